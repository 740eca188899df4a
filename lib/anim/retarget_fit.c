/* Lays a skeleton over another one in their rest poses. Rotations are in double precision, unit quaternions;
 * all constants of a clip that is carried over are made here. */
#include "retarget_fit.h"

#include <string.h>

#include "angle.h"
#include "quat.h"
#include "vector3.h"

static const double SOFT_ROOM = 30 / TW_DEGREES; /* that trunk, feet and heads keep of their own rest pose */
static const double AXIS_ROOM = 30 / TW_DEGREES; /* within which a figure faces along an axis of its world */

typedef struct fitting {
  const tw_retarget_job *job;
  const tw_bone_match *match;
  tw_arena *arena;
  tw_fit *fit;
  uint8_t *target_branches; /* [nodes] children below which matched bones are; 2: more than one */
  uint32_t *target_way;     /* [nodes] the last such child */
  uint8_t *source_branches;
  uint32_t *source_way;
  bool *is_source_matched; /* [nodes of the source] */
} fitting;

/* out = a^-1 b. */
static void multiply_inverse(const double a[4], const double b[4], double out[4]) {
  double inverse[4];
  quat_conjugate(a, inverse);
  quat_multiply(inverse, b, out);
}

/* The shortest turn from one direction to another. Exactly the identity for equal ones. */
static void swing_between(const double from[3], const double to[3], double out[4]) {
  double a[3] = {from[0], from[1], from[2]}, b[3] = {to[0], to[1], to[2]}, axis[3];
  tw_unit3(a);
  tw_unit3(b);
  tw_cross3(a, b, axis);
  double sine = tw_length3(axis), cosine = tw_dot3(a, b);
  if (sine < 1e-9) { /* along, or against: about any axis across */
    double across[3] = {fabs(a[0]) < 0.5 ? 1 : 0, fabs(a[0]) < 0.5 ? 0 : 1, 0};
    tw_cross3(a, across, axis);
    tw_unit3(axis);
    memcpy(out, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
    if (cosine < 0) tw_quat_axis_angle(axis, TW_PI, out);
    return;
  }
  tw_unit3(axis);
  tw_quat_axis_angle(axis, atan2(sine, cosine), out);
}

/* ---- rest poses ------------------------------------------------------------------------------ */

static tw_status find_rest(const tw_skeleton *skeleton, tw_arena *arena, tw_rest *out, tw_error *error) {
  uint32_t count = skeleton->node_count;
  out->rotation = tw_arena_alloc_raw(arena, count, sizeof *out->rotation);
  out->place = tw_arena_alloc_raw(arena, count, sizeof *out->place);
  out->unit = tw_arena_alloc_raw(arena, count, sizeof *out->unit);
  tw_trs *locals = tw_arena_alloc_raw(arena, count, sizeof *locals);
  float *world = tw_arena_alloc_raw(arena, count, 16 * sizeof *world);
  if (!out->rotation || !out->place || !out->unit || !locals || !world)
    return tw_fail(error, TW_NO_MEMORY, "no memory for a rest pose");
  for (uint32_t i = 0; i < count; i++) locals[i] = skeleton->nodes[i].rest;
  tw_pose_locals(NULL, skeleton->nodes, count, locals, world);
  tw_pose_world(skeleton->nodes, skeleton->order, count, world, world);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t node = skeleton->order[i], parent = skeleton->nodes[node].parent;
    double own[4];
    quat_widen(skeleton->nodes[node].rest.rotation, own);
    tw_normalize(own, 4);
    if (parent != TW_NO_INDEX)
      quat_multiply(out->rotation[parent], own, out->rotation[node]);
    else
      memcpy(out->rotation[node], own, sizeof own);
    for (int k = 0; k < 3; k++) out->place[node][k] = (double)world[16 * (size_t)node + 12 + (size_t)k];
    const float *scale = skeleton->nodes[node].rest.scale;
    out->unit[node] = cbrt(fabs((double)scale[0] * (double)scale[1] * (double)scale[2]));
    if (parent != TW_NO_INDEX) out->unit[node] *= out->unit[parent];
  }
  return TW_OK;
}

