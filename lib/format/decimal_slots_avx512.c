/* Slots of decimal digits on machines with AVX-512 and its multiplications of integers (IFMA) and shuffles of
 * bytes (VBMI).
 *
 * From 2^-13 to 1e5 a float's exponent says which power of ten makes of half its last place something between
 * a half and five. Within that reach lies what reads back as the float: so the nearest whole number will do,
 * and of the multiples of ten no more than one, which is then the shortest; that it may end in yet more zeros
 * is seen in the text. All of it is exact in doubles, and nothing lies at the end of the reach, as in
 * decimal_kernel.h. Whole numbers have nine digits, the first of which is 0 or 1. Below a power of two the
 * reach is half as much, but down to 2^-11 these are whole numbers themselves, and 2^-12 and 2^-13 lie a half
 * and a quarter from theirs, which is within.
 *
 * 2^52 is added so that the whole number stands in a double's lowest bits, which is where IFMA reads it. Each
 * step is taken for all numbers before the next one, since a step's instructions wait for each other. The
 * components of rotations are below 1: where all numbers are, their texts have one form, and less is looked
 * up.
 *
 * Below 1e-3 a single digit is shorter with an exponent. */
#include "decimal.h"
#include "decimal_slots.h"

#include <immintrin.h>
#include <math.h>

enum {
  GROUPS = TW_SLOTS / TW_GROUP,
  BODY = 2,
  OPEN_BIT = 1 << 0,
  MINUS_BIT = 1 << 1,
  NINTH_BIT = 1 << BODY, /* of numbers from 1 on */
  COMMA_BIT = 1 << 15,
  ALL_BITS = COMMA_BIT - 1 /* but that */
};

/* Where the bytes of slots come from: of two words a number, those of the second one 64 further on. D1 is the
 * last digit. */
enum { D1, D2, D4, D5, D7, D8, OPEN, MINUS, POINT = 64, D3, ZERO, D6, COMMA, D9 };

/* Numbers by how many digits are behind the point; NONE are zeros. Only the lowest three bits choose a row of
 * sources. */
enum { EIGHT, TEN, SEVEN, SIX, FIVE, FOUR, THREE, NONE, NINE, ELEVEN, KINDS = 16, ROWS = 8 };

/* Below 1 there are as many zeros as the lowest need, and the others lose some. */
alignas(64) static const uint8_t sources[ROWS][TW_SLOT] = {
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, D9, D8, D7, D6, D5, D4, D3, D2, D1, COMMA},
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, D9, D8, D7, D6, D5, D4, D3, D2, D1, COMMA},
    {OPEN, MINUS, D9, D8, POINT, D7, D6, D5, D4, D3, D2, D1, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, D9, D8, D7, POINT, D6, D5, D4, D3, D2, D1, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, D9, D8, D7, D6, POINT, D5, D4, D3, D2, D1, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, D9, D8, D7, D6, D5, POINT, D4, D3, D2, D1, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, D9, D8, D7, D6, D5, D4, POINT, D3, D2, D1, ZERO, ZERO, ZERO, COMMA},
    {OPEN, MINUS, ZERO, POINT, ZERO, ZERO, D9, D8, D7, D6, D5, D4, D3, D2, D1, COMMA},
};

/* By kind: what may be kept of a slot, but for the ninth digit from 1 on; how long a body with all digits is;
 * how many digits are before the point, whatever they are; and what makes a whole number without the last
 * digit. */
enum { P8 = 0x7F8E, P9 = 0x7FCE, P10 = 0x7FEE, P11 = 0x7FFE, P_ABOVE = 0x7FFA, P_ZERO = 1 << BODY };
alignas(64) static const uint32_t parts[KINDS] = {P8,      P10,     P_ABOVE, P_ABOVE, P_ABOVE,
                                                  P_ABOVE, P_ABOVE, P_ZERO,  P9,      P11};
