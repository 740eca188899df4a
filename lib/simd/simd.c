/* What the processor has. */
#include "simd.h"

bool tw_processor_has(uint32_t set) {
#ifdef __x86_64__
  if (set == TW_SET_AVX2) return __builtin_cpu_supports("avx2");
#endif
  return set == TW_SET_ANY;
}
