/* Skeletons whose scales have signs, as rigs mirror limbs and programs with another hand turn scenes, as
 * equal ones without.
 *
 * D of a node is the product of the signs of its scale and of those above it, a diagonal matrix; D above a
 * root is chosen. With translations and rotations in the frame D of the node's parent, and scales without
 * signs, each node's matrix M becomes D_parent M D, and so its world W becomes D_root W D: all places are
 * where they were, seen in a world that D_root mirrors. It does so only for a figure whose left side is its
 * right one, which could not be laid over another by turns. */
#include <math.h>
#include <string.h>

#include "retarget_carrying.h"
#include "vector3.h"

/* Diagonals are bits: 1 << axis where the sign is negative. */
enum { ALL_AXES = 7 };

static unsigned signs_of(const float scale[3]) {
  unsigned signs = 0;
  for (int i = 0; i < 3; i++) signs |= (unsigned)(scale[i] < 0) << i;
  return signs;
}

static bool is_odd(unsigned signs) {
  return (signs ^ signs >> 1 ^ signs >> 2) & 1;
}

/* The signs that a diagonal gives the axis of a turn, about which a mirrored turn goes the other way. */
static unsigned turn_signs(unsigned signs) {
  return is_odd(signs) ? signs ^ ALL_AXES : signs;
}

static void flip(unsigned signs, float *values) {
  for (int i = 0; i < 3; i++)
    if (signs & 1u << i) values[i] = -values[i];
}

static bool has_signs(const tw_skeleton *skeleton) {
  uint32_t i = 0;
  while (i < skeleton->node_count && signs_of(skeleton->nodes[i].rest.scale) == 0) i++;
  return i < skeleton->node_count;
}

/* Whether the figure is a mirror image, so that its left limbs are on its right: legs and toes tell where
 * left, up and forwards are. False where it lacks some of them. */
static bool is_mirrored(const uint32_t *bones, const float *world) {
  enum { FEATURES = 3 };
  static const tw_bone features[FEATURES] = {TW_BONE_UPPER_LEG, TW_BONE_FOOT, TW_BONE_TOES};
  double places[FEATURES][2][3], ways[3][3];
  for (int i = 0; i < FEATURES; i++)
    for (int side = 0; side < 2; side++) {
      uint32_t node = bones[(int)features[i] + side];
      if (node == TW_NO_INDEX) return false;
      for (int k = 0; k < 3; k++) places[i][side][k] = (double)world[16 * (size_t)node + 12 + (size_t)k];
    }
  for (int k = 0; k < 3; k++) {
    ways[0][k] = places[0][0][k] - places[0][1][k];
    ways[1][k] = places[0][0][k] + places[0][1][k] - places[1][0][k] - places[1][1][k];
    ways[2][k] = places[2][0][k] + places[2][1][k] - places[1][0][k] - places[1][1][k];
  }
  return tw_determinant3(ways[0], ways[1], ways[2]) < 0;
}

/* D above each node. bones: [TW_BONES] nodes or TW_NO_INDEX. NULL without memory. */
static uint8_t *find_signs(const tw_skeleton *skeleton, const uint32_t *bones, tw_arena *arena) {
  uint32_t count = skeleton->node_count, hips = bones[TW_BONE_HIPS];
  uint8_t *above = tw_arena_alloc(arena, count, sizeof *above);
  tw_trs *locals = tw_arena_alloc_raw(arena, count, sizeof *locals);
  float *world = tw_arena_alloc_raw(arena, count, 16 * sizeof *world);
  if (!above || !locals || !world) return NULL;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t node = skeleton->order[i], parent = skeleton->nodes[node].parent;
    locals[i] = skeleton->nodes[i].rest;
    if (parent != TW_NO_INDEX)
      above[node] = (uint8_t)(above[parent] ^ signs_of(skeleton->nodes[parent].rest.scale));
  }
  tw_pose_locals(NULL, skeleton->nodes, count, locals, world);
  tw_pose_world(skeleton->nodes, skeleton->order, count, world, world);
  if (!is_mirrored(bones, world)) return above;
  unsigned root = hips == TW_NO_INDEX ? 0 : above[hips] ^ signs_of(skeleton->nodes[hips].rest.scale);
  if (!is_odd(root)) root = 1;
  for (uint32_t i = 0; i < count; i++) above[i] ^= (uint8_t)root;
  return above;
}

