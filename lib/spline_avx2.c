/* Lines of patches on machines with AVX2: compiled for it. */
#include "spline_kernel.h"

void tw_spline_fill_avx2(const tw_spline_job *job, bool transposed) {
  fill_job(job, transposed);
}
