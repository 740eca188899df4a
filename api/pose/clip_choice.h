/* What a query says of clips: which ones, of this model or of others; how borrowed ones are carried over
 * (tweend/retarget.h); and root motion (tweend/root_motion.h). */
#ifndef API_CLIP_CHOICE_H
#define API_CLIP_CHOICE_H

#include "cache.h"
#include "call.h"
#include "rules.h"
#include "tweend/model.h"
#include "tweend/retarget.h"
#include "tweend/root_motion.h"

/* Root motion. A view into the call's query. */
typedef struct api_root {
  bool is_on;       /* root motion is taken out of the clip */
  bool in_place;    /* and dropped */
  bool is_carried;  /* a node of the clip carries it, as tracks; only where it is not dropped */
  const char *name; /* of the node; NULL: found by the clip */
  uint32_t node;    /* the same, once it is found in the model; else TW_NO_INDEX */
  unsigned axes;    /* bits, as in tw_root_job */
} api_root;

/* A view into the call's arena. */
typedef struct api_clip_terms {
  tw_retarget_wish retarget; /* of borrowed clips */
  api_root root;
} api_clip_terms;

/* The names of the parameters, behind those of all routes that take clips. */
extern const api_rule api_clip_term_rules[];

/* Reads them. in_place=true alone means root_motion=auto. names_feet: other values of `feet` than "hold" are
 * the names of nodes, and not read here. 400. */
api_outcome api_clip_terms_read(api_call *call, bool names_feet, api_clip_terms *out);

/* A clip of a request, before it is compiled. */
typedef struct api_clip_choice {
  char lender[API_ID_TEXT]; /* the id of the model that it is borrowed from; "" for the model's own */
  uint32_t index;
} api_clip_choice;

/* A view into the call's arena. */
typedef struct api_clip_choices {
  uint32_t count;
  const api_clip_choice *list; /* [count], all different; NULL: the model's own first `count` clips */
  api_clip_terms terms;
} api_clip_choices;

/* Finds the clips that `text` names: one name ("{model id}/{name}" borrows a clip), several names separated
 * by commas, or "none"; the name of a clip takes precedence over these meanings. NULL: the model's own first
 * `otherwise` clips, or all if there are fewer. 404 for an unknown name, 400 for a repeated one or more than
 * 256; API_NEEDS_THREAD in a light call when the search is long; a light call stalls where a lender is not
 * cached; 404 and 400 for terms that do not fit. Warns where retarget=auto has no clip to carry over. */
api_outcome api_clips_choose(api_call *call, const tw_model *model, const char *text, uint32_t otherwise,
                             const api_clip_terms *terms, api_clip_choices *out);

api_clip_choice api_clips_get(const api_clip_choices *choices, uint32_t i);

/* Prints the choices and terms for keys and entity tags: equal texts of one model mean equal clips. */
void api_clips_print(const api_clip_choices *choices, tw_text *text);

/* Prints axes as the parameter has them: "x,z,yaw". */
void api_root_axes_print(unsigned axes, tw_text *text);

/* ---- clips of other models ------------------------------------------------------------------ */

/* A clip of another stored model. */
typedef struct api_borrowed {
  char lender[API_ID_TEXT];
  api_entry *entry; /* a reference to the model; to be released where it is not NULL */
  uint32_t index;
} api_borrowed;

/* Finds the clip of a name that api_clip_is_borrowed. API_FAILED without such a model; API_CONTINUE without
 * such a clip, with the fault of 404; a light call stalls where the model is not cached. */
api_outcome api_clip_find_borrowed(api_call *call, const char *name, size_t length, api_borrowed *out);

#endif
