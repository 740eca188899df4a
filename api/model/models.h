/* Stored models, parsed. */
#ifndef API_MODELS_H
#define API_MODELS_H

#include "cache.h"
#include "call.h"
#include "tweend/format.h"
#include "upload.h"

/* 32 digits of lower-case hex. */
bool api_is_model_id(const char *text, size_t length);

/* Who makes much of little, and what the request was granted beside that. */
typedef struct api_maker {
  api_call *call;
  uint64_t granted;
} api_maker;

/* Grants `bytes` beside those. False: the fault stalls. */
bool api_maker_grant(void *maker, uint64_t bytes);
/* What may be made: no more than there is memory for. The maker outlives it. */
api_making api_making_of(api_maker *maker);

/* The stored model, parsed, from the cache or the store: *out holds a tw_model, released with
 * api_entry_release. reading: NULL for the defaults, here and below. 404, 503; API_NEEDS_THREAD in a light
 * call when it is not at hand. */
api_outcome api_model_take(api_call *call, const char *id, const api_reading *reading, api_entry **out);

/* Looks whether a model is stored and whole, before anything of it is answered from the cache: 404 and 500
 * where it is not, as another daemon on the same store may have deleted it. A store that cannot be reached is
 * no reason to refuse what is cached. API_NEEDS_LOOK in a call with API_LIGHT when nobody has looked of late.
 */
api_outcome api_model_look(api_call *call, const char *id);

/* The model in the request's body, parsed for this request alone. */
api_outcome api_model_of_body(api_call *call, const api_reading *reading, api_entry **out);

/* What an answer says beside the description of a model: prints members. */
typedef struct api_addition {
  void (*print)(void *context, tw_text *out);
  void *context;
} api_addition;

/* Reads a model from GLB that the service made, stores it and answers as for an upload. held: memory that the
 * request holds beside. name: or NULL. */
api_outcome api_model_store(api_call *call, api_bytes bytes, uint64_t held, const char *name,
                            const api_addition *addition);

/* Answers as for an upload of the bytes that the call's model was stored with. */
api_outcome api_model_reply_stored(api_call *call);

/* Prints the description of a model. False: the fault says why. */
bool api_describe(const tw_model *model, const char *id, uint64_t size, tw_text *out, api_fault *fault);

/* What a person would call the model: its own name or the first that it holds; NULL without any. */
const char *api_model_name(const tw_model *model);

#endif