/* ---- bones and those between ----------------------------------------------------------------- */

/* Counts for each node the children below which, or which themselves, are matched. */
static tw_status find_ways(const tw_skeleton *skeleton, const bool *is_matched, tw_arena *arena,
                           uint8_t **branches, uint32_t **way, tw_error *error) {
  uint32_t count = skeleton->node_count;
  *branches = tw_arena_alloc(arena, count, sizeof **branches);
  *way = tw_arena_alloc_raw(arena, count, sizeof **way);
  if (!*branches || !*way) return tw_fail(error, TW_NO_MEMORY, "no memory to lay skeletons over each other");
  for (uint32_t i = count; i-- > 0;) {
    uint32_t node = skeleton->order[i], parent = skeleton->nodes[node].parent;
    if (parent == TW_NO_INDEX || (!is_matched[node] && (*branches)[node] == 0)) continue;
    if ((*branches)[parent] < 2) (*branches)[parent]++;
    (*way)[parent] = node;
  }
  return TW_OK;
}

static bool is_spine(uint32_t role) {
  return role >= TW_BONE_SPINE && role <= TW_BONE_NECK;
}

static void list_bones(fitting *f) {
  const tw_skeleton *target = &f->job->target;
  tw_fit *fit = f->fit;
  for (uint32_t i = 0; i < target->node_count; i++) {
    uint32_t node = target->order[i], parent = target->nodes[node].parent, source = f->match->source_of[node];
    uint32_t above = parent == TW_NO_INDEX ? TW_NO_INDEX : fit->bone_of[parent];
    fit->bone_of[node] = above; /* of nodes in between it is the bone above until the end of this function */
    if (source == TW_NO_INDEX) continue;
    fit->bones[fit->bone_count] =
        (tw_fitted_bone){.source = source, .target = node, .above = above, .last = source};
    if (f->match->role[node] == TW_BONE_HIPS) fit->hips = fit->bone_count;
    fit->bone_of[node] = fit->bone_count++;
  }
  for (uint32_t i = 0; i < target->node_count; i++)
    if (f->match->source_of[i] == TW_NO_INDEX) fit->bone_of[i] = TW_NO_INDEX;
}

static void find_carriers(tw_fit *fit) {
  for (uint32_t i = 0; fit->hips == TW_NO_INDEX && i < fit->bone_count; i++)
    fit->bones[i].is_carrier = fit->bones[i].above == TW_NO_INDEX;
  for (uint32_t i = fit->hips; i != TW_NO_INDEX; i = fit->bones[i].above) fit->bones[i].is_carrier = true;
}

/* Takes in the source's bones from a matched one to where the next one, or several, begin. */
static void take_in(fitting *f, tw_fitted_bone *bone) {
  for (uint32_t node = bone->source; f->source_branches[node] == 1;) {
    node = f->source_way[node];
    if (f->is_source_matched[node]) return;
    f->fit->is_taken_in[node] = true;
    bone->last = node;
  }
}

static void list_between(fitting *f, tw_fitted_bone *bone, uint32_t *used) {
  bone->first_between = *used;
  bone->share = is_spine(f->match->role[bone->target]) ? TW_SHARE_ALL : TW_SHARE_TWIST;
  for (uint32_t node = bone->target; f->target_branches[node] == 1;) {
    node = f->target_way[node];
    if (f->match->source_of[node] != TW_NO_INDEX) break;
    f->fit->between[(*used)++] = node;
  }
  bone->between_count = *used - bone->first_between;
}

