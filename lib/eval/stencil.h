/* Points of irregular patches, directly from their control points: a stencil holds the weight of each control
 * point at each point of a small grid. */
#ifndef TWEEND_STENCIL_H
#define TWEEND_STENCIL_H

#include "bspline.h"

enum { TW_STENCIL_CONTROLS_MAX = 128 };

/* The weights of the control points of one class of patches. Points of the grid are in this order: the
 * corners, the insides of the four sides, the inside of the patch line by line. */
typedef struct tw_stencil {
  /* Even: padded with a control point of weight 0 where the class has an odd number. */
  uint32_t control_count;
  /* Floats from one control point's weights to the next's: room for all points, padded with weights 0. */
  uint32_t stride;
  const float *values; /* [control_count][stride] */
  /* Weights of two tangents at each point whose cross product points outward; NULL where no normals are asked
   * for. Each tangent has a scale of its own, with which its weights' absolute values sum to at most 1.
   * [control_count][2][stride] */
  const float *tangents;
} tw_stencil;

/* The index of point (i, j) of a grid of n^2 cells in a stencil's order. */
static inline uint32_t tw_stencil_place(uint32_t n, uint32_t i, uint32_t j) {
  bool is_end_of_line = i == 0 || i == n, is_end_line = j == 0 || j == n;
  if (is_end_of_line && is_end_line) return 2u * (j > 0) + (i > 0);
  if (is_end_line) return 4 + (j > 0 ? n - 1 : 0) + i - 1;
  if (is_end_of_line) return 4 + (i > 0 ? 3 : 2) * (n - 1) + j - 1;
  return 4 * n + (j - 1) * (n - 1) + i - 1;
}

/* Controls: [control_count], relative to `origin`. width: 1 to 4 components; further ones are 0. values and
 * normals: NULL where not wanted, else where those of the first point go. step: floats to the next point. */
typedef struct tw_stencil_job {
  const tw_stencil *stencil;
  const tw_point *controls;
  tw_point origin;
  uint32_t width;
  float *values, *normals;
  ptrdiff_t step;
} tw_stencil_job;

/* Computes `count` points of a stencil from index `first` on. Returns false when float is not precise enough
 * for all normals; the normals written are then invalid. */
bool tw_stencil_rows(const tw_stencil_job *job, size_t first, size_t count);

#endif
