/* Rows of shallow surfaces with normals, in vectors as wide as the compiler may use: each file that includes
 * this is compiled for another instruction set. Tangents are found row by row, those of a level 2 that is
 * remade LANES items at a time; kinds of rows that look at the same things are made together there. */
#ifndef TWEEND_SHALLOW_NORMALS_KERNEL_H
#define TWEEND_SHALLOW_NORMALS_KERNEL_H

#include "normal_rows.h"
#include "shallow_tangents.h"
#include "shallow_triangles.h"

/* ---- rows ----------------------------------------------------------------------------------- */

/* Normals of rows [from, to) one by one, some of which take care. Of a level 2 that is remade only the
 * vertices come here, with tangents of level 1; but where those are parallel, level 2's own face serves. */
static __attribute__((noinline)) void look_at_each(const tw_shallow_level *l, const tw_shallow_rows *j,
                                                   rows_of *find, uint32_t step, uint32_t from, uint32_t to) {
  float *normal = j->out + NORMAL_ROW * (size_t)(from - j->begin) + 3;
  for (uint32_t i = from; i < to; i++, normal += NORMAL_ROW) {
    row rows[2];
    find(l, i / step, rows);
    row *r = &rows[i % step];
    float quad[4][3];
    if (l->remade) {
      remake_quad(l, i, quad);
      for (size_t k = 0; k < 4; k++) r->quad[k] = quad[k];
    }
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

/* Rows of which each item has `step`, 1 or 2. */
static inline __attribute__((always_inline)) void fill(const tw_shallow_level *l, const tw_shallow_rows *j,
                                                       rows_of *find, uint32_t step) {
  float *restrict out = j->out;
  normal_batch b;
  for (uint32_t first = j->begin - j->begin % step; first < j->end; first += NORMAL_BATCH) {
    uint32_t from = first < j->begin ? j->begin - first : 0,
             to = j->end - first < NORMAL_BATCH ? j->end - first : NORMAL_BATCH;
    tw_point *place = b.along, *stop = place + to;
    for (uint32_t item = first / step; place < stop; item++, place += step) {
      row rows[2];
      find(l, item, rows);
      for (uint32_t r = 0; r < step; r++) put_tangents(rows[r].along, place + r);
    }
    if (!put_normal_rows(&b, from, to, j->points + 3 * (size_t)first, out))
      take_care(l, j, find, step, first + from, first + to);
    out += NORMAL_ROW * (size_t)(to - from);
  }
}

/* ---- level 2 of triangles, remade ----------------------------------------------------------- */

/* How rows of LANES items, of so many that there are, are found. */
typedef struct lanes {
  find_from *look;
  rows_from *find;
  uint32_t item_count;
} lanes;

/* Items. */
typedef struct span {
  uint32_t begin, end;
} span;

/* Rows of LANES items from one on, `step` of each, of which those that are asked for go out. */
static inline __attribute__((always_inline)) void put_asked(const tw_shallow_rows *j, const lane_row *rows,
                                                            uint32_t step, uint32_t item) {
  float block[NORMAL_ROW * TRIPLES];
  uint32_t first = item * step, end = first + LANES * step;
  bool all = first >= j->begin && end <= j->end;
  float *out = all ? j->out + NORMAL_ROW * (size_t)(first - j->begin) : block;
  if (!put_items(rows, step, out)) look_at_lanes(rows, step, out);
  uint32_t from = first > j->begin ? first : j->begin, to = end < j->end ? end : j->end;
  if (!all && from < to)
    memcpy(j->out + NORMAL_ROW * (size_t)(from - j->begin), block + NORMAL_ROW * (size_t)(from - first),
           NORMAL_ROW * (size_t)(to - from) * sizeof *block);
}

/* Rows of some items, LANES at a time, be they of one kind or of two that look at the same things. The last
 * ones of the cage are found again with some before them, so that every lane has an item. */
static inline __attribute__((always_inline)) void fill_span(const tw_shallow_level *l, span items, lanes by,
                                                            const tw_shallow_rows *const jobs[],
                                                            const uint32_t steps[], uint32_t kinds) {
  offsets where[2];
  points_about about;
  uint32_t last = by.item_count - LANES, item = items.begin < last ? items.begin : last, n = 0;
  by.look(l, item, &where[0]);
  for (bool more = true; more; n = 1 - n) {
    uint32_t next = last - item > LANES ? item + LANES : last;
    lane_row found[6], *rows = found;
    more = item < last && items.end - item > LANES;
    if (more) by.look(l, next, &where[1 - n]);
    by.find(l, item, &where[n], &about, rows);
    for (uint32_t k = 0; k < kinds; rows += steps[k++]) put_asked(jobs[k], rows, steps[k], item);
    item = next;
  }
}

/* Rows of a kind. */
static inline __attribute__((always_inline)) void
fill_kind(const tw_shallow_level *l, const tw_shallow_rows *j, uint32_t step, lanes by) {
  if (j->begin == j->end) return;
  span items = {j->begin / step, (uint32_t)(((uint64_t)j->end + step - 1) / step)};
  fill_span(l, items, by, &j, &step, 1);
}

static inline tw_shallow_rows part_of(const tw_shallow_rows *j, uint32_t begin, uint32_t end) {
  return (tw_shallow_rows){j->points, begin, end, j->out + NORMAL_ROW * ((size_t)begin - j->begin)};
}

/* Items of which all rows are asked for. */
static inline span whole_items(const tw_shallow_rows *j, uint32_t step) {
  return (span){(uint32_t)(((uint64_t)j->begin + step - 1) / step), j->end / step};
}

typedef void fill_rows_of(const tw_shallow_level *l, const tw_shallow_rows *j);

/* Rows of two kinds: together where both are asked for, what is left of either alone. */
static inline __attribute__((always_inline)) void fill_both(const tw_shallow_level *l,
                                                            const tw_shallow_rows *const jobs[2],
                                                            const uint32_t steps[2], lanes by,
                                                            fill_rows_of *const alone[2]) {
  span a = whole_items(jobs[0], steps[0]), b = whole_items(jobs[1], steps[1]),
       items = {a.begin > b.begin ? a.begin : b.begin, a.end < b.end ? a.end : b.end};
  bool together = items.begin < items.end;
  if (together) fill_span(l, items, by, jobs, steps, 2);
  for (uint32_t k = 0; k < 2; k++) {
    uint32_t middle = together ? items.begin * steps[k] : jobs[k]->end;
    tw_shallow_rows before = part_of(jobs[k], jobs[k]->begin, middle);
    alone[k](l, &before);
    if (!together) continue;
    tw_shallow_rows behind = part_of(jobs[k], items.end * steps[k], jobs[k]->end);
    alone[k](l, &behind);
  }
}

static __attribute__((noinline)) void fill_edges(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, 1, (lanes){find_inside, edges_2, l->cage.edge_count});
}
static __attribute__((noinline)) void fill_halves(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, 2, (lanes){find_about, halves_2, l->cage.edge_count});
}
static __attribute__((noinline)) void fill_spokes(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, 3, (lanes){find_corners, spokes_2, l->cage.face_count});
}
static __attribute__((noinline)) void fill_centres(const tw_shallow_level *l, const tw_shallow_rows *j) {
  fill_kind(l, j, 3, (lanes){find_corners, centres_2, l->cage.face_count});
}

