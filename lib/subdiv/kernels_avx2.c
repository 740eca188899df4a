/* The kernels of patches for machines with AVX2: compiled for it. */
#include "bspline_kernel.h"
#include "stencil_kernel.h"

void tw_spline_fill_avx2(const tw_spline_job *job, bool transposed) {
  fill_job(job, transposed);
}

bool tw_stencil_fill_avx2(const tw_stencil_job *job) {
  return fill_stencil(job);
}
