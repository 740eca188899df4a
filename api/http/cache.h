/* What is worth keeping between requests: parsed models, plans, clips, answers. Immutable values by text
 * keys, reference-counted. Entries that nobody holds are idle: of those a byte budget is kept, the least
 * recently used go first. Entries in use do not count against it, and so push out nothing that others use;
 * all of them count against the budget of the process (budget.h).
 *
 * Two requests for one missing key make its value once. A request never blocks for what another one makes:
 * its take fails with a stall in the fault, and api_handle makes its ticket wait at the entry. */
#ifndef API_CACHE_H
#define API_CACHE_H

#include "budget.h"
#include "problem.h"

typedef struct api_cache api_cache;
typedef struct api_entry api_entry;

/* idle_max: bytes of idle entries. budget: outlives the cache. NULL without memory. */
api_cache *api_cache_create(uint64_t idle_max, api_budget *budget);
void api_cache_destroy(api_cache *cache); /* NULL accepted; no entry may be held */

/* What a build makes: the value, the bytes it holds, and who frees it. */
typedef struct api_built {
  void *value;
  size_t size;
  void (*destroy)(void *value);
  api_cached kind;
} api_built;

/* Makes the value of a missing key; may take other keys, but none that waits for this one. */
typedef bool (*api_build)(void *context, api_built *out, api_fault *fault);

/* The entry when it is there and complete, else NULL. Takes a reference. */
api_entry *api_cache_peek(api_cache *cache, const char *key);

/* The entry, taking a reference. Where it is missing it is built here; in a light call (not API_HEAVY) it is
 * promised instead: the ticket's next heavy call will build it, and who else asks for it waits. NULL: the
 * fault says why: a failure, which is not remembered, or a stall: API_STALL_THREAD in a light call,
 * API_STALL_ENTRY while another request makes it, or what the build itself stalled at. */
api_entry *api_cache_take(api_cache *cache, const char *key, api_ticket *ticket, api_effort effort,
                          api_build build, void *context, api_fault *fault);

/* Keeps a value that is made already; frees it where the key is known, or without memory. */
void api_cache_put(api_cache *cache, const char *key, const api_built *built);

/* Waits at the entry that the fault of API_STALL_ENTRY names, and takes the fault's reference to it over. */
api_wait api_cache_wait(api_cache *cache, api_ticket *ticket, api_entry *awaited);
/* True when the ticket waited at an entry: it will not be woken. */
bool api_cache_cancel(api_cache *cache, api_ticket *ticket);
/* Lets go of what the ticket promised, and of what it waited for. */
void api_cache_end(api_cache *cache, api_ticket *ticket);

/* A value of one request's own, under the same kind of handle. Frees it and returns NULL without
 * memory. */
api_entry *api_cache_own(api_cache *cache, const api_built *built);

void *api_entry_value(const api_entry *entry);
void api_entry_release(api_entry *entry); /* NULL accepted */

/* Forgets every key in which `part` stands. Who holds such an entry keeps it. */
void api_cache_forget(api_cache *cache, const char *part);

/* Frees idle entries, least recently used first, until `bytes` are free; returns how many are. */
uint64_t api_cache_relieve(api_cache *cache, uint64_t bytes);

/* By which the table finds a key; for tests of keys that collide. */
uint32_t api_cache_hash(const char *key);

/* Bytes of the idle entries. */
uint64_t api_cache_idle_size(api_cache *cache);

/* Fills in `cached`. */
void api_cache_usage(api_cache *cache, api_usage *out);

#endif
