/* Ways through a hierarchy, evaluated at a time. */
#include "way.h"

#include <math.h>
#include <string.h>

#include "vector3.h"

/* ---- affine transforms ----------------------------------------------------------------------- */

const tw_affine TW_AFFINE_IDENTITY = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};

static void turn(const tw_affine *m, const double v[3], double out[3]) {
  const double from[3] = {v[0], v[1], v[2]};
  for (int i = 0; i < 3; i++)
    out[i] = m->axes[0][i] * from[0] + m->axes[1][i] * from[1] + m->axes[2][i] * from[2];
}

void tw_affine_move(const tw_affine *m, const double p[3], double out[3]) {
  turn(m, p, out);
  for (int i = 0; i < 3; i++) out[i] += m->at[i];
}

tw_affine tw_affine_product(const tw_affine *a, const tw_affine *b) {
  tw_affine out;
  for (int i = 0; i < 3; i++) turn(a, b->axes[i], out.axes[i]);
  tw_affine_move(a, b->at, out.at);
  return out;
}

static tw_affine affine_of_matrix(const float m[16]) {
  tw_affine out;
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) out.axes[column][row] = (double)m[4 * column + row];
  for (int row = 0; row < 3; row++) out.at[row] = (double)m[12 + row];
  return out;
}

tw_affine tw_affine_of(const tw_trs *trs) {
  double q[4], s;
  tw_affine out;
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

void tw_affine_solve(const tw_affine *m, const double v[3], double x[3]) {
  double across[3], det = tw_determinant3(m->axes[0], m->axes[1], m->axes[2]), solved[3];
  for (int i = 0; i < 3; i++) {
    tw_cross3(m->axes[(i + 1) % 3], m->axes[(i + 2) % 3], across);
    solved[i] = det != 0 ? tw_dot3(across, v) / det : 0;
  }
  memcpy(x, solved, sizeof solved);
}

void tw_affine_turn_inside(const tw_affine *m, const double q[4], double out[4]) {
  double axis[3], sine = tw_length3(q), w = q[3];
  tw_affine_solve(m, q, axis);
  tw_unit3(axis);
  if (tw_determinant3(m->axes[0], m->axes[1], m->axes[2]) < 0) sine = -sine;
  for (int i = 0; i < 3; i++) out[i] = axis[i] * sine;
  out[3] = w;
}

/* ---- the way --------------------------------------------------------------------------------- */

tw_node_tracks *tw_way_list_tracks(const tw_clip *clip, tw_arena *arena) {
  tw_node_tracks *all = tw_arena_alloc_raw(arena, clip->node_count, sizeof *all);
  if (all) memset(all, 0xFF, clip->node_count * sizeof *all);
  for (uint32_t i = 0; all && i < clip->track_count; i++)
    if (clip->tracks[i].path != TW_WEIGHTS) all[clip->tracks[i].node].tracks[clip->tracks[i].path] = i;
  return all;
}

tw_way_node tw_way_node_of(const tw_node_tracks *all, const tw_node *nodes, uint32_t node) {
  tw_way_node out = {.rest = nodes[node].rest, .before = TW_AFFINE_IDENTITY};
  memcpy(out.tracks, all[node].tracks, sizeof out.tracks);
  return out;
}

static bool is_still(const tw_way_node *node) {
  return node->tracks[0] == TW_NO_INDEX && node->tracks[1] == TW_NO_INDEX && node->tracks[2] == TW_NO_INDEX;
}

bool tw_way_find(const tw_node_tracks *all, const tw_node *nodes, uint32_t node, tw_arena *arena,
                 tw_way *out) {
  uint32_t depth = 0;
  for (uint32_t n = nodes[node].parent; n != TW_NO_INDEX; n = nodes[n].parent) depth++;
  uint32_t *above = tw_arena_alloc_raw(arena, depth, sizeof *above), place = depth;
  for (uint32_t n = nodes[node].parent; above && n != TW_NO_INDEX; n = nodes[n].parent) above[--place] = n;
  uint32_t moved = 0;
  for (uint32_t i = 0; above && i < depth; i++) {
    tw_way_node next = tw_way_node_of(all, nodes, above[i]);
    moved += !is_still(&next);
  }
  *out = (tw_way){.nodes = above ? tw_arena_alloc(arena, moved, sizeof *out->nodes) : NULL,
                  .still = TW_AFFINE_IDENTITY,
                  .own = tw_way_node_of(all, nodes, node)};
  if (!out->nodes) return false;
  for (uint32_t i = 0; i < depth; i++) {
    const tw_node *at = &nodes[above[i]];
    tw_way_node next = tw_way_node_of(all, nodes, above[i]);
    if (is_still(&next)) {
      tw_affine own = at->has_matrix ? affine_of_matrix(at->matrix) : tw_affine_of(&at->rest);
      out->still = tw_affine_product(&out->still, &own);
      continue;
    }
    next.before = out->still;
    out->nodes[out->count++] = next;
    out->still = TW_AFFINE_IDENTITY;
  }
  return true;
}

/* ---- evaluating ------------------------------------------------------------------------------ */

tw_trs tw_way_local_at(const tw_clip *clip, const tw_way_node *node, float time) {
  tw_trs out = node->rest;
  float *const places[] = {out.translation, out.rotation, out.scale};
  static const size_t widths[] = {3, 4, 3};
  for (int path = 0; path < 3; path++) {
    float sample[4];
    if (node->tracks[path] == TW_NO_INDEX) continue;
    tw_clip_sample(clip, node->tracks[path], &time, 1, sample);
    memcpy(places[path], sample, widths[path] * sizeof *sample);
  }
  return out;
}

tw_affine tw_way_parent_at(const tw_clip *clip, const tw_way *way, float time) {
  tw_affine world = TW_AFFINE_IDENTITY;
  for (uint32_t i = 0; i < way->count; i++) {
    tw_trs trs = tw_way_local_at(clip, &way->nodes[i], time);
    tw_affine own = tw_affine_of(&trs);
    world = tw_affine_product(&world, &way->nodes[i].before);
    world = tw_affine_product(&world, &own);
  }
  return tw_affine_product(&world, &way->still);
}

bool tw_way_node_bends(const tw_clip *clip, const tw_way_node *node, const tw_bend_sink *sink) {
  for (int path = 0; path < 3; path++)
    if (node->tracks[path] != TW_NO_INDEX && !tw_clip_bends(clip, node->tracks[path], sink)) return false;
  return true;
}

bool tw_way_bends(const tw_clip *clip, const tw_way *way, const tw_bend_sink *sink) {
  for (uint32_t i = 0; i < way->count; i++)
    if (!tw_way_node_bends(clip, &way->nodes[i], sink)) return false;
  return tw_way_node_bends(clip, &way->own, sink);
}
