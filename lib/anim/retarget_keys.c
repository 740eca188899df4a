/* Carries a clip over to another skeleton as keys. What a target bone does is a constant, times the turns of
 * the source's joints from the last bone of the matched one above to its own last bone, times a constant:
 *
 *   local = K^-1 C_above^-1 (q_1 ... q_n) C
 *
 * A bone that takes in the source's bones below it is also turned so that it points to where the next joint
 * is, not to where it would be at the end of a straight limb.
 *
 * With one moving joint the keys themselves are carried over: slerp, splines and steps commute with constant
 * rotations. Else the product is sampled at all times of its tracks, and between them as often as it takes.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clip.h"
#include "foot_hold.h"
#include "retarget_fit.h"
#include "vector3.h"

static const double IDENTITY[4] = {0, 0, 0, 1};
static const double STILL = 1e-6; /* radians within which a bone stays at rest without a key */
static const double LIKE = 1e-3;  /* radians and parts within which two bones rest alike */

/* ---- the source's tracks ------------------------------------------------------------------------------- */

/* A step of a path through the source: a constant turn, then the joint's rotation. */
typedef struct path_step {
  double gap[4];
  uint32_t track;
  bool is_inverse; /* its inverse: the path goes up */
} path_step;

typedef struct path {
  path_step *steps; /* [count] */
  uint32_t count;
  double end[4]; /* a constant turn behind the last step */
} path;

/* Where a bone points that takes in the source's bones below it: from its joint to the next. */
typedef struct aim {
  const uint32_t *nodes; /* [count] the bones that are taken in, from the upper one down */
  uint32_t count;
  double next[3];   /* the next joint, in the last bone's frame */
  double rest[3];   /* the direction to it at rest, in the frame of the target's bone */
  double offset[4]; /* C of the bone */
} aim;

/* A rotation of the target as a function of time. */
typedef struct turn {
  const aim *own, *above; /* or NULL */
  double hang[4];         /* K^-1 */
  double before[4], after[4];
  path path;
  tw_share share;
  uint32_t part, parts; /* the share: which of how many; parts 1: the whole */
  double rest[4], direction[3];
  double left[4], right[4]; /* of part > 0: around the share */
} turn;

typedef struct carrying {
  const tw_retarget_job *job;
  const tw_bone_match *match;
  tw_fit fit;
  tw_arena *arena; /* of the result */
  tw_arena *scratch;
  tw_track_keys *tracks; /* [tracks of the source] with quaternions */
  uint32_t *track_of[3]; /* by path, [nodes of the source] or TW_NO_INDEX */
  tw_clip *clip;         /* of `tracks` */
  uint32_t *depths[2];   /* [nodes of the source, of the target] nodes from the root to each */
  const aim **aims;      /* [bones of the fit] or NULL */
  turn **turns;          /* [nodes of the target] or NULL */
  tw_track_keys *out;
  uint32_t out_count;
  uint32_t lost_count;
} carrying;

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory to carry a clip over");
}

static void conjugate(const double q[4], double out[4]) {
  for (int i = 0; i < 3; i++) out[i] = -q[i];
  out[3] = q[3];
}

static void rotation_key(const tw_track_keys *track, uint32_t key, double out[4]) {
  if (track->form == TW_KEY_EULER)
    tw_quat_euler(track->angles + 3 * (size_t)key, track->order, out);
  else
    tw_quat_axis_angle(track->angles + 4 * (size_t)key, track->angles[4 * (size_t)key + 3], out);
}

/* Turns Euler and axis-angle keys that are interpolated as quaternions into such. */
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

/* Turns angles that are interpolated into LINEAR quaternions within the tolerance. */
static tw_status express(carrying *c, const tw_track_keys *track, uint64_t *steps, tw_track_keys *out,
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

static tw_status take_tracks(carrying *c, tw_error *error) {
  const tw_clip_keys *keys = c->job->keys;
  uint64_t steps = TW_REDUCTION_STEPS;
  c->tracks = tw_arena_alloc_raw(c->scratch, keys->track_count, sizeof *c->tracks);
  if (!c->tracks) return no_memory(error);
  for (int path = 0; path < TW_WEIGHTS; path++) {
    c->track_of[path] = tw_arena_alloc_raw(c->scratch, c->job->source.node_count, sizeof(uint32_t));
    if (!c->track_of[path]) return no_memory(error);
    memset(c->track_of[path], 0xFF, c->job->source.node_count * sizeof(uint32_t));
  }
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < keys->track_count && status == TW_OK; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    c->tracks[i] = *track;
    if (track->path != TW_WEIGHTS) c->track_of[track->path][track->node] = i;
    if (moves_angles(track))
      status = express(c, track, &steps, &c->tracks[i], error);
    else if (track->angles && !make_quaternions(track, c->arena, &c->tracks[i]))
      status = no_memory(error);
    c->tracks[i].kept = NULL; /* it may refer to other parts of the source's file */
  }
  const tw_clip_keys all = {.track_count = keys->track_count, .tracks = c->tracks};
  return status == TW_OK ? tw_clip_create(&all, c->job->source.node_count, -1, &c->clip, error) : status;
}

/* ---- paths --------------------------------------------------------------------------------------------- */

static void rest_turn(const tw_skeleton *skeleton, uint32_t node, double out[4]) {
  quat_widen(skeleton->nodes[node].rest.rotation, out);
  tw_normalize(out, 4);
}

/* Adds the turn of a node, or its inverse. */
static void add_step(const carrying *c, path *path, uint32_t node, bool is_inverse) {
  uint32_t track = c->track_of[TW_ROTATION][node];
  if (track != TW_NO_INDEX) {
    path_step *step = &path->steps[path->count++];
    memcpy(step->gap, path->end, sizeof step->gap);
    step->track = track;
    step->is_inverse = is_inverse;
    memcpy(path->end, IDENTITY, sizeof IDENTITY);
    return;
  }
  double rest[4];
  rest_turn(&c->job->source, node, rest);
  if (is_inverse) conjugate(rest, rest);
  quat_multiply(path->end, rest, path->end);
}

