/* What decimal_kernel.h finds in loops, for sixteen floats side by side, where compilers would not find the
 * instructions: tables in registers instead of comparisons, and products of halves of a lane instead of whole
 * ones. The arithmetic is the same, for the reasons told there. */
#ifndef TWEEND_DECIMAL_SIXTEEN_H
#define TWEEND_DECIMAL_SIXTEEN_H

#include <immintrin.h>

#include "decimal.h"

/* Of the binary exponents from 2^-10, where 1e-3 lies, to 2^16: the decade that they begin in, and where
 * another begins before they end, or else the end of all. */
static const int32_t first_decades[32] = {0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 4, 4,
                                          4, 5, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7, 7, 7, 7, 7};
static const float next_decades[32] = {1e5F, 1e5F, 1e5F, 1e-2F, 1e5F, 1e5F, 1e-1F, 1e5F, 1e5F, 1e5F, 1e5F,
                                       1e5F, 1e5F, 10,   1e5F,  1e5F, 100,  1e5F,  1e5F, 1000, 1e5F, 1e5F,
                                       1e5F, 1e4F, 1e5F, 1e5F,  1e5F, 1e5F, 1e5F,  1e5F, 1e5F, 1e5F};

static inline __m512i every(int32_t value) {
  return _mm512_set1_epi32(value);
}

/* The decades of magnitudes in the plain range. */
static inline __m512i find_decades(__m512 magnitudes) {
  enum { LEAST_EXPONENT = 127 - 10 };
  __m512i exponents =
      _mm512_sub_epi32(_mm512_srli_epi32(_mm512_castps_si512(magnitudes), 23), every(LEAST_EXPONENT));
  __m512i decades = _mm512_permutex2var_epi32(_mm512_loadu_si512(first_decades), exponents,
                                              _mm512_loadu_si512(first_decades + 16));
  __m512 next =
      _mm512_permutex2var_ps(_mm512_loadu_ps(next_decades), exponents, _mm512_loadu_ps(next_decades + 16));
  __mmask16 is_next = _mm512_cmp_ps_mask(magnitudes, next, _CMP_GE_OQ);
  return _mm512_mask_add_epi32(decades, is_next, decades, every(1));
}

static inline __m512d nearest_eight(__m512d x) {
  const __m512d whole = _mm512_set1_pd(0x1p52);
  return _mm512_sub_pd(_mm512_add_pd(x, whole), whole);
}

static inline __mmask8 is_within(__m512d a, __m512d b, __m512d reach) {
  return _mm512_cmp_pd_mask(_mm512_abs_pd(_mm512_sub_pd(a, b)), reach, _CMP_LT_OQ);
}

/* Nine digits of each of eight magnitudes, in the lower half of a lane. */
static inline __m512i find_nines(__m256 magnitudes, __m256i decades) {
  const __m512d powers = _mm512_setr_pd(1e11, 1e10, 1e9, 1e8, 1e7, 1e6, 1e5, 1e4);
  const __m512i exponent = _mm512_set1_epi64(0x7FF0000000000000),
                to_half_place = _mm512_set1_epi64(24LL << 52);
  const __m512d whole = _mm512_set1_pd(0x1p52); /* a sum with it has the digits in its lower half */
  __m512d v = _mm512_cvtps_pd(magnitudes);
  __m512d power = _mm512_permutexvar_pd(_mm512_cvtepu32_epi64(decades), powers);
  __m512d half_place = _mm512_castsi512_pd(
      _mm512_sub_epi64(_mm512_and_si512(_mm512_castpd_si512(v), exponent), to_half_place));
  __m512d number = _mm512_mul_pd(v, power), reach = _mm512_mul_pd(half_place, power);
  __m512d tenth = _mm512_mul_pd(number, _mm512_set1_pd(0.1)),
          hundredth = _mm512_mul_pd(number, _mm512_set1_pd(0.01));
  __m512d eight = _mm512_mul_pd(nearest_eight(tenth), _mm512_set1_pd(10)),
          seven = _mm512_mul_pd(nearest_eight(hundredth), _mm512_set1_pd(100));
  __m512d nine = _mm512_add_pd(number, whole);
  nine = _mm512_mask_add_pd(nine, is_within(number, eight, reach), eight, whole);
  nine = _mm512_mask_add_pd(nine, is_within(number, seven, reach), seven, whole);
  return _mm512_castpd_si512(nine);
}

