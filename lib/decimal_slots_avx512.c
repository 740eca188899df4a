/* Slots of decimal digits on machines with AVX-512 and its multiplications of integers (IFMA) and shuffles of
 * bytes (VBMI).
 *
 * The digits are found as in decimal_kernel.h, by other instructions: 2^52 is added so that the nearest whole
 * number stands in a double's lowest bits, which is where IFMA reads it; and what is multiplied and added in
 * one is exact, or is compared with what is far away. Each step is taken for all numbers before the next one,
 * since a step's instructions wait for each other. The components of rotations are below 1: where all numbers
 * are, their texts have one form, and nothing is looked up.
 *
 * The decade below 1e-3 is taken in as well, down to 2^-13: scaled like the one above it, its numbers have
 * eight digits before the point, which do since the reach is over a half. But a single digit is shorter with
 * an exponent. */
#include "decimal.h"
#include "decimal_slots.h"

#include <immintrin.h>
#include <math.h>

enum {
  GROUPS = TW_SLOTS / TW_GROUP,
  BODY = 2,
  OPEN_BIT = 1 << 0,
  MINUS_BIT = 1 << 1,
  COMMA_BIT = 1 << 15,
  ALL_BITS = COMMA_BIT - 1 /* but that */
};

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

/* Zeros are of a kind of their own behind the decades, with a body like that of the lowest decade. By kind:
 * what may be kept of a slot; how long a body with nine digits is; and how many digits are before the point,
 * whatever they are. */
enum { ZERO_KIND = TW_DECIMAL_DECADES, KINDS = 16 };
enum { PART_0 = 0x7FFE, PART_1 = 0x7FEE, PART_2 = 0x7FCE, PART_ZERO = 1 << BODY };
static const uint32_t parts[KINDS] = {PART_0, PART_1, PART_2, PART_0,   PART_0,
                                      PART_0, PART_0, PART_0, PART_ZERO};
static const uint32_t lengths[KINDS] = {13, 13, 13, 10, 10, 10, 10, 10, 10};
static const uint32_t wholes[KINDS] = {0, 0, 0, 1, 2, 3, 4, 5, 1};
static const double powers[TW_DECIMAL_DECADES] = {1e11, 1e10, 1e9, 1e8, 1e7, 1e6, 1e5, 1e4};

/* By the lowest five bits of a float's exponent, which from 2^1 to 2^16 are 0 to 15 and from 2^-13 to 1 are
 * 18 to 31: the decade of the lowest such float, and where the next one begins, if it does. */
static const uint32_t decades[32] = {3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7,
                                     0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3};
static const float next_decades[32] = {
    10, 10, 10,    100,   100,   100,   1e3F,  1e3F,  1e3F,  1e4F,  1e4F,  1e4F,  1e4F, 1e5F, 1e5F, 1e5F,
    0,  0,  1e-2F, 1e-2F, 1e-2F, 1e-2F, 1e-2F, 1e-2F, 1e-2F, 1e-1F, 1e-1F, 1e-1F, 1,    1,    1,    10};

/* Sixteen numbers, in such an order that unpacking one half's eight digits and the rest gives two blocks: the
 * first halves of four numbers each in turn, then the second ones. */
typedef struct half {
  __m512d power, number, reach;
  __m512i nine, eight, digits, rest;
} half;

typedef struct group {
  __m512i bits, magnitude, plain, kind, part, shift;
  __mmask16 is_zero, is_unsure; /* is_unsure: may have no slot */
  half halves[2];
} group;

static inline __m512i as_int(__m512d x) {
  return _mm512_castpd_si512(x);
}

static inline __m512i bits_of(float value) {
  return _mm512_castps_si512(_mm512_set1_ps(value));
}

static inline void take(group *g, const float *values) {
  const __m512i order = _mm512_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
  /* By blocks, as they were written just now. */
  __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(values)), _mm_load_ps(values + 4), 1);
  __m256 high =
      _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(values + 8)), _mm_load_ps(values + 12), 1);
  __m512 all = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
  g->bits = _mm512_permutexvar_epi32(order, _mm512_castps_si512(all));
  g->magnitude = _mm512_and_si512(g->bits, _mm512_set1_epi32(INT32_MAX));
}

