/* A substitute for rest poses of motion capture in which all bones lie along one axis, with the legs folded
 * up beside the trunk, so that only clips say how the figure stands. The pose of the clip in which the figure
 * stands straightest, turned upright and forwards in its own world, takes the place of the rest pose. Where
 * the target rests folded too, rest poses stay: a clip on its own skeleton must not change. */
#include <math.h>
#include <string.h>

#include "angle.h"
#include "retarget_carrying.h"
#include "vector3.h"

enum { TIMES = 64 }; /* that are looked at */

/* The nodes that tell how a figure stands. */
typedef struct figure {
  uint32_t hips, top, thighs[2], feet[2];
} figure;

static bool find_figure(const uint32_t bones[TW_BONES], figure *out) {
  static const tw_bone tops[] = {TW_BONE_HEAD, TW_BONE_NECK, TW_BONE_UPPER_CHEST, TW_BONE_CHEST,
                                 TW_BONE_SPINE};
  *out = (figure){.hips = bones[TW_BONE_HIPS], .top = TW_NO_INDEX};
  for (size_t i = 0; out->top == TW_NO_INDEX && i < sizeof tops / sizeof *tops; i++)
    out->top = bones[tops[i]];
  bool is_whole = out->hips != TW_NO_INDEX && out->top != TW_NO_INDEX;
  for (int side = 0; side < 2; side++) {
    out->thighs[side] = bones[TW_BONE_UPPER_LEG + side];
    out->feet[side] = bones[TW_BONE_FOOT + side];
    is_whole = is_whole && out->thighs[side] != TW_NO_INDEX && out->feet[side] != TW_NO_INDEX;
  }
  return is_whole;
}

static void place_of(const float *world, uint32_t node, double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = (double)world[16 * (size_t)node + 12 + (size_t)k];
}

/* The mean cosine between the trunk and the legs: -1 where the figure stands straight. */
static double fold_of(const figure *f, const float *world) {
  double hips[3], top[3], trunk[3], sum = 0;
  place_of(world, f->hips, hips);
  place_of(world, f->top, top);
  tw_difference3(top, hips, trunk);
  for (int side = 0; side < 2; side++) {
    double thigh[3], foot[3], leg[3];
    place_of(world, f->thighs[side], thigh);
    place_of(world, f->feet[side], foot);
    tw_difference3(foot, thigh, leg);
    double size = tw_length3(trunk) * tw_length3(leg);
    sum += size > 0 ? tw_dot3(trunk, leg) / size / 2 : 0;
  }
  return sum;
}

/* A pose of the source. */
typedef struct stance {
  tw_trs *locals; /* [nodes] */
  float *world;   /* [nodes][16] */
} stance;

static void take_pose(const tw_skeleton *s, const tw_clip *clip, float time, const stance *out) {
  if (clip)
    tw_clip_pose(clip, s->nodes, s->node_count, time, out->locals);
  else
    for (uint32_t i = 0; i < s->node_count; i++) out->locals[i] = s->nodes[i].rest;
  tw_pose_locals(clip, s->nodes, s->node_count, out->locals, out->world);
  tw_pose_world(s->nodes, s->order, s->node_count, out->world, out->world);
}

/* Leaves the pose at the time when the figure stands straightest. False: it never stands. */
static tw_status find_stance(const tw_skeleton *s, const tw_clip *clip, const figure *f, const stance *out,
                             float *time, bool *stands, tw_error *error) {
  static const double STANDING = -0.8;
  double best = 2, duration = (double)tw_clip_duration(clip);
  if (!tw_work((uint64_t)TIMES * s->node_count)) return tw_work_status(error);
  for (int i = 0; i < TIMES; i++) {
    float at = (float)(duration * i / (TIMES - 1));
    take_pose(s, clip, at, out);
    double fold = fold_of(f, out->world);
    if (fold < best) best = fold, *time = at;
  }
  *stands = best <= STANDING;
  take_pose(s, clip, *time, out);
  return TW_OK;
}

/* The turn that sets the figure upright, facing forwards, in a world whose up is the axis nearest to its own.
 */
