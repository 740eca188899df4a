/* A store whose operations are counted and timed for /metrics. */
#ifndef SRV_STORE_METER_H
#define SRV_STORE_METER_H

#include "metrics.h"

typedef struct srv_store_meter {
  api_store store;
  srv_metrics *metrics;
} srv_store_meter;

/* The same store, counted. meter: outlives it, and is not changed any more. */
api_store srv_store_metered(srv_store_meter *meter);

#endif
