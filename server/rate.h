/* Rate limits: token buckets by id (an address or an API key). When there are too many, the fullest are
 * forgotten. */
#ifndef SRV_RATE_H
#define SRV_RATE_H

#include "api.h"

typedef struct srv_rates srv_rates;
srv_rates *srv_rates_create(void); /* NULL without memory */
void srv_rates_destroy(srv_rates *rates);

/* What is left of a rate. Zeroed: no rate applies. */
typedef struct srv_allowance {
  api_rate rate;
  uint32_t left;    /* requests that are allowed now */
  uint32_t reset_s; /* until the bucket is full again */
  uint32_t retry_s; /* above 0: refused; until the next request is allowed */
} srv_allowance;

/* Takes a token from the bucket of `id`. rate: its count is from 1 to SRV_RATE_MAX. now_ns: monotonic time.
 * Any thread. */
srv_allowance srv_rates_take(srv_rates *rates, const uint8_t id[16], api_rate rate, uint64_t now_ns);

#endif
