/* A 3MF package: a zip whose model part is packed while it is read. */
#ifndef API_PACKAGE_H
#define API_PACKAGE_H

#include "tweend/format.h"

typedef struct api_package api_package;

/* Bytes that a package holds besides the stream of its model. */
enum { API_PACKAGE_COST = 512 << 10 };

/* TW_LIMIT: it could be over 4 GiB. TW_NO_MEMORY. */
tw_status api_package_create(const tw_scene *scene, const tw_3mf_options *options, api_package **out,
                             tw_error *error);
void api_package_destroy(api_package *package); /* NULL accepted */

uint64_t api_package_bound(const api_package *package);                /* its size is at most this */
bool api_package_origin(const api_package *package, double origin[3]); /* as tw_flat_stream_origin */

/* Reads the next bytes, at least one unless `capacity` is 0, and returns how many; 0 at the end, -1 without
 * memory or where the work is no longer wanted. */
int64_t api_package_read(api_package *package, uint8_t *out, size_t capacity);

#endif
