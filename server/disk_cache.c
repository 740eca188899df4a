/* The copies are kept by a file store (store_fs.h), which writes each one atomically and checks its hash when
 * it is read. The modification time of a summary's file is the time at which its model was last used. When
 * the copies exceed the limit, the files in the folder are counted, and the least recently used are removed
 * down to nine tenths of the limit, so that counting is rare. The cache needs no list in memory, and its
 * folder outlives the daemon. */
#include "disk_cache.h"

#include "disk.h"

#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct srv_disk_cache {
  api_store folder;
  const char *root;
  uint64_t limit;
  atomic_uint_fast64_t bytes, hits, misses;
  pthread_mutex_t counting; /* held by the one thread that counts and removes */
};

typedef struct copy {
  char id[API_ID_TEXT];
  uint64_t bytes;
  int64_t used_ns; /* Unix time */
} copy;

typedef struct copies {
  const srv_disk_cache *cache;
  copy *list;
  size_t count, capacity;
  uint64_t bytes;
} copies;

/* Bytes that the file takes on disk, without its directory entry. */
static uint64_t disk_size(const struct stat *facts) {
  return (uint64_t)facts->st_blocks * 512;
}

static void summary_path(const srv_disk_cache *cache, const char *id, char path[PATH_MAX]) {
  snprintf(path, PATH_MAX, "%s/summaries/%.2s/%s", cache->root, id, id + 2);
}

/* A copy without a summary file counts as the oldest. False without memory. */
static bool add_copy(void *context, const char *id, const struct stat *object) {
  copies *all = context;
  if (strlen(id) != API_ID_TEXT - 1) return true;
  if (all->count == all->capacity) {
    size_t capacity = all->capacity > 0 ? 2 * all->capacity : 1024;
    copy *longer = realloc(all->list, capacity * sizeof *longer);
    if (!longer) return false;
    all->list = longer;
    all->capacity = capacity;
  }
  copy *c = &all->list[all->count++];
  char path[PATH_MAX];
  struct stat facts;
  *c = (copy){.bytes = disk_size(object)};
  memcpy(c->id, id, sizeof c->id);
  summary_path(all->cache, id, path);
  if (stat(path, &facts) == 0) {
    c->bytes += disk_size(&facts);
    c->used_ns = (int64_t)facts.st_mtim.tv_sec * 1000000000 + facts.st_mtim.tv_nsec;
  }
  all->bytes += c->bytes;
  return true;
}

static int compare_last_use(const void *a, const void *b) {
  int64_t first = ((const copy *)a)->used_ns, second = ((const copy *)b)->used_ns;
  return (first > second) - (first < second);
}

/* Counts the copies and, over the limit, removes the least recently used. One thread at a time does so;
 * others return at once. */
static void shrink(srv_disk_cache *cache) {
  copies all = {.cache = cache};
  char objects[PATH_MAX];
  if (pthread_mutex_trylock(&cache->counting) != 0) return;
  uint64_t before = atomic_load(&cache->bytes);
  snprintf(objects, sizeof objects, "%s/objects", cache->root);
  if (srv_each_file(objects, add_copy, &all)) {
    uint64_t bytes = all.bytes, aim = cache->limit - cache->limit / 10;
    if (bytes > cache->limit) qsort(all.list, all.count, sizeof *all.list, compare_last_use);
    for (size_t i = 0; all.bytes > cache->limit && i < all.count && bytes > aim; i++) {
      cache->folder.remove(cache->folder.context, all.list[i].id);
      bytes -= all.list[i].bytes;
    }
    /* Keeps what other threads added meanwhile. Copies that were counted too count twice until next time. */
    atomic_fetch_add(&cache->bytes, bytes - before);
  }
  free(all.list);
  pthread_mutex_unlock(&cache->counting);
}

srv_disk_cache *srv_disk_cache_create(srv_store_fs *folder, const char *root, uint64_t limit) {
  srv_disk_cache *cache = calloc(1, sizeof *cache);
  if (!cache) return NULL;
  cache->folder = srv_store_fs_api(folder);
  cache->root = root;
  cache->limit = limit;
  pthread_mutex_init(&cache->counting, NULL);
  shrink(cache);
  return cache;
}

void srv_disk_cache_destroy(srv_disk_cache *cache) {
  if (!cache) return;
  pthread_mutex_destroy(&cache->counting);
  free(cache);
}

void srv_disk_cache_put(srv_disk_cache *cache, const char *id, api_bytes bytes, const char *summary) {
  enum { SUMMARY_ROOM = 4096 };
  bool existed = false;
  if (cache->limit < SUMMARY_ROOM || bytes.size > cache->limit - SUMMARY_ROOM) return;
  api_store_status status =
      cache->folder.put(cache->folder.context, id, bytes, summary ? summary : "", &existed);
  if (status != API_STORE_OK || existed) return;
  uint64_t added = (bytes.size + 4095) / 4096 * 4096 + SUMMARY_ROOM;
  if (atomic_fetch_add(&cache->bytes, added) + added > cache->limit) shrink(cache);
}

bool srv_disk_cache_open(srv_disk_cache *cache, const char *id, api_blob *out) {
  bool is_hit = cache->folder.open(cache->folder.context, id, out) == API_STORE_OK;
  atomic_fetch_add(is_hit ? &cache->hits : &cache->misses, 1);
  if (!is_hit) return false;
  char path[PATH_MAX];
  summary_path(cache, id, path);
  utimensat(AT_FDCWD, path, NULL, 0);
  return true;
}

char *srv_disk_cache_summary(srv_disk_cache *cache, const char *id) {
  return cache->folder.summary(cache->folder.context, id);
}

void srv_disk_cache_forget(srv_disk_cache *cache, const char *id) {
  cache->folder.remove(cache->folder.context, id);
}

srv_disk_cache_load srv_disk_cache_look(srv_disk_cache *cache) {
  return (srv_disk_cache_load){atomic_load(&cache->bytes), cache->limit, atomic_load(&cache->hits),
                               atomic_load(&cache->misses)};
}