/* The nodes from the root to each. NULL without memory. */
static uint32_t *find_depths(const carrying *c, const tw_skeleton *skeleton) {
  uint32_t *depths = tw_arena_alloc_raw(c->scratch, skeleton->node_count, sizeof *depths);
  for (uint32_t i = 0; depths && i < skeleton->node_count; i++) {
    uint32_t node = skeleton->order[i], parent = skeleton->nodes[node].parent;
    depths[node] = parent == TW_NO_INDEX ? 1 : depths[parent] + 1;
  }
  return depths;
}

/* The rotations that lead from one node's frame to another's; TW_NO_INDEX is the world. NULL without memory.
 */
static bool find_path(const carrying *c, uint32_t from, uint32_t to, path *out) {
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
  *out = (path){.steps = tw_arena_alloc(c->scratch, steps, sizeof *out->steps)};
  uint32_t *way = tw_arena_alloc_raw(c->scratch, count, sizeof *way);
  if (!out->steps || !way) return false;
  memcpy(out->end, IDENTITY, sizeof IDENTITY);
  for (uint32_t node = from; node != up; node = source->nodes[node].parent) add_step(c, out, node, true);
  uint32_t listed = 0;
  for (uint32_t node = to; node != down; node = source->nodes[node].parent) way[listed++] = node;
  while (listed > 0) add_step(c, out, way[--listed], false);
  return true;
}

/* ---- aims ---------------------------------------------------------------------------------------------- */

/* The local transform of a node of the source at a time. */
static tw_trs source_at(const carrying *c, uint32_t node, float time) {
  tw_trs out = c->job->source.nodes[node].rest;
  float *parts[] = {out.translation, out.rotation, out.scale};
  for (int path = 0; path < TW_WEIGHTS; path++)
    if (c->track_of[path][node] != TW_NO_INDEX)
      tw_clip_sample(c->clip, c->track_of[path][node], &time, 1, parts[path]);
  return out;
}

static bool is_moved(const carrying *c, uint32_t node) {
  for (int path = 0; path < TW_WEIGHTS; path++)
    if (c->track_of[path][node] != TW_NO_INDEX) return true;
  return false;
}

/* The mean place in the source of the next matched joints below a bone. */
typedef struct next_joint {
  double place[3];
  uint32_t count;
} next_joint;

/* [bones of the fit]; NULL without memory. */
static next_joint *find_next_joints(const carrying *c) {
  const tw_fit *fit = &c->fit;
  next_joint *next = tw_arena_alloc(c->scratch, fit->bone_count, sizeof *next);
  for (uint32_t i = 0; next && i < fit->bone_count; i++) {
    const tw_fitted_bone *bone = &fit->bones[i];
    if (bone->above == TW_NO_INDEX) continue;
    for (int k = 0; k < 3; k++) next[bone->above].place[k] += fit->source.place[bone->source][k];
    next[bone->above].count++;
  }
  for (uint32_t i = 0; next && i < fit->bone_count; i++)
    for (int k = 0; k < 3 && next[i].count > 0; k++) next[i].place[k] /= next[i].count;
  return next;
}

/* Makes the aim of a bone, where it has one: *out stays NULL without bones taken in that move. */
static bool make_aim(const carrying *c, uint32_t index, const next_joint *next, const aim **out) {
  const tw_fit *fit = &c->fit;
  const tw_fitted_bone *bone = &fit->bones[index];
  uint32_t count = c->depths[0][bone->last] - c->depths[0][bone->source];
  double back[4], way[3];
  bool is_bent = false;
  if (bone->last == bone->source || bone->between_count > 0 || next->count == 0) return true;
  uint32_t *nodes = tw_arena_alloc_raw(c->scratch, count, sizeof *nodes);
  aim *made = tw_arena_alloc(c->scratch, 1, sizeof *made);
  if (!nodes || !made) return false;
  for (uint32_t i = count, node = bone->last; i > 0; node = c->job->source.nodes[node].parent) {
    nodes[--i] = node;
    is_bent = is_bent || is_moved(c, node);
  }
  *made = (aim){.nodes = nodes, .count = count};
  memcpy(made->offset, bone->offset, sizeof made->offset);
  conjugate(fit->source.rotation[bone->last], back);
  for (int k = 0; k < 3; k++) {
    way[k] = next->place[k] - fit->source.place[bone->source][k];
    made->next[k] = next->place[k] - fit->source.place[bone->last][k];
  }
  tw_rotation_turn(back, made->next, made->next);
  tw_rotation_turn(back, way, way);
  conjugate(bone->offset, back);
  tw_rotation_turn(back, way, made->rest);
  if (is_bent && tw_unit3(made->rest) > 0) *out = made;
  return true;
}

/* The turn of a bone, in its own frame, towards the next joint. */
static void swing_at(const carrying *c, const aim *aim, float time, double out[4]) {
  double way[3], all[4] = {0, 0, 0, 1}, q[4], axis[3];
  memcpy(way, aim->next, sizeof way);
  for (uint32_t i = aim->count; i-- > 0;) {
    tw_trs trs = source_at(c, aim->nodes[i], time);
    quat_widen(trs.rotation, q);
    tw_normalize(q, 4);
    tw_rotation_turn(q, way, way);
    for (int k = 0; k < 3; k++) way[k] += (double)trs.translation[k];
    quat_multiply(q, all, all);
  }
  quat_multiply(all, aim->offset, all); /* from the bone's frame to that of its source's joint */
  conjugate(all, q);
  tw_rotation_turn(q, way, way);
  memcpy(out, IDENTITY, sizeof IDENTITY);
  if (tw_unit3(way) == 0) return;
  tw_cross3(aim->rest, way, axis);
  double sine = tw_unit3(axis);
  if (sine > 1e-9) tw_quat_axis_angle(axis, atan2(sine, tw_dot3(aim->rest, way)), out);
}

/* ---- turns --------------------------------------------------------------------------------------------- */

