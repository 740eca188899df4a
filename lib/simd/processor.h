/* What the processor has beyond what every one has. Kernels are compiled for several sets of instructions,
 * and the best one that is there is taken at run time. */
#ifndef TWEEND_PROCESSOR_H
#define TWEEND_PROCESSOR_H

#include <stdbool.h>
#include <stdint.h>

/* The last is the best; kernels stand in this order in their tables. */
enum { TW_SET_ANY, TW_SET_AVX2, TW_SET_AVX512, TW_SETS };

static inline bool tw_processor_has(uint32_t set) {
#ifdef __x86_64__
  if (set == TW_SET_AVX2) return __builtin_cpu_supports("avx2");
  if (set == TW_SET_AVX512)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("avx512f") &&
           __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512bw");
#endif
  return set == TW_SET_ANY;
}

static inline uint32_t tw_processor_best(void) {
  uint32_t best = TW_SETS - 1;
  while (!tw_processor_has(best)) best--;
  return best;
}

#endif
