/* LINEAR keys of a track of Euler angles: its own, and more between two where slerp would leave the path that
 * the angles take, or turn the other way.
 *
 * Between keys the angles change at constant rates a, b, c about axes of which the outer ones turn the inner
 * ones, so the angular acceleration is at most |ab| + |ac| + |bc|. A path strays from the geodesic between
 * its ends by at most an eighth of that, and by up to a quarter more because the sphere of rotations is
 * curved, as long as the step is within STEP_MOST. Cutting a step into n equal parts divides the stray by n
 * squared. */
#include <math.h>
#include <string.h>

#include "clip.h"

static const double STEP_MOST = 2.7; /* the most that the angles of a part change, in all: 154.7 degrees */
static const double CURVATURE = 1.25;

static const double *triple(const tw_track_keys *track, uint32_t key) {
  return track->angles + 3 * (size_t)key;
}

/* The equal parts that the step from a key to the next is cut into. *stray: a bound on how far each of them
 * strays, in radians. */
static double count_parts(const tw_track_keys *track, uint32_t key, double tolerance, double *stray) {
  const double *from = triple(track, key), *to = triple(track, key + 1);
  double a = fabs(to[0] - from[0]), b = fabs(to[1] - from[1]), c = fabs(to[2] - from[2]);
  double whole = CURVATURE * (a * b + a * c + b * c) / 8;
  double parts = fmax(1, ceil(fmax((a + b + c) / STEP_MOST, sqrt(whole / tolerance))));
  *stray = whole / (parts * parts);
  return parts;
}

/* Rotation keys on their way. */
typedef struct key_list {
  float *times, (*rotations)[4];
  uint32_t count;
  double last[4];
} key_list;

static void add_key(key_list *list, float time, const double angles[3], tw_euler_order order) {
  double rotation[4];
  tw_quat_euler(angles, order, rotation);
  double scale = tw_quat_key_scale(rotation, list->count > 0 ? list->last : NULL);
  for (int i = 0; i < 4; i++) list->last[i] = rotation[i] * scale;
  if (list->times) list->times[list->count] = time;
  quat_narrow(list->last, list->rotations[list->count++]);
}

/* Adds the keys between a key and the next one, where single precision has times for them. */
static void add_parts(key_list *list, const tw_track_keys *track, uint32_t key, double parts) {
  const double *from = triple(track, key), *to = triple(track, key + 1);
  double start = (double)track->times[key], end = (double)track->times[key + 1];
  for (double part = 1; part < parts; part++) {
    float time = (float)(start + (end - start) * (part / parts));
    if (!(time > list->times[list->count - 1] && time < track->times[key + 1])) continue;
    double angles[3], u = ((double)time - start) / (end - start);
    for (int i = 0; i < 3; i++) angles[i] = from[i] + u * (to[i] - from[i]);
    add_key(list, time, angles, track->order);
  }
}

tw_status tw_euler_keys(const tw_track_keys *track, double tolerance, uint32_t max_added, tw_arena *arena,
                        tw_track_keys *out, double *reached, tw_error *error) {
  double added = 0, stray, most = 0;
  for (uint32_t key = 0; key + 1 < track->key_count; key++) {
    added += count_parts(track, key, tolerance, &stray) - 1;
    most = fmax(most, stray);
  }
  if (added > max_added || added > UINT32_MAX / 2 - track->key_count)
    return tw_fail(error, TW_LIMIT, "a track needs more than %u %s besides its own", max_added,
                   tw_plural(max_added, "key", "keys"));
  size_t count = track->key_count + (size_t)added;
  key_list list = {.times = added > 0 ? tw_arena_alloc_raw(arena, count, sizeof *list.times) : NULL,
                   .rotations = tw_arena_alloc_raw(arena, count, sizeof *list.rotations)};
  if ((added > 0 && !list.times) || !list.rotations)
    return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of a track");
  for (uint32_t key = 0; key < track->key_count; key++) {
    add_key(&list, track->times[key], triple(track, key), track->order);
    if (added > 0 && key + 1 < track->key_count)
      add_parts(&list, track, key, count_parts(track, key, tolerance, &stray));
  }
  *out = (tw_track_keys){.node = track->node,
                         .path = TW_ROTATION,
                         .interpolation = TW_LINEAR,
                         .form = TW_KEY_QUATERNION,
                         .width = 4,
                         .key_count = list.count,
                         .times = list.times ? list.times : track->times,
                         .values = list.rotations[0]};
  *reached = fmax(*reached, most);
  return TW_OK;
}
