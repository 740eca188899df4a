/* Several regular patches at once: the kernel for every machine, and the choice of the best one. */
#include "spline_batch_kernel.h"

static uint32_t fill_anywhere(const tw_spline_batch *batch) {
  return fill_batch(batch);
}

typedef uint32_t batch_kernel(const tw_spline_batch *batch);

/* The last is the best; NULL beyond it. */
static batch_kernel *kernel_at(uint32_t instruction_set) {
  if (instruction_set == 0) return fill_anywhere;
#ifdef __x86_64__
  bool avx2 = __builtin_cpu_supports("avx2");
  if (instruction_set == 1 && avx2) return tw_spline_batch_fill_avx2;
  if (instruction_set == 2 && avx2 && __builtin_cpu_supports("avx512f") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return tw_spline_batch_fill_avx512;
#endif
  return NULL;
}

uint32_t tw_spline_batch_rows(const tw_spline_batch *batch) {
  uint32_t best = 2;
  while (!kernel_at(best)) best--;
  return kernel_at(best)(batch);
}

bool tw_spline_batch_rows_by(uint32_t instruction_set, const tw_spline_batch *batch, uint32_t *unsure) {
  batch_kernel *kernel = kernel_at(instruction_set);
  if (kernel) *unsure = kernel(batch);
  return kernel != NULL;
}
