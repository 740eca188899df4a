/* What all requests share. */
#ifndef API_SERVICE_H
#define API_SERVICE_H

#include <nettle/hmac.h>
#include <stdatomic.h>

#include "api.h"
#include "cache.h"

enum { API_KEY_DIGEST = 32, API_ASKED = 4096 };

typedef struct api_kept_key {
  uint8_t digest[API_KEY_DIGEST]; /* SHA-256 of the key: equal lengths to compare */
  unsigned rights;
  api_rate rate;
} api_kept_key;

struct api_keys {
  struct api_keys *older;         /* requests may still refer to it */
  uint8_t digest[API_KEY_DIGEST]; /* of all that follows */
  size_t count, url_count;
  bool has_rates;                    /* one of the keys */
  api_kept_key *keys;                /* [count], behind the last member */
  struct hmac_sha256_ctx url_keys[]; /* [url_count], to be copied for each message */
};

void api_key_digest(const char *key, uint8_t out[API_KEY_DIGEST]);

struct api_service {
  api_limits limits;
  api_store store;
  tw_parallel_for threads;
  const tw_parallel_for *parallel; /* NULL: there are no threads */
  tw_arena *arena;                 /* of the copied settings */
  api_keys *_Atomic keys;          /* in force; NULL without memory only */
  api_metrics metrics;
  api_page page;
  const char *cors_origins;
  atomic_bool is_draining;
  api_budget *budget;
  api_cache *cache;
  atomic_uint_fast64_t held[API_HELD_COUNT]; /* of the budget, by the host */
  atomic_uint_fast64_t faces, joint_times;   /* see api_usage */
  atomic_uint asked[API_ASKED];              /* hashes of requests, see response_cache.c */
};

#endif