/* Those that have no slot become a half. is_unit: all are below 1. */
static inline __attribute__((always_inline)) void classify(group *g, bool is_unit) {
  const __m512i most = bits_of(1e5F), least = bits_of(0x1p-13F);
  g->is_zero = _mm512_testn_epi32_mask(g->magnitude, g->magnitude);
  __mmask16 has_slot =
      is_unit ? _mm512_cmpge_epi32_mask(g->magnitude, least)
              : _mm512_cmplt_epu32_mask(_mm512_sub_epi32(g->magnitude, least), _mm512_sub_epi32(most, least));
  __mmask16 is_low = _mm512_cmplt_epi32_mask(g->magnitude, bits_of(1e-3F));
  if (!is_unit) is_low = _kor_mask16(is_low, _knot_mask16(has_slot));
  g->plain = _mm512_mask_mov_epi32(bits_of(0.5F), has_slot, g->magnitude);
  g->is_unsure = _kandn_mask16(g->is_zero, is_low);
}

/* ---- decades ------------------------------------------------------------------------------------------ */

/* Of numbers below 1. */
static inline void find_unit_decade(group *g) {
  __mmask16 hundredths = _mm512_cmpge_epi32_mask(g->plain, bits_of(1e-2F)),
            tenths = _mm512_cmpge_epi32_mask(g->plain, bits_of(1e-1F));
  g->part = _mm512_mask_mov_epi32(_mm512_set1_epi32(PART_0), hundredths, _mm512_set1_epi32(PART_1));
  g->part = _mm512_mask_mov_epi32(g->part, tenths, _mm512_set1_epi32(PART_2));
  g->part = _mm512_mask_mov_epi32(g->part, g->is_zero, _mm512_set1_epi32(PART_ZERO));
  for (size_t i = 0; i < 2; i++) {
    __m512d power = _mm512_mask_mov_pd(_mm512_set1_pd(1e11), (__mmask8)hundredths, _mm512_set1_pd(1e10));
    g->halves[i].power = _mm512_mask_mov_pd(power, (__mmask8)tenths, _mm512_set1_pd(1e9));
    hundredths = _kshiftri_mask16(hundredths, 8);
    tenths = _kshiftri_mask16(tenths, 8);
  }
}

static inline void find_decade(group *g) {
  __m512i exponent = _mm512_srli_epi32(g->plain, 23);
  __m512i decade =
      _mm512_permutex2var_epi32(_mm512_loadu_si512(decades), exponent, _mm512_loadu_si512(decades + 16));
  __m512i next = _mm512_permutex2var_epi32(_mm512_loadu_si512(next_decades), exponent,
                                           _mm512_loadu_si512(next_decades + 16));
  decade =
      _mm512_mask_add_epi32(decade, _mm512_cmpge_epi32_mask(g->plain, next), decade, _mm512_set1_epi32(1));
  g->kind = _mm512_mask_mov_epi32(decade, g->is_zero, _mm512_set1_epi32(ZERO_KIND));
  g->part = _mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(parts));
  /* Of 64 bits the lowest three are looked at. */
  const __m512i low = _mm512_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
  const __m512i high = _mm512_setr_epi32(8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13, 14, 14, 15, 15);
  __m512d all = _mm512_loadu_pd(powers);
  g->halves[0].power = _mm512_permutexvar_pd(_mm512_permutexvar_epi32(low, decade), all);
  g->halves[1].power = _mm512_permutexvar_pd(_mm512_permutexvar_epi32(high, decade), all);
}

/* ---- digits ------------------------------------------------------------------------------------------- */

/* The reach from the middle to the next float: half a place more. */
static inline void scale(half *h, __m256 value) {
  __m512d v = _mm512_cvtps_pd(value);
  __m512i middle = _mm512_add_epi64(as_int(v), _mm512_set1_epi64(1LL << 28));
  h->number = _mm512_mul_pd(v, h->power);
  h->reach = _mm512_fmsub_pd(_mm512_castsi512_pd(middle), h->power, h->number);
}

