/* Where the embedded store has what, see store_fs.c. */
#ifndef SRV_STORE_FS_LAYOUT_H
#define SRV_STORE_FS_LAYOUT_H

#include <limits.h>

#include "api.h"

enum { SRV_STORE_ROOT_MAX = PATH_MAX - 128 }; /* leaves room for the names below the root */

/* A path below the root: always fits. */
typedef struct srv_path {
  char text[PATH_MAX];
} srv_path;

srv_path srv_store_folder_path(const char *root, const char *name);
/* objects/ab or summaries/ab */
srv_path srv_store_prefix_path(const char *root, const char *kind, const char *id);
srv_path srv_store_object_path(const char *root, const char *id);
srv_path srv_store_summary_path(const char *root, const char *id);

/* The summary, for free; NULL when it is lost or empty, as a power failure may leave it. */
char *srv_store_read_summary(const char *root, const char *id);

/* Logs errno; the status of what failed by it. */
api_store_status srv_store_unavailable(const char *what);

/* The status after ENOENT: absent if objects/ exists, else unavailable. */
api_store_status srv_store_not_found(const char *root);

#endif
