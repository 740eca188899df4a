/* Answers about immutable models, kept whole as entries of the service's cache. The key is the canonical
 * request: the model's id, the representation, and all parameters with defaults, in one order and
 * spelling. The warnings of the call that prints an answer are those of every call that is sent it. */
#ifndef API_RESPONSE_CACHE_H
#define API_RESPONSE_CACHE_H

#include "call.h"

/* Larger answers are not cached, so that an answer that is sent slowly holds little memory. */
enum { API_RESPONSE_MAX = 4 << 20 };

/* Prints the text of an answer, and adds its warnings to the call that it is printed for. False: the fault is
 * filled; the caller frees the text. */
typedef bool (*api_print)(void *context, tw_text *out, api_fault *fault);

/* Answers with the cached text of the key, printed where it is missing; validates as api_validate does. Where
 * printing sets told_name of the call, the entity tag depends on that name in place of `canonical`.
 * A light call stalls where it is not cached. */
api_outcome api_response_reply(api_call *call, const char *key, const char *representation,
                               const char *canonical, api_print print, void *context);

/* The same for answers of which there may be any number; call api_validate before. A missing answer is
 * printed and cached only when it is asked for a second time, so that one-off requests evict nothing.
 * API_NEEDS_THREAD in a light call when it is not cached; API_CONTINUE: answer without the cache. */
api_outcome api_response_reply_repeated(api_call *call, const char *key, api_print print, void *context);

#endif
