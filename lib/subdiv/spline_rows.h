/* Rows of points of regular patches: lines of bicubic B-splines, a few points at a time. */
#ifndef TWEEND_SPLINE_ROWS_H
#define TWEEND_SPLINE_ROWS_H

#include "spline.h"

/* A rectangle of a patch's grid, bounds included. */
typedef struct tw_patch_rect {
  uint32_t i0, i1, j0, j1;
} tw_patch_rect;

/* points: [16] control points, rows of four along i, relative to `origin`; width: 2 to 4, the rest is 0.
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
