/* Keys for what is known as a function of time: sampled where the tracks have keys that it depends on, and as
 * often between as it takes. */
#include "signal_keys.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "order.h"
#include "quat.h"
#include "vector3.h"

typedef struct samples {
  uint32_t count;
  float *times;     /* [count] */
  double *values;   /* [count][width] */
  bool *is_settled; /* [count] the way to the next sample is within the tolerance */
} samples;

static void samples_deinit(samples *all) {
  tw_free(all->times);
  tw_free(all->values);
  tw_free(all->is_settled);
}

static tw_status samples_init(samples *all, size_t room, uint32_t width, tw_error *error) {
  *all = (samples){.times = tw_alloc(room, sizeof(float)),
                   .values = tw_alloc(room, width * sizeof(double)),
                   .is_settled = tw_alloc_zero(room, sizeof(bool))};
  if (all->times && all->values && all->is_settled) return TW_OK;
  samples_deinit(all);
  *all = (samples){0};
  return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of a track");
}

static bool all_step(const tw_signal *signal) {
  for (uint32_t i = 0; i < signal->track_count; i++)
    if (signal->tracks[signal->indices[i]].interpolation != TW_STEP) return false;
  return true;
}

/* The key times of all tracks, each once; just before each jump too. */
static tw_status gather_times(const tw_signal *signal, bool is_step, float **out, uint32_t *out_count,
                              tw_error *error) {
  uint64_t count = signal->time_count;
  for (uint32_t i = 0; i < signal->track_count; i++)
    count += 2 * (uint64_t)signal->tracks[signal->indices[i]].key_count;
  float *times = count < UINT32_MAX ? tw_alloc((size_t)count, sizeof *times) : NULL;
  *out = times;
  if (!times) return tw_fail(error, TW_NO_MEMORY, "no memory for the key times of a track");
  uint32_t used = 0, kept = 0;
  for (uint32_t i = 0; i < signal->time_count; i++) times[used++] = signal->times[i];
  for (uint32_t i = 0; i < signal->track_count; i++) {
    const tw_track_keys *track = &signal->tracks[signal->indices[i]];
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
  return tw_work((uint64_t)STEPS_A_NODE * count * (signal->cost + 1)) ? TW_OK : tw_work_status(error);
}

/* there: [width] scratch. */
static double error_between(const tw_signal *signal, const samples *all, uint32_t index, double u,
                            double *there) {
  const double *from = all->values + (size_t)index * signal->width, *to = from + signal->width;
  double start = (double)all->times[index], seconds = (double)all->times[index + 1] - start;
  signal->at(signal->context, (float)(start + u * seconds), there);
  if (signal->path == TW_ROTATION) {
    double between[4];
    tw_rotation_slerp(from, to, u, between);
    return tw_angle_between(there, between);
  }
  double most = 0;
  for (uint32_t i = 0; i < signal->width; i++) {
    there[i] -= from[i] + u * (to[i] - from[i]);
    most = fmax(most, fabs(there[i]));
  }
  return signal->path == TW_WEIGHTS ? most : tw_length3(there);
}

static float middle_of(const samples *all, uint32_t index) {
  return (float)(((double)all->times[index] + (double)all->times[index + 1]) / 2);
}

static bool is_near(const tw_signal *signal, const samples *all, uint32_t index, double *there) {
  static const double probes[] = {0.25, 0.5, 0.75};
  float middle = middle_of(all, index);
  if (!(middle > all->times[index] && middle < all->times[index + 1])) return true;
  for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
    if (error_between(signal, all, index, probes[i], there) > signal->tolerance) return false;
  return true;
}

/* Halves the steps that stray. */
static tw_status halve(const tw_signal *signal, samples *all, double *there, tw_error *error) {
  enum { SAMPLES = 4 }; /* of a step that is halved: three probes, and the middle */
  samples finer;
  size_t width = signal->width;
  tw_status status = samples_init(&finer, 2 * (size_t)all->count, signal->width, error);
  for (uint32_t i = 0; i < all->count && status == TW_OK; i++) {
    bool is_settled = all->is_settled[i];
    status = sampling(signal, is_settled ? 0 : SAMPLES, error);
    is_settled = is_settled || i + 1 == all->count || is_near(signal, all, i, there);
    finer.times[finer.count] = all->times[i];
    finer.is_settled[finer.count] = is_settled;
    memcpy(finer.values + width * finer.count++, all->values + width * i, width * sizeof *finer.values);
    if (is_settled) continue;
    finer.times[finer.count] = middle_of(all, i);
    signal->at(signal->context, finer.times[finer.count], finer.values + width * finer.count);
    finer.count++;
  }
  samples_deinit(status == TW_OK ? all : &finer);
  if (status == TW_OK) *all = finer;
  return status;
}

static tw_status refine(const tw_signal *signal, samples *all, double *there, tw_error *error) {
  enum { HALVINGS = 16 };
  for (int pass = 0; pass < HALVINGS; pass++) {
    uint32_t before = all->count;
    tw_status status = halve(signal, all, there, error);
    if (status != TW_OK || all->count == before) return status;
    if (all->count > signal->max_keys)
      return tw_fail(error, TW_LIMIT, "a track that is carried over needs more than %u %s", signal->max_keys,
                     tw_plural(signal->max_keys, "key", "keys"));
  }
  return TW_OK;
}

tw_status tw_samples_keep(const float *times, const double *values, uint32_t count, uint32_t width,
                          tw_path path, bool is_step, uint32_t node, tw_arena *arena, tw_track_keys *out,
                          tw_error *error) {
  float *kept_times = tw_arena_alloc_raw(arena, count, sizeof *kept_times);
  float *kept = tw_arena_alloc_raw(arena, count, width * sizeof *kept);
  if (!kept_times || !kept) return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of a track");
  memcpy(kept_times, times, count * sizeof *kept_times);
  for (size_t i = 0; i < (size_t)count * width; i++) kept[i] = (float)values[i];
  for (uint32_t i = 1; path == TW_ROTATION && i < count; i++) { /* signs go on from the key before */
    float dot = 0;
    for (uint32_t k = 0; k < 4; k++) dot += kept[4 * (size_t)i + k] * kept[4 * (size_t)(i - 1) + k];
    for (uint32_t k = 0; dot < 0 && k < 4; k++) kept[4 * (size_t)i + k] = -kept[4 * (size_t)i + k];
  }
  *out = (tw_track_keys){.node = node,
                         .path = path,
                         .interpolation = is_step ? TW_STEP : TW_LINEAR,
                         .form = path == TW_ROTATION ? TW_KEY_QUATERNION : TW_KEY_VALUES,
                         .width = width,
                         .key_count = count,
                         .times = kept_times,
                         .values = kept};
  return TW_OK;
}

/* Samples at the times. */
static tw_status sample_all(const tw_signal *signal, const float *times, uint32_t count, samples *all,
                            tw_error *error) {
  tw_status status = samples_init(all, count, signal->width, error);
  for (; all->count < count && status == TW_OK; all->count++) {
    all->times[all->count] = times[all->count];
    signal->at(signal->context, times[all->count], all->values + (size_t)signal->width * all->count);
    status = sampling(signal, 1, error);
  }
  return status;
}

tw_status tw_signal_sample(const tw_signal *signal, uint32_t node, tw_arena *arena, tw_track_keys *out,
                           tw_error *error) {
  bool is_step = all_step(signal);
  uint32_t count = 0;
  float *times;
  samples all = {0};
  double *there = tw_alloc(signal->width, sizeof *there);
  tw_status status = there ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for the keys of a track");
  if (status == TW_OK) {
    status = gather_times(signal, is_step, &times, &count, error);
    if (status == TW_OK) status = sample_all(signal, times, count, &all, error);
    tw_free(times);
  }
  if (status == TW_OK && !is_step) status = refine(signal, &all, there, error);
  if (status == TW_OK)
    status = tw_samples_keep(all.times, all.values, all.count, signal->width, signal->path, is_step, node,
                             arena, out, error);
  samples_deinit(&all);
  tw_free(there);
  return status;
}
