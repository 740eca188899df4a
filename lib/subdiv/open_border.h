/* The textbook's border: new points only where every parent exists, so that an open mesh shrinks by the
 * faces that touch its border. A 4 x 4 grid of points becomes 9 + 12 + 4 = 25. */
#ifndef TWEEND_OPEN_H
#define TWEEND_OPEN_H

#include "topology.h"
#include "tweend/subdiv.h"

/* Faces of a refined mesh whose parents all exist: those at an inner vertex of the parent, and of Loop's
 * middle triangles those with no edge on the border. *faces: [returned count], in the arena; NULL without
 * memory. */
uint32_t tw_open_faces(const tw_topology *parent, const tw_topology *child, tw_arena *arena,
                       uint32_t **faces);

/* A mesh of some faces of another, which are all of one size, with their sharpness; new borders are sharp.
 * *vertices: [out->vertex_count], the vertex of `full` that each was. */
tw_status tw_open_cut(const tw_topology *full, const uint32_t *faces, uint32_t face_count, tw_arena *arena,
                      tw_topology *out, uint32_t **vertices);

/* Counts at `level` (1 or more) of what some faces of the mesh at level 1 leave, in closed form. visible:
 * [first->face_count], the same for all children of a face of the cage; NULL: all are. */
tw_surface_counts tw_open_count(const tw_topology *first, const uint8_t *visible, uint32_t level);
tw_surface_counts tw_loop_open_count(const tw_topology *first, const uint8_t *visible, uint32_t level);

/* Counts of some faces of a mesh; visible as above. */
tw_surface_counts tw_count_faces(const tw_topology *topology, const uint8_t *visible);

#endif