static tw_status find_bones(fitting *f, tw_error *error) {
  const tw_skeleton *source = &f->job->source, *target = &f->job->target;
  tw_fit *fit = f->fit;
  bool *is_matched = tw_arena_alloc(f->arena, target->node_count, sizeof *is_matched);
  f->is_source_matched = tw_arena_alloc(f->arena, source->node_count, sizeof *f->is_source_matched);
  fit->bones = tw_arena_alloc(f->arena, target->node_count, sizeof *fit->bones);
  fit->bone_of = tw_arena_alloc_raw(f->arena, target->node_count, sizeof *fit->bone_of);
  fit->between = tw_arena_alloc_raw(f->arena, target->node_count, sizeof *fit->between);
  fit->is_taken_in = tw_arena_alloc(f->arena, source->node_count, sizeof *fit->is_taken_in);
  if (!is_matched || !f->is_source_matched || !fit->bones || !fit->bone_of || !fit->between ||
      !fit->is_taken_in)
    return tw_fail(error, TW_NO_MEMORY, "no memory to lay skeletons over each other");
  for (uint32_t i = 0; i < target->node_count; i++) {
    is_matched[i] = f->match->source_of[i] != TW_NO_INDEX;
    if (is_matched[i]) f->is_source_matched[f->match->source_of[i]] = true;
  }
  tw_status status = find_ways(target, is_matched, f->arena, &f->target_branches, &f->target_way, error);
  if (status == TW_OK)
    status = find_ways(source, f->is_source_matched, f->arena, &f->source_branches, &f->source_way, error);
  if (status != TW_OK) return status;
  fit->hips = TW_NO_INDEX;
  list_bones(f);
  find_carriers(fit);
  uint32_t used = 0;
  for (uint32_t i = 0; i < fit->bone_count; i++) {
    if (fit->bones[i].is_carrier) continue;
    take_in(f, &fit->bones[i]);
    list_between(f, &fit->bones[i], &used);
  }
  return TW_OK;
}

/* ---- the figure as a whole ------------------------------------------------------------------- */

/* The nodes of a bone of VRM's on both sides; false where it is not matched. */
static bool find_role(const fitting *f, uint32_t role, uint32_t *source, uint32_t *target) {
  for (uint32_t i = 0; i < f->fit->bone_count; i++) {
    if (f->match->role[f->fit->bones[i].target] != role) continue;
    *source = f->fit->bones[i].source;
    *target = f->fit->bones[i].target;
    return true;
  }
  return false;
}

/* Places of a matched bone in both skeletons; false where it is not matched. */
static bool place_role(const fitting *f, uint32_t role, const double **source, const double **target) {
  uint32_t from, to;
  if (!find_role(f, role, &from, &to)) return false;
  *source = f->fit->source.place[from];
  *target = f->fit->target.place[to];
  return true;
}

bool tw_find_axes(const double *left, const double *right, const double *low, const double *high,
                  double axes[3][3]) {
  for (int i = 0; i < 3; i++) {
    axes[0][i] = left[i] - right[i];
    axes[1][i] = high[i] - low[i];
  }
  double along;
  if (tw_unit3(axes[0]) == 0) return false;
  along = tw_dot3(axes[0], axes[1]);
  for (int i = 0; i < 3; i++) axes[1][i] -= along * axes[0][i];
  if (tw_unit3(axes[1]) == 0) return false;
  tw_cross3(axes[0], axes[1], axes[2]);
  return true;
}

/* The turn from the target's axes to the source's. Where it nearly takes axes of the world to axes of the
 * world, the turn that does so exactly is used: how far a figure leans is part of its rest pose. */
static void turn_between(double source[3][3], double target[3][3], double out[4]) {
  double columns[3][3] = {{0}}, whole[3][3] = {{0}}, rounded[4];
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) {
      for (int k = 0; k < 3; k++) columns[column][row] += source[k][row] * target[k][column];
      whole[column][row] = round(columns[column][row]);
    }
  tw_quat_best(columns, out);
  tw_quat_best(whole, rounded);
  if (fabs(tw_determinant3(whole[0], whole[1], whole[2]) - 1) < 0.5 &&
      tw_angle_between(out, rounded) < AXIS_ROOM)
    memcpy(out, rounded, sizeof rounded);
  tw_normalize(out, 4);
}

