/* Clips whose root motion is taken out. Computed in double precision at each time, so that putting the motion
 * back gives what was there but for the rounding of the results. */
#include "tweend/root_motion.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "vector3.h"
#include "way.h"

/* ---- the clip -------------------------------------------------------------------------------- */

typedef enum root_part { PART_SAME, PART_NODE, PART_CARRIER } root_part;

typedef struct rooting {
  uint32_t node, carrier; /* carrier: as in the job */
  unsigned axes;
  tw_way way;
  tw_way_node top;         /* the carrier, where it is a node of the clip */
  tw_affine start_inverse; /* the inverse of W(0)'s linear part */
  double start[3];         /* w(0) */
  bool is_negative[3];     /* the node's scales at time 0 */
  root_part *parts;        /* [tracks] */
} rooting;

static const rooting *rooting_of(const tw_clip *clip) {
  return clip->making;
}

/* R(t): cosine and sine of half the turn about y, and the shift. */
typedef struct root_state {
  double half[2], shift[3];
} root_state;

static void turn_about_y(const double half[2], double sign, const double v[3], double out[3]) {
  double cosine = half[0] * half[0] - half[1] * half[1], sine = sign * 2 * half[0] * half[1];
  double x = cosine * v[0] + sine * v[2], z = cosine * v[2] - sine * v[0];
  out[0] = x, out[1] = v[1], out[2] = z;
}

/* The components of the rotation of a linear part that turns and scales evenly which tell its turn about y: w
 * and y, in proportion (Shepperd 1978: the largest of four is not divided by). */
static void find_twist(double axes[3][3], double half[2]) {
  double trace = axes[0][0] + axes[1][1] + axes[2][2],
         size = cbrt(fabs(tw_determinant3(axes[0], axes[1], axes[2])));
  double largest = fmax(fmax(axes[0][0], axes[1][1]), axes[2][2]);
  if (trace >= largest) {
    half[0] = size + trace;
    half[1] = axes[2][0] - axes[0][2];
  } else if (axes[1][1] == largest) {
    half[0] = axes[2][0] - axes[0][2];
    half[1] = size + 2 * axes[1][1] - trace;
  } else if (axes[0][0] == largest) {
    half[0] = axes[1][2] - axes[2][1];
    half[1] = axes[1][0] + axes[0][1];
  } else {
    half[0] = axes[0][1] - axes[1][0];
    half[1] = axes[2][1] + axes[1][2];
  }
}

/* Whether a linear part turns and scales evenly. */
static bool is_even(const tw_affine *m) {
  static const double ROOM = 1e-4;
  double size = tw_length3(m->axes[0]);
  for (int i = 0; i < 3; i++) {
    const double *a = m->axes[i], *b = m->axes[(i + 1) % 3];
    if (fabs(tw_length3(a) - size) > ROOM * size || fabs(tw_dot3(a, b)) > ROOM * size * size) return false;
  }
  return size > 0;
}

/* The same components where the linear part scales unevenly, as a clip stretches a node: those of the
 * rotation that fits its axes best, which its polar decomposition has. */
static void find_twist_of_uneven(double axes[3][3], double half[2]) {
  double unit[3][3], q[4], most = 0;
  half[0] = half[1] = 0;
  for (int i = 0; i < 9; i++) most = fmax(most, fabs(axes[i / 3][i % 3]));
  if (!(most > 0)) return;
  for (int i = 0; i < 9; i++) unit[i / 3][i % 3] = axes[i / 3][i % 3] / most;
  tw_quat_best(unit, q);
  half[0] = fabs(q[3]) * most;
  half[1] = (q[3] < 0 ? -q[1] : q[1]) * most;
}

/* D(t). What the node's scales mirror since time 0 is left out: a rotation cannot tell it. */
static tw_affine turn_since_start(const rooting *r, const tw_affine *world, const tw_trs *local) {
  tw_affine turn = tw_affine_product(world, &r->start_inverse), own = *world;
  if (tw_determinant3(turn.axes[0], turn.axes[1], turn.axes[2]) >= 0) return turn;
  for (int i = 0; i < 3; i++)
    if ((local->scale[i] < 0) != r->is_negative[i])
      for (int k = 0; k < 3; k++) own.axes[i][k] = -own.axes[i][k];
  return tw_affine_product(&own, &r->start_inverse);
}

