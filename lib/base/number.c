/* Prints floats as their shortest decimal text, in batches: loops that the compiler vectorises find the
 * digits, then one byte shuffle for each number places them. Compiled for the baseline and for AVX2; both
 * give the same bytes.
 *
 * The kernel covers magnitudes from 1e-3 to 1e5, where all arithmetic is exact in doubles: a float times the
 * power of ten that gives it nine digits before the point has at most 24 + 26 bits (5^11 has 26), and half
 * the distance to the neighbouring float times that power has 26. A decimal within that half distance reads
 * back as the float. No nine-digit decimal lies exactly at half distance, because the midpoint of two such
 * floats has at least 13 digits. The half distance is between 2.9 and 49 units of the ninth digit, so:
 * - the nearest nine digits always read back;
 * - the nearest multiple of 10 is shorter, where it is within the half distance;
 * - at most one multiple of 100 is within it, and is then the shortest; its further zeros are dropped as
 *   text.
 * Below a power of two the half distance is half as long, but such floats are multiples of 100 themselves. */
#include "number.h"

#include <math.h>
#include <string.h>

#ifdef __x86_64__
#include <immintrin.h>
#elif defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
#include <arm_neon.h>
#endif

#define INLINE static inline __attribute__((always_inline))

enum {
  BATCH = 64,  /* numbers */
  LANES = 8,   /* batches are padded to a multiple, so that vector loops have no remainder */
  DECADES = 8, /* from 1e-3 to 1e5 */
  KIND_OTHER = 2 * DECADES + 1
};

/* A batch of numbers. A kind is 2 * decade, plus 1 for negative numbers; 2 * DECADES for 0; KIND_OTHER for
 * numbers that the kernel does not cover. pieces: the characters that a number's text is picked from. They
 * are its nine digits, the last one first, so that trailing zeros are the lowest bits of a word; then the
 * point, '0' and '-'. */
enum { PIECE_POINT = 9, PIECE_ZERO, PIECE_MINUS, PIECES = 16 };
typedef struct batch {
  float values[BATCH];
  uint32_t kinds[BATCH];
  uint64_t pieces[2 * BATCH];
} batch;

/* ---- digits ---------------------------------------------------------------------------------- */

/* The bits of a float's exponent, and what to subtract from them to get half a unit of the last place. */
enum { EXPONENT = 0x7F800000, TO_HALF_ULP = 24 << 23 };

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

/* The nearest integer, ties to even, of 0 <= x < 2^51: doubles from 2^52 on have no fraction. */
static inline double nearest(double x) {
  return (x + 0x1p52) - 0x1p52;
}

/* Finds a value's kind, its magnitude (1 where the kernel does not cover it), and the scale: the power of ten
 * that gives the magnitude five digits before the point. */
INLINE uint32_t find_kind(float value, float *magnitude, float *scale) {
  uint32_t sign = bits_of(value) >> 31;
  float size = fabsf(value);
  bool is_covered = size >= 1e-3F && size < 1e5F;
  float v = is_covered ? size : 1;
  /* Each bound is the float nearest to a power of ten, and prints as that. */
  uint32_t decade = (uint32_t)(v >= 1e-2F) + (uint32_t)(v >= 1e-1F) + (uint32_t)(v >= 1) +
                    (uint32_t)(v >= 10) + (uint32_t)(v >= 100) + (uint32_t)(v >= 1000) +
                    (uint32_t)(v >= 1e4F);
  float power = v >= 1e-2F ? 1e6F : 1e7F;
  power = v >= 1e-1F ? 1e5F : power;
  power = v >= 1 ? 1e4F : power;
  power = v >= 10 ? 1e3F : power;
  power = v >= 100 ? 1e2F : power;
  power = v >= 1000 ? 1e1F : power;
  power = v >= 1e4F ? 1 : power;
  *magnitude = v;
  *scale = power;
  return is_covered ? 2 * decade + sign : size == 0 ? 2 * DECADES : KIND_OTHER;
}

/* The nine digits of a magnitude as an integer. */
INLINE uint32_t find_digits(float v, float scale) {
  float half_ulp = float_of((bits_of(v) & EXPONENT) - TO_HALF_ULP);
  double power = (double)scale * 1e4;
  double number = (double)v * power, distance = (double)half_ulp * power;
  /* 0.1 is inexact, but its error is less than any float's distance from a tie; ties stay ties. */
  double nine = nearest(number), eight = 10 * nearest(number * 0.1), seven = 100 * nearest(number * 0.01);
  nine = fabs(number - eight) < distance ? eight : nine;
  nine = fabs(number - seven) < distance ? seven : nine;
  return (uint32_t)(int32_t)nine; /* more instruction sets convert to signed integers */
}

