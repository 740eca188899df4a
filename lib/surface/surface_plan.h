/* The state of a surface while it is made, shared by the files that make it. */
#ifndef TWEEND_SURFACE_PLAN_H
#define TWEEND_SURFACE_PLAN_H

#include "cage.h"
#include "evaluator.h"
#include "surface.h"

typedef struct tw_surface_builder {
  const tw_mesh *mesh;
  tw_surface *surface;
  const tw_parallel_for *parallel;
  tw_arena *arena; /* scratch, freed when the surface is made */
  /* Holds the cage and the points' topologies between it and the base; becomes the surface's. */
  tw_arena *points_arena;
  tw_cage cage;
  uint32_t levels;      /* generic steps from the cage to the base */
  bool keeps_all_faces; /* the answer has all faces in the order of the cage */
  bool morph_normals;   /* the answer has targets that displace normals */
  uint32_t preference;  /* the first entry of the table of evaluators to try; then the one that was chosen */
  bool long_lists;      /* of shallow levels: lists of exceptions may be long */
  bool declined;        /* the evaluator returned TW_LIMIT; the next one can be tried */
  tw_topology topologies[TW_FIELDS_MAX]; /* of each field, at the level that was made last */
  uint32_t cage_vertices[TW_FIELDS_MAX]; /* vertex count of each field at the cage */
  uint32_t channel_count;
  tw_channel channels[TW_CHANNELS_MAX];     /* of the mesh: UV sets, then attributes */
  uint32_t channel_fields[TW_CHANNELS_MAX]; /* the field of each; several can share one */
  bool has_whole_numbers;                   /* an attribute of whole numbers */
  uint32_t *point_order; /* [point_order_count] vertices of the base in the order of the points; NULL: as they
                            are */
  uint32_t point_order_count;
  /* [faces of the last level] cage face of each; NULL where it keeps_all_faces. */
  uint32_t *source;
  /* Of an open border whose answer is made in two parts (surface_rim.c): */
  bool has_rim;                           /* this is the inner part */
  const struct tw_surface_builder *inner; /* of the rim's builder: the inner part's; else NULL */
  uint8_t *part;     /* [faces of the base] flags of those that the part shows; NULL: all can be shown */
  uint64_t *origins; /* [faces of the last level] of the rim: tw_rim_cut */
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

/* Chooses the evaluator and the number of generic steps to the base. TW_LIMIT when the answer has too many
 * faces for generic steps. TW_NO_MEMORY. */
tw_status tw_builder_choose(tw_surface_builder *b, tw_error *error);

/* Whether the border is open and shrinks the answer. */
static inline bool tw_builder_shrinks(const tw_surface_builder *b) {
  return tw_cage_shrinks(&b->cage, &b->surface->options);
}

/* Whether the cage can be the base: it has triangles for Loop's scheme, else quads of four different vertices
 * each. A quad with a vertex twice is refined once, which makes quads of four vertices. */
bool tw_builder_cage_is_base(const tw_surface_builder *b);

/* Whether values of corners depend on sharpness across seams, by Chaikin's rule: patches and triangles do not
 * see it. */
bool tw_builder_crosses_seams(const tw_surface_builder *b);

/* Makes the base: the topologies, and all values at its vertices except positions. TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_builder_base(tw_surface_builder *b);

/* ---- the rim of an open border: surface_rim.c ------------------------------------------------- */

/* Whether an answer that shrinks from an open border is so large that it is made in two parts. */
bool tw_rim_is_worth_it(const tw_surface_builder *b);

/* Marks the faces of the base that the part shows. TW_NO_MEMORY. */
tw_status tw_rim_part(tw_surface_builder *b);

/* Of the rim's builder, when it has made a level: */

/* Finds which faces are the rim's, at the level that is the inner part's base. TW_NO_MEMORY. */
tw_status tw_rim_begin(tw_surface_builder *b);

/* Flags of the vertices of the rim's faces at a level: [vertex_count], in b->arena; NULL without memory. */
uint8_t *tw_rim_vertices(const tw_surface_builder *b, const tw_topology *level);

/* Gives the faces of the next level their origins. faces: [face_count] those that are left, in the numbers of
 * all children. TW_NO_MEMORY. */
tw_status tw_rim_cut(tw_surface_builder *b, const uint32_t *faces, uint32_t face_count);

/* Numbers the rim's rows after those of the inner part, which have the rows where both meet. TW_NO_MEMORY. */
tw_status tw_rim_number(tw_surface_builder *b);

/* Makes the groups of the answer of those of its two parts. TW_NO_MEMORY. */
tw_status tw_rim_join_groups(tw_surface *s);

/* Numbers the rows of a surface that has its base and the order of its faces. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_builder_number(tw_surface_builder *b);

/* Sets the tangent frames of the base's faces, where rows have tangents. TW_NO_MEMORY. */
tw_status tw_builder_find_frames(tw_surface_builder *b);

/* Makes room for the limit masks of a topology's vertices. */
void tw_builder_need_masks(tw_surface *s, const tw_topology *t);

/* Fails as there is no such surface: `error` says that thousands of faces meet in a point. */
tw_status tw_builder_fail_fans(tw_error *error);

/* Sets the layout of the rows of TW_DOMAIN_VERTICES. TW_NO_MEMORY. */
tw_status tw_builder_lay_out(tw_surface_builder *b);

#endif
