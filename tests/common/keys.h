/* Tracks and clips for tests of motion. */
#ifndef KEYS_H
#define KEYS_H

#include "test.h"
#include "tweend/anim.h"

/* values: [count][4], or [count][3][4] for TW_CUBICSPLINE. */
static inline tw_track_keys quaternion_keys(tw_interpolation interpolation, const float *times,
                                            const float *values, uint32_t count) {
  return (tw_track_keys){.path = TW_ROTATION,
                         .interpolation = interpolation,
                         .form = TW_KEY_QUATERNION,
                         .width = 4,
                         .key_count = count,
                         .times = times,
                         .values = values};
}

/* angles: [count][3], radians. */
static inline tw_track_keys euler_keys(tw_euler_order order, const float *times, const double *angles,
                                       uint32_t count) {
  return (tw_track_keys){.path = TW_ROTATION,
                         .interpolation = TW_EULER,
                         .form = TW_KEY_EULER,
                         .order = order,
                         .width = 3,
                         .key_count = count,
                         .times = times,
                         .angles = angles};
}

/* turns: [count][4], axis and angle in radians. */
static inline tw_track_keys axis_angle_keys(const float *times, const double *turns, uint32_t count) {
  return (tw_track_keys){.path = TW_ROTATION,
                         .interpolation = TW_LINEAR,
                         .form = TW_KEY_AXIS_ANGLE,
                         .width = 4,
                         .key_count = count,
                         .times = times,
                         .angles = turns};
}

/* values: [count][3], or [count][3][3] for TW_CUBICSPLINE. */
static inline tw_track_keys value_keys(tw_path path, tw_interpolation interpolation, const float *times,
                                       const float *values, uint32_t count) {
  return (tw_track_keys){.path = path,
                         .interpolation = interpolation,
                         .width = 3,
                         .key_count = count,
                         .times = times,
                         .values = values};
}

/* A clip over at most 100 nodes; fails the test when it is refused. */
static inline tw_clip *clip_of(const tw_track_keys *tracks, uint32_t count, int force) {
  tw_clip_keys keys = {.track_count = count, .tracks = tracks};
  tw_clip *clip = NULL;
  tw_error error = {0};
  if (tw_clip_create(&keys, 100, force, &clip, &error) != TW_OK)
    fail_msg("%s: %s", error.pointer, error.detail);
  return clip;
}

#endif
