/* The cache: a hash table of entries, a list of them by use, one lock. Builds run outside the lock.
 *
 * The table holds what it lists, as users do. Only under the lock does a reference come from the table, so
 * that what the table alone holds stays so until the lock is given back; whoever lets go of the last
 * reference frees the entry, with the lock or without it. */
#include "cache.h"

#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { BUCKETS = 8192, CHAIN_MOST = 64 };

typedef enum entry_state { BUILDING, READY, FAILED } entry_state;

struct api_entry {
  api_cache *cache; /* NULL: of one request's own */
  atomic_uint references;
  uint32_t hash;
  entry_state state;
  bool is_listed; /* in the table: others may find it */
  api_built built;
  api_fault fault; /* of a failed build */
  api_entry *next_in_bucket;
  api_entry *newer, *older; /* by last use */
  char key[];
};

struct api_cache {
  pthread_mutex_t lock;
  pthread_cond_t built; /* some entry has left BUILDING */
  uint64_t budget;
  atomic_uint_fast64_t size; /* of the complete entries; changes under the lock */
  api_entry *newest, *oldest;
  api_entry *buckets[BUCKETS];
};

api_cache *api_cache_create(uint64_t budget) {
  api_cache *cache = tw_alloc_zero(1, sizeof *cache);
  if (!cache) return NULL;
  cache->budget = budget;
  if (pthread_mutex_init(&cache->lock, NULL) != 0) {
    free(cache);
    return NULL;
  }
  if (pthread_cond_init(&cache->built, NULL) != 0) {
    pthread_mutex_destroy(&cache->lock);
    free(cache);
    return NULL;
  }
  return cache;
}

/* ---- the table and the list; under the lock --------------------------------------------------- */

/* Eight bytes at a time, multiplied and folded. Keys that were chosen to collide meet in crowd_out. */
uint32_t api_cache_hash(const char *key, size_t length) {
  static const uint64_t odd = 0x9E3779B97F4A7C15;
  uint64_t hash = 0, word = 0;
  for (; length >= sizeof word; length -= sizeof word, key += sizeof word) {
    memcpy(&word, key, sizeof word);
    hash = (hash ^ word) * odd;
    hash ^= hash >> 32;
  }
  word = length;
  memcpy(&word, key, length);
  hash = (hash ^ word) * odd;
  return (uint32_t)(hash >> 32);
}

static api_entry **bucket_of(api_cache *cache, uint32_t hash) {
  return &cache->buckets[hash % BUCKETS];
}

static api_entry *find(api_cache *cache, const char *key, uint32_t hash) {
  api_entry *entry = *bucket_of(cache, hash);
  while (entry && (entry->hash != hash || strcmp(entry->key, key) != 0)) entry = entry->next_in_bucket;
  return entry;
}

static void unlink_use(api_cache *cache, api_entry *entry) {
  *(entry->newer ? &entry->newer->older : &cache->newest) = entry->older;
  *(entry->older ? &entry->older->newer : &cache->oldest) = entry->newer;
  entry->newer = entry->older = NULL;
}

static void link_newest(api_cache *cache, api_entry *entry) {
  entry->older = cache->newest;
  *(cache->newest ? &cache->newest->newer : &cache->oldest) = entry;
  cache->newest = entry;
}

static void link_first(api_cache *cache, api_entry *entry) {
  api_entry **bucket = bucket_of(cache, entry->hash);
  entry->next_in_bucket = *bucket;
  *bucket = entry;
}

static void unlink_bucket(api_cache *cache, api_entry *entry) {
  api_entry **link = bucket_of(cache, entry->hash);
  while (*link != entry) link = &(*link)->next_in_bucket;
  *link = entry->next_in_bucket;
  entry->next_in_bucket = NULL;
}

static void list_entry(api_cache *cache, api_entry *entry) {
  link_first(cache, entry);
  link_newest(cache, entry);
  entry->is_listed = true;
  atomic_fetch_add(&entry->references, 1);
}

