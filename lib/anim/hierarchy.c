/* Node hierarchies: parents first, world matrices of one pose and of sixteen, skins. */
#include "clip.h"

#include <stdlib.h>
#include <string.h>

/* A node that is its own ancestor; `start` is one from which no root is reached. */
static uint32_t node_on_cycle(const tw_node *nodes, uint32_t node_count, uint32_t start) {
  for (uint32_t i = 0; i < node_count; i++) start = nodes[start].parent;
  return start;
}

static tw_status check_parents(const tw_node *nodes, uint32_t node_count, tw_error *error) {
  for (uint32_t i = 0; i < node_count; i++)
    if (nodes[i].parent != TW_NO_INDEX && nodes[i].parent >= node_count) {
      tw_fail(error, TW_INVALID, "node %u has parent %u, but there are %u nodes", i, nodes[i].parent,
              node_count);
      return tw_error_at(error, "/nodes/%u/parent", i);
    }
  return TW_OK;
}

/* Breadth first from the roots; order is the queue itself. Returns how many nodes it reached. */
static uint32_t order_from_roots(const tw_node *nodes, uint32_t node_count, uint32_t *first_child,
                                 uint32_t *next_sibling, uint32_t *order) {
  uint32_t reached = 0;
  for (uint32_t i = 0; i < node_count; i++) first_child[i] = TW_NO_INDEX;
  for (uint32_t i = node_count; i-- > 0;) {
    if (nodes[i].parent == TW_NO_INDEX) continue;
    next_sibling[i] = first_child[nodes[i].parent];
    first_child[nodes[i].parent] = i;
  }
  for (uint32_t i = 0; i < node_count; i++)
    if (nodes[i].parent == TW_NO_INDEX) order[reached++] = i;
  for (uint32_t head = 0; head < reached; head++)
    for (uint32_t child = first_child[order[head]]; child != TW_NO_INDEX; child = next_sibling[child])
      order[reached++] = child;
  return reached;
}

static tw_status report_cycle(const tw_node *nodes, uint32_t node_count, const uint32_t *order,
                              uint32_t reached, uint32_t *seen, tw_error *error) {
  memset(seen, 0, node_count * sizeof *seen);
  for (uint32_t i = 0; i < reached; i++) seen[order[i]] = 1;
  uint32_t lost = 0;
  while (seen[lost]) lost++;
  uint32_t node = node_on_cycle(nodes, node_count, lost);
  tw_fail(error, TW_INVALID, "node %u is its own ancestor", node);
  return tw_error_at(error, "/nodes/%u/parent", node);
}

tw_status tw_nodes_order(const tw_node *nodes, uint32_t node_count, uint32_t *order, tw_error *error) {
  tw_status status = check_parents(nodes, node_count, error);
  if (status != TW_OK) return status;
  uint32_t *links = tw_alloc(node_count, 2 * sizeof *links);
  uint32_t *reached_order = tw_alloc(node_count, sizeof *reached_order);
  if (links && reached_order) {
    uint32_t reached = order_from_roots(nodes, node_count, links, links + node_count, reached_order);
    if (reached < node_count)
      status = report_cycle(nodes, node_count, reached_order, reached, links, error);
    else if (node_count)
      memcpy(order, reached_order, node_count * sizeof *order);
  } else {
    status = tw_fail(error, TW_NO_MEMORY, "no memory for the node order");
  }
  free(links);
  free(reached_order);
  return status;
}

void tw_pose_locals(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, const tw_trs *locals,
                    float *out) {
  for (uint32_t i = 0; i < node_count; i++) {
    if (nodes[i].has_matrix && !(clip && tw_clip_moves(clip, i)))
      memcpy(out + 16 * (size_t)i, nodes[i].matrix, sizeof nodes[i].matrix);
    else
      tw_trs_to_matrix(&locals[i], out + 16 * (size_t)i);
  }
}

