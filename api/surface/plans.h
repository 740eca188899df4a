/* Surfaces of all meshes of a model under the options of a request: counted, limited, built, cached. */
#ifndef API_PLANS_H
#define API_PLANS_H

#include <stdatomic.h>

#include "cache.h"
#include "call.h"
#include "tweend/format.h"
#include "upload.h"

/* What a request asks of the surface itself. -1: not said, so the file's own tags count. */
typedef struct api_surface_query {
  uint64_t level; /* as it came: api_plan_check judges it */
  int scheme, boundary, uv, creasing, triangles;
  api_reading reading; /* of the model */
  bool limit, normals;
  bool own_normals; /* those of the file, at level 0 */
  bool tagged;      /* with the tags of the cage, at level 0 */
  bool with_holes;  /* as tw_mesh_open_holes makes faces of them, and without details */
  bool details;     /* with what is modelled onto levels */
  tw_creases creases;
  double crease_degrees;  /* of TW_CREASES_ANGLE, else 0 */
  float crease_sharpness; /* of the edges that creases adds, else 0 */
} api_surface_query;

/* Fills in that nothing is said but for scheme and boundary, which it reads. TW_SYNTAX. */
tw_status api_surface_query_begin(const api_query *query, api_surface_query *out, tw_error *error);

/* The meshes that a plan is of. */
typedef struct api_plan_meshes {
  uint32_t count;
  const tw_mesh *meshes; /* [count] */
  uint32_t still_count;  /* those after it can be moved */
  const uint32_t *uses;  /* [count] how often each is in the answer; NULL: each once */
} api_plan_meshes;

/* The meshes of an answer, as a plan's at other places. */
typedef struct api_plan_moves {
  uint32_t count;                /* 0: the plan's meshes are the answer's */
  const uint32_t *of;            /* [count] meshes of the plan */
  const float *const *positions; /* [count] of all points, or NULL: as it is */
} api_plan_moves;

/* Immutable but for is_warm. */
typedef struct api_plan {
  uint32_t count;
  tw_surface **surfaces;   /* [count], one a mesh */
  tw_patch_shapes *shapes; /* that the surfaces share; NULL with a source */
  tw_surface_counts total;
  atomic_bool is_warm; /* bounds are known: reading it costs no pass of its own */
  api_entry *source;   /* the plan that this one moves, or NULL */
  bool *borrows;       /* [count] surfaces that are the source's, or NULL */
} api_plan;

/* More than what the levels of a mesh hold that are made step by step, with all that lives on their points:
 * down to the deepest that something is modelled onto, or to one of so many points. */
uint64_t api_detail_cost(const tw_mesh *mesh, uint64_t points);

/* All meshes of a model, none of which moves. */
api_plan_meshes api_plan_all(const tw_model *model);

/* Judges what a surface was counted to have, and `status` of counting it. TW_LIMIT, which the call's fault
 * tells with the counts: --max-level, --max-faces, or the library's own limit. */
tw_status api_plan_check(api_call *call, uint64_t level, const tw_surface_counts *counts, tw_status status);

/* The options of one mesh: the request's, else the mesh's tags, else the defaults. */
tw_surface_options api_surface_options(const api_surface_query *query, const tw_mesh *mesh);

/* The plan: *out holds an api_plan. is_stored as in api_clip_take: plans of stored models are kept, one for
 * all moves; what moves is the request's own. 422 with the predicted counts over a limit; API_NEEDS_THREAD in
 * a light call when it is not at hand. */
api_outcome api_plan_take(api_call *call, const api_plan_meshes *meshes, const api_plan_moves *moves,
                          bool is_stored, const api_surface_query *query, api_entry **out);

/* Computes the bounds of all surfaces, unless they are known. */
tw_status api_plan_warm(api_plan *plan, const tw_parallel_for *parallel, tw_error *error);

/* Prints the query with all its values, for keys and entity tags. */
void api_surface_query_print(const api_surface_query *query, tw_text *text);

#endif