static root_state state_of(const rooting *r, const tw_affine *world, const tw_trs *local) {
  root_state state = {{1, 0}, {0, 0, 0}};
  if (r->axes & TW_ROOT_YAW) {
    double half[2];
    tw_affine turn = turn_since_start(r, world, local);
    (is_even(&turn) ? find_twist : find_twist_of_uneven)(turn.axes, half);
    double length = hypot(half[0], half[1]), size = tw_length3(turn.axes[0]);
    bool turns =
        length > 1e-9 * size && fabs(half[1]) > 1e-12 * length; /* less is noise: R(0) is the identity */
    if (turns) state.half[0] = half[0] / length, state.half[1] = half[1] / length;
  }
  double start[3];
  turn_about_y(state.half, 1, r->start, start);
  for (int axis = 0; axis < 3; axis++)
    if (r->axes & 1u << axis) state.shift[axis] = world->at[axis] - start[axis];
  return state;
}

/* What a time has. */
typedef struct root_moment {
  root_state root;
  tw_affine parent;
  tw_trs local; /* of the node, before anything is taken */
} root_moment;

static root_moment moment_at(const tw_clip *clip, float time) {
  const rooting *r = rooting_of(clip);
  root_moment moment = {.parent = tw_way_parent_at(clip->parts[0], &r->way, time),
                        .local = tw_way_local_at(clip->parts[0], &r->way.own, time)};
  tw_affine own = tw_affine_of(&moment.local), world = tw_affine_product(&moment.parent, &own);
  moment.root = state_of(r, &world, &moment.local);
  return moment;
}

/* Places beyond the range of float end there. */
static float narrow(double value) {
  return (float)fmax(-(double)FLT_MAX, fmin((double)FLT_MAX, value));
}

/* The node's transform without the motion: parent^-1 R^-1 parent local. */
static void take_out(const root_moment *moment, tw_trs *out) {
  double local[3], world[3], back[3];
  *out = moment->local;
  for (int i = 0; i < 3; i++) local[i] = (double)moment->local.translation[i];
  tw_affine_move(&moment->parent, local, world);
  for (int i = 0; i < 3; i++) world[i] -= moment->root.shift[i];
  turn_about_y(moment->root.half, -1, world, back);
  for (int i = 0; i < 3; i++) back[i] -= moment->parent.at[i];
  tw_affine_solve(&moment->parent, back, local);
  for (int i = 0; i < 3; i++) out->translation[i] = narrow(local[i]);
  if (moment->root.half[1] == 0) return;
  const double turn[4] = {0, -moment->root.half[1], 0, moment->root.half[0]};
  double inside[4], q[4], result[4];
  tw_affine_turn_inside(&moment->parent, turn, inside);
  quat_widen(moment->local.rotation, q);
  quat_multiply(inside, q, result);
  tw_normalize(result, 4);
  quat_narrow(result, out->rotation);
}

/* The carrier's transform with the motion in front: R local. */
static void put_in_front(const root_state *root, tw_trs *local) {
  double at[3], moved[3], q[4], result[4];
  const double turn[4] = {0, root->half[1], 0, root->half[0]};
  for (int i = 0; i < 3; i++) at[i] = (double)local->translation[i];
  turn_about_y(root->half, 1, at, moved);
  for (int i = 0; i < 3; i++) local->translation[i] = narrow(moved[i] + root->shift[i]);
  quat_widen(local->rotation, q);
  quat_multiply(turn, q, result);
  quat_narrow(result, local->rotation);
}

/* What a part's node has at a time. */
static tw_trs part_at(const tw_clip *clip, root_part part, float time) {
  const rooting *r = rooting_of(clip);
  root_moment moment = moment_at(clip, time);
  tw_trs out = TW_TRS_IDENTITY;
  if (part == PART_NODE) {
    take_out(&moment, &out);
    return out;
  }
  if (r->carrier < clip->parts[0]->node_count) out = tw_way_local_at(clip->parts[0], &r->top, time);
  put_in_front(&moment.root, &out);
  return out;
}

static void rooted_pose(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                        tw_trs *locals) {
  const rooting *r = rooting_of(clip);
  const tw_clip *inner = clip->parts[0];
  uint32_t own = first < inner->node_count ? inner->node_count - first : 0;
  tw_clip_pose_nodes(inner, nodes, first, count < own ? count : own, time, locals);
  if (r->node - first < count) locals[r->node - first] = part_at(clip, PART_NODE, time);
  if (r->carrier != TW_NO_INDEX && r->carrier - first < count)
    locals[r->carrier - first] = part_at(clip, PART_CARRIER, time);
}

