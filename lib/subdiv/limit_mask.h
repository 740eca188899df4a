/* A limit mask on its way: the vertex with its neighbours. Private to limit.c, limit_decay.c and
 * loop_limit.c. */
#ifndef TWEEND_LIMIT_MASK_H
#define TWEEND_LIMIT_MASK_H

#include "limit.h"

/* Entry 0 is the vertex itself, then come its ring and, among quads, the far corners of its fan. */
typedef struct tw_limit_neighbours {
  const tw_topology *t;
  uint32_t vertex, ring_count, fan_count;
  tw_limit_entry *entries;
} tw_limit_neighbours;

static inline tw_limit_entry *tw_ring_entry(const tw_limit_neighbours *n, uint32_t i) {
  return &n->entries[1 + i % n->ring_count];
}

static inline tw_limit_entry *tw_fan_entry(const tw_limit_neighbours *n, uint32_t i) {
  return &n->entries[1 + n->ring_count + i % n->fan_count];
}

static inline float tw_ring_sharpness(const tw_limit_neighbours *n, uint32_t i) {
  return n->t->edge_sharpness[n->t->ring_edges[n->t->ring_offsets[n->vertex] + i % n->ring_count]];
}

/* Carries tangents of the vertex after all decay back to the neighbours that there are now. */
void tw_limit_settle(const tw_limit_neighbours *neighbours);

/* Loop's masks: position and tangents at smooth vertices, and the tangent across a crease that bounds
 * `faces` faces, two at least, and begins at ring edge `first`. Entries must be zero. */
void tw_loop_limit_smooth(const tw_limit_neighbours *neighbours);
void tw_loop_tangents_smooth(const tw_limit_neighbours *neighbours);
void tw_loop_tangents_across(const tw_limit_neighbours *neighbours, uint32_t first, uint32_t faces);

#endif
