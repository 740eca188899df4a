/* Clips whose root motion is taken out. Computed in double precision at each time, so that putting the motion
 * back gives what was there but for the rounding of the results. */
#include "tweend/root_motion.h"

#include <math.h>
#include <string.h>

#include "clip.h"
#include "vector3.h"

/* ---- affine transforms -----------------------------------------------------------------------------------
 */

/* Columns of the linear part, then the translation. */
typedef struct affine {
  double axes[3][3], at[3];
} affine;

static const affine AFFINE_IDENTITY = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};

static void affine_turn(const affine *m, const double v[3], double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = m->axes[0][i] * v[0] + m->axes[1][i] * v[1] + m->axes[2][i] * v[2];
}

static void affine_move(const affine *m, const double p[3], double out[3]) {
  affine_turn(m, p, out);
  for (int i = 0; i < 3; i++) out[i] += m->at[i];
}

static affine affine_product(const affine *a, const affine *b) {
  affine out;
  for (int i = 0; i < 3; i++) affine_turn(a, b->axes[i], out.axes[i]);
  affine_move(a, b->at, out.at);
  return out;
}

static affine affine_of_matrix(const float m[16]) {
  affine out;
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) out.axes[column][row] = (double)m[4 * column + row];
  for (int row = 0; row < 3; row++) out.at[row] = (double)m[12 + row];
  return out;
}

static affine affine_of(const tw_trs *trs) {
  double q[4], s;
  affine out;
  quat_widen(trs->rotation, q);
  s = 2 / quat_dot(q, q);
  double xx = q[0] * q[0] * s, yy = q[1] * q[1] * s, zz = q[2] * q[2] * s, xy = q[0] * q[1] * s,
         xz = q[0] * q[2] * s, yz = q[1] * q[2] * s, wx = q[3] * q[0] * s, wy = q[3] * q[1] * s,
         wz = q[3] * q[2] * s;
  const double axes[3][3] = {{1 - (yy + zz), xy + wz, xz - wy},
                             {xy - wz, 1 - (xx + zz), yz + wx},
                             {xz + wy, yz - wx, 1 - (xx + yy)}};
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) out.axes[column][row] = axes[column][row] * (double)trs->scale[column];
  for (int row = 0; row < 3; row++) out.at[row] = (double)trs->translation[row];
  return out;
}

/* Solves m x = v for the linear part. Without an inverse x is 0. */
static void affine_solve(const affine *m, const double v[3], double x[3]) {
  double across[3], det = tw_determinant3(m->axes[0], m->axes[1], m->axes[2]);
  for (int i = 0; i < 3; i++) {
    tw_cross3(m->axes[(i + 1) % 3], m->axes[(i + 2) % 3], across);
    x[i] = det != 0 ? tw_dot3(across, v) / det : 0;
  }
}

/* ---- the clip --------------------------------------------------------------------------------------------
 */

/* A node on the way from the top to the one whose motion is taken. */
typedef struct way_node {
  uint32_t tracks[3]; /* by path, of the clip; TW_NO_INDEX: as at rest */
  tw_trs rest;
  affine before; /* of nodes above it that stand still */
} way_node;

typedef enum root_part { PART_SAME, PART_NODE, PART_CARRIER } root_part;

typedef struct rooting {
  uint32_t node, carrier; /* carrier: as in the job */
  unsigned axes;
  uint32_t way_count;
  way_node *way;        /* [way_count] nodes above that move */
  affine still;         /* of those that stand still, between the last one that moves and the node */
  way_node own, top;    /* the node, and the carrier where it is a node of the clip */
  affine start_inverse; /* the inverse of W(0)'s linear part */
  double start[3];      /* w(0) */
  root_part *parts;     /* [tracks] */
} rooting;

static const rooting *rooting_of(const tw_clip *clip) {
  return clip->making;
}

static tw_trs trs_at(const tw_clip *inner, const way_node *node, float time) {
  tw_trs out = node->rest;
  float *const places[] = {out.translation, out.rotation, out.scale};
  static const size_t widths[] = {3, 4, 3};
  for (int path = 0; path < 3; path++) {
    float sample[4];
    if (node->tracks[path] == TW_NO_INDEX) continue;
    tw_clip_sample(inner, node->tracks[path], &time, 1, sample);
    memcpy(places[path], sample, widths[path] * sizeof *sample);
  }
  return out;
}

