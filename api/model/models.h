/* Models: stored, parsed, cached, described. */
#ifndef API_MODELS_H
#define API_MODELS_H

#include "cache.h"
#include "call.h"
#include "tweend/format.h"
#include "upload.h"

/* Whether a text is a model's id: 32 digits of lower-case hex. */
bool api_is_model_id(const char *text, size_t length);

/* The limits on what a document may make, bounded by --max-memory. The service outlives the result. */
api_making api_making_within(const api_service *service);

/* The stored model, parsed, from the cache or the store: *out holds a tw_model and is released by
 * api_entry_release. reading: NULL for the defaults, here and below. 404, 500, 503; a light call
 * stalls where the model is not cached. */
api_outcome api_model_take(api_call *call, const char *id, const api_reading *reading, api_entry **out);

/* Checks that a model is stored and whole before anything about it is answered from the cache: another daemon
 * on the same store may have deleted it. 404 where it is absent, 500 where it is damaged; where the store
 * cannot be reached, the cache still answers. API_NEEDS_LOOK in a call with API_LIGHT without a recent
 * check. */
api_outcome api_model_look(api_call *call, const char *id);

/* The model in the request's body, parsed for this request alone: *out holds a tw_model. */
api_outcome api_model_of_body(api_call *call, const api_reading *reading, api_entry **out);

/* Members that an answer adds to the description of a model. */
typedef struct api_addition {
  void (*print)(void *context, tw_text *out);
  void *context;
} api_addition;

/* Parses a GLB that the request made, and holds, stores it, and answers as for an upload. name: or NULL.
 * addition: or NULL. */
api_outcome api_model_store(api_call *call, api_bytes bytes, const char *name, const api_addition *addition);

/* Fails with 507. */
api_outcome api_model_fail_full(api_call *call);

/* Answers as for an upload of the bytes of the call's stored model. */
api_outcome api_model_reply_stored(api_call *call);

/* Prints the description of a model, and adds its warnings to the answer's header. False: the call's fault
 * says why. */
bool api_describe(const tw_model *model, const char *id, uint64_t size, tw_text *out, api_call *call);

/* The model's name: its own, or the first one in its meshes, nodes or clips; NULL without any. */
const char *api_model_name(const tw_model *model);

/* The warning of edges that TW_CREASES_FILE keeps hard, in the call's arena; NULL without memory. */
const char *api_hard_warning(api_call *call, uint64_t edges);

#endif