/* Takes the entry out of table, list and account. True when nobody else holds it: it is to be destroyed,
 * outside the lock. */
static bool unlist_entry(api_cache *cache, api_entry *entry) {
  unlink_bucket(cache, entry);
  unlink_use(cache, entry);
  entry->is_listed = false;
  if (entry->state == READY) atomic_fetch_sub(&cache->size, entry->built.size);
  return atomic_fetch_sub(&entry->references, 1) == 1;
}

/* Whether only the table holds the entry, which is listed. */
static bool is_unheld(const api_entry *entry) {
  return atomic_load(&entry->references) == 1;
}

/* Frees an entry that nobody holds. */
static void destroy_entry(api_entry *entry) {
  if (entry->state == READY && entry->built.destroy) entry->built.destroy(entry->built.value);
  free(entry);
}

/* Takes unheld entries, oldest first, out of the table until the rest fits; returns them chained by
 * next_in_bucket, to be destroyed outside the lock. */
static api_entry *evict(api_cache *cache) {
  api_entry *evicted = NULL;
  for (api_entry *entry = cache->oldest; entry && cache->size > cache->budget;) {
    api_entry *newer = entry->newer;
    if (is_unheld(entry) && unlist_entry(cache, entry)) {
      entry->next_in_bucket = evicted;
      evicted = entry;
    }
    entry = newer;
  }
  return evicted;
}

/* Takes out of a full chain the unheld entry that was used least recently: queries that are chosen to have
 * one hash drive out each other, instead of making every look-up a long walk. NULL for none. */
static api_entry *crowd_out(api_cache *cache, uint32_t hash) {
  uint32_t length = 0;
  api_entry *last = NULL;
  for (api_entry *entry = *bucket_of(cache, hash); entry; entry = entry->next_in_bucket, length++)
    if (is_unheld(entry)) last = entry;
  return length >= CHAIN_MOST && last && unlist_entry(cache, last) ? last : NULL;
}

static void destroy_chain(api_entry *entry) {
  while (entry) {
    api_entry *next = entry->next_in_bucket;
    destroy_entry(entry);
    entry = next;
  }
}

void api_cache_destroy(api_cache *cache) {
  if (!cache) return;
  while (cache->oldest) {
    api_entry *entry = cache->oldest;
    bool is_last = unlist_entry(cache, entry);
    assert(is_last);
    (void)is_last;
    destroy_entry(entry);
  }
  pthread_cond_destroy(&cache->built);
  pthread_mutex_destroy(&cache->lock);
  free(cache);
}

/* ---- use --------------------------------------------------------------------------------------- */

/* Chains are in the order of use as well, see crowd_out. */
static void touch(api_cache *cache, api_entry *entry) {
  atomic_fetch_add(&entry->references, 1);
  if (*bucket_of(cache, entry->hash) != entry) {
    unlink_bucket(cache, entry);
    link_first(cache, entry);
  }
  if (cache->newest != entry) {
    unlink_use(cache, entry);
    link_newest(cache, entry);
  }
}

bool api_cache_peek_all(api_cache *cache, const api_cache_key *keys, size_t count, api_entry **out) {
  size_t found = 0;
  pthread_mutex_lock(&cache->lock);
  for (; found < count; found++) {
    out[found] = find(cache, keys[found].text, keys[found].hash);
    if (!out[found] || out[found]->state != READY) break;
  }
  bool is_all = found == count;
  for (size_t i = 0; is_all && i < count; i++) touch(cache, out[i]);
  pthread_mutex_unlock(&cache->lock);
  return is_all;
}

api_entry *api_cache_peek(api_cache *cache, const char *key) {
  api_entry *entry;
  const api_cache_key hashed = {key, api_cache_hash(key, strlen(key))};
  return api_cache_peek_all(cache, &hashed, 1, &entry) ? entry : NULL;
}

