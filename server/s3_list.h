/* The keys of a bucket, page by page (ListObjectsV2). */
#ifndef SRV_S3_LIST_H
#define SRV_S3_LIST_H

#include "s3_request.h"

/* Calls `take` with each key that begins with `folder` and follows `after`, both below the prefix, and with
 * the size of its object, in ascending order, until it says false. answer: of the last page; its status tells
 * whether all went well. */
void srv_s3_list(srv_s3 *s3, const char *folder, const char *after, unsigned page_size, uint64_t timeout_ms,
                 const atomic_bool *stops, bool (*take)(void *context, const char *key, uint64_t size),
                 void *context, srv_s3_answer *answer);

#endif
