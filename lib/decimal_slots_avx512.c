/* Slots of decimal digits on machines with AVX-512 and its multiplications of integers (IFMA) and shuffles of
 * bytes (VBMI).
 *
 * The digits are found as in decimal_kernel.h, by other instructions: 2^52 is added so that the nearest whole
 * number stands in a double's lowest bits, which is where IFMA reads it; and what is multiplied and added in
 * one is exact, or is compared with what is far away. Each step is taken for all numbers before the next one,
 * since a step's instructions wait for each other. */
#include "decimal.h"
#include "decimal_slots.h"

#include <immintrin.h>

enum { GROUPS = TW_SLOTS / TW_GROUP, BODY = 2, OPEN_BIT = 1 << 0, MINUS_BIT = 1 << 1, COMMA_BIT = 1 << 15 };

/* Where the bytes of slots come from: eight digits, the last of them first, the ninth, and these. */
enum { NINTH = 8, POINT, ZERO, MINUS, OPEN, COMMA };

/* By decade. Below 1 there are as many zeros as the lowest needs, and the others lose some. */
static const uint8_t sources[TW_DECIMAL_DECADES][TW_SLOT] = {
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, 7, 6, 5, 4, 3, 2, 1, 0, NINTH, COMMA},
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, 7, 6, 5, 4, 3, 2, 1, 0, NINTH, COMMA},
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, 7, 6, 5, 4, 3, 2, 1, 0, NINTH, COMMA},
    {OPEN, MINUS, 7, POINT, 6, 5, 4, 3, 2, 1, 0, NINTH, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, 7, 6, POINT, 5, 4, 3, 2, 1, 0, NINTH, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, 7, 6, 5, POINT, 4, 3, 2, 1, 0, NINTH, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, 7, 6, 5, 4, POINT, 3, 2, 1, 0, NINTH, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, 7, 6, 5, 4, 3, POINT, 2, 1, 0, NINTH, ZERO, ZERO, ZERO, COMMA},
};

/* Zeros are of a kind of their own behind the decades: they are printed as 1 would be, with a body like that
 * of the lowest decade. By kind: what may be kept of a slot; how long a body with eight digits is; and how
 * many digits are before the point, whatever they are. */
enum { ZERO_KIND = TW_DECIMAL_DECADES, KINDS = 16 };
static const uint32_t parts[KINDS] = {0x7FFE, 0x7FEE, 0x7FCE, 0x7FFE, 0x7FFE, 0x7FFE, 0x7FFE, 0x7FFE, 0x7FFC};
static const uint32_t lengths[KINDS] = {12, 12, 12, 9, 9, 9, 9, 9, 9};
static const uint32_t wholes[KINDS] = {0, 0, 0, 1, 2, 3, 4, 5, 1};
static const double powers[TW_DECIMAL_DECADES] = {1e11, 1e10, 1e9, 1e8, 1e7, 1e6, 1e5, 1e4};

/* By the lowest five bits of a float's exponent, which from 2^1 to 2^16 are 0 to 15 and from 2^-10 to 1 are
 * 21 to 31: the decade of the lowest such float, and where the next one begins, if it does. */
static const uint32_t decades[32] = {3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7,
                                     0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3};
static const float next_decades[32] = {
    10, 10, 10, 100, 100, 100,   1e3F,  1e3F,  1e3F,  1e4F,  1e4F,  1e4F,  1e4F, 1e5F, 1e5F, 1e5F,
    0,  0,  0,  0,   0,   1e-2F, 1e-2F, 1e-2F, 1e-2F, 1e-1F, 1e-1F, 1e-1F, 1,    1,    1,    10};

/* Sixteen numbers. Two halves have their digits, eight numbers each, in such an order that unpacking one
 * gives two blocks. */
typedef struct half {
  __m512d number, reach;
  __m512i nine, eight, digits, rest;
} half;

typedef struct group {
  __m512i bits, plain, decade, kind, zeros;
  __mmask16 is_zero, is_other;
  half halves[2];
} group;

static inline __m512i as_int(__m512d x) {
  return _mm512_castpd_si512(x);
}

