/* Sums of stencils on machines with AVX2: compiled for it. */
#include "stencil_kernel.h"

bool tw_stencil_fill_avx2(const tw_stencil_job *job) {
  return fill_stencil(job);
}
