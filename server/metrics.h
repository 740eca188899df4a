/* Counters, and their print in the Prometheus text format. */
#ifndef SRV_METRICS_H
#define SRV_METRICS_H

#include "live.h"

#include <stddef.h>
#include <stdint.h>

typedef struct srv_metrics srv_metrics;

srv_metrics *srv_metrics_create(void); /* NULL without memory */
void srv_metrics_destroy(srv_metrics *metrics);

/* Counts one finished request. route: a text that lives as long as the program, one of few. Any thread. */
void srv_metrics_request(srv_metrics *metrics, const char *route, int status, double seconds,
                         uint64_t bytes_in, uint64_t bytes_out);

/* What others know at the time of printing. */
typedef struct srv_gauges {
  uint64_t connections, requests_in_flight;
  uint64_t threads, queue_capacity;
  size_t jobs_waiting, jobs_running;
  srv_live_load live;
} srv_gauges;

/* The whole text, malloc'ed, its size in *size; NULL without memory. */
char *srv_metrics_print(srv_metrics *metrics, const srv_gauges *gauges, size_t *size);

#endif
