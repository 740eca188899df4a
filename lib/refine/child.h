/* The part of a refined mesh's connectivity that all schemes share (V: the parent's vertex count):
 * vertices: 0.. for vertices, V.. for the middles of edges;
 * edges:    2e and 2e + 1, the halves of edge e at its first and at its second end;
 * corners:  4c at the vertex of corner c, along the half of its edge. */
#ifndef TWEEND_CHILD_H
#define TWEEND_CHILD_H

#include "crease.h"
#include "parallel_for.h"

/* One term of a mask: the weight of a parent's vertex or, from vertex_count + edge_count on, of the child's
 * vertex of that number, which is a face point. */
typedef struct tw_share {
  uint32_t vertex;
  float weight;
} tw_share;

/* Writes the child's fans and rings, which follow from the parent's without sorting or walking. They are
 * written vertex by vertex, starting at any vertex whose offsets are known. */
typedef struct tw_child_fans {
  const tw_topology *parent;
  tw_topology *child;
  uint32_t corners, edges; /* next places to write in fan_corners and ring_edges */
} tw_child_fans;

static inline void tw_put_corner(tw_child_fans *fans, uint32_t corner) {
  fans->child->fan_corners[fans->corners++] = corner;
}
static inline void tw_put_edge(tw_child_fans *fans, uint32_t edge) {
  fans->child->ring_edges[fans->edges++] = edge;
}

/* Sets the counts and the face size of a child. TW_LIMIT over 32 bits. */
tw_status tw_child_count(tw_topology *child, uint64_t vertices, uint64_t edges, uint64_t faces,
                         uint32_t face_size);

/* The scheme's own part of a step. The loops get this struct as their context. */
typedef struct tw_child_step {
  const tw_topology *parent;
  tw_topology *child;                    /* its counts and face size are set */
  uint32_t middle_corners, middle_edges; /* corners and edges at the middle of an edge, for each face of the
                                            edge; the two halves of the edge come on top */
  tw_parallel_for_body *split_faces;     /* writes corners and edges of the children of faces */
  void (*link_edge)(tw_child_fans *fans, uint32_t edge); /* puts the fan and ring of an edge's middle */
  tw_parallel_for_body *link_faces; /* writes the fans of face points; NULL: the scheme has none */
} tw_child_step;

static inline tw_child_fans tw_start_fans(const tw_child_step *step, uint32_t vertex) {
  return (tw_child_fans){step->parent, step->child, step->child->fan_offsets[vertex],
                         step->child->ring_offsets[vertex]};
}

/* Makes the child's connectivity and sharpness. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_child_make(const tw_child_step *step, const tw_rules *rules, tw_arena *arena,
                        const tw_parallel_for *parallel);

#endif
