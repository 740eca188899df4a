/* Rates by key: token buckets, of which the fullest are forgotten where there are too many. */
#ifndef SRV_RATE_H
#define SRV_RATE_H

#include "api.h"

typedef struct srv_rates srv_rates;
srv_rates *srv_rates_create(void); /* NULL without memory */
void srv_rates_destroy(srv_rates *rates);

/* What is left of a rate. A zeroed one is of no rate. */
typedef struct srv_allowance {
  api_rate rate;
  uint32_t left;    /* requests at once */
  uint32_t reset_s; /* until all are allowed again */
  uint32_t retry_s; /* above 0: refused, until the next one is allowed */
} srv_allowance;

/* Takes a token of the bucket `id`, which has the rate (count from 1 to SRV_RATE_MAX), at a monotonic
 * time. Any thread. */
srv_allowance srv_rates_take(srv_rates *rates, const uint8_t id[16], api_rate rate, uint64_t now_ns);

#endif
