/* What is worth keeping between requests: parsed models, plans, clips, descriptions. Immutable values
 * by text keys, reference-counted, under a byte budget and few to a place of the table; the least recently
 * used go first. Values in use stay even when they are over the budget. Two requests for one missing key
 * build it once. */
#ifndef API_CACHE_H
#define API_CACHE_H

#include "problem.h"

typedef struct api_cache api_cache;
typedef struct api_entry api_entry;

api_cache *api_cache_create(uint64_t budget); /* NULL without memory */
void api_cache_destroy(api_cache *cache);     /* NULL accepted; no entry may be held */

/* What a build makes: the value, the bytes it holds, and who frees it. */
typedef struct api_built {
  void *value;
  size_t size;
  void (*destroy)(void *value);
} api_built;

/* Makes the value of a missing key; may take other keys, but none that waits for this one. */
typedef bool (*api_build)(void *context, api_built *out, api_fault *fault);

/* The entry when it is there and complete, else NULL. Takes a reference. */
api_entry *api_cache_peek(api_cache *cache, const char *key);

/* A key whose hash is known. */
typedef struct api_cache_key {
  const char *text;
  uint32_t hash;
} api_cache_key;

/* The same of several keys in one go: all of them, or none. out: [count]. */
bool api_cache_peek_all(api_cache *cache, const api_cache_key *keys, size_t count, api_entry **out);

/* The entry, built where it is missing; waits while another thread builds it. Takes a reference.
 * NULL: the fault says why (a failure is not remembered). */
api_entry *api_cache_take(api_cache *cache, const char *key, api_build build, void *context,
                          api_fault *fault);

/* A value of one request's own, under the same kind of handle. Frees it and returns NULL without
 * memory. */
api_entry *api_entry_create(const api_built *built);

void *api_entry_value(const api_entry *entry);
void api_entry_hold(api_entry *entry);
void api_entry_release(api_entry *entry); /* NULL accepted */

/* Forgets every key in which `part` stands. Who holds such an entry keeps it. */
void api_cache_forget(api_cache *cache, const char *part);

/* Of a key of `length` bytes. */
uint32_t api_cache_hash(const char *key, size_t length);

/* Bytes of the complete entries. */
uint64_t api_cache_size(api_cache *cache);

#endif