static void rooted_sample(const tw_clip *clip, uint32_t index, const float *times, size_t time_count,
                          float *out) {
  const rooting *r = rooting_of(clip);
  const tw_track *track = &clip->tracks[index];
  if (r->parts[index] == PART_SAME) {
    tw_clip_sample(clip->parts[0], index, times, time_count, out);
    return;
  }
  for (size_t i = 0; i < time_count; i++) {
    tw_trs trs = part_at(clip, r->parts[index], times[i]);
    memcpy(out + i * track->width, track->path == TW_ROTATION ? trs.rotation : trs.translation,
           track->width * sizeof *out);
  }
}

static bool rooted_bends(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink) {
  const rooting *r = rooting_of(clip);
  const tw_clip *inner = clip->parts[0];
  if (r->parts[track] == PART_SAME) return tw_clip_bends(inner, track, sink);
  return tw_way_bends(inner, &r->way, sink);
}

void tw_clip_root_at(const tw_clip *clip, float time, tw_trs *out) {
  root_moment moment = moment_at(clip, time);
  *out = TW_TRS_IDENTITY;
  put_in_front(&moment.root, out);
}

/* ---- making ---------------------------------------------------------------------------------- */

static void start(const tw_clip *clip, rooting *r) {
  tw_affine parent = tw_way_parent_at(clip, &r->way, 0);
  tw_trs local = tw_way_local_at(clip, &r->way.own, 0);
  tw_affine own = tw_affine_of(&local), world = tw_affine_product(&parent, &own);
  memcpy(r->start, world.at, sizeof r->start);
  for (int i = 0; i < 3; i++) r->is_negative[i] = local.scale[i] < 0;
  r->start_inverse = TW_AFFINE_IDENTITY;
  for (int i = 0; i < 3; i++) {
    double column[3] = {0, 0, 0};
    column[i] = 1;
    tw_affine_solve(&world, column, r->start_inverse.axes[i]);
  }
}

/* Adds or replaces a track of a node's path. */
static void put_track(tw_clip *clip, rooting *r, uint32_t node, tw_path path, root_part part, bool holds) {
  uint32_t index = 0;
  while (index < clip->track_count && (clip->tracks[index].node != node || clip->tracks[index].path != path))
    index++;
  if (index == clip->track_count) clip->track_count++;
  clip->tracks[index] = (tw_track){
      .kind = TRACK_MADE, .node = node, .path = path, .holds = holds, .width = path == TW_ROTATION ? 4 : 3};
  clip->moves[node] |= (uint8_t)(1u << path);
  r->parts[index] = part;
}

/* Whether all tracks that a node's way has are STEP. */
static bool way_holds(const tw_clip *inner, const rooting *r) {
  bool holds = true;
  for (uint32_t i = 0; i <= r->way.count; i++) {
    const tw_way_node *node = i < r->way.count ? &r->way.nodes[i] : &r->way.own;
    for (int path = 0; path < 3; path++)
      holds = holds && (node->tracks[path] == TW_NO_INDEX || inner->tracks[node->tracks[path]].holds);
  }
  return holds;
}

static bool build_tracks(const tw_clip *inner, const tw_root_job *job, tw_clip *clip, rooting *r) {
  size_t most = (size_t)inner->track_count + 4;
  clip->node_count = job->node_count + (job->carrier == job->node_count);
  clip->tracks = tw_arena_alloc(clip->arena, most, sizeof *clip->tracks);
  clip->moves = tw_arena_alloc(clip->arena, clip->node_count, sizeof *clip->moves);
  r->parts = tw_arena_alloc(clip->arena, most, sizeof *r->parts);
  if (!clip->tracks || !clip->moves || !r->parts) return false;
  if (inner->node_count) memcpy(clip->moves, inner->moves, inner->node_count * sizeof *clip->moves);
  clip->track_count = inner->track_count;
  for (uint32_t i = 0; i < inner->track_count; i++) {
    const tw_track *track = &inner->tracks[i];
    clip->tracks[i] = (tw_track){.kind = TRACK_MADE,
                                 .node = track->node,
                                 .path = track->path,
                                 .holds = track->holds,
                                 .width = track->width};
  }
  bool holds = way_holds(inner, r);
  for (int i = 0; i < 2; i++) {
    tw_path path = i ? TW_ROTATION : TW_TRANSLATION;
    put_track(clip, r, job->node, path, PART_NODE, holds);
    if (job->carrier != TW_NO_INDEX) put_track(clip, r, job->carrier, path, PART_CARRIER, holds);
  }
  return true;
}

