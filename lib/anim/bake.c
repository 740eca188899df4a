/* Clips sampled to keys at given times. */
#include "tweend/bake.h"

#include <math.h>

#include "clip.h"

static tw_status check_times(const float *times, uint32_t time_count, tw_error *error) {
  if (time_count == 0) return tw_fail(error, TW_INVALID, "there are no times to bake");
  for (uint32_t i = 0; i < time_count; i++) {
    if (isfinite(times[i]) && times[i] >= 0 && (i == 0 || times[i] > times[i - 1])) continue;
    tw_fail(error, TW_INVALID, "time %u is not finite, negative or not after the one before it", i);
    return tw_error_at(error, "/times/%u", i);
  }
  return TW_OK;
}

/* A turn of more than 360 degrees changes sides. */
static void align_signs(float *rotations, uint32_t count) {
  for (size_t i = 1; i < count; i++) {
    float *at = rotations + 4 * i;
    const float *before = at - 4;
    if (before[0] * at[0] + before[1] * at[1] + before[2] * at[2] + before[3] * at[3] >= 0) continue;
    for (int j = 0; j < 4; j++) at[j] = -at[j];
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

tw_status tw_clip_bake(const tw_clip *clip, const float *times, uint32_t time_count, tw_arena *arena,
                       tw_clip_keys *out, tw_error *error) {
  tw_status status = check_times(times, time_count, error);
  if (status != TW_OK) return status;
  tw_track_keys *tracks = tw_arena_alloc(arena, clip->track_count, sizeof *tracks);
  if (!tracks) return tw_fail(error, TW_NO_MEMORY, "no memory for a baked clip");
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    float *values = tw_arena_alloc(arena, (size_t)time_count * track->width, sizeof *values);
    if (!values) return tw_fail(error, TW_NO_MEMORY, "no memory for a baked clip");
    tw_clip_sample(clip, i, times, time_count, values);
    tracks[i] = tw_track_as_keys(track, times, values, time_count);
  }
  *out = (tw_clip_keys){.track_count = clip->track_count, .tracks = tracks};
  return TW_OK;
}
