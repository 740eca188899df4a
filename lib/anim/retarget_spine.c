/* Keeps the top of a spine where the source has it. Where spines differ in their bones they bend at other
 * joints, so that shoulders and neck would end elsewhere though each bone turns as it should. The whole spine
 * is then swung about its first joint until its top, the mean place of the humanoid bones that hang on it,
 * lies in the direction in which the source's does, as seen from that joint. What hangs on the spine keeps
 * its rotation in the world. The top may still be too near to the joint, or too far from it, as where the
 * only bone is close below the shoulders: beyond a small distance the joint itself moves by what is missing.
 */
#include <string.h>

#include "retarget_carrying.h"
#include "vector3.h"

static const double ELSEWHERE = 0.1; /* of the way from the hips to the top */
static const double MISSED = 0.015; /* of that way at rest, some 0.4 % of a person's height: a top that misses
                                      its place by less moves no joint */

static bool is_spine(uint8_t role) {
  return role >= TW_BONE_SPINE && role <= TW_BONE_UPPER_CHEST;
}

/* ---- what the spine is ----------------------------------------------------------------------- */

/* The bones of the target's spine from the first one on, as indices into the fit's: each hangs on the one
 * before, the first on the hips. */
typedef struct spine_bones {
  uint32_t count, bones[TW_SPINE_MOST];
} spine_bones;

static spine_bones find_spine(const tw_carrying *c) {
  const tw_fit *fit = &c->fit;
  spine_bones out = {0};
  uint32_t on = fit->hips;
  for (uint32_t i = 0; i < fit->bone_count && on != TW_NO_INDEX && out.count < TW_SPINE_MOST; i++) {
    if (fit->bones[i].above != on || !is_spine(c->match.role[fit->bones[i].target])) continue;
    out.bones[out.count++] = on = i; /* parents stand first */
  }
  return out;
}

/* Whether a bone has a place in a humanoid, as neck and shoulders have. A file may hang others on a spine. */
static bool is_humanoid(const tw_carrying *c, uint32_t bone) {
  return c->match.role[c->fit.bones[bone].target] < TW_BONES;
}

static bool is_one_of(const spine_bones *spine, uint32_t bone) {
  for (uint32_t i = 0; i < spine->count; i++)
    if (spine->bones[i] == bone) return true;
  return false;
}

/* Whether the clip moves a node of the source between a matched bone and a matched bone below that one. */
static bool moves_between(const tw_carrying *c, uint32_t above, uint32_t below) {
  const tw_node *nodes = c->job->source.nodes;
  for (uint32_t node = nodes[below].parent; node != TW_NO_INDEX && node != above; node = nodes[node].parent)
    if (tw_carrying_moves(c, node)) return true;
  return false;
}

/* How far a joint at rest is on the way from the hips, 0, to the spine's top, 1. */
static double height_of(const double hips[3], const double top[3], const double joint[3]) {
  double way[3], up[3];
  tw_difference3(top, hips, up);
  tw_difference3(joint, hips, way);
  double square = tw_dot3(up, up);
  return square > 0 ? tw_dot3(way, up) / square : 0;
}

/* The mean rest places in the world of the bones that hang on the spine: of the source and the target. */
static void find_world_tops(const tw_carrying *c, uint32_t last_bone, double tops[2][3]) {
  const tw_fit *fit = &c->fit;
  uint32_t count = 0;
  memset(tops, 0, 2 * sizeof *tops);
  for (uint32_t i = 0; i < fit->bone_count; i++) {
    if (fit->bones[i].above != last_bone || !is_humanoid(c, i)) continue;
    count++;
    for (int k = 0; k < 3; k++) { /* running means */
      tops[0][k] += (fit->source.place[fit->bones[i].source][k] - tops[0][k]) / count;
      tops[1][k] += (fit->target.place[fit->bones[i].target][k] - tops[1][k]) / count;
    }
  }
}

/* Whether the target's spine bends at other joints than the source's. */
static bool bends_elsewhere(const tw_carrying *c, const spine_bones *spine) {
  const tw_fit *fit = &c->fit;
  const tw_fitted_bone *hips = &fit->bones[fit->hips];
  double tops[2][3];
  find_world_tops(c, spine->bones[spine->count - 1], tops);
  for (uint32_t i = 0; i < spine->count; i++) {
    const tw_fitted_bone *bone = &fit->bones[spine->bones[i]];
    double from = height_of(fit->source.place[hips->source], tops[0], fit->source.place[bone->source]);
    double to = height_of(fit->target.place[hips->target], tops[1], fit->target.place[bone->target]);
    if (bone->between_count > 0 || moves_between(c, fit->bones[bone->above].last, bone->source) ||
        (!c->match.has_map && fabs(from - to) > ELSEWHERE))
      return true;
  }
  return false;
}

