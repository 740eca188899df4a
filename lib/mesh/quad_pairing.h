/* Pairs the triangles that an exporter split quads into. */
#ifndef TWEEND_QUAD_PAIRING_H
#define TWEEND_QUAD_PAIRING_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Joins triangles that follow one another in the file, share an edge,
 * its texture coordinates and a material, and make a convex quad that is nearly flat. Where a triangle
 * could go with either neighbour, the sum of the quads' quality decides. Replaces the mesh's faces by
 * arrays in the arena; only meshes without tags, named groups and a choice of UVs for tangents. */
tw_status tw_pair_triangles(tw_mesh *mesh, tw_arena *arena, tw_error *error);

/* The most bytes that it takes, those of the arena included. */
size_t tw_pair_size(const tw_mesh *mesh);

#ifdef __cplusplus
}
#endif
#endif
