/* A surface while it is made: what the files that make it share. */
#ifndef TWEEND_SURFACE_PLAN_H
#define TWEEND_SURFACE_PLAN_H

#include "cage.h"
#include "surface.h"

typedef struct tw_build {
  const tw_mesh *mesh;
  tw_surface *surface;
  const tw_parallel_for *parallel;
  tw_arena *arena;        /* until the surface is made */
  tw_arena *points_arena; /* the cage, and the points' topologies between it and the base */
  tw_cage cage;
  uint32_t levels;                            /* from the cage to the base */
  bool whole;                                 /* the answer holds all faces in the order of the cage */
  bool morph_normals;                         /* targets displace normals */
  bool too_irregular;                         /* patches gave up */
  tw_topology topologies[1 + TW_UV_SETS_MAX]; /* of each field at the level that is made last */
  uint32_t cage_vertices[1 + TW_UV_SETS_MAX]; /* of each field */
  uint32_t *source;                           /* [faces] cage face of each; NULL where all are whole */
} tw_build;

static inline tw_rules tw_build_rules(const tw_build *b, uint32_t field) {
  tw_rules rules = b->surface->rules;
  rules.linear = b->surface->fields[field].linear;
  return rules;
}

/* Tangents are for normal maps, which need normals and UVs. */
static inline bool tw_build_has_tangents(const tw_build *b) {
  return b->mesh->has_tangents && b->mesh->uv_set_count > 0 && b->surface->options.normals;
}

/* Decides by what rows are computed, and how many levels lead to the base. generic: by steps alone, which
 * TW_LIMIT says there are too many faces for. TW_NO_MEMORY. */
tw_status tw_build_choose(tw_build *b, bool generic, tw_error *error);

/* Makes the base: the topologies, and all values at its vertices but positions. TW_NO_MEMORY, TW_CANCELLED.
 */
tw_status tw_build_base(tw_build *b);

/* Goes on from the base to all points of TW_WAY_LEVELS but positions, and numbers them. Errors likewise. */
tw_status tw_build_levels(tw_build *b);

/* Numbers the rows of a surface that has its base, and its faces' order. Errors likewise. */
tw_status tw_build_number(tw_build *b);

/* Finds how the base's faces bear tangents, where rows have some. TW_NO_MEMORY. */
tw_status tw_build_find_frames(tw_build *b);

/* Says what the rows of vertices hold. */
void tw_build_lay_out(tw_build *b);

/* A surface that lacks its positions. generic: as for tw_build_choose. *too_irregular: patches were tried,
 * and gave up. */
tw_status tw_build_plan(const tw_mesh *mesh, const tw_surface_options *options,
                        const tw_parallel_for *parallel, bool generic, tw_surface **out, bool *too_irregular,
                        tw_error *error);

#endif