/* n / d in each lane, of its lower half; exact for the constants below and any n. */
static inline __m512i divide(__m512i n, int64_t factor, unsigned shift) {
  return _mm512_srli_epi64(_mm512_mul_epu32(n, _mm512_set1_epi64(factor)), shift);
}

/* Splits nine digits into their characters. */
static inline void put_pieces(__m512i nines, char *pieces) {
  __m512i first = divide(nines, 1441151881, 57); /* by 10^8 */
  __m512i eight =
      _mm512_maskz_sub_epi32(0x5555, nines, _mm512_mul_epu32(first, _mm512_set1_epi64(100000000)));
  __m512i four = divide(eight, 3518437209, 45); /* by 10^4 */
  /* What is left of a quotient stays in the lower part of a lane while the quotient moves to the upper. */
  __m512i fours = _mm512_add_epi64(eight, _mm512_mul_epu32(four, _mm512_set1_epi64((1LL << 32) - 10000)));
  __m512i hundreds = _mm512_srli_epi16(_mm512_mulhi_epu16(fours, _mm512_set1_epi16(10486)), 4);
  __m512i pairs = _mm512_add_epi32(fours, _mm512_mullo_epi32(hundreds, every((1 << 16) - 100)));
  __m512i tens = _mm512_mulhi_epu16(pairs, _mm512_set1_epi16(6554));
  __m512i digits = _mm512_add_epi16(pairs, _mm512_mullo_epi16(tens, _mm512_set1_epi16((1 << 8) - 10)));
  __m512i last = _mm512_or_si512(digits, _mm512_set1_epi8('0'));
  __m512i others = _mm512_or_si512(first, _mm512_set1_epi64('0' | '.' << 8 | '0' << 16 | '-' << 24));
  const __m512i low = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11),
                high = _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15);
  _mm512_storeu_si512(pieces, _mm512_permutex2var_epi64(last, low, others));
  _mm512_storeu_si512(pieces + 64, _mm512_permutex2var_epi64(last, high, others));
}

static inline void find_sixteen(const float *values, uint32_t *kinds, char *pieces) {
  __m512i bits = _mm512_castps_si512(_mm512_loadu_ps(values));
  __m512 magnitudes = _mm512_castsi512_ps(_mm512_and_si512(bits, every(INT32_MAX)));
  __mmask16 is_plain = _mm512_cmp_ps_mask(magnitudes, _mm512_set1_ps(1e-3F), _CMP_GE_OQ) &
                       _mm512_cmp_ps_mask(magnitudes, _mm512_set1_ps(1e5F), _CMP_LT_OQ);
  __mmask16 is_zero = _mm512_cmp_ps_mask(magnitudes, _mm512_setzero_ps(), _CMP_EQ_OQ);
  magnitudes = _mm512_mask_mov_ps(_mm512_set1_ps(1), is_plain, magnitudes);
  __m512i decades = find_decades(magnitudes);
  __m512i others = _mm512_mask_mov_epi32(every(TW_DECIMAL_OTHER), is_zero, every(TW_DECIMAL_ZERO));
  __m512i signs = _mm512_srli_epi32(bits, 31);
  _mm512_storeu_si512(kinds, _mm512_mask_add_epi32(others, is_plain, signs, _mm512_slli_epi32(decades, 1)));
  put_pieces(find_nines(_mm512_castps512_ps256(magnitudes), _mm512_castsi512_si256(decades)), pieces);
  put_pieces(find_nines(_mm512_extractf32x8_ps(magnitudes, 1), _mm512_extracti32x8_epi32(decades, 1)),
             pieces + 8 * TW_PIECES);
}

#endif