static const uint64_t ZEROS = 0x3030303030303030; /* eight characters '0' */
enum { EIGHT_DIGITS = 100000000 };

/* Swaps the bytes of a word on big-endian machines: its lowest byte is then the first in memory. */
static inline uint64_t little_endian(uint64_t word) {
  return __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? __builtin_bswap64(word) : word;
}

/* Finds kinds and pieces of the first `count` values. Each step is a loop of its own, over vectors of one
 * width. Nine digits are split into the first digit and two groups of four, groups into pairs, pairs into
 * digits. */
INLINE void find_pieces_body(batch *restrict b, size_t count) {
  static const uint64_t others = '0' | '.' << 8 | '0' << 16 | '-' << 24;
  float magnitudes[BATCH], scales[BATCH];
  uint32_t nines[BATCH], firsts[BATCH];
  uint16_t fours[2 * BATCH], pairs[4 * BATCH];
  uint8_t digits[8 * BATCH];
  for (; count % LANES != 0; count++) b->values[count] = 0;
  for (size_t i = 0; i < count; i++) b->kinds[i] = find_kind(b->values[i], &magnitudes[i], &scales[i]);
  for (size_t i = 0; i < count; i++) nines[i] = find_digits(magnitudes[i], scales[i]);
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
  for (size_t i = 0; i < count; i++) {
    uint64_t eight;
    memcpy(&eight, digits + 8 * i, sizeof eight);
    b->pieces[2 * i] = eight | ZEROS;
    b->pieces[2 * i + 1] = little_endian(others | firsts[i]);
  }
}

/* Separate functions: inlined into the printing loops, GCC generates worse code for both. */
static __attribute__((noinline)) void find_pieces_baseline(batch *b, size_t count) {
  find_pieces_body(b, count);
}

#ifdef __x86_64__
static __attribute__((noinline, target("avx2"))) void find_pieces_avx2(batch *b, size_t count) {
  find_pieces_body(b, count);
}
#endif

INLINE void find_pieces(batch *b, size_t count, bool avx2) {
#ifdef __x86_64__
  if (avx2) {
    find_pieces_avx2(b, count);
    return;
  }
#endif
  (void)avx2;
  find_pieces_baseline(b, count);
}

/* ---- text ------------------------------------------------------------------------------------ */

enum { TEXT_MOST = 14 }; /* without the comma */

