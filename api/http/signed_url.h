/* Signed URLs: query parameters exp and sig that give the right to read to whoever has the URL. */
#ifndef API_SIGNED_URL_H
#define API_SIGNED_URL_H

#include "call.h"

typedef enum api_signature {
  API_SIGNATURE_NONE, /* the URL bears none */
  API_SIGNATURE_GOOD,
  API_SIGNATURE_BAD /* the fault says why */
} api_signature;

api_signature api_signed_url_judge(api_call *call, const api_keys *keys);

#endif
