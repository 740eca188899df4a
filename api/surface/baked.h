/* Bakes skins and morph targets: each mesh that a pose deforms becomes a plain mesh, once for each node that
 * shows it. */
#ifndef API_BAKED_H
#define API_BAKED_H

#include "call.h"
#include "plans.h"
#include "tweend/model.h"

/* Lives in the call's arena. */
typedef struct api_baked {
  tw_model *model;
  tw_trs *pose; /* [nodes of the model] */
  api_plan_meshes meshes;
  api_plan_moves moves; /* one for each mesh of `model`; count 0 where nothing moves */
} api_baked;

/* Bakes the model at one time of the clip, or at rest where the clip is NULL, for a surface of the query. 422
 * where more points would move than an answer can hold, the surface would be over a limit, or a point moves
 * too far. */
api_outcome api_bake(api_call *call, const tw_model *model, const tw_clip *clip, float time,
                     const api_surface_query *query, api_baked *out);

/* Whether baking moves anything: a node shows a mesh with joints or morph targets. */
bool api_bakes(const tw_model *model);

/* A copy of the model with its own array of nodes, with room for `more`. NULL without memory. */
tw_model *api_copy_nodes(tw_arena *arena, const tw_model *model, uint32_t more);

#endif
