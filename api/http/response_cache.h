/* Answers about immutable models that are remembered whole, as entries of the service's cache. The key is the
 * canonical request: the model's id, the representation, and all parameters with their defaults, in one order
 * and one spelling. */
#ifndef API_RESPONSE_CACHE_H
#define API_RESPONSE_CACHE_H

#include "call.h"

/* No larger answer is offered to the cache, so that an answer that is sent slowly holds little memory. */
enum { API_RESPONSE_MAX = 4 << 20 };

/* Prints the text of an answer; on failure fills the fault, and the text is freed by the caller. */
typedef bool (*api_print)(void *context, tw_text *out, api_fault *fault);

/* Answers with the text under the key, printed where it is missing; validators as in api_validate.
 * API_NEEDS_THREAD in a light call when it is not at hand. */
api_outcome api_response_reply(api_call *call, const char *key, const char *representation,
                               const char *canonical, api_print print, void *context);

/* The same for unbounded sets of answers, after api_validate. A missing answer is printed and cached only
 * when asked for a second time, so that one-off requests evict nothing. API_NEEDS_THREAD in a light call when
 * it is not cached; API_CONTINUE: answer without the cache. */
api_outcome api_response_reply_repeated(api_call *call, const char *key, api_print print, void *context);

#endif