static turn *make_turn(carrying *c, uint32_t index) {
  const tw_fit *fit = &c->fit;
  const tw_fitted_bone *bone = &fit->bones[index];
  const tw_skeleton *target = &c->job->target;
  turn *out = tw_arena_alloc(c->scratch, 1, sizeof *out);
  uint32_t parent = target->nodes[bone->target].parent;
  double frame[4], inverse[4]; /* the parent's world at rest, or behind C_above where there is a bone above */
  if (!out) return NULL;
  if (parent == TW_NO_INDEX)
    memcpy(frame, IDENTITY, sizeof frame);
  else
    memcpy(frame, fit->target.rotation[parent], sizeof frame);
  if (bone->above != TW_NO_INDEX) {
    const tw_fitted_bone *above = &fit->bones[bone->above];
    conjugate(fit->target.rotation[above->target], inverse);
    quat_multiply(inverse, frame, frame);
    quat_multiply(above->offset, frame, frame);
  } else {
    quat_multiply(fit->turned, frame, frame);
  }
  conjugate(frame, out->before);
  if (bone->above != TW_NO_INDEX) {
    out->above = c->aims[bone->above];
    quat_multiply(out->before, fit->bones[bone->above].offset, out->hang);
  }
  out->own = c->aims[index];
  memcpy(out->after, bone->offset, sizeof out->after);
  out->parts = 1 + bone->between_count;
  out->share = bone->share;
  memcpy(out->direction, bone->direction, sizeof out->direction);
  rest_turn(target, bone->target, out->rest);
  uint32_t from = bone->above == TW_NO_INDEX ? TW_NO_INDEX : fit->bones[bone->above].last;
  return find_path(c, from, bone->last, &out->path) ? out : NULL;
}

/* Makes the turns of the bones that share this one's. */
static bool make_shares(carrying *c, const tw_fitted_bone *bone, const turn *whole) {
  double chain[4];
  memcpy(chain, IDENTITY, sizeof chain);
  for (uint32_t i = 0; i < bone->between_count; i++) {
    uint32_t node = c->fit.between[bone->first_between + i];
    turn *part = tw_arena_alloc(c->scratch, 1, sizeof *part);
    double rest[4];
    if (!part) return false;
    *part = *whole;
    part->part = i + 1;
    conjugate(chain, part->left);
    rest_turn(&c->job->target, node, rest);
    quat_multiply(chain, rest, chain);
    memcpy(part->right, chain, sizeof chain);
    c->turns[node] = part;
  }
  return true;
}

static tw_status make_turns(carrying *c, tw_error *error) {
  enum { STEPS_MOST = 1 << 20 };
  uint64_t steps = 0;
  c->turns = tw_arena_alloc(c->scratch, c->job->target.node_count, sizeof *c->turns);
  c->depths[0] = find_depths(c, &c->job->source);
  c->depths[1] = find_depths(c, &c->job->target);
  c->aims = tw_arena_alloc(c->scratch, c->fit.bone_count, sizeof(const aim *));
  if (!c->turns || !c->depths[0] || !c->depths[1] || !c->aims) return no_memory(error);
  const next_joint *next = find_next_joints(c);
  if (!next) return no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++)
    if (!make_aim(c, i, &next[i], &c->aims[i])) return no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++) {
    const tw_fitted_bone *bone = &c->fit.bones[i];
    turn *turn = make_turn(c, i);
    if (!turn || !make_shares(c, bone, turn)) return no_memory(error);
    c->turns[bone->target] = turn;
    steps += turn->path.count + (turn->above ? turn->above->count : 0);
    if (steps > STEPS_MOST)
      return tw_fail(error, TW_LIMIT, "the skeletons branch too differently to carry a clip over");
  }
  return TW_OK;
}

/* ---- evaluating a turn ---------------------------------------------------------------------- */

/* The part of a deviation from rest, which is in the bone's own frame. */
static void take_share(const turn *turn, const double deviation[4], double out[4]) {
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
  conjugate(twist, rest_of_twist);
  quat_multiply(rest_of_twist, out, rest_of_twist);
  quat_multiply(deviation, rest_of_twist, out);
}

/* joints: the rotation of each step's joint. lead: a turn before all others. */
static void evaluate_turn(const turn *turn, const float (*joints)[4], const double lead[4], double out[4]) {
  quat_multiply(lead, turn->before, out);
  for (uint32_t i = 0; i < turn->path.count; i++) {
    const path_step *step = &turn->path.steps[i];
    double q[4];
    quat_widen(joints[i], q);
    if (step->is_inverse) conjugate(q, q);
    quat_multiply(out, step->gap, out);
    quat_multiply(out, q, out);
  }
  quat_multiply(out, turn->path.end, out);
  quat_multiply(out, turn->after, out);
  tw_normalize(out, 4);
  if (turn->parts == 1) return;
  double deviation[4], share[4];
  conjugate(turn->rest, deviation);
  quat_multiply(deviation, out, deviation);
  take_share(turn, deviation, share);
  if (turn->part == 0) {
    quat_multiply(turn->rest, share, out);
  } else {
    quat_multiply(turn->left, share, out);
    quat_multiply(out, turn->right, out);
  }
}

/* Evaluates at one time. room: [steps][4]. */
static void turn_at(const carrying *c, const turn *turn, float time, float (*room)[4], double out[4]) {
  double lead[4], swing[4], back[4];
  for (uint32_t i = 0; i < turn->path.count; i++)
    tw_clip_sample(c->clip, turn->path.steps[i].track, &time, 1, room[i]);
  memcpy(lead, IDENTITY, sizeof lead);
  if (turn->above) { /* hangs on a bone that swings: K^-1 swing^-1 K */
    swing_at(c, turn->above, time, swing);
    conjugate(swing, swing);
    conjugate(turn->hang, back);
    quat_multiply(turn->hang, swing, lead);
    quat_multiply(lead, back, lead);
  }
  evaluate_turn(turn, (const float(*)[4])room, lead, out);
  if (!turn->own) return;
  swing_at(c, turn->own, time, swing);
  quat_multiply(out, swing, out);
}

/* Whether a turn depends on joints besides those of its path. */
static bool has_aims(const turn *turn) {
  return turn->own || turn->above;
}

/* ---- sampling ------------------------------------------------------------------------------- */

