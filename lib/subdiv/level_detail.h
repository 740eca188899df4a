/* What is modelled onto levels (Zorin, Schröder and Sweldens 1997): displacements in local frames of a level,
 * added after the step that makes it. A surface of a coarser level shows deeper details too: each of its
 * vertices, which has the same number on all deeper levels, is moved as far as it is on the deepest one with
 * details. */
#ifndef TWEEND_LEVEL_DETAIL_H
#define TWEEND_LEVEL_DETAIL_H

#include "cage.h"
#include "parallel_for.h"

/* Details, of ascending levels. */
typedef struct tw_detail_list {
  uint32_t count;
  const tw_detail *details;
} tw_detail_list;

static inline uint32_t tw_deepest_detail(const tw_detail_list *list) {
  return list->count > 0 ? list->details[list->count - 1].level : 0;
}

/* Those of levels with a lower number. */
tw_detail_list tw_coarser_details(const tw_detail_list *list, uint32_t level);

/* Whether the details are of the cage's levels, as the options refine it. TW_INVALID, TW_LIMIT; pointer
 * "/details/0". */
tw_status tw_details_check(const tw_detail_list *list, const tw_cage *cage, const tw_surface_options *options,
                           tw_error *error);

/* A level that is being made. */
typedef struct tw_detail_step {
  const tw_detail_list *list;
  const tw_topology *topology; /* of the level, sharpened */
  const tw_rules *rules;
  uint32_t level;
  uint32_t answer; /* the level that rows are of */
} tw_detail_step;

/* Adds what is modelled onto the level to its positions: [vertices][3] as subdivision made them. At the level
 * of the answer the displacements of deeper levels are added too, and beyond it none. Coordinates stay within
 * TW_COORDINATE_MAX. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_details_add(const tw_detail_step *step, const tw_parallel_for *parallel, double *positions);

/* A level of a mesh as subdivision makes it of the levels above and their details, without its own. */
typedef struct tw_detail_level {
  const uint32_t *point_of; /* of the cage; NULL: all points are used */
  tw_topology topology;
  double *positions; /* [vertices][3] */
} tw_detail_level;

/* Refines to options->level. Lives in the arena. TW_INVALID with an open border, TW_LIMIT over
 * TW_GENERIC_FACES_MAX, TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_detail_level_of(const tw_mesh *mesh, const tw_surface_options *options,
                             const tw_parallel_for *parallel, tw_arena *arena, tw_detail_level *out,
                             tw_error *error);

/* The frames of a level, which outlives them; for one thread, as they have room for one mask. */
typedef struct tw_detail_frames tw_detail_frames;
tw_status tw_detail_frames_create(const tw_detail_level *level, const tw_rules *rules, tw_arena *arena,
                                  tw_detail_frames **out);

/* Adds a displacement in the mesh's space to the offsets of a vertex, which are in its frame. False: they
 * would be over TW_COORDINATE_MAX. */
bool tw_detail_move(tw_detail_frames *frames, uint32_t vertex, const double by[3], float offsets[3]);

#endif
