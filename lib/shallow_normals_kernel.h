/* Rows of shallow surfaces with normals, in vectors as wide as the compiler may use: each file that includes
 * this is compiled for another instruction set. Tangents of polygons are found row by row, those of level 2
 * of triangles LANES items at a time; kinds of rows that look at the same things are made together. */
#ifndef TWEEND_SHALLOW_NORMALS_KERNEL_H
#define TWEEND_SHALLOW_NORMALS_KERNEL_H

#include "normal_rows.h"
#include "shallow_tangents.h"
#include "shallow_triangles.h"

/* ---- rows ----------------------------------------------------------------------------------- */

/* Normals of rows [from, to) one by one, some of which take care. */
static __attribute__((noinline)) void look_at_each(const tw_shallow_level *l, const tw_shallow_rows *j,
                                                   rows_of *find, uint32_t step, uint32_t from, uint32_t to) {
  float *normal = j->out + NORMAL_ROW * (size_t)(from - j->begin) + 3;
  for (uint32_t i = from; i < to; i++, normal += NORMAL_ROW) {
    row rows[3];
    find(l, i / step, rows);
    const row *r = &rows[i % step];
    tw_normal_from_tangents((const float *)&r->along[0], (const float *)&r->along[1], r->quad, normal);
  }
}

/* Hands out a copy of the level: nobody can be taken to change the one that the rows are found by. */
static inline __attribute__((always_inline)) void take_care(const tw_shallow_level *l,
                                                            const tw_shallow_rows *j, rows_of *find,
                                                            uint32_t step, uint32_t from, uint32_t to) {
  tw_shallow_level copy = *l;
  look_at_each(&copy, j, find, step, from, to);
}

/* Rows of which each item has `step`, 1 to 3. */
static inline __attribute__((always_inline)) void fill(const tw_shallow_level *l, const tw_shallow_rows *j,
                                                       rows_of *find, uint32_t step) {
  float *restrict out = j->out;
  normal_batch b;
  for (uint32_t first = j->begin - j->begin % step; first < j->end; first += NORMAL_BATCH) {
    uint32_t from = first < j->begin ? j->begin - first : 0,
             to = j->end - first < NORMAL_BATCH ? j->end - first : NORMAL_BATCH;
    tw_point *place = b.along, *stop = place + to;
    for (uint32_t item = first / step; place < stop; item++, place += step) {
      row rows[3];
      find(l, item, rows);
      for (uint32_t r = 0; r < step; r++) put_tangents(rows[r].along, place + r);
    }
    if (!put_normal_rows(&b, from, to, j->points + 3 * (size_t)first, out))
      take_care(l, j, find, step, first + from, first + to);
    out += NORMAL_ROW * (size_t)(to - from);
  }
}

/* Few rows. */
static __attribute__((noinline)) void fill_few(const tw_shallow_level *l, const tw_shallow_rows *j,
                                               rows_of *find, uint32_t step) {
  fill(l, j, find, step);
}

/* ---- triangles ------------------------------------------------------------------------------ */

/* Rows that items have of a kind: how many, and how those of one item are found. */
typedef struct family {
  uint32_t step;
  rows_of *find;
} family;

/* How tangents of LANES items are. */
typedef struct lanes {
  find_from *look;
  tangents_from *find;
} lanes;

/* Items. */
typedef struct span {
  uint32_t begin, end;
} span;

/* Those of which all rows are asked for. */
static inline span whole_items(const tw_shallow_rows *j, uint32_t step) {
  return (span){(uint32_t)(((uint64_t)j->begin + step - 1) / step), j->end / step};
}

/* Whether every lane can have one; and offsets must be within 32 bits. */
static inline bool fills_lanes(const tw_shallow_level *l, span items) {
  return items.end > items.begin && items.end - items.begin >= LANES &&
         l->cage.corner_count <= UINT32_MAX / 3;
}

static inline tw_shallow_rows part_of(const tw_shallow_rows *j, uint32_t begin, uint32_t end) {
  return (tw_shallow_rows){j->points, begin, end, j->out + NORMAL_ROW * ((size_t)begin - j->begin)};
}

/* All rows of some items, LANES at a time, be they of one kind or of two that look at the same things. The
 * last ones are found again with some before them, so that every lane has an item. */
static inline __attribute__((always_inline)) void fill_span(const tw_shallow_level *l, span items, lanes by,
                                                            const tw_shallow_rows *const jobs[],
                                                            const family kinds[], uint32_t kind_count) {
  offsets about[2];
  uint32_t last = items.end - LANES, item = items.begin, n = 0;
  by.look(l, item, &about[0]);
  for (bool more = true; more; n = 1 - n) {
    uint32_t next = last - item > LANES ? item + LANES : last;
    tangents found[6], *rows = found;
    more = item < last;
    if (more) by.look(l, next, &about[1 - n]);
    by.find(l, item, &about[n], rows);
    for (uint32_t k = 0; k < kind_count; rows += kinds[k++].step) {
      const tw_shallow_rows *j = jobs[k];
      uint32_t step = kinds[k].step, first = item * step;
      bool sure = put_items(rows, j->points + 3 * (size_t)first, step,
                            j->out + NORMAL_ROW * (size_t)(first - j->begin));
      if (!sure) take_care(l, j, kinds[k].find, step, first, first + step * LANES);
    }
    item = next;
  }
}

