/* Points of irregular patches straight from their control points: a stencil holds what each point of a small
 * grid takes from each control point. */
#ifndef TWEEND_STENCIL_H
#define TWEEND_STENCIL_H

#include "bspline.h"

enum {
  TW_STENCIL_CONTROLS_MAX = 128,
  TW_STENCIL_BLOCK = 16 /* points; no vector holds more */
};

/* Weights of one class, a block of points after the other, so that they are read in the order in which they
 * lie in memory. Which points these are: see the sections below. Unused places weigh nothing. */
typedef struct tw_stencil {
  uint32_t control_count; /* even: a last one may weigh nothing */
  const float *values;    /* [blocks][control_count][TW_STENCIL_BLOCK] */
  /* Of any two tangents whose cross product points outward, each to a scale of its own at each point, at
   * which its weights' absolute values sum to 1 or less; NULL where no normals are asked for.
   * [blocks][control_count][2][TW_STENCIL_BLOCK] */
  const float *tangents;
} tw_stencil;

/* Lines of points. controls: [control_count], relative to `origin`; width: 1 to 4, the rest is 0. values and
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

/* ---- sections: where the points of a grid lie in a stencil, each a rectangle, line by line ------ */

/* Corners 0 to 3, the insides of sides 0 to 3, the inside. Where lines are as wide as a block, sides and the
 * inside reach up to the corners and sides behind them, so that a line fills its block whether it ends before
 * these or not: of these there is only the side that is a column. */
enum { TW_SECTION_SIDES = 4, TW_SECTION_COLUMN = 5, TW_SECTION_INSIDE = 8, TW_SECTIONS = 9 };

static inline bool tw_sections_reach(uint32_t n) {
  return n == TW_STENCIL_BLOCK;
}

/* Points of a line of the inside of a grid of n cells. */
static inline uint32_t tw_section_line(uint32_t n) {
  return tw_sections_reach(n) ? n : n - 1;
}

/* False where there is no such section. */
static inline bool tw_section_rect(uint32_t n, uint32_t section, tw_patch_rect *rect) {
  bool right = section == 1 || section == 2 || section == 5,
       upper = section == 2 || section == 3 || section == 6;
  uint32_t i = right ? n : 0, j = upper ? n : 0, last = tw_section_line(n);
  *rect = (tw_patch_rect){i, i, j, j};
  if (section == 4 || section == 6 || section == 8) rect->i0 = 1, rect->i1 = last;
  if (section == 5 || section >= 7) rect->j0 = 1, rect->j1 = last;
  return !tw_sections_reach(n) || section == TW_SECTION_COLUMN || !(right || upper);
}

/* The place of its first point: no side lies in two blocks, and the inside begins a block. */
static inline uint32_t tw_section_first(uint32_t n, uint32_t section) {
  uint32_t sides = n < 4 ? 4 : n, inside = sides + 4 * n;
  if (section < TW_SECTION_SIDES) return section;
  if (section < TW_SECTION_INSIDE) return sides + (section - TW_SECTION_SIDES) * n;
  return (inside + TW_STENCIL_BLOCK - 1) / TW_STENCIL_BLOCK * TW_STENCIL_BLOCK;
}

/* Blocks of all. */
static inline uint32_t tw_section_blocks(uint32_t n) {
  uint32_t line = tw_section_line(n), end = tw_section_first(n, TW_SECTION_INSIDE) + line * line;
  return (end + TW_STENCIL_BLOCK - 1) / TW_STENCIL_BLOCK;
}

#endif
