/* Signed URLs: the query parameters exp and sig give the right to read to everybody who has the URL. */
#ifndef API_SIGNED_URL_H
#define API_SIGNED_URL_H

#include "call.h"

typedef enum api_signature {
  API_SIGNATURE_NONE, /* the URL has none */
  API_SIGNATURE_GOOD,
  API_SIGNATURE_BAD /* the fault says why */
} api_signature;

api_signature api_signed_url_judge(api_call *call, const api_keys *keys);

#endif