/* Finds how the figures face, and which way is up in the source. */
static void find_turn(fitting *f, double up[3]) {
  static const uint32_t sides[] = {TW_BONE_UPPER_LEG, TW_BONE_UPPER_ARM, TW_BONE_SHOULDER};
  static const uint32_t tops[] = {TW_BONE_HEAD, TW_BONE_NECK, TW_BONE_UPPER_CHEST, TW_BONE_CHEST,
                                  TW_BONE_SPINE};
  const double *left[2], *right[2], *low[2], *high[2];
  double source[3][3], target[3][3];
  memcpy(f->fit->turned, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  memcpy(up, (double[]){0, 1, 0}, 3 * sizeof *up);
  bool has_sides = false, has_top = false;
  for (size_t i = 0; !has_sides && i < sizeof sides / sizeof *sides; i++)
    has_sides =
        place_role(f, sides[i], &left[0], &left[1]) && place_role(f, sides[i] + 1, &right[0], &right[1]);
  for (size_t i = 0; !has_top && i < sizeof tops / sizeof *tops; i++)
    has_top = place_role(f, tops[i], &high[0], &high[1]);
  if (!has_sides || !has_top || !place_role(f, TW_BONE_HIPS, &low[0], &low[1])) return;
  if (!tw_find_axes(left[0], right[0], low[0], high[0], source) ||
      !tw_find_axes(left[1], right[1], low[1], high[1], target))
    return;
  turn_between(source, target, f->fit->turned);
  memcpy(up, source[1], 3 * sizeof *up);
  for (int i = 0; i < 3; i++)
    if (fabs(up[i]) > cos(AXIS_ROOM))
      for (int k = 0; k < 3; k++) up[k] = k == i ? copysign(1, up[i]) : 0;
}

static double distance(const double *a, const double *b) {
  const double way[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return tw_length3(way);
}

/* The lengths of both figures' legs, 0 where they have none. */
static void find_legs(const fitting *f, double lengths[2]) {
  lengths[0] = lengths[1] = 0;
  for (uint32_t side = 0; side < 2; side++) {
    const double *upper[2], *lower[2], *foot[2];
    if (!place_role(f, TW_BONE_UPPER_LEG + side, &upper[0], &upper[1]) ||
        !place_role(f, TW_BONE_LOWER_LEG + side, &lower[0], &lower[1]) ||
        !place_role(f, TW_BONE_FOOT + side, &foot[0], &foot[1]))
      continue;
    for (int k = 0; k < 2; k++) lengths[k] += distance(upper[k], lower[k]) + distance(lower[k], foot[k]);
  }
}

/* The sums of distances from each matched bone to the one above. */
static void sum_lengths(const tw_fit *fit, double lengths[2]) {
  lengths[0] = lengths[1] = 0;
  for (uint32_t i = 0; i < fit->bone_count; i++) {
    const tw_fitted_bone *bone = &fit->bones[i];
    if (bone->above == TW_NO_INDEX) continue;
    const tw_fitted_bone *above = &fit->bones[bone->above];
    lengths[0] += distance(fit->source.place[bone->source], fit->source.place[above->source]);
    lengths[1] += distance(fit->target.place[bone->target], fit->target.place[above->target]);
  }
}

/* The height of the hips above the lowest joint of the legs, along `up`. side: 0 source, 1 target. */
static double hips_height(const fitting *f, int side, const double up[3]) {
  const double *hips[2], *joint[2];
  double height = 0;
  if (!place_role(f, TW_BONE_HIPS, &hips[0], &hips[1])) return 0;
  for (uint32_t role = TW_BONE_UPPER_LEG; role < TW_BONE_SHOULDER; role++)
    if (place_role(f, role, &joint[0], &joint[1]))
      height = fmax(height, tw_dot3(hips[side], up) - tw_dot3(joint[side], up));
  return height;
}

/* Where the hips rest. A skeleton whose hips rest at the origin, as those of motion capture do, says nothing
 * of their height: they then rest as high as the legs are long. */
static void find_hips_rest(const fitting *f, int side, const double up[3], double out[3]) {
  const double *hips[2];
  double height = hips_height(f, side, up);
  if (!place_role(f, TW_BONE_HIPS, &hips[0], &hips[1])) return;
  memcpy(out, hips[side], 3 * sizeof *out);
  if (tw_length3(out) > height / 10) return;
  for (int i = 0; i < 3; i++) out[i] = up[i] * height;
}

/* Between humanoid maps distances go by the height of the hips above the ground, and places are absolute
 * (VRMC_vrm_animation 1.0, "humanoid"). */
static bool scale_as_vrm(fitting *f) {
  const double *hips[2];
  if (!f->match->has_map || !place_role(f, TW_BONE_HIPS, &hips[0], &hips[1])) return false;
  if (!(hips[0][1] > 0 && hips[1][1] > 0)) return false;
  f->fit->scale = hips[1][1] / hips[0][1];
  return true;
}

static void find_scale(fitting *f, const double up[3]) {
  tw_fit *fit = f->fit;
  double lengths[2];
  if (scale_as_vrm(f)) return;
  find_legs(f, lengths);
  if (!(lengths[0] > 0 && lengths[1] > 0)) sum_lengths(fit, lengths);
  fit->scale = lengths[0] > 0 && lengths[1] > 0 ? lengths[1] / lengths[0] : 1;
  if (fit->hips == TW_NO_INDEX) return;
  double source[3] = {0}, target[3] = {0}, back[4], target_up[3];
  quat_conjugate(fit->turned, back);
  tw_rotation_turn(back, up, target_up);
  find_hips_rest(f, 0, up, source);
  find_hips_rest(f, 1, target_up, target);
  tw_rotation_turn(back, source, source);
  for (int i = 0; i < 3; i++) fit->hips_offset[i] = target[i] - fit->scale * source[i];
}

static void find_size(tw_fit *fit) {
  for (uint32_t i = 1; i < fit->bone_count; i++)
    fit->size = fmax(fit->size, distance(fit->target.place[fit->bones[0].target],
                                         fit->target.place[fit->bones[i].target]));
}

/* ---- alignments ------------------------------------------------------------------------------ */

/* Whether a bone is turned to point where the source's does. Others keep the direction of their rest pose. */
static bool is_limb(uint32_t role) {
  return (role >= TW_BONE_UPPER_LEG && role < TW_BONE_FOOT) || (role >= TW_BONE_UPPER_ARM && role < TW_BONES);
}

/* The mean places of the next matched bones below each bone. */
typedef struct next_joints {
  double source[3], target[3];
  uint32_t count;
} next_joints;

static next_joints *find_next(const fitting *f) {
  const tw_fit *fit = f->fit;
  next_joints *next = tw_arena_alloc(f->arena, fit->bone_count, sizeof *next);
  for (uint32_t i = 0; next && i < fit->bone_count; i++) {
    const tw_fitted_bone *bone = &fit->bones[i];
    if (bone->above == TW_NO_INDEX) continue;
    next_joints *above = &next[bone->above];
    for (int k = 0; k < 3; k++) {
      above->source[k] += fit->source.place[bone->source][k];
      above->target[k] += fit->target.place[bone->target][k];
    }
    above->count++;
  }
  return next;
}

/* Unit vectors from a joint to the mean of the next ones. False where these are at the joint's place. */
static bool find_directions(const tw_fit *fit, const tw_fitted_bone *bone, const next_joints *next,
                            double source[3], double target[3]) {
  if (next->count == 0) return false;
  for (int k = 0; k < 3; k++) {
    source[k] = next->source[k] / next->count - fit->source.place[bone->source][k];
    target[k] = next->target[k] / next->count - fit->target.place[bone->target][k];
  }
  return tw_unit3(source) > 0 && tw_unit3(target) > 0;
}

static void align(const fitting *f, tw_fitted_bone *bone, const next_joints *next) {
  const tw_fit *fit = f->fit;
  uint32_t role = f->match->role[bone->target];
  bool is_known = role != TW_BONES, goes_with_limb = !is_known || is_limb(role);
  double source[3], target[3], swing[4], back[4];
  memcpy(bone->alignment, TW_QUAT_IDENTITY, sizeof TW_QUAT_IDENTITY);
  if (f->match->has_map && is_known) return;
  if (bone->is_carrier && fit->hips != TW_NO_INDEX) return;
  if (goes_with_limb && bone->above != TW_NO_INDEX)
    memcpy(bone->alignment, fit->bones[bone->above].alignment, sizeof bone->alignment);
  if (!find_directions(fit, bone, next, source, target)) return;
  if (!is_known && next->count > 1) return;
  quat_conjugate(fit->turned, back);
  tw_rotation_turn(back, source, source);
  tw_rotation_turn(bone->alignment, target, target);
  if (!goes_with_limb && tw_angle3(target, source) <= SOFT_ROOM) return;
  swing_between(target, source, swing);
  quat_multiply(swing, bone->alignment, bone->alignment);
  tw_normalize(bone->alignment, 4);
}

/* The direction of a bone in its own frame, for twists. */
static void find_twist(const tw_fit *fit, tw_fitted_bone *bone, const next_joints *next) {
  double source[3], back[4];
  if (bone->between_count == 0 || bone->share != TW_SHARE_TWIST) return;
  if (!find_directions(fit, bone, next, source, bone->direction)) {
    bone->between_count = 0;
    return;
  }
  quat_conjugate(fit->target.rotation[bone->target], back);
  tw_rotation_turn(back, bone->direction, bone->direction);
}

static tw_status align_bones(fitting *f, tw_error *error) {
  tw_fit *fit = f->fit;
  const next_joints *next = find_next(f);
  if (!next) return tw_fail(error, TW_NO_MEMORY, "no memory to align bones");
  for (uint32_t i = 0; i < fit->bone_count; i++) {
    tw_fitted_bone *bone = &fit->bones[i];
    double turned[4], aligned[4];
    align(f, bone, &next[i]);
    find_twist(fit, bone, &next[i]);
    quat_multiply(bone->alignment, fit->target.rotation[bone->target], aligned);
    quat_multiply(fit->turned, aligned, turned);
    multiply_inverse(fit->source.rotation[bone->last], turned, bone->offset);
    tw_normalize(bone->offset, 4);
  }
  return TW_OK;
}

tw_status tw_retarget_fit(const tw_retarget_job *job, const tw_bone_match *match, tw_arena *arena,
                          tw_fit *out, tw_error *error) {
  *out = (tw_fit){0};
  fitting f = {.job = job, .match = match, .arena = arena, .fit = out};
  double up[3];
  tw_status status = find_rest(&job->source, arena, &out->source, error);
  if (status == TW_OK) status = find_rest(&job->target, arena, &out->target, error);
  if (status == TW_OK) status = find_bones(&f, error);
  if (status != TW_OK) return status;
  find_turn(&f, up);
  bool is_axis = fabs(up[0]) + fabs(up[1]) + fabs(up[2]) == 1;
  for (int i = 0; i < 3; i++) out->up[i] = is_axis ? up[i] : i == 1;
  find_scale(&f, up);
  find_size(out);
  return align_bones(&f, error);
}
