/* Several regular patches at once: the kernel for every machine, and the choice of the best one. */
#include "processor.h"
#include "spline_batch_kernel.h"

static uint32_t fill_anywhere(const tw_spline_batch *batch) {
  return fill_batch(batch);
}

typedef uint32_t batch_kernel(const tw_spline_batch *batch);

static batch_kernel *const kernels[TW_SETS] = {fill_anywhere,
#ifdef __x86_64__
                                               tw_spline_batch_fill_avx2
#endif
};

uint32_t tw_spline_batch_rows(const tw_spline_batch *batch) {
  return kernels[tw_processor_has(TW_SET_AVX2)](batch);
}
