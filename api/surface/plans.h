/* Plans: the surfaces of all meshes of a model under a request's options, counted, limited, built, cached. */
#ifndef API_PLANS_H
#define API_PLANS_H

#include <stdatomic.h>

#include "cache.h"
#include "call.h"
#include "models.h"
#include "surface_query.h"
#include "tweend/shells.h"

/* The meshes of a plan. */
typedef struct api_plan_meshes {
  uint32_t count;
  const tw_mesh *meshes; /* [count] */
  uint32_t still_count;  /* the meshes after these can be moved */
  const uint32_t *uses;  /* [count] how often the answer has each; NULL: once */
} api_plan_meshes;

/* The meshes of an answer: meshes of the plan, at other positions. */
typedef struct api_plan_moves {
  uint32_t count;                /* 0: the plan's meshes are the answer's */
  const uint32_t *of;            /* [count] indices of meshes of the plan */
  const float *const *positions; /* [count] positions of all points; NULL: unchanged */
} api_plan_moves;

/* Whether `solids` of a plan are written; whoever begins to write them ends. */
enum { API_SHELLS_UNKNOWN, API_SHELLS_BEING_WRITTEN, API_SHELLS_KNOWN };

/* What tw_find_cage_changes finds of the model's meshes: flags, which are known together. */
enum {
  API_CHANGES_KNOWN = 1,
  API_JOINS_VALUES = 2,
  API_PARTS_VALUES = 4,
  API_JOINS_POINTS = 8,
  API_PARTS_POINTS = 16
};

/* Immutable but for is_warm, changes, shells and solids. */
typedef struct api_plan {
  uint32_t count;
  tw_surface **surfaces;     /* [count], one for each mesh */
  tw_patch_classes *classes; /* shared by the surfaces; NULL with a source */
  tw_surface_counts total;
  api_hard hard;
  atomic_bool is_warm; /* the bounds are known, so that reading starts without a pass over all points */
  /* Of a cage as triangles and as n-gons (tw_polygons): API_CHANGES_KNOWN and what follows, or 0. */
  atomic_int changes[TW_POLYGONS_NGON + 1];
  atomic_int shells; /* API_SHELLS_... */
  tw_solid *solids;  /* [count] the shells of each surface */
  api_entry *source; /* the plan that this one moves, or NULL */
  bool *borrows;     /* [count] whether the surface belongs to the source; NULL: none does */
} api_plan;

/* About the most bytes that making a surface of a level takes, for admission: what it really takes is
 * metered. Levels that are made step by step may take more: lib asks for that (reserve_steps,
 * surface_choose.c). */
uint64_t api_surface_bound(const tw_mesh *mesh, uint64_t level);

/* All meshes of a model, unmoved. */
api_plan_meshes api_plan_all(const tw_model *model);

/* Checks the counts of a surface, given the `status` of counting. TW_LIMIT over --max-level, --max-faces, or
 * the library's own limit; the call's fault then has the counts. */
tw_status api_plan_check(api_call *call, uint64_t level, const tw_surface_counts *counts, tw_status status);

/* Checks a surface by api_plan_check before anything is built, and without counting where a bound shows that
 * it is within the limits. */
tw_status api_plan_admit(api_call *call, const api_plan_meshes *meshes, const api_surface_query *query);

/* Counts a surface of the query exactly, all meshes together. TW_LIMIT if a count of a mesh is over 32 bits;
 * the counts are complete all the same. */
tw_status api_plan_count(api_call *call, const api_plan_meshes *meshes, const api_surface_query *query,
                         tw_surface_counts *total);

/* The options of a mesh of a plan: the request's, else the mesh's tags, else the defaults. index: the mesh's
 * place in the plan, by which it may have a level of its own. */
tw_surface_options api_surface_options(const api_surface_query *query, uint32_t index, const tw_mesh *mesh);

/* Takes out of the query what all meshes of the model have anyway, and says how its format pairs triangles,
 * so that all ways to ask for the same have one key. */
void api_surface_settle(api_surface_query *query, const tw_model *model);

/* Makes a view of a mesh with the creases and details that the query wants. *hard: what
 * TW_CREASES_FILE found are added to it. The arena holds new creases. Errors as tw_mesh_with_creases. */
tw_status api_plan_cage(const api_surface_query *query, const tw_mesh *mesh, tw_arena *scratch, tw_mesh *out,
                        api_hard *hard, tw_error *error);

/* Takes a plan: *out holds an api_plan. is_stored as in api_clip_take: the plan of a stored model is cached,
 * one for all positions; the moved surfaces are the request's own. 422 with the counts over a limit;
 * a light call stalls where it is not cached. */
api_outcome api_plan_take(api_call *call, const api_plan_meshes *meshes, const api_plan_moves *moves,
                          bool is_stored, const api_surface_query *query, api_entry **out);

/* Computes the bounds of all surfaces, unless they are known. */
tw_status api_plan_warm(api_plan *plan, const tw_parallel_for *parallel, tw_error *error);

/* Measures the shells of all surfaces, unless they are known: a pass over all triangles. solids:
 * [plan->count]. TW_NO_MEMORY, TW_CANCELLED. */
tw_status api_plan_shells(api_plan *plan, const tw_parallel_for *parallel, tw_solid *solids, tw_error *error);

/* Whether the shells are known. */
bool api_plan_knows_shells(const api_plan *plan);

#endif
