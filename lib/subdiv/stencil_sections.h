/* Where the points of a grid lie in a stencil: in sections, each a rectangle, line by line. */
#ifndef TWEEND_STENCIL_SECTIONS_H
#define TWEEND_STENCIL_SECTIONS_H

#include "stencil.h"

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
