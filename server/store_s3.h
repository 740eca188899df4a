/* The shared store: a bucket of any S3-compatible object store, with copies on a local disk. */
#ifndef SRV_STORE_S3_H
#define SRV_STORE_S3_H

#include "config.h"
#include "disk_cache.h"

typedef struct srv_store_s3 srv_store_s3;

/* Tries the bucket. A bucket that refuses (credentials, name, region) is an error; one that cannot be reached
 * is tried again until it answers. folder: at --cache-dir, outlives the store. NULL with one line in
 * error. */
srv_store_s3 *srv_store_s3_open(const srv_config *config, srv_store_fs *folder, srv_error *error);
void srv_store_s3_close(srv_store_s3 *store); /* NULL accepted; blobs opened from it stay valid */

/* Whether the store could be opened; keeps nothing open. False with one line in error. */
bool srv_store_s3_check(const srv_config *config, srv_error *error);

/* The store's functions for the api; valid until close. Its probe succeeds once the bucket has been reached:
 * copies are served without the bucket, and no other replica would do better. */
api_store srv_store_s3_api(srv_store_s3 *store);

typedef struct srv_store_s3_load {
  bool is_reachable; /* as far as is known */
  uint64_t retries;
  srv_disk_cache_load cache;
} srv_store_s3_load;
srv_store_s3_load srv_store_s3_look(srv_store_s3 *store); /* any thread */

#endif
