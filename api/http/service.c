/* The service: settings, keys and caches that all requests share. */
#include "service.h"

#include "access.h"

#include <stdlib.h>
#include <string.h>

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

static uint64_t relieve(void *cache, uint64_t bytes) {
  return api_cache_relieve(cache, bytes);
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
  service->budget = api_budget_create(settings->limits.max_memory, settings->limits.max_waiting);
  if (service->budget) service->cache = api_cache_create(settings->limits.plan_cache, service->budget);
  if (!service->cache || !service->cors_origins || !copy_keys(service, settings->api_keys)) {
    api_service_destroy(service);
    return NULL;
  }
  api_budget_relieved_by(service->budget, relieve, service->cache);
  return service;
}

void api_service_destroy(api_service *service) {
  if (!service) return;
  api_cache_destroy(service->cache);
  api_budget_destroy(service->budget);
  tw_arena_destroy(service->arena);
  free(service);
}

void api_service_drain(api_service *service) {
  atomic_store(&service->is_draining, true);
}

/* ---- memory and waiting -------------------------------------------------------------------------- */

void api_service_hold(api_service *service, uint64_t bytes) {
  api_budget_add(service->budget, bytes);
}

void api_service_let_go(api_service *service, uint64_t bytes) {
  api_budget_subtract(service->budget, bytes);
}

bool api_service_try_hold(api_service *service, uint64_t bytes) {
  return api_budget_try_add(service->budget, bytes);
}

bool api_ticket_cancel(api_service *service, api_ticket *ticket) {
  return api_budget_cancel(service->budget, ticket) || api_cache_cancel(service->cache, ticket);
}

void api_ticket_end(api_service *service, api_ticket *ticket) {
  api_cache_end(service->cache, ticket);
  api_budget_grant(service->budget, ticket, 0);
}
