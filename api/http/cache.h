/* The cache of parsed models, plans, clips and answers: immutable values by text keys, reference-counted. An
 * entry that no request holds is idle; idle entries are kept up to a byte budget, and the least recently used
 * are evicted first. Entries in use do not count against that budget, so they push out nothing; all entries
 * count against the budget of the process (budget.h).
 *
 * Requests for the same missing key build its value once. A request never blocks while another one builds:
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

/* What a build makes: the value, its size in bytes, and the function that frees it. */
typedef struct api_built {
  void *value;
  size_t size;
  void (*destroy)(void *value);
  api_cached kind;
} api_built;

/* Builds the value of a missing key. May take other keys, but none whose build waits for this one. */
typedef bool (*api_build)(void *context, api_built *out, api_fault *fault);

/* The entry if it is complete, else NULL. Takes a reference. */
api_entry *api_cache_peek(api_cache *cache, const char *key);

/* The entry, with a reference. A missing entry is built by a heavy call; a light call (not API_HEAVY) only
 * promises it: the ticket's next heavy call will build it, and other requests for it wait. NULL: the fault
 * says why: an error, which is not cached, or a stall: API_STALL_THREAD in a light call, API_STALL_ENTRY
 * while another request builds the entry, or the stall of the build itself. */
api_entry *api_cache_take(api_cache *cache, const char *key, api_ticket *ticket, api_effort effort,
                          api_build build, void *context, api_fault *fault);

/* Caches a finished value. Destroys it where the key is already there, or without memory. */
void api_cache_put(api_cache *cache, const char *key, const api_built *built);

/* Waits at the entry in the fault of an API_STALL_ENTRY, and takes over the fault's reference to it. */
api_wait api_cache_wait(api_cache *cache, api_ticket *ticket, api_entry *awaited);
/* True when the ticket waited at an entry: its wake will not be called. */
bool api_cache_cancel(api_cache *cache, api_ticket *ticket);
/* Ends the ticket's promises, and releases the entry that it waited for. */
void api_cache_end(api_cache *cache, api_ticket *ticket);

/* An entry outside the cache, for a value of one request alone. Destroys the value and returns NULL without
 * memory. */
api_entry *api_cache_own(api_cache *cache, const api_built *built);

void *api_entry_value(const api_entry *entry);
void api_entry_release(api_entry *entry); /* NULL accepted */

/* Removes from the cache every key that mentions a model: one that contains its id, followed by '/'. Requests
 * keep the entries that they hold. Takes time in proportion to these keys, however many others there are. */
void api_cache_forget(api_cache *cache, const char *id);

/* Frees idle entries, least recently used first, until `bytes` are freed; returns how many were. */
uint64_t api_cache_relieve(api_cache *cache, uint64_t bytes);

/* The hash by which the table finds a key; public for tests of colliding keys. */
uint32_t api_cache_hash(const char *key);

/* The bytes of all idle entries. */
uint64_t api_cache_idle_size(api_cache *cache);

/* Fills in out->cached. */
void api_cache_usage(api_cache *cache, api_usage *out);

#endif
