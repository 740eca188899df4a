/* Unit normals from tangents. No product is contracted and no root is approximated, so that all machines give
 * the same bytes. */
#ifndef TWEEND_NORMAL_H
#define TWEEND_NORMAL_H

#include <math.h>

#include "simd.h"
#include "tweend/base.h"

/* Float can normalise a cross product whose squared length lies between tw_normal_least_square and
 * TW_NORMAL_SQUARE_MAX: within these bounds it does not overflow and is more than rounding error. lengths: at
 * least the product of the tangents' squared lengths. */
#define TW_NORMAL_SQUARE_MAX 1e24f
#define TW_NORMAL_SQUARE_MIN 1e-24f
#define TW_NORMAL_PARALLEL   1e-6f
static inline float tw_normal_least_square(float lengths) {
  return lengths * TW_NORMAL_PARALLEL > TW_NORMAL_SQUARE_MIN ? lengths * TW_NORMAL_PARALLEL
                                                             : TW_NORMAL_SQUARE_MIN;
}

static inline __attribute__((always_inline)) tw_point tw_point_cross(tw_point a, tw_point b) {
  tw_point a_turned = __builtin_shufflevector(a, a, 1, 2, 0, 3),
           b_turned = __builtin_shufflevector(b, b, 1, 2, 0, 3), c = a * b_turned - a_turned * b;
  return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}
static inline __attribute__((always_inline)) float tw_point_square(tw_point a) {
  tw_point s = a * a;
  return s[0] + s[1] + s[2];
}
/* Scales a vector to length 1. square: its squared length. Adding 0 turns -0 into 0, so that a rotated patch
 * has the same normals. */
static inline __attribute__((always_inline)) tw_point tw_point_unit(tw_point vector, float square) {
  return vector * (1 / sqrtf(square)) + 0.0f;
}

/* As tw_put_normal, but slower and for any tangents: in double. */
void tw_careful_normal(tw_point tangent1, tw_point tangent2, const tw_point quad[4], float normal[3]);

/* Writes the unit normal of two tangents. Where they are parallel the normal comes from the diagonals of
 * `quad` (four points); where those are parallel too, it is +Y. */
static inline __attribute__((always_inline)) void tw_put_normal(tw_point tangent1, tw_point tangent2,
                                                                const tw_point quad[4], float normal[3]) {
  tw_point n = tw_point_cross(tangent1, tangent2);
  float square = tw_point_square(n),
        least = tw_normal_least_square(tw_point_square(tangent1) * tw_point_square(tangent2));
  if (__builtin_expect(square > least && square < TW_NORMAL_SQUARE_MAX, 1))
    tw_store_point(tw_point_unit(n, square), normal);
  else
    tw_careful_normal(tangent1, tangent2, quad, normal);
}

#endif
