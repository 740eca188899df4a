/* Signed URLs: the query parameters exp and sig give the right to read to everybody who has the URL. */
#ifndef API_SIGNED_URL_H
#define API_SIGNED_URL_H

#include "call.h"

#include <nettle/hmac.h>

typedef enum api_signature {
  API_SIGNATURE_NONE, /* the URL has none */
  API_SIGNATURE_GOOD,
  API_SIGNATURE_BAD /* the fault says why */
} api_signature;

/* 32 bytes as base64url, without and with the padding that nettle writes */
enum { API_SIGNATURE_SIZE = 43, API_SIGNATURE_PADDED = 48 };

/* Signs with a key that has been set. out: the first API_SIGNATURE_SIZE characters are the signature,
 * nettle's padding follows. */
void api_signed_url_sign(const struct hmac_sha256_ctx *key, const char *method, const char *path,
                         const api_query *query, char out[API_SIGNATURE_PADDED]);

api_signature api_signed_url_judge(api_call *call, const api_keys *keys);

#endif