/* Lists the nodes on the way from `above`, without it, down to `last`; *out is NULL where `above` is no
 * ancestor of `last`. False without memory. */
static bool list_way(const tw_carrying *c, const tw_skeleton *skeleton, uint32_t above, uint32_t last,
                     uint32_t **out, uint32_t *count) {
  uint32_t node = last;
  *out = NULL;
  *count = 0;
  for (; node != TW_NO_INDEX && node != above; node = skeleton->nodes[node].parent) ++*count;
  if (node == TW_NO_INDEX) return true;
  *out = tw_arena_alloc_raw(c->scratch, *count, sizeof **out);
  if (!*out) return false;
  node = last;
  for (uint32_t i = *count; i-- > 0; node = skeleton->nodes[node].parent) (*out)[i] = node;
  return true;
}

/* The mean rest places of the humanoid bones that hang on the spine, in the frames of the last nodes of both.
 */
static bool find_tops(const tw_carrying *c, uint32_t last_bone, tw_spine_swing *swing) {
  const tw_fit *fit = &c->fit;
  uint32_t source_last = swing->source[swing->source_count - 1],
           target_last = swing->target[swing->target_count - 1], count = 0;
  for (uint32_t i = 0; i < fit->bone_count; i++) {
    double from[3], to[3];
    if (fit->bones[i].above != last_bone || !is_humanoid(c, i) ||
        !tw_rest_place_in(&c->job->source, source_last, fit->bones[i].source, from) ||
        !tw_rest_place_in(&c->job->target, target_last, fit->bones[i].target, to))
      continue;
    for (int k = 0; k < 3; k++) {
      swing->source_top[k] += from[k];
      swing->target_top[k] += to[k];
    }
    count++;
  }
  for (int k = 0; k < 3 && count > 0; k++) {
    swing->source_top[k] /= count;
    swing->target_top[k] /= count;
  }
  return count > 0;
}

/* ---- the swing ------------------------------------------------------------------------------- */

/* The rotation of a node of the target before the spine is swung. time: NULL: as the source rests. */
static void turn_of(const tw_carrying *c, const tw_spine_swing *swing, uint32_t node, const float *time,
                    double out[4]) {
  const tw_bone_turn *turn = c->turns[node];
  if (turn)
    tw_turn_unswung(c, turn, time, swing->room, out);
  else
    tw_rest_turn(&c->job->target, node, out);
}

/* The top of the target's spine in the frame of its hips. time: NULL: as the source rests. */
static void target_top(const tw_carrying *c, const tw_spine_swing *swing, const float *time, double out[3]) {
  memcpy(out, swing->target_top, 3 * sizeof *out);
  for (uint32_t i = swing->target_count; i-- > 0;) {
    const tw_trs *rest = &c->job->target.nodes[swing->target[i]].rest;
    double q[4];
    turn_of(c, swing, swing->target[i], time, q);
    for (int k = 0; k < 3; k++) out[k] *= (double)rest->scale[k];
    tw_rotation_turn(q, out, out);
    for (int k = 0; k < 3; k++) out[k] += (double)rest->translation[k];
  }
}

/* The top of the source's spine in the frame of its hips. */
static void source_top(const tw_carrying *c, const tw_spine_swing *swing, float time, double out[3]) {
  memcpy(out, swing->source_top, 3 * sizeof *out);
  for (uint32_t i = swing->source_count; i-- > 0;) {
    tw_trs trs = tw_carrying_source_at(c, swing->source[i], time);
    tw_move_place(&trs, out);
  }
}

/* The ways from the target's first joint to the top, as it is before the swing and as the source has it, in
 * the frame of the target's hips. */
static void ways_to_top(const tw_carrying *c, const tw_spine_swing *swing, float time, double is[3],
                        double wanted[3]) {
  source_top(c, swing, time, wanted);
  for (int k = 0; k < 3; k++) wanted[k] = swing->ratio * (wanted[k] - swing->source_rest[k]);
  tw_rotation_turn(swing->turn, wanted, wanted);
  target_top(c, swing, &time, is);
  for (int k = 0; k < 3; k++) {
    wanted[k] += swing->target_rest[k] - swing->joint[k];
    is[k] -= swing->joint[k];
  }
}

