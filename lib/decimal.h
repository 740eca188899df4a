/* Floats as the shortest decimal digits that read back, a batch at a time. */
#ifndef TWEEND_DECIMAL_H
#define TWEEND_DECIMAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { TW_DECIMALS = 64 }; /* a batch */

/* From 1e-3 up to 1e5 eight decades have a kind each for positive numbers and, one more, for negative ones;
 * of zeros and of anything else nothing more is said. */
enum { TW_DECIMAL_DECADES = 8, TW_DECIMAL_ZERO = 2 * TW_DECIMAL_DECADES, TW_DECIMAL_OTHER };

typedef struct tw_decimals {
  float values[TW_DECIMALS];       /* given; those behind the last one are overwritten */
  uint32_t kinds[TW_DECIMALS];     /* twice the decade, and one more below zero; or one of the above */
  uint8_t digits[TW_DECIMALS * 8]; /* 0 to 9, the first eight of each; the first of all is not 0 */
  uint32_t ninths[TW_DECIMALS];    /* the ninth of each */
} tw_decimals;

/* Finds the digits of the batch's first `count` values, with the best instruction set that this machine has.
 */
void tw_decimals_find(tw_decimals *batch, size_t count);

/* With each instruction set that this machine has, from 0, which all machines have, to the best; false
 * beyond. All find the same digits. */
bool tw_decimals_find_by(uint32_t instruction_set, tw_decimals *batch, size_t count);

/* ---- for the kernels alone ------------------------------------------------------------------ */

#ifdef __x86_64__
void tw_decimals_find_avx2(tw_decimals *batch, size_t count);
void tw_decimals_find_avx512(tw_decimals *batch, size_t count);
#endif

#ifdef __cplusplus
}
#endif
#endif
