/* Carries a clip over to another skeleton as keys. What a target bone does is a constant, times the turns of
 * the source's joints from the last bone of the matched one above to its own last bone, times a constant:
 *
 *   local = K^-1 C_above^-1 (q_1 ... q_n) C
 *
 * where K are the rest rotations of the target's nodes between the two bones, and C is how a bone of the
 * target lies on the source's (offset, retarget_fit.h).
 *
 * A bone that takes in the source's bones below it is also turned so that it points to where the next joint
 * is, not to where it would be at the end of a straight limb.
 *
 * With one moving joint the keys themselves are carried over: slerp, splines and steps commute with constant
 * rotations. Else the product is sampled at all times of its tracks, and between them as often as it takes.
 */
#include <math.h>
#include <string.h>

#include "foot_hold.h"
#include "retarget_carrying.h"
#include "vector3.h"

static const double STILL = 1e-6; /* radians within which a bone stays at rest without a key */

/* ---- rotations ------------------------------------------------------------------------------- */

/* Products with constants are linear in a quaternion, so tangents go the same way. */
static void map_rotation(const void *context, const double *value, bool is_tangent, double *out) {
  const tw_bone_turn *turn = context;
  const tw_path_step *step = &turn->path.steps[0];
  double q[4];
  (void)is_tangent;
  memcpy(q, value, sizeof q);
  if (step->is_inverse) quat_conjugate(q, q);
  quat_multiply(turn->before, step->gap, out);
  quat_multiply(out, q, out);
  quat_multiply(out, turn->path.end, out);
  quat_multiply(out, turn->after, out);
}

/* What a signal of a turn takes. */
typedef struct turn_signal {
  const tw_carrying *carrying;
  const tw_bone_turn *turn;
  float (*room)[4];
} turn_signal;

static void signal_rotation(const void *context, float time, double *out) {
  const turn_signal *signal = context;
  tw_turn_at(signal->carrying, signal->turn, time, signal->room, out);
}

static tw_status sample_turn(tw_carrying *c, const tw_bone_turn *turn, uint32_t node, tw_error *error) {
  uint32_t count = tw_turn_tracks(c, turn, NULL);
  uint32_t *tracks = tw_arena_alloc_raw(c->scratch, count, sizeof *tracks);
  float(*room)[4] = tw_arena_alloc_raw(c->scratch, turn->path.count, sizeof *room);
  if (!tracks || !room) return tw_carrying_no_memory(error);
  tw_turn_tracks(c, turn, tracks);
  const turn_signal context = {c, turn, room};
  const tw_signal signal = {.indices = tracks,
                            .track_count = count,
                            .path = TW_ROTATION,
                            .at = signal_rotation,
                            .context = &context,
                            .cost = tw_turn_cost(c, turn)};
  return tw_signal_carry(c, signal, node, error);
}

/* A bone that nothing moves may still point elsewhere than at rest: one key. */
static tw_status hold_turn(tw_carrying *c, const tw_bone_turn *turn, uint32_t node, tw_error *error) {
  static const float start = 0;
  double held[4], rest[4];
  tw_turn_evaluate(turn, NULL, TW_QUAT_IDENTITY, held);
  tw_rest_turn(&c->job->target, node, rest);
  if (tw_angle_between(held, rest) < STILL) return TW_OK;
  tw_status status =
      tw_samples_keep(&start, held, 1, 4, TW_ROTATION, false, node, c->arena, &c->out[c->out_count], error);
  c->out_count += status == TW_OK;
  return status;
}

/* Whether a turn depends on joints besides those of its path. */
static bool has_aims(const tw_bone_turn *turn) {
  return turn->own || turn->above || turn->spine;
}

static tw_status carry_rotations(tw_carrying *c, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t node = 0; node < c->job->target.node_count && status == TW_OK; node++) {
    const tw_bone_turn *turn = c->turns[node];
    if (!turn) continue;
    if (turn->path.count == 0 && !has_aims(turn))
      status = hold_turn(c, turn, node, error);
    else if (turn->path.count == 1 && turn->parts == 1 && !has_aims(turn))
      status = tw_keys_carry(c, &c->tracks[turn->path.steps[0].track], node, map_rotation, turn, error);
    else
      status = sample_turn(c, turn, node, error);
    if (status == TW_OK) status = tw_work_status(error);
  }
  return status;
}

/* ---- translations and scales of other bones -------------------------------------------------- */

static double unit_of(const tw_rest *rest, uint32_t node) {
  return node == TW_NO_INDEX ? 1 : rest->unit[node];
}

/* From lengths in the frame of the source's parent to those in the frame of the target's: rigs may be scaled
 * as a whole by a node above them. */
