/* Skins and morph targets baked: each mesh that a pose moves stands there as a plain mesh, once for each node
 * that shows it. */
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
  api_plan_moves moves; /* [meshes of the model], or none where nothing moves */
} api_baked;

/* 422 where more points would move than an answer can hold, or one goes too far. */
api_outcome api_bake(api_call *call, const tw_model *model, const tw_clip *clip, float time, api_baked *out);

/* A copy whose nodes are its own, with room for some more. NULL without memory. */
tw_model *api_copy_nodes(tw_arena *arena, const tw_model *model, uint32_t more);

#endif
