/* Recovers quads from the triangles that an exporter split them into. */
#ifndef TWEEND_QUAD_PAIRING_H
#define TWEEND_QUAD_PAIRING_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Joins triangles that an exporter split quads into, where enough neighbours in the file look like split
 * rectangles:
 * 1. Triangles that follow one another in the file and share an edge in the pattern that most such pairs
 *    have. The quad's shape does not matter unless it is folded over; several such pairs in a row are a fan
 *    round a point, not quads.
 * 2. Other triangles that follow one another, where they make a convex quad that is nearly flat and split
 *    along its diagonal. Where a triangle could pair with the one before or the one after, the sum of the
 *    quads' quality decides.
 * 3. Where few triangles are left, triangles with a common edge, the best quad first.
 * Never joins across materials, seams of UVs or attributes, or edges where normals differ; where only angles
 * tell hard edges (angles_tell), not across one bent by TW_HARD_DEGREES either. Replaces the mesh's faces by
 * arrays in the arena. Only for meshes without tags, named groups, smoothing groups and tangent_uvs.
 * O(n log n). */
tw_status tw_pair_triangles(tw_mesh *mesh, tw_arena *arena, tw_error *error);

/* How good a quad two triangles make: 1 for a flat rectangle. 0 where they share no whole edge, where the
 * edge has to stay (it parts materials, UVs, attributes or normals), or where the quad is not convex or is
 * bent by more than 60 degrees. quad: the quad's four corners of the mesh. */
double tw_pair_quality(const tw_mesh *mesh, uint32_t face, uint32_t other, uint32_t quad[4]);

/* The most bytes that tw_pair_triangles allocates, those in the arena included. */
size_t tw_pair_size(const tw_mesh *mesh);

#ifdef __cplusplus
}
#endif
#endif