static double local_scale(const tw_carrying *c, const tw_fitted_bone *bone) {
  static const double ROUNDING = 1e-6;
  const tw_fit *fit = &c->fit;
  double from = unit_of(&fit->source, c->job->source.nodes[bone->source].parent),
         to = unit_of(&fit->target, c->job->target.nodes[bone->target].parent);
  if (!(from > 0 && to > 0) || fabs(from / to - 1) < ROUNDING) return fit->scale;
  return fit->scale * (from / to);
}

/* Whether a bone's rest translation and rotation are those of the source's bone, scaled. */
static bool rests_alike(const tw_carrying *c, const tw_fitted_bone *bone, double scale) {
  const tw_fit *fit = &c->fit;
  const tw_node *source = &c->job->source.nodes[bone->source], *target = &c->job->target.nodes[bone->target];
  if (bone->above == TW_NO_INDEX) return false;
  const tw_fitted_bone *above = &fit->bones[bone->above];
  if (above->target != target->parent || above->source != source->parent || above->last != above->source)
    return false;
  double from[3], to[3], way[3], a[4], b[4];
  for (int i = 0; i < 3; i++) {
    from[i] = scale * (double)source->rest.translation[i];
    to[i] = (double)target->rest.translation[i];
    way[i] = to[i] - from[i];
  }
  quat_widen(source->rest.rotation, a);
  quat_widen(target->rest.rotation, b);
  double room = 10 * TW_REST_LIKE * (tw_length3(to) + tw_length3(from));
  return tw_length3(way) <= room && tw_angle_between(a, b) <= TW_REST_LIKE &&
         tw_angle_between(above->offset, TW_QUAT_IDENTITY) <= TW_REST_LIKE;
}

/* How a value of the source becomes the target's: as a scaled difference from rest, or by the ratio of the
 * rest values. */
typedef struct likeness {
  double from[3], to[3], scale;
  bool is_ratio;
} likeness;

static void map_alike(const void *context, const double *value, bool is_tangent, double *out) {
  const likeness *like = context;
  for (int i = 0; i < 3; i++) {
    double ratio = like->from[i] != 0 ? like->to[i] / like->from[i] : 1;
    if (like->is_ratio)
      out[i] = value[i] * ratio;
    else
      out[i] = is_tangent ? like->scale * value[i] : like->to[i] + like->scale * (value[i] - like->from[i]);
  }
}

/* Whether a track leaves its node at rest. */
static bool stays(const tw_carrying *c, const tw_track_keys *track, const float *rest) {
  double unit = unit_of(&c->fit.source, c->job->source.nodes[track->node].parent) * c->fit.scale;
  double room = track->path == TW_SCALE ? TW_REST_LIKE : c->job->tolerance.distance * c->fit.size / unit;
  bool is_cubic = track->interpolation == TW_CUBICSPLINE;
  double seconds = is_cubic ? (double)track->times[track->key_count - 1] - (double)track->times[0] : 0;
  for (size_t row = 0; row < (size_t)track->key_count * (is_cubic ? 3 : 1); row++)
    for (int i = 0; i < 3; i++) {
      double value = (double)track->values[3 * row + (size_t)i];
      bool is_tangent = is_cubic && row % 3 != 1;
      if (fabs(is_tangent ? value * seconds : value - (double)rest[i]) > room) return false;
    }
  return true;
}

static tw_status carry_alike(tw_carrying *c, const tw_fitted_bone *bone, tw_path path, tw_error *error) {
  uint32_t track = c->track_of[path][bone->source];
  const tw_trs *from = &c->job->source.nodes[bone->source].rest,
               *to = &c->job->target.nodes[bone->target].rest;
  const float *source = path == TW_SCALE ? from->scale : from->translation;
  const float *target = path == TW_SCALE ? to->scale : to->translation;
  if (track == TW_NO_INDEX || (path == TW_TRANSLATION && bone->is_carrier)) return TW_OK;
  if (path == TW_TRANSLATION && c->spine && bone->target == c->spine->first) return TW_OK; /* the swing's */
  double scale = local_scale(c, bone);
  bool is_alike = bone->is_carrier ? tw_carries_scale(bone) : rests_alike(c, bone, scale);
  if (!is_alike) {
    c->lost_count += !stays(c, &c->tracks[track], source);
    return TW_OK;
  }
  likeness like = {.scale = scale, .is_ratio = path == TW_SCALE};
  for (int i = 0; i < 3; i++) {
    like.from[i] = (double)source[i];
    like.to[i] = (double)target[i];
  }
  return tw_keys_carry(c, &c->tracks[track], bone->target, map_alike, &like, error);
}

static tw_status carry_others(tw_carrying *c, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < c->fit.bone_count && status == TW_OK; i++) {
    status = carry_alike(c, &c->fit.bones[i], TW_TRANSLATION, error);
    if (status == TW_OK) status = carry_alike(c, &c->fit.bones[i], TW_SCALE, error);
  }
  return status;
}

/* ---- what is told ---------------------------------------------------------------------------- */

