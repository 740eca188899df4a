/* Decimal digits on machines with AVX2: compiled for it. */
#include "decimal_kernel.h"

void tw_decimals_find_avx2(tw_decimals *batch, size_t count) {
  find_decimals(batch, count);
}
