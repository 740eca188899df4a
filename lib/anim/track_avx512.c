/* Finding keys and sampling arcs on machines with AVX-512: compiled for it. */
#include "track_kernel.h"

const tw_track_kernels tw_track_kernels_avx512 = {find_keys, sample_arcs, pose_arcs};
