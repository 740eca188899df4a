/* Content codings of answers and of request bodies. */
#ifndef API_CODINGS_H
#define API_CODINGS_H

#include "call.h"

/* Encodes the call's answer by call->coding if it is long enough to gain by it. API_NEEDS_THREAD in a light
 * call when that takes time. */
api_outcome api_encode(api_call *call);

/* The largest window that a zstd body may ask for is 8 MiB, which RFC 9659 sets for content codings. */
enum { API_ZSTD_WINDOW_LOG = 23 };

/* Decodes a content coding. limit: the most bytes that may come out. TW_SYNTAX: the bytes are not of that
 * coding, or truncated; TW_LIMIT. *out: malloc'ed, [*size]. */
tw_status api_decode(api_coding coding, api_bytes bytes, uint64_t limit, uint8_t **out, size_t *size,
                     tw_error *error);

/* Whether the decoded bytes begin with `beginning`. */
bool api_decodes_to(api_coding coding, api_bytes bytes, const char *beginning);

#endif
