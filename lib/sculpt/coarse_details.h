/* The detail that a coarsened cage needs so that its refined surface equals the mesh it was found in. */
#ifndef TWEEND_COARSE_DETAILS_H
#define TWEEND_COARSE_DETAILS_H

#include "coarse_faces.h"
#include "parallel_for.h"
#include "tweend/subdiv.h"

/* Maps corners of the cage's surface to corners of the mesh. After n steps back the cage refined n times has
 * as many corners as the mesh, in another order: (*out)[c] is the mesh's corner at corner c of that level.
 * Call it after each step. child: the topology that the step began with (the mesh's at the first step);
 * parents: the faces that the step found; levels: the number of steps before; before: *out of the call
 * before, NULL at the first step. *out lives in the arena, 4 bytes a corner of the mesh. O(corners of the
 * mesh). TW_NO_MEMORY. */
tw_status tw_coarse_corners(const tw_topology *child, const tw_coarse_faces *parents, const uint32_t *before,
                            uint32_t levels, tw_arena *arena, const uint32_t **out);

/* Adds a detail of options->level to the cage, which puts each vertex of that level where `refined` has it.
 * corners: from tw_coarse_corners. The detail lives in the arena. TW_INVALID: a point is too far from the
 * surface. TW_LIMIT as tw_detail_level_of; TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_coarse_detail(const tw_mesh *refined, const uint32_t *corners, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_arena *arena, tw_mesh *cage, tw_error *error);

#endif