alignas(64) static const uint32_t lengths[KINDS] = {13, 13, 10, 10, 10, 10, 10, 10, 13, 13};
alignas(64) static const uint32_t wholes[KINDS] = {0, 0, 2, 3, 4, 5, 6, 1, 0, 0};
alignas(64) static const float powers[KINDS] = {1e7F, 1e9F, 1e6F, 1e5F, 1e4F, 1e3F, 1e2F, 1, 1e8F, 1e10F};

/* By the lowest five bits of a float's exponent, which from 2^1 to 2^16 are 0 to 15 and from 2^-13 to 1 are
 * 18 to 31: the kind, and from 1 on the number from which on there are nine digits. */
alignas(64) static const uint32_t kinds[32] = {SEVEN, SEVEN, SEVEN,  SIX,    SIX,    SIX,   FIVE,  FIVE,
                                               FIVE,  FOUR,  FOUR,   FOUR,   FOUR,   THREE, THREE, THREE,
                                               0,     0,     ELEVEN, ELEVEN, ELEVEN, TEN,   TEN,   TEN,
                                               TEN,   NINE,  NINE,   NINE,   EIGHT,  EIGHT, EIGHT, SEVEN};
alignas(64) static const
    float ninths[32] = {10, 10, 10, 100, 100, 100, 1e3F, 1e3F, 1e3F, 1e4F, 1e4F, 1e4F, 1e4F, 1e5F, 1e5F, 1e5F,
                        1,  1,  1,  1,   1,   1,   1,    1,    1,    1,    1,    1,    1,    1,    1,    10};

/* The same below 1, by the lowest four bits, which are 2 to 14, and 0 of zeros; and the reach. */
alignas(64) static const uint32_t unit_parts[16] = {P_ZERO, 0,  P11, P11, P11, P10, P10, P10,
                                                    P10,    P9, P9,  P9,  P8,  P8,  P8};
alignas(64) static const
    double unit_powers[16] = {0, 0, 1e10, 1e10, 1e10, 1e9, 1e9, 1e9, 1e9, 1e8, 1e8, 1e8, 1e7, 1e7, 1e7};
alignas(64) static const double unit_reaches[16] = {0,
                                                    0,
                                                    1e10 * 0x1p-37,
                                                    1e10 * 0x1p-36,
                                                    1e10 * 0x1p-35,
                                                    1e9 * 0x1p-34,
                                                    1e9 * 0x1p-33,
                                                    1e9 * 0x1p-32,
                                                    1e9 * 0x1p-31,
                                                    1e8 * 0x1p-30,
                                                    1e8 * 0x1p-29,
                                                    1e8 * 0x1p-28,
                                                    1e7 * 0x1p-27,
                                                    1e7 * 0x1p-26,
                                                    1e7 * 0x1p-25};

/* Two digits by the number that they are. */
alignas(64) static const uint8_t pairs[128] = {
    0x00, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16,
    0x17, 0x18, 0x19, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x26, 0x27, 0x28, 0x29, 0x30, 0x31, 0x32, 0x33,
    0x34, 0x35, 0x36, 0x37, 0x38, 0x39, 0x40, 0x41, 0x42, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x50,
    0x51, 0x52, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59, 0x60, 0x61, 0x62, 0x63, 0x64, 0x65, 0x66, 0x67,
    0x68, 0x69, 0x70, 0x71, 0x72, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x80, 0x81, 0x82, 0x83, 0x84,
    0x85, 0x86, 0x87, 0x88, 0x89, 0x90, 0x91, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99};

/* The zeros at the end, by the quarters of a byte without a bit in front of the first digit that is none. */
alignas(64) static const uint32_t zero_counts[16] = {0, 0, 1, 2, 3, 3, 4, 5, 6, 6, 7, 8};

/* Eight numbers. number: with all digits but the last one in front of the point; reach: of that; digits: of
 * each three a byte and two halves of one, the last one first. */
typedef struct half {
  __m512d number, reach;
  __m512i whole, digits;
} half;

typedef struct group {
  __m512i bits, magnitude, kind, part;
  half halves[2];
} group;

