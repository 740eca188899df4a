/* A control mesh made ready for subdivision: connectivity, sharpness, and which faces are answered. */
#ifndef TWEEND_CAGE_H
#define TWEEND_CAGE_H

#include "crease.h"
#include "tweend/subdiv.h"

/* Most faces that are refined in the generic way to the end, holes included: that takes memory in
 * proportion to them. */
enum { TW_GENERIC_FACES_MAX = 16 << 20 };

/* Arrays live in `arena`. */
typedef struct tw_cage {
  tw_arena *arena;
  tw_topology topology; /* sharpened */
  uint32_t *point_of;   /* [vertices] point of the mesh, ascending; NULL when all points are used */
  uint8_t *visible;     /* [faces] */
  /* At the answer's level, with those that are left out of the answer; set by tw_cage_count. */
  uint64_t refined_faces;
  /* Those of edges and vertices, where options->tagged asks for them: vertices are numbered as in the
   * topology. */
  tw_surface_tags tags;
} tw_cage;

static inline tw_rules tw_rules_of(const tw_surface_options *options) {
  return (tw_rules){.linear = options->scheme == TW_BILINEAR,
                    .chaikin = options->creasing == TW_CREASE_CHAIKIN,
                    .loop = options->scheme == TW_LOOP,
                    .smooth_triangles = options->triangles == TW_TRIANGLES_SMOOTH};
}

static inline bool tw_keeps_tags(const tw_mesh *mesh, const tw_surface_options *options) {
  return options->tagged && options->level == 0 && mesh->hole_count == 0;
}

/* Whether the options fit the mesh at all: level in range, triangles for loop. */
tw_status tw_cage_check_options(const tw_mesh *mesh, const tw_surface_options *options, tw_error *error);

/* Reads a checked mesh. TW_NO_MEMORY. */
tw_status tw_cage_read(const tw_mesh *mesh, const tw_surface_options *options, tw_arena *arena,
                       tw_cage *cage);

/* Whether the border eats into the mesh with every level. */
bool tw_cage_shrinks(const tw_cage *cage, const tw_surface_options *options);

/* Counts of a level with all that is left out of an answer. */
tw_surface_counts tw_cage_counts_at(const tw_cage *cage, bool loop, uint32_t level);

/* Exact counts of the answer, in closed form. */
tw_status tw_cage_count(const tw_surface_options *options, tw_cage *cage, tw_surface_counts *out,
                        tw_error *error);

#endif
