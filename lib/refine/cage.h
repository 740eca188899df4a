/* A control mesh made ready for subdivision: connectivity, sharpness, and which faces the answer has. */
#ifndef TWEEND_CAGE_H
#define TWEEND_CAGE_H

#include "crease.h"
#include "tweend/subdiv.h"

/* Most faces, holes included, that generic steps refine all the way to the answer, which takes memory in
 * proportion to the faces. */
enum { TW_GENERIC_FACES_MAX = 16 << 20 };

/* Arrays live in `arena`. */
typedef struct tw_cage {
  tw_arena *arena;
  tw_topology topology; /* sharpened */
  uint32_t *point_of;   /* [vertices] point of the mesh, ascending; NULL when faces use all points */
  uint8_t *visible;     /* [faces] */
  /* Faces at the answer's level, those left out of the answer included; set by tw_cage_count. */
  uint64_t refined_faces;
  /* Tags of edges and vertices (in the topology's numbers), where options->tagged asks for them; `faces` is
   * not set. */
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

/* Gathers the positions of a cage's vertices from those of the mesh's points. point_of: as in tw_cage. out:
 * [vertex_count][3]. */
static inline void tw_cage_gather(const float *positions, const uint32_t *point_of, uint32_t vertex_count,
                                  double *out) {
  for (size_t v = 0; v < vertex_count; v++)
    for (size_t c = 0; c < 3; c++) out[3 * v + c] = (double)positions[3 * (point_of ? point_of[v] : v) + c];
}

/* Whether the mesh shrinks from its border with every level (TW_BOUNDARY_OPEN, and the mesh has a border). */
bool tw_cage_shrinks(const tw_cage *cage, const tw_surface_options *options);

/* Counts of a level, what an answer leaves out included. */
tw_surface_counts tw_cage_counts_at(const tw_cage *cage, bool loop, uint32_t level);

/* Exact counts of the answer, in closed form. TW_LIMIT as tw_surface_count; TW_NO_MEMORY. */
tw_status tw_cage_count(const tw_surface_options *options, tw_cage *cage, tw_surface_counts *out,
                        tw_error *error);

#endif
