/* Pi, and angles in degrees. */
#ifndef TWEEND_ANGLE_H
#define TWEEND_ANGLE_H

#define TW_PI      3.14159265358979323846
#define TW_RADIANS (TW_PI / 180) /* in a degree; TW_DEGREES, in a radian, is public (tweend/anim.h) */

#endif
