/* Points of irregular patches straight from their control points, without a step on the way: where many
 * patches share a class and the grid is small, what each of its points takes from each control point is worth
 * keeping. */
#ifndef TWEEND_STENCIL_H
#define TWEEND_STENCIL_H

#include "shape.h"

enum {
  TW_STENCIL_CONTROLS_MAX = 128,
  TW_STENCIL_BLOCK = 16 /* points; no vector holds more */
};

/* Weights of one class, a block of points after the other, so that they are read in the order in which they
 * lie in memory. Which points these are: see stencil_sections.h. Unused places weigh nothing. */
typedef struct tw_stencil {
  uint32_t control_count; /* even: a last one may weigh nothing */
  const float *values;    /* [blocks][control_count][TW_STENCIL_BLOCK] */
  /* Of any two tangents whose cross product points outward, each to a scale of its own at each point, at
   * which its weights' absolute values sum to 1 or less; NULL where no normals are asked for.
   * [blocks][control_count][2][TW_STENCIL_BLOCK] */
  const float *tangents;
} tw_stencil;

/* What stencils are made for. scratch_points: of patches of the depth. */
typedef struct tw_stencil_wish {
  uint32_t depth, scratch_points;
  bool limit, normals;
} tw_stencil_wish;

/* Makes one that lives in the arena. TW_NO_MEMORY. */
tw_status tw_stencil_make(tw_patch_class *shape, const tw_stencil_wish *wish, tw_arena *arena,
                          tw_stencil *out);

/* Has those patches summed whose classes many of the patches share, where the depth allows.
 * shapes: those of the patches. limit: as all jobs that want values will have it. normals: these will be
 * asked for too. TW_NO_MEMORY; TW_LIMIT: others who share the classes have left no room. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals);

/* Lines of points. controls: [control_count], relative to `origin`; width: 2 to 4, the rest is 0. values and
 * normals, each NULL where not wanted: where those of the first point go. step and line_step lead to the next
 * point and the next line, in floats. */
typedef struct tw_stencil_job {
  const tw_stencil *stencil;
  uint32_t first, count, lines, apart; /* places: lines of `count` points begin `apart` from each other */
  const float (*controls)[4];
  float origin[4];
  uint32_t width;
  float *values, *normals;
  ptrdiff_t step, line_step;
} tw_stencil_job;

/* With the best instruction set that this machine has. False when float does not suffice for all normals:
 * those that it wrote mean nothing then. */
bool tw_stencil_rows(const tw_stencil_job *job);

/* A rectangle of the grid of a stencil for `depth`. job: without its places. */
bool tw_stencil_rect(const tw_stencil_job *job, uint32_t depth, tw_patch_rect rect);

/* ---- for the kernels alone ------------------------------------------------------------------ */

#ifdef __x86_64__
bool tw_stencil_fill_avx2(const tw_stencil_job *job);
#endif

#endif
