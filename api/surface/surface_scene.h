/* What a surface shows of a model: clips as a pose or as animations, meshes moved by skins or left out. */
#ifndef API_SURFACE_SCENE_H
#define API_SURFACE_SCENE_H

#include "clips.h"
#include "plans.h"
#include "times.h"
#include "tweend/anim.h"
#include "tweend/format.h"

typedef struct api_reduction {
  bool is_wide; /* LINEAR tracks are reduced too, not only those that glTF cannot express */
  tw_tolerance tolerance;
} api_reduction;

/* The parameters. */
typedef struct api_scene_query {
  const char *clips;    /* as in api_clips_choose; NULL: all clips, or the first with times */
  api_clip_terms terms; /* as in api_clips_choose */
  bool is_bare;         /* meshes=none */
  bool is_baked;        /* skin=bake */
  api_reduction reduction;
  api_times times;
} api_scene_query;

/* The scene of an answer. Lives in the answer's arena, except the entries. */
typedef struct api_surface_scene {
  api_scene_query query;
  api_clip_choices choices;
  bool is_stored;
  /* Released by api_scene_release. */
  api_entry *moving;  /* the merged clips, if times are given; else NULL */
  api_entry **lent;   /* [choices.count] clips that are compiled; NULL for the model's own keys */
  api_entry *reduced; /* the reduced tracks, or NULL */
  tw_scene content;   /* this room fills in model, pose, posed_by, weights, clips; the caller the rest */
  api_plan_meshes meshes;
  api_plan_moves moves;
  tw_clip_keys baked; /* the keys of `moving` at the times of the request */
} api_surface_scene;

/* Reads the parameters. meshes_alone: the name of the answer's form where that has neither clips nor nodes,
 * else NULL. */
api_outcome api_scene_read(api_call *call, const char *meshes_alone, api_scene_query *out);

/* Finds the clips, and compiles those that are posed, baked or borrowed. is_stored as in api_clip_take. */
api_outcome api_scene_take_clips(api_call *call, const tw_model *model, bool is_stored,
                                 api_surface_scene *scene);

/* Prints the parameters with defaults; call after api_scene_take_clips. */
void api_scene_print(const api_surface_scene *scene, tw_text *text);

/* Fills content.model, pose, posed_by and weights, and meshes and moves; call after api_scene_take_clips.
 * surface: the surface that skin=bake must not take over a limit. Not in a light call with times or
 * skin=bake. */
api_outcome api_scene_pose(api_call *call, const tw_model *model, const api_surface_query *surface,
                           api_surface_scene *scene);

/* Fills content.clips with clips that are kept or baked to keys; reports the error of reduced tracks, or
 * between baked keys, in X-Tweend-Error. */
api_outcome api_scene_animate(api_call *call, const tw_model *model, api_surface_scene *scene);

/* Adds the warnings of the clips to the answer. */
void api_scene_warn(api_call *call, const api_surface_scene *scene);

void api_scene_release(api_surface_scene *scene);

#endif
