/* What of a model a surface shows: its clips as a pose or as animations, its meshes moved by skins or left
 * out.
 */
#ifndef API_SURFACE_SCENE_H
#define API_SURFACE_SCENE_H

#include "clips.h"
#include "plans.h"
#include "times.h"
#include "tweend/anim.h"
#include "tweend/format.h"

typedef struct api_reduction {
  bool is_wide; /* LINEAR tracks get fewer keys too, not only those that glTF does not have */
  tw_tolerance tolerance;
} api_reduction;

/* Parameters as read. */
typedef struct api_scene_query {
  const char *clips; /* as in api_clips_choose; NULL: all, with times the first */
  bool is_bare;      /* meshes=none */
  bool is_baked;     /* skin=bake */
  api_reduction reduction;
  api_times times;
} api_scene_query;

/* Being made. Lives in the arena of the answer, but for the entries. */
typedef struct api_surface_scene {
  api_scene_query query;
  api_clip_choices choices;
  bool is_stored;
  /* Let go by api_scene_release. */
  api_entry *moving;  /* the clips as one, where times are given; else NULL */
  api_entry **lent;   /* [choices.count] borrowed clips that are kept, NULL for the model's own */
  api_entry *reduced; /* or NULL */
  tw_scene content;   /* model, pose, posed_by, clips; the rest is the caller's */
  api_plan_meshes meshes;
  api_plan_moves moves;
  tw_clip_keys baked; /* the keys of `moving` at the times asked for */
} api_surface_scene;

/* meshes_alone: the answer's form holds no clips and no nodes. */
api_outcome api_scene_read(api_call *call, bool meshes_alone, api_scene_query *out);

/* Finds the clips, and takes what of them is to be compiled. is_stored as in api_clip_take. */
api_outcome api_scene_take_clips(api_call *call, const tw_model *model, bool is_stored,
                                 api_surface_scene *scene);

/* Prints the parameters with their defaults, once the clips are taken. */
void api_scene_print(const api_surface_scene *scene, tw_text *text);

/* Fills content.model, pose and posed_by, meshes and moves, once the clips are taken. Not for a light call
 * with times. */
api_outcome api_scene_pose(api_call *call, const tw_model *model, api_surface_scene *scene);

/* Fills content.clips where clips are kept or baked to keys, and tells the error that is left. */
api_outcome api_scene_animate(api_call *call, const tw_model *model, api_surface_scene *scene);

/* Tells the warnings of the clips. */
void api_scene_warn(api_call *call, const api_surface_scene *scene);

void api_scene_release(api_surface_scene *scene);

#endif