static bool build(tw_clip *inner, const tw_root_job *job, tw_clip *clip, rooting *r) {
  static const tw_clip_kind kind = {rooted_pose, rooted_sample, rooted_bends};
  clip->parts = tw_arena_alloc(clip->arena, 1, sizeof *clip->parts);
  r->node = job->node;
  r->carrier = job->carrier;
  r->axes = job->axes;
  tw_node_tracks *all = tw_way_list_tracks(inner, clip->arena);
  if (!clip->parts || !all || !tw_way_find(all, job->nodes, job->node, clip->arena, &r->way)) return false;
  if (job->carrier < job->node_count) r->top = tw_way_node_of(all, job->nodes, job->carrier);
  if (!build_tracks(inner, job, clip, r)) return false;
  start(inner, r);
  clip->parts[0] = inner;
  clip->kind = &kind;
  clip->making = r;
  clip->duration = inner->duration;
  clip->depth = inner->depth;
  clip->leaves = inner->leaves;
  clip->cost = inner->cost * (3 * (r->way.count + 1) + 1);
  return true;
}

/* Whether a turn about y in the world is one in the frame m: whether m m^T is the same around y. */
static bool holds_yaw(const tw_affine *m) {
  static const double ROOM = 2e-4;
  double square[3][3] = {{0}};
  for (int i = 0; i < 9; i++)
    for (int k = 0; k < 3; k++) square[i / 3][i % 3] += m->axes[k][i / 3] * m->axes[k][i % 3];
  double most = fmax(fmax(square[0][0], square[1][1]), square[2][2]) * ROOM;
  return fabs(square[0][0] - square[2][2]) <= most && fabs(square[0][2]) <= most &&
         fabs(square[0][1]) <= most && fabs(square[1][2]) <= most;
}

/* Looks for a time at which the node's parent does not hold a turn. */
typedef struct yaw_check {
  const tw_clip *clip;
  const tw_way *way;
  double before; /* the time looked at last */
  bool fails;
} yaw_check;

/* Looks at a time and two before it. */
static bool check_yaw(void *context, double time) {
  enum { STEPS_A_NODE = 30 };
  yaw_check *c = context;
  for (int i = 0; i < 3 && !c->fails; i++) {
    float at = (float)(time + (c->before - time) * i / 3);
    tw_affine parent = tw_way_parent_at(c->clip, c->way, at);
    c->fails = !holds_yaw(&parent);
  }
  c->before = time;
  return !c->fails && tw_work(STEPS_A_NODE * (uint64_t)(c->way->count + 1) * c->clip->cost);
}

/* Whether the node's parent, which scales evenly at time 0, holds turns later too, where scales above it
 * move. Looks at some ten thousand times at most. */
static bool keeps_yaw(const tw_clip *clip, const tw_way *way) {
  enum { NODES_MOST = 1 << 20, TIMES_A_BEND = 3 };
  uint64_t left = NODES_MOST / (TIMES_A_BEND * clip->cost * (uint64_t)(way->count + 1)) + 1;
  yaw_check check = {.clip = clip, .way = way};
  const tw_bend_sink sink = {check_yaw, &check, &left};
  bool is_scaled = false, goes_on = true;
  for (uint32_t i = 0; i < way->count; i++) is_scaled |= way->nodes[i].tracks[TW_SCALE] != TW_NO_INDEX;
  for (uint32_t i = 0; is_scaled && goes_on && i < way->count; i++)
    goes_on = tw_way_node_bends(clip, &way->nodes[i], &sink);
  return !check.fails;
}

tw_status tw_clip_take_root(tw_clip *clip, const tw_root_job *job, tw_clip **out, tw_error *error) {
  tw_arena *arena = tw_arena_create();
  tw_clip *rooted = arena ? tw_arena_alloc(arena, 1, sizeof *rooted) : NULL;
  rooting *r = rooted ? tw_arena_alloc(arena, 1, sizeof *r) : NULL;
  if (rooted) rooted->arena = arena;
  if (!r || !build(clip, job, rooted, r)) {
    tw_arena_destroy(arena);
    return tw_fail(error, TW_NO_MEMORY, "no memory for root motion");
  }
  tw_affine parent = tw_way_parent_at(clip, &r->way, 0);
  if ((job->axes & TW_ROOT_YAW) && !(is_even(&parent) && keeps_yaw(clip, &r->way))) {
    tw_arena_destroy(arena);
    return tw_fail(error, TW_UNSUPPORTED,
                   "a turn cannot be taken out below nodes with unequal scales or shear: leave yaw out of "
                   "root_axes");
  }
  rooted->part_count = 1; /* from here on the clip owns it */
  *out = rooted;
  return TW_OK;
}

/* ---- the usual node -------------------------------------------------------------------------- */

