/* Finding keys and sampling arcs: the kernels for every machine, and the choice of the best ones. */
#include "processor.h"
#include "track_kernel.h"

static const tw_track_kernels anywhere = {find_keys, sample_arcs, pose_arcs};

static const tw_track_kernels *const kernels[TW_SETS] = {&anywhere,
#ifdef __x86_64__
                                                         &tw_track_kernels_avx2, &tw_track_kernels_avx512
#endif
};

const tw_track_kernels *tw_track_kernels_at(uint32_t instruction_set) {
  return tw_processor_has(instruction_set) ? kernels[instruction_set] : NULL;
}

static const tw_track_kernels *best_kernels(void) {
  return kernels[tw_processor_best()];
}

void tw_timeline_find_all(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                          uint32_t *keys) {
  best_kernels()->find_keys(timeline, times, count, clamped, keys);
}

void tw_arcs_sample(const float *arcs, size_t arc_count, const uint32_t *which, const float *times,
                    size_t count, float *out) {
  best_kernels()->sample_arcs(arcs, arc_count, which, times, count, out);
}

void tw_arcs_pose(const arc_block *blocks, size_t window, size_t block, float time, tw_trs *locals) {
  best_kernels()->pose_arcs(blocks, window, block, time, locals);
}
