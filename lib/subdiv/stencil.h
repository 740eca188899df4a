/* Points of irregular patches straight from their control points: a stencil holds what each point of a small
 * grid takes from each control point. */
#ifndef TWEEND_STENCIL_H
#define TWEEND_STENCIL_H

#include "bspline.h"

enum { TW_STENCIL_CONTROLS_MAX = 128 };

/* The weights of the control points of one class of patches, at all points of its grid in this order: the
 * corners, the points inside of the four sides, the points inside of the patch line by line. */
typedef struct tw_stencil {
  uint32_t control_count; /* even: a last one may weigh nothing */
  uint32_t stride;        /* of points: some more than there are, which weigh nothing */
  const float *values;    /* [control_count][stride] */
  /* Of any two tangents whose cross product points outward, each to a scale of its own at each point, at
   * which its weights' absolute values sum to 1 or less; NULL where no normals are asked for.
   * [control_count][2][stride] */
  const float *tangents;
} tw_stencil;

/* Where a point of a grid of n^2 cells is among those of a stencil. */
static inline uint32_t tw_stencil_place(uint32_t n, uint32_t i, uint32_t j) {
  bool is_end_of_line = i == 0 || i == n, is_end_line = j == 0 || j == n;
  if (is_end_of_line && is_end_line) return 2u * (j > 0) + (i > 0);
  if (is_end_line) return 4 + (j > 0 ? n - 1 : 0) + i - 1;
  if (is_end_of_line) return 4 + (i > 0 ? 3 : 2) * (n - 1) + j - 1;
  return 4 * n + (j - 1) * (n - 1) + i - 1;
}

/* controls: [control_count], relative to `origin`; width: 1 to 4, the rest is 0. values and normals, each
 * NULL where not wanted: where those of the first point go; step: floats to the next. */
typedef struct tw_stencil_job {
  const tw_stencil *stencil;
  const tw_point *controls;
  tw_point origin;
  uint32_t width;
  float *values, *normals;
  ptrdiff_t step;
} tw_stencil_job;

/* Points of a stencil from place `first` on. False when float does not suffice for all normals: those that it
 * wrote mean nothing then. */
bool tw_stencil_rows(const tw_stencil_job *job, size_t first, size_t count);

#endif