/* Something of the target as a function of time: a rotation or a place. */
typedef struct signal {
  const carrying *carrying;
  const uint32_t *tracks; /* [track_count] of the source, that it depends on */
  uint32_t track_count;
  tw_path path;
  void (*at)(const struct signal *signal, float time, double out[4]);
  const turn *turn;
  const struct place *place;
  float (*room)[4];
} signal;

static int compare_floats(const void *a, const void *b) {
  float left = *(const float *)a, right = *(const float *)b;
  return (left > right) - (left < right);
}

static bool all_step(const signal *signal) {
  for (uint32_t i = 0; i < signal->track_count; i++)
    if (signal->carrying->tracks[signal->tracks[i]].interpolation != TW_STEP) return false;
  return true;
}

/* The key times of all tracks, each once; just before each jump too. */
static float *gather_times(const signal *signal, bool is_step, uint32_t *out_count, tw_error *error) {
  const carrying *c = signal->carrying;
  uint64_t count = 0;
  for (uint32_t i = 0; i < signal->track_count; i++)
    count += 2 * (uint64_t)c->tracks[signal->tracks[i]].key_count;
  float *times = count < UINT32_MAX ? tw_alloc((size_t)count, sizeof *times) : NULL;
  if (!times) {
    no_memory(error);
    return NULL;
  }
  uint32_t used = 0, kept = 0;
  for (uint32_t i = 0; i < signal->track_count; i++) {
    const tw_track_keys *track = &c->tracks[signal->tracks[i]];
    for (uint32_t key = 0; key < track->key_count; key++) {
      float before = nextafterf(track->times[key], -1);
      if (track->interpolation == TW_STEP && !is_step && key > 0 && before > track->times[key - 1])
        times[used++] = before;
      times[used++] = track->times[key];
    }
  }
  qsort(times, used, sizeof *times, compare_floats);
  for (uint32_t i = 0; i < used; i++)
    if (kept == 0 || times[i] > times[kept - 1]) times[kept++] = times[i];
  *out_count = kept;
  return times;
}

enum { LOOKS = 64 }; /* samples after which the work looks whether it is still wanted */

typedef struct sample {
  double value[4];
  float time;
  bool is_settled; /* the way to the next sample is within the tolerance */
} sample;

static double error_between(const signal *signal, const sample *from, const sample *to, double u) {
  double there[4], between[4] = {0};
  signal->at(signal, (float)((double)from->time + u * ((double)to->time - (double)from->time)), there);
  if (signal->path == TW_ROTATION) {
    tw_rotation_slerp(from->value, to->value, u, between);
    return tw_angle_between(there, between);
  }
  for (int i = 0; i < 3; i++) there[i] -= from->value[i] + u * (to->value[i] - from->value[i]);
  return tw_length3(there);
}

static bool is_near(const signal *signal, const sample *from, const sample *to) {
  static const double probes[] = {0.25, 0.5, 0.75};
  const carrying *c = signal->carrying;
  const tw_tolerance *tolerance = &c->job->tolerance;
  double most = signal->path == TW_ROTATION ? tolerance->angle : tolerance->distance * c->fit.size;
  float middle = (float)(((double)from->time + (double)to->time) / 2);
  if (!(middle > from->time && middle < to->time)) return true;
  for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
    if (error_between(signal, from, to, probes[i]) > most) return false;
  return true;
}

/* Halves the steps that stray. */
static tw_status halve(const signal *signal, sample **samples, uint32_t *count, tw_error *error) {
  sample *finer = tw_alloc(2 * (size_t)*count, sizeof *finer);
  uint32_t used = 0;
  tw_status status = finer ? TW_OK : no_memory(error);
  for (uint32_t i = 0; i < *count && status == TW_OK; i++) {
    if (i % LOOKS == 0) status = tw_work_status(error);
    sample *from = &(*samples)[i];
    bool is_last = i + 1 == *count;
    from->is_settled = from->is_settled || is_last || is_near(signal, from, from + 1);
    finer[used++] = *from;
    if (from->is_settled) continue;
    sample middle = {.time = (float)(((double)from->time + (double)from[1].time) / 2)};
    signal->at(signal, middle.time, middle.value);
    finer[used++] = middle;
  }
  if (status != TW_OK) {
    tw_free(finer);
    return status;
  }
  tw_free(*samples);
  *samples = finer;
  *count = used;
  return TW_OK;
}

static tw_status refine(const signal *signal, sample **samples, uint32_t *count, tw_error *error) {
  enum { HALVINGS = 16 };
  for (int pass = 0; pass < HALVINGS; pass++) {
    uint32_t before = *count;
    tw_status status = halve(signal, samples, count, error);
    if (status != TW_OK || *count == before) return status;
    if (*count > signal->carrying->job->max_keys)
      return tw_fail(error, TW_LIMIT, "a track that is carried over needs more than %u keys",
                     signal->carrying->job->max_keys);
  }
  return TW_OK;
}

static tw_status keep_samples(carrying *c, const sample *samples, uint32_t count, tw_path path, bool is_step,
                              uint32_t node, tw_error *error) {
  uint32_t width = path == TW_ROTATION ? 4 : 3;
  float *times = tw_arena_alloc_raw(c->arena, count, sizeof *times);
  float *values = tw_arena_alloc_raw(c->arena, count, width * sizeof *values);
  if (!times || !values) return no_memory(error);
  for (uint32_t i = 0; i < count; i++) {
    times[i] = samples[i].time;
    for (uint32_t k = 0; k < width; k++) values[width * (size_t)i + k] = (float)samples[i].value[k];
  }
  for (uint32_t i = 1; path == TW_ROTATION && i < count; i++) { /* signs go on from the key before */
    float dot = 0;
    for (uint32_t k = 0; k < 4; k++) dot += values[4 * (size_t)i + k] * values[4 * (size_t)(i - 1) + k];
    for (uint32_t k = 0; dot < 0 && k < 4; k++) values[4 * (size_t)i + k] = -values[4 * (size_t)i + k];
  }
  c->out[c->out_count++] = (tw_track_keys){.node = node,
                                           .path = path,
                                           .interpolation = is_step ? TW_STEP : TW_LINEAR,
                                           .form = path == TW_ROTATION ? TW_KEY_QUATERNION : TW_KEY_VALUES,
                                           .width = width,
                                           .key_count = count,
                                           .times = times,
                                           .values = values};
  return TW_OK;
}