static inline __m512i as_int(__m512d x) {
  return _mm512_castpd_si512(x);
}

static inline __m512i bits_of(float value) {
  return _mm512_castps_si512(_mm512_set1_ps(value));
}

static inline __m512i load_group(const tw_decimal_slots *slots, size_t i) {
  const float *values = slots->values + TW_GROUP / TW_BLOCK * i * slots->stride;
  __m512 all = _mm512_castps128_ps512(_mm_loadu_ps(values));
  all = _mm512_insertf32x4(all, _mm_loadu_ps(values + slots->stride), 1);
  all = _mm512_insertf32x4(all, _mm_loadu_ps(values + 2 * slots->stride), 2);
  all = _mm512_insertf32x4(all, _mm_loadu_ps(values + 3 * slots->stride), 3);
  return _mm512_castps_si512(all);
}

static inline __m512i without_sign(__m512i bits) {
  return _mm512_and_si512(bits, _mm512_set1_epi32(INT32_MAX));
}

/* ---- powers of ten ------------------------------------------------------------------------------------ */

static inline void widen(__m512 from, __m512d to[2]) {
  to[0] = _mm512_cvtps_pd(_mm512_castps512_ps256(from));
  to[1] = _mm512_cvtps_pd(_mm512_extractf32x8_ps(from, 1));
}

/* Of numbers below 1. Doubles have the same lowest bits of exponents. */
static inline void scale_unit(group *g) {
  __m512d values[2];
  g->part = _mm512_permutexvar_epi32(_mm512_srli_epi32(g->magnitude, 23), _mm512_load_si512(unit_parts));
  widen(_mm512_castsi512_ps(g->magnitude), values);
  for (size_t i = 0; i < 2; i++) {
    __m512i exponent = _mm512_srli_epi64(as_int(values[i]), 52);
    __m512d power =
        _mm512_permutex2var_pd(_mm512_load_pd(unit_powers), exponent, _mm512_load_pd(unit_powers + 8));
    g->halves[i].number = _mm512_mul_pd(values[i], power);
    g->halves[i].reach =
        _mm512_permutex2var_pd(_mm512_load_pd(unit_reaches), exponent, _mm512_load_pd(unit_reaches + 8));
  }
}

/* From a table of 32. */
static inline __m512i look_up(const void *table, __m512i places) {
  return _mm512_permutex2var_epi32(_mm512_load_si512(table), places,
                                   _mm512_load_si512((const char *)table + 64));
}

/* Those that have no slot become a half. The reach is to the middle between a number and the next float. */
static inline void scale_any(group *g) {
  const __m512i least = bits_of(0x1p-13F), span = _mm512_sub_epi32(bits_of(1e5F), least);
  __mmask16 has_slot = _mm512_cmplt_epu32_mask(_mm512_sub_epi32(g->magnitude, least), span);
  __mmask16 is_zero = _mm512_testn_epi32_mask(g->magnitude, g->magnitude);
  __m512i plain = _mm512_mask_mov_epi32(bits_of(0.5F), has_slot, g->magnitude);
  __m512i exponent = _mm512_srli_epi32(plain, 23);
  __mmask16 has_ninth = _mm512_cmpge_epi32_mask(plain, look_up(ninths, exponent));
  g->kind = _mm512_mask_mov_epi32(look_up(kinds, exponent), is_zero, _mm512_set1_epi32(NONE));
  g->part = _mm512_permutexvar_epi32(g->kind, _mm512_load_si512(parts));
  g->part = _mm512_mask_or_epi32(g->part, has_ninth, g->part, _mm512_set1_epi32(NINTH_BIT));
  __m512d values[2], power[2];
  widen(_mm512_castsi512_ps(plain), values);
  widen(_mm512_permutexvar_ps(g->kind, _mm512_load_ps(powers)), power);
  for (size_t i = 0; i < 2; i++) {
    __m512i middle = _mm512_add_epi64(as_int(values[i]), _mm512_set1_epi64(1LL << 28));
    g->halves[i].number = _mm512_mul_pd(values[i], power[i]);
    g->halves[i].reach = _mm512_fmsub_pd(_mm512_castsi512_pd(middle), power[i], g->halves[i].number);
  }
}

