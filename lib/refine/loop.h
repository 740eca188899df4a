/* One level of Loop's subdivision of a mesh of triangles, with creases.
 *
 * The numbers of a child level follow by arithmetic from those of its parent level (V, E: the parent's
 * counts):
 * vertices: 0.. for vertices, V.. for the middles of edges;
 * faces:    4f + i at corner i of face f, which is also corner i of that child; 4f + 3 in the middle, its
 * corner i opposite to child i;
 * edges:    2e and 2e + 1 for edge e (at its first and second end), 2E + c across the face of corner c,
 * between the middles of the two edges that meet there.
 *
 * Rules: Loop 1987; the masks at creases, corners and borders are those of all schemes (crease.h). */
#ifndef TWEEND_LOOP_H
#define TWEEND_LOOP_H

#include "child.h"

/* Topology and sharpness of the next level. The parent's sharpness must be set. TW_LIMIT, TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_loop_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                           const tw_parallel_for *parallel, tw_topology *child);

/* As tw_refine_mask. */
uint32_t tw_loop_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

/* The weight of each neighbour in the smooth rule at a vertex of this valence. */
double tw_loop_weight(uint32_t valence);

#endif
