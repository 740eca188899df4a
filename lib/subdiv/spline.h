/* Weights of the uniform cubic B-spline at the points that `depth` subdivisions put on one segment. */
#ifndef TWEEND_SPLINE_H
#define TWEEND_SPLINE_H

#include "tweend/base.h"

/* Points are computed so many at a time, or fewer. */
enum { TW_SPLINE_LANES = 16 };

/* Each array: [2^depth + 1], and TW_SPLINE_LANES - 1 more that repeat the last. */
typedef struct tw_spline {
  const float *point[4]; /* of control points -1, 0, 1, 2 of the segment: the refined control point */
  const float *limit[4]; /* its limit */
  const float *slope[3]; /* of their differences: the limit's derivative over the segment */
} tw_spline;

/* Tables for depths 0 to TW_LEVEL_MAX, made once, shared by all threads. NULL without memory. */
const tw_spline *tw_spline_table(uint32_t depth);

#endif