void tw_pose_world(const tw_node *nodes, const uint32_t *order, uint32_t node_count, const float *local,
                   float *world) {
  for (uint32_t i = 0; i < node_count; i++) {
    uint32_t node = order[i], parent = nodes[node].parent;
    const float *from = local + 16 * (size_t)node;
    float *to = world + 16 * (size_t)node;
    if (parent != TW_NO_INDEX)
      tw_matrix_multiply(world + 16 * (size_t)parent, from, to);
    else
      memmove(to, from, 16 * sizeof *to);
  }
}

void tw_skin_matrices(const tw_skin *skin, const float *world, float *out) {
  for (uint32_t i = 0; i < skin->joint_count; i++)
    tw_matrix_multiply(world + 16 * (size_t)skin->joints[i], skin->inverse_bind + 16 * (size_t)i,
                       out + 16 * (size_t)i);
}

/* One number of sixteen poses. Inner loops run over the lanes and nothing else, so that the compiler makes
 * vector instructions of them; the formulas and their order are those of one pose. */
typedef struct lane_row {
  float at[TW_LANES];
} lane_row;

/* ---- sixteen poses: local transforms ------------------------------------------------------------------- */

static void put_at_rest(const tw_trs *rest, lane_row *rows) {
  for (int lane = 0; lane < TW_LANES; lane++) {
    for (int i = 0; i < 3; i++) rows[i].at[lane] = rest->translation[i];
    for (int i = 0; i < 4; i++) rows[3 + i].at[lane] = rest->rotation[i];
    for (int i = 0; i < 3; i++) rows[7 + i].at[lane] = rest->scale[i];
  }
}

static inline __attribute__((always_inline)) void transpose(const float *restrict samples, uint32_t width,
                                                            lane_row *restrict rows) {
  for (uint32_t i = 0; i < width; i++)
    for (uint32_t lane = 0; lane < TW_LANES; lane++) rows[i].at[lane] = samples[lane * width + i];
}

/* Constant widths let the compiler turn the loops into shuffles. */
static void put_samples(const float *samples, uint32_t width, lane_row *rows) {
  if (width == 4)
    transpose(samples, 4, rows);
  else
    transpose(samples, 3, rows);
}

void tw_clip_lanes(const tw_clip *clip, const tw_node *nodes, uint32_t node_count,
                   const float times[TW_LANES], float *locals) {
  static const uint32_t first_rows[] = {[TW_TRANSLATION] = 0, [TW_ROTATION] = 3, [TW_SCALE] = 7};
  lane_row *rows = (lane_row *)locals;
  float clamped[TW_LANES], samples[4 * TW_LANES];
  uint32_t keys[TW_LANES];
  const tw_timeline *timeline = NULL;
  for (uint32_t i = 0; i < node_count; i++) put_at_rest(&nodes[i].rest, rows + (size_t)i * TW_LANE_TRS);
  for (uint32_t i = 0; i < clip->posed_count; i++) {
    const tw_track *track = &clip->tracks[clip->posed[i]];
    if (track->timeline != timeline) tw_timeline_find(track->timeline, times, TW_LANES, clamped, keys);
    timeline = track->timeline;
    tw_track_sample(track, clamped, keys, TW_LANES, samples, track->width * sizeof *samples);
    put_samples(samples, track->width, rows + (size_t)track->node * TW_LANE_TRS + first_rows[track->path]);
  }
}

/* ---- sixteen poses: world matrices --------------------------------------------------------------------- */

/* out = parent x local, of a transform: quat.h's matrix of the rotation, its columns scaled. Products are
 * what this costs: a scale that is known to be 1 saves a seventh of them. */
static inline __attribute__((always_inline)) void multiply_trs(const lane_row *restrict parent,
                                                               const lane_row *restrict trs, bool is_scaled,
                                                               lane_row *restrict out) {
  for (int lane = 0; lane < TW_LANES; lane++) {
    const float q[4] = {trs[3].at[lane], trs[4].at[lane], trs[5].at[lane], trs[6].at[lane]};
    float m[9];
    quat_matrix(q, m);
    for (size_t column = 0; column < 3; column++) {
      float scale = is_scaled ? trs[7 + column].at[lane] : 1;
      float x = m[3 * column] * scale, y = m[3 * column + 1] * scale, z = m[3 * column + 2] * scale;
      for (size_t row = 0; row < 3; row++)
        out[3 * column + row].at[lane] =
            parent[row].at[lane] * x + parent[3 + row].at[lane] * y + parent[6 + row].at[lane] * z;
    }
    for (size_t row = 0; row < 3; row++)
      out[9 + row].at[lane] = parent[row].at[lane] * trs[0].at[lane] +
                              parent[3 + row].at[lane] * trs[1].at[lane] +
                              parent[6 + row].at[lane] * trs[2].at[lane] + parent[9 + row].at[lane];
  }
}