/* The kind of each; those that have none become 1. */
static inline void classify(group *g, const float *values) {
  const __m512i least = _mm512_castps_si512(_mm512_set1_ps(1e-3F));
  const __m512i span = _mm512_set1_epi32(0x47C35000 - 0x3A83126F); /* from 1e-3 to 1e5, as bits */
  /* By blocks, as they were written just now. */
  __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(values)), _mm_load_ps(values + 4), 1);
  __m256 high =
      _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(values + 8)), _mm_load_ps(values + 12), 1);
  g->bits = _mm512_castps_si512(_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1));
  __m512i magnitude = _mm512_and_si512(g->bits, _mm512_set1_epi32(INT32_MAX));
  __mmask16 is_plain = _mm512_cmplt_epu32_mask(_mm512_sub_epi32(magnitude, least), span);
  g->is_zero = _mm512_testn_epi32_mask(magnitude, magnitude);
  g->is_other = _knot_mask16(_kor_mask16(is_plain, g->is_zero));
  g->plain = _mm512_mask_mov_epi32(_mm512_castps_si512(_mm512_set1_ps(1)), is_plain, magnitude);
}

static inline void find_decade(group *g) {
  __m512i exponent = _mm512_srli_epi32(g->plain, 23);
  __m512i decade =
      _mm512_permutex2var_epi32(_mm512_loadu_si512(decades), exponent, _mm512_loadu_si512(decades + 16));
  __m512i next = _mm512_permutex2var_epi32(_mm512_loadu_si512(next_decades), exponent,
                                           _mm512_loadu_si512(next_decades + 16));
  g->decade =
      _mm512_mask_add_epi32(decade, _mm512_cmpge_epi32_mask(g->plain, next), decade, _mm512_set1_epi32(1));
  g->kind = _mm512_mask_mov_epi32(g->decade, g->is_zero, _mm512_set1_epi32(ZERO_KIND));
}

static inline void scale(half *h, __m256 value, __m512i decade) {
  const __m512i exponent = _mm512_set1_epi64(0x7FF0000000000000),
                to_half_place = _mm512_set1_epi64(24LL << 52);
  __m512d v = _mm512_cvtps_pd(value), power = _mm512_permutexvar_pd(decade, _mm512_loadu_pd(powers));
  __m512i half_place = _mm512_sub_epi64(_mm512_and_si512(as_int(v), exponent), to_half_place);
  h->number = _mm512_mul_pd(v, power);
  h->reach = _mm512_mul_pd(_mm512_castsi512_pd(half_place), power);
}

static inline void scale_halves(group *g) {
  const __m512i order = _mm512_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
  /* Of 64 bits the lowest three are looked at. */
  const __m512i low = _mm512_setr_epi32(0, 0, 4, 4, 1, 1, 5, 5, 2, 2, 6, 6, 3, 3, 7, 7);
  const __m512i high = _mm512_setr_epi32(8, 8, 12, 12, 9, 9, 13, 13, 10, 10, 14, 14, 11, 11, 15, 15);
  __m512 ordered = _mm512_castsi512_ps(_mm512_permutexvar_epi32(order, g->plain));
  scale(&g->halves[0], _mm512_castps512_ps256(ordered), _mm512_permutexvar_epi32(low, g->decade));
  scale(&g->halves[1], _mm512_extractf32x8_ps(ordered, 1), _mm512_permutexvar_epi32(high, g->decade));
}

