/* Counters, and their print in the Prometheus text format. */
#ifndef SRV_METRICS_H
#define SRV_METRICS_H

#include "config.h"
#include "live.h"
#include "store_s3.h"

#include <stddef.h>
#include <stdint.h>

/* Why a request or a connection is turned away: api_refusal, and what the daemon itself refuses. */
enum {
  SRV_REFUSAL_RATE = API_REFUSAL_COUNT, /* of its address */
  SRV_REFUSAL_KEY_RATE,
  SRV_REFUSAL_CONNECTIONS,
  SRV_REFUSAL_ADDRESS_CONNECTIONS,
  SRV_REFUSAL_FRAMING,         /* its head is malformed */
  SRV_REFUSAL_SLOW,            /* it did not arrive in time */
  SRV_REFUSAL_ROOM,            /* there is no memory or disk for its body */
  SRV_REFUSAL_SPOOL,           /* other bodies have --spool-limit */
  SRV_REFUSAL_QUEUE,           /* too many wait */
  SRV_REFUSAL_WAIT,            /* it waited too long */
  SRV_REFUSAL_COMPUTE_TIMEOUT, /* before its answer began */
  SRV_REFUSAL_LISTENERS,
  SRV_REFUSAL_DRAIN,
  SRV_REFUSAL_COUNT
};

typedef struct srv_metrics srv_metrics;

srv_metrics *srv_metrics_create(void); /* NULL without memory */
void srv_metrics_destroy(srv_metrics *metrics);

/* Each counts one. Any thread. The route of a request is one of few texts that live as long as the program.
 */
void srv_metrics_request(srv_metrics *metrics, const srv_log_request *request);
void srv_metrics_refusal(srv_metrics *metrics, unsigned reason); /* API_REFUSAL_NONE: none */

/* The store with its operations counted and timed. Once; the metrics outlive it. */
api_store srv_metrics_of_store(srv_metrics *metrics, const api_store *store);

/* What others know at the time of printing. */
typedef struct srv_gauges {
  uint64_t connections, requests_in_flight;
  size_t jobs_waiting, threads_busy;
  uint64_t spool_bytes;
  uint64_t store_bytes;            /* with --store-limit */
  const srv_store_s3_load *bucket; /* NULL: the store is a folder */
  srv_live_load live;
  api_usage usage;
} srv_gauges;

/* The whole text, malloc'ed, its size in *size; NULL without memory. */
char *srv_metrics_print(srv_metrics *metrics, const srv_config *config, const srv_gauges *gauges,
                        size_t *size);

#endif
