/* Uniform cubic B-splines: tables of weights at the 2^depth + 1 points that `depth` subdivisions put on one
 * segment, and rows of points of regular patches. */
#ifndef TWEEND_BSPLINE_H
#define TWEEND_BSPLINE_H

#include "simd.h"
#include "tweend/base.h"

/* Each array: [2^depth + 1], the weight repeated in all four components. Aligned, because the tw_point tables
 * follow the structs in the same block. */
typedef struct tw_spline {
  /* Weights of control points -1, 0, 1, 2 of the segment: for the refined control point and its limit. */
  _Alignas(tw_point) const tw_point *point[4];
  const tw_point *limit[4];
  /* Weights of the control points' differences: for the limit's derivative over the segment. */
  const tw_point *slope[3];
} tw_spline;

/* Tables for depths 0 to `depth`, indexed by depth, in one block of memory for free(). NULL without
 * memory. */
tw_spline *tw_spline_tables_create(uint32_t depth);
size_t tw_spline_tables_size(uint32_t depth);

/* ---- rows of points -------------------------------------------------------------------------- */

/* A rectangle of a patch's grid, bounds included. */
typedef struct tw_patch_rect {
  uint32_t i0, i1, j0, j1;
} tw_patch_rect;

/* points: [16] control points, rows of four along i, relative to `origin`. width: 1 to 4 components; further
 * ones are 0.
 * values, normals and derivatives: NULL where not wanted, else where point (i0, j0) goes; their content is as
 * in tw_patch_job. step and line_step: floats to the next point along i and along j.
 * column: a single point is summed in the same order as when it is part of its column. */
typedef struct tw_spline_job {
  const tw_spline *spline;
  const tw_point *points;
  tw_point origin;
  uint32_t width;
  bool limit, column;
  tw_patch_rect rect;
  float *values, *normals, *derivatives;
  ptrdiff_t step, line_step;
} tw_spline_job;

void tw_spline_rows(const tw_spline_job *job);

#endif
