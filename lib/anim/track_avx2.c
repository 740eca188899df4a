/* Finding keys and sampling arcs on machines with AVX2: compiled for it. */
#include "track_kernel.h"

const tw_track_kernels tw_track_kernels_avx2 = {find_keys, sample_arcs, pose_arcs};
