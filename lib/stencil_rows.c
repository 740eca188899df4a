/* Sums of stencils: the kernel for every machine, and the choice of the best one. */
#include "stencil_kernel.h"

typedef bool stencil_kernel(const tw_stencil_job *job);

static bool fill_anywhere(const tw_stencil_job *job) {
  return fill_stencil(job);
}

/* The last is the best; NULL beyond it. */
static stencil_kernel *kernel_at(uint32_t instruction_set) {
  if (instruction_set == 0) return fill_anywhere;
#ifdef __x86_64__
  if (instruction_set == 1 && __builtin_cpu_supports("avx2")) return tw_stencil_fill_avx2;
#endif
  return NULL;
}

bool tw_stencil_rows(const tw_stencil_job *job) {
  stencil_kernel *best = kernel_at(1);
  return best ? best(job) : fill_anywhere(job);
}

bool tw_stencil_rows_by(uint32_t instruction_set, const tw_stencil_job *job, bool *sure) {
  stencil_kernel *kernel = kernel_at(instruction_set);
  if (kernel) *sure = kernel(job);
  return kernel != NULL;
}
