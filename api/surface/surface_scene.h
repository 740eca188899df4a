/* What a surface shows of a model: clips as a pose or as animations, meshes moved by skins or left out. */
#ifndef API_SURFACE_SCENE_H
#define API_SURFACE_SCENE_H

#include "plans.h"

/* The scene of an answer. Lives in the answer's arena, except the entries. */
typedef struct api_surface_scene {
  api_surface_query *query;
  bool is_stored;
  /* Released by api_scene_release. */
  api_entry *moving;    /* the merged clips, if times are given; else NULL */
  api_entry **compiled; /* [query->choices.count] clips that are compiled; NULL for the model's own keys */
  api_entry *reduced;   /* the reduced tracks, or NULL */
  bool lacks_clips;     /* mixed clips of the model are left out, as other models are not there */
  tw_scene content;     /* this room fills in model, pose, posed_by, weights, clips; the caller the rest */
  api_plan_meshes meshes;
  api_plan_moves moves;
  tw_clip_keys baked; /* the keys of `moving` at the times of the request */
} api_surface_scene;

/* Finds the clips, query->choices, and compiles those that are posed, baked or borrowed. is_stored as in
 * api_clip_take. */
api_outcome api_scene_take_clips(api_call *call, const tw_model *model, bool is_stored,
                                 api_surface_scene *scene);

/* Fills content.model, pose, posed_by and weights, and meshes and moves; call after api_scene_take_clips.
 * Not in a light call with times or skin=bake. */
api_outcome api_scene_pose(api_call *call, const tw_model *model, api_surface_scene *scene);

/* Fills content.clips with clips that are kept or baked to keys; reports the error of reduced tracks, or
 * between baked keys, in X-Tweend-Error. */
api_outcome api_scene_animate(api_call *call, const tw_model *model, api_surface_scene *scene);

/* Adds the warnings of the model and of the clips that are asked for to the answer. */
void api_scene_warn(api_call *call, const tw_model *model, const api_surface_scene *scene);

void api_scene_release(api_surface_scene *scene);

#endif
