/* Shortest decimal digits in plain loops that compilers make vectors of, and their text, which is picked from
 * them without a branch: each file that includes this is compiled for another instruction set.
 *
 * In the eight decades from 1e-3 to 1e5 all of it is exact in doubles: a float times the power of ten that
 * gives it nine digits before the point has no more than 24 + 26 bits (5^11 has 26), and half the distance to
 * its neighbours times that power has 26. What lies within that reach reads back as the float; nothing of
 * nine digits lies at its end, since the middle between two such floats has 13 digits and more. The reach is
 * between 2.9 and 49, so of nine digits the nearest will always do; the nearest multiple of ten is shorter
 * where it is inside; and of the multiples of a hundred no more than one is inside, which is then the
 * shortest: that it may end in yet more zeros is seen in the text. The interval is narrower below a power of
 * two, but those are multiples of a hundred themselves. */
#ifndef TWEEND_DECIMAL_KERNEL_H
#define TWEEND_DECIMAL_KERNEL_H

#ifdef __AVX2__
#include <immintrin.h>
#elif defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
#include <arm_neon.h>
#endif

#include "decimal.h"

#include <math.h>
#include <string.h>

/* ---- digits ---------------------------------------------------------------------------------------- */

/* Of a float: the bits of its exponent, and how much less they say of half its last place. */
enum { EXPONENT = 0x7F800000, TO_HALF_PLACE = 24 << 23 };