static tw_status tell_bones(const tw_carrying *c, tw_retargeted *out, tw_error *error) {
  const tw_fit *fit = &c->fit;
  out->bones = tw_arena_alloc_raw(c->arena, fit->bone_count, sizeof *out->bones);
  if (!out->bones) return tw_carrying_no_memory(error);
  for (uint32_t node = 0; node < c->job->target.node_count; node++) {
    uint32_t bone = fit->bone_of[node];
    if (bone == TW_NO_INDEX) continue;
    out->bones[out->bone_count++] =
        (tw_matched_bone){.source = fit->bones[bone].source,
                          .target = node,
                          .by = (tw_match)c->match.by[node],
                          .aligned = tw_angle_between(fit->bones[bone].alignment, TW_QUAT_IDENTITY)};
  }
  return TW_OK;
}

static tw_status tell_unmatched(const tw_carrying *c, tw_retargeted *out, tw_error *error) {
  const tw_skeleton *source = &c->job->source, *target = &c->job->target;
  bool *has_target = tw_arena_alloc(c->scratch, source->node_count, sizeof *has_target);
  bool *is_lost = tw_arena_alloc(c->scratch, source->node_count, sizeof *is_lost);
  out->without_target = tw_arena_alloc_raw(c->arena, source->node_count, sizeof(uint32_t));
  out->without_source = tw_arena_alloc_raw(c->arena, target->node_count, sizeof(uint32_t));
  if (!has_target || !is_lost || !out->without_target || !out->without_source)
    return tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++) has_target[c->fit.bones[i].source] = true;
  for (uint32_t i = 0; i < c->job->keys->track_count; i++) { /* what rests by the map moves in the clip */
    const tw_track_keys *track = &c->job->keys->tracks[i];
    if (track->path != TW_WEIGHTS && c->match.is_left[track->node]) is_lost[track->node] = true;
  }
  for (uint32_t i = 0; i < source->node_count; i++)
    if (is_lost[i] || (tw_carrying_moves(c, i) && !has_target[i] && !c->fit.is_taken_in[i]))
      out->without_target[out->without_target_count++] = i;
  for (uint32_t i = 0; i < target->node_count; i++)
    if (c->match.is_target_bone[i] && !c->turns[i]) out->without_source[out->without_source_count++] = i;
  return TW_OK;
}

/* ---- the job --------------------------------------------------------------------------------- */

static tw_status carry(tw_carrying *c, tw_retargeted *out, tw_error *error) {
  tw_status status = tw_retarget_fit(c->job, &c->match, c->scratch, &c->fit, error);
  if (status == TW_OK) status = tw_tracks_take(c, error);
  if (status == TW_OK) status = tw_turns_make(c, error);
  if (status == TW_OK) status = tw_spine_make(c, error);
  if (status != TW_OK) return status;
  c->out = tw_arena_alloc_raw(c->arena, c->job->target.node_count, 3 * sizeof *c->out);
  if (!c->out) return tw_carrying_no_memory(error);
  status = carry_rotations(c, error);
  if (status == TW_OK) status = tw_places_carry(c, error);
  if (status == TW_OK) status = tw_spine_carry(c, error);
  if (status == TW_OK) status = carry_others(c, error);
  if (status == TW_OK) status = tell_bones(c, out, error);
  if (status == TW_OK) status = tell_unmatched(c, out, error);
  out->keys = (tw_clip_keys){.track_count = c->out_count, .tracks = c->out};
  out->scale = c->fit.scale;
  out->lost_count = c->lost_count;
  if (status != TW_OK || !c->job->holds_feet) return status;
  return tw_feet_hold(c->job, &c->match, c->fit.up, c->fit.size, c->arena, &out->keys, &out->held_count,
                      error);
}

tw_status tw_retarget_run(const tw_retarget_job *job, tw_arena *arena, tw_retargeted *out, tw_error *error) {
  tw_retarget_job straight;
  tw_carrying c = {.job = &straight, .arena = arena, .scratch = tw_arena_create()};
  tw_retargeted made = {0};
  uint8_t *signs;
  uint32_t bones[2][TW_BONES];
  tw_status status =
      c.scratch ? tw_bones_match(job, c.scratch, &c.match, error) : tw_carrying_no_memory(error);
  if (status == TW_OK) {
    tw_bones_list(job, &c.match, bones);
    status = tw_signs_take(job, bones, arena, &straight, &signs, error);
  }
  if (status == TW_OK)
    status = tw_stance_take(&c.match, bones, c.scratch, &straight, &made.stance_time, error);
  if (status == TW_OK) status = carry(&c, &made, error);
  if (status == TW_OK) status = tw_signs_give_back(&job->target, signs, arena, &made.keys, error);
  tw_clip_destroy(c.clip);
  tw_arena_destroy(c.scratch);
  if (status == TW_OK) *out = made;
  return status;
}
