/* Weights of the uniform cubic B-spline at the points that `depth` subdivisions put on one segment. */
#ifndef TWEEND_SPLINE_H
#define TWEEND_SPLINE_H

#include "tweend/base.h"

/* Each: [2^depth + 1][4], weights of the control points -1, 0, 1, 2 of the segment. */
typedef struct tw_spline {
  const float (*point)[4];      /* the refined control point */
  const float (*limit)[4];      /* its limit */
  const float (*derivative)[4]; /* direction of the limit's tangent */
} tw_spline;

/* Tables for depths 0 to TW_LEVEL_MAX, made once, shared by all threads. NULL without memory. */
const tw_spline *tw_spline_table(uint32_t depth);

#endif
