/* Uniform cubic B-splines: their weights at the points that `depth` subdivisions put on one segment, and rows
 * of points of regular patches. */
#ifndef TWEEND_BSPLINE_H
#define TWEEND_BSPLINE_H

#include "tweend/base.h"

/* Weights are read so many at a time, or fewer. */
enum { TW_SPLINE_LANES = 16 };

/* Each array: [2^depth + 1], and TW_SPLINE_LANES - 1 more that repeat the last. */
typedef struct tw_spline {
  const float *point[4]; /* of control points -1, 0, 1, 2 of the segment: the refined control point */
  const float *limit[4]; /* its limit */
  const float *slope[3]; /* of their differences: the limit's derivative over the segment */
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
  const float (*points)[4];
  float origin[4];
  uint32_t width;
  bool limit, column;
  tw_patch_rect rect;
  float *values, *normals, *derivatives;
  ptrdiff_t step, line_step;
} tw_spline_job;

/* With the best instruction set that this machine has. */
void tw_spline_rows(const tw_spline_job *job);

/* ---- for the kernels alone ------------------------------------------------------------------ */

/* transposed: i and j of the patch have changed places. */
#ifdef __x86_64__
void tw_spline_fill_avx2(const tw_spline_job *job, bool transposed);
#endif

/* Normals of `count` points of line j one by one, by the kernels' arithmetic where that suffices. out: where
 * that of the first goes. */
void tw_spline_look_closer(const tw_spline_job *job, size_t first, size_t count, size_t j, bool transposed,
                           float *out);

#endif
