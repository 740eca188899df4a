/* How clips come to a model: what a query says of carrying borrowed clips over (tweend/retarget.h) and of
 * root motion (tweend/root_motion.h). */
#ifndef API_CLIP_TERMS_H
#define API_CLIP_TERMS_H

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

/* API_FAILED with 400 for a map or feet=hold without retarget=auto. */
api_outcome api_clip_terms_check(api_call *call, const api_clip_terms *terms);

/* Finds the node that root_motion names. 404. */
api_outcome api_clip_terms_find_root(api_call *call, const tw_model *model, api_clip_terms *terms);

/* Prints those that are on for keys and entity tags. */
void api_clip_terms_print(const api_clip_terms *terms, tw_text *text);

/* Prints axes as the parameter has them: "x,z,yaw". */
void api_root_axes_print(unsigned axes, tw_text *text);

#endif
