/* Pairs the triangles that an exporter split quads into. */
#ifndef TWEEND_QUAD_PAIRING_H
#define TWEEND_QUAD_PAIRING_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Joins triangles that an exporter split quads into, of a mesh where enough neighbours in the file look like
 * split rectangles:
 * 1. Triangles that follow one another in the file and share an edge in the pattern that most such pairs
 * have, whatever the quad's shape, unless it is folded over, or several of them in a row go round one point
 * (a fan, not quads).
 * 2. Other triangles that follow one another, where they make a convex quad that is nearly flat and split
 *    along its diagonal. Where a triangle could go with the one before or the one behind, the sum of the
 * quads' quality decides.
 * 3. Where few triangles are left, those with an edge in common, the best quad first.
 * Never across materials, UV seams and edges at which normals part. Replaces the mesh's faces by arrays in
 * the arena; only meshes without tags, named groups and a choice of UVs for tangents. O(n log n). */
tw_status tw_pair_triangles(tw_mesh *mesh, tw_arena *arena, tw_error *error);

/* How good a quad two triangles make, up to 1 for a flat rectangle; 0: they share no whole edge, or one that
 * has to stay (of two materials, a UV seam, a hard edge), or the quad is not convex or bent by more than 60
 * degrees. quad: its corners of the mesh. */
double tw_pair_quality(const tw_mesh *mesh, uint32_t face, uint32_t other, uint32_t quad[4]);

/* The most bytes that tw_pair_triangles takes, those of the arena included. */
size_t tw_pair_size(const tw_mesh *mesh);

#ifdef __cplusplus
}
#endif
#endif
