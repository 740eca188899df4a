/* Unit normals from tangents. */
#ifndef TWEEND_NORMAL_H
#define TWEEND_NORMAL_H

#include "tweend/base.h"

/* Float can normalise a cross product whose squared length lies between tw_normal_least_square and this: it
 * does not overflow, nor is it rounding alone. lengths: at least the product of the tangents' squared
 * lengths. */
#define TW_NORMAL_SQUARE_MAX 1e24f
#define TW_NORMAL_SQUARE_MIN 1e-24f
#define TW_NORMAL_PARALLEL   1e-6f
static inline float tw_normal_least_square(float lengths) {
  return lengths * TW_NORMAL_PARALLEL > TW_NORMAL_SQUARE_MIN ? lengths * TW_NORMAL_PARALLEL
                                                             : TW_NORMAL_SQUARE_MIN;
}

/* Unit normal of two tangents; `quad` (four points) serves where they are parallel, and +Y where that has
 * none either. */
void tw_normal_from_tangents(const float tangent1[3], const float tangent2[3], const float *const quad[4],
                             float normal[3]);

#endif