/* Nine digits, those that need not be there as zeros, as a number in the lowest bits. */
static inline void shorten(half *h) {
  const __m512d ones = _mm512_set1_pd(0x1p52), magnitude = _mm512_castsi512_pd(_mm512_set1_epi64(INT64_MAX));
  __m512d eight = _mm512_sub_pd(_mm512_add_pd(_mm512_mul_pd(h->number, _mm512_set1_pd(0.1)), ones), ones);
  __m512d seven = _mm512_sub_pd(_mm512_fmadd_pd(h->number, _mm512_set1_pd(0.01), ones), ones);
  __m512d over_eight = _mm512_fnmadd_pd(eight, _mm512_set1_pd(10), h->number);
  __m512d over_seven = _mm512_fnmadd_pd(seven, _mm512_set1_pd(100), h->number);
  __mmask8 is_eight = _mm512_cmp_pd_mask(_mm512_and_pd(over_eight, magnitude), h->reach, _CMP_LT_OQ);
  __mmask8 is_seven = _mm512_cmp_pd_mask(_mm512_and_pd(over_seven, magnitude), h->reach, _CMP_LT_OQ);
  __m512d number = _mm512_mask_sub_pd(h->number, is_eight, h->number, over_eight);
  number = _mm512_mask_sub_pd(number, is_seven, h->number, over_seven);
  h->nine = as_int(_mm512_add_pd(number, ones));
}

/* Divided by what is multiplied with 2^52 over it, rounded up, which is exact for numbers below 2^30. */
static inline __m512i divide(__m512i number, int64_t reciprocal) {
  return _mm512_madd52hi_epu64(_mm512_setzero_si512(), number, _mm512_set1_epi64(reciprocal));
}

/* Adds a multiple of `number`, below 2^52; with one below 0, the sum is right in its lowest 52 bits. */
static inline __m512i add_multiple(__m512i to, __m512i number, int64_t factor) {
  return _mm512_madd52lo_epu64(to, number, _mm512_set1_epi64(factor & ((1LL << 52) - 1)));
}

/* Eight digits and one; and of the eight the first four into the upper half. */
static inline void split_nine(half *h) {
  h->eight = divide(h->nine, 450359962737050);
  h->rest = add_multiple(h->nine, h->eight, -10);
  h->digits = add_multiple(h->eight, divide(h->eight, 450359962738), (1LL << 32) - 10000);
}

/* Fours into pairs, and those into digits, each first one into the upper half. */
static inline void split_fours(half *h) {
  __m512i pair =
      _mm512_srli_epi32(_mm512_mulhi_epu16(h->digits, _mm512_set1_epi32(5243)), 3); /* below 10^4 */
  __m512i pairs = _mm512_add_epi32(h->digits, _mm512_mullo_epi32(pair, _mm512_set1_epi32((1 << 16) - 100)));
  __m512i ten = _mm512_mulhi_epu16(pairs, _mm512_set1_epi16(6554)); /* below 100 */
  h->digits = _mm512_add_epi16(pairs, _mm512_maddubs_epi16(_mm512_set1_epi16((1 << 8) - 10), ten));
}

/* The lower halves of 64 bits each, in the order of the numbers. */
static inline __m512i join(__m512i a, __m512i b) {
  const __m512i places = _mm512_setr_epi32(0, 4, 8, 12, 2, 6, 10, 14, 16, 20, 24, 28, 18, 22, 26, 30);
  return _mm512_permutex2var_epi32(a, places, b);
}

/* The zeros at the end of eight digits, in bits; they are in the lowest ones. */
static inline __m512i count_zeros(__m512i digits) {
  return _mm512_popcnt_epi64(_mm512_andnot_si512(digits, _mm512_sub_epi64(digits, _mm512_set1_epi64(1))));
}

/* The zeros at the end of eight digits; of nine, one less than none. */
static inline void find_zeros(group *g) {
  __m512i ninths = join(g->halves[0].rest, g->halves[1].rest);
  __m512i zeros = join(count_zeros(g->halves[0].digits), count_zeros(g->halves[1].digits));
  g->zeros = _mm512_mask_mov_epi32(_mm512_srli_epi32(zeros, 3), _mm512_test_epi32_mask(ninths, ninths),
                                   _mm512_set1_epi32(-1));
}