/* Waits, under the lock, until another thread has built the entry that is held. */
static api_entry *await(api_cache *cache, api_entry *entry, api_fault *fault) {
  while (entry->state == BUILDING) pthread_cond_wait(&cache->built, &cache->lock);
  if (entry->state == READY) {
    pthread_mutex_unlock(&cache->lock);
    return entry;
  }
  *fault = entry->fault;
  pthread_mutex_unlock(&cache->lock);
  api_entry_release(entry);
  return NULL;
}

/* Runs the build of a listed entry, which is held, outside the lock. */
static api_entry *build_entry(api_cache *cache, api_entry *entry, api_build build, void *context,
                              api_fault *fault) {
  api_built built = {0};
  bool is_built = build(context, &built, fault);
  pthread_mutex_lock(&cache->lock);
  entry->built = built;
  entry->built.size += sizeof *entry + strlen(entry->key);
  entry->fault = *fault;
  if (!is_built && entry->is_listed) unlist_entry(cache, entry); /* the caller still holds it */
  entry->state = is_built ? READY : FAILED;
  if (is_built && entry->is_listed) atomic_fetch_add(&cache->size, entry->built.size);
  api_entry *evicted = evict(cache);
  pthread_cond_broadcast(&cache->built);
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(evicted);
  if (is_built) return entry;
  api_entry_release(entry);
  return NULL;
}

api_entry *api_cache_take(api_cache *cache, const char *key, api_build build, void *context,
                          api_fault *fault) {
  *fault = (api_fault){0};
  size_t length = strlen(key) + 1;
  uint32_t hash = api_cache_hash(key, length - 1);
  pthread_mutex_lock(&cache->lock);
  api_entry *entry = find(cache, key, hash);
  if (entry) {
    touch(cache, entry);
    return await(cache, entry, fault);
  }
  entry = calloc(1, sizeof *entry + length);
  if (!entry) {
    pthread_mutex_unlock(&cache->lock);
    api_fault_without_memory(fault);
    return NULL;
  }
  memcpy(entry->key, key, length);
  entry->cache = cache;
  entry->hash = hash;
  atomic_init(&entry->references, 1);
  entry->state = BUILDING;
  api_entry *crowded_out = crowd_out(cache, hash);
  list_entry(cache, entry);
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(crowded_out);
  return build_entry(cache, entry, build, context, fault);
}

api_entry *api_entry_create(const api_built *built) {
  api_entry *entry = calloc(1, sizeof *entry + 1);
  if (!entry) {
    built->destroy(built->value);
    return NULL;
  }
  atomic_init(&entry->references, 1);
  entry->state = READY;
  entry->built = *built;
  return entry;
}

void *api_entry_value(const api_entry *entry) {
  return entry->built.value;
}

void api_entry_hold(api_entry *entry) {
  atomic_fetch_add(&entry->references, 1);
}

/* What was over the budget while it was held goes when the table alone holds it. */
static void fit_budget(api_cache *cache) {
  if (atomic_load(&cache->size) <= cache->budget) return;
  pthread_mutex_lock(&cache->lock);
  api_entry *evicted = evict(cache);
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(evicted);
}

void api_entry_release(api_entry *entry) {
  if (!entry) return;
  api_cache *cache = entry->cache;
  uint32_t left = atomic_fetch_sub(&entry->references, 1) - 1;
  if (left == 0)
    destroy_entry(entry);
  else if (left == 1 && cache)
    fit_budget(cache);
}

void api_cache_forget(api_cache *cache, const char *part) {
  api_entry *gone = NULL;
  pthread_mutex_lock(&cache->lock);
  for (api_entry *entry = cache->oldest; entry;) {
    api_entry *newer = entry->newer;
    if (strstr(entry->key, part)) {
      if (unlist_entry(cache, entry)) {
        entry->next_in_bucket = gone;
        gone = entry;
      }
    }
    entry = newer;
  }
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(gone);
}

uint64_t api_cache_size(api_cache *cache) {
  return atomic_load(&cache->size);
}
