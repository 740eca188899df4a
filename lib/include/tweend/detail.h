/* Details: what is modelled onto the levels of a surface. */
#ifndef TWEEND_DETAIL_H
#define TWEEND_DETAIL_H

#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Converts the caller's points, which are in another space, back to the mesh's space, in place. now:
 * [rows][3], the surface's points as they are. Points that have not moved must become exactly these again. */
typedef struct tw_points_back {
  void (*take)(void *context, const float *now, uint32_t rows);
  void *context;
} tw_points_back;

/* Makes a view of a mesh whose surface at options->level has these points. The difference between them and
 * the surface as it is goes into the mesh's detail of that level, or at level 0 into its positions. Deeper
 * details keep their offsets, except for the offsets that must change so that the surface meets the points.
 * Where no deeper level has a detail, points that have not moved keep their values to the last bit.
 * positions: [rows][3] of TW_DOMAIN_POINTS of the surface that the same options make of the mesh. back: NULL,
 * or called once before positions are read. Arrays of the result live in the arena, or are the mesh's.
 * parallel: as for tw_surface_create_by. O(points of the level and of the deepest level with a detail).
 * Errors as of tw_surface_create_by. TW_INVALID also with an open border or TW_BILINEAR; with pointer
 * "/positions/7/1" where a coordinate is not finite or over TW_COORDINATE_MAX; with "/positions/7" where a
 * point is too far from the surface. TW_LIMIT for a level of over 16,777,216 faces. */
tw_status tw_mesh_sculpt(const tw_mesh *mesh, const tw_surface_options *options, const float *positions,
                         const tw_points_back *back, const tw_parallel_for *parallel, tw_arena *arena,
                         tw_mesh *out, tw_error *error);

/* Whether each detail of a checked mesh fits its level as Catmull and Clark's scheme makes it or, for a mesh
 * of triangles, as Loop's does. TW_INVALID or TW_LIMIT, pointer "/details/0"; TW_NO_MEMORY. O(corners). */
tw_status tw_mesh_check_details(const tw_mesh *mesh, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
