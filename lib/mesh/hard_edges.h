/* Finds the edges that a file means to be hard, from its normals, its smoothing groups, or the angle between
 * faces. */
#ifndef TWEEND_HARD_EDGES_H
#define TWEEND_HARD_EDGES_H

#include "topology.h"

/* Counts the hard edges that each method finds. topology: built from the mesh's own points and corners;
 * tw_topology_pair is enough. TW_NO_MEMORY. */
tw_status tw_hard_edges_count(const tw_mesh *mesh, const tw_topology *topology, tw_hard_edge_counts *out);

/* Whether the file gives two corners normals that differ by over half a degree. */
bool tw_corners_part(const tw_mesh *mesh, uint32_t a, uint32_t b);

/* The unit normal of a face by Newell's method; 0 0 0 for a face without area. */
void tw_mesh_face_normal(const tw_mesh *mesh, uint32_t face, double out[3]);

#endif