static inline void find_kept(const group *g, uint64_t *kept) {
  __m512i length = _mm512_sub_epi32(_mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(lengths)), g->zeros);
  __m512i whole = _mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(wholes));
  __mmask16 is_whole = _mm512_cmplt_epi32_mask(length, _mm512_add_epi32(whole, _mm512_set1_epi32(2)));
  length = _mm512_mask_mov_epi32(length, is_whole, whole); /* without a point at its end */
  __m512i dropped = _mm512_sllv_epi32(_mm512_set1_epi32(-(1 << BODY)), length);
  __mmask16 is_positive = _mm512_cmpge_epi32_mask(g->bits, _mm512_setzero_si512());
  dropped = _mm512_mask_or_epi32(dropped, is_positive, dropped, _mm512_set1_epi32(MINUS_BIT));
  __m512i part = _mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(parts));
  const __m512i signs =
      _mm512_broadcast_i32x4(_mm_setr_epi32(OPEN_BIT | COMMA_BIT, COMMA_BIT, COMMA_BIT, COMMA_BIT));
  __m512i all = _mm512_or_si512(_mm512_andnot_si512(dropped, part), signs);
  _mm256_storeu_si256((__m256i *)kept, _mm512_cvtepi32_epi16(all));
}

/* The slots of block i of a group, from the digits and the other bytes of its numbers. */
static inline void put_block(__m512i kinds, size_t i, __m512i bytes, char *text) {
  const __m512i lane =
      _mm512_setr_epi32(0, 0, 0, 0, 0x04040404, 0x04040404, 0x04040404, 0x04040404, 0x08080808, 0x08080808,
                        0x08080808, 0x08080808, 0x0C0C0C0C, 0x0C0C0C0C, 0x0C0C0C0C, 0x0C0C0C0C);
  const __m512i byte =
      _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  const __m512i number = _mm512_add_epi8(lane, _mm512_set1_epi8((char)(TW_SLOT * i)));
  __m512i place = _mm512_or_si512(_mm512_permutexvar_epi8(number, kinds), byte);
  place = _mm512_permutex2var_epi8(_mm512_loadu_si512(sources), place, _mm512_loadu_si512(sources[4]));
  _mm512_store_si512(text, _mm512_shuffle_epi8(bytes, place));
}

static inline void put_blocks(const group *g, char (*text)[TW_BLOCK * TW_SLOT]) {
  const __m512i zeros = _mm512_set1_epi64(0x3030303030303030), signs = _mm512_set1_epi64(0x2C5B2D302E30);
  __m512i kinds = _mm512_slli_epi32(g->kind, 4); /* zeros look like the lowest decade */
  for (size_t i = 0; i < 2; i++) {
    __m512i digits = _mm512_or_si512(g->halves[i].digits, zeros);
    __m512i rest = _mm512_or_si512(g->halves[i].rest, signs);
    put_block(kinds, 2 * i, _mm512_unpacklo_epi64(digits, rest), text[2 * i]);
    put_block(kinds, 2 * i + 1, _mm512_unpackhi_epi64(digits, rest), text[2 * i + 1]);
  }
}

/* Returns the others. */
static inline __attribute__((always_inline)) uint64_t find_groups(tw_decimal_slots *slots, size_t count) {
  group g[GROUPS];
  uint64_t others = 0;
  for (size_t i = 0; i < count; i++) classify(&g[i], slots->values + TW_GROUP * i);
  for (size_t i = 0; i < count; i++) others |= (uint64_t)g[i].is_other << TW_GROUP * i;
  for (size_t i = 0; i < count; i++) find_decade(&g[i]);
  for (size_t i = 0; i < count; i++) scale_halves(&g[i]);
  for (size_t i = 0; i < 2 * count; i++) shorten(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_nine(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_fours(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < count; i++) find_zeros(&g[i]);
  for (size_t i = 0; i < count; i++) find_kept(&g[i], slots->kept + TW_GROUP / TW_BLOCK * i);
  for (size_t i = 0; i < count; i++) put_blocks(&g[i], slots->text + TW_GROUP / TW_BLOCK * i);
  return others;
}

void tw_decimal_slots_find(tw_decimal_slots *slots, size_t count) {
  uint64_t others = count <= TW_GROUP               ? find_groups(slots, 1)
                    : count <= 2 * (size_t)TW_GROUP ? find_groups(slots, 2)
                                                    : find_groups(slots, GROUPS);
  slots->others = count < TW_SLOTS ? others & ((1ULL << count) - 1) : others;
}