static inline void scale_halves(group *g) {
  __m512 plain = _mm512_castsi512_ps(g->plain);
  scale(&g->halves[0], _mm512_castps512_ps256(plain));
  scale(&g->halves[1], _mm512_extractf32x8_ps(plain, 1));
}

/* The nearest integer to a number from 0 up to 2^51. */
static inline __m512d nearest(__m512d number) {
  const __m512d shift = _mm512_set1_pd(0x1p52);
  return _mm512_sub_pd(_mm512_add_pd(number, shift), shift);
}

/* Nine digits, those that need not be there as zeros, as a number in the lowest bits. */
static inline void shorten(half *h) {
  const __m512d magnitude = _mm512_castsi512_pd(_mm512_set1_epi64(INT64_MAX));
  __m512d eight = nearest(_mm512_mul_pd(h->number, _mm512_set1_pd(0.1)));
  __m512d seven = nearest(_mm512_mul_pd(h->number, _mm512_set1_pd(0.01)));
  __m512d over_eight = _mm512_fnmadd_pd(eight, _mm512_set1_pd(10), h->number);
  __m512d over_seven = _mm512_fnmadd_pd(seven, _mm512_set1_pd(100), h->number);
  __mmask8 is_eight = _mm512_cmp_pd_mask(_mm512_and_pd(over_eight, magnitude), h->reach, _CMP_LT_OQ);
  __mmask8 is_seven = _mm512_cmp_pd_mask(_mm512_and_pd(over_seven, magnitude), h->reach, _CMP_LT_OQ);
  __m512d number = _mm512_mask_sub_pd(h->number, is_eight, h->number, over_eight);
  number = _mm512_mask_sub_pd(number, is_seven, h->number, over_seven);
  h->nine = as_int(_mm512_add_pd(number, _mm512_set1_pd(0x1p52)));
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

/* ---- what is kept ------------------------------------------------------------------------------------- */

/* The lower halves of 64 bits each. */
static inline __m512i join(__m512i a, __m512i b) {
  const __m512i places = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  return _mm512_permutex2var_epi32(a, places, b);
}

/* The zeros at the end of eight digits, in bits; they are in the lowest ones. */
static inline __m512i count_zeros(__m512i digits) {
  return _mm512_popcnt_epi64(_mm512_andnot_si512(digits, _mm512_sub_epi64(digits, _mm512_set1_epi64(1))));
}

/* How many of the nine digits are zeros at the end. */
static inline void find_zeros(group *g) {
  const __m512i digit = _mm512_set1_epi32(0xFF);
  __m512i zeros = join(count_zeros(g->halves[0].digits), count_zeros(g->halves[1].digits));
  __mmask16 is_eight = _mm512_testn_epi32_mask(join(g->halves[0].rest, g->halves[1].rest), digit);
  g->shift = _mm512_maskz_add_epi32(is_eight, _mm512_srli_epi32(zeros, 3), _mm512_set1_epi32(1));
}

/* The bits of bodies up to their last digit that is no zero, and the lower ones. */
static inline __m512i find_bodies(const group *g) {
  __m512i length = _mm512_sub_epi32(_mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(lengths)), g->shift);
  __m512i whole = _mm512_permutexvar_epi32(g->kind, _mm512_loadu_si512(wholes));
  __mmask16 is_whole = _mm512_cmplt_epi32_mask(length, _mm512_add_epi32(whole, _mm512_set1_epi32(2)));
  length = _mm512_mask_mov_epi32(length, is_whole, whole); /* without a point at its end */
  return _mm512_andnot_si512(_mm512_sllv_epi32(_mm512_set1_epi32(-(1 << BODY)), length),
                             _mm512_set1_epi32(ALL_BITS));
}

