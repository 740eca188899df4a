/* Content codings, of answers and of what is sent. */
#ifndef API_CODINGS_H
#define API_CODINGS_H

#include "call.h"

/* Codes the answer of the call as call->coding says, where it is long enough to gain by it. API_NEEDS_THREAD
 * in a light call where that takes time. */
api_outcome api_encode(api_call *call);

/* The largest window that a zstd body may ask for is 8 MiB, which RFC 9659 sets for content codings. */
enum { API_ZSTD_WINDOW_LOG = 23 };

/* Undoes a content coding. limit: the most bytes that may come out.
 * TW_SYNTAX: not of that coding, or cut off; TW_LIMIT. *out: malloc'ed, [*size]. */
tw_status api_decode(api_coding coding, api_bytes bytes, uint64_t limit, uint8_t **out, size_t *size,
                     tw_error *error);

/* Whether what the bytes code begins so. */
bool api_decodes_to(api_coding coding, api_bytes bytes, const char *beginning);

#endif
