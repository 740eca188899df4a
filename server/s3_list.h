/* The keys of a bucket, page by page (ListObjectsV2). */
#ifndef SRV_S3_LIST_H
#define SRV_S3_LIST_H

#include "s3_request.h"

/* Lists the keys that begin with `folder` and follow `after`, both without the prefix, in ascending order.
 * Calls `take` with each key and the size of its object until it returns false. answer: that of the last
 * page; its status tells whether all pages were read. */
void srv_s3_list(srv_s3 *s3, const char *folder, const char *after, unsigned page_size, uint64_t timeout_ms,
                 const atomic_bool *stops, bool (*take)(void *context, const char *key, uint64_t size),
                 void *context, srv_s3_answer *answer);

#endif
