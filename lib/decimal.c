/* Decimal digits of floats: the kernel for every machine, and the choice of the best one. */
#include "decimal_kernel.h"
#include "processor.h"

/* LANES: values of the widest vectors. FEW: take less time one by one. */
enum { LANES = 16, FEW = 4 };

/* The digits of a number below 10^8, one a byte, the first in the lowest: halves, pairs and digits are split
 * side by side (after Paul Khuong, "How to print integers really fast"). */
static uint64_t split_eight(uint32_t value) {
  uint64_t halves = value / 10000 | (uint64_t)(value % 10000) << 32;
  uint64_t hundreds = (halves * 10486 >> 20) & 0x7F0000007F; /* exact below 10^4 */
  uint64_t pairs = hundreds | (halves - 100 * hundreds) << 16;
  uint64_t tens = (pairs * 103 >> 10) & 0x000F000F000F000F; /* exact below 100 */
  return tens | (pairs - 10 * tens) << 8;
}

static void find_few(tw_decimals *batch, size_t count) {
  for (size_t i = 0; i < count; i++) {
    uint32_t nine = find_nine(batch->values[i], &batch->kinds[i]);
    uint64_t digits = split_eight(nine / 10);
    if (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) digits = __builtin_bswap64(digits);
    memcpy(batch->digits + sizeof digits * i, &digits, sizeof digits);
    batch->ninths[i] = nine % 10;
  }
}

static void find_anywhere(tw_decimals *batch, size_t count) {
  find_decimals(batch, count);
}

typedef void find_kernel(tw_decimals *batch, size_t count);

static find_kernel *const kernels[TW_SETS] = {find_anywhere,
#ifdef __x86_64__
                                              tw_decimals_find_avx2, tw_decimals_find_avx512
#endif
};

static void run(find_kernel *kernel, tw_decimals *batch, size_t count) {
  for (; count % LANES != 0; count++) batch->values[count] = 0;
  kernel(batch, count);
}

void tw_decimals_find(tw_decimals *batch, size_t count) {
  if (count <= FEW) {
    find_few(batch, count);
    return;
  }
  run(kernels[tw_processor_best()], batch, count);
}

bool tw_decimals_find_by(uint32_t instruction_set, tw_decimals *batch, size_t count) {
  if (!tw_processor_has(instruction_set)) return false;
  run(kernels[instruction_set], batch, count);
  return true;
}