/* The world transform of the node's parent. */
static affine parent_at(const tw_clip *inner, const rooting *r, float time) {
  affine world = AFFINE_IDENTITY;
  for (uint32_t i = 0; i < r->way_count; i++) {
    tw_trs trs = trs_at(inner, &r->way[i], time);
    affine own = affine_of(&trs);
    world = affine_product(&world, &r->way[i].before);
    world = affine_product(&world, &own);
  }
  return affine_product(&world, &r->still);
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

/* The components of the rotation nearest to a linear part that tell its turn about y: w and y, in proportion
 * (Shepperd 1978: the largest of four is not divided by). */
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

static root_state state_of(const rooting *r, const affine *world) {
  root_state state = {{1, 0}, {0, 0, 0}};
  if (r->axes & TW_ROOT_YAW) {
    double half[2];
    affine turn = affine_product(world, &r->start_inverse);
    find_twist(turn.axes, half);
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
  affine parent;
  tw_trs local; /* of the node, before anything is taken */
} root_moment;

static root_moment moment_at(const tw_clip *clip, float time) {
  const rooting *r = rooting_of(clip);
  root_moment moment = {.parent = parent_at(clip->parts[0], r, time),
                        .local = trs_at(clip->parts[0], &r->own, time)};
  affine own = affine_of(&moment.local), world = affine_product(&moment.parent, &own);
  moment.root = state_of(r, &world);
  return moment;
}

/* The node's transform without the motion: parent^-1 R^-1 parent local. */
static void take_out(const root_moment *moment, tw_trs *out) {
  double local[3], world[3], back[3];
  *out = moment->local;
  for (int i = 0; i < 3; i++) local[i] = (double)moment->local.translation[i];
  affine_move(&moment->parent, local, world);
  for (int i = 0; i < 3; i++) world[i] -= moment->root.shift[i];
  turn_about_y(moment->root.half, -1, world, back);
  for (int i = 0; i < 3; i++) back[i] -= moment->parent.at[i];
  affine_solve(&moment->parent, back, local);
  for (int i = 0; i < 3; i++) out->translation[i] = (float)local[i];
  if (moment->root.half[1] == 0) return;
  /* The turn about the world's y is one about that axis in the parent; mirrored parents turn it round. */
  const affine *p = &moment->parent;
  static const double up[3] = {0, 1, 0};
  double axis[3], q[4], result[4];
  affine_solve(p, up, axis);
  tw_unit3(axis);
  double sine = -moment->root.half[1] * (tw_determinant3(p->axes[0], p->axes[1], p->axes[2]) < 0 ? -1 : 1);
  const double turn[4] = {axis[0] * sine, axis[1] * sine, axis[2] * sine, moment->root.half[0]};
  quat_widen(moment->local.rotation, q);
  quat_multiply(turn, q, result);
  tw_normalize(result, 4);
  quat_narrow(result, out->rotation);
}

/* The carrier's transform with the motion in front: R local. */
static void put_in_front(const root_state *root, tw_trs *local) {
  double at[3], moved[3], q[4], result[4];
  const double turn[4] = {0, root->half[1], 0, root->half[0]};
  for (int i = 0; i < 3; i++) at[i] = (double)local->translation[i];
  turn_about_y(root->half, 1, at, moved);
  for (int i = 0; i < 3; i++) local->translation[i] = (float)(moved[i] + root->shift[i]);
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
  if (r->carrier < clip->parts[0]->node_count) out = trs_at(clip->parts[0], &r->top, time);
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

static bool put_bends(const tw_clip *inner, const way_node *node, const tw_bend_sink *sink) {
  for (int path = 0; path < 3; path++)
    if (node->tracks[path] != TW_NO_INDEX && !tw_clip_bends(inner, node->tracks[path], sink)) return false;
  return true;
}

static bool rooted_bends(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink) {
  const rooting *r = rooting_of(clip);
  const tw_clip *inner = clip->parts[0];
  if (r->parts[track] == PART_SAME) return tw_clip_bends(inner, track, sink);
  for (uint32_t i = 0; i < r->way_count; i++)
    if (!put_bends(inner, &r->way[i], sink)) return false;
  return put_bends(inner, &r->own, sink);
}

void tw_clip_root_at(const tw_clip *clip, float time, tw_trs *out) {
  root_moment moment = moment_at(clip, time);
  *out = TW_TRS_IDENTITY;
  put_in_front(&moment.root, out);
}

/* ---- making ----------------------------------------------------------------------------------------------
 */

/* The tracks of a node's translation, rotation and scale. */
typedef struct node_tracks {
  uint32_t tracks[3];
} node_tracks;

/* Those of each node. NULL without memory. */
static node_tracks *list_tracks(const tw_clip *clip, tw_arena *arena) {
  node_tracks *all = tw_arena_alloc_raw(arena, clip->node_count, sizeof *all);
  if (all) memset(all, 0xFF, clip->node_count * sizeof *all);
  for (uint32_t i = 0; all && i < clip->track_count; i++)
    if (clip->tracks[i].path != TW_WEIGHTS) all[clip->tracks[i].node].tracks[clip->tracks[i].path] = i;
  return all;
}

static way_node way_node_of(const node_tracks *all, const tw_node *nodes, uint32_t node) {
  way_node out = {.rest = nodes[node].rest, .before = AFFINE_IDENTITY};
  memcpy(out.tracks, all[node].tracks, sizeof out.tracks);
  return out;
}

static bool is_still(const way_node *node) {
  return node->tracks[0] == TW_NO_INDEX && node->tracks[1] == TW_NO_INDEX && node->tracks[2] == TW_NO_INDEX;
}

/* Finds the nodes above that move, and what those give together that do not. */
static bool find_way(const node_tracks *all, const tw_root_job *job, rooting *r, tw_arena *arena) {
  uint32_t depth = 0;
  for (uint32_t n = job->nodes[job->node].parent; n != TW_NO_INDEX; n = job->nodes[n].parent) depth++;
  uint32_t *above = tw_arena_alloc_raw(arena, depth, sizeof *above), place = depth;
  for (uint32_t n = job->nodes[job->node].parent; above && n != TW_NO_INDEX; n = job->nodes[n].parent)
    above[--place] = n;
  uint32_t moved = 0;
  for (uint32_t i = 0; above && i < depth; i++) {
    way_node way = way_node_of(all, job->nodes, above[i]);
    moved += !is_still(&way);
  }
  r->way = above ? tw_arena_alloc(arena, moved, sizeof *r->way) : NULL;
  if (!r->way) return false;
  r->still = AFFINE_IDENTITY;
  for (uint32_t i = 0; i < depth; i++) {
    const tw_node *node = &job->nodes[above[i]];
    way_node way = way_node_of(all, job->nodes, above[i]);
    if (is_still(&way)) {
      affine own = node->has_matrix ? affine_of_matrix(node->matrix) : affine_of(&node->rest);
      r->still = affine_product(&r->still, &own);
      continue;
    }
    way.before = r->still;
    r->way[r->way_count++] = way;
    r->still = AFFINE_IDENTITY;
  }
  return true;
}

/* Whether a linear part turns and scales evenly. */
static bool is_even(const affine *m) {
  static const double ROOM = 1e-4;
  double size = tw_length3(m->axes[0]);
  for (int i = 0; i < 3; i++) {
    const double *a = m->axes[i], *b = m->axes[(i + 1) % 3];
    if (fabs(tw_length3(a) - size) > ROOM * size || fabs(tw_dot3(a, b)) > ROOM * size * size) return false;
  }
  return size > 0;
}

static void start(const tw_clip *clip, rooting *r) {
  affine parent = parent_at(clip, r, 0);
  tw_trs local = trs_at(clip, &r->own, 0);
  affine own = affine_of(&local), world = affine_product(&parent, &own);
  memcpy(r->start, world.at, sizeof r->start);
  r->start_inverse = AFFINE_IDENTITY;
  for (int i = 0; i < 3; i++) {
    double column[3] = {0, 0, 0};
    column[i] = 1;
    affine_solve(&world, column, r->start_inverse.axes[i]);
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
  for (uint32_t i = 0; i <= r->way_count; i++) {
    const way_node *node = i < r->way_count ? &r->way[i] : &r->own;
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
  node_tracks *all = list_tracks(inner, clip->arena);
  if (!clip->parts || !all || !find_way(all, job, r, clip->arena)) return false;
  r->own = way_node_of(all, job->nodes, job->node);
  if (job->carrier < job->node_count) r->top = way_node_of(all, job->nodes, job->carrier);
  if (!build_tracks(inner, job, clip, r)) return false;
  start(inner, r);
  clip->parts[0] = inner;
  clip->kind = &kind;
  clip->making = r;
  clip->duration = inner->duration;
  clip->depth = inner->depth;
  clip->leaves = inner->leaves;
  clip->cost = inner->cost * (3 * (r->way_count + 1) + 1);
  return true;
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
  affine parent = parent_at(clip, r, 0);
  if ((job->axes & TW_ROOT_YAW) && !is_even(&parent)) {
    tw_arena_destroy(arena);
    return tw_fail(error, TW_UNSUPPORTED,
                   "a turn cannot be taken out below nodes with unequal scales or shear: leave yaw out of "
                   "root_axes");
  }
  rooted->part_count = 1; /* from here on the clip owns it */
  *out = rooted;
  return TW_OK;
}

/* ---- the usual node --------------------------------------------------------------------------------------
 */

/* below: [node_count] nodes of each subtree. */
static uint32_t choose_root(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                            uint32_t node_count, unsigned bits, const uint32_t *below,
                            bool *has_moved_above) {
  uint32_t best = TW_NO_INDEX;
  for (uint32_t i = 0; i < node_count; i++) {
    uint32_t node = order[i], parent = nodes[node].parent;
    bool moves = (clip->moves[node] & bits) != 0;
    has_moved_above[node] = parent != TW_NO_INDEX && has_moved_above[parent];
    if (moves && !has_moved_above[node] && (best == TW_NO_INDEX || below[node] > below[best])) best = node;
    if (moves) has_moved_above[node] = true;
  }
  return best;
}

uint32_t tw_clip_find_root(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                           uint32_t node_count) {
  uint32_t *below = tw_alloc_zero(node_count, sizeof *below), root = TW_NO_INDEX;
  bool *marks = tw_alloc_zero(node_count, sizeof *marks);
  for (uint32_t i = node_count; below && i-- > 0;) {
    uint32_t node = order[i], parent = nodes[node].parent;
    below[node]++;
    if (parent != TW_NO_INDEX) below[parent] += below[node];
  }
  if (below && marks) root = choose_root(clip, nodes, order, node_count, 1u << TW_TRANSLATION, below, marks);
  if (below && marks && root == TW_NO_INDEX)
    root = choose_root(clip, nodes, order, node_count, 1u << TW_ROTATION, below, marks);
  tw_free(below);
  tw_free(marks);
  return root;
}