static tw_status sample_signal(carrying *c, const signal *signal, uint32_t node, tw_error *error) {
  bool is_step = all_step(signal);
  uint32_t count;
  float *times = gather_times(signal, is_step, &count, error);
  if (!times) return TW_NO_MEMORY;
  sample *samples = tw_alloc_zero(count, sizeof *samples);
  tw_status status = samples ? TW_OK : no_memory(error);
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    samples[i].time = times[i];
    signal->at(signal, times[i], samples[i].value);
    if (i % LOOKS == 0) status = tw_work_status(error);
  }
  tw_free(times);
  if (status == TW_OK && !is_step) status = refine(signal, &samples, &count, error);
  if (status == TW_OK) status = keep_samples(c, samples, count, signal->path, is_step, node, error);
  tw_free(samples);
  return status;
}

/* ---- rotations ------------------------------------------------------------------------------ */

/* A copy of a track's keys for another node. to_value: what becomes of a value, and of a tangent. */
typedef void map_value(const void *context, const double *value, bool is_tangent, double *out);

static tw_status map_keys(carrying *c, const tw_track_keys *track, uint32_t node, map_value *map,
                          const void *context, tw_error *error) {
  bool is_cubic = track->interpolation == TW_CUBICSPLINE;
  size_t rows = (size_t)track->key_count * (is_cubic ? 3 : 1), width = track->width;
  float *values = tw_arena_alloc_raw(c->arena, rows, width * sizeof *values);
  float *times = tw_arena_alloc_raw(c->arena, track->key_count, sizeof *times);
  if (!values || !times) return no_memory(error);
  memcpy(times, track->times, track->key_count * sizeof *times);
  for (size_t row = 0; row < rows; row++) {
    double value[4] = {0}, mapped[4] = {0};
    for (size_t k = 0; k < width; k++) value[k] = (double)track->values[width * row + k];
    map(context, value, is_cubic && row % 3 != 1, mapped);
    for (size_t k = 0; k < width; k++) values[width * row + k] = (float)mapped[k];
  }
  tw_track_keys out = *track;
  out.node = node;
  out.times = times;
  out.values = values;
  out.kept = NULL;
  c->out[c->out_count++] = out;
  return TW_OK;
}

/* Products with constants are linear in a quaternion, so tangents go the same way. */
static void map_rotation(const void *context, const double *value, bool is_tangent, double *out) {
  const turn *turn = context;
  const path_step *step = &turn->path.steps[0];
  double q[4];
  (void)is_tangent;
  memcpy(q, value, sizeof q);
  if (step->is_inverse) conjugate(q, q);
  quat_multiply(turn->before, step->gap, out);
  quat_multiply(out, q, out);
  quat_multiply(out, turn->path.end, out);
  quat_multiply(out, turn->after, out);
}

static void signal_rotation(const signal *signal, float time, double out[4]) {
  turn_at(signal->carrying, signal->turn, time, signal->room, out);
}

/* The most tracks that an aim depends on, and those tracks. */
static uint32_t aim_most(const aim *aim) {
  return aim ? 2 * aim->count : 0;
}

static uint32_t add_aim_tracks(const carrying *c, const aim *aim, uint32_t *tracks) {
  uint32_t count = 0;
  for (uint32_t i = 0; aim && i < aim->count; i++)
    for (int path = TW_TRANSLATION; path <= TW_ROTATION; path++)
      if (c->track_of[path][aim->nodes[i]] != TW_NO_INDEX) tracks[count++] = c->track_of[path][aim->nodes[i]];
  return count;
}

static tw_status sample_turn(carrying *c, const turn *turn, uint32_t node, tw_error *error) {
  uint32_t count = turn->path.count;
  size_t most = (size_t)count + aim_most(turn->own) + aim_most(turn->above);
  uint32_t *tracks = tw_arena_alloc_raw(c->scratch, most, sizeof *tracks);
  float(*room)[4] = tw_arena_alloc_raw(c->scratch, count, sizeof *room);
  if (!tracks || !room) return no_memory(error);
  for (uint32_t i = 0; i < count; i++) tracks[i] = turn->path.steps[i].track;
  count += add_aim_tracks(c, turn->own, tracks + count);
  count += add_aim_tracks(c, turn->above, tracks + count);
  const signal signal = {.carrying = c,
                         .tracks = tracks,
                         .track_count = count,
                         .path = TW_ROTATION,
                         .at = signal_rotation,
                         .turn = turn,
                         .room = room};
  return sample_signal(c, &signal, node, error);
}

/* A bone that nothing moves may still point elsewhere than at rest: one key. */
static tw_status hold_turn(carrying *c, const turn *turn, uint32_t node, tw_error *error) {
  sample held = {.time = 0};
  double rest[4];
  evaluate_turn(turn, NULL, IDENTITY, held.value);
  rest_turn(&c->job->target, node, rest);
  if (tw_angle_between(held.value, rest) < STILL) return TW_OK;
  return keep_samples(c, &held, 1, TW_ROTATION, false, node, error);
}

static tw_status carry_rotations(carrying *c, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t node = 0; node < c->job->target.node_count && status == TW_OK; node++) {
    const turn *turn = c->turns[node];
    if (!turn) continue;
    if (turn->path.count == 0 && !has_aims(turn))
      status = hold_turn(c, turn, node, error);
    else if (turn->path.count == 1 && turn->parts == 1 && !has_aims(turn))
      status = map_keys(c, &c->tracks[turn->path.steps[0].track], node, map_rotation, turn, error);
    else
      status = sample_turn(c, turn, node, error);
    if (status == TW_OK) status = tw_work_status(error);
  }
  return status;
}

/* ---- places --------------------------------------------------------------------------------- */

