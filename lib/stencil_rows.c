/* Sums of stencils: the kernel for every machine, and the choice of the best one. */
#include "processor.h"
#include "stencil_kernel.h"

typedef bool stencil_kernel(const tw_stencil_job *job);

static bool fill_anywhere(const tw_stencil_job *job) {
  return fill_stencil(job);
}

static stencil_kernel *const kernels[TW_SETS] = {fill_anywhere,
#ifdef __x86_64__
                                                 tw_stencil_fill_avx2, tw_stencil_fill_avx512
#endif
};

bool tw_stencil_rows(const tw_stencil_job *job) {
  return kernels[tw_processor_best()](job);
}

bool tw_stencil_rows_by(uint32_t instruction_set, const tw_stencil_job *job, bool *sure) {
  if (!tw_processor_has(instruction_set)) return false;
  *sure = kernels[instruction_set](job);
  return true;
}
