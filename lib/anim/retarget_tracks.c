/* The source's tracks, with quaternions in place of angles. */
#include <string.h>

#include "retarget_carrying.h"

tw_status tw_carrying_no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory to carry a clip over");
}

static void rotation_key(const tw_track_keys *track, uint32_t key, double out[4]) {
  if (track->form == TW_KEY_EULER)
    tw_quat_euler(track->angles + 3 * (size_t)key, track->order, out);
  else
    tw_quat_axis_angle(track->angles + 4 * (size_t)key, track->angles[4 * (size_t)key + 3], out);
}

/* Replaces Euler or axis-angle keys, which the track interpolates as quaternions, by quaternions. False
 * without memory. */
static bool make_quaternions(const tw_track_keys *track, tw_arena *arena, tw_track_keys *out) {
  float *values = tw_arena_alloc_raw(arena, track->key_count, 4 * sizeof *values);
  if (!values) return false;
  for (uint32_t i = 0; i < track->key_count; i++) {
    double q[4], axis[4];
    if (track->form == TW_KEY_EULER) {
      rotation_key(track, i, q);
    } else {
      memcpy(axis, track->angles + 4 * (size_t)i, sizeof axis);
      tw_normalize(axis, 3);
      tw_quat_axis_angle(axis, axis[3], q);
    }
    quat_narrow(q, values + 4 * (size_t)i);
  }
  *out = *track;
  out->form = TW_KEY_QUATERNION;
  out->width = 4;
  out->values = values;
  out->angles = NULL;
  return true;
}

/* Whether the track interpolates its Euler or axis-angle keys as angles, not as quaternions. */
static bool moves_angles(const tw_track_keys *track) {
  return track->angles && (track->interpolation == TW_EULER ||
                           (track->form == TW_KEY_AXIS_ANGLE && track->interpolation == TW_LINEAR));
}

/* Replaces keys whose angles are interpolated by LINEAR quaternions, as many as the tolerance asks for. */
static tw_status express(tw_carrying *c, const tw_track_keys *track, uint64_t *steps, tw_track_keys *out,
                         tw_error *error) {
  tw_track_keys only = *track;
  only.node = 0;
  const tw_clip_keys alone = {.track_count = 1, .tracks = &only};
  tw_clip_keys expressed;
  tw_tolerance reached = {0};
  tw_clip *clip;
  tw_status status = tw_clip_create(&alone, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  status = tw_clip_express(clip, &alone, c->job->tolerance, c->job->max_keys, steps, c->arena, &expressed,
                           &reached, error);
  tw_clip_destroy(clip);
  if (status != TW_OK) return status;
  *out = expressed.tracks[0];
  out->node = track->node;
  return TW_OK;
}

tw_status tw_tracks_take(tw_carrying *c, tw_error *error) {
  const tw_clip_keys *keys = c->job->keys;
  uint64_t steps = TW_REDUCTION_STEPS;
  c->tracks = tw_arena_alloc_raw(c->scratch, keys->track_count, sizeof *c->tracks);
  if (!c->tracks) return tw_carrying_no_memory(error);
  for (int path = 0; path < TW_WEIGHTS; path++) {
    c->track_of[path] = tw_arena_alloc_raw(c->scratch, c->job->source.node_count, sizeof(uint32_t));
    if (!c->track_of[path]) return tw_carrying_no_memory(error);
    memset(c->track_of[path], 0xFF, c->job->source.node_count * sizeof(uint32_t));
  }
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < keys->track_count && status == TW_OK; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    c->tracks[i] = *track;
    if (track->path != TW_WEIGHTS && !c->match.is_left[track->node])
      c->track_of[track->path][track->node] = i;
    if (moves_angles(track))
      status = express(c, track, &steps, &c->tracks[i], error);
    else if (track->angles && !make_quaternions(track, c->arena, &c->tracks[i]))
      status = tw_carrying_no_memory(error);
    c->tracks[i].preserved = NULL; /* it may refer to other parts of the source's file */
  }
  const tw_clip_keys all = {.track_count = keys->track_count, .tracks = c->tracks};
  return status == TW_OK ? tw_clip_create(&all, c->job->source.node_count, -1, &c->clip, error) : status;
}

tw_trs tw_carrying_source_at(const tw_carrying *c, uint32_t node, float time) {
  tw_trs out = c->job->source.nodes[node].rest;
  float *parts[] = {out.translation, out.rotation, out.scale};
  for (int path = 0; path < TW_WEIGHTS; path++)
    if (c->track_of[path][node] != TW_NO_INDEX)
      tw_clip_sample(c->clip, c->track_of[path][node], &time, 1, parts[path]);
  return out;
}

bool tw_carrying_moves(const tw_carrying *c, uint32_t node) {
  for (int path = 0; path < TW_WEIGHTS; path++)
    if (c->track_of[path][node] != TW_NO_INDEX) return true;
  return false;
}

void tw_move_place(const tw_trs *trs, double place[3]) {
  double q[4];
  quat_widen(trs->rotation, q);
  tw_normalize(q, 4);
  for (int i = 0; i < 3; i++) place[i] *= (double)trs->scale[i];
  tw_rotation_turn(q, place, place);
  for (int i = 0; i < 3; i++) place[i] += (double)trs->translation[i];
}
