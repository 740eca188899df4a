/* Storing models that requests made. */
#ifndef API_MODEL_STORE_H
#define API_MODEL_STORE_H

#include "call.h"

/* Members that an answer adds to the description of a model. */
typedef struct api_addition {
  void (*print)(void *context, tw_text *out);
  void *context;
} api_addition;

/* Parses a GLB that the request made, and holds, stores it, and answers as for an upload. name: or NULL.
 * addition: or NULL. */
api_outcome api_model_store(api_call *call, api_bytes bytes, const char *name, const api_addition *addition);

/* Answers as for an upload of the bytes of the call's stored model. */
api_outcome api_model_reply_stored(api_call *call);

#endif