/* place = the transform of a place. */
static void move_place(const tw_trs *trs, double place[3]) {
  double q[4];
  quat_widen(trs->rotation, q);
  tw_normalize(q, 4);
  for (int i = 0; i < 3; i++) place[i] *= (double)trs->scale[i];
  tw_rotation_turn(q, place, place);
  for (int i = 0; i < 3; i++) place[i] += (double)trs->translation[i];
}

/* A node's own matrix, which may shear, on a place. */
static void move_by_matrix(const float m[16], double place[3]) {
  const double was[3] = {place[0], place[1], place[2]};
  for (int i = 0; i < 3; i++)
    place[i] =
        (double)m[i] * was[0] + (double)m[4 + i] * was[1] + (double)m[8 + i] * was[2] + (double)m[12 + i];
}

/* Where a node of the source is in the world. */
static void source_place(const carrying *c, uint32_t node, float time, double out[3]) {
  const tw_node *nodes = c->job->source.nodes;
  tw_trs own = source_at(c, node, time);
  for (int i = 0; i < 3; i++) out[i] = (double)own.translation[i];
  for (node = nodes[node].parent; node != TW_NO_INDEX; node = nodes[node].parent) {
    if (nodes[node].has_matrix && !is_moved(c, node)) {
      move_by_matrix(nodes[node].matrix, out);
    } else {
      tw_trs trs = source_at(c, node, time);
      move_place(&trs, out);
    }
  }
}

/* The place of a bone of the target that carries the figure. */
typedef struct place {
  uint32_t bone;
  double offset[3]; /* in the target's world */
  uint32_t depth;
  const uint32_t *way;           /* [depth] the target's nodes above, from the root down */
  const struct place **carriers; /* [depth] places of those that are carried too; or NULL */
  float (*room)[4];
} place;

static void target_world(const carrying *c, const place *place, float time, double out[3]) {
  const tw_fit *fit = &c->fit;
  double back[4];
  conjugate(fit->turned, back);
  source_place(c, fit->bones[place->bone].source, time, out);
  tw_rotation_turn(back, out, out);
  for (int i = 0; i < 3; i++) out[i] = fit->scale * out[i] + place->offset[i];
}

/* A node's transform in the world; a column an axis. */
typedef struct world {
  double axes[3][3], origin[3];
} world;

static void descend(world *at, const double rotation[4], const double translation[3], const float scale[3]) {
  const world above = *at;
  for (int i = 0; i < 3; i++) {
    double axis[3] = {i == 0, i == 1, i == 2};
    tw_rotation_turn(rotation, axis, axis);
    for (int k = 0; k < 3; k++) {
      at->origin[k] += above.axes[i][k] * translation[i];
      at->axes[i][k] = (double)scale[i] *
                       (above.axes[0][k] * axis[0] + above.axes[1][k] * axis[1] + above.axes[2][k] * axis[2]);
    }
  }
}

/* From the world into a node's frame. What a scale of 0 has flattened becomes the origin. */
static void into(const world *at, double point[3]) {
  double way[3], determinant = tw_determinant3(at->axes[0], at->axes[1], at->axes[2]);
  for (int i = 0; i < 3; i++) way[i] = point[i] - at->origin[i];
  point[0] = tw_determinant3(way, at->axes[1], at->axes[2]);
  point[1] = tw_determinant3(at->axes[0], way, at->axes[2]);
  point[2] = tw_determinant3(at->axes[0], at->axes[1], way);
  for (int i = 0; i < 3; i++) point[i] = determinant != 0 ? point[i] / determinant : 0;
}

/* From the target's world into the frame of the bone's parent, as the nodes above are at this time. */
static void localize(const carrying *c, const place *place, float time, double point[3]) {
  world at = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (uint32_t i = 0; i < place->depth; i++) {
    uint32_t node = place->way[i];
    const tw_trs *rest = &c->job->target.nodes[node].rest;
    double rotation[4], translation[3];
    rest_turn(&c->job->target, node, rotation);
    for (int k = 0; k < 3; k++) translation[k] = (double)rest->translation[k];
    if (c->turns[node]) turn_at(c, c->turns[node], time, place->room, rotation);
    descend(&at, rotation, translation, rest->scale);
    if (place->carriers[i]) target_world(c, place->carriers[i], time, at.origin);
  }
  into(&at, point);
}

static void signal_place(const signal *signal, float time, double out[4]) {
  target_world(signal->carrying, signal->place, time, out);
  localize(signal->carrying, signal->place, time, out);
}

/* The tracks that a place depends on: those of the source's nodes from the root to its own, and those that
 * turn the target's nodes above. */
static bool find_tracks(const carrying *c, const place *place, uint32_t **tracks, uint32_t *count) {
  const tw_node *nodes = c->job->source.nodes;
  uint32_t source = c->fit.bones[place->bone].source;
  size_t most = 0;
  for (uint32_t node = source; node != TW_NO_INDEX; node = nodes[node].parent) most += 3;
  for (uint32_t i = 0; i < place->depth; i++)
    if (c->turns[place->way[i]]) most += c->turns[place->way[i]]->path.count;
  *tracks = tw_arena_alloc_raw(c->scratch, most, sizeof **tracks);
  *count = 0;
  if (!*tracks) return false;
  for (uint32_t node = source; node != TW_NO_INDEX; node = nodes[node].parent)
    for (int path = 0; path < TW_WEIGHTS; path++) {
      bool counts = node != source || path == TW_TRANSLATION;
      if (counts && c->track_of[path][node] != TW_NO_INDEX) (*tracks)[(*count)++] = c->track_of[path][node];
    }
  if (*count == 0) return true;
  for (uint32_t i = 0; i < place->depth; i++) {
    const turn *turn = c->turns[place->way[i]];
    for (uint32_t k = 0; turn && k < turn->path.count; k++) (*tracks)[(*count)++] = turn->path.steps[k].track;
  }
  return true;
}

/* The affine map from a translation of the source to one of the target. */
typedef struct affine {
  double columns[3][3], origin[3];
} affine;

static void map_translation(const void *context, const double *value, bool is_tangent, double *out) {
  const affine *map = context;
  for (int i = 0; i < 3; i++) {
    out[i] = is_tangent ? 0 : map->origin[i];
    for (int k = 0; k < 3; k++) out[i] += map->columns[k][i] * value[k];
  }
}

