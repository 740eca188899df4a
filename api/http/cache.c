/* The cache: a hash table of entries, a list of the idle ones by last use, one lock.
 *
 * An entry is listed while it is in the table; requests find only listed entries. It is idle when the table
 * holds the only reference. An entry that loses its last reference under the lock is added to the caller's
 * chain, which the caller destroys after unlocking: builds, destructors and wake-ups run without the lock. */
#include "cache.h"

#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { BUCKETS = 8192, CHAIN_MOST = 64, ID_LENGTH = API_ID_TEXT - 1 };

typedef enum entry_state {
  BUILDING, /* a thread is building the value */
  PROMISED, /* a request will build it, on a compute thread or once it has memory */
  READY,
  FAILED /* no longer listed; requests that waited read the fault */
} entry_state;

/* A model's id in the key of a listed entry, in a table by ids. */
typedef struct mention {
  struct mention *next, **link; /* link: what points to this one */
  const char *id;               /* [ID_LENGTH], in the key */
  api_entry *entry;
} mention;

struct api_entry {
  api_cache *cache;
  size_t references; /* of the table while listed, of each holder, of the ticket that promised it */
  uint32_t hash;
  entry_state state;
  bool is_listed;
  api_built built;
  api_fault fault;           /* of FAILED; a stall: nobody tried, each waiting request tries itself */
  api_ticket *waiting;       /* waiting for READY or FAILED */
  api_entry *next_promised;  /* promised by the same ticket */
  api_entry *next_in_bucket; /* or in a chain of entries to destroy */
  api_entry *newer, *older;  /* in the list of idle entries */
  size_t mention_count;
  mention *mentions; /* [mention_count], behind the key */
  char key[];
};

_Static_assert(offsetof(api_entry, key) % _Alignof(mention) == 0, "mentions follow the key");

/* The counts of one kind of values. */
typedef struct tally {
  atomic_uint_fast64_t bytes, hits, misses, evictions;
} tally;

struct api_cache {
  pthread_mutex_t lock;
  api_budget *budget;
  tally tallies[API_CACHED_COUNT]; /* atomic, not guarded by the lock */
  uint64_t idle_max, idle_size;
  api_entry *newest, *oldest; /* of the idle entries */
  api_entry *buckets[BUCKETS];
  mention *mentions[BUCKETS];
};

api_cache *api_cache_create(uint64_t idle_max, api_budget *budget) {
  api_cache *cache = tw_alloc_zero(1, sizeof *cache);
  if (!cache) return NULL;
  cache->idle_max = idle_max;
  cache->budget = budget;
  if (pthread_mutex_init(&cache->lock, NULL) == 0) return cache;
  free(cache);
  return NULL;
}

/* ---- the table; under the lock --------------------------------------------------------------- */

/* Eight bytes at a time, multiplied and folded. Keys chosen to collide fill one bucket, which
 * evict_from_full_bucket keeps short. */
