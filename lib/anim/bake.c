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
