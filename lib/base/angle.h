/* Pi, and angles in degrees. */
#ifndef TWEEND_ANGLE_H
#define TWEEND_ANGLE_H

#define TW_PI     3.14159265358979323846
#define TW_DEGREE (TW_PI / 180) /* in radians */

#endif
