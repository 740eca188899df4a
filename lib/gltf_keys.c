/* Tracks as glTF can hold them: quaternions with STEP, LINEAR (slerp) or CUBICSPLINE. All other rotations
 * are sampled: the steps between two keys are halved until the middle of each, where slerp strays
 * most, is near enough to the track. */
#include "gltf_keys.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS_MAX = 1024 };

static const double TURN_A_STEP = 0.7853981633974483; /* 45 degrees: no step can hide a whole turn */
static const double STRAY_MAX = 0.0008;               /* radians: 0.05 degrees at the middle of a step */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of an animation");
}

/* ---- splines ---------------------------------------------------------------------------------- */

/* Scales each value and its tangents so that the value has unit length and is on the side of the one
 * before it, as tw_clip does. */
static void straighten_spline(float *keys, uint32_t key_count) {
  const float *previous = NULL;
  for (uint32_t key = 0; key < key_count; key++) {
    float *triple = keys + (size_t)key * 12, *value = triple + 4;
    double square = 0, dot = 0;
    for (int i = 0; i < 4; i++) {
      square += (double)value[i] * (double)value[i];
      if (previous) dot += (double)previous[i] * (double)value[i];
    }
    double scale = (dot < 0 ? -1 : 1) / sqrt(square);
    for (int i = 0; i < 12; i++) triple[i] = (float)((double)triple[i] * scale);
    previous = value;
  }
}

static tw_status take_spline(const tw_track_keys *track, tw_arena *arena, tw_gltf_keys *out,
                             tw_error *error) {
  float *values = tw_arena_alloc(arena, track->key_count, 12 * sizeof *values);
  if (!values) return no_memory(error);
  memcpy(values, track->values, (size_t)track->key_count * 12 * sizeof *values);
  straighten_spline(values, track->key_count);
  out->values = values;
  return TW_OK;
}

/* ---- samples ---------------------------------------------------------------------------------- */

/* A track alone in a clip, and memory for one segment's samples. */
typedef struct sampler {
  const tw_track_keys *track;
  tw_clip *clip;
  float times[2 * STEPS_MAX + 1];
  float rotations[2 * STEPS_MAX + 1][4];
  uint32_t steps[]; /* [key_count] steps that begin at each key; the last has none */
} sampler;

static void sampler_destroy(sampler *s) {
  tw_clip_destroy(s->clip);
  free(s);
}

static tw_status sampler_create(const tw_track_keys *track, sampler **out, tw_error *error) {
  size_t most = (SIZE_MAX - sizeof **out) / sizeof(*out)->steps[0];
  sampler *s = track->key_count < most ? malloc(sizeof *s + track->key_count * sizeof s->steps[0]) : NULL;
  if (!s) return no_memory(error);
  s->track = track;
  tw_track_keys alone = *track;
  alone.node = 0;
  tw_status status =
      tw_clip_create(&(tw_clip_keys){.track_count = 1, .tracks = &alone}, 1, -1, &s->clip, error);
  if (status == TW_OK)
    *out = s;
  else
    free(s);
  return status;
}

static float step_time(const tw_track_keys *track, uint32_t segment, uint32_t step, uint32_t steps) {
  double from = (double)track->times[segment], to = (double)track->times[segment + 1];
  return (float)(from + (to - from) * step / steps);
}

static double angle_between(const float a[4], const float b[4]) {
  double dot = 0, difference = 0, sum = 0;
  for (int i = 0; i < 4; i++) dot += (double)a[i] * (double)b[i];
  for (int i = 0; i < 4; i++) {
    double nearer = dot < 0 ? -(double)b[i] : (double)b[i];
    difference += ((double)a[i] - nearer) * ((double)a[i] - nearer);
    sum += ((double)a[i] + nearer) * ((double)a[i] + nearer);
  }
  return 4 * atan2(sqrt(difference), sqrt(sum));
}

/* How far slerp between every second sample strays from the sample between. */
static double largest_stray(float (*rotations)[4], uint32_t steps) {
  double largest = 0;
  for (uint32_t step = 0; step < steps; step++) {
    float middle[4];
    tw_quat_slerp(rotations[2 * step], rotations[2 * step + 2], 0.5f, middle);
    largest = fmax(largest, angle_between(middle, rotations[2 * step + 1]));
  }
  return largest;
}