uint32_t api_cache_hash(const char *key) {
  static const uint64_t odd = 0x9E3779B97F4A7C15;
  size_t length = strlen(key);
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

/* The place in the table of an id. Seeded, as clients may choose ids. */
static mention **mentions_of(api_cache *cache, const char *id) {
  uint64_t hash = (uintptr_t)cache, word;
  for (size_t i = 0; i < ID_LENGTH; i += sizeof word) {
    memcpy(&word, id + i, sizeof word);
    hash = (hash ^ word) * UINT64_C(0x9E3779B97F4A7C15);
    hash ^= hash >> 32;
  }
  return &cache->mentions[hash % BUCKETS];
}

static bool is_id(const char *text) {
  for (size_t i = 0; i < ID_LENGTH; i++)
    if (!(text[i] >= '0' && text[i] <= '9') && !(text[i] >= 'a' && text[i] <= 'f')) return false;
  return true;
}

/* The first id in the key that a '/' at `from` or behind it follows; NULL: none. */
static const char *next_mention(const char *key, const char *from) {
  for (const char *end = strchr(from, '/'); end; end = strchr(end + 1, '/'))
    if (end - key >= ID_LENGTH && is_id(end - ID_LENGTH)) return end - ID_LENGTH;
  return NULL;
}

static void link_mentions(api_cache *cache, api_entry *entry) {
  const char *id = next_mention(entry->key, entry->key);
  for (size_t i = 0; i < entry->mention_count; i++) {
    mention **place = mentions_of(cache, id), *m = &entry->mentions[i];
    *m = (mention){.next = *place, .link = place, .id = id, .entry = entry};
    if (m->next) m->next->link = &m->next;
    *place = m;
    id = next_mention(entry->key, id + ID_LENGTH + 1);
  }
}

static void unlink_mentions(api_entry *entry) {
  for (size_t i = 0; i < entry->mention_count; i++) {
    mention *m = &entry->mentions[i];
    *m->link = m->next;
    if (m->next) m->next->link = m->link;
  }
}

static bool is_idle(const api_entry *entry) {
  return entry->is_listed && entry->state == READY && entry->references == 1;
}

static void link_idle(api_cache *cache, api_entry *entry) {
  entry->older = cache->newest;
  *(cache->newest ? &cache->newest->newer : &cache->oldest) = entry;
  cache->newest = entry;
  cache->idle_size += entry->built.size;
}

static void unlink_idle(api_cache *cache, api_entry *entry) {
  *(entry->newer ? &entry->newer->older : &cache->newest) = entry->older;
  *(entry->older ? &entry->older->newer : &cache->oldest) = entry->newer;
  entry->newer = entry->older = NULL;
  cache->idle_size -= entry->built.size;
}

/* Adds an entry that has no references to the chain. */
static void add_to_chain(api_entry *entry, api_entry **chain) {
  entry->next_in_bucket = *chain;
  *chain = entry;
}

/* Removes the entry from the table, and the table's reference. */
static void unlist(api_cache *cache, api_entry *entry, api_entry **chain) {
  if (is_idle(entry)) unlink_idle(cache, entry);
  unlink_bucket(cache, entry);
  unlink_mentions(entry);
  entry->is_listed = false;
  if (--entry->references == 0) add_to_chain(entry, chain);
}

static tally *tally_of(api_cache *cache, const api_built *built) {
  return &cache->tallies[built->kind];
}

/* Unlists an idle entry to make room, and counts that. */
static void evict(api_cache *cache, api_entry *entry, api_entry **chain) {
  atomic_fetch_add(&tally_of(cache, &entry->built)->evictions, 1);
  unlist(cache, entry, chain);
}

/* Takes a reference to a READY entry, and moves the entry to the front of its bucket: a bucket's entries
 * stand in the order of their last use, as evict_from_full_bucket needs it. */
static void touch(api_cache *cache, api_entry *entry) {
  atomic_fetch_add(&tally_of(cache, &entry->built)->hits, 1);
  if (is_idle(entry)) unlink_idle(cache, entry);
  entry->references++;
  if (*bucket_of(cache, entry->hash) == entry) return;
  unlink_bucket(cache, entry);
  link_first(cache, entry);
}

/* Drops a reference. If that makes the entry idle, the oldest idle entries are evicted down to idle_max; an
 * entry larger than idle_max is itself evicted, and no other entry for it. */
static void drop(api_cache *cache, api_entry *entry, api_entry **chain) {
  entry->references--;
  if (!entry->is_listed && entry->references == 0) {
    add_to_chain(entry, chain);
  } else if (is_idle(entry)) {
    link_idle(cache, entry);
    if (entry->built.size > cache->idle_max) evict(cache, entry, chain);
    while (cache->idle_size > cache->idle_max) evict(cache, cache->oldest, chain);
  }
}

/* Evicts the least recently used idle entry of a full bucket: keys that are chosen to collide evict each
 * other instead of making every look-up slow. */
static void evict_from_full_bucket(api_cache *cache, uint32_t hash, api_entry **chain) {
  uint32_t length = 0;
  api_entry *last = NULL;
  for (api_entry *entry = *bucket_of(cache, hash); entry; entry = entry->next_in_bucket, length++)
    if (is_idle(entry)) last = entry;
  if (length >= CHAIN_MOST && last) evict(cache, last, chain);
}

/* Lists a new entry, with a reference for the caller. NULL without memory. */
static api_entry *add(api_cache *cache, const char *key, uint32_t hash, api_entry **chain) {
  size_t length = strlen(key) + 1, count = 0;
  for (const char *id = next_mention(key, key); id; id = next_mention(key, id + ID_LENGTH + 1)) count++;
  size_t aligned = (length + _Alignof(mention) - 1) / _Alignof(mention) * _Alignof(mention);
  api_entry *entry = calloc(1, sizeof *entry + aligned + count * sizeof(mention));
  if (!entry) return NULL;
  memcpy(entry->key, key, length);
  entry->mention_count = count;
  entry->mentions = (mention *)(void *)(entry->key + aligned);
  entry->cache = cache;
  entry->hash = hash;
  entry->state = BUILDING;
  entry->references = 2;
  entry->is_listed = true;
  evict_from_full_bucket(cache, hash, chain);
  link_first(cache, entry);
  link_mentions(cache, entry);
  return entry;
}

/* The bytes of an entry beside its value. */
static size_t own_size(const api_entry *entry) {
  return sizeof *entry + strlen(entry->key) + entry->mention_count * sizeof(mention);
}

/* ---- outside the lock ------------------------------------------------------------------------ */

/* Counts a value as the cache's; until now it was charged to the work that made it. */
static void add_bytes(api_cache *cache, const api_built *built) {
  tw_meter_give_back(built->size);
  atomic_fetch_add(&tally_of(cache, built)->bytes, built->size);
  api_budget_add(cache->budget, built->size);
}

static uint64_t destroy_chain(api_cache *cache, api_entry *entry) {
  uint64_t freed = 0;
  tw_meter *meter = tw_meter_use(NULL); /* the entries are not of the work that makes room */
  while (entry) {
    api_entry *next = entry->next_in_bucket;
    if (entry->state == READY) {
      if (entry->built.destroy) entry->built.destroy(entry->built.value);
      atomic_fetch_sub(&tally_of(cache, &entry->built)->bytes, entry->built.size);
      freed += entry->built.size;
    }
    free(entry);
    entry = next;
  }
  tw_meter_use(meter);
  if (freed > 0) api_budget_subtract(cache->budget, freed);
  return freed;
}

static void wake_all(api_ticket *ticket) {
  while (ticket) {
    api_ticket *next = ticket->next;
    ticket->next = NULL;
    ticket->wake(ticket);
    ticket = next;
  }
}

void api_cache_destroy(api_cache *cache) {
  if (!cache) return;
  api_entry *chain = NULL;
  while (cache->oldest) unlist(cache, cache->oldest, &chain);
  destroy_chain(cache, chain);
  for (size_t i = 0; i < BUCKETS; i++) assert(!cache->buckets[i]);
  pthread_mutex_destroy(&cache->lock);
  free(cache);
}

/* ---- promises and waiting -------------------------------------------------------------------- */

/* Under the lock: makes the entry READY or FAILED. Returns the tickets that waited, for the caller to
 * wake. */
static api_ticket *settle(api_entry *entry, entry_state state) {
  api_ticket *waiting = entry->waiting;
  entry->waiting = NULL;
  entry->state = state;
  for (api_ticket *t = waiting; t; t = t->next) t->is_waiting_for_entry = false;
  return waiting;
}

static void promise(api_entry *entry, api_ticket *ticket) {
  entry->state = PROMISED;
  entry->next_promised = ticket->promised;
  ticket->promised = entry;
}

/* Under the lock: ends the ticket's promise of the entry. False where the promise is another ticket's. */
static bool take_promise_back(api_entry *entry, api_ticket *ticket) {
  api_entry **link = &ticket->promised;
  while (*link && *link != entry) link = &(*link)->next_promised;
  if (!*link) return false;
  *link = entry->next_promised;
  entry->next_promised = NULL;
  return true;
}

/* Under the lock: fails the entry without a value and drops the caller's reference. Returns as settle
 * does. */
static api_ticket *give_up(api_cache *cache, api_entry *entry, const api_fault *fault, api_entry **chain) {
  if (entry->is_listed) unlist(cache, entry, chain);
  entry->fault = *fault;
  entry->fault.awaited = NULL;
  api_ticket *waiting = settle(entry, FAILED);
  drop(cache, entry, chain);
  return waiting;
}

/* The fault of an entry that was not built for a reason of its builder's alone: requests that waited for the
 * entry try themselves. */
static const api_fault UNTRIED = {.stall = API_STALL_ENTRY};

/* Breaks the ticket's promises: tickets that waited are woken and build the entries themselves. */
static void break_promises(api_cache *cache, api_ticket *ticket) {
  while (ticket->promised) {
    api_entry *entry = ticket->promised, *chain = NULL;
    pthread_mutex_lock(&cache->lock);
    take_promise_back(entry, ticket);
    api_ticket *woken = give_up(cache, entry, &UNTRIED, &chain);
    pthread_mutex_unlock(&cache->lock);
    wake_all(woken);
    destroy_chain(cache, chain);
  }
}

api_wait api_cache_wait(api_cache *cache, api_ticket *ticket, api_entry *awaited) {
  /* A ticket that waits keeps no promise: two could wait for each other. */
  break_promises(cache, ticket);
  api_entry_release(ticket->awaited);
  ticket->awaited = awaited;
  pthread_mutex_lock(&cache->lock);
  bool waits = awaited->state == BUILDING || awaited->state == PROMISED;
  if (waits) {
    ticket->is_waiting_for_entry = true;
    ticket->previous = NULL;
    ticket->next = awaited->waiting;
    if (ticket->next) ticket->next->previous = ticket;
    awaited->waiting = ticket;
  }
  pthread_mutex_unlock(&cache->lock);
  return waits ? API_WAIT_BEGUN : API_WAIT_OVER;
}

bool api_cache_cancel(api_cache *cache, api_ticket *ticket) {
  pthread_mutex_lock(&cache->lock);
  bool waited = ticket->is_waiting_for_entry;
  if (waited) {
    *(ticket->previous ? &ticket->previous->next : &ticket->awaited->waiting) = ticket->next;
    if (ticket->next) ticket->next->previous = ticket->previous;
    ticket->previous = ticket->next = NULL;
    ticket->is_waiting_for_entry = false;
  }
  pthread_mutex_unlock(&cache->lock);
  return waited;
}

void api_cache_end(api_cache *cache, api_ticket *ticket) {
  break_promises(cache, ticket);
  api_entry_release(ticket->awaited);
  ticket->awaited = NULL;
}

/* ---- taking ---------------------------------------------------------------------------------- */

api_entry *api_cache_peek(api_cache *cache, const char *key) {
  uint32_t hash = api_cache_hash(key);
  pthread_mutex_lock(&cache->lock);
  api_entry *entry = find(cache, key, hash);
  if (entry && entry->state != READY) entry = NULL;
  if (entry) touch(cache, entry);
  pthread_mutex_unlock(&cache->lock);
  return entry;
}

/* Builds the value of an entry that the caller holds, without the lock. A build that stalls for memory leaves
 * the entry promised by its ticket, so that the other requests wait for the entry and only one for memory. */
static api_entry *build_entry(api_cache *cache, api_entry *entry, api_ticket *ticket, api_build build,
                              void *context, api_fault *fault) {
  api_built built = {0};
  bool is_built = build(context, &built, fault);
  if (!is_built) api_fault_without_grant(fault);
  built.size += own_size(entry);
  if (is_built) {
    atomic_fetch_add(&tally_of(cache, &built)->misses, 1);
    add_bytes(cache, &built);
  }
  api_ticket *woken = NULL;
  api_entry *chain = NULL;
  pthread_mutex_lock(&cache->lock);
  if (is_built) {
    entry->built = built;
    woken = settle(entry, READY);
  } else if (fault->stall == API_STALL_MEMORY) {
    promise(entry, ticket); /* the promise takes over the caller's reference */
  } else {
    /* A build is cancelled when its own request has used up its time; the other requests may have time left.
     */
    woken = give_up(cache, entry, fault->error.status == TW_CANCELLED ? &UNTRIED : fault, &chain);
  }
  pthread_mutex_unlock(&cache->lock);
  wake_all(woken);
  destroy_chain(cache, chain);
  return is_built ? entry : NULL;
}

/* Under the lock: ends the ticket's wait, if it was for this key. Returns the entry with the ticket's
 * reference if it is READY and still listed. A failed build fills the fault: all requests that waited for it
 * fail alike, unless the build was cancelled. */
static api_entry *take_awaited(api_cache *cache, const char *key, api_ticket *ticket, api_fault *fault,
                               api_entry **chain) {
  api_entry *awaited = ticket->awaited;
  if (!awaited || strcmp(awaited->key, key) != 0) return NULL;
  ticket->awaited = NULL;
  if (awaited->state == READY && awaited->is_listed) return awaited;
  if (awaited->state == FAILED && awaited->fault.stall == API_STALL_NONE) *fault = awaited->fault;
  drop(cache, awaited, chain);
  return NULL;
}

/* Under the lock: this ticket, which has a reference, is to build the entry. A heavy call builds it now and
 * gets it back; a light call promises it. */
static api_entry *begin_build(api_entry *entry, api_ticket *ticket, api_effort effort, api_fault *fault) {
  if (effort == API_HEAVY) {
    entry->state = BUILDING;
    return entry;
  }
  promise(entry, ticket);
  fault->stall = API_STALL_THREAD;
  return NULL;
}

api_entry *api_cache_take(api_cache *cache, const char *key, api_ticket *ticket, api_effort effort,
                          api_build build, void *context, api_fault *fault) {
  *fault = (api_fault){0};
  uint32_t hash = api_cache_hash(key);
  api_entry *chain = NULL, *to_build = NULL, *entry = NULL;
  pthread_mutex_lock(&cache->lock);
  api_entry *ready = take_awaited(cache, key, ticket, fault, &chain);
  bool is_settled = ready || fault->status != 0;
  if (!is_settled) entry = find(cache, key, hash);
  if (!is_settled && !entry) {
    entry = add(cache, key, hash, &chain);
    if (entry)
      to_build = begin_build(entry, ticket, effort, fault);
    else
      api_fault_without_memory(fault);
  } else if (entry && entry->state == READY) {
    touch(cache, entry);
    ready = entry;
  } else if (entry && entry->state == PROMISED && take_promise_back(entry, ticket)) {
    to_build = begin_build(entry, ticket, effort, fault);
  } else if (entry) {
    entry->references++;
    fault->stall = API_STALL_ENTRY;
    fault->awaited = entry;
  }
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(cache, chain);
  return to_build ? build_entry(cache, to_build, ticket, build, context, fault) : ready;
}

void api_cache_put(api_cache *cache, const char *key, const api_built *built) {
  uint32_t hash = api_cache_hash(key);
  api_entry *chain = NULL;
  pthread_mutex_lock(&cache->lock);
  api_entry *entry = find(cache, key, hash) ? NULL : add(cache, key, hash, &chain);
  if (entry) {
    entry->built = *built;
    entry->built.size += own_size(entry);
    entry->state = READY;
    add_bytes(cache, &entry->built);
    drop(cache, entry, &chain);
  }
  pthread_mutex_unlock(&cache->lock);
  if (!entry) built->destroy(built->value);
  destroy_chain(cache, chain);
}

api_entry *api_cache_own(api_cache *cache, const api_built *built) {
  api_entry *entry = calloc(1, sizeof *entry + 1);
  if (!entry) {
    built->destroy(built->value);
    return NULL;
  }
  entry->cache = cache;
  entry->references = 1;
  entry->state = READY;
  entry->built = *built;
  add_bytes(cache, built);
  return entry;
}

void *api_entry_value(const api_entry *entry) {
  return entry->built.value;
}

void api_entry_release(api_entry *entry) {
  if (!entry) return;
  api_cache *cache = entry->cache;
  api_entry *chain = NULL;
  pthread_mutex_lock(&cache->lock);
  drop(cache, entry, &chain);
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(cache, chain);
  api_budget_poke(cache->budget); /* a newly idle entry can make room for waiting requests */
}

uint64_t api_cache_relieve(api_cache *cache, uint64_t bytes) {
  api_entry *chain = NULL;
  uint64_t freed = 0;
  pthread_mutex_lock(&cache->lock);
  for (; cache->oldest && freed < bytes; evict(cache, cache->oldest, &chain))
    freed += cache->oldest->built.size;
  pthread_mutex_unlock(&cache->lock);
  return destroy_chain(cache, chain);
}

void api_cache_forget(api_cache *cache, const char *id) {
  api_entry *chain = NULL;
  pthread_mutex_lock(&cache->lock);
  for (mention *m = *mentions_of(cache, id); m;) {
    bool is_of = memcmp(m->id, id, ID_LENGTH) == 0;
    if (is_of) unlist(cache, m->entry, &chain);
    m = is_of ? *mentions_of(cache, id) : m->next; /* a key may mention an id twice */
  }
  pthread_mutex_unlock(&cache->lock);
  destroy_chain(cache, chain);
}

uint64_t api_cache_idle_size(api_cache *cache) {
  pthread_mutex_lock(&cache->lock);
  uint64_t size = cache->idle_size;
  pthread_mutex_unlock(&cache->lock);
  return size;
}

void api_cache_usage(api_cache *cache, api_usage *out) {
  for (size_t i = 0; i < API_CACHED_COUNT; i++) {
    out->cached[i].bytes = atomic_load(&cache->tallies[i].bytes);
    out->cached[i].hits = atomic_load(&cache->tallies[i].hits);
    out->cached[i].misses = atomic_load(&cache->tallies[i].misses);
    out->cached[i].evictions = atomic_load(&cache->tallies[i].evictions);
  }
}
