/* The budget: the memory that bodies, models, plans, caches and answers under way hold together, against
 * --max-memory.
 *
 * Two kinds of memory count. What exists (cache entries, bodies) is added when it is made and subtracted when
 * it is freed; that never fails. What a request is about to use is granted to its ticket beforehand; a grant
 * that does not fit makes the request wait. Grants make room for themselves: idle cache entries go. A request
 * is always granted what it asks for when no other one that is computed has a grant, so a request that is
 * alone is never refused. */
#ifndef API_BUDGET_H
#define API_BUDGET_H

#include "api.h"

typedef struct api_budget api_budget;

/* limit: bytes. waiting_max: requests that may wait for memory at once. NULL without memory. */
api_budget *api_budget_create(uint64_t limit, size_t waiting_max);
void api_budget_destroy(api_budget *budget); /* NULL accepted; nobody may wait */

/* relieve(context, bytes): frees idle memory, about so many bytes, and returns how many. Without a lock held.
 * Set once, before use. */
void api_budget_relieved_by(api_budget *budget, uint64_t (*relieve)(void *context, uint64_t bytes),
                            void *context);

void api_budget_add(api_budget *budget, uint64_t bytes);
/* Wakes requests that fit now. */
void api_budget_subtract(api_budget *budget, uint64_t bytes);
/* Adds what can be done without; false when it does not fit. */
bool api_budget_try_add(api_budget *budget, uint64_t bytes);
uint64_t api_budget_used(api_budget *budget);
/* What tickets have been granted of it. */
uint64_t api_budget_granted(api_budget *budget);

/* Makes the ticket's grant `bytes` in all, more or less than before. False when more does not fit: the grant
 * is as it was. */
bool api_budget_grant(api_budget *budget, api_ticket *ticket, uint64_t bytes);
/* The same for the answer that the ticket's request has by now. A client may take very long to read it:
 * answers that hold no more than an eighth of the budget do not count against a request that is alone
 * otherwise. */
bool api_budget_keep(api_budget *budget, api_ticket *ticket, uint64_t bytes);

typedef enum api_wait {
  API_WAIT_BEGUN,   /* the ticket is woken once, with `bytes` granted; do not touch it until then */
  API_WAIT_OVER,    /* what was waited for is there already: go on */
  API_WAIT_CROWDED, /* too many wait */
} api_wait;

/* Waits until `bytes` in all can be granted; the ticket holds nothing meanwhile. */
api_wait api_budget_wait(api_budget *budget, api_ticket *ticket, uint64_t bytes);
/* True when the ticket waited here: it will not be woken. */
bool api_budget_cancel(api_budget *budget, api_ticket *ticket);
/* Call when more memory is idle: waiting requests may fit now. */
void api_budget_poke(api_budget *budget);

#endif