static inline __attribute__((always_inline)) void find_kept(const group *g, bool is_unit, uint64_t *kept) {
  /* The order of the numbers, by the lower halves of 32 bits. */
  const __m512i places =
      _mm512_zextsi256_si512(_mm256_setr_epi16(0, 4, 8, 12, 2, 6, 10, 14, 16, 20, 24, 28, 18, 22, 26, 30));
  const __m512i signs =
      _mm512_broadcast_i64x4(_mm256_setr_epi32(OPEN_BIT | COMMA_BIT, OPEN_BIT | COMMA_BIT, COMMA_BIT,
                                               COMMA_BIT, COMMA_BIT, COMMA_BIT, COMMA_BIT, COMMA_BIT));
  __m512i body = is_unit ? _mm512_srlv_epi32(_mm512_set1_epi32(ALL_BITS), g->shift) : find_bodies(g);
  __m512i sign = _mm512_or_si512(_mm512_srai_epi32(g->bits, 31), _mm512_set1_epi32(~MINUS_BIT));
  __m512i all = _mm512_or_si512(_mm512_and_si512(body, _mm512_and_si512(g->part, sign)), signs);
  _mm256_storeu_si256((__m256i *)kept, _mm512_castsi512_si256(_mm512_permutexvar_epi16(places, all)));
}

/* ---- text --------------------------------------------------------------------------------------------- */

/* Which bytes make the slots of block i of a group. */
static inline __m512i find_places(const group *g, size_t i) {
  const __m512i lane =
      _mm512_setr_epi32(0, 0, 0, 0, 0x08080808, 0x08080808, 0x08080808, 0x08080808, 0x10101010, 0x10101010,
                        0x10101010, 0x10101010, 0x18181818, 0x18181818, 0x18181818, 0x18181818);
  const __m512i byte =
      _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  const __m512i number = _mm512_add_epi8(lane, _mm512_set1_epi8((char)(32 * (i / 2) + 4 * (i % 2))));
  __m512i kinds = _mm512_slli_epi32(g->kind, 4); /* zeros look like the lowest decade */
  __m512i place = _mm512_or_si512(_mm512_permutexvar_epi8(number, kinds), byte);
  return _mm512_permutex2var_epi8(_mm512_loadu_si512(sources), place, _mm512_loadu_si512(sources[4]));
}

/* The characters that are no digits, and a zero that the ninth digit is added to. */
static inline __m512i find_signs(size_t closed) {
  const __m512i open = _mm512_set1_epi64(0x2C5B2D302E30), closing = _mm512_set1_epi64(0x5D5B2D302E30);
  return _mm512_mask_mov_epi64(open, (__mmask8)(3U << 2 * closed), closing);
}

static inline void put_blocks(const group *g, size_t closed, char (*text)[TW_BLOCK * TW_SLOT]) {
  const __m512i zeros = _mm512_set1_epi64(0x3030303030303030), signs = find_signs(closed);
  for (size_t i = 0; i < 4; i++) {
    __m512i digits = _mm512_or_si512(g->halves[i / 2].digits, zeros);
    __m512i rest = _mm512_or_si512(g->halves[i / 2].rest, signs);
    __m512i bytes = i % 2 ? _mm512_unpackhi_epi64(digits, rest) : _mm512_unpacklo_epi64(digits, rest);
    _mm512_store_si512(text[i], _mm512_shuffle_epi8(bytes, find_places(g, i)));
  }
}

/* Of numbers below 1: their digits are added to a text that has zeros for them. */
static inline void put_unit_blocks(const group *g, size_t closed, char (*text)[TW_BLOCK * TW_SLOT]) {
  enum { REST = 64 };
  const __m512i open = _mm512_broadcast_i32x4(_mm_setr_epi8('[', '-', '0', '.', '0', '0', '0', '0', '0', '0',
                                                            '0', '0', '0', '0', '0', ',')),
                closing = _mm512_broadcast_i32x4(_mm_setr_epi8('[', '-', '0', '.', '0', '0', '0', '0', '0',
                                                               '0', '0', '0', '0', '0', '0', ']'));
  const __m512i slot = _mm512_mask_mov_epi64(open, (__mmask8)(2U << 2 * closed), closing);
  const __m512i order =
      _mm512_broadcast_i32x4(_mm_setr_epi8(0, 0, 0, 0, 0, 0, 7, 6, 5, 4, 3, 2, 1, 0, REST, 0));
  const __m512i lane = _mm512_setr_epi64(0, 0, 0x1010101010101010, 0x1010101010101010, 0x2020202020202020,
                                         0x2020202020202020, 0x3030303030303030, 0x3030303030303030);
  for (size_t i = 0; i < 4; i++) {
    const half *h = &g->halves[i / 2];
    const __m512i places =
        _mm512_add_epi8(_mm512_add_epi8(order, lane), _mm512_set1_epi8((char)(8 * (i % 2))));
    __m512i digits = _mm512_maskz_permutex2var_epi8(0x7FC07FC07FC07FC0, h->digits, places, h->rest);
    _mm512_store_si512(text[i], _mm512_or_si512(slot, digits));
  }
}

