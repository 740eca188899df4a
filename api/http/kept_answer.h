/* Small answers that were asked for more than once, ready to be sent again: an answer about an immutable
 * model is a function of its path and query alone. */
#ifndef API_KEPT_ANSWER_H
#define API_KEPT_ANSWER_H

#include "cache.h"
#include "kept_key.h"

typedef struct api_kept_answers api_kept_answers;

api_kept_answers *api_kept_answers_create(uint64_t budget); /* bytes; NULL without memory */
void api_kept_answers_destroy(api_kept_answers *answers);   /* NULL accepted */

/* Forgets what was kept about a model. */
void api_kept_answers_forget(api_kept_answers *answers, const char *id);

/* Bytes of the answers that are kept. */
uint64_t api_kept_answers_size(api_kept_answers *answers);

/* Where they are kept. Under keys without their time stands what answers at any time are made from. */
api_cache *api_kept_answers_cache(api_kept_answers *answers);

/* Whether a key of this hash was asked for before, and not too many others since: what is asked for once is
 * not worth keeping. */
bool api_kept_asked_again(api_kept_answers *answers, uint32_t hash);

/* Answers a call whose route and key are judged. API_LATER: nothing is kept, go on. The key is whole then
 * when an answer was asked for before. */
api_outcome api_kept_answer(api_call *call, api_kept_key *key);

/* Offers a complete answer of status 200 and bytes, with an entity tag: it is kept when it is small and not
 * asked for the first time. */
void api_keep_answer(const api_call *call);

#endif
