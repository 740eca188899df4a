/* The service: settings, keys and caches that all requests share. */
#ifndef API_SERVICE_H
#define API_SERVICE_H

#include <nettle/hmac.h>
#include <stdatomic.h>

#include "api.h"
#include "cache.h"

enum { API_KEY_DIGEST = 32, API_ASKED = 4096 };

typedef struct api_service_key {
  uint8_t digest[API_KEY_DIGEST]; /* SHA-256 of the key; equal lengths for comparing */
  unsigned rights;
  api_rate rate;
} api_service_key;

struct api_keys {
  struct api_keys *older;         /* the keys before these, which requests may still use */
  uint8_t digest[API_KEY_DIGEST]; /* of the keyring */
  size_t count, url_count;
  bool has_rates;                    /* whether a key has a rate */
  api_service_key *keys;             /* [count], in the memory behind url_keys */
  struct hmac_sha256_ctx url_keys[]; /* [url_count], copied for each message */
};

void api_key_digest(const char *key, uint8_t out[API_KEY_DIGEST]);

struct api_service {
  api_limits limits;
  api_store store;
  tw_parallel_for parallel;
  tw_arena *arena;        /* holds the copied settings */
  api_keys *_Atomic keys; /* in force; NULL only without memory */
  api_metrics metrics;
  api_page page, docs, example, viewer;
  const char *cors_origins, *hosts;
  atomic_bool is_draining;
  api_budget *budget;
  api_cache *cache;
  atomic_uint_fast64_t held[API_HELD_COUNT]; /* by the host, part of the budget's sum */
  atomic_uint_fast64_t faces, joint_times;   /* see api_usage */
  atomic_uint asked[API_ASKED];              /* hashes of requests, see response_cache.c */
};

#endif
