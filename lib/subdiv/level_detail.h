/* What is modelled onto levels: added to the points on their way from the cage, in frames of the level
 * (Zorin, Schröder and Sweldens 1997). Levels above it follow, as vertices keep their numbers: each goes
 * where the vertex of the deepest level goes. */
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

/* The first few, of levels above this one. */
tw_detail_list tw_details_above(const tw_detail_list *list, uint32_t level);

/* Whether the details are of the cage's levels, as the options refine it. TW_INVALID, TW_LIMIT; pointer
 * "/details/0". */
tw_status tw_details_check(const tw_detail_list *list, const tw_cage *cage, const tw_surface_options *options,
                           tw_error *error);

/* Adds what is modelled onto a level, `level` of those that are refined, to its positions: [vertices][3] as
 * subdivision made them. Where the answer is of this level, they follow deeper details as well. The topology
 * is sharpened. TW_NO_MEMORY. */
typedef struct tw_detail_step {
  const tw_detail_list *list;
  const tw_topology *topology;
  const tw_rules *rules;
  uint32_t level, answer;
} tw_detail_step;
tw_status tw_details_add(const tw_detail_step *step, const tw_parallel_for *parallel, double *positions);

/* The same with positions that rows hold. */
tw_status tw_details_add_floats(const tw_detail_step *step, const tw_parallel_for *parallel,
                                float *positions);

/* A level of a mesh as subdivision makes it of the levels above and their details. */
typedef struct tw_detail_level {
  const uint32_t *point_of; /* of the cage; NULL: all points are used */
  tw_topology topology;
  double *positions; /* [vertices][3] */
} tw_detail_level;
tw_status tw_detail_level_of(const tw_mesh *mesh, const tw_surface_options *options,
                             const tw_parallel_for *parallel, tw_arena *arena, tw_detail_level *out,
                             tw_error *error);

/* Adds to the offsets of one vertex so much that it is moved by this. False: they would not be finite. */
typedef struct tw_detail_frames tw_detail_frames;
tw_status tw_detail_frames_create(const tw_detail_level *level, const tw_rules *rules, tw_arena *arena,
                                  tw_detail_frames **out);
bool tw_detail_move(tw_detail_frames *frames, uint32_t vertex, const double by[3], float offsets[3]);

#endif
