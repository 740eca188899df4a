/* The service: settings, keys and caches that all requests share. */
#include "service.h"

#include "access.h"
#include "kept_answer.h"

#include <stdlib.h>
#include <string.h>

/* One part in so many of the cache's budget is for kept answers. */
enum { ANSWERS_PART = 16 };

/* Copies the keys as digests. */
static bool copy_keys(api_service *service, const char *const *keys) {
  size_t count = 0;
  while (keys && keys[count]) count++;
  service->key_digests = tw_arena_alloc(service->arena, count, sizeof *service->key_digests);
  if (!service->key_digests) return false;
  for (size_t i = 0; i < count; i++) api_key_digest(keys[i], service->key_digests[i]);
  service->key_count = count;
  return true;
}

api_service *api_service_create(const api_settings *settings) {
  api_service *service = tw_alloc_zero(1, sizeof *service);
  if (!service) return NULL;
  service->limits = settings->limits;
  service->store = settings->store;
  service->crew = settings->crew;
  atomic_init(&service->is_draining, false);
  service->arena = tw_arena_create();
  const char *origins = settings->cors_origins ? settings->cors_origins : "";
  if (service->arena) service->cors_origins = tw_arena_text(service->arena, origins, strlen(origins));
  uint64_t for_answers = settings->limits.plan_cache / ANSWERS_PART;
  service->cache = api_cache_create(settings->limits.plan_cache - for_answers);
  service->answers = api_kept_answers_create(for_answers);
  if (!service->cache || !service->answers || !service->cors_origins ||
      !copy_keys(service, settings->api_keys)) {
    api_service_destroy(service);
    return NULL;
  }
  return service;
}

void api_service_destroy(api_service *service) {
  if (!service) return;
  api_kept_answers_destroy(service->answers);
  api_cache_destroy(service->cache);
  tw_arena_destroy(service->arena);
  free(service);
}

void api_service_drain(api_service *service) {
  atomic_store(&service->is_draining, true);
}