/* Steps enough for each to turn less than TURN_A_STEP. */
static uint32_t least_steps(const tw_track_keys *track, uint32_t segment) {
  double travel = 3.141592653589793; /* quaternions take the short way */
  if (track->angles) {
    size_t width = track->form == TW_KEY_EULER ? 3 : 4;
    const double *from = track->angles + segment * width, *to = from + width;
    travel = track->form == TW_KEY_AXIS_ANGLE ? travel : 0; /* the axis turns too */
    for (size_t i = width == 4 ? 3 : 0; i < width; i++) travel += fabs(to[i] - from[i]);
  }
  double steps = ceil(travel / TURN_A_STEP);
  return steps < 1 ? 1 : steps > STEPS_MAX ? STEPS_MAX : (uint32_t)steps;
}

static uint32_t enough_steps(sampler *s, uint32_t segment) {
  uint32_t steps = least_steps(s->track, segment);
  for (; 2 * steps <= STEPS_MAX; steps *= 2) {
    for (uint32_t i = 0; i <= 2 * steps; i++) s->times[i] = step_time(s->track, segment, i, 2 * steps);
    tw_clip_sample(s->clip, 0, s->times, 2 * (size_t)steps + 1, s->rotations[0]);
    if (largest_stray(s->rotations, steps) <= STRAY_MAX) break;
  }
  return steps;
}

/* glTF interpolates between the keys just as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP;
}

/* The times of all keys and of the steps between them; steps that float time cannot tell apart are one.
 * NULL without memory. */
static const float *dense_times(sampler *s, tw_arena *arena, uint32_t *count) {
  const tw_track_keys *track = s->track;
  uint64_t most = 1;
  for (uint32_t segment = 0; segment + 1 < track->key_count; segment++)
    most += s->steps[segment] = enough_steps(s, segment);
  float *times = most < UINT32_MAX ? tw_arena_alloc(arena, (size_t)most, sizeof *times) : NULL;
  if (!times) return NULL;
  *count = 0;
  for (uint32_t segment = 0; segment + 1 < track->key_count; segment++) {
    times[(*count)++] = track->times[segment];
    for (uint32_t step = 1; step < s->steps[segment]; step++) {
      float time = step_time(track, segment, step, s->steps[segment]);
      if (time > times[*count - 1] && time < track->times[segment + 1]) times[(*count)++] = time;
    }
  }
  times[(*count)++] = track->times[track->key_count - 1];
  return times;
}

/* A turn past 180 degrees changes sides. */
static void make_continuous(float (*rotations)[4], uint32_t count) {
  for (uint32_t i = 1; i < count; i++) {
    double dot = 0;
    for (int j = 0; j < 4; j++) dot += (double)rotations[i - 1][j] * (double)rotations[i][j];
    for (int j = 0; dot < 0 && j < 4; j++) rotations[i][j] = -rotations[i][j];
  }
}

static tw_status take_samples(const tw_track_keys *track, tw_arena *arena, tw_gltf_keys *out,
                              tw_error *error) {
  sampler *s = NULL;
  tw_status status = sampler_create(track, &s, error);
  if (status != TW_OK) return status;
  uint32_t count = track->key_count;
  const float *times = is_native(track) ? track->times : dense_times(s, arena, &count);
  float(*rotations)[4] = times ? tw_arena_alloc(arena, count, sizeof *rotations) : NULL;
  if (rotations) {
    tw_clip_sample(s->clip, 0, times, count, rotations[0]);
    make_continuous(rotations, count);
    out->interpolation = track->interpolation == TW_STEP ? TW_STEP : TW_LINEAR;
    out->key_count = count;
    out->times = times;
    out->values = rotations[0];
  }
  sampler_destroy(s);
  return rotations ? TW_OK : no_memory(error);
}

/* ---- all tracks ------------------------------------------------------------------------------- */

tw_status tw_gltf_keys_of(const tw_track_keys *track, tw_arena *arena, tw_gltf_keys *out, tw_error *error) {
  tw_gltf_keys keys = {.interpolation = track->interpolation,
                       .key_count = track->key_count,
                       .width = track->path == TW_ROTATION ? 4 : track->width,
                       .times = track->times,
                       .values = track->values};
  tw_status status = TW_OK;
  if (track->path == TW_ROTATION)
    status = track->interpolation == TW_CUBICSPLINE ? take_spline(track, arena, &keys, error)
                                                    : take_samples(track, arena, &keys, error);
  if (status != TW_OK) return status;
  if (keys.interpolation == TW_CUBICSPLINE && keys.key_count == 1) { /* glTF asks for two */
    keys.interpolation = TW_STEP;
    keys.values += keys.width;
  }
  *out = keys;
  return TW_OK;
}
