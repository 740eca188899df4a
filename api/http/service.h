/* What all requests share. */
#ifndef API_SERVICE_H
#define API_SERVICE_H

#include <stdatomic.h>

#include "api.h"
#include "cache.h"

enum { API_KEY_DIGEST = 32, API_ASKED = 4096 };

struct api_service {
  api_limits limits;
  api_store store;
  api_crew crew;
  tw_arena *arena; /* of the copied settings */
  size_t key_count;
  uint8_t (*key_digests)[API_KEY_DIGEST]; /* SHA-256 of each key: equal lengths to compare */
  const char *cors_origins;
  atomic_bool is_draining;
  api_budget *budget;
  api_cache *cache;
  atomic_uint asked[API_ASKED]; /* hashes of requests, see response_cache.c */
};

#endif
