/* Rows of shallow surfaces with normals, of as many edges or faces of the cage at a time as a vector has
 * lanes: points that lie anywhere become vectors of each coordinate, those points of level 2 and their
 * tangents, and those rows. Points have the sums of shallow_points.c, tangents those of shallow_tangents.h.
 */
#ifndef TWEEND_SHALLOW_LANES_H
#define TWEEND_SHALLOW_LANES_H

#ifdef __AVX__
#include <immintrin.h>
#endif

#include "normal_rows.h"
#include "shallow_normals.h"

/* ---- numbers -------------------------------------------------------------------------------- */

typedef uint32_t indices __attribute__((vector_size(4 * LANES)));

/* Corners of as many triangles as there are lanes. */
enum { TRIPLES = 3 * LANES };

static inline indices load_indices(const uint32_t *from) {
  indices value;
  memcpy(&value, from, sizeof value);
  return value;
}
static inline void put_indices(uint32_t *to, indices values) {
  memcpy(to, &values, sizeof values);
}
static inline indices from_on(uint32_t first) {
  static const uint32_t steps[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return load_indices(steps) + first;
}

/* ---- points --------------------------------------------------------------------------------- */

/* Points of so many rows as a vector has fours, next to each other. By instructions that take them from
 * memory: compilers load what shuffles in C join first. */
static inline __attribute__((always_inline)) vector join(const float *const rows[4]) {
#if defined __AVX512F__
  __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(load_four(rows[0])), load_four(rows[1]), 1),
         high = _mm256_insertf128_ps(_mm256_castps128_ps256(load_four(rows[2])), load_four(rows[3]), 1);
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
#elif defined __AVX__
  return _mm256_insertf128_ps(_mm256_castps128_ps256(load_four(rows[0])), load_four(rows[1]), 1);
#else
  return load_four(rows[0]);
#endif
}

/* The points that LANES offsets name, of which each `step`th is taken. */
static inline __attribute__((always_inline)) coordinates points_at(const float *base, const uint32_t *offsets,
                                                                   size_t step) {
  vector v[4];
  for (size_t m = 0; m < 4; m++) {
    const float *rows[4] = {NULL};
    for (size_t n = 0; n < LANES / 4; n++) rows[n] = base + offsets[(m * (LANES / 4) + n) * step];
    v[m] = join(rows);
  }
  return coordinates_in(v);
}

/* LANES points that are `step` floats apart. */
static inline __attribute__((always_inline)) coordinates points_by(const float *base, size_t step) {
  vector v[4];
  for (size_t m = 0; m < 4; m++) {
    const float *rows[4] = {NULL};
    for (size_t n = 0; n < LANES / 4; n++) rows[n] = base + (m * (LANES / 4) + n) * step;
    v[m] = join(rows);
  }
  return coordinates_in(v);
}

/* ---- points of level 2 ---------------------------------------------------------------------- */

/* In the middle of an edge, by the sums of the generic step, in its order. */
static inline __attribute__((always_inline)) coordinates
middle_of(const coordinates *a, const coordinates *b, const coordinates *left, const coordinates *right) {
  coordinates out;
  for (size_t c = 0; c < 3; c++)
    out.of[c] = 0.25f * (a->of[c] + b->of[c]) + 0.25f * (left->of[c] + right->of[c]);
  return out;
}

/* Of a vertex between `count` faces. */
static inline __attribute__((always_inline)) vector smooth_of(vector own, vector faces, vector edges,
                                                              float count) {
  return (faces + edges) * (1 / (count * count)) + own * ((count - 2) / count);
}

/* Of one between four, in the middle of an edge: where the edge ends, the middles of both of its faces, and
 * of the four quads in those the one at the end of the first face's side, that at its beginning, and so on.
 */
static inline __attribute__((always_inline)) coordinates
between_quads(const coordinates *own, const coordinates *start, const coordinates *end,
              const coordinates *const faces[2], const coordinates *const quads[4]) {
  coordinates out;
  for (size_t c = 0; c < 3; c++) {
    vector across = ((quads[0]->of[c] + quads[1]->of[c]) + quads[2]->of[c]) + quads[3]->of[c];
    vector along = ((end->of[c] + faces[0]->of[c]) + start->of[c]) + faces[1]->of[c];
    out.of[c] = smooth_of(own->of[c], across, along, 4);
  }
  return out;
}