/* From a translation of the source's node, with nothing moving above, to the target's. */
static void place_of_translation(const carrying *c, const place *place, const double translation[3],
                                 double out[3]) {
  const tw_fit *fit = &c->fit;
  const tw_node *nodes = c->job->source.nodes;
  double back[4];
  memcpy(out, translation, 3 * sizeof *out);
  for (uint32_t node = nodes[fit->bones[place->bone].source].parent; node != TW_NO_INDEX;
       node = nodes[node].parent) {
    if (nodes[node].has_matrix)
      move_by_matrix(nodes[node].matrix, out);
    else
      move_place(&nodes[node].rest, out);
  }
  conjugate(fit->turned, back);
  tw_rotation_turn(back, out, out);
  for (int i = 0; i < 3; i++) out[i] = fit->scale * out[i] + place->offset[i];
  localize(c, place, 0, out);
}

static tw_status carry_translation(carrying *c, const place *place, uint32_t track, tw_error *error) {
  affine map;
  double zero[3] = {0};
  place_of_translation(c, place, zero, map.origin);
  for (int i = 0; i < 3; i++) {
    double unit[3] = {i == 0, i == 1, i == 2};
    place_of_translation(c, place, unit, map.columns[i]);
    for (int k = 0; k < 3; k++) map.columns[i][k] -= map.origin[k];
  }
  return map_keys(c, &c->tracks[track], c->fit.bones[place->bone].target, map_translation, &map, error);
}

/* Whether nothing above a bone of the target moves. */
static bool is_fixed_above(const carrying *c, const place *place) {
  for (uint32_t i = 0; i < place->depth; i++)
    if (place->carriers[i] || (c->turns[place->way[i]] && c->turns[place->way[i]]->path.count > 0))
      return false;
  return true;
}

static tw_status make_place(carrying *c, uint32_t bone, place **places, uint64_t *depths, place **out,
                            tw_error *error) {
  enum { DEPTHS_MOST = 1 << 12 };
  const tw_fit *fit = &c->fit;
  const tw_node *nodes = c->job->target.nodes;
  uint32_t target = fit->bones[bone].target, depth = c->depths[1][target] - 1, steps = 1;
  *depths += depth;
  if (*depths > DEPTHS_MOST)
    return tw_fail(error, TW_LIMIT, "too many nodes above the hips match to carry a clip over");
  place *made = *out = tw_arena_alloc(c->scratch, 1, sizeof *made);
  uint32_t *way = tw_arena_alloc_raw(c->scratch, depth, sizeof *way);
  const place **carriers = tw_arena_alloc(c->scratch, depth, sizeof(const place *));
  if (!made || !way || !carriers) return no_memory(error);
  for (uint32_t node = nodes[target].parent, i = depth; node != TW_NO_INDEX; node = nodes[node].parent) {
    way[--i] = node;
    if (fit->bone_of[node] != TW_NO_INDEX) carriers[i] = places[fit->bone_of[node]];
    if (c->turns[node] && c->turns[node]->path.count > steps) steps = c->turns[node]->path.count;
  }
  *made = (place){.bone = bone,
                  .depth = depth,
                  .way = way,
                  .carriers = carriers,
                  .room = tw_arena_alloc_raw(c->scratch, steps, sizeof *made->room)};
  if (!made->room) return no_memory(error);
  if (bone == fit->hips) {
    memcpy(made->offset, fit->hips_offset, sizeof made->offset);
    return TW_OK;
  }
  double back[4], rest[3];
  conjugate(fit->turned, back);
  tw_rotation_turn(back, fit->source.place[fit->bones[bone].source], rest);
  for (int i = 0; i < 3; i++) made->offset[i] = fit->target.place[target][i] - fit->scale * rest[i];
  return TW_OK;
}

/* Carries the translation of hips, and of matched nodes above them, over by their places in the world. */
static tw_status carry_places(carrying *c, tw_error *error) {
  const tw_fit *fit = &c->fit;
  place **places = tw_arena_alloc(c->scratch, fit->bone_count, sizeof(place *));
  tw_status status = places ? TW_OK : no_memory(error);
  uint64_t depths = 0;
  for (uint32_t i = 0; i < fit->bone_count && status == TW_OK; i++) {
    if (!fit->bones[i].is_carrier) continue;
    uint32_t *tracks, count;
    place *place = NULL;
    status = make_place(c, i, places, &depths, &place, error);
    if (status != TW_OK) break;
    if (!find_tracks(c, place, &tracks, &count)) return no_memory(error);
    if (count == 0) continue;
    places[i] = place;
    bool is_plain = count == 1 && c->tracks[tracks[0]].path == TW_TRANSLATION &&
                    c->tracks[tracks[0]].node == fit->bones[i].source && is_fixed_above(c, place);
    const signal signal = {.carrying = c,
                           .tracks = tracks,
                           .track_count = count,
                           .path = TW_TRANSLATION,
                           .at = signal_place,
                           .place = place};
    status = is_plain ? carry_translation(c, place, tracks[0], error)
                      : sample_signal(c, &signal, fit->bones[i].target, error);
  }
  return status;
}

/* ---- translations and scales of other bones ------------------------------------------------- */

/* Whether a bone's rest translation and rotation are those of the source's bone, scaled. */
static bool rests_alike(const carrying *c, const tw_fitted_bone *bone) {
  const tw_fit *fit = &c->fit;
  const tw_node *source = &c->job->source.nodes[bone->source], *target = &c->job->target.nodes[bone->target];
  if (bone->above == TW_NO_INDEX) return false;
  const tw_fitted_bone *above = &fit->bones[bone->above];
  if (above->target != target->parent || above->source != source->parent || above->last != above->source)
    return false;
  double from[3], to[3], way[3], a[4], b[4];
  for (int i = 0; i < 3; i++) {
    from[i] = fit->scale * (double)source->rest.translation[i];
    to[i] = (double)target->rest.translation[i];
    way[i] = to[i] - from[i];
  }
  quat_widen(source->rest.rotation, a);
  quat_widen(target->rest.rotation, b);
  double room = 10 * LIKE * (tw_length3(to) + tw_length3(from));
  return tw_length3(way) <= room && tw_angle_between(a, b) <= LIKE &&
         tw_angle_between(above->offset, IDENTITY) <= LIKE;
}

