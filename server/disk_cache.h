/* Copies of models on a local disk, as many as fit, the ones that were used last. */
#ifndef SRV_DISK_CACHE_H
#define SRV_DISK_CACHE_H

#include "store_fs.h"

typedef struct srv_disk_cache srv_disk_cache;

/* limit: bytes on disk that the copies may take together. folder: keeps them; root: its path; both outlive
 * the cache. NULL without memory. */
srv_disk_cache *srv_disk_cache_create(srv_store_fs *folder, const char *root, uint64_t limit);
void srv_disk_cache_destroy(srv_disk_cache *cache); /* NULL accepted */

/* Any thread, from here on. */

/* Keeps a copy, where it can. summary: may be NULL. */
void srv_disk_cache_put(srv_disk_cache *cache, const char *id, api_bytes bytes, const char *summary);
/* False where there is no whole copy. */
bool srv_disk_cache_open(srv_disk_cache *cache, const char *id, api_blob *out);
/* As it was when the copy was made, malloc'ed; NULL without one. */
char *srv_disk_cache_summary(srv_disk_cache *cache, const char *id);
void srv_disk_cache_forget(srv_disk_cache *cache, const char *id);

typedef struct srv_disk_cache_load {
  uint64_t bytes, limit; /* on disk, as last counted and what came since */
  uint64_t hits, misses; /* of srv_disk_cache_open */
} srv_disk_cache_load;
srv_disk_cache_load srv_disk_cache_look(srv_disk_cache *cache);

#endif
