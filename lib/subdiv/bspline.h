/* Uniform cubic B-splines: their weights at the points that `depth` subdivisions put on one segment, and rows
 * of points of regular patches. */
#ifndef TWEEND_BSPLINE_H
#define TWEEND_BSPLINE_H

#include "simd.h"
#include "tweend/base.h"

/* Each array: [2^depth + 1], a weight for all components. Aligned, as arrays lie behind it. */
typedef struct tw_spline {
  _Alignas(tw_point)
      const tw_point *point[4]; /* of control points -1, 0, 1, 2 of the segment: the refined control point */
  const tw_point *limit[4];     /* its limit */
  const tw_point *slope[3];     /* of their differences: the limit's derivative over the segment */
} tw_spline;

/* Tables for depths 0 to `depth` in one block of memory, which free() frees. NULL without memory. */
tw_spline *tw_spline_tables_create(uint32_t depth);
size_t tw_spline_tables_size(uint32_t depth);

/* ---- rows of points ----------------------------------------------------------------------------- */

/* A rectangle of a patch's grid, bounds included. */
typedef struct tw_patch_rect {
  uint32_t i0, i1, j0, j1;
} tw_patch_rect;

/* points: [16] control points, rows of four along i, relative to `origin`; width: 1 to 4, the rest is 0.
 * values, normals and derivatives, each NULL where not wanted, are as tw_patch_job has them: where those of
 * point (i0, j0) go. step and line_step lead to the next point along i and along j, in floats. column: a
 * single point is summed up in the order of those of its column. */
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
