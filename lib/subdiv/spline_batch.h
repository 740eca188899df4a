/* The same rectangle of several regular patches at once, a patch a lane: where lines are shorter than
 * vectors. */
#ifndef TWEEND_SPLINE_BATCH_H
#define TWEEND_SPLINE_BATCH_H

#include "spline_rows.h"

/* Points of width 3, and their normals next to them where these are wanted. */
typedef struct tw_spline_batch {
  const tw_spline *spline;
  bool limit, normals;
  tw_patch_rect rect;
  ptrdiff_t step;                       /* from row to row, in floats */
  uint32_t count;                       /* patches, TW_SPLINE_LANES at most */
  float *rows[TW_SPLINE_LANES];         /* where the first row of each goes, all others behind it */
  float outward[TW_SPLINE_LANES];       /* 1, or -1 where the control points are a mirror image */
  float points[16][3][TW_SPLINE_LANES]; /* control points, in rows of four along i; unused ones are finite */
} tw_spline_batch;

/* With the best instruction set that this machine has. The bytes are those of tw_spline_rows. Returns the
 * patches, a bit each, for whose normals float does not suffice: those that it wrote mean nothing. */
uint32_t tw_spline_batch_rows(const tw_spline_batch *batch);

/* ---- for the kernels alone ------------------------------------------------------------------ */

#ifdef __x86_64__
uint32_t tw_spline_batch_fill_avx2(const tw_spline_batch *batch);
#endif

#endif