/* Tangents at the cage's vertices are those of level 1: limits have the same directions at every level. Those
 * rows are found by a copy as below. */
static void fill_remade(const tw_shallow_level *l, const tw_shallow_rows *rows) {
  tw_shallow_level own = *l;
  own.cage.face_size = 3;
  own.cage.face_offsets = NULL;
  fill(&own, &rows[TW_SHALLOW_VERTICES], level_1_vertex, 1);
  fill_kind(l, &rows[TW_SHALLOW_FACES], 1, (lanes){find_middle, faces_2, l->cage.face_count});
  fill_both(l, (const tw_shallow_rows *const[2]){&rows[TW_SHALLOW_EDGES], &rows[TW_SHALLOW_HALVES]},
            (const uint32_t[2]){1, 2}, (lanes){find_about, whole_edges_2, l->cage.edge_count},
            (fill_rows_of *const[2]){fill_edges, fill_halves});
  fill_both(l, (const tw_shallow_rows *const[2]){&rows[TW_SHALLOW_SPOKES], &rows[TW_SHALLOW_CENTRES]},
            (const uint32_t[2]){3, 3}, (lanes){find_corners, corners_2, l->cage.face_count},
            (fill_rows_of *const[2]){fill_spokes, fill_centres});
}

/* ---- levels --------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) void fill_level_1(const tw_shallow_level *l,
                                                               const tw_shallow_rows *rows) {
  fill(l, &rows[TW_SHALLOW_VERTICES], level_1_vertex, 1);
  fill(l, &rows[TW_SHALLOW_EDGES], level_1_middle, 1);
  fill(l, &rows[TW_SHALLOW_FACES], level_1_face, 1);
}

/* Rows are found by a copy, to which the compiler binds all that asks for the size of a face: nobody else is
 * told of it, so that no call and no row that is stored can be taken to change it. */
static void fill_level_1_of_triangles(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  tw_shallow_level own = *level;
  own.cage.face_size = 3;
  own.cage.face_offsets = NULL;
  fill_level_1(&own, rows);
}

static void fill_level_1_of_polygons(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  tw_shallow_level own = *level;
  fill_level_1(&own, rows);
}

static void fill_kept(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  tw_shallow_level own = *level;
  const tw_shallow_level *l = &own;
  fill(l, &rows[TW_SHALLOW_VERTICES], level_2_vertex, 1);
  fill(l, &rows[TW_SHALLOW_EDGES], level_2_middle, 1);
  fill(l, &rows[TW_SHALLOW_FACES], level_2_face, 1);
  fill(l, &rows[TW_SHALLOW_HALVES], level_2_halves, 2);
  fill(l, &rows[TW_SHALLOW_SPOKES], level_2_spoke, 1);
  fill(l, &rows[TW_SHALLOW_CENTRES], level_2_centre, 1);
}

static inline void fill_rows(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  if (level->remade)
    fill_remade(level, rows);
  else if (level->number == 2)
    fill_kept(level, rows);
  else if (level->cage.face_size == 3)
    fill_level_1_of_triangles(level, rows);
  else
    fill_level_1_of_polygons(level, rows);
}

#endif