/* Rows of a kind; few where an item is not whole. */
static inline __attribute__((always_inline)) void fill_kind(const tw_shallow_level *l,
                                                            const tw_shallow_rows *j, family kind, lanes by) {
  span items = whole_items(j, kind.step);
  if (!fills_lanes(l, items)) {
    fill_few(l, j, kind.find, kind.step);
    return;
  }
  tw_shallow_rows before = part_of(j, j->begin, items.begin * kind.step),
                  behind = part_of(j, items.end * kind.step, j->end);
  fill_few(l, &before, kind.find, kind.step);
  fill_span(l, items, by, &j, &kind, 1);
  fill_few(l, &behind, kind.find, kind.step);
}

typedef void fill_rows_of(const tw_shallow_level *l, const tw_shallow_rows *j);

/* Rows of two kinds: together where both are asked for, what is left of either alone. */
static inline __attribute__((always_inline)) void fill_both(const tw_shallow_level *l,
                                                            const tw_shallow_rows *const jobs[2],
                                                            const family kinds[2], lanes by,
                                                            fill_rows_of *const alone[2]) {
  span a = whole_items(jobs[0], kinds[0].step), b = whole_items(jobs[1], kinds[1].step),
       items = {a.begin > b.begin ? a.begin : b.begin, a.end < b.end ? a.end : b.end};
  bool together = fills_lanes(l, items);
  if (together) fill_span(l, items, by, jobs, kinds, 2);
  for (uint32_t k = 0; k < 2; k++) {
    uint32_t middle = together ? items.begin * kinds[k].step : jobs[k]->end;
    tw_shallow_rows before = part_of(jobs[k], jobs[k]->begin, middle);
    alone[k](l, &before);
    if (!together) continue;
    tw_shallow_rows behind = part_of(jobs[k], items.end * kinds[k].step, jobs[k]->end);
    alone[k](l, &behind);
  }
}

static const family middles = {1, level_2_middle}, both_halves = {2, level_2_halves},
                    spokes = {3, level_2_spokes}, centres = {3, level_2_centres};

static __attribute__((noinline)) void fill_middles(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, middles, (lanes){find_middles, edges_2});
}
static __attribute__((noinline)) void fill_halves(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, both_halves, (lanes){find_both_halves, halves_2});
}
static __attribute__((noinline)) void fill_spokes(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, spokes, (lanes){find_corners, spokes_2});
}
static __attribute__((noinline)) void fill_centres(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, centres, (lanes){find_corners, centres_2});
}

/* Single rows are found by a copy, to which the compiler binds all that asks for the size of a face: nobody
 * else is told of it, so that no call and no row that is stored can be taken to change it. */
static void fill_triangles(const tw_shallow_level *level_at, const tw_shallow_rows *rows) {
  tw_shallow_level own = *level_at;
  const tw_shallow_level *l = &own;
  own.cage.face_size = 3;
  own.cage.face_offsets = NULL;
  if (l->number == 1) {
    fill(l, &rows[TW_SHALLOW_VERTICES], level_1_vertex, 1);
    fill(l, &rows[TW_SHALLOW_EDGES], level_1_middle, 1);
    fill(l, &rows[TW_SHALLOW_FACES], level_1_face, 1);
    return;
  }
  fill(l, &rows[TW_SHALLOW_VERTICES], level_2_vertex, 1);
  fill_kind(level_at, &rows[TW_SHALLOW_FACES], (family){1, level_2_face}, (lanes){find_in_turn, faces_2});
  fill_both(level_at, (const tw_shallow_rows *const[2]){&rows[TW_SHALLOW_EDGES], &rows[TW_SHALLOW_HALVES]},
            (const family[2]){middles, both_halves}, (lanes){find_both_halves, whole_edges_2},
            (fill_rows_of *const[2]){fill_middles, fill_halves});
  fill_both(level_at, (const tw_shallow_rows *const[2]){&rows[TW_SHALLOW_SPOKES], &rows[TW_SHALLOW_CENTRES]},
            (const family[2]){spokes, centres}, (lanes){find_corners, corners_2},
            (fill_rows_of *const[2]){fill_spokes, fill_centres});
}

/* ---- polygons ------------------------------------------------------------------------------- */

static void fill_polygons(const tw_shallow_level *level_at, const tw_shallow_rows *rows) {
  tw_shallow_level own = *level_at;
  const tw_shallow_level *l = &own;
  if (l->number == 1) {
    fill(l, &rows[TW_SHALLOW_VERTICES], level_1_vertex, 1);
    fill(l, &rows[TW_SHALLOW_EDGES], level_1_middle, 1);
    fill(l, &rows[TW_SHALLOW_FACES], level_1_face, 1);
    return;
  }
  fill(l, &rows[TW_SHALLOW_VERTICES], level_2_vertex, 1);
  fill(l, &rows[TW_SHALLOW_EDGES], level_2_middle, 1);
  fill(l, &rows[TW_SHALLOW_FACES], level_2_face, 1);
  fill(l, &rows[TW_SHALLOW_HALVES], level_2_halves, 2);
  fill(l, &rows[TW_SHALLOW_SPOKES], level_2_spokes, 1);
  fill(l, &rows[TW_SHALLOW_CENTRES], level_2_centres, 1);
}

static inline void fill_rows(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  if (level->cage.face_size == 3)
    fill_triangles(level, rows);
  else
    fill_polygons(level, rows);
}

#endif
