/* The connectivity of a refined mesh, as far as all schemes agree on it (V, E the parent's counts):
 * vertices: 0.. of vertices, V.. of the middles of edges;
 * edges:    2e and 2e + 1, the halves of edge e at its first and at its second end;
 * corners:  4c at the vertex of corner c, along the half of its edge. */
#ifndef TWEEND_CHILD_H
#define TWEEND_CHILD_H

#include "crease.h"
#include "parallel_for.h"

/* A share of one of the parent's vertices or, from vertex_count + edge_count on, of the child's vertex of
 * that number, which is a face point. */
typedef struct tw_share {
  uint32_t vertex;
  float weight;
} tw_share;

/* Fans and rings of the child follow from the parent's, so that nothing has to be sorted or walked: they
 * are written vertex by vertex, from any on whose places are known. */
typedef struct tw_child_fans {
  const tw_topology *parent;
  tw_topology *child;
  uint32_t corners, edges; /* next places */
} tw_child_fans;

static inline void tw_put_corner(tw_child_fans *fans, uint32_t corner) {
  fans->child->fan_corners[fans->corners++] = corner;
}
static inline void tw_put_edge(tw_child_fans *fans, uint32_t edge) {
  fans->child->ring_edges[fans->edges++] = edge;
}

/* Sets the counts of a child, and its face size. TW_LIMIT over 32 bits. */
tw_status tw_child_count(tw_topology *child, uint64_t vertices, uint64_t edges, uint64_t faces,
                         uint32_t face_size);

/* What a scheme adds. Its loops get the step as their context. */
typedef struct tw_child_step {
  const tw_topology *parent;
  tw_topology *child;                    /* its counts and face size are set */
  uint32_t middle_corners, middle_edges; /* that the middle of an edge has for each face there; and two
                                            edges more, the halves */
  tw_parallel_for_body *split_faces;     /* corners and edges of the children of faces */
  void (*link_edge)(tw_child_fans *fans, uint32_t edge); /* puts those of an edge's middle */
  tw_parallel_for_body *link_faces;                      /* fans of face points; NULL: there are none */
} tw_child_step;

static inline tw_child_fans tw_start_fans(const tw_child_step *step, uint32_t vertex) {
  return (tw_child_fans){step->parent, step->child, step->child->fan_offsets[vertex],
                         step->child->ring_offsets[vertex]};
}

/* Makes the child. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_child_make(const tw_child_step *step, const tw_rules *rules, tw_arena *arena,
                        const tw_parallel_for *parallel);

#endif