/* ---- digits ------------------------------------------------------------------------------------------- */

/* The nearest integer to a number from 0 up to 2^51. */
static inline __m512d nearest(__m512d number) {
  const __m512d shift = _mm512_set1_pd(0x1p52);
  return _mm512_sub_pd(_mm512_add_pd(number, shift), shift);
}

/* All digits, the last one of which need not be there as a zero, as a number in the lowest bits. */
static inline void shorten(half *h) {
  const __m512d magnitude = _mm512_castsi512_pd(_mm512_set1_epi64(INT64_MAX));
  __m512d whole = nearest(h->number);
  __m512d over = _mm512_and_pd(_mm512_sub_pd(h->number, whole), magnitude);
  __mmask8 is_short = _mm512_cmp_pd_mask(over, h->reach, _CMP_LT_OQ);
  __m512d number = _mm512_mask_mov_pd(h->number, is_short, whole);
  h->whole = as_int(_mm512_fmadd_pd(number, _mm512_set1_pd(10), _mm512_set1_pd(0x1p52)));
}

/* Divided by what is multiplied with 2^52 over it, rounded up, which is exact for numbers below 2^30. */
static inline __m512i divide(__m512i number, int64_t reciprocal) {
  return _mm512_madd52hi_epu64(_mm512_setzero_si512(), number, _mm512_set1_epi64(reciprocal));
}

/* Three digits in 16 bits each; what is above them has no meaning. */
static inline void split_whole(half *h) {
  const __m512i move = _mm512_set1_epi64((1LL << 16) - 1000), move_again = _mm512_slli_epi64(move, 16);
  h->digits = _mm512_madd52lo_epu64(h->whole, divide(h->whole, 4503599627371), move);
  h->digits = _mm512_madd52lo_epu64(h->digits, divide(h->whole, 4503599628), move_again);
}

/* Each three digits into two and the last one, those two into halves of a byte. */
static inline void split_threes(half *h) {
  __m512i two = _mm512_mulhi_epu16(h->digits, _mm512_set1_epi16(6554)); /* below 1000 */
  __m512i bytes = _mm512_add_epi16(h->digits, _mm512_maddubs_epi16(_mm512_set1_epi16((1 << 8) - 10), two));
  h->digits = _mm512_permutex2var_epi8(_mm512_load_si512(pairs), bytes, _mm512_load_si512(pairs + 64));
}

/* ---- what is kept ------------------------------------------------------------------------------------- */

/* The bits in front of the first one: the last digits have the lowest ones. */
static inline __m512i count_zero_bits(__m512i digits) {
  return _mm512_popcnt_epi64(_mm512_andnot_si512(digits, _mm512_sub_epi64(digits, _mm512_set1_epi64(1))));
}

/* How many digits are zeros at the end; of zeros it is any number up to eight. */
static inline __m512i count_zeros(const group *g) {
  const __m512i lower = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  __m512i bits = _mm512_permutex2var_epi32(count_zero_bits(g->halves[0].digits), lower,
                                           count_zero_bits(g->halves[1].digits));
  return _mm512_permutexvar_epi32(_mm512_srli_epi32(bits, 2), _mm512_load_si512(zero_counts));
}

/* The bits of bodies up to their last digit that is no zero, and the lower ones. */
static inline __m512i find_bodies(const group *g, __m512i zeros) {
  __m512i length = _mm512_sub_epi32(_mm512_permutexvar_epi32(g->kind, _mm512_load_si512(lengths)), zeros);
  __m512i whole = _mm512_permutexvar_epi32(g->kind, _mm512_load_si512(wholes));
  __mmask16 is_whole = _mm512_cmplt_epi32_mask(length, _mm512_add_epi32(whole, _mm512_set1_epi32(2)));
  length = _mm512_mask_mov_epi32(length, is_whole, whole); /* without a point at its end */
  return _mm512_andnot_si512(_mm512_sllv_epi32(_mm512_set1_epi32(-(1 << BODY)), length),
                             _mm512_set1_epi32(ALL_BITS));
}

