/* Details: what is modelled onto levels (Zorin, Schröder and Sweldens 1997). A detail is a set of
 * displacements in local frames of a level, added after the step that makes the level. A surface of a coarser
 * level shows deeper details too: a vertex has the same number on all deeper levels, so it is displaced as
 * far as it is on the deepest level with a detail. */
#ifndef TWEEND_LEVEL_DETAIL_H
#define TWEEND_LEVEL_DETAIL_H

#include "cage.h"
#include "parallel_for.h"

/* Details by ascending level. */
typedef struct tw_detail_list {
  uint32_t count;
  const tw_detail *details;
} tw_detail_list;

static inline uint32_t tw_deepest_detail(const tw_detail_list *list) {
  return list->count > 0 ? list->details[list->count - 1].level : 0;
}

/* The details of levels below `level` in number. */
tw_detail_list tw_coarser_details(const tw_detail_list *list, uint32_t level);

/* Checks that the details fit the cage's levels, as the options refine it: each has one offset a vertex.
 * TW_INVALID, TW_LIMIT; pointer "/details/0". */
tw_status tw_details_check(const tw_detail_list *list, const tw_cage *cage, const tw_surface_options *options,
                           tw_error *error);

/* A level that is being made, to which details may be added. */
typedef struct tw_detail_step {
  const tw_detail_list *list;
  const tw_topology *topology; /* of the level, sharpened */
  const tw_rules *rules;
  uint32_t level;
  uint32_t answer; /* the level that rows are read from */
} tw_detail_step;

/* Adds the level's detail to its positions: [vertices][3] as subdivision made them. At the answer's level the
 * displacements of deeper levels are added too; beyond the answer's level nothing is added. Coordinates are
 * clamped to TW_COORDINATE_MAX. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_details_add(const tw_detail_step *step, const tw_parallel_for *parallel, double *positions);

/* A level of a mesh as subdivision makes it. */
typedef struct tw_detail_level {
  const uint32_t *point_of; /* as in tw_cage */
  tw_topology topology;
  double *positions; /* [vertices][3] */
} tw_detail_level;

/* Refines the mesh to options->level with the details of the levels above, without the level's own. Arrays
 * live in the arena. TW_INVALID with an open border, or details that do not fit; TW_LIMIT over
 * TW_GENERIC_FACES_MAX; TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_detail_level_of(const tw_mesh *mesh, const tw_surface_options *options,
                             const tw_parallel_for *parallel, tw_arena *arena, tw_detail_level *out,
                             tw_error *error);

/* Computes the frames of a level, which outlives it. For one thread: it has room for one mask. */
typedef struct tw_detail_frames tw_detail_frames;
tw_status tw_detail_frames_create(const tw_detail_level *level, const tw_rules *rules, tw_arena *arena,
                                  tw_detail_frames **out);

/* Converts a displacement in the mesh's space to the vertex's frame and adds it to the vertex's offsets,
 * which are in that frame. Returns false where an offset gets over TW_COORDINATE_MAX. */
bool tw_detail_move(tw_detail_frames *frames, uint32_t vertex, const double by[3], float offsets[3]);

#endif