/* out = parent x matrix, the same in every lane. */
static void multiply_matrix(const lane_row *restrict parent, const float matrix[16], lane_row *restrict out) {
  for (size_t column = 0; column < 4; column++)
    for (size_t row = 0; row < 3; row++)
      for (int lane = 0; lane < TW_LANES; lane++) {
        const float *factors = matrix + 4 * column;
        float sum = parent[row].at[lane] * factors[0] + parent[3 + row].at[lane] * factors[1] +
                    parent[6 + row].at[lane] * factors[2];
        out[3 * column + row].at[lane] = column < 3 ? sum : sum + parent[9 + row].at[lane];
      }
}

/* Whether transforms that the clip made may have a scale other than 1. */
static bool may_scale(const tw_clip *clip, const tw_node *node, uint32_t index) {
  const float *rest = node->rest.scale;
  return !clip || clip->moves[index] & 1u << TW_SCALE || rest[0] != 1 || rest[1] != 1 || rest[2] != 1;
}

static inline __attribute__((always_inline)) void world_matrices(const tw_clip *clip, const tw_node *nodes,
                                                                 const uint32_t *order, uint32_t node_count,
                                                                 const lane_row *locals, lane_row *world) {
  lane_row identity[TW_LANE_MATRIX] = {{{0}}};
  for (size_t i = 0; i < 3; i++)
    for (int lane = 0; lane < TW_LANES; lane++) identity[4 * i].at[lane] = 1;
  for (uint32_t i = 0; i < node_count; i++) {
    const tw_node *node = &nodes[order[i]];
    const lane_row *parent =
        node->parent == TW_NO_INDEX ? identity : world + (size_t)node->parent * TW_LANE_MATRIX;
    const lane_row *trs = locals + (size_t)order[i] * TW_LANE_TRS;
    lane_row *out = world + (size_t)order[i] * TW_LANE_MATRIX;
    if (node->has_matrix && !(clip && tw_clip_moves(clip, order[i])))
      multiply_matrix(parent, node->matrix, out);
    else if (may_scale(clip, node, order[i]))
      multiply_trs(parent, trs, true, out);
    else
      multiply_trs(parent, trs, false, out);
  }
}

typedef void world_kernel(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                          uint32_t node_count, const lane_row *locals, lane_row *world);

static void world_matrices_baseline(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                                    uint32_t node_count, const lane_row *locals, lane_row *world) {
  world_matrices(clip, nodes, order, node_count, locals, world);
}

#ifdef __x86_64__
static __attribute__((target("avx2"))) void world_matrices_avx2(const tw_clip *clip, const tw_node *nodes,
                                                                const uint32_t *order, uint32_t node_count,
                                                                const lane_row *locals, lane_row *world) {
  world_matrices(clip, nodes, order, node_count, locals, world);
}
#endif

void tw_lanes_world(const tw_clip *clip, const tw_node *nodes, const uint32_t *order, uint32_t node_count,
                    const float *locals, float *world) {
  world_kernel *kernel = world_matrices_baseline;
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) kernel = world_matrices_avx2;
#endif
  kernel(clip, nodes, order, node_count, (const lane_row *)locals, (lane_row *)world);
}

void tw_lanes_matrix(const float *world, uint32_t node, uint32_t lane, float out[16]) {
  const lane_row *rows = (const lane_row *)world + (size_t)node * TW_LANE_MATRIX;
  for (int column = 0; column < 4; column++) {
    for (int row = 0; row < 3; row++) out[4 * column + row] = rows[3 * column + row].at[lane];
    out[4 * column + 3] = column < 3 ? 0 : 1;
  }
}
