/* Converts tracks into keys that glTF can hold. */
#include <string.h>

#include "gltf/gltf.h"
#include "quat.h"

static const tw_tolerance TOLERANCE = {.angle = 0.0017453292519943296, .distance = 1}; /* 0.1 degrees */

/* Scales quaternions to unit length and to the side of the key before, as tw_clip_create does. If all keys
 * are so already, *out has the track's own. */
static tw_status normalize_keys(const tw_track_keys *track, tw_arena *arena, tw_track_keys *out,
                                tw_error *error) {
  float *scaled = NULL;
  double previous[4];
  for (size_t key = 0; key < track->key_count; key++) {
    double rotation[4];
    quat_widen(track->values + key * 4, rotation);
    double scale = tw_quat_key_scale(rotation, key > 0 ? previous : NULL);
    for (int i = 0; i < 4; i++) previous[i] = rotation[i] * scale;
    if (scale == 1) continue;
    if (!scaled) {
      scaled = tw_arena_alloc_raw(arena, track->key_count, 4 * sizeof *scaled);
      if (!scaled) return tw_gltf_no_memory(error);
      memcpy(scaled, track->values, (size_t)track->key_count * 4 * sizeof *scaled);
    }
    quat_narrow(previous, scaled + key * 4);
  }
  *out = *track;
  if (scaled) out->values = scaled;
  return TW_OK;
}

static tw_status take_rotation(const tw_track_keys *track, uint32_t max_keys, uint64_t *steps,
                               tw_arena *arena, tw_track_keys *out, tw_error *error) {
  bool fits = tw_keys_fit_gltf(track);
  if (fits && track->form == TW_KEY_QUATERNION) return normalize_keys(track, arena, out, error);
  tw_track_keys alone = *track;
  alone.node = 0;
  const tw_clip_keys keys = {.track_count = 1, .tracks = &alone};
  tw_clip_keys taken;
  tw_tolerance reached;
  tw_clip *clip = NULL;
  tw_status status = tw_clip_create(&keys, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  status = fits ? tw_clip_bake(clip, track->times, track->key_count, arena, &taken, error)
                : tw_clip_express(clip, &keys, TOLERANCE, max_keys, steps, arena, &taken, &reached, error);
  tw_clip_destroy(clip);
  if (status != TW_OK) return status;
  *out = taken.tracks[0];
  out->node = track->node;
  return TW_OK;
}

tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, uint64_t *steps, tw_arena *arena,
                          tw_track_keys *out, tw_error *error) {
  tw_track_keys taken = *track;
  if (track->interpolation == TW_CUBICSPLINE && track->key_count == 1) {
    taken.interpolation = TW_STEP;
    taken.values += taken.width; /* the value, which stands between its tangents */
  }
  bool stays = taken.interpolation == TW_CUBICSPLINE && tw_keys_fit_gltf(&taken);
  if (taken.path == TW_ROTATION && !stays) return take_rotation(&taken, max_keys, steps, arena, out, error);
  *out = taken;
  return TW_OK;
}
