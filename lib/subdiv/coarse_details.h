/* The detail by which a cage that was found again has the surface that it was found in. */
#ifndef TWEEND_COARSE_DETAILS_H
#define TWEEND_COARSE_DETAILS_H

#include "coarse_faces.h"
#include "parallel_for.h"
#include "tweend/subdiv.h"

/* Which corner of the mesh is which corner of its cage's surface. After n steps back the cage so far, refined
 * n times, has as many corners as the mesh, in another order: *out[c] is the corner of the mesh that corner c
 * of that level is. Called after each step: `child` is what the step began with (the mesh at the first),
 * `parents` the faces that it found, `levels` the number of steps before, `before` what *out was after them
 * (NULL at the first). Lives in the arena, 4 bytes a corner of the mesh. O(corners of the mesh).
 * TW_NO_MEMORY. */
tw_status tw_coarse_corners(const tw_topology *child, const tw_coarse_faces *parents, const uint32_t *before,
                            uint32_t levels, tw_arena *arena, const uint32_t **out);

/* Adds a detail of options->level to the cage that puts each vertex of that level where the refined mesh has
 * it. corners: as of tw_coarse_corners. Lives in the arena. TW_INVALID: a point is too far from the surface;
 * TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_coarse_detail(const tw_mesh *refined, const uint32_t *corners, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_arena *arena, tw_mesh *cage, tw_error *error);

#endif