static inline uint32_t bits_of(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

static inline float float_of(uint32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* Below 2^51, ties to even: there is no room behind the point of 2^52. */
static inline double nearest(double x) {
  return (x + 0x1p52) - 0x1p52;
}

/* The nine digits of a value as one number. */
static inline uint32_t find_nine(float value, uint32_t *kind) {
  uint32_t sign = bits_of(value) >> 31;
  float magnitude = fabsf(value);
  bool is_plain = magnitude >= 1e-3F && magnitude < 1e5F;
  float v = is_plain ? magnitude : 1;
  /* Each is the float nearest to a power of ten, and prints as that. */
  uint32_t decade = (uint32_t)(v >= 1e-2F) + (uint32_t)(v >= 1e-1F) + (uint32_t)(v >= 1) +
                    (uint32_t)(v >= 10) + (uint32_t)(v >= 100) + (uint32_t)(v >= 1000) +
                    (uint32_t)(v >= 1e4F);
  float scale = v >= 1e-2F ? 1e6F : 1e7F;
  scale = v >= 1e-1F ? 1e5F : scale;
  scale = v >= 1 ? 1e4F : scale;
  scale = v >= 10 ? 1e3F : scale;
  scale = v >= 100 ? 1e2F : scale;
  scale = v >= 1000 ? 1e1F : scale;
  scale = v >= 1e4F ? 1 : scale;
  *kind = is_plain ? 2 * decade + sign : magnitude == 0 ? TW_DECIMAL_ZERO : TW_DECIMAL_OTHER;

  uint32_t bits = bits_of(v);
  float half_place = float_of((bits & EXPONENT) - TO_HALF_PLACE);
  double power = (double)scale * 1e4;
  double number = (double)v * power, reach = (double)half_place * power;
  /* A tenth is not exact, but off by less than any float is from a tie, and ties stay ties. */
  double nine = nearest(number), eight = 10 * nearest(number * 0.1), seven = 100 * nearest(number * 0.01);
  nine = fabs(number - eight) < reach ? eight : nine;
  nine = fabs(number - seven) < reach ? seven : nine;
  return (uint32_t)(int32_t)nine; /* signed ones are converted by more instruction sets */
}

/* A word whose lowest byte is the first in memory, and back. */
static inline uint64_t first_lowest(uint64_t word) {
  return __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? __builtin_bswap64(word) : word;
}

/* What follows the other eight digits. */
static inline uint64_t last_pieces(uint32_t first_digit) {
  static const uint64_t characters = '0' | '.' << 8 | '0' << 16 | '-' << 24;
  return first_lowest(characters | first_digit);
}

/* The digits of a number below 10^8, one a byte, the last in the lowest: halves, pairs and digits are split
 * side by side (after Paul Khuong, "How to print integers really fast"). */
static inline uint64_t split_eight(uint32_t value) {
  uint64_t halves = value % 10000 | (uint64_t)(value / 10000) << 32;
  uint64_t hundreds = (halves * 10486 >> 20) & 0x7F0000007F; /* exact below 10^4 */
  uint64_t pairs = hundreds << 16 | (halves - 100 * hundreds);
  uint64_t tens = (pairs * 103 >> 10) & 0x000F000F000F000F; /* exact below 100 */
  return tens << 8 | (pairs - 10 * tens);
}

static const uint64_t ZEROS = 0x3030303030303030; /* as characters */
enum { EIGHT_DIGITS = 100000000 };

static inline void find_few(tw_decimals *batch, size_t count) {
  for (size_t i = 0; i < count; i++) {
    uint32_t nine = find_nine(batch->values[i], &batch->kinds[i]), first = nine / EIGHT_DIGITS;
    const uint64_t pieces[] = {first_lowest(split_eight(nine - first * EIGHT_DIGITS) | ZEROS),
                               last_pieces(first)};
    memcpy(batch->pieces + i * TW_PIECES, pieces, sizeof pieces);
  }
}

/* Nine digits are split into a first and two fours, those into pairs, those into digits, each in a loop of
 * its own for vectors of one width. count: of the batch, rounded up to what vectors hold. */
static inline __attribute__((always_inline)) void find_many(tw_decimals *restrict batch, size_t count) {
  uint32_t nines[TW_DECIMALS], firsts[TW_DECIMALS];
  uint16_t fours[2 * TW_DECIMALS], pairs[4 * TW_DECIMALS];
  uint8_t digits[8 * TW_DECIMALS];
  uint64_t eights[TW_DECIMALS], pieces[2 * TW_DECIMALS];
  for (size_t i = 0; i < count; i++) nines[i] = find_nine(batch->values[i], &batch->kinds[i]);
  for (size_t i = 0; i < count; i++) {
    firsts[i] = nines[i] / EIGHT_DIGITS;
    uint32_t eight = nines[i] - EIGHT_DIGITS * firsts[i], four = eight / 10000;
    fours[2 * i] = (uint16_t)(eight - 10000 * four);
    fours[2 * i + 1] = (uint16_t)four;
  }
  for (size_t i = 0; i < 2 * count; i++) {
    uint16_t pair = (uint16_t)(fours[i] / 100);
    pairs[2 * i] = (uint16_t)(fours[i] - 100 * pair);
    pairs[2 * i + 1] = pair;
  }
  for (size_t i = 0; i < 4 * count; i++) {
    uint16_t ten = (uint16_t)(pairs[i] / 10);
    digits[2 * i] = (uint8_t)(pairs[i] - 10 * ten);
    digits[2 * i + 1] = (uint8_t)ten;
  }
  memcpy(eights, digits, count * sizeof *eights);
  for (size_t i = 0; i < count; i++) {
    pieces[2 * i] = eights[i] | ZEROS;
    pieces[2 * i + 1] = last_pieces(firsts[i]);
  }
  memcpy(batch->pieces, pieces, count * TW_PIECES);
}

static void find_decimals(tw_decimals *batch, size_t count) {
  /* LANES: values of the widest vectors. FEW: take less time one by one. */
  enum { LANES = 16, FEW = 4 };
  if (count <= FEW) {
    find_few(batch, count);
    return;
  }
  for (; count % LANES != 0; count++) batch->values[count] = 0;
  find_many(batch, count);
}

/* ---- text ------------------------------------------------------------------------------------------ */

enum { TEXT_MOST = 14 }; /* without the comma */

/* Which piece is where in the text of each kind, with all digits. */
enum { P = TW_PIECE_POINT, O = TW_PIECE_NOUGHT, M = TW_PIECE_MINUS };
static const uint8_t orders[][TW_PIECES] = {
    {O, P, O, O, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {M, O, P, O, O, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {O, P, O, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {M, O, P, O, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {O, P, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {M, O, P, 8, 7, 6, 5, 4, 3, 2, 1, 0},
    {8, P, 7, 6, 5, 4, 3, 2, 1, 0},
    {M, 8, P, 7, 6, 5, 4, 3, 2, 1, 0},
    {8, 7, P, 6, 5, 4, 3, 2, 1, 0},
    {M, 8, 7, P, 6, 5, 4, 3, 2, 1, 0},
    {8, 7, 6, P, 5, 4, 3, 2, 1, 0},
    {M, 8, 7, 6, P, 5, 4, 3, 2, 1, 0},
    {8, 7, 6, 5, P, 4, 3, 2, 1, 0},
    {M, 8, 7, 6, 5, P, 4, 3, 2, 1, 0},
    {8, 7, 6, 5, 4, P, 3, 2, 1, 0},
    {M, 8, 7, 6, 5, 4, P, 3, 2, 1, 0},
    {O},
};
/* How long that is with a comma, by zeros at the end. */
static const uint8_t lengths[][9] = {
    {14, 13, 12, 11, 10, 9, 8, 7, 6}, {15, 14, 13, 12, 11, 10, 9, 8, 7}, {13, 12, 11, 10, 9, 8, 7, 6, 5},
    {14, 13, 12, 11, 10, 9, 8, 7, 6}, {12, 11, 10, 9, 8, 7, 6, 5, 4},    {13, 12, 11, 10, 9, 8, 7, 6, 5},
    {11, 10, 9, 8, 7, 6, 5, 4, 2},    {12, 11, 10, 9, 8, 7, 6, 5, 3},    {11, 10, 9, 8, 7, 6, 5, 3, 3},
    {12, 11, 10, 9, 8, 7, 6, 4, 4},   {11, 10, 9, 8, 7, 6, 4, 4, 4},     {12, 11, 10, 9, 8, 7, 5, 5, 5},
    {11, 10, 9, 8, 7, 5, 5, 5, 5},    {12, 11, 10, 9, 8, 6, 6, 6, 6},    {11, 10, 9, 8, 6, 6, 6, 6, 6},
    {12, 11, 10, 9, 7, 7, 7, 7, 7},   {2, 2, 2, 2, 2, 2, 2, 2, 2},
};

/* out[i] = pieces[order[i]]; all TW_PIECES bytes are written. */
static inline __attribute__((always_inline)) void pick(char *out, const char *pieces, const uint8_t *order) {
#ifdef __AVX2__
  __m128i all = _mm_loadu_si128((const __m128i *)(const void *)pieces);
  __m128i places = _mm_loadu_si128((const __m128i *)(const void *)order);
  _mm_storeu_si128((__m128i *)(void *)out, _mm_shuffle_epi8(all, places));
#elif defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  vst1q_u8((uint8_t *)out, vqtbl1q_u8(vld1q_u8((const uint8_t *)pieces), vld1q_u8(order)));
#else
  for (size_t i = 0; i < TEXT_MOST; i++) out[i] = pieces[order[i]];
#endif
}

/* Rare, and kept out of the way of what is not. */
static __attribute__((noinline)) char *place_other(char *out, float value) {
  out += tw_print_any_float(out, value);
  *out++ = ',';
  return out;
}

/* The batch's value i and a comma. Up to TW_FLOAT_TEXT bytes are written, wherever the text ends. Returns the
 * end. */
static inline __attribute__((always_inline)) char *place(char *out, const tw_decimals *batch, size_t i) {
  uint32_t kind = batch->kinds[i];
  if (kind == TW_DECIMAL_OTHER) return place_other(out, batch->values[i]);
  const char *pieces = batch->pieces + i * TW_PIECES;
  uint64_t word;
  memcpy(&word, pieces, sizeof word);
  word = first_lowest(word ^ ZEROS);
  int zeros = word ? __builtin_ctzll(word) / 8 : 8;
  pick(out, pieces, orders[kind]);
  out += lengths[kind][zeros];
  out[-1] = ',';
  return out;
}

static char *print_row(char *out, const float *values, size_t count) {
  for (size_t first = 0, left; first < count; first += left) {
    tw_decimals batch;
    left = count - first < TW_DECIMALS ? count - first : TW_DECIMALS;
    memcpy(batch.values, values + first, left * sizeof *values);
    find_decimals(&batch, left);
    for (size_t i = 0; i < left; i++) out = place(out, &batch, i);
  }
  return out;
}

/* Inlined, so that the widths of poses are known where they are copied. */
static inline __attribute__((always_inline)) char *print_as_wide(char *out, const tw_vectors *all,
                                                                 size_t width) {
  char *start = out;
  for (size_t first = 0, left; first < all->count; first += left) {
    tw_decimals batch;
    left = all->count - first < TW_DECIMALS / width ? all->count - first : TW_DECIMALS / width;
    for (size_t i = 0; i < left; i++)
      memcpy(batch.values + i * width, all->values + (first + i) * all->stride, width * sizeof(float));
    find_decimals(&batch, left * width);
    for (size_t i = 0; i < left; i++) {
      *out++ = '[';
      for (size_t j = 0; j < width; j++) out = place(out, &batch, i * width + j);
      out[-1] = ']';
      *out++ = ',';
      if (all->ends) all->ends[first + i] = (size_t)(out - start) - 1;
    }
  }
  return out;
}

static char *print_vectors(char *out, const tw_vectors *vectors) {
  switch (vectors->width) {
  case 3: return print_as_wide(out, vectors, 3);
  case 4: return print_as_wide(out, vectors, 4);
  case 16: return print_as_wide(out, vectors, 16);
  default: return print_as_wide(out, vectors, vectors->width);
  }
}

#endif
