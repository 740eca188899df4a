/* Counters, and /metrics in the Prometheus text format. */
#ifndef SRV_METRICS_H
#define SRV_METRICS_H

#include "config.h"
#include "live.h"
#include "store_s3.h"

#include <stddef.h>
#include <stdint.h>

/* Why a request or connection is refused: continues api_refusal with the daemon's own reasons. */
enum {
  SRV_REFUSAL_RATE = API_REFUSAL_COUNT, /* --rate-limit of its address */
  SRV_REFUSAL_KEY_RATE,
  SRV_REFUSAL_CONNECTIONS,
  SRV_REFUSAL_ADDRESS_CONNECTIONS,
  SRV_REFUSAL_FRAMING,         /* the head is malformed or over a limit */
  SRV_REFUSAL_SLOW,            /* the request did not arrive in time */
  SRV_REFUSAL_ROOM,            /* no memory or disk for the body */
  SRV_REFUSAL_SPOOL,           /* other bodies use all of --spool-limit */
  SRV_REFUSAL_QUEUE,           /* the queue is full */
  SRV_REFUSAL_WAIT,            /* the request waited too long */
  SRV_REFUSAL_COMPUTE_TIMEOUT, /* computing took too long before the answer began */
  SRV_REFUSAL_LISTENERS,
  SRV_REFUSAL_DRAIN,
  SRV_REFUSAL_COUNT
};

typedef struct srv_metrics srv_metrics;

srv_metrics *srv_metrics_create(void); /* NULL without memory */
void srv_metrics_destroy(srv_metrics *metrics);

/* Each call counts one. Any thread. The route of a request must be a text that lives as long as the program,
 * one of few. */
void srv_metrics_request(srv_metrics *metrics, const srv_log_request *request);
void srv_metrics_refusal(srv_metrics *metrics, unsigned reason); /* API_REFUSAL_NONE: not counted */

/* Wraps a store so that its operations are counted and timed. Call once; the metrics must outlive the
 * result. */
api_store srv_metrics_of_store(srv_metrics *metrics, const api_store *store);

/* Values that other parts supply when the text is printed. */
typedef struct srv_gauges {
  uint64_t connections, requests_in_flight;
  size_t jobs_waiting, threads_busy;
  uint64_t spool_bytes;
  uint64_t store_bytes;            /* with --store-limit */
  const srv_store_s3_load *bucket; /* NULL: the store is a folder */
  srv_live_load live;
  api_usage usage;
} srv_gauges;

/* The text of /metrics, malloc'ed, its size in *size; NULL without memory. */
char *srv_metrics_print(srv_metrics *metrics, const srv_config *config, const srv_gauges *gauges,
                        size_t *size);

#endif
