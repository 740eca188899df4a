/* What makes keys fit to be compiled. Every message bears the place relative to the clip. */
#include "clip.h"

#include <math.h>
#include <stdlib.h>

static const char *const path_names[] = {"translation", "rotation", "scale", "weights"};
static const char *const interpolation_names[] = {"step", "linear", "cubicspline", "nlerp", "squad", "euler"};

/* Angles beyond this have lost their precision. */
static const double ANGLE_MAX = 1e9;

static const char *values_word(tw_key_form form) {
  switch (form) {
  case TW_KEY_VALUES: return "values";
  case TW_KEY_QUATERNION: return "quaternions";
  case TW_KEY_EULER: return "eulers";
  case TW_KEY_AXIS_ANGLE: return "axis_angles";
  }
  return "values";
}

static tw_status check_times(const tw_track_keys *track, uint32_t index, tw_error *error) {
  for (uint32_t i = 0; i < track->key_count; i++) {
    float time = track->times[i];
    const char *fault = NULL;
    if (!isfinite(time))
      fault = "is not finite";
    else if (time < 0)
      fault = "is negative";
    else if (i > 0 && time == track->times[i - 1])
      fault = "is the same as the one before it";
    else if (i > 0 && time < track->times[i - 1])
      fault = "is before the one before it";
    if (!fault) continue;
    tw_fail(error, TW_INVALID, "key time %u (%g) %s", i, (double)time, fault);
    return tw_error_at(error, "/tracks/%u/times/%u", index, i);
  }
  return TW_OK;
}

static tw_status check_values(const tw_track_keys *track, uint32_t index, tw_error *error) {
  bool cubic = track->interpolation == TW_CUBICSPLINE;
  size_t per_key =
      track->angles ? (track->form == TW_KEY_EULER ? 3 : 4) : (size_t)track->width * (cubic ? 3 : 1);
  size_t count = track->key_count * per_key;
  for (size_t i = 0; i < count; i++) {
    bool bad = track->angles ? !(fabs(track->angles[i]) <= ANGLE_MAX) : !isfinite(track->values[i]);
    if (!bad) continue;
    tw_fail(error, TW_INVALID, "key %zu has a number that is not finite%s", i / per_key,
            track->angles ? " or an angle beyond 1e9 radians" : "");
    return tw_error_at(error, "/tracks/%u/%s/%zu", index, values_word(track->form), i / per_key);
  }
  return TW_OK;
}

/* The width that a track's path and form ask for; 0 where any will do. */
static uint32_t expected_width(const tw_track_keys *track) {
  switch (track->path) {
  case TW_TRANSLATION:
  case TW_SCALE: return 3;
  case TW_ROTATION: return track->form == TW_KEY_EULER ? 3 : 4;
  case TW_WEIGHTS: break;
  }
  return 0;
}

static bool has_interpolation(const tw_track_keys *track) {
  switch (track->interpolation) {
  case TW_STEP:
  case TW_LINEAR: return true;
  case TW_CUBICSPLINE: return !track->angles;
  case TW_NLERP:
  case TW_SQUAD: return track->path == TW_ROTATION;
  case TW_EULER: return track->path == TW_ROTATION && track->form == TW_KEY_EULER;
  }
  return false;
}

static tw_status refuse(tw_error *error, uint32_t index, const char *member) {
  return tw_error_at(error, "/tracks/%u/%s", index, member);
}

static tw_status check_shape(const tw_track_keys *track, uint32_t index, uint32_t node_count, int force,
                             tw_error *error) {
  bool angular = track->form == TW_KEY_EULER || track->form == TW_KEY_AXIS_ANGLE;
  uint32_t width = expected_width(track);
  if (track->node >= node_count) {
    tw_fail(error, TW_INVALID, "track %u moves node %u, but there are %u nodes", index, track->node,
            node_count);
    return refuse(error, index, "node");
  }
  if (track->key_count == 0) {
    tw_fail(error, TW_INVALID, "track %u has no keys", index);
    return refuse(error, index, "times");
  }
  if (angular ? track->path != TW_ROTATION || !track->angles : track->angles || !track->values) {
    tw_fail(error, TW_INVALID, "a %s track cannot have keys in this form", path_names[track->path]);
    return refuse(error, index, values_word(track->form));
  }
  if (track->width == 0 || (width != 0 && track->width != width)) {
    tw_fail(error, TW_INVALID, "a %s track cannot have keys of %u numbers", path_names[track->path],
            track->width);
    return refuse(error, index, values_word(track->form));
  }
  if (!has_interpolation(track)) {
    tw_fail(error, TW_INVALID, "interpolation %s does not go with the keys of this %s track",
            interpolation_names[track->interpolation], path_names[track->path]);
    return refuse(error, index, "interpolation");
  }
  if (force == TW_CUBICSPLINE && track->path == TW_ROTATION && track->interpolation != TW_CUBICSPLINE) {
    tw_fail(error, TW_INVALID, "track %u has no tangents to interpolate as cubicspline", index);
    return refuse(error, index, "interpolation");
  }
  return TW_OK;
}

tw_status tw_clip_check(const tw_clip_keys *keys, uint32_t node_count, int force, tw_error *error) {
  uint8_t *moved = tw_alloc_zero(node_count, 1);
  if (!moved) return tw_fail(error, TW_NO_MEMORY, "no memory to check a clip");
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < keys->track_count && status == TW_OK; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    status = check_shape(track, i, node_count, force, error);
    if (status == TW_OK) status = check_times(track, i, error);
    if (status == TW_OK) status = check_values(track, i, error);
    if (status != TW_OK) break;
    uint8_t bit = (uint8_t)(1u << track->path);
    if (moved[track->node] & bit) {
      tw_fail(error, TW_INVALID, "two tracks move the %s of node %u", path_names[track->path], track->node);
      status = refuse(error, i, "path");
    }
    moved[track->node] |= bit;
  }
  free(moved);
  return status;
}
