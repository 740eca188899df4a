/* Rows of points and unit normals, in vectors as wide as the compiler may use. Many tangents are found before
 * they are crossed, so that roots and quotients overlap. All instruction sets give the same bytes. */
#ifndef TWEEND_NORMAL_ROWS_H
#define TWEEND_NORMAL_ROWS_H

#include "point.h"
#include "unit_normals.h"

/* 48 are whole vectors, and whole items of one, two and three rows; the last vector may begin at any row. */
enum { NORMAL_BATCH = 48, NORMAL_PLACES = NORMAL_BATCH + LANES, NORMAL_ROW = 6 };

/* Tangents of some rows: all first ones, then all second ones. */
typedef struct normal_batch {
  tw_point along[2 * NORMAL_PLACES];
} normal_batch;

static inline void put_tangents(const tw_point along[2], tw_point *place) {
  place[0] = along[0];
  place[NORMAL_PLACES] = along[1];
}

/* Each coordinate of LANES points. */
typedef struct coordinates {
  vector of[3];
} coordinates;

/* Of points as they lie in four vectors: in the four lanes of one, each four of them stand apart. */
static inline __attribute__((always_inline)) coordinates coordinates_in(const vector v[4]) {
  vector low = SHUFFLE(v[0], v[1], 0, 4, 1, 5), high = SHUFFLE(v[2], v[3], 0, 4, 1, 5),
         z_low = SHUFFLE(v[0], v[1], 2, 6, 2, 6), z_high = SHUFFLE(v[2], v[3], 2, 6, 2, 6);
  return (coordinates){
      {SHUFFLE(low, high, 0, 1, 4, 5), SHUFFLE(low, high, 2, 3, 6, 7), SHUFFLE(z_low, z_high, 0, 1, 4, 5)}};
}

static inline __attribute__((always_inline)) coordinates coordinates_of(const tw_point *points) {
  const float *from = (const float *)points;
  vector v[4];
  for (size_t m = 0; m < 4; m++) v[m] = load(from + m * LANES);
  return coordinates_in(v);
}

/* The other way round. */
static inline __attribute__((always_inline)) void points_of(const coordinates *c, vector points[4]) {
  vector x = c->of[0], y = c->of[1], z = c->of[2];
  vector low = SHUFFLE(x, y, 0, 4, 1, 5), high = SHUFFLE(x, y, 2, 6, 3, 7);
  points[0] = SHUFFLE(low, z, 0, 1, 4, 4);
  points[1] = SHUFFLE(low, z, 2, 3, 5, 5);
  points[2] = SHUFFLE(high, z, 0, 1, 6, 6);
  points[3] = SHUFFLE(high, z, 2, 3, 7, 7);
}

static inline vector square_of(const coordinates *c) {
  return c->of[0] * c->of[0] + c->of[1] * c->of[1] + c->of[2] * c->of[2];
}

/* Unit normals. Clears lanes of `sure` that need a closer look. */
static inline __attribute__((always_inline)) coordinates cross(const coordinates *along1,
                                                               const coordinates *along2, mask *sure) {
  coordinates normals;
  vector zero = {0}, lengths = square_of(along1) * square_of(along2);
  vector least = greater(lengths * TW_NORMAL_PARALLEL, zero + TW_NORMAL_SQUARE_MIN);
  unit_normals(along1->of, along2->of, least, zero + 1.0f, normals.of, sure);
  return normals;
}

static inline void put_point_and_normal(tw_point point, tw_point normal, float *row) {
  tw_point rest = __builtin_shufflevector(point, normal, 2, 4, 5, 6);
  memcpy(row, &point, sizeof point);
  memcpy(row + 2, &rest, sizeof rest);
}

/* As many rows as a vector holds points. Reads three floats more than the points. */
static inline __attribute__((always_inline)) void put_points_and_normals(const float *points, vector normals,
                                                                         float *rows) {
#ifdef __AVX512F__
  vector four_points = load(points),
         first = __builtin_shufflevector(four_points, normals, 0, 1, 2, 16, 17, 18, 3, 4, 5, 20, 21, 22, 6, 7,
                                         8, 24),
         last = __builtin_shufflevector(four_points, normals, 25, 26, 9, 10, 11, 28, 29, 30, 25, 26, 9, 10,
                                        11, 28, 29, 30);
  four halves[2] = {four_of(last, 0), four_of(last, 1)};
  put_all(rows, first);
  memcpy(rows + LANES, halves, sizeof halves);
#else
  for (size_t n = 0; n < LANES / 4; n++)
    put_point_and_normal(tw_load_point(points + 3 * n), four_of(normals, n), rows + NORMAL_ROW * n);
#endif
}

/* Rows [from, to) of a batch, at least one. points: [to][3], of all its rows, and four floats more. False:
 * some of the normals need a closer look. */
static inline bool put_normal_rows(normal_batch *batch, uint32_t from, uint32_t to, const float *points,
                                   float *restrict out) {
  mask sure = first_mask();
  tw_point *along = batch->along;
  const tw_point last[2] = {along[to - 1], along[NORMAL_PLACES + to - 1]};
  for (uint32_t i = to; (i - from) % LANES > 0; i++) put_tangents(last, along + i);
  for (uint32_t i = from; i < to; i += LANES) {
    coordinates along1 = coordinates_of(along + i), along2 = coordinates_of(along + NORMAL_PLACES + i),
                normals = cross(&along1, &along2, &sure);
    vector rows[4];
    points_of(&normals, rows);
    if (to - i >= LANES) {
      for (size_t m = 0; m < 4; m++, out += NORMAL_ROW * LANES / 4)
        put_points_and_normals(points + 3 * ((size_t)i + m * LANES / 4), rows[m], out);
    } else {
      const tw_point *some = (const tw_point *)rows;
      for (uint32_t k = i; k < to; k++, out += NORMAL_ROW)
        put_point_and_normal(tw_load_point(points + 3 * (size_t)k), some[k - i], out);
    }
  }
  return all_set(sure);
}

#endif
