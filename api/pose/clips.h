/* Clips that a request names: found, borrowed from another model, merged, compiled, cached. */
#ifndef API_CLIPS_H
#define API_CLIPS_H

#include "cache.h"
#include "call.h"
#include "tweend/model.h"

/* One clip of a request, found before anything is compiled. */
typedef struct api_clip_choice {
  char lender[API_ID_TEXT]; /* the model it is borrowed from; "" for the model's own */
  uint32_t index;
} api_clip_choice;

/* A view into the call's arena. */
typedef struct api_clip_choices {
  uint32_t count;
  const api_clip_choice *list; /* [count], none of them twice; NULL: the model's own first `count` clips */
} api_clip_choices;

/* Finds the clips that `text` means: one by its name ("{model id}/{name}" borrows it), several with commas
 * between their names, "none"; a name that exists goes before the other meanings. NULL: the model's own first
 * clips, `otherwise` of them or all that there are. 404 for a name that is none, 400 for a name given twice
 * or more than 256; API_NEEDS_THREAD where the search is long, or a lender is not at hand. */
api_outcome api_clips_choose(api_call *call, const tw_model *model, const char *text, uint32_t otherwise,
                             api_clip_choices *out);

api_clip_choice api_clips_get(const api_clip_choices *choices, uint32_t i);

/* Prints the choices for keys and entity tags: equal texts of one model mean equal clips. */
void api_clips_print(const api_clip_choices *choices, tw_text *text);

/* Clips as one, ready for use on one model; immutable. */
typedef struct api_clip {
  tw_arena *arena;             /* of what follows */
  const char *name;            /* those of all clips, commas between them */
  const char *node_names;      /* of all of the model's nodes, as api_node_names_print prints them */
  const tw_clip_keys *carried; /* of a single borrowed clip, carried over to the model; else NULL */
  tw_clip *compiled;
  uint32_t warning_count; /* one for each node of a borrowed clip that the model does not have */
  const char **warnings;  /* [warning_count] sentences */
} api_clip;

/* The clips, at least one, merged by tw_clip_merge and compiled: *out holds an api_clip. force: a
 * tw_interpolation, or -1. is_stored: the model is call->id of the store, so the clip may be cached; a model
 * out of the body is not. */
api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choices *choices, int force, api_entry **out);

/* The names of nodes as an array of JSON. nodes: [count]; NULL for the first `count`. */
void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text);

#endif