/* From the source's rest to the target's: a scaled difference, or a ratio. */
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
static bool stays(const carrying *c, const tw_track_keys *track, const float *rest) {
  double room = track->path == TW_SCALE ? LIKE : c->job->tolerance.distance * c->fit.size / c->fit.scale;
  if (track->interpolation == TW_CUBICSPLINE) return false;
  for (size_t i = 0; i < 3 * (size_t)track->key_count; i++)
    if (fabs((double)track->values[i] - (double)rest[i % 3]) > room) return false;
  return true;
}

static tw_status carry_alike(carrying *c, const tw_fitted_bone *bone, tw_path path, tw_error *error) {
  uint32_t track = c->track_of[path][bone->source];
  const tw_trs *from = &c->job->source.nodes[bone->source].rest,
               *to = &c->job->target.nodes[bone->target].rest;
  const float *source = path == TW_SCALE ? from->scale : from->translation;
  const float *target = path == TW_SCALE ? to->scale : to->translation;
  if (track == TW_NO_INDEX || (path == TW_TRANSLATION && bone->is_carrier)) return TW_OK;
  bool is_alike = bone->is_carrier ? tw_angle_between(bone->offset, IDENTITY) <= LIKE : rests_alike(c, bone);
  if (!is_alike) {
    c->lost_count += !stays(c, &c->tracks[track], source);
    return TW_OK;
  }
  likeness like = {.scale = c->fit.scale, .is_ratio = path == TW_SCALE};
  for (int i = 0; i < 3; i++) {
    like.from[i] = (double)source[i];
    like.to[i] = (double)target[i];
  }
  return map_keys(c, &c->tracks[track], bone->target, map_alike, &like, error);
}

static tw_status carry_others(carrying *c, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < c->fit.bone_count && status == TW_OK; i++) {
    status = carry_alike(c, &c->fit.bones[i], TW_TRANSLATION, error);
    if (status == TW_OK) status = carry_alike(c, &c->fit.bones[i], TW_SCALE, error);
  }
  return status;
}

/* ---- what is told --------------------------------------------------------------------------- */

static tw_status tell_bones(const carrying *c, tw_retargeted *out, tw_error *error) {
  const tw_fit *fit = &c->fit;
  out->bones = tw_arena_alloc_raw(c->arena, fit->bone_count, sizeof *out->bones);
  if (!out->bones) return no_memory(error);
  for (uint32_t node = 0; node < c->job->target.node_count; node++) {
    uint32_t bone = fit->bone_of[node];
    if (bone == TW_NO_INDEX) continue;
    out->bones[out->bone_count++] =
        (tw_matched_bone){.source = fit->bones[bone].source,
                          .target = node,
                          .by = (tw_match)c->match->by[node],
                          .aligned = tw_angle_between(fit->bones[bone].alignment, IDENTITY)};
  }
  return TW_OK;
}

static tw_status tell_unmatched(const carrying *c, tw_retargeted *out, tw_error *error) {
  const tw_skeleton *source = &c->job->source, *target = &c->job->target;
  bool *has_target = tw_arena_alloc(c->scratch, source->node_count, sizeof *has_target);
  out->without_target = tw_arena_alloc_raw(c->arena, source->node_count, sizeof(uint32_t));
  out->without_source = tw_arena_alloc_raw(c->arena, target->node_count, sizeof(uint32_t));
  if (!has_target || !out->without_target || !out->without_source) return no_memory(error);
  for (uint32_t i = 0; i < c->fit.bone_count; i++) has_target[c->fit.bones[i].source] = true;
  for (uint32_t i = 0; i < source->node_count; i++)
    if (is_moved(c, i) && !has_target[i] && !c->fit.is_taken_in[i])
      out->without_target[out->without_target_count++] = i;
  for (uint32_t i = 0; i < target->node_count; i++)
    if (c->match->is_target_bone[i] && !c->turns[i]) out->without_source[out->without_source_count++] = i;
  return TW_OK;
}

/* ---- the job -------------------------------------------------------------------------------- */

static tw_status carry(carrying *c, tw_retargeted *out, tw_error *error) {
  tw_bone_match match;
  tw_status status = tw_bones_match(c->job, c->scratch, &match, error);
  c->match = &match;
  if (status == TW_OK) status = tw_retarget_fit(c->job, &match, c->scratch, &c->fit, error);
  if (status == TW_OK) status = take_tracks(c, error);
  if (status == TW_OK) status = make_turns(c, error);
  if (status != TW_OK) return status;
  c->out = tw_arena_alloc_raw(c->arena, c->job->target.node_count, 3 * sizeof *c->out);
  if (!c->out) return no_memory(error);
  status = carry_rotations(c, error);
  if (status == TW_OK) status = carry_places(c, error);
  if (status == TW_OK) status = carry_others(c, error);
  if (status == TW_OK) status = tell_bones(c, out, error);
  if (status == TW_OK) status = tell_unmatched(c, out, error);
  out->keys = (tw_clip_keys){.track_count = c->out_count, .tracks = c->out};
  out->scale = c->fit.scale;
  out->lost_count = c->lost_count;
  if (status != TW_OK || !c->job->holds_feet) return status;
  return tw_feet_hold(c->job, &match, c->arena, &out->keys, &out->held_count, error);
}

tw_status tw_retarget_run(const tw_retarget_job *job, tw_arena *arena, tw_retargeted *out, tw_error *error) {
  carrying c = {.job = job, .arena = arena, .scratch = tw_arena_create()};
  tw_retargeted made = {0};
  tw_status status = c.scratch ? carry(&c, &made, error) : no_memory(error);
  tw_clip_destroy(c.clip);
  tw_arena_destroy(c.scratch);
  if (status == TW_OK) *out = made;
  return status;
}
