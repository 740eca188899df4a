/* Lines of patches on machines with AVX-512: compiled for it. */
#include "spline_batch_kernel.h"

void tw_spline_fill_avx512(const tw_spline_job *job, bool transposed) {
  fill_job(job, transposed);
}

uint32_t tw_spline_batch_fill_avx512(const tw_spline_batch *batch) {
  return fill_batch(batch);
}