static inline __attribute__((always_inline)) void find_kept(const group *g, bool is_unit, uint64_t *kept) {
  const __m512i signs =
      _mm512_broadcast_i32x4(_mm_setr_epi32(OPEN_BIT | COMMA_BIT, COMMA_BIT, COMMA_BIT, COMMA_BIT));
  __m512i zeros = count_zeros(g);
  __m512i body = is_unit ? _mm512_srlv_epi32(_mm512_set1_epi32(ALL_BITS), zeros) : find_bodies(g, zeros);
  __m512i sign = _mm512_or_si512(_mm512_srai_epi32(g->bits, 31), _mm512_set1_epi32(~MINUS_BIT));
  __m512i all = _mm512_or_si512(_mm512_and_si512(body, _mm512_and_si512(g->part, sign)), signs);
  _mm256_storeu_si256((__m256i *)kept, _mm512_cvtepi32_epi16(all));
}

/* ---- text --------------------------------------------------------------------------------------------- */

/* The sources of block i of a group. */
static inline __m512i find_sources(const group *g, size_t i) {
  const __m512i lane =
      _mm512_setr_epi32(0, 0, 0, 0, 0x04040404, 0x04040404, 0x04040404, 0x04040404, 0x08080808, 0x08080808,
                        0x08080808, 0x08080808, 0x0C0C0C0C, 0x0C0C0C0C, 0x0C0C0C0C, 0x0C0C0C0C);
  const __m512i byte =
      _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  __m512i number = _mm512_add_epi8(lane, _mm512_set1_epi8((char)(16 * i)));
  __m512i row = _mm512_permutexvar_epi8(number, _mm512_slli_epi32(g->kind, 4));
  return _mm512_permutex2var_epi8(_mm512_load_si512(sources), _mm512_or_si512(row, byte),
                                  _mm512_load_si512(sources[ROWS / 2]));
}

/* The two words of each number. */
static inline void find_words(__m512i digits, size_t closed, __m512i words[2]) {
  const __m512i lower = _mm512_set1_epi64(0x00000F0F0F0F0F0F), upper = _mm512_set1_epi64(0x00000F000F000F00);
  const __m512i signs = _mm512_set1_epi64(0x2D5B303030303030); /* "000000[-" */
  const __m512i open = _mm512_set1_epi64(0x0000302C3030302E), closing = _mm512_set1_epi64(0x0000305D3030302E);
  __mmask8 is_closed = (__mmask8)((1U << closed & 0xF) * 0x11);
  __m512i more_signs = _mm512_mask_mov_epi64(open, is_closed, closing); /* ".000,0" */
  words[0] = _mm512_or_si512(_mm512_and_si512(digits, lower), signs);
  words[1] = _mm512_or_si512(_mm512_and_si512(_mm512_srli_epi64(digits, 4), upper), more_signs);
}

static inline __attribute__((always_inline)) void put_blocks(const group *g, bool is_unit, size_t closed,
                                                             char (*text)[TW_BLOCK * TW_SLOT]) {
  const __m512i lane = _mm512_setr_epi64(0, 0, 0x0808080808080808, 0x0808080808080808, 0x1010101010101010,
                                         0x1010101010101010, 0x1818181818181818, 0x1818181818181818);
  for (size_t i = 0; i < 2; i++) {
    __m512i words[2];
    find_words(g->halves[i].digits, closed, words);
    for (size_t j = 0; j < 2; j++) {
      __m512i from = is_unit ? _mm512_broadcast_i32x4(_mm_load_si128((const __m128i *)sources[0]))
                             : find_sources(g, 2 * i + j);
      from = _mm512_add_epi8(from, _mm512_add_epi8(lane, _mm512_set1_epi8((char)(32 * j))));
      _mm512_store_si512(text[2 * i + j], _mm512_permutex2var_epi8(words[0], from, words[1]));
    }
  }
}

