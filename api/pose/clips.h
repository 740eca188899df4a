/* Clips that a request names: found, borrowed from another model, compiled, cached. */
#ifndef API_CLIPS_H
#define API_CLIPS_H

#include "cache.h"
#include "call.h"
#include "tweend/model.h"

/* A clip ready for use on one model; immutable. */
typedef struct api_clip {
  tw_arena *arena; /* of what follows */
  const char *name;
  const char *node_names;   /* of all of the model's nodes, as api_node_names_print prints them */
  const tw_trs *rest;       /* [nodes of the model] where the clip does not move them */
  const tw_clip_keys *keys; /* of a borrowed clip, carried over to the model; NULL for the model's own */
  tw_clip *compiled;
  uint32_t missing_count; /* nodes of a borrowed clip that the model does not have */
  const char **missing;   /* [missing_count], their names */
} api_clip;

/* Which clip a request means, found before anything is compiled. */
typedef struct api_clip_choice {
  char lender[API_ID_TEXT]; /* the model it is borrowed from; "" for the model's own */
  uint32_t index;           /* TW_NO_INDEX: the model has no clip, and none was asked for */
  int force;                /* a tw_interpolation, or -1 */
} api_clip_choice;

/* Finds the clip that `name` means ("{model id}/{name}" borrows one); NULL: the model's first.
 * 404 when there is none of that name. */
api_outcome api_clip_find(api_call *call, const tw_model *model, const char *name, int force,
                          api_clip_choice *out);

/* The clip, compiled: *out holds an api_clip. is_stored: the model is call->id of the store, so the
 * clip may be cached; a model out of the body is not. */
api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choice *choice, api_entry **out);

/* The names of nodes as an array of JSON. nodes: [count]; NULL for the first `count`. */
void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text);

/* The keys of a taken clip: those it carried over, or the model's own. */
const tw_clip_keys *api_clip_keys(const api_clip *clip, const tw_model *model, const api_clip_choice *choice);

/* Adds X-Tweend-Warning with the names of missing nodes, percent-encoded where they are not plain ASCII. */
void api_clip_warning(api_call *call, const api_clip *clip);

#endif
