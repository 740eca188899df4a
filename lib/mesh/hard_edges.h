/* Edges that a file means to be hard, by its normals, its smoothing groups, or how they are bent. */
#ifndef TWEEND_HARD_EDGES_H
#define TWEEND_HARD_EDGES_H

#include "topology.h"

/* topology: of the mesh's own points and corners; that of tw_topology_pair is enough. TW_NO_MEMORY. */
tw_status tw_hard_edges_count(const tw_mesh *mesh, const tw_topology *topology, tw_hard_edge_counts *out);

/* Whether the file gives two corners normals that differ by over half a degree. */
bool tw_corners_part(const tw_mesh *mesh, uint32_t a, uint32_t b);

/* The unit normal of a face, by all its corners; 0 0 0 without area. */
void tw_mesh_face_normal(const tw_mesh *mesh, uint32_t face, double out[3]);

#endif
