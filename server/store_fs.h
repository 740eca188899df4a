/* The embedded store: a folder of content-addressed files, which several daemons may share. */
#ifndef SRV_STORE_FS_H
#define SRV_STORE_FS_H

#include "api.h"
#include "config.h"
#include "fail.h"

typedef struct srv_store_fs srv_store_fs;

/* Opens the folder, creating it and its missing parents, and removes the temporary files that uploads left
 * which were killed over an hour ago. flag: the flag that names the folder, for errors. NULL with one line in
 * error. */
srv_store_fs *srv_store_fs_open(const char *flag, const char *root, srv_error *error);
/* Whether srv_store_fs_open could succeed, as far as access rights tell; creates nothing. False with one line
 * in error. */
bool srv_store_fs_check(const char *flag, const char *root, srv_error *error);
void srv_store_fs_close(srv_store_fs *store); /* NULL accepted; blobs opened from it stay valid */

/* Sets the limit for the bytes of all models together, 0: no limit; and the bytes that stay free on the disk,
 * 0: none, SRV_MIN_FREE_AUTO: 1 GiB, or 5 % of a smaller file system. Before the first call of the store. */
void srv_store_fs_limit(srv_store_fs *store, uint64_t bytes, uint64_t min_free);
/* The bytes of all models; counted only with a limit. */
uint64_t srv_store_fs_used(srv_store_fs *store);

/* The store's functions for the api; valid until close. */
api_store srv_store_fs_api(srv_store_fs *store);

/* Path of a folder for temporary files on the same disk; lives as long as the store. */
const char *srv_store_fs_temporary(const srv_store_fs *store);

#endif
