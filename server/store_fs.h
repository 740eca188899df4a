/* The embedded store: a folder of content-addressed files, which several daemons may share. */
#ifndef SRV_STORE_FS_H
#define SRV_STORE_FS_H

#include "api.h"
#include "fail.h"

typedef struct srv_store_fs srv_store_fs;

/* Opens or makes the folder, and those on the way to it, and removes the temporary files that uploads left
 * which were killed over an hour ago. NULL with one line in error. */
srv_store_fs *srv_store_fs_open(const char *root, srv_error *error);
/* Whether the folder could be opened, as far as its rights tell; makes nothing. False with one line in error.
 */
bool srv_store_fs_check(const char *path, srv_error *error);
void srv_store_fs_close(srv_store_fs *store); /* NULL accepted; blobs opened from it stay valid */

/* The most bytes that models may take together, 0 for any number. Before the first call of the store. */
void srv_store_fs_limit(srv_store_fs *store, uint64_t bytes);
/* What they take, where there is a limit. */
uint64_t srv_store_fs_used(srv_store_fs *store);

/* The store as api/ sees it; valid until close. */
api_store srv_store_fs_api(srv_store_fs *store);

/* Path of a folder on the same disk for temporary files; lives as long as the store. */
const char *srv_store_fs_temporary(const srv_store_fs *store);

#endif
