/* Node hierarchies: their order, world matrices, joint matrices. */
#include "clip.h"

#include <stdlib.h>
#include <string.h>

/* Finds a node that is its own ancestor. `start` is a node from which no root is reached. */
static uint32_t node_on_cycle(const tw_node *nodes, uint32_t node_count, uint32_t start) {
  for (uint32_t i = 0; i < node_count; i++) start = nodes[start].parent;
  return start;
}

static tw_status check_parents(const tw_node *nodes, uint32_t node_count, tw_error *error) {
  for (uint32_t i = 0; i < node_count; i++)
    if (nodes[i].parent != TW_NO_INDEX && nodes[i].parent >= node_count) {
      tw_fail(error, TW_INVALID, "node %u has parent %u, but there %s %u %s", i, nodes[i].parent,
              tw_plural(node_count, "is", "are"), node_count, tw_plural(node_count, "node", "nodes"));
      return tw_error_at(error, "/nodes/%u/parent", i);
    }
  return TW_OK;
}

/* Walks breadth first from the roots; `order` is the queue itself. Returns how many nodes it reached. */
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
  tw_free(links);
  tw_free(reached_order);
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

double tw_matrix_cofactors(const float m[16], double out[9]) {
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) {
      int c1 = 4 * ((column + 1) % 3), c2 = 4 * ((column + 2) % 3), r1 = (row + 1) % 3, r2 = (row + 2) % 3;
      out[3 * column + row] =
          (double)m[c1 + r1] * (double)m[c2 + r2] - (double)m[c1 + r2] * (double)m[c2 + r1];
    }
  return (double)m[0] * out[0] + (double)m[1] * out[1] + (double)m[2] * out[2];
}

void tw_skin_matrices(const tw_skin *skin, const float *world, float *out) {
  for (uint32_t i = 0; i < skin->joint_count; i++)
    tw_matrix_multiply(world + 16 * (size_t)skin->joints[i], skin->inverse_bind + 16 * (size_t)i,
                       out + 16 * (size_t)i);
}
