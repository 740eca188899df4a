/* Points of irregular patches straight from their control points, without a step on the way: where many
 * patches share a class and the grid is small, what each of its points takes from each control point is worth
 * keeping. */
#ifndef TWEEND_STENCIL_H
#define TWEEND_STENCIL_H

#include "shape.h"

enum { TW_STENCIL_CONTROLS_MAX = 128 };

/* Weights of one class. Points of the grid lie in sections, one after the other: the corners, the insides of
 * the four sides, the inside, each row by row of its own rectangle. */
typedef struct tw_stencil {
  uint32_t control_count; /* even: a last one may weigh nothing */
  uint32_t apart;         /* points, and some more so that vectors can be read from each */
  const float *values;    /* [control_count][apart] */
  /* Of any two tangents whose cross product points outward, each to a scale of its own at each point, at
   * which its weights' absolute values sum to 1 or less; NULL where no normals are asked for. */
  const float *tangents[2];
} tw_stencil;

/* What stencils are made for. scratch_points: of patches of the depth. */
typedef struct tw_stencil_wish {
  uint32_t depth, scratch_points;
  bool limit, normals;
} tw_stencil_wish;

/* Makes one that lives in the arena. TW_NO_MEMORY. */
tw_status tw_stencil_make(tw_patch_class *shape, const tw_stencil_wish *wish, tw_arena *arena,
                          tw_stencil *out);

/* Has those patches summed whose classes are common or many of the patches share, where the depth allows.
 * shapes: those of the patches. limit: as all jobs that want values will have it. normals: these will be
 * asked for too. TW_NO_MEMORY; TW_LIMIT: others who share the classes have left no room. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals);

/* controls: [control_count], relative to `origin`; width: 2 to 4, the rest is 0. values and normals, each
 * NULL where not wanted: where those of the first point go; step: to the next, in floats. */
typedef struct tw_stencil_job {
  const tw_stencil *stencil;
  uint32_t first, count;
  const float (*controls)[4];
  float origin[4];
  uint32_t width;
  float *values, *normals;
  ptrdiff_t step;
} tw_stencil_job;

/* With the best instruction set that this machine has. False when float does not suffice for all normals:
 * those that it wrote mean nothing then. */
bool tw_stencil_rows(const tw_stencil_job *job);

/* A rectangle of the grid of a stencil for `depth`. job: without first and count; line_step: to the next
 * line. */
bool tw_stencil_rect(const tw_stencil_job *job, uint32_t depth, tw_patch_rect rect, ptrdiff_t line_step);

/* With each instruction set that this machine has, as tw_spline_rows_by. */
bool tw_stencil_rows_by(uint32_t instruction_set, const tw_stencil_job *job, bool *sure);

/* ---- for the kernels alone ------------------------------------------------------------------ */

#ifdef __x86_64__
bool tw_stencil_fill_avx2(const tw_stencil_job *job);
bool tw_stencil_fill_avx512(const tw_stencil_job *job);
#endif

#endif
