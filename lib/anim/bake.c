/* Bakes clips to keys at given times, which every glTF program plays alike. */
#include "clip.h"

#include <math.h>

/* Negates each rotation whose dot product with the one before is negative, as happens where a turn of more
 * than 360 degrees ends. */
static void align_signs(float *rotations, uint32_t count) {
  for (size_t i = 1; i < count; i++) {
    float *key = rotations + 4 * i;
    double before[4], at[4];
    quat_widen(key - 4, before);
    quat_widen(key, at);
    for (int j = 0; j < 4 && quat_dot(before, at) < 0; j++) key[j] = -key[j];
  }
}

tw_track_keys tw_track_as_keys(const tw_track *track, const float *times, float *values, uint32_t key_count) {
  bool rotation = track->path == TW_ROTATION;
  if (rotation) align_signs(values, key_count);
  return (tw_track_keys){.node = track->node,
                         .path = track->path,
                         .interpolation = track->holds ? TW_STEP : TW_LINEAR,
                         .form = rotation ? TW_KEY_QUATERNION : TW_KEY_VALUES,
                         .width = track->width,
                         .key_count = key_count,
                         .times = times,
                         .values = values};
}

static tw_status check_bake_times(const float *times, uint32_t time_count, tw_error *error) {
  if (time_count == 0) return tw_fail(error, TW_INVALID, "there are no times to bake");
  for (uint32_t i = 0; i < time_count; i++) {
    if (isfinite(times[i]) && times[i] >= 0 && (i == 0 || times[i] > times[i - 1])) continue;
    tw_fail(error, TW_INVALID, "time %u is not finite, negative or not after the one before it", i);
    return tw_error_at(error, "/times/%u", i);
  }
  return TW_OK;
}

tw_status tw_track_bake(const tw_clip *clip, uint32_t index, const float *times, uint32_t time_count,
                        tw_arena *arena, tw_track_keys *out, tw_error *error) {
  const tw_track *track = &clip->tracks[index];
  float *values = tw_arena_alloc(arena, (size_t)time_count * track->width, sizeof *values);
  if (!values) return tw_fail(error, TW_NO_MEMORY, "no memory for a baked track");
  tw_clip_sample(clip, index, times, time_count, values);
  *out = tw_track_as_keys(track, times, values, time_count);
  return TW_OK;
}

tw_status tw_clip_bake(const tw_clip *clip, const float *times, uint32_t time_count, tw_arena *arena,
                       tw_clip_keys *out, tw_error *error) {
  tw_status status = check_bake_times(times, time_count, error);
  if (status != TW_OK) return status;
  tw_track_keys *tracks = tw_arena_alloc(arena, clip->track_count, sizeof *tracks);
  if (!tracks) return tw_fail(error, TW_NO_MEMORY, "no memory for a baked clip");
  for (uint32_t i = 0; i < clip->track_count && status == TW_OK; i++)
    status = tw_track_bake(clip, i, times, time_count, arena, &tracks[i], error);
  if (status != TW_OK) return status;
  *out = (tw_clip_keys){.track_count = clip->track_count, .tracks = tracks};
  return TW_OK;
}
