/* Vectors as wide as the compiler may use, and how those of components become rows in memory. */
#ifndef TWEEND_WIDE_H
#define TWEEND_WIDE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __AVX__
enum { LANES = 8 };
#else
enum { LANES = 4 };
#endif
enum { WIDTH_MAX = 4, ROW_MAX = 6, LINE = 4 * WIDTH_MAX };

typedef float vector __attribute__((vector_size(4 * LANES)));
typedef int32_t mask __attribute__((vector_size(4 * LANES)));
typedef float four __attribute__((vector_size(16)));
typedef double two __attribute__((vector_size(16)));
typedef int32_t four_mask __attribute__((vector_size(16)));

static inline vector load(const float *from) {
  vector value;
  memcpy(&value, from, sizeof value);
  return value;
}

static inline four load_four(const float *from) {
  four value;
  memcpy(&value, from, sizeof value);
  return value;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* Of each four lanes of two vectors, those that four numbers below 8 name. */
#define OF_FOUR(n, m)           ((n) % 4 + 4 * (m) + (n) / 4 * LANES)
#define OF_FOURS(i, j, k, l, m) OF_FOUR(i, m), OF_FOUR(j, m), OF_FOUR(k, m), OF_FOUR(l, m)
#ifdef __AVX__
#define SHUFFLE(a, b, i, j, k, l)                                                                            \
  __builtin_shufflevector(a, b, OF_FOURS(i, j, k, l, 0), OF_FOURS(i, j, k, l, 1))
#else
#define SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#endif

/* The nth four lanes. */
static inline __attribute__((always_inline)) four four_of(vector from, size_t n) {
#ifdef __AVX__
  if (n == 1) return __builtin_shufflevector(from, from, 4, 5, 6, 7);
#endif
  (void)n;
  return __builtin_shufflevector(from, from, 0, 1, 2, 3);
}

/* Lanes from the fifth on, and the first four of what follows. */
static inline __attribute__((always_inline)) vector four_on(vector at, vector following) {
#ifdef __AVX__
  return __builtin_shufflevector(at, following, 4, 5, 6, 7, 8, 9, 10, 11);
#else
  (void)at;
  return following;
#endif
}

static inline __attribute__((always_inline)) void put(float *out, four row) {
  memcpy(out, &row, sizeof row);
}

static inline __attribute__((always_inline)) void put_all(float *out, vector values) {
  memcpy(out, &values, sizeof values);
}

/* Half of a vector, as one number. */
static inline __attribute__((always_inline)) void put_half(float *out, four row, int half) {
  double pair = ((two)row)[half];
  memcpy(out, &pair, sizeof pair);
}

/* Rows of three next to each other: four points at a time fill a four of each vector. */
static inline __attribute__((always_inline)) void pack_three(const vector *v, vector *out) {
  vector xxyy = SHUFFLE(v[0], v[1], 0, 2, 4, 6), yyzz = SHUFFLE(v[1], v[2], 1, 3, 5, 7),
         zzxx = SHUFFLE(v[2], v[0], 0, 2, 5, 7);
  out[0] = SHUFFLE(xxyy, zzxx, 0, 2, 4, 6);
  out[1] = SHUFFLE(yyzz, xxyy, 0, 2, 5, 7);
  out[2] = SHUFFLE(zzxx, yyzz, 1, 3, 5, 7);
}

/* Likewise of six. */
static inline __attribute__((always_inline)) void pack_six(const vector *v, vector *out) {
  vector low[3], high[3];
  for (size_t c = 0; c < 3; c++) {
    low[c] = SHUFFLE(v[2 * c], v[2 * c + 1], 0, 4, 1, 5);
    high[c] = SHUFFLE(v[2 * c], v[2 * c + 1], 2, 6, 3, 7);
  }
  out[0] = SHUFFLE(low[0], low[1], 0, 1, 4, 5);
  out[1] = SHUFFLE(low[2], low[0], 0, 1, 6, 7);
  out[2] = SHUFFLE(low[1], low[2], 2, 3, 6, 7);
  out[3] = SHUFFLE(high[0], high[1], 0, 1, 4, 5);
  out[4] = SHUFFLE(high[2], high[0], 0, 1, 6, 7);
  out[5] = SHUFFLE(high[1], high[2], 2, 3, 6, 7);
}

/* All packed rows. */
static inline __attribute__((always_inline)) void put_packed(const vector *packed, size_t width, float *out) {
  for (size_t m = 0; m < LANES / 4; m++)
    for (size_t k = 0; k < width; k++, out += 4) put(out, four_of(packed[k], m));
}

/* Some of them, from memory. */
static __attribute__((noinline)) void put_kept(const vector *kept, size_t width, size_t count, float *out) {
  const float *from = (const float *)kept;
  for (; count >= 4; count -= 4, from += 4)
    for (size_t k = 0; k < width; k++, out += 4) put(out, load_four(from + k * LANES));
  size_t left = count * width, k = 0;
  for (; k + 4 <= left; k += 4) put(out + k, load_four(from + k / 4 * LANES));
  for (; k < left; k++) out[k] = from[k / 4 * LANES + k % 4];
}

static inline __attribute__((always_inline)) void put_some_packed(const vector *packed, size_t width,
                                                                  size_t count, float *out) {
  vector kept[ROW_MAX];
  for (size_t k = 0; k < width; k++) kept[k] = packed[k];
  put_kept(kept, width, count, out);
}

static inline __attribute__((always_inline)) void store_packed(const vector *v, size_t width, size_t count,
                                                               float *out) {
  vector packed[ROW_MAX];
  if (width == 3)
    pack_three(v, packed);
  else
    pack_six(v, packed);
  if (count == LANES)
    put_packed(packed, width, out);
  else
    put_some_packed(packed, width, count, out);
}

/* Rows by themselves: of each four points the first components, then a fifth and sixth. */
typedef struct apart {
  vector rows[4], tails[2];
} apart;

static inline __attribute__((always_inline)) apart take_apart(const vector *v, size_t width) {
  vector z = v[width > 2 ? 2 : 0], w = v[width > 3 ? 3 : 0];
  vector xy_low = SHUFFLE(v[0], v[1], 0, 4, 1, 5), xy_high = SHUFFLE(v[0], v[1], 2, 6, 3, 7),
         zw_low = SHUFFLE(z, w, 0, 4, 1, 5), zw_high = SHUFFLE(z, w, 2, 6, 3, 7);
  apart a = {.rows = {SHUFFLE(xy_low, zw_low, 0, 1, 4, 5), SHUFFLE(xy_low, zw_low, 2, 3, 6, 7),
                      SHUFFLE(xy_high, zw_high, 0, 1, 4, 5), SHUFFLE(xy_high, zw_high, 2, 3, 6, 7)}};
  a.tails[0] = width > 4 ? SHUFFLE(v[width - 2], v[width - 1], 0, 4, 1, 5) : z;
  a.tails[1] = width > 4 ? SHUFFLE(v[width - 2], v[width - 1], 2, 6, 3, 7) : z;
  return a;
}

static inline __attribute__((always_inline)) void put_row(float *out, size_t width, four row, four tail,
                                                          size_t half) {
  if (width >= 4)
    put(out, row);
  else
    put_half(out, row, 0);
  if (width == 3) out[2] = row[2];
  if (width == 6) put_half(out + 4, tail, (int)half);
}

/* One of them, from memory. */
static inline void put_one_apart(const apart *a, size_t width, size_t lane, float *out) {
  const float *row = (const float *)&a->rows[lane % 4], *tail = (const float *)&a->tails[lane % 4 / 2];
  put_row(out, width, load_four(row + lane / 4 * 4), load_four(tail + lane / 4 * 4), lane % 2);
}

static __attribute__((noinline)) void put_some_apart(const apart *a, size_t width, size_t count, float *out,
                                                     ptrdiff_t step) {
  for (size_t l = 0; l < count; l++, out += step) put_one_apart(a, width, l, out);
}

/* Rows of `width` components, 2, 3, 4 or 6: those of the first `count` points, `step` apart. */
static inline __attribute__((always_inline)) void store_rows(const vector *v, size_t width, size_t count,
                                                             float *out, ptrdiff_t step) {
  if (width % 3 == 0 && step == (ptrdiff_t)width) {
    store_packed(v, width, count, out);
    return;
  }
  apart a = take_apart(v, width);
  if (count < LANES) {
    apart kept = a;
    put_some_apart(&kept, width, count, out, step);
    return;
  }
  for (size_t m = 0; m < LANES / 4; m++)
    for (size_t r = 0; r < 4; r++, out += step)
      put_row(out, width, four_of(a.rows[r], m), four_of(a.tails[r / 2], m), r % 2);
}

#endif
