/* Copies of models on a local disk: as many as the limit allows, least recently used first out. */
#ifndef SRV_DISK_CACHE_H
#define SRV_DISK_CACHE_H

#include "store_fs.h"

typedef struct srv_disk_cache srv_disk_cache;

/* folder: stores the copies; root: its path; both outlive the cache. limit: bytes on disk of all copies
 * together. NULL without memory. */
srv_disk_cache *srv_disk_cache_create(srv_store_fs *folder, const char *root, uint64_t limit);
void srv_disk_cache_destroy(srv_disk_cache *cache); /* NULL accepted */

/* Any thread may call the functions below. */

/* Keeps a copy if it fits and can be written. summary: may be NULL. */
void srv_disk_cache_put(srv_disk_cache *cache, const char *id, api_bytes bytes, const char *summary);
/* False when there is no copy with the right hash. */
bool srv_disk_cache_open(srv_disk_cache *cache, const char *id, api_blob *out);
/* The summary that the copy was made with, malloc'ed; NULL when there is none. */
char *srv_disk_cache_summary(srv_disk_cache *cache, const char *id);
void srv_disk_cache_forget(srv_disk_cache *cache, const char *id);

typedef struct srv_disk_cache_load {
  uint64_t bytes, limit; /* bytes: as last counted, plus copies made since */
  uint64_t hits, misses; /* of srv_disk_cache_open */
} srv_disk_cache_load;
srv_disk_cache_load srv_disk_cache_look(srv_disk_cache *cache);

#endif
