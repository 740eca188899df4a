/* The state of a surface while it is made, shared by the files that make it. */
#ifndef TWEEND_SURFACE_PLAN_H
#define TWEEND_SURFACE_PLAN_H

#include "cage.h"
#include "surface.h"

/* The methods that a plan may use. */
typedef enum tw_attempt {
  TW_TRY_ALL,
  TW_TRY_WITHOUT_LEVELS,
  TW_TRY_LARGE_LEVELS, /* as TW_TRY_ALL, with long lists of exceptions */
  TW_TRY_STEPS         /* generic steps all the way to the answer */
} tw_attempt;

typedef struct tw_surface_builder {
  const tw_mesh *mesh;
  tw_surface *surface;
  const tw_parallel_for *parallel;
  tw_arena *arena; /* scratch, freed when the surface is made */
  /* Holds the cage and the points' topologies between it and the base; becomes the surface's. */
  tw_arena *points_arena;
  tw_cage cage;
  uint32_t levels;    /* generic steps from the cage to the base */
  bool whole;         /* the answer has all faces in the order of the cage */
  bool morph_normals; /* the answer has targets that displace normals */
  tw_attempt attempt;
  tw_attempt next;                       /* what to try where the method chosen returned TW_LIMIT */
  tw_topology topologies[TW_FIELDS_MAX]; /* of each field, at the level that was made last */
  uint32_t cage_vertices[TW_FIELDS_MAX]; /* vertex count of each field at the cage */
  uint32_t channel_count;
  tw_channel channels[TW_CHANNELS_MAX];     /* of the mesh: UV sets, then attributes */
  uint32_t channel_fields[TW_CHANNELS_MAX]; /* the field of each; several can share one */
  bool has_whole;                           /* an attribute of whole numbers */
  uint32_t *point_order; /* [point_order_count] vertices of the base in the order of the points; NULL: as they
                            are */
  uint32_t point_order_count;
  /* [faces of the last level] cage face of each; NULL where `whole`. */
  uint32_t *source;
} tw_surface_builder;

static inline tw_rules tw_builder_rules(const tw_surface_builder *b, uint32_t field) {
  tw_rules rules = b->surface->rules;
  rules.linear = b->surface->fields[field].linear;
  return rules;
}

/* Tangents are for normal maps, which need normals and UVs. */
static inline bool tw_builder_has_tangents(const tw_surface_builder *b) {
  return b->mesh->has_tangents && b->mesh->uv_set_count > 0 && b->surface->options.normals;
}

/* Chooses the method (tw_way) and the number of generic steps to the base. TW_LIMIT when the answer has too
 * many faces for TW_TRY_STEPS. TW_NO_MEMORY. */
tw_status tw_builder_choose(tw_surface_builder *b, tw_error *error);

/* Makes the base: the topologies, and all values at its vertices except positions. TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_builder_base(tw_surface_builder *b);

/* TW_WAY_LEVELS: computes the values of all points of the level from the base, except positions, and numbers
 * them. TW_LIMIT as tw_shallow_plan, TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_builder_levels(tw_surface_builder *b, bool *is_large);

/* Numbers the rows of a surface that has its base and the order of its faces. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_builder_number(tw_surface_builder *b);

/* Sets the tangent frames of the base's faces, where rows have tangents. TW_NO_MEMORY. */
tw_status tw_builder_find_frames(tw_surface_builder *b);

/* Sets the layout of the rows of TW_DOMAIN_VERTICES. */
void tw_builder_lay_out(tw_surface_builder *b);

#endif
