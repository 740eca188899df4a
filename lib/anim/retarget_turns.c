/* What turns a bone of the target: paths through the source, and where bones point that take others in. */
#include <math.h>
#include <string.h>

#include "retarget_carrying.h"
#include "vector3.h"

void tw_rest_turn(const tw_skeleton *skeleton, uint32_t node, double out[4]) {
  quat_widen(skeleton->nodes[node].rest.rotation, out);
  tw_normalize(out, 4);
}

bool tw_rest_place_in(const tw_skeleton *skeleton, uint32_t above, uint32_t node, double out[3]) {
  memset(out, 0, 3 * sizeof *out);
  for (; node != above; node = skeleton->nodes[node].parent) {
    if (node == TW_NO_INDEX) return false;
    tw_move_place(&skeleton->nodes[node].rest, out);
  }
  return true;
}

/* Adds the turn of a node, or its inverse. */
static void add_step(const tw_carrying *c, tw_turn_path *path, uint32_t node, bool is_inverse) {
  uint32_t track = c->track_of[TW_ROTATION][node];
  if (track != TW_NO_INDEX) {
    tw_path_step *step = &path->steps[path->count++];
    memcpy(step->gap, path->end, sizeof step->gap);
    step->track = track;
    step->is_inverse = is_inverse;
    memcpy(path->end, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
    return;
  }
  double rest[4];
  tw_rest_turn(&c->job->source, node, rest);
  if (is_inverse) quat_conjugate(rest, rest);
  quat_multiply(path->end, rest, path->end);
}

/* The nodes from the root to each. NULL without memory. */
static uint32_t *find_depths(const tw_carrying *c, const tw_skeleton *skeleton) {
  uint32_t *depths = tw_arena_alloc_raw(c->scratch, skeleton->node_count, sizeof *depths);
  for (uint32_t i = 0; depths && i < skeleton->node_count; i++) {
    uint32_t node = skeleton->order[i], parent = skeleton->nodes[node].parent;
    depths[node] = parent == TW_NO_INDEX ? 1 : depths[parent] + 1;
  }
  return depths;
}

/* The rotations that lead from one node's frame to another's; TW_NO_INDEX is the world. NULL without memory.
 */
static bool find_path(const tw_carrying *c, uint32_t from, uint32_t to, tw_turn_path *out) {
  const tw_skeleton *source = &c->job->source;
  uint32_t up = from, down = to, steps = 0, count = 0;
  uint32_t up_depth = from == TW_NO_INDEX ? 0 : c->depths[0][from], depth = c->depths[0][to];
  while (up != down) { /* to where the ways meet */
    bool goes_up = up_depth > depth;
    steps++;
    if (goes_up) {
      up = source->nodes[up].parent;
      up_depth--;
    } else {
      down = source->nodes[down].parent;
      depth--;
      count++;
    }
  }
  *out = (tw_turn_path){.steps = tw_arena_alloc(c->scratch, steps, sizeof *out->steps)};
  uint32_t *way = tw_arena_alloc_raw(c->scratch, count, sizeof *way);
  if (!out->steps || !way) return false;
  memcpy(out->end, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  for (uint32_t node = from; node != up; node = source->nodes[node].parent) add_step(c, out, node, true);
  uint32_t listed = 0;
  for (uint32_t node = to; node != down; node = source->nodes[node].parent) way[listed++] = node;
  while (listed > 0) add_step(c, out, way[--listed], false);
  return true;
}

/* ---- aims ------------------------------------------------------------------------------------ */

/* The mean rest place in the source of the next matched joints below a bone that takes others in, in the
 * frame of the last one of these. */
typedef struct next_joint {
  double place[3];
  uint32_t count;
} next_joint;

/* [bones of the fit]; NULL without memory. */
static next_joint *find_next_joints(const tw_carrying *c) {
  const tw_fit *fit = &c->fit;
  next_joint *next = tw_arena_alloc(c->scratch, fit->bone_count, sizeof *next);
  for (uint32_t i = 0; next && i < fit->bone_count; i++) {
    const tw_fitted_bone *bone = &fit->bones[i];
    double place[3];
    if (bone->above == TW_NO_INDEX || fit->bones[bone->above].last == fit->bones[bone->above].source ||
        !tw_rest_place_in(&c->job->source, fit->bones[bone->above].last, bone->source, place))
      continue;
    for (int k = 0; k < 3; k++) next[bone->above].place[k] += place[k];
    next[bone->above].count++;
  }
  for (uint32_t i = 0; next && i < fit->bone_count; i++)
    for (int k = 0; k < 3 && next[i].count > 0; k++) next[i].place[k] /= next[i].count;
  return next;
}

/* The way from a bone's joint to the next one, in the bone's own frame. time: NULL: as the source rests. */
static void way_at(const tw_carrying *c, const tw_aim *aim, const float *time, double way[3]) {
  double all[4] = {0, 0, 0, 1}, q[4];
  memcpy(way, aim->next, 3 * sizeof *way);
  for (uint32_t i = aim->count; i-- > 0;) {
    tw_trs trs = c->job->source.nodes[aim->nodes[i]].rest;
    if (time) trs = tw_carrying_source_at(c, aim->nodes[i], *time);
    tw_move_place(&trs, way);
    quat_widen(trs.rotation, q);
    tw_normalize(q, 4);
    quat_multiply(q, all, all);
  }
  quat_multiply(all, aim->offset, all); /* from the bone's frame to that of its source's joint */
  quat_conjugate(all, q);
  tw_rotation_turn(q, way, way);
}

/* Makes the aim of a bone, where it has one: *out stays NULL without bones taken in that move. */
static bool make_aim(const tw_carrying *c, uint32_t index, const next_joint *next, const tw_aim **out) {
  const tw_fit *fit = &c->fit;
  const tw_fitted_bone *bone = &fit->bones[index];
  uint32_t count = c->depths[0][bone->last] - c->depths[0][bone->source];
  bool is_bent = false;
  if (bone->last == bone->source || bone->between_count > 0 || next->count == 0) return true;
  uint32_t *nodes = tw_arena_alloc_raw(c->scratch, count, sizeof *nodes);
  tw_aim *made = tw_arena_alloc(c->scratch, 1, sizeof *made);
  if (!nodes || !made) return false;
  for (uint32_t i = count, node = bone->last; i > 0; node = c->job->source.nodes[node].parent) {
    nodes[--i] = node;
    is_bent = is_bent || tw_carrying_moves(c, node);
  }
  *made = (tw_aim){.nodes = nodes, .count = count};
  memcpy(made->offset, bone->offset, sizeof made->offset);
  memcpy(made->next, next->place, sizeof made->next);
  way_at(c, made, NULL, made->rest);
  if (is_bent && tw_unit3(made->rest) > 0) *out = made;
  return true;
}

/* The turn of a bone, in its own frame, towards the next joint. */
static void swing_at(const tw_carrying *c, const tw_aim *aim, float time, double out[4]) {
  double way[3], axis[3];
  way_at(c, aim, &time, way);
  memcpy(out, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  if (tw_unit3(way) == 0) return;
  tw_cross3(aim->rest, way, axis);
  double sine = tw_unit3(axis);
  if (sine > 1e-9) tw_quat_axis_angle(axis, atan2(sine, tw_dot3(aim->rest, way)), out);
}

/* ---- turns ----------------------------------------------------------------------------------- */

static tw_bone_turn *make_turn(tw_carrying *c, uint32_t index) {
  const tw_fit *fit = &c->fit;
  const tw_fitted_bone *bone = &fit->bones[index];
  const tw_skeleton *target = &c->job->target;
  tw_bone_turn *out = tw_arena_alloc(c->scratch, 1, sizeof *out);
  uint32_t parent = target->nodes[bone->target].parent;
  double frame[4], inverse[4]; /* the parent's world at rest, or behind C_above where there is a bone above */
  if (!out) return NULL;
  if (parent == TW_NO_INDEX)
    memcpy(frame, TW_QUAT_IDENTITY, sizeof frame);
  else
    memcpy(frame, fit->target.rotation[parent], sizeof frame);
  if (bone->above != TW_NO_INDEX) {
    const tw_fitted_bone *above = &fit->bones[bone->above];
    quat_conjugate(fit->target.rotation[above->target], inverse);
    quat_multiply(inverse, frame, frame);
    quat_multiply(above->offset, frame, frame);
  } else {
    quat_multiply(fit->turned, frame, frame);
  }
  quat_conjugate(frame, out->before);
  if (bone->above != TW_NO_INDEX) {
    out->above = c->aims[bone->above];
    quat_multiply(out->before, fit->bones[bone->above].offset, out->hang);
  }
  out->own = c->aims[index];
  memcpy(out->after, bone->offset, sizeof out->after);
  out->parts = 1 + bone->between_count;
  out->share = bone->share;
  memcpy(out->direction, bone->direction, sizeof out->direction);
  tw_rest_turn(target, bone->target, out->rest);
  uint32_t from = bone->above == TW_NO_INDEX ? TW_NO_INDEX : fit->bones[bone->above].last;
  return find_path(c, from, bone->last, &out->path) ? out : NULL;
}

/* Makes the turns of the bones that share this one's. */
static bool make_shares(tw_carrying *c, const tw_fitted_bone *bone, const tw_bone_turn *whole) {
  double chain[4];
  memcpy(chain, TW_QUAT_IDENTITY, sizeof chain);
  for (uint32_t i = 0; i < bone->between_count; i++) {
    uint32_t node = c->fit.between[bone->first_between + i];
    tw_bone_turn *part = tw_arena_alloc(c->scratch, 1, sizeof *part);
    double rest[4];
    if (!part) return false;
    *part = *whole;
    part->part = i + 1;
    quat_conjugate(chain, part->left);
    tw_rest_turn(&c->job->target, node, rest);
    quat_multiply(chain, rest, chain);
    memcpy(part->right, chain, sizeof chain);
    c->turns[node] = part;
  }
  return true;
}

static tw_status branch_too_differently(tw_error *error) {
  return tw_fail(error, TW_LIMIT, "the skeletons branch too differently to carry a clip over");
}

tw_status tw_turns_make(tw_carrying *c, tw_error *error) {
  uint64_t steps = 0;
  c->turns = tw_arena_alloc(c->scratch, c->job->target.node_count, sizeof *c->turns);
  c->depths[0] = find_depths(c, &c->job->source);
  c->depths[1] = find_depths(c, &c->job->target);
  c->aims = tw_arena_alloc(c->scratch, c->fit.bone_count, sizeof(const tw_aim *));
  if (!c->turns || !c->depths[0] || !c->depths[1] || !c->aims) return tw_carrying_no_memory(error);
  const next_joint *next = find_next_joints(c);
  if (!next) return tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++)
    if (!make_aim(c, i, &next[i], &c->aims[i])) return tw_carrying_no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++) {
    const tw_fitted_bone *bone = &c->fit.bones[i];
    tw_bone_turn *turn = make_turn(c, i);
    if (!turn || !make_shares(c, bone, turn)) return tw_carrying_no_memory(error);
    c->turns[bone->target] = turn;
    steps += tw_turn_cost(c, turn);
    if (steps > TW_TURN_STEPS_MOST) return branch_too_differently(error);
  }
  return TW_OK;
}

/* ---- evaluating a turn ----------------------------------------------------------------------- */

/* The part of a deviation from rest, which is in the bone's own frame. */
static void take_share(const tw_bone_turn *turn, const double deviation[4], double out[4]) {
  double twist[4] = {0, 0, 0, deviation[3]}, identity[4] = {0, 0, 0, 1};
  double u = 1.0 / turn->parts;
  if (turn->share == TW_SHARE_ALL) {
    tw_rotation_slerp(identity, deviation, u, out);
    return;
  }
  double along = tw_dot3(deviation, turn->direction);
  for (int i = 0; i < 3; i++) twist[i] = along * turn->direction[i];
  if (tw_normalize(twist, 4) < 1e-9) memcpy(twist, identity, sizeof twist); /* half a turn about no axis */
  tw_rotation_slerp(identity, twist, u, out);
  if (turn->part > 0) return;
  /* The first bone keeps the swing: the deviation less what the others turn. */
  double rest_of_twist[4];
  quat_conjugate(twist, rest_of_twist);
  quat_multiply(rest_of_twist, out, rest_of_twist);
  quat_multiply(deviation, rest_of_twist, out);
}

void tw_turn_evaluate(const tw_bone_turn *turn, const float (*joints)[4], const double lead[4],
                      double out[4]) {
  quat_multiply(lead, turn->before, out);
  for (uint32_t i = 0; i < turn->path.count; i++) {
    const tw_path_step *step = &turn->path.steps[i];
    double q[4];
    quat_widen(joints[i], q);
    if (step->is_inverse) quat_conjugate(q, q);
    quat_multiply(out, step->gap, out);
    quat_multiply(out, q, out);
  }
  quat_multiply(out, turn->path.end, out);
  quat_multiply(out, turn->after, out);
  tw_normalize(out, 4);
  if (turn->parts == 1) return;
  double deviation[4], share[4];
  quat_conjugate(turn->rest, deviation);
  quat_multiply(deviation, out, deviation);
  take_share(turn, deviation, share);
  if (turn->part == 0) {
    quat_multiply(turn->rest, share, out);
  } else {
    quat_multiply(turn->left, share, out);
    quat_multiply(out, turn->right, out);
  }
}

/* The rotation of a step's joint. time: NULL: as the source rests. */
static void joint_at(const tw_carrying *c, const tw_path_step *step, const float *time, float out[4]) {
  if (time)
    tw_clip_sample(c->clip, step->track, time, 1, out);
  else
    memcpy(out, c->job->source.nodes[c->tracks[step->track].node].rest.rotation, 4 * sizeof *out);
}

void tw_turn_unswung(const tw_carrying *c, const tw_bone_turn *turn, const float *time, float (*room)[4],
                     double out[4]) {
  double lead[4], swing[4], back[4];
  for (uint32_t i = 0; i < turn->path.count; i++) joint_at(c, &turn->path.steps[i], time, room[i]);
  memcpy(lead, TW_QUAT_IDENTITY, sizeof lead);
  if (turn->above && time) { /* hangs on a bone that swings: K^-1 swing^-1 K */
    swing_at(c, turn->above, *time, swing);
    quat_conjugate(swing, swing);
    quat_conjugate(turn->hang, back);
    quat_multiply(turn->hang, swing, lead);
    quat_multiply(lead, back, lead);
  }
  tw_turn_evaluate(turn, (const float(*)[4])room, lead, out);
  if (!turn->own || !time) return;
  swing_at(c, turn->own, *time, swing);
  quat_multiply(out, swing, out);
}

/* ---- what turns depend on -------------------------------------------------------------------- */

/* Lists behind the first `count` tracks, if there is a list, and returns how many there are then. */
static uint32_t add_track(uint32_t *tracks, uint32_t count, uint32_t track) {
  if (track == TW_NO_INDEX) return count;
  if (tracks) tracks[count] = track;
  return count + 1;
}

static uint32_t add_nodes(const tw_carrying *c, const uint32_t *nodes, uint32_t node_count, uint32_t *tracks,
                          uint32_t count) {
  for (uint32_t i = 0; i < node_count; i++)
    for (int path = 0; path < TW_WEIGHTS; path++)
      count = add_track(tracks, count, c->track_of[path][nodes[i]]);
  return count;
}

static uint32_t add_unswung(const tw_carrying *c, const tw_bone_turn *turn, uint32_t *tracks,
                            uint32_t count) {
  const tw_aim *aims[] = {turn->own, turn->above};
  for (uint32_t i = 0; i < turn->path.count; i++) count = add_track(tracks, count, turn->path.steps[i].track);
  for (int i = 0; i < 2; i++)
    if (aims[i]) count = add_nodes(c, aims[i]->nodes, aims[i]->count, tracks, count);
  return count;
}

uint32_t tw_turn_tracks(const tw_carrying *c, const tw_bone_turn *turn, uint32_t *tracks) {
  const tw_spine_swing *spine = turn->spine;
  uint32_t count = add_unswung(c, turn, tracks, 0);
  if (!spine) return count;
  count = add_nodes(c, spine->source, spine->source_count, tracks, count);
  for (uint32_t i = 0; i < spine->target_count; i++)
    if (c->turns[spine->target[i]]) count = add_unswung(c, c->turns[spine->target[i]], tracks, count);
  return count;
}

static uint64_t unswung_cost(const tw_bone_turn *turn) {
  return (uint64_t)turn->path.count + (turn->own ? turn->own->count : 0) +
         (turn->above ? turn->above->count : 0);
}

uint64_t tw_turn_cost(const tw_carrying *c, const tw_bone_turn *turn) {
  const tw_spine_swing *spine = turn->spine;
  uint64_t cost = unswung_cost(turn);
  if (!spine) return cost;
  cost += spine->source_count;
  for (uint32_t i = 0; i < spine->target_count;
       i++) { /* for the top, and for the frame of what hangs there */
    const tw_bone_turn *of = c->turns[spine->target[i]];
    cost += 2 * (1 + (of ? unswung_cost(of) : 0));
  }
  return cost;
}

tw_status tw_turns_measure(const tw_carrying *c, uint64_t steps, tw_error *error) {
  for (uint32_t i = 0; i < c->fit.bone_count && steps <= TW_TURN_STEPS_MOST; i++)
    steps += tw_turn_cost(c, c->turns[c->fit.bones[i].target]);
  return steps <= TW_TURN_STEPS_MOST ? TW_OK : branch_too_differently(error);
}
