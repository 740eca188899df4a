/* The textbook's border: new points only where every parent exists, so that an open mesh shrinks by the
 * faces that touch its border. A 4 x 4 grid of points becomes 9 + 12 + 4 = 25. */
#ifndef TWEEND_OPEN_H
#define TWEEND_OPEN_H

#include "topology.h"
#include "tweend/subdiv.h"

/* Quads of a refined mesh whose parents all exist: those at an inner vertex of the parent.
 * *quads: [returned count], in the arena; NULL without memory. */
uint32_t tw_open_quads(const tw_topology *parent, tw_arena *arena, uint32_t **quads);

/* A mesh of some quads of another, with their sharpness; new borders are sharp. *vertices:
 * [out->vertex_count], the vertex of `full` that each was. */
tw_status tw_open_cut(const tw_topology *full, const uint32_t *quads, uint32_t quad_count, tw_arena *arena,
                      tw_topology *out, uint32_t **vertices);

/* Counts at `level` (1 or more) in closed form from the mesh at level 1. */
tw_surface_counts tw_open_count(const tw_topology *first, uint32_t level);

#endif
