/* Tracks as glTF can hold them: quaternions with STEP, LINEAR (slerp) or CUBICSPLINE. */
#include "gltf_keys.h"

#include <math.h>
#include <string.h>

#include "tweend/bake.h"

static const tw_tolerance TOLERANCE = {.angle = 0.0017453292519943296, .distance = 1}; /* 0.1 degrees */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of an animation");
}

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

static tw_status take_spline(const tw_track_keys *track, tw_arena *arena, tw_track_keys *out,
                             tw_error *error) {
  *out = *track;
  if (track->path == TW_ROTATION) {
    float *values = tw_arena_alloc(arena, track->key_count, 12 * sizeof *values);
    if (!values) return no_memory(error);
    memcpy(values, track->values, (size_t)track->key_count * 12 * sizeof *values);
    straighten_spline(values, track->key_count);
    out->values = values;
  }
  if (track->key_count == 1) {
    out->interpolation = TW_STEP;
    out->values += out->width; /* between its tangents */
  }
  return TW_OK;
}

/* glTF interpolates between the keys just as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP;
}

static tw_status take_rotation(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena,
                               tw_track_keys *out, tw_error *error) {
  tw_track_keys alone = *track;
  alone.node = 0;
  const tw_clip_keys keys = {.track_count = 1, .tracks = &alone};
  tw_clip_keys taken;
  tw_tolerance reached;
  tw_clip *clip = NULL;
  tw_status status = tw_clip_create(&keys, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  status = is_native(track)
               ? tw_clip_bake(clip, track->times, track->key_count, arena, &taken, error)
               : tw_clip_reduce(clip, &keys, TOLERANCE, max_keys, arena, &taken, &reached, error);
  tw_clip_destroy(clip);
  if (status != TW_OK) return status;
  *out = taken.tracks[0];
  out->node = track->node;
  return TW_OK;
}

tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena, tw_track_keys *out,
                          tw_error *error) {
  if (track->interpolation == TW_CUBICSPLINE) return take_spline(track, arena, out, error);
  if (track->path == TW_ROTATION) return take_rotation(track, max_keys, arena, out, error);
  *out = *track;
  return TW_OK;
}