static inline __attribute__((always_inline)) void find_groups(tw_decimal_slots *slots, group *g, size_t count,
                                                              bool is_unit, size_t closed) {
  for (size_t i = 0; i < count; i++)
    if (is_unit)
      scale_unit(&g[i]);
    else
      scale_any(&g[i]);
  for (size_t i = 0; i < 2 * count; i++) shorten(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_whole(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < 2 * count; i++) split_threes(&g[i / 2].halves[i % 2]);
  for (size_t i = 0; i < count; i++) find_kept(&g[i], is_unit, slots->kept + TW_GROUP / TW_BLOCK * i);
  for (size_t i = 0; i < count; i++)
    put_blocks(&g[i], is_unit, closed, slots->text + TW_GROUP / TW_BLOCK * i);
}

/* ---- numbers without a slot --------------------------------------------------------------------------- */

/* Those that may be: from 1e5 on, and below 1e-3, but for zeros. least: of what is one less than magnitudes,
 * the highest of zeros. */
static inline __mmask16 is_unsure(__m512i least, __m512i most) {
  __m512i low = _mm512_sub_epi32(bits_of(1e-3F), _mm512_set1_epi32(1));
  return _kor_mask16(_mm512_cmplt_epu32_mask(least, low), _mm512_cmpge_epu32_mask(most, bits_of(1e5F)));
}

static __attribute__((noinline)) uint64_t find_others(const tw_decimal_slots *slots, size_t groups) {
  enum { BEHIND_FIRST = 0x7F00 }; /* of a slot, below 2^-10; up to 1e-3 no number has a single digit */
  uint64_t others = 0;
  for (size_t i = 0; i < groups; i++) {
    __m512i magnitude = without_sign(load_group(slots, i));
    __mmask16 unsure = is_unsure(_mm512_sub_epi32(magnitude, _mm512_set1_epi32(1)), magnitude);
    others |= (uint64_t)unsure << TW_GROUP * i;
  }
  for (uint64_t left = others; left; left &= left - 1) {
    size_t i = (size_t)__builtin_ctzll(left), block = i / TW_BLOCK, column = i % TW_BLOCK;
    float magnitude = fabsf(slots->values[block * slots->stride + column]);
    bool has_digits = slots->kept[block] >> TW_SLOT * column & BEHIND_FIRST;
    if (magnitude >= 0x1p-13F && magnitude < 1e-3F && has_digits) others &= ~(1ULL << i);
  }
  return others;
}

static inline __attribute__((always_inline)) void find_some(tw_decimal_slots *slots, size_t count,
                                                            size_t closed) {
  const __m512i one = _mm512_set1_epi32(1);
  group g[GROUPS];
  for (size_t i = 0; i < count; i++) g[i].bits = load_group(slots, i);
  for (size_t i = 0; i < count; i++) g[i].magnitude = without_sign(g[i].bits);
  __m512i most = g[0].magnitude, least = _mm512_sub_epi32(most, one);
  for (size_t i = 1; i < count; i++) most = _mm512_max_epu32(most, g[i].magnitude);
  for (size_t i = 1; i < count; i++) least = _mm512_min_epu32(least, _mm512_sub_epi32(g[i].magnitude, one));
  if (_mm512_cmpge_epu32_mask(most, bits_of(1)))
    find_groups(slots, g, count, false, closed);
  else
    find_groups(slots, g, count, true, closed);
  slots->others = is_unsure(least, most) ? find_others(slots, count) : 0;
}

void tw_decimal_slots_find(tw_decimal_slots *slots, size_t blocks, size_t closed) {
  if (blocks == TW_SLOT_BLOCKS)
    find_some(slots, GROUPS, closed);
  else if (blocks == TW_SLOT_BLOCKS / 2)
    find_some(slots, GROUPS / 2, closed);
  else
    find_some(slots, 1, closed);
}