/* For each kind, the piece at each position of the text with all nine digits. */
enum { P = PIECE_POINT, O = PIECE_ZERO, M = PIECE_MINUS };
static const uint8_t orders[][PIECES] = {
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
/* The length of that text with a comma, by the number of trailing zeros. */
static const uint8_t lengths[][9] = {
    {14, 13, 12, 11, 10, 9, 8, 7, 6}, {15, 14, 13, 12, 11, 10, 9, 8, 7}, {13, 12, 11, 10, 9, 8, 7, 6, 5},
    {14, 13, 12, 11, 10, 9, 8, 7, 6}, {12, 11, 10, 9, 8, 7, 6, 5, 4},    {13, 12, 11, 10, 9, 8, 7, 6, 5},
    {11, 10, 9, 8, 7, 6, 5, 4, 2},    {12, 11, 10, 9, 8, 7, 6, 5, 3},    {11, 10, 9, 8, 7, 6, 5, 3, 3},
    {12, 11, 10, 9, 8, 7, 6, 4, 4},   {11, 10, 9, 8, 7, 6, 4, 4, 4},     {12, 11, 10, 9, 8, 7, 5, 5, 5},
    {11, 10, 9, 8, 7, 5, 5, 5, 5},    {12, 11, 10, 9, 8, 6, 6, 6, 6},    {11, 10, 9, 8, 6, 6, 6, 6, 6},
    {12, 11, 10, 9, 7, 7, 7, 7, 7},   {2, 2, 2, 2, 2, 2, 2, 2, 2},
};

#ifdef __x86_64__
/* Not always_inline: bodies that are not compiled for AVX2 contain calls of it, which are then removed as
 * dead code. */
__attribute__((target("avx2"))) static inline void shuffle_avx2(char *out, const char *pieces,
                                                                const uint8_t *order) {
  __m128i all = _mm_loadu_si128((const __m128i *)(const void *)pieces);
  __m128i places = _mm_loadu_si128((const __m128i *)(const void *)order);
  _mm_storeu_si128((__m128i *)(void *)out, _mm_shuffle_epi8(all, places));
}
#endif

/* out[i] = pieces[order[i]]; up to PIECES bytes are written. */
INLINE void shuffle(char *out, const char *pieces, const uint8_t *order, bool avx2) {
#ifdef __x86_64__
  if (avx2) {
    shuffle_avx2(out, pieces, order);
    return;
  }
#elif defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  vst1q_u8((uint8_t *)out, vqtbl1q_u8(vld1q_u8((const uint8_t *)pieces), vld1q_u8(order)));
  return;
#endif
  (void)avx2;
  for (size_t i = 0; i < TEXT_MOST; i++) out[i] = pieces[order[i]];
}

/* Rare, so kept out of the loop. */
static __attribute__((noinline)) char *put_other(char *out, float value) {
  out += tw_print_float(out, value);
  *out++ = ',';
  return out;
}

/* Writes value i and a comma, touching up to TW_FLOAT_TEXT bytes. Returns the end of the text. */
INLINE char *put_number(char *out, const batch *b, size_t i, bool avx2) {
  uint32_t kind = b->kinds[i];
  if (kind == KIND_OTHER) return put_other(out, b->values[i]);
  uint64_t word = little_endian(b->pieces[2 * i] ^ ZEROS);
  int zeros = word ? __builtin_ctzll(word) / 8 : 8;
  shuffle(out, (const char *)&b->pieces[2 * i], orders[kind], avx2);
  out += lengths[kind][zeros];
  out[-1] = ',';
  return out;
}

INLINE char *print_row(char *out, const float *values, size_t count, bool avx2) {
  for (size_t first = 0, some; first < count; first += some) {
    batch b;
    some = count - first < BATCH ? count - first : BATCH;
    memcpy(b.values, values + first, some * sizeof *values);
    find_pieces(&b, some, avx2);
    for (size_t i = 0; i < some; i++) out = put_number(out, &b, i, avx2);
  }
  return out;
}

/* Prints one vector after another: for vectors of no numbers, or of more than a batch. */
INLINE char *print_each(char *out, const tw_vectors *all, bool avx2) {
  const char *start = out;
  for (size_t i = 0; i < all->count; i++) {
    *out++ = '[';
    out = print_row(out, all->values + i * all->stride, all->width, avx2);
    if (all->width > 0) out--; /* the comma */
    *out++ = ']';
    if (all->ends) all->ends[i] = (size_t)(out - start);
    *out++ = ',';
  }
  return out;
}

INLINE char *print_width(char *out, const tw_vectors *all, size_t width, bool avx2) {
  const char *start = out;
  for (size_t first = 0, some; first < all->count; first += some) {
    batch b;
    some = all->count - first < BATCH / width ? all->count - first : BATCH / width;
    for (size_t i = 0; i < some; i++)
      memcpy(b.values + i * width, all->values + (first + i) * all->stride, width * sizeof(float));
    find_pieces(&b, some * width, avx2);
    for (size_t i = 0; i < some; i++) {
      *out++ = '[';
      for (size_t c = 0; c < width; c++) out = put_number(out, &b, i * width + c, avx2);
      memcpy(out - 1, "],", 2);
      if (all->ends) all->ends[first + i] = (size_t)(out - start);
      out++;
    }
  }
  return out;
}

INLINE char *print_vectors(char *out, const tw_vectors *all, bool avx2) {
  switch (all->width) { /* constant widths let the compiler unroll the copies */
  case 3: return print_width(out, all, 3, avx2);
  case 4: return print_width(out, all, 4, avx2);
  default: break;
  }
  if (all->width == 0 || all->width > BATCH) return print_each(out, all, avx2);
  return print_width(out, all, all->width, avx2);
}

/* ---- variants -------------------------------------------------------------------------------- */

static char *print_vectors_baseline(char *out, const tw_vectors *vectors) {
  return print_vectors(out, vectors, false);
}

#ifdef __x86_64__
__attribute__((target("avx2"))) static char *print_vectors_avx2(char *out, const tw_vectors *vectors) {
  return print_vectors(out, vectors, true);
}
#endif

tw_number_printer *tw_number_printer_at(uint32_t variant) {
#ifdef __x86_64__
  if (variant == 1) return __builtin_cpu_supports("avx2") ? print_vectors_avx2 : NULL;
#endif
  return variant == 0 ? print_vectors_baseline : NULL;
}

size_t tw_print_vectors(char *out, const tw_vectors *vectors) {
  tw_number_printer *best = tw_number_printer_at(1);
  char *end = best ? best(out, vectors) : print_vectors_baseline(out, vectors);
  return (size_t)(end - out) - (vectors->count > 0 ? 1 : 0);
}