/* Returns those that may have no slot. */
static inline __attribute__((always_inline)) uint64_t find_groups(tw_decimal_slots *slots, group *g,
                                                                  size_t count, bool is_unit, size_t closed) {
  uint64_t unsure = 0;
  for (size_t i = 0; i < count; i++) classify(&g[i], is_unit);
  for (size_t i = 0; i < count; i++) unsure |= (uint64_t)g[i].is_unsure << TW_GROUP * i;
  for (size_t i = 0; i < count; i++)
    if (is_unit)
      find_unit_decade(&g[i]);
    else
      find_decade(&g[i]);
  for (size_t i = 0; i < count; i++) scale_halves(&g[i]);
  for (size_t i = 0; i < 2 * count; i++) shorten(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_nine(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_fours(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < count; i++) find_zeros(&g[i]);
  for (size_t i = 0; i < count; i++) find_kept(&g[i], is_unit, slots->kept + TW_GROUP / TW_BLOCK * i);
  for (size_t i = 0; i < count; i++) {
    char(*text)[TW_BLOCK * TW_SLOT] = slots->text + TW_GROUP / TW_BLOCK * i;
    if (is_unit)
      put_unit_blocks(&g[i], closed, text);
    else
      put_blocks(&g[i], closed, text);
  }
  return unsure;
}

static inline __attribute__((always_inline)) uint64_t find_some(tw_decimal_slots *slots, size_t count,
                                                                size_t closed) {
  group g[GROUPS];
  for (size_t i = 0; i < count; i++) take(&g[i], slots->values + TW_GROUP * i);
  __m512i most = g[0].magnitude;
  for (size_t i = 1; i < count; i++) most = _mm512_max_epu32(most, g[i].magnitude);
  bool is_unit = !_mm512_cmpge_epu32_mask(most, bits_of(1));
  return is_unit ? find_groups(slots, g, count, true, closed) : find_groups(slots, g, count, false, closed);
}

/* Those of some that have no slot. In `unsure` numbers are in the order of groups. */
static __attribute__((noinline)) uint64_t find_others(const tw_decimal_slots *slots, uint64_t unsure) {
  enum { BEHIND_FIRST = 0x7F00 }; /* of a slot, in the lowest decade */
  uint64_t others = _pdep_u64(_pext_u64(unsure, 0x5555555555555555), 0x0F0F0F0F0F0F0F0F) |
                    _pdep_u64(_pext_u64(unsure, 0xAAAAAAAAAAAAAAAA), 0xF0F0F0F0F0F0F0F0);
  for (uint64_t left = others; left; left &= left - 1) {
    int i = __builtin_ctzll(left);
    float magnitude = fabsf(slots->values[i]);
    bool has_digits = slots->kept[i / TW_BLOCK] >> TW_SLOT * (i % TW_BLOCK) & BEHIND_FIRST;
    if (magnitude >= 0x1p-13F && magnitude < 1e-3F && has_digits) others &= ~(1ULL << i);
  }
  return others;
}

void tw_decimal_slots_find(tw_decimal_slots *slots, size_t count, size_t closed) {
  size_t groups = count <= TW_GROUP ? 1 : count <= 2 * (size_t)TW_GROUP ? 2 : GROUPS;
  for (; count < groups * TW_GROUP; count += TW_BLOCK) _mm_store_ps(slots->values + count, _mm_setzero_ps());
  uint64_t unsure = groups == 1   ? find_some(slots, 1, closed)
                    : groups == 2 ? find_some(slots, 2, closed)
                                  : find_some(slots, GROUPS, closed);
  slots->others = unsure ? find_others(slots, unsure) : 0;
}