/* Of one between three, in the middle of a triangle. */
static inline __attribute__((always_inline)) coordinates
between_corners(const coordinates *own, const coordinates edges[3], const coordinates quads[3]) {
  coordinates out;
  for (size_t c = 0; c < 3; c++) {
    vector zero = {0}; /* which a sum begins with: there is one below it */
    vector across = ((zero + quads[0].of[c]) + quads[1].of[c]) + quads[2].of[c];
    vector along = ((zero + edges[2].of[c]) + edges[0].of[c]) + edges[1].of[c];
    out.of[c] = smooth_of(own->of[c], across, along, 3);
  }
  return out;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* A row of each item: its point, tangents there, and a face there that serves where they are parallel, from
 * the point on. */
typedef struct lane_row {
  coordinates along[2];
  const coordinates *quad[4];
} lane_row;

/* Between four faces. */
static inline __attribute__((always_inline)) void between_four(const coordinates *own,
                                                               const coordinates *const edges[4],
                                                               const coordinates *const faces[4],
                                                               lane_row *out) {
  for (size_t c = 0; c < 3; c++) {
    vector rising = faces[0]->of[c] - faces[2]->of[c], falling = faces[3]->of[c] - faces[1]->of[c];
    out->along[0].of[c] = 4 * (edges[0]->of[c] - edges[2]->of[c]) + (rising + falling);
    out->along[1].of[c] = 4 * (edges[1]->of[c] - edges[3]->of[c]) + (rising - falling);
  }
  const coordinates *quad[4] = {own, edges[0], faces[0], edges[1]};
  memcpy(out->quad, quad, sizeof quad);
}

/* Between three. */
static inline __attribute__((always_inline)) void between_three(const coordinates *own, float weight,
                                                                const coordinates *const edges[3],
                                                                const coordinates *const faces[3],
                                                                lane_row *out) {
  for (size_t c = 0; c < 3; c++) {
    out->along[0].of[c] =
        4 * (edges[1]->of[c] - edges[0]->of[c]) + weight * (faces[2]->of[c] - faces[1]->of[c]);
    out->along[1].of[c] =
        4 * (edges[2]->of[c] - edges[0]->of[c]) + weight * (faces[0]->of[c] - faces[1]->of[c]);
  }
  const coordinates *quad[4] = {own, edges[0], faces[0], edges[1]};
  memcpy(out->quad, quad, sizeof quad);
}

/* ---- looking ahead -------------------------------------------------------------------------- */

enum { CACHE_LINE = 64 };

/* Of numbers that are read in turn, `count` at a time, asks for those of some items farther on: the processor
 * sees them coming too late. An address beyond the end does no harm. */
static inline __attribute__((always_inline)) void fetch_on(const void *numbers, size_t count) {
  enum { ITEMS = 48 };
  uintptr_t from = (uintptr_t)numbers + (size_t)(ITEMS / LANES) * 4 * count;
  for (size_t b = 0; b < 4 * count; b += CACHE_LINE) __builtin_prefetch((const void *)(from + b));
}

/* Asks for memory that floats farther on will be written to, where `count` are to be written now. */
static inline __attribute__((always_inline)) void prepare_memory(const float *out, size_t count) {
  enum { AHEAD_SIZE = 2304 };
  for (size_t b = 0; b < count * sizeof *out; b += CACHE_LINE)
    __builtin_prefetch((const void *)((uintptr_t)out + AHEAD_SIZE + b), 1, 3);
}

/* Asks for all that offsets name. */
static inline __attribute__((always_inline)) void fetch(const float *base, const uint32_t *offsets,
                                                        size_t count) {
  for (size_t i = 0; i < count; i++) __builtin_prefetch(base + offsets[i]);
}

/* ---- storing rows --------------------------------------------------------------------------- */

/* Fours of `step` vectors by turns: the first of each, then the second of each. */
static inline __attribute__((always_inline)) void take_turns(const vector *v, uint32_t step, vector *out) {
  vector a = v[0], b = v[step > 1 ? 1 : 0], c = v[step > 2 ? 2 : 0];
  out[0] = a;
#if defined __AVX512F__
  if (step == 2) {
    out[0] = QUARTERS(a, b, 0, 4, 1, 5);
    out[1] = QUARTERS(a, b, 2, 6, 3, 7);
  } else if (step == 3) {
    out[0] = QUARTERS(QUARTERS(a, b, 0, 4, 1, 5), c, 0, 1, 4, 2);
    out[1] = QUARTERS(QUARTERS(a, b, 5, 2, 6, 3), c, 0, 5, 1, 2);
    out[2] = QUARTERS(QUARTERS(a, b, 3, 7, 3, 7), c, 6, 0, 1, 7);
  }
#elif defined __AVX__
  if (step > 1) out[0] = __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
  if (step == 2) out[1] = __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
  if (step == 3) {
    out[1] = __builtin_shufflevector(c, a, 0, 1, 2, 3, 12, 13, 14, 15);
    out[2] = __builtin_shufflevector(b, c, 4, 5, 6, 7, 12, 13, 14, 15);
  }
#else
  if (step > 1) out[1] = b;
  if (step > 2) out[2] = c;
#endif
}

/* As many rows as a vector holds points. */
static inline __attribute__((always_inline)) void put_both(vector points, vector normals, float *rows) {
#ifdef __AVX512F__
  vector first =
             __builtin_shufflevector(points, normals, 0, 1, 2, 16, 17, 18, 4, 5, 6, 20, 21, 22, 8, 9, 10, 24),
         last = __builtin_shufflevector(points, normals, 25, 26, 12, 13, 14, 28, 29, 30, 25, 26, 12, 13, 14,
                                        28, 29, 30);
  four halves[2] = {four_of(last, 0), four_of(last, 1)};
  put_all(rows, first);
  memcpy(rows + LANES, halves, sizeof halves);
#else
  for (size_t n = 0; n < LANES / 4; n++)
    put_point_and_normal(four_of(points, n), four_of(normals, n), rows + NORMAL_ROW * n);
#endif
}

/* Points and normals of LANES items, `step` rows of each. False: some of the normals need a closer look. */
static inline __attribute__((always_inline)) bool put_items(const lane_row *items, uint32_t step,
                                                            float *restrict out) {
  vector points[4][3], normals[4][3];
  mask sure = first_mask();
  prepare_memory(out, (size_t)NORMAL_ROW * step * LANES);
  for (uint32_t r = 0; r < step; r++) {
    coordinates normal = cross(&items[r].along[0], &items[r].along[1], &sure);
    vector own[4], rows[4];
    points_of(items[r].quad[0], own);
    points_of(&normal, rows);
    for (size_t m = 0; m < 4; m++) {
      points[m][r] = own[m];
      normals[m][r] = rows[m];
    }
  }
  for (size_t m = 0; m < 4; m++) {
    vector own[3], rows[3];
    take_turns(points[m], step, own);
    take_turns(normals[m], step, rows);
    for (size_t k = 0; k < step; k++, out += NORMAL_ROW * LANES / 4) put_both(own[k], rows[k], out);
  }
  return all_set(sure);
}

static inline void point_in_lane(const coordinates *c, size_t lane, float point[3]) {
  for (size_t i = 0; i < 3; i++) point[i] = c->of[i][lane];
}

/* Their normals one by one, some of which take care. */
static __attribute__((noinline)) void look_at_lanes(const lane_row *items, uint32_t step, float *out) {
  enum { FOURS = LANES / 4 };
  for (size_t item = 0; item < LANES; item++)
    for (uint32_t r = 0; r < step; r++, out += NORMAL_ROW) {
      size_t lane = 4 * (item % FOURS) + item / FOURS; /* as coordinates_in has them */
      float along[2][3], quad[4][3];
      for (size_t i = 0; i < 2; i++) point_in_lane(&items[r].along[i], lane, along[i]);
      for (size_t i = 0; i < 4; i++) point_in_lane(items[r].quad[i], lane, quad[i]);
      tw_normal_from_tangents(along[0], along[1], (const float *const[4]){quad[0], quad[1], quad[2], quad[3]},
                              out + 3);
    }
}

#endif
