/* Loops that fill in rows of a shallow level, whatever the rows are. What they are made of lies anywhere
 * where the cage's faces come in any order: it is asked for some rows ahead. */
#ifndef TWEEND_SHALLOW_KERNEL_H
#define TWEEND_SHALLOW_KERNEL_H

#include "point.h"
#include "shallow.h"

/* A level as what its points are made of: the cage and its points or, for level 2, the points of level 1 and
 * the middles of its quads. */
typedef struct level {
  tw_topology cage;
  tw_rules rules;
  uint32_t middles, face_points; /* first vertex of level 1 in the middle of an edge, of a face */
  const float *points, *centres;
} level;

static inline const float *point_row(const level *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}
static inline const float *centre_row(const level *l, uint32_t face) {
  return l->centres + 3 * (size_t)face;
}
static inline tw_point point(const level *l, uint32_t vertex) {
  return tw_load_point(point_row(l, vertex));
}
static inline tw_point centre(const level *l, uint32_t face) {
  return tw_load_point(centre_row(l, face));
}

/* Rows of an item: one, or those of an edge or a triangle, which have much in common. */
enum { ITEM_MAX = 3 };
typedef void rows_of(const level *l, uint32_t item, tw_point *rows);

/* Asks for what two items will need: for what one that comes soon is made of, and for what tells where that
 * is of one that comes later. */
enum { AHEAD = 24 };
typedef void prefetch_of(const level *l, uint32_t soon, uint32_t later);

static inline void prefetch_nothing(const level *l, uint32_t soon, uint32_t later) {
  (void)l;
  (void)soon;
  (void)later;
}

/* Rows [begin, end) of a kind of which each item has `step`. triangles: all faces are, which is known where
 * this is inlined, so that nothing of them has to be looked up. */
static inline __attribute__((always_inline)) void fill_items(const level *l, rows_of *rows_at,
                                                             prefetch_of *prefetch, uint32_t step,
                                                             bool triangles, uint32_t begin, uint32_t end,
                                                             float *restrict out) {
  if (begin == end) return;
  level own = *l; /* which no row that is stored can be taken to change */
  if (triangles) {
    own.cage.face_size = 3;
    own.cage.face_offsets = NULL;
  }
  uint32_t last = (end - 1) / step;
  for (uint32_t item = begin / step; item <= last; item++) {
    if (last - item >= 2 * AHEAD) prefetch(&own, item + AHEAD, item + 2 * AHEAD);
    tw_point rows[ITEM_MAX];
    rows_at(&own, item, rows);
    uint32_t at = item * step;
    if (step == 1 || (at >= begin && end - at >= step)) {
      for (uint32_t k = 0; k + 1 < step; k++, out += 3) tw_store_inner_point(rows[k], out);
      tw_store_point(rows[step - 1], out);
      out += 3;
      continue;
    }
    for (uint32_t k = 0; k < step; k++) { /* the first item or the last one, in part */
      if (at + k < begin || at + k >= end) continue;
      tw_store_point(rows[k], out);
      out += 3;
    }
  }
}

static inline __attribute__((always_inline)) void fill_rows(const level *l, rows_of *rows_at,
                                                            prefetch_of *prefetch, uint32_t step,
                                                            uint32_t begin, uint32_t end,
                                                            float *restrict out) {
  if (l->cage.face_size == 3)
    fill_items(l, rows_at, prefetch, step, true, begin, end, out);
  else
    fill_items(l, rows_at, prefetch, step, false, begin, end, out);
}

/* The same of kinds that have a row for each corner: a face at a time where all are triangles. */
static inline __attribute__((always_inline)) void fill_corners(const level *l, rows_of *of_corner,
                                                               rows_of *of_triangle,
                                                               prefetch_of *prefetch_triangle, uint32_t begin,
                                                               uint32_t end, float *restrict out) {
  if (l->cage.face_size == 3)
    fill_items(l, of_triangle, prefetch_triangle, 3, true, begin, end, out);
  else
    fill_items(l, of_corner, prefetch_nothing, 1, false, begin, end, out);
}

/* Writes rows [begin, end) of some kind, or of all. */
typedef void fill_of(const level *l, uint32_t begin, uint32_t end, float *restrict out);

/* Rows of one kind, as they follow each other in a level. */
typedef struct kind {
  fill_of *fill;
  uint32_t count;
} kind;

static inline void fill_kinds(const level *l, const kind *kinds, uint32_t first, uint32_t end, float *out) {
  for (uint32_t begin = 0; first < end; begin += kinds++->count) {
    uint32_t stop = end - begin < kinds->count ? end : begin + kinds->count;
    if (first >= stop) continue;
    kinds->fill(l, first - begin, stop - begin, out);
    out += 3 * (size_t)(stop - first);
    first = stop;
  }
}

#endif
