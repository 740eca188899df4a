/* What of a model a surface shows: its clip as a pose or an animation, its meshes moved by skins or left out.
 */
#ifndef API_SHOWN_H
#define API_SHOWN_H

#include "clips.h"
#include "plans.h"
#include "reduced.h"
#include "times.h"
#include "tweend/format.h"

/* Parameters as read. */
typedef struct api_shown_query {
  const char *clip_name;
  bool has_clip; /* clip or a time was given */
  bool is_bare;  /* meshes=none */
  bool is_baked; /* skin=bake */
  api_reduction reduction;
  api_times times;
} api_shown_query;

/* Being made. Lives in the arena of the answer, but for the entries. */
typedef struct api_shown {
  api_shown_query query;
  api_clip_choice choice;
  bool is_stored;
  api_entry *clip, *reduced; /* NULL without; let go by api_shown_release */
  tw_scene scene;            /* model, pose, posed_by, clip; the rest is the caller's */
  api_plan_meshes meshes;
  api_plan_moves moves;
  tw_clip_keys animation;
} api_shown;

api_outcome api_shown_read(api_call *call, api_shown_query *out);

/* Finds and holds the clip. is_stored as in api_clip_take. */
api_outcome api_shown_take_clip(api_call *call, const tw_model *model, bool is_stored, api_shown *shown);

/* Prints the parameters with their defaults, once the clip is taken. */
void api_shown_print(const api_shown *shown, api_text *text);

/* Fills scene.model, pose and posed_by, meshes and moves, once the clip is taken. Not for a light call with a
 * clip. */
api_outcome api_shown_pose(api_call *call, const tw_model *model, api_shown *shown);

/* Fills scene.clip where the clip is kept or baked to keys, and tells the error that is left. */
api_outcome api_shown_animate(api_call *call, const tw_model *model, api_shown *shown);

void api_shown_release(api_shown *shown);

#endif