enum { SAMPLES_MOST = 1 << 21 }; /* of plain clips */

/* Looks for a change of a track's value. */
typedef struct change {
  const tw_clip *clip;
  uint32_t track, samples; /* samples: taken so far */
  uint64_t *left;          /* samples that may still be taken, by all tracks together */
  float first[4];
  double before; /* the time looked at last */
  bool is_found;
} change;

static bool differs(const change *c, const float *value) {
  static const double ANGLE = 1e-5, SHARE = 1e-6;
  if (c->clip->tracks[c->track].path == TW_ROTATION) {
    double a[4], b[4];
    quat_widen(c->first, a);
    quat_widen(value, b);
    return tw_angle_between(a, b) > ANGLE;
  }
  double apart = 0, largest = 0;
  for (int i = 0; i < 3; i++) {
    apart = fmax(apart, fabs((double)value[i] - (double)c->first[i]));
    largest = fmax(largest, fmax(fabs((double)value[i]), fabs((double)c->first[i])));
  }
  return apart > SHARE * largest;
}

/* Looks at a time and two before it: a cubic between equal values is there at one of them at most. */
static bool look_at(void *context, double time) {
  change *c = context;
  float times[3], values[3 * 4];
  uint32_t width = c->clip->tracks[c->track].width;
  if (*c->left < 3) return false;
  *c->left -= 3;
  if (c->samples == 0) c->before = time;
  for (int i = 0; i < 3; i++) times[i] = (float)(time + (c->before - time) * i / 3);
  tw_clip_sample(c->clip, c->track, times, 3, values);
  if (c->samples == 0) memcpy(c->first, values, width * sizeof *values);
  for (int i = 0; i < 3; i++) c->is_found |= differs(c, values + (size_t)i * width);
  c->samples += 3;
  c->before = time;
  return !c->is_found;
}

/* Whether a track's value changes: exporters that bake write tracks of nodes that rest, too. Where *left does
 * not reach, it counts as one that does. */
static bool changes(const tw_clip *clip, uint32_t track, uint64_t *left) {
  change c = {.clip = clip, .track = track, .left = left};
  uint64_t steps = *left;
  tw_bend_sink sink = {look_at, &c, &steps};
  return !tw_clip_bends(clip, track, &sink) || !look_at(&c, (double)clip->duration);
}

/* Writes the track of each node that has one of a path. out: [node_count]. */
static void list_tracks(const tw_clip *clip, tw_path path, uint32_t *out) {
  for (uint32_t t = 0; t < clip->track_count; t++)
    if (clip->tracks[t].path == path) out[clip->tracks[t].node] = t;
}

/* below: [node_count] nodes of each subtree. left: as of changes(); NULL: any track counts. */
static uint32_t choose_root(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                            uint32_t node_count, tw_path path, const uint32_t *track_of, uint64_t *left,
                            const uint32_t *below, bool *has_moved_above) {
  uint32_t best = TW_NO_INDEX;
  for (uint32_t i = 0; i < node_count; i++) {
    uint32_t node = order[i], parent = nodes[node].parent;
    has_moved_above[node] = parent != TW_NO_INDEX && has_moved_above[parent];
    if (has_moved_above[node] || !(clip->moves[node] & 1u << path)) continue;
    if (left && !changes(clip, track_of[node], left)) continue;
    if (best == TW_NO_INDEX || below[node] > below[best]) best = node;
    has_moved_above[node] = true;
  }
  return best;
}

uint32_t tw_clip_find_root(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                           uint32_t node_count) {
  uint32_t *below = tw_alloc_zero(node_count, sizeof *below),
           *track_of = tw_alloc(node_count, sizeof *track_of), root = TW_NO_INDEX;
  bool *marks = tw_alloc_zero(node_count, sizeof *marks);
  for (uint32_t i = node_count; below && i-- > 0;) {
    uint32_t node = order[i], parent = nodes[node].parent;
    below[node]++;
    if (parent != TW_NO_INDEX) below[parent] += below[node];
  }
  static const tw_path paths[] = {TW_TRANSLATION, TW_ROTATION};
  uint64_t left = SAMPLES_MOST / clip->cost;
  for (int i = 0; below && marks && track_of && root == TW_NO_INDEX && i < 4; i++) {
    bool must_change = i < 2; /* else a node whose tracks never change serves */
    list_tracks(clip, paths[i % 2], track_of);
    root = choose_root(clip, nodes, order, node_count, paths[i % 2], track_of, must_change ? &left : NULL,
                       below, marks);
  }
  tw_free(track_of);
  tw_free(below);
  tw_free(marks);
  return root;
}
