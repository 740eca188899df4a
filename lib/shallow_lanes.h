/* Rows of shallow surfaces with normals, of as many edges or faces of the cage at a time as a vector has
 * lanes: points that lie anywhere become vectors of each coordinate, those tangents, and those rows. The
 * arithmetic is that of single rows in shallow_tangents.h, and so are the bytes. */
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

/* ---- tangents ------------------------------------------------------------------------------- */

/* Of a row of each item. */
typedef struct tangents {
  coordinates along[2];
} tangents;

/* Between four faces. */
static inline __attribute__((always_inline)) void
between_four(const coordinates *const edges[4], const coordinates *const faces[4], tangents *out) {
  for (size_t c = 0; c < 3; c++) {
    vector rising = faces[0]->of[c] - faces[2]->of[c], falling = faces[3]->of[c] - faces[1]->of[c];
    out->along[0].of[c] = 4 * (edges[0]->of[c] - edges[2]->of[c]) + (rising + falling);
    out->along[1].of[c] = 4 * (edges[1]->of[c] - edges[3]->of[c]) + (rising - falling);
  }
}

/* Between three. */
static inline __attribute__((always_inline)) void between_three(float weight, const coordinates edges[3],
                                                                const coordinates faces[3], tangents *out) {
  for (size_t c = 0; c < 3; c++) {
    out->along[0].of[c] = 4 * (edges[1].of[c] - edges[0].of[c]) + weight * (faces[2].of[c] - faces[1].of[c]);
    out->along[1].of[c] = 4 * (edges[2].of[c] - edges[0].of[c]) + weight * (faces[0].of[c] - faces[1].of[c]);
  }
}

/* ---- looking ahead -------------------------------------------------------------------------- */

enum { CACHE_LINE = 64 };

/* Of numbers that are read in turn, `count` at a time, asks for those of some items farther on: the processor
 * sees them coming too late. An address beyond the end does no harm. */
static inline __attribute__((always_inline)) void fetch_on(const void *numbers, size_t count) {
  enum { ITEMS = 48 };
  uintptr_t from = (uintptr_t)numbers + ITEMS / LANES * 4 * count;
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

/* ---- rows ----------------------------------------------------------------------------------- */

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

/* Points and normals of LANES items, `step` rows of each. False: some of the normals need a closer look. */
static inline __attribute__((always_inline)) bool put_items(const tangents *t, const float *points,
                                                            uint32_t step, float *restrict out) {
  enum { ROWS = LANES / 4 }; /* in a vector */
  vector normals[4][3];
  mask sure = first_mask();
  prepare_memory(out, NORMAL_ROW * step * LANES);
  for (uint32_t r = 0; r < step; r++) {
    coordinates normal = cross(&t[r].along[0], &t[r].along[1], &sure);
    vector rows[4];
    points_of(&normal, rows);
    for (size_t m = 0; m < 4; m++) normals[m][r] = rows[m];
  }
  for (size_t m = 0; m < 4; m++) {
    vector rows[3];
    take_turns(normals[m], step, rows);
    for (size_t k = 0; k < step; k++, points += 3 * ROWS, out += NORMAL_ROW * ROWS)
      put_points_and_normals(points, rows[k], out);
  }
  return all_set(sure);
}

#endif
