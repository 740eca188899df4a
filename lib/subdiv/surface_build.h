/* A surface on its way from the mesh to what can be read: private to the files that build it. */
#ifndef TWEEND_SURFACE_BUILD_H
#define TWEEND_SURFACE_BUILD_H

#include "cage.h"
#include "surface.h"

/* What only the next level needs lives in `arena`. */
typedef struct tw_build {
  const tw_mesh *mesh;
  tw_surface *surface;
  const tw_parallel_for *parallel;
  tw_rules rules;
  tw_arena *arena;
  tw_arena *points_arena; /* the cage, and the points' topologies between it and the base */
  tw_cage cage;
  uint32_t levels;    /* from the cage to the base */
  bool whole;         /* the answer holds all faces in the order of the cage */
  bool too_irregular; /* patches gave up */
  tw_topology topologies[1 + TW_UV_SETS_MAX];
  uint32_t *source; /* [faces] cage face of each face */
} tw_build;

static inline bool tw_build_is_loop(const tw_build *b) {
  return b->surface->options.scheme == TW_LOOP;
}

static inline tw_rules tw_build_rules(const tw_build *b, uint32_t field) {
  tw_rules rules = b->rules;
  rules.linear = b->surface->fields[field].linear;
  return rules;
}

/* A copy of rows of `size` bytes, of those at `indices` (NULL: of the first `count`). NULL without memory. */
void *tw_build_gather(tw_arena *arena, const void *in, const uint32_t *indices, uint32_t count, size_t size);

/* Decides how the levels are shared out: how many of them generic steps make, and what makes the rest.
 * generic: no patches. */
tw_status tw_build_choose(tw_build *b, bool generic, tw_error *error);

/* All values at the cage; where rows are made of that, its topology alone. */
tw_status tw_build_start(tw_build *b);

/* One level of everything; what the next level needs goes to `arena`, the surface's own at the last. */
tw_status tw_build_refine(tw_build *b, tw_arena *arena);

/* Tangents are for normal maps, which need normals and UVs. */
static inline bool tw_build_has_tangents(const tw_build *b) {
  return b->mesh->has_tangents && b->mesh->uv_set_count > 0 && b->surface->options.normals;
}

/* Of the faces of the topologies at hand. uvs: values of each set. */
tw_status tw_build_find_frames(tw_build *b, const float *const uvs[]);

/* Numbers the base's rows. cage_vertices: [fields] of the cage. */
tw_status tw_build_number(tw_build *b, const uint32_t *cage_vertices);

/* What stands where in a row of the answer. */
void tw_build_lay_out(tw_build *b);

#endif
