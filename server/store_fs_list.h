/* Lists the models of the embedded store, a page at a time. */
#ifndef SRV_STORE_FS_LIST_H
#define SRV_STORE_FS_LIST_H

#include "api.h"

/* As api_store's `list`, of the store with this root. */
api_store_status srv_store_fs_list(const char *root, const char *after, size_t limit, api_listed *out,
                                   size_t *count, bool *more);

#endif
