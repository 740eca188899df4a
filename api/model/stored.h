/* What the store has: ids, stored bytes, and the summaries beside them. */
#ifndef API_STORED_H
#define API_STORED_H

#include <cjson/cJSON.h>

#include "call.h"
#include "tweend/format.h"

/* The id of bytes: the beginning of their SHA-256. */
void api_model_id_print(api_bytes bytes, char out[API_ID_TEXT]);

/* Whether a text is a model's id: 32 digits of lower-case hex. */
bool api_is_model_id(const char *text, size_t length);

/* Fail with 503; with 507; with one of these by the status of writing; with 404. */
api_outcome api_store_fail_unavailable(api_call *call);
api_outcome api_model_fail_full(api_call *call);
api_outcome api_store_fail_writing(api_call *call, api_store_status status);
api_outcome api_model_fail_absent(api_call *call, const char *id);

/* Checks that a model is stored and whole before anything about it is answered from the cache: another daemon
 * on the same store may have deleted it. 404 where it is absent, 500 where it is damaged; where the store
 * cannot be reached, the cache still answers. API_NEEDS_LOOK in a call with API_LIGHT without a recent
 * check. */
api_outcome api_model_look(api_call *call, const char *id);

/* Opens the stored bytes, which the caller closes. 404, 500, 503. */
api_outcome api_stored_open(api_call *call, const char *id, api_blob *out);

/* Reads all bytes of an open blob, for tw_free; NULL: the fault says why. */
uint8_t *api_stored_read(api_call *call, const api_blob *blob);

/* The summary stored with a model's bytes. */
typedef struct api_summary {
  cJSON *tree;      /* holds the name; freed by the caller, even where there is no summary */
  const char *name; /* or NULL */
  tw_format format;
} api_summary;

/* Reads a summary; false where it is lost. text: or NULL. */
bool api_summary_read(const char *text, api_summary *out);

/* The same for a stored model. */
bool api_summary_find(api_service *service, const char *id, api_summary *out);

#endif
