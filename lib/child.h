/* The connectivity of a refined mesh, as far as all schemes agree on it (V, E the parent's counts):
 * vertices: 0.. of vertices, V.. of the middles of edges;
 * edges:    2e and 2e + 1, the halves of edge e at its first and at its second end;
 * corners:  4c at the vertex of corner c, along the half of its edge. */
#ifndef TWEEND_CHILD_H
#define TWEEND_CHILD_H

#include "topology.h"

/* Allocates all arrays of a child whose counts and face size are set. TW_NO_MEMORY. */
tw_status tw_child_allocate(tw_topology *child, tw_arena *arena);

/* Fills the halves of edges, and joins the corners along them into rings. */
void tw_child_split_edges(const tw_topology *parent, tw_topology *child);

/* Fans and rings of the child follow from the parent's, so that nothing has to be sorted or walked: they
 * are written vertex by vertex. */
typedef struct tw_child_fans {
  const tw_topology *parent;
  tw_topology *child;
  uint32_t corners, edges; /* written so far */
} tw_child_fans;

static inline void tw_put_corner(tw_child_fans *fans, uint32_t corner) {
  fans->child->fan_corners[fans->corners++] = corner;
}
static inline void tw_put_edge(tw_child_fans *fans, uint32_t edge) {
  fans->child->ring_edges[fans->edges++] = edge;
}
static inline void tw_end_fan(tw_child_fans *fans, uint32_t vertex, uint8_t flags) {
  fans->child->fan_offsets[vertex + 1] = fans->corners;
  fans->child->ring_offsets[vertex + 1] = fans->edges;
  fans->child->vertex_flags[vertex] = flags;
}

/* Flags of the vertex in the middle of an edge. */
static inline uint8_t tw_middle_flags(uint8_t edge_flags) {
  if (edge_flags & TW_EDGE_NONMANIFOLD) return TW_VERTEX_NONMANIFOLD;
  return edge_flags & TW_EDGE_BORDER ? TW_VERTEX_BORDER : 0;
}

/* Begins with the fans of the parent's vertices. */
tw_child_fans tw_child_link_vertices(const tw_topology *parent, tw_topology *child);

#endif
