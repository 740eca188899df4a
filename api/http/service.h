/* What all requests share. */
#ifndef API_SERVICE_H
#define API_SERVICE_H

#include <stdatomic.h>

#include "api.h"
#include "cache.h"

enum { API_KEY_DIGEST = 32, API_ASKED = 4096 };

/* SHA-256 of each key: equal lengths to compare. */
struct api_keys {
  struct api_keys *older; /* requests may still refer to it */
  size_t count;
  uint8_t digests[][API_KEY_DIGEST];
};

void api_key_digest(const char *key, uint8_t out[API_KEY_DIGEST]);

struct api_service {
  api_limits limits;
  api_store store;
  tw_parallel_for threads;
  const tw_parallel_for *parallel; /* NULL: there are no threads */
  tw_arena *arena;                 /* of the copied settings */
  api_keys *_Atomic keys;          /* in force; NULL without memory only */
  const char *cors_origins;
  atomic_bool is_draining;
  api_budget *budget;
  api_cache *cache;
  atomic_uint asked[API_ASKED]; /* hashes of requests, see response_cache.c */
};

#endif
