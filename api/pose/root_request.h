/* Root motion in requests: root_motion, root_axes, in_place (tweend/root_motion.h). */
#ifndef API_ROOT_REQUEST_H
#define API_ROOT_REQUEST_H

#include "call.h"
#include "tweend/model.h"
#include "tweend/root_motion.h"

/* A view into the call's query. */
typedef struct api_root {
  bool is_on;       /* root motion is taken out of the clip */
  bool in_place;    /* and dropped */
  bool is_carried;  /* a node of the clip carries it, as tracks; only where it is not dropped */
  const char *name; /* of the node; NULL: found by the clip */
  uint32_t node;    /* the same, once it is found in the model; else TW_NO_INDEX */
  unsigned axes;    /* bits, as in tw_root_job */
} api_root;

/* Reads the parameters. in_place=true alone means root_motion=auto. 400. */
api_outcome api_root_read(api_call *call, api_root *out);

/* Finds the node that is named. 404. */
api_outcome api_root_find(api_call *call, const tw_model *model, api_root *root);

/* Prints it for keys and entity tags; nothing where it is off. */
void api_root_print(const api_root *root, tw_text *text);

/* Prints axes as the parameter has them: "x,z,yaw". */
void api_root_axes_print(unsigned axes, tw_text *text);

#endif
