/* What a cage that was found again cannot say by itself. */
#ifndef TWEEND_COARSE_DETAILS_H
#define TWEEND_COARSE_DETAILS_H

#include "coarse_faces.h"
#include "parallel_for.h"
#include "tweend/subdiv.h"

/* Which corner of a refined mesh each corner of a cage's level is, that is refined step by step. One more
 * step back: before: [corners of the refined mesh] as of the levels above it, NULL for the mesh itself;
 * child: the topology that the step takes back, parents: faces of that. *levels: of `before`; grows by one.
 * Lives in the arena. TW_NO_MEMORY. */
tw_status tw_coarse_corners(const tw_topology *child, const tw_coarse_faces *parents, const uint32_t *before,
                            uint32_t levels, tw_arena *arena, const uint32_t **out);

/* Adds a detail of options->level to the cage that puts each vertex of that level where the refined mesh has
 * it. corners: as of tw_coarse_corners. Lives in the arena. TW_INVALID: a point is too far from the surface;
 * TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_coarse_detail(const tw_mesh *refined, const uint32_t *corners, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_arena *arena, tw_mesh *cage, tw_error *error);

#endif