static void straighten_node(tw_node *node, unsigned above) {
  unsigned below = above ^ signs_of(node->rest.scale);
  flip(above, node->rest.translation);
  flip(turn_signs(above), node->rest.rotation);
  for (int i = 0; i < 3; i++) node->rest.scale[i] = fabsf(node->rest.scale[i]);
  for (size_t column = 0; column < 4; column++) {
    bool is_turned = column < 3 && below & 1u << column;
    flip(is_turned ? above ^ ALL_AXES : above, node->matrix + 4 * column);
  }
}

static bool straighten_nodes(tw_skeleton *skeleton, const uint8_t *above, tw_arena *arena) {
  tw_node *nodes = tw_arena_alloc_raw(arena, skeleton->node_count, sizeof *nodes);
  if (!nodes) return false;
  memcpy(nodes, skeleton->nodes, skeleton->node_count * sizeof *nodes);
  for (uint32_t i = 0; i < skeleton->node_count; i++) straighten_node(&nodes[i], above[i]);
  skeleton->nodes = nodes;
  return true;
}

/* Copies the keys of a track with other signs. */
static bool flip_keys(tw_track_keys *track, unsigned signs, tw_arena *arena) {
  size_t rows = (size_t)track->key_count * (track->interpolation == TW_CUBICSPLINE ? 3 : 1),
         width = track->width;
  if (track->angles) {
    double *angles = tw_arena_alloc_raw(arena, rows, width * sizeof *angles);
    for (size_t i = 0; angles && i < rows * width; i++)
      angles[i] = i % width < 3 && signs & 1u << i % width ? -track->angles[i] : track->angles[i];
    track->angles = angles;
    return angles;
  }
  float *values = tw_arena_alloc_raw(arena, rows, width * sizeof *values);
  if (values) memcpy(values, track->values, rows * width * sizeof *values);
  for (size_t row = 0; values && row < rows; row++) flip(signs, values + row * width);
  track->values = values;
  return values;
}

/* Changes the signs of all keys to those of the skeleton without signs, or back: it is its own inverse.
 * nodes: with their signs. False without memory. */
static bool flip_tracks(tw_clip_keys *keys, const tw_node *nodes, const uint8_t *above, tw_arena *arena) {
  tw_track_keys *tracks = tw_arena_alloc_raw(arena, keys->track_count, sizeof *tracks);
  bool has_room = tracks;
  if (has_room && keys->track_count) memcpy(tracks, keys->tracks, keys->track_count * sizeof *tracks);
  for (uint32_t i = 0; has_room && i < keys->track_count; i++) {
    uint32_t node = tracks[i].node;
    unsigned signs = tracks[i].path == TW_TRANSLATION ? above[node]
                     : tracks[i].path == TW_ROTATION  ? turn_signs(above[node])
                     : tracks[i].path == TW_SCALE     ? signs_of(nodes[node].rest.scale)
                                                      : 0;
    if (signs) has_room = flip_keys(&tracks[i], signs, arena);
  }
  keys->tracks = tracks;
  return has_room;
}

tw_status tw_signs_take(const tw_retarget_job *job, uint32_t bones[2][TW_BONES], tw_arena *arena,
                        tw_retarget_job *out, uint8_t **signs, tw_error *error) {
  *out = *job;
  *signs = NULL;
  if (has_signs(&job->source)) {
    const uint8_t *above = find_signs(&job->source, bones[0], arena);
    tw_clip_keys *keys = tw_arena_alloc_raw(arena, 1, sizeof *keys);
    if (!above || !keys) return tw_carrying_no_memory(error);
    *keys = *job->keys;
    out->keys = keys;
    if (!flip_tracks(keys, job->source.nodes, above, arena) || !straighten_nodes(&out->source, above, arena))
      return tw_carrying_no_memory(error);
  }
  if (!has_signs(&job->target)) return TW_OK;
  *signs = find_signs(&job->target, bones[1], arena);
  if (!*signs || !straighten_nodes(&out->target, *signs, arena)) return tw_carrying_no_memory(error);
  return TW_OK;
}

tw_status tw_signs_give_back(const tw_skeleton *target, const uint8_t *signs, tw_arena *arena,
                             tw_clip_keys *keys, tw_error *error) {
  if (!signs || flip_tracks(keys, target->nodes, signs, arena)) return TW_OK;
  return tw_carrying_no_memory(error);
}
