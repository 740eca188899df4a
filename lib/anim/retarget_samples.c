/* Keys of the result: sampled where the source has keys and as often between as it takes, or mapped one by
 * one. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "order.h"
#include "retarget_carrying.h"
#include "vector3.h"

static bool all_step(const tw_signal *signal) {
  for (uint32_t i = 0; i < signal->track_count; i++)
    if (signal->carrying->tracks[signal->tracks[i]].interpolation != TW_STEP) return false;
  return true;
}

/* The key times of all tracks, each once; just before each jump too. */
static tw_status gather_times(const tw_signal *signal, bool is_step, float **out, uint32_t *out_count,
                              tw_error *error) {
  const tw_carrying *c = signal->carrying;
  uint64_t count = 0;
  for (uint32_t i = 0; i < signal->track_count; i++)
    count += 2 * (uint64_t)c->tracks[signal->tracks[i]].key_count;
  float *times = count < UINT32_MAX ? tw_alloc((size_t)count, sizeof *times) : NULL;
  *out = times;
  if (!times) return tw_carrying_no_memory(error);
  uint32_t used = 0, kept = 0;
  for (uint32_t i = 0; i < signal->track_count; i++) {
    const tw_track_keys *track = &c->tracks[signal->tracks[i]];
    for (uint32_t key = 0; key < track->key_count; key++) {
      float before = nextafterf(track->times[key], -1);
      if (track->interpolation == TW_STEP && !is_step && key > 0 && before > track->times[key - 1])
        times[used++] = before;
      times[used++] = track->times[key];
    }
  }
  tw_status status = tw_sort(times, used, sizeof *times, tw_order_floats);
  if (status != TW_OK) return tw_fail(error, status, "the key times of a bone cannot be sorted");
  for (uint32_t i = 0; i < used; i++)
    if (kept == 0 || times[i] > times[kept - 1]) times[kept++] = times[i];
  *out_count = kept;
  return TW_OK;
}

/* Counts the work of so many samples. */
static tw_status sampling(const tw_signal *signal, uint32_t count, tw_error *error) {
  enum { STEPS_A_NODE = 10 };
  return tw_work(STEPS_A_NODE * count * (signal->nodes + 1)) ? TW_OK : tw_work_status(error);
}

static double error_between(const tw_signal *signal, const tw_key_sample *from, const tw_key_sample *to,
                            double u) {
  double there[4], between[4] = {0};
  signal->at(signal, (float)((double)from->time + u * ((double)to->time - (double)from->time)), there);
  if (signal->path == TW_ROTATION) {
    tw_rotation_slerp(from->value, to->value, u, between);
    return tw_angle_between(there, between);
  }
  for (int i = 0; i < 3; i++) there[i] -= from->value[i] + u * (to->value[i] - from->value[i]);
  return tw_length3(there);
}

static bool is_near(const tw_signal *signal, const tw_key_sample *from, const tw_key_sample *to) {
  static const double probes[] = {0.25, 0.5, 0.75};
  const tw_carrying *c = signal->carrying;
  const tw_tolerance *tolerance = &c->job->tolerance;
  double most = signal->path == TW_ROTATION ? tolerance->angle : tolerance->distance * c->fit.size;
  float middle = (float)(((double)from->time + (double)to->time) / 2);
  if (!(middle > from->time && middle < to->time)) return true;
  for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
    if (error_between(signal, from, to, probes[i]) > most) return false;
  return true;
}

/* Halves the steps that stray. */
static tw_status halve(const tw_signal *signal, tw_key_sample **samples, uint32_t *count, tw_error *error) {
  enum { SAMPLES = 4 }; /* of a step that is halved: three probes, and the middle */
  tw_key_sample *finer = tw_alloc(2 * (size_t)*count, sizeof *finer);
  uint32_t used = 0;
  tw_status status = finer ? TW_OK : tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < *count && status == TW_OK; i++) {
    tw_key_sample *from = &(*samples)[i];
    bool is_last = i + 1 == *count;
    status = sampling(signal, from->is_settled ? 0 : SAMPLES, error);
    from->is_settled = from->is_settled || is_last || is_near(signal, from, from + 1);
    finer[used++] = *from;
    if (from->is_settled) continue;
    tw_key_sample middle = {.time = (float)(((double)from->time + (double)from[1].time) / 2)};
    signal->at(signal, middle.time, middle.value);
    finer[used++] = middle;
  }
  if (status != TW_OK) {
    tw_free(finer);
    return status;
  }
  tw_free(*samples);
  *samples = finer;
  *count = used;
  return TW_OK;
}

static tw_status refine(const tw_signal *signal, tw_key_sample **samples, uint32_t *count, tw_error *error) {
  enum { HALVINGS = 16 };
  for (int pass = 0; pass < HALVINGS; pass++) {
    uint32_t before = *count;
    tw_status status = halve(signal, samples, count, error);
    if (status != TW_OK || *count == before) return status;
    if (*count > signal->carrying->job->max_keys)
      return tw_fail(error, TW_LIMIT, "a track that is carried over needs more than %u %s",
                     signal->carrying->job->max_keys,
                     tw_plural(signal->carrying->job->max_keys, "key", "keys"));
  }
  return TW_OK;
}

tw_status tw_samples_carry(tw_carrying *c, const tw_key_sample *samples, uint32_t count, tw_path path,
                           bool is_step, uint32_t node, tw_error *error) {
  uint32_t width = path == TW_ROTATION ? 4 : 3;
  float *times = tw_arena_alloc_raw(c->arena, count, sizeof *times);
  float *values = tw_arena_alloc_raw(c->arena, count, width * sizeof *values);
  if (!times || !values) return tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < count; i++) {
    times[i] = samples[i].time;
    for (uint32_t k = 0; k < width; k++) values[width * (size_t)i + k] = (float)samples[i].value[k];
  }
  for (uint32_t i = 1; path == TW_ROTATION && i < count; i++) { /* signs go on from the key before */
    float dot = 0;
    for (uint32_t k = 0; k < 4; k++) dot += values[4 * (size_t)i + k] * values[4 * (size_t)(i - 1) + k];
    for (uint32_t k = 0; dot < 0 && k < 4; k++) values[4 * (size_t)i + k] = -values[4 * (size_t)i + k];
  }
  c->out[c->out_count++] = (tw_track_keys){.node = node,
                                           .path = path,
                                           .interpolation = is_step ? TW_STEP : TW_LINEAR,
                                           .form = path == TW_ROTATION ? TW_KEY_QUATERNION : TW_KEY_VALUES,
                                           .width = width,
                                           .key_count = count,
                                           .times = times,
                                           .values = values};
  return TW_OK;
}

tw_status tw_signal_carry(tw_carrying *c, const tw_signal *signal, uint32_t node, tw_error *error) {
  bool is_step = all_step(signal);
  uint32_t count = 0;
  float *times;
  tw_status status = gather_times(signal, is_step, &times, &count, error);
  tw_key_sample *samples = status == TW_OK ? tw_alloc_zero(count, sizeof *samples) : NULL;
  if (status == TW_OK && !samples) status = tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    samples[i].time = times[i];
    signal->at(signal, times[i], samples[i].value);
    status = sampling(signal, 1, error);
  }
  tw_free(times);
  if (status == TW_OK && !is_step) status = refine(signal, &samples, &count, error);
  if (status == TW_OK) status = tw_samples_carry(c, samples, count, signal->path, is_step, node, error);
  tw_free(samples);
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
