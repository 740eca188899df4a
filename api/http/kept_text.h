/* Answers of text that are printed once and kept in the cache. */
#ifndef API_KEPT_TEXT_H
#define API_KEPT_TEXT_H

#include "call.h"

/* Prints the text; on failure fills the fault, and the text is freed by the caller. */
typedef bool (*api_print)(void *context, api_text *out, api_fault *fault);

/* Answers with the text under the key, printed where it is missing; validators as in api_validate.
 * API_NEEDS_THREAD in a light call when it is not at hand. */
api_outcome api_reply_kept(api_call *call, const char *key, const char *representation, const char *canonical,
                           api_print print, void *context);

#endif
