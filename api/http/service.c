/* The service: settings, keys and caches that all requests share. */
#include "service.h"

#include <cjson/cJSON.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>

/* ---- keys ------------------------------------------------------------------------------------ */

_Static_assert(API_KEY_DIGEST == SHA256_DIGEST_SIZE, "keys are compared by their SHA-256");

void api_key_digest(const char *key, uint8_t out[API_KEY_DIGEST]) {
  struct sha256_ctx hash;
  sha256_init(&hash);
  sha256_update(&hash, strlen(key), (const uint8_t *)key);
  sha256_digest(&hash, SHA256_DIGEST_SIZE, out);
}

static void digest_keyring(const api_keyring *keyring, uint8_t out[API_KEY_DIGEST]) {
  struct sha256_ctx hash;
  sha256_init(&hash);
  for (size_t i = 0; i < keyring->count; i++) {
    const api_key *key = &keyring->keys[i];
    const uint32_t numbers[] = {key->rights, key->rate.count, key->rate.period_s};
    sha256_update(&hash, strlen(key->text) + 1, (const uint8_t *)key->text);
    sha256_update(&hash, sizeof numbers, (const uint8_t *)numbers);
  }
  sha256_update(&hash, 1, (const uint8_t *)"");
  for (size_t i = 0; i < keyring->url_count; i++)
    sha256_update(&hash, strlen(keyring->url_keys[i].text) + 1, (const uint8_t *)keyring->url_keys[i].text);
  sha256_digest(&hash, API_KEY_DIGEST, out);
}

static api_keys *create_keys(const api_keyring *keyring) {
  size_t count = keyring->count, url_count = keyring->url_count;
  api_keys *set =
      tw_alloc_zero(1, sizeof *set + url_count * sizeof *set->url_keys + count * sizeof *set->keys);
  if (!set) return NULL;
  set->count = count;
  set->url_count = url_count;
  set->keys = (api_service_key *)(set->url_keys + url_count);
  for (size_t i = 0; i < count; i++) {
    const api_key *key = &keyring->keys[i];
    set->keys[i] = (api_service_key){.rights = key->rights, .rate = key->rate};
    set->has_rates |= key->rate.count > 0;
    api_key_digest(key->text, set->keys[i].digest);
  }
  for (size_t i = 0; i < url_count; i++)
    hmac_sha256_set_key(&set->url_keys[i], strlen(keyring->url_keys[i].text),
                        (const uint8_t *)keyring->url_keys[i].text);
  digest_keyring(keyring, set->digest);
  return set;
}

bool api_service_set_keys(api_service *service, const api_keyring *keyring) {
  api_keys *set = create_keys(keyring), *present = atomic_load(&service->keys);
  if (!set) return false;
  if (present && memcmp(present->digest, set->digest, API_KEY_DIGEST) == 0) {
    free(set);
  } else {
    set->older = present;
    atomic_store(&service->keys, set);
  }
  return true;
}

const api_keys *api_service_keys(const api_service *service) {
  return atomic_load(&service->keys);
}

static void destroy_keys(api_service *service) {
  for (api_keys *set = atomic_load(&service->keys); set;) {
    api_keys *older = set->older;
    free(set);
    set = older;
  }
}

/* ---- the service ----------------------------------------------------------------------------- */

static uint64_t relieve(void *cache, uint64_t bytes) {
  return api_cache_relieve(cache, bytes);
}

/* Runs a loop where the host has no threads. */
static void run_serially(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                         void *context) {
  (void)owner;
  for (uint32_t i = 0; i < count; i++) part(context, i);
}

static void *allocate_for_json(size_t size) {
  return tw_alloc(size, 1);
}

/* A copy of the text, "" for NULL; NULL without memory. */
static const char *keep_setting(const api_service *service, const char *text) {
  if (!text) text = "";
  return service->arena ? tw_arena_text(service->arena, text, strlen(text)) : NULL;
}

api_service *api_service_create(const api_settings *settings) {
  api_service *service = tw_alloc_zero(1, sizeof *service);
  if (!service) return NULL;
  cJSON_Hooks hooks = {allocate_for_json, tw_free};
  cJSON_InitHooks(&hooks); /* documents are charged to the request that reads them */
  service->limits = settings->limits;
  service->store = settings->store;
  service->metrics = settings->metrics;
  service->page = settings->page;
  service->docs = settings->docs;
  service->viewer = settings->viewer;
  service->example = settings->example;
  const api_parallel_for *parallel = &settings->parallel;
  service->parallel = (tw_parallel_for){parallel->owner, parallel->run ? parallel->run : run_serially,
                                        parallel->is_cancelled};
  atomic_init(&service->is_draining, false);
  service->arena = tw_arena_create();
  service->cors_origins = keep_setting(service, settings->cors_origins);
  service->hosts = keep_setting(service, settings->hosts);
  service->budget = api_budget_create(settings->limits.max_memory, settings->limits.max_waiting);
  if (service->budget) service->cache = api_cache_create(settings->limits.plan_cache, service->budget);
  if (!service->cache || !service->cors_origins || !service->hosts ||
      !api_service_set_keys(service, &settings->keyring)) {
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
  destroy_keys(service);
  free(service);
}

void api_service_drain(api_service *service) {
  atomic_store(&service->is_draining, true);
}

/* ---- memory and waiting ---------------------------------------------------------------------- */

void api_service_hold(api_service *service, api_held what, uint64_t bytes) {
  atomic_fetch_add(&service->held[what], bytes);
  api_budget_add(service->budget, bytes);
}

void api_service_let_go(api_service *service, api_held what, uint64_t bytes) {
  atomic_fetch_sub(&service->held[what], bytes);
  api_budget_subtract(service->budget, bytes);
}

bool api_service_try_hold(api_service *service, api_held what, uint64_t bytes) {
  bool is_held = api_budget_try_add(service->budget, bytes);
  if (is_held) atomic_fetch_add(&service->held[what], bytes);
  return is_held;
}

bool api_service_hold_live(api_service *service, uint64_t bytes) {
  atomic_uint_fast64_t *held = &service->held[API_HELD_LIVE];
  bool fits = atomic_fetch_add(held, bytes) + bytes <= service->limits.max_memory / 2 &&
              api_budget_add_evicting(service->budget, bytes);
  if (!fits) atomic_fetch_sub(held, bytes);
  return fits;
}

void api_service_usage(const api_service *service, api_usage *out) {
  api_cache_usage(service->cache, out);
  for (size_t i = 0; i < API_HELD_COUNT; i++) out->held[i] = atomic_load(&service->held[i]);
  out->granted = api_budget_granted(service->budget);
  out->faces = atomic_load(&service->faces);
  out->joint_times = atomic_load(&service->joint_times);
}

bool api_ticket_cancel(api_service *service, api_ticket *ticket) {
  return api_budget_cancel(service->budget, ticket) || api_cache_cancel(service->cache, ticket);
}

void api_ticket_end(api_service *service, api_ticket *ticket) {
  api_cache_end(service->cache, ticket);
  api_budget_grant(service->budget, ticket, 0);
}
