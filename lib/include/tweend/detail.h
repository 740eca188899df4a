/* Modelling onto the levels of a surface. */
#ifndef TWEEND_DETAIL_H
#define TWEEND_DETAIL_H

#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

/* For points that come from another space than the mesh's: takes them back where they lie. now: [rows][3],
 * the surface's points as they are, which those that have not moved become again. */
typedef struct tw_points_back {
  void (*take)(void *context, const float *now, uint32_t rows);
  void *context;
} tw_points_back;

/* A view of a mesh whose surface at options->level has these points. How they differ from the surface as it
 * is goes into the mesh's detail of that level, at level 0 into its positions; deeper details keep their
 * offsets, but for what it takes to meet the points. Points that are where they were keep what they had, to
 * the last bit, where no deeper level has a detail. positions: [rows][3] of TW_DOMAIN_POINTS of the surface
 * that is made of the mesh by the same options. back: NULL, or called once before they are read. Arrays of
 * the result live in the arena, or are the mesh's. parallel: as for tw_surface_create_by. O(points of the
 * level and of the deepest one with a detail). Errors as of tw_surface_create_by; TW_INVALID with an open
 * border, with pointer "/positions/7/1" where a coordinate is not finite or over TW_COORDINATE_MAX, with
 * "/positions/7" where a point is too far from the surface; TW_LIMIT of a level of over 16,777,216 faces. */
tw_status tw_mesh_sculpt(const tw_mesh *mesh, const tw_surface_options *options, const float *positions,
                         const tw_points_back *back, const tw_parallel_for *parallel, tw_arena *arena,
                         tw_mesh *out, tw_error *error);

/* Whether the details of a checked mesh are of its levels, by Catmull and Clark's scheme or, of triangles, by
 * Loop's. TW_INVALID or TW_LIMIT, pointer "/details/0"; TW_NO_MEMORY. O(corners). */
tw_status tw_mesh_check_details(const tw_mesh *mesh, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
