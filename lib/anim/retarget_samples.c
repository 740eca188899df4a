/* Makes the keys of a track of the result: samples of a function of time, or the source's keys, each of them
 * mapped. */
#include <string.h>

#include "retarget_carrying.h"

tw_status tw_signal_carry(tw_carrying *c, tw_signal signal, uint32_t node, tw_error *error) {
  const tw_tolerance *tolerance = &c->job->tolerance;
  signal.tracks = c->tracks;
  signal.width = signal.path == TW_ROTATION ? 4 : 3;
  signal.tolerance = signal.path == TW_ROTATION ? tolerance->angle : tolerance->distance * c->fit.size;
  signal.max_keys = c->job->max_keys;
  tw_status status = tw_signal_sample(&signal, node, c->arena, &c->out[c->out_count], error);
  c->out_count += status == TW_OK;
  return status;
}

tw_status tw_keys_carry(tw_carrying *c, const tw_track_keys *track, uint32_t node, tw_map_value *map,
                        const void *context, tw_error *error) {
  enum { STEPS_A_ROW = 5 };
  bool is_cubic = track->interpolation == TW_CUBICSPLINE;
  size_t rows = (size_t)track->key_count * (is_cubic ? 3 : 1), width = track->width;
  float *values = tw_arena_alloc_raw(c->arena, rows, width * sizeof *values);
  float *times = tw_arena_alloc_raw(c->arena, track->key_count, sizeof *times);
  if (!values || !times) return tw_carrying_no_memory(error);
  if (!tw_work(STEPS_A_ROW * rows)) return tw_work_status(error);
  memcpy(times, track->times, track->key_count * sizeof *times);
  for (size_t row = 0; row < rows; row++) {
    double value[4] = {0}, mapped[4] = {0};
    for (size_t k = 0; k < width; k++) value[k] = (double)track->values[width * row + k];
    map(context, value, is_cubic && row % 3 != 1, mapped);
    for (size_t k = 0; k < width; k++) values[width * row + k] = (float)mapped[k];
  }
  tw_track_keys out = *track;
  out.node = node;
  out.times = times;
  out.values = values;
  out.preserved = NULL;
  c->out[c->out_count++] = out;
  return TW_OK;
}
