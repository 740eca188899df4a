/* Floats as the shortest decimal digits that read back, a batch at a time, and the text that they make. */
#ifndef TWEEND_DECIMAL_H
#define TWEEND_DECIMAL_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TW_DECIMALS = 64 }; /* a batch */

/* From 1e-3 up to 1e5 eight decades have a kind each for positive numbers and, one more, for negative ones;
 * of zeros and of anything else nothing more is said. */
enum { TW_DECIMAL_DECADES = 8, TW_DECIMAL_ZERO = 2 * TW_DECIMAL_DECADES, TW_DECIMAL_OTHER };

/* What the text of a number is picked from: nine digits, the last one in the first place, so that zeros at
 * the end are the lowest bits of a word; and what else there is in numbers. */
enum { TW_PIECE_FIRST = 8, TW_PIECE_POINT, TW_PIECE_NOUGHT, TW_PIECE_MINUS, TW_PIECES = 16 };

typedef struct tw_decimals {
  float values[TW_DECIMALS];            /* given; those behind the last one are overwritten */
  uint32_t kinds[TW_DECIMALS];          /* twice the decade, and one more below zero; or one of the above */
  char pieces[TW_DECIMALS * TW_PIECES]; /* the first of all nine digits is not 0 */
} tw_decimals;

/* What finds and prints on one instruction set. All give the same bytes. */
typedef struct tw_decimal_kernels {
  /* The pieces of the batch's first `count` values; NULL where text is made without. */
  void (*find)(tw_decimals *batch, size_t count);
  /* `count` numbers, and vectors of 1 to TW_DECIMALS numbers in brackets, a comma behind each. Return the
   * end. */
  char *(*print_row)(char *out, const float *values, size_t count);
  char *(*print_vectors)(char *out, const tw_vectors *vectors);
} tw_decimal_kernels;
extern const tw_decimal_kernels tw_decimal_kernels_avx2, tw_decimal_kernels_vbmi2;

/* 0 for every machine, 1 AVX2, 2 AVX-512 with VBMI2; NULL for one that the machine lacks, and beyond. */
const tw_decimal_kernels *tw_decimal_kernels_at(uint32_t instruction_set);

/* As tw_print_float, by std::to_chars: of any magnitude. */
size_t tw_print_any_float(char *out, float value);

#ifdef __cplusplus
}
#endif
#endif