/* The swing in the frame of the target's hips. */
static void swing_of_top(const tw_carrying *c, const tw_spine_swing *swing, float time, double out[4]) {
  double is[3], wanted[3], axis[3];
  ways_to_top(c, swing, time, is, wanted);
  memcpy(out, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  tw_cross3(is, wanted, axis);
  double angle = atan2(tw_length3(axis), tw_dot3(is, wanted));
  if (tw_unit3(axis) > 0) tw_quat_axis_angle(axis, angle, out);
}

static void swing_at(const tw_carrying *c, const tw_bone_turn *turn, float time, double q[4]) {
  const tw_spine_swing *swing = turn->spine;
  double frame[4] = {0, 0, 0, 1}, own[4], back[4], swung[4];
  for (uint32_t i = 0; i < turn->spine_depth; i++) { /* the frame of the spine's node, from the hips' */
    turn_of(c, swing, swing->target[i], &time, own);
    quat_multiply(frame, own, frame);
  }
  quat_multiply(frame, turn->spine_hang, frame); /* and of the bone's parent */
  swing_of_top(c, swing, time, swung);
  if (!turn->is_first_of_spine) quat_conjugate(swung, swung);
  quat_conjugate(frame, back);
  quat_multiply(back, swung, back);
  quat_multiply(back, frame, back);
  quat_multiply(back, q, q);
  tw_normalize(q, 4);
}

void tw_turn_at(const tw_carrying *c, const tw_bone_turn *turn, float time, float (*room)[4], double out[4]) {
  tw_turn_unswung(c, turn, &time, room, out);
  if (turn->spine) swing_at(c, turn, time, out);
}

/* ---- what the swing leaves ------------------------------------------------------------------- */

/* What a signal of the first joint's translation takes. */
typedef struct joint_signal {
  const tw_carrying *carrying;
  const tw_spine_swing *swing;
} joint_signal;

static void signal_joint(const void *context, float time, double *out) {
  const joint_signal *signal = context;
  const tw_carrying *c = signal->carrying;
  const tw_spine_swing *swing = signal->swing;
  const tw_node *nodes = c->job->target.nodes;
  double is[3], wanted[3], most = MISSED * tw_length3(swing->target_rest);
  ways_to_top(c, swing, time, is, wanted);
  double length = tw_length3(wanted), misses = length - tw_length3(is);
  double moved = copysign(fmax(fabs(misses) - most, 0), misses);
  for (int k = 0; k < 3; k++) out[k] = length > 0 ? moved / length * wanted[k] : 0;
  for (uint32_t i = 0; swing->target[i] != swing->first; i++) { /* into the frame of the joint's parent */
    const float *scale = nodes[swing->target[i]].rest.scale;
    double q[4];
    turn_of(c, swing, swing->target[i], &time, q);
    quat_conjugate(q, q);
    tw_rotation_turn(q, out, out);
    for (int k = 0; k < 3; k++) out[k] = scale[k] != 0 ? out[k] / (double)scale[k] : 0;
  }
  for (int k = 0; k < 3; k++) out[k] += (double)nodes[swing->first].rest.translation[k];
}

static bool is_at_rest(const tw_track_keys *keys, const float rest[3]) {
  for (size_t i = 0; i < 3 * (size_t)keys->key_count; i++)
    if (keys->values[i] != rest[i % 3]) return false;
  return true;
}

tw_status tw_spine_carry(tw_carrying *c, tw_error *error) {
  const tw_spine_swing *swing = c->spine;
  if (!swing) return TW_OK;
  const tw_bone_turn *turn = c->turns[swing->first];
  uint32_t count = tw_turn_tracks(c, turn, NULL);
  uint32_t *tracks = tw_arena_alloc_raw(c->scratch, count, sizeof *tracks);
  if (!tracks) return tw_carrying_no_memory(error);
  tw_turn_tracks(c, turn, tracks);
  const joint_signal context = {c, swing};
  const tw_signal signal = {.indices = tracks,
                            .track_count = count,
                            .path = TW_TRANSLATION,
                            .at = signal_joint,
                            .context = &context,
                            .cost = tw_turn_cost(c, turn)};
  tw_status status = tw_signal_carry(c, signal, swing->first, error);
  if (status == TW_OK &&
      is_at_rest(&c->out[c->out_count - 1], c->job->target.nodes[swing->first].rest.translation))
    c->out_count--;
  return status;
}

/* ---- making it ------------------------------------------------------------------------------- */

/* Adds the swing to the turn of a bone: the spine's first one, or, the other way round, one that hangs on the
 * spine. Returns how many nodes were looked at. */
static uint64_t add_swing(const tw_carrying *c, const tw_spine_swing *swing, uint32_t node, bool is_first) {
  const tw_skeleton *target = &c->job->target;
  tw_bone_turn *turn = c->turns[node];
  uint64_t steps = 0;
  double own[4];
  turn->spine = swing;
  turn->is_first_of_spine = is_first;
  memcpy(turn->spine_hang, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  for (node = target->nodes[node].parent; node != swing->hips; node = target->nodes[node].parent, steps++) {
    uint32_t depth = c->depths[1][node] - c->depths[1][swing->hips];
    turn->spine_depth = depth <= swing->target_count && swing->target[depth - 1] == node ? depth : 0;
    if (turn->spine_depth > 0) break;
    tw_rest_turn(target, node, own);
    quat_multiply(own, turn->spine_hang, turn->spine_hang);
  }
  return steps;
}

/* What the swing computes with. False where the spine has no length. */
static bool find_constants(const tw_carrying *c, tw_spine_swing *swing) {
  const tw_skeleton *source = &c->job->source;
  const tw_fitted_bone *hips = &c->fit.bones[c->fit.hips];
  quat_conjugate(hips->offset, swing->turn);
  tw_rest_place_in(&c->job->target, swing->hips, swing->first, swing->joint);
  memcpy(swing->source_rest, swing->source_top, sizeof swing->source_rest);
  for (uint32_t i = swing->source_count; i-- > 0;)
    tw_move_place(&source->nodes[swing->source[i]].rest, swing->source_rest);
  target_top(c, swing, NULL, swing->target_rest);
  double length = tw_length3(swing->source_rest);
  swing->ratio = length > 0 ? tw_length3(swing->target_rest) / length : 0;
  return swing->ratio > 0 && isfinite(swing->ratio);
}

static bool moves_any(const tw_carrying *c, const tw_spine_swing *swing) {
  for (uint32_t i = 0; i < swing->source_count; i++)
    if (tw_carrying_moves(c, swing->source[i])) return true;
  return false;
}

/* The most joints of the source that turn one node of the spine. */
static uint32_t most_steps(const tw_carrying *c, const tw_spine_swing *swing) {
  uint32_t most = 1;
  for (uint32_t i = 0; i < swing->target_count; i++) {
    const tw_bone_turn *turn = c->turns[swing->target[i]];
    if (turn && turn->path.count > most) most = turn->path.count;
  }
  return most;
}

tw_status tw_spine_make(tw_carrying *c, tw_error *error) {
  const tw_fit *fit = &c->fit;
  spine_bones spine = find_spine(c);
  if (spine.count == 0 || !bends_elsewhere(c, &spine)) return TW_OK;
  const tw_fitted_bone *hips = &fit->bones[fit->hips], *last = &fit->bones[spine.bones[spine.count - 1]];
  uint32_t end = last->target;
  if (last->between_count > 0) end = fit->between[last->first_between + last->between_count - 1];
  tw_spine_swing *swing = tw_arena_alloc(c->scratch, 1, sizeof *swing);
  if (!swing || !list_way(c, &c->job->source, hips->last, last->last, &swing->source, &swing->source_count) ||
      !list_way(c, &c->job->target, hips->target, end, &swing->target, &swing->target_count))
    return tw_carrying_no_memory(error);
  swing->hips = hips->target;
  swing->first = fit->bones[spine.bones[0]].target;
  if (!swing->source || !moves_any(c, swing) || !find_tops(c, spine.bones[spine.count - 1], swing))
    return TW_OK;
  swing->room = tw_arena_alloc_raw(c->scratch, most_steps(c, swing), sizeof *swing->room);
  if (!swing->room) return tw_carrying_no_memory(error);
  if (!find_constants(c, swing)) return TW_OK;
  c->spine = swing;
  uint64_t steps = add_swing(c, swing, swing->first, true);
  for (uint32_t i = 0; i < fit->bone_count && steps <= TW_TURN_STEPS_MOST; i++)
    if (is_one_of(&spine, fit->bones[i].above) && !is_one_of(&spine, i))
      steps += add_swing(c, swing, fit->bones[i].target, false);
  return tw_turns_measure(c, steps, error);
}
