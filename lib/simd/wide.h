/* Vectors as wide as the compiler may use, and how those of components become rows in memory. */
#ifndef TWEEND_WIDE_H
#define TWEEND_WIDE_H

#include "normal.h"
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __AVX__
enum { TW_WIDE = 8 };
#else
enum { TW_WIDE = 4 };
#endif
enum { TW_WIDTH_MAX = 4, TW_ROW_MAX = 6, TW_LINE = 4 * TW_WIDTH_MAX };

typedef float tw_vector __attribute__((vector_size(4 * TW_WIDE)));
typedef int32_t tw_mask __attribute__((vector_size(4 * TW_WIDE)));
typedef float tw_four __attribute__((vector_size(16)));
typedef double tw_two __attribute__((vector_size(16)));
typedef int32_t tw_four_mask __attribute__((vector_size(16)));

static inline tw_vector tw_load(const float *from) {
  tw_vector value;
  memcpy(&value, from, sizeof value);
  return value;
}

static inline tw_four tw_load_four(const float *from) {
  tw_four value;
  memcpy(&value, from, sizeof value);
  return value;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* Of each four lanes of two vectors, those that four numbers below 8 name. */
#define TW_OF_FOUR(n, m)           ((n) % 4 + 4 * (m) + (n) / 4 * TW_WIDE)
#define TW_OF_FOURS(i, j, k, l, m) TW_OF_FOUR(i, m), TW_OF_FOUR(j, m), TW_OF_FOUR(k, m), TW_OF_FOUR(l, m)
#ifdef __AVX__
#define TW_SHUFFLE(a, b, i, j, k, l)                                                                         \
  __builtin_shufflevector(a, b, TW_OF_FOURS(i, j, k, l, 0), TW_OF_FOURS(i, j, k, l, 1))
#else
#define TW_SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#endif

/* The nth four lanes. */
static inline __attribute__((always_inline)) tw_four tw_four_of(tw_vector from, size_t n) {
#ifdef __AVX__
  if (n == 1) return __builtin_shufflevector(from, from, 4, 5, 6, 7);
#endif
  (void)n;
  return __builtin_shufflevector(from, from, 0, 1, 2, 3);
}

/* Lanes from the fifth on, and the first four of what follows. */
static inline __attribute__((always_inline)) tw_vector tw_four_on(tw_vector at, tw_vector following) {
#ifdef __AVX__
  return __builtin_shufflevector(at, following, 4, 5, 6, 7, 8, 9, 10, 11);
#else
  (void)at;
  return following;
#endif
}

static inline __attribute__((always_inline)) void tw_put(float *out, tw_four row) {
  memcpy(out, &row, sizeof row);
}

static inline __attribute__((always_inline)) void tw_put_all(float *out, tw_vector values) {
  memcpy(out, &values, sizeof values);
}

/* Half of a vector, as one number. */
static inline __attribute__((always_inline)) void tw_put_half(float *out, tw_four row, int half) {
  double pair = ((tw_two)row)[half];
  memcpy(out, &pair, sizeof pair);
}

/* Rows of three next to each other: four points at a time fill a four of each vector. */
static inline __attribute__((always_inline)) void tw_pack_three(const tw_vector *v, tw_vector *out) {
  tw_vector xxyy = TW_SHUFFLE(v[0], v[1], 0, 2, 4, 6), yyzz = TW_SHUFFLE(v[1], v[2], 1, 3, 5, 7),
            zzxx = TW_SHUFFLE(v[2], v[0], 0, 2, 5, 7);
  out[0] = TW_SHUFFLE(xxyy, zzxx, 0, 2, 4, 6);
  out[1] = TW_SHUFFLE(yyzz, xxyy, 0, 2, 5, 7);
  out[2] = TW_SHUFFLE(zzxx, yyzz, 1, 3, 5, 7);
}

/* Likewise of six. */
static inline __attribute__((always_inline)) void tw_pack_six(const tw_vector *v, tw_vector *out) {
  tw_vector low[3], high[3];
  for (size_t c = 0; c < 3; c++) {
    low[c] = TW_SHUFFLE(v[2 * c], v[2 * c + 1], 0, 4, 1, 5);
    high[c] = TW_SHUFFLE(v[2 * c], v[2 * c + 1], 2, 6, 3, 7);
  }
  out[0] = TW_SHUFFLE(low[0], low[1], 0, 1, 4, 5);
  out[1] = TW_SHUFFLE(low[2], low[0], 0, 1, 6, 7);
  out[2] = TW_SHUFFLE(low[1], low[2], 2, 3, 6, 7);
  out[3] = TW_SHUFFLE(high[0], high[1], 0, 1, 4, 5);
  out[4] = TW_SHUFFLE(high[2], high[0], 0, 1, 6, 7);
  out[5] = TW_SHUFFLE(high[1], high[2], 2, 3, 6, 7);
}

/* All packed rows. */
static inline __attribute__((always_inline)) void tw_put_packed(const tw_vector *packed, size_t width,
                                                                float *out) {
  for (size_t m = 0; m < TW_WIDE / 4; m++)
    for (size_t k = 0; k < width; k++, out += 4) tw_put(out, tw_four_of(packed[k], m));
}

/* Some of them, from memory. */
static __attribute__((noinline)) void tw_put_kept(const tw_vector *kept, size_t width, size_t count,
                                                  float *out) {
  const float *from = (const float *)kept;
  for (; count >= 4; count -= 4, from += 4)
    for (size_t k = 0; k < width; k++, out += 4) tw_put(out, tw_load_four(from + k * TW_WIDE));
  size_t left = count * width, k = 0;
  for (; k + 4 <= left; k += 4) tw_put(out + k, tw_load_four(from + k / 4 * TW_WIDE));
  for (; k < left; k++) out[k] = from[k / 4 * TW_WIDE + k % 4];
}

static inline __attribute__((always_inline)) void tw_put_some_packed(const tw_vector *packed, size_t width,
                                                                     size_t count, float *out) {
  tw_vector kept[TW_ROW_MAX];
  for (size_t k = 0; k < width; k++) kept[k] = packed[k];
  tw_put_kept(kept, width, count, out);
}

static inline __attribute__((always_inline)) void tw_store_packed(const tw_vector *v, size_t width,
                                                                  size_t count, float *out) {
  tw_vector packed[TW_ROW_MAX];
  if (width == 3)
    tw_pack_three(v, packed);
  else
    tw_pack_six(v, packed);
  if (count == TW_WIDE)
    tw_put_packed(packed, width, out);
  else
    tw_put_some_packed(packed, width, count, out);
}

/* Rows by themselves: of each four points the first components, then a fifth and sixth. */
typedef struct tw_apart {
  tw_vector rows[4], tails[2];
} tw_apart;

static inline __attribute__((always_inline)) tw_apart tw_take_apart(const tw_vector *v, size_t width) {
  tw_vector y = v[width > 1 ? 1 : 0], z = v[width > 2 ? 2 : 0], w = v[width > 3 ? 3 : 0];
  tw_vector xy_low = TW_SHUFFLE(v[0], y, 0, 4, 1, 5), xy_high = TW_SHUFFLE(v[0], y, 2, 6, 3, 7),
            zw_low = TW_SHUFFLE(z, w, 0, 4, 1, 5), zw_high = TW_SHUFFLE(z, w, 2, 6, 3, 7);
  tw_apart a = {.rows = {TW_SHUFFLE(xy_low, zw_low, 0, 1, 4, 5), TW_SHUFFLE(xy_low, zw_low, 2, 3, 6, 7),
                         TW_SHUFFLE(xy_high, zw_high, 0, 1, 4, 5), TW_SHUFFLE(xy_high, zw_high, 2, 3, 6, 7)}};
  a.tails[0] = width > 4 ? TW_SHUFFLE(v[width - 2], v[width - 1], 0, 4, 1, 5) : z;
  a.tails[1] = width > 4 ? TW_SHUFFLE(v[width - 2], v[width - 1], 2, 6, 3, 7) : z;
  return a;
}

static inline __attribute__((always_inline)) void tw_put_row(float *out, size_t width, tw_four row,
                                                             tw_four tail, size_t half) {
  if (width >= 4)
    tw_put(out, row);
  else if (width >= 2)
    tw_put_half(out, row, 0);
  else
    out[0] = row[0];
  if (width == 3) out[2] = row[2];
  if (width == 6) tw_put_half(out + 4, tail, (int)half);
}

/* Some of them, from memory. */
static __attribute__((noinline)) void tw_put_some_apart(const tw_apart *a, size_t width, size_t count,
                                                        float *out, ptrdiff_t step) {
  for (size_t l = 0; l < count; l++, out += step) {
    const float *row = (const float *)&a->rows[l % 4], *tail = (const float *)&a->tails[l % 4 / 2];
    tw_put_row(out, width, tw_load_four(row + l / 4 * 4), tw_load_four(tail + l / 4 * 4), l % 2);
  }
}

/* Rows of `width` components, 1, 2, 3, 4 or 6: those of the first `count` points, `step` apart. */
static inline __attribute__((always_inline)) void tw_store_rows(const tw_vector *v, size_t width,
                                                                size_t count, float *out, ptrdiff_t step) {
  if (width % 3 == 0 && step == (ptrdiff_t)width) {
    tw_store_packed(v, width, count, out);
    return;
  }
  tw_apart a = tw_take_apart(v, width);
  if (count < TW_WIDE) {
    tw_apart kept = a;
    tw_put_some_apart(&kept, width, count, out, step);
    return;
  }
  for (size_t m = 0; m < TW_WIDE / 4; m++)
    for (size_t r = 0; r < 4; r++, out += step)
      tw_put_row(out, width, tw_four_of(a.rows[r], m), tw_four_of(a.tails[r / 2], m), r % 2);
}

/* ---- unit normals ------------------------------------------------------------------------------- */

/* Unit normals of tangents in vectors as wide as the compiler may use. No product is contracted and no root
 * approximated, so that all instruction sets give the same bytes, those of tw_normal_from_tangents. */

static inline __attribute__((always_inline)) tw_vector tw_greater(tw_vector a, tw_vector b) {
  tw_mask more = a > b;
  return (tw_vector)(((tw_mask)a & more) | ((tw_mask)b & ~more));
}

static inline tw_vector tw_root(tw_vector square) {
  for (int l = 0; l < TW_WIDE; l++) square[l] = sqrtf(square[l]);
  return square;
}

static inline __attribute__((always_inline)) bool tw_all_set(tw_mask m) {
  tw_four_mask all = (tw_four_mask)tw_four_of((tw_vector)m, 0);
  for (size_t n = 1; n < TW_WIDE / 4; n++) all &= (tw_four_mask)tw_four_of((tw_vector)m, n);
  uint64_t halves[2];
  memcpy(halves, &all, sizeof halves);
  return (halves[0] & halves[1]) == UINT64_MAX;
}

static inline tw_mask tw_first_mask(void) {
  return (tw_mask){0} == 0;
}

/* Cross products, and what each is multiplied by to become a unit normal. */
typedef struct tw_crossed {
  tw_vector of[3], scale;
} tw_crossed;

/* least: what the square of each has to exceed; outward: 1, or -1 to turn them over; sure: which of all so
 * far need no closer look. */
static inline __attribute__((always_inline)) tw_crossed tw_cross_tangents(const tw_vector a[3],
                                                                          const tw_vector b[3],
                                                                          tw_vector least, tw_vector outward,
                                                                          tw_mask *sure) {
  tw_crossed n;
  for (size_t c = 0; c < 3; c++) n.of[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
  tw_vector square = n.of[0] * n.of[0] + n.of[1] * n.of[1] + n.of[2] * n.of[2];
  *sure &= (square > least) & (square < TW_NORMAL_SQUARE_MAX);
  n.scale = outward / tw_root(square);
  return n;
}

/* With no zero below 0: a patch has the same normals turned round. */
static inline __attribute__((always_inline)) void tw_normalise(const tw_crossed *n, tw_vector *out) {
  for (size_t c = 0; c < 3; c++) out[c] = n->of[c] * n->scale + 0.0f;
}

#endif