static bool find_upright(const figure *f, const float *world, double out[4]) {
  double left[3], right[3], low[3], high[3], axes[3][3], now[4], up[4] = {0, 0, 0, 1};
  place_of(world, f->thighs[0], left);
  place_of(world, f->thighs[1], right);
  place_of(world, f->hips, low);
  place_of(world, f->top, high);
  if (!tw_find_axes(left, right, low, high, axes)) return false;
  tw_quat_best(axes, now);
  int axis = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(axes[1][i]) > fabs(axes[1][axis])) axis = i;
  const double nearest[3] = {axis == 0 ? copysign(1, axes[1][0]) : 0, axis == 1 ? copysign(1, axes[1][1]) : 0,
                             axis == 2 ? copysign(1, axes[1][2]) : 0},
               y[3] = {0, 1, 0}, x[3] = {1, 0, 0};
  double about[3];
  tw_cross3(y, nearest, about);
  if (axis != 1)
    tw_quat_axis_angle(about, TW_PI / 2, up);
  else if (nearest[1] < 0)
    tw_quat_axis_angle(x, TW_PI, up);
  quat_conjugate(now, now);
  quat_multiply(up, now, out);
  return true;
}

/* Turns the hips in the world: their own rotation becomes P^-1 turn P l, where P is that of the nodes above.
 */
static void turn_hips(const tw_skeleton *s, uint32_t hips, const double turn[4], tw_trs *locals) {
  double above[4] = {0, 0, 0, 1}, own[4], back[4];
  for (uint32_t node = s->nodes[hips].parent; node != TW_NO_INDEX; node = s->nodes[node].parent) {
    quat_widen(locals[node].rotation, own);
    tw_normalize(own, 4);
    quat_multiply(own, above, above);
  }
  quat_conjugate(above, back);
  quat_widen(locals[hips].rotation, own);
  quat_multiply(above, own, own);
  quat_multiply(turn, own, own);
  quat_multiply(back, own, own);
  tw_normalize(own, 4);
  quat_narrow(own, locals[hips].rotation);
}

/* Makes rotations of the pose those at rest. False without memory. */
static bool rest_so(tw_skeleton *s, const tw_clip *clip, const tw_trs *locals, uint32_t hips,
                    tw_arena *arena) {
  tw_node *nodes = tw_arena_alloc_raw(arena, s->node_count, sizeof *nodes);
  if (!nodes) return false;
  memcpy(nodes, s->nodes, s->node_count * sizeof *nodes);
  for (uint32_t i = 0; i < s->node_count; i++) {
    memcpy(nodes[i].rest.rotation, locals[i].rotation, sizeof locals[i].rotation);
    if (i == hips || tw_clip_moves(clip, i)) nodes[i].has_matrix = false;
  }
  s->nodes = nodes;
  return true;
}

/* Whether the skeleton rests with its legs folded up. */
static tw_status find_folded(const tw_skeleton *s, const figure *f, tw_arena *arena, bool *out,
                             tw_error *error) {
  static const double FOLDED = 0.5;
  const stance rest = {.locals = tw_arena_alloc_raw(arena, s->node_count, sizeof *rest.locals),
                       .world = tw_arena_alloc_raw(arena, s->node_count, 16 * sizeof *rest.world)};
  if (!rest.locals || !rest.world) return tw_carrying_no_memory(error);
  take_pose(s, NULL, 0, &rest);
  *out = fold_of(f, rest.world) >= FOLDED;
  return TW_OK;
}

tw_status tw_stance_take(const tw_bone_match *match, uint32_t bones[2][TW_BONES], tw_arena *arena,
                         tw_retarget_job *job, float *time, tw_error *error) {
  tw_skeleton *s = &job->source;
  figure f, other;
  bool is_folded = false, is_other = false;
  *time = -1;
  if (match->has_map || !find_figure(bones[0], &f) || !find_figure(bones[1], &other)) return TW_OK;
  tw_status status = find_folded(s, &f, arena, &is_folded, error);
  if (status == TW_OK && is_folded) status = find_folded(&job->target, &other, arena, &is_other, error);
  if (status != TW_OK || !is_folded || is_other) return status;
  const stance pose = {.locals = tw_arena_alloc_raw(arena, s->node_count, sizeof *pose.locals),
                       .world = tw_arena_alloc_raw(arena, s->node_count, 16 * sizeof *pose.world)};
  if (!pose.locals || !pose.world) return tw_carrying_no_memory(error);
  tw_clip *clip;
  float at = 0;
  bool stands = false;
  double turn[4];
  status = tw_clip_create(job->keys, s->node_count, -1, &clip, error);
  if (status != TW_OK) return status;
  status = find_stance(s, clip, &f, &pose, &at, &stands, error);
  if (status == TW_OK && stands && find_upright(&f, pose.world, turn)) {
    turn_hips(s, f.hips, turn, pose.locals);
    *time = at;
    if (!rest_so(s, clip, pose.locals, f.hips, arena)) status = tw_carrying_no_memory(error);
  }
  tw_clip_destroy(clip);
  return status;
}
