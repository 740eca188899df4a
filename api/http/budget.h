/* The budget: the memory that bodies, models, plans, caches and answers hold together, against --max-memory.
 *
 * Two kinds of memory count. Existing memory (cache entries, bodies) is added when it is allocated and
 * subtracted when it is freed; that never fails. What a request takes is granted to its ticket: by a crude
 * bound before it reads an upload, makes a surface or prints poses, and by its meter (lib/base/meter.c),
 * which asks for more when the grant is used up. A request whose grant does not fit waits, and begins anew. A
 * grant makes room by evicting idle cache entries. If no other request that computes has a grant, a request
 * is granted as much of what it asks for as is left, but for a sixteenth, so that small requests are always
 * served beside it. */
#ifndef API_BUDGET_H
#define API_BUDGET_H

#include "api.h"

typedef struct api_budget api_budget;

/* limit: bytes. waiting_max: requests that may wait for memory at once. NULL without memory. */
api_budget *api_budget_create(uint64_t limit, size_t waiting_max);
void api_budget_destroy(api_budget *budget); /* NULL accepted; no ticket may wait */

/* relieve(context, bytes) frees about so many bytes of idle memory and returns how many. Called without a
 * lock held. Set once, before use. */
void api_budget_relieved_by(api_budget *budget, uint64_t (*relieve)(void *context, uint64_t bytes),
                            void *context);

void api_budget_add(api_budget *budget, uint64_t bytes);
/* Also wakes waiting requests that fit now. */
void api_budget_subtract(api_budget *budget, uint64_t bytes);
/* Adds memory that the caller can do without; false when it does not fit. */
bool api_budget_try_add(api_budget *budget, uint64_t bytes);
/* The same for memory that is needed: evicts idle cache entries. Waiting tickets go before it, unless it is
 * as small as what may pass them. */
bool api_budget_add_evicting(api_budget *budget, uint64_t bytes);
/* The most that all but small requests may hold of a limit. */
uint64_t api_budget_most(uint64_t limit);
uint64_t api_budget_used(api_budget *budget);
/* The part of it that is granted to tickets. */
uint64_t api_budget_granted(api_budget *budget);

/* Sets the ticket's grant to `bytes` in all, more or less than before; of more, a request that is alone may
 * get a part (ticket->granted). False when an increase does not fit: the grant is unchanged. */
bool api_budget_grant(api_budget *budget, api_ticket *ticket, uint64_t bytes);
/* The same for the memory of a finished answer. A client may take very long to read it, so answers do not
 * keep another request from being alone unless more than an eighth of the budget is in use. */
bool api_budget_retain(api_budget *budget, api_ticket *ticket, uint64_t bytes);

typedef enum api_wait {
  API_WAIT_BEGUN,   /* the ticket is woken once, with `bytes` granted; do not touch it until then */
  API_WAIT_OVER,    /* there is nothing to wait for any more: go on */
  API_WAIT_CROWDED, /* too many tickets wait already */
} api_wait;

/* Releases the ticket's grant and waits until `bytes` in all can be granted. */
api_wait api_budget_wait(api_budget *budget, api_ticket *ticket, uint64_t bytes);
/* True when the ticket waited for memory: its wake will not be called. */
bool api_budget_cancel(api_budget *budget, api_ticket *ticket);
/* Call when memory has become idle: waiting requests may fit now. */
void api_budget_poke(api_budget *budget);

#endif
