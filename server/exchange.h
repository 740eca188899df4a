/* One request and its answer, from the request line to the log line. Knows no socket: intake.c feeds it and
 * delivers what it answers. An exchange moves between an I/O thread and a compute thread, never at the
 * same time: from srv_exchange_finish returning SRV_EXCHANGE_LATER until `ready` is called it belongs to
 * the compute thread. */
#ifndef SRV_EXCHANGE_H
#define SRV_EXCHANGE_H

#include "api.h"
#include "body.h"
#include "config.h"
#include "framing.h"
#include "live.h"
#include "metrics.h"
#include "peers.h"
#include "rate.h"
#include "store_s3.h"
#include "work.h"

#include <stdatomic.h>

/* What all exchanges share. */
typedef struct srv_server {
  const srv_config *config;
  api_service *service;
  srv_work *work;
  srv_live *live;
  srv_metrics *metrics;
  srv_rates *rates;
  srv_peers *peers;
  srv_store_fs *folder; /* whose bytes /metrics tells, with --store-limit */
  srv_store_s3 *bucket; /* whose state it tells; NULL without one */
  srv_networks trusted; /* proxies */
  srv_spool spool;
  atomic_bool draining;       /* new requests get 503 */
  atomic_bool stopping;       /* nothing may be queued any more */
  atomic_size_t connections;  /* open ones */
  atomic_size_t in_flight;    /* opened exchanges that have not ended */
  atomic_uint_fast64_t ended; /* exchanges so far */
  atomic_size_t unsent;       /* while draining: clients that have not taken all that they were sent */
} srv_server;

enum {
  SRV_REQUEST_ID_SIZE = 65,
  SRV_METHOD_SIZE = 24,
  SRV_TIMING_SIZE = 100,
  SRV_RATES_SIZE = 128,
  SRV_TRACE_SIZE = 56
};

typedef struct srv_exchange {
  srv_job job; /* first: the pool hands it back */
  srv_server *server;
  char *target; /* copy of the request target, cut into path and query; NULL: no exchange */
  char method[SRV_METHOD_SIZE];
  char id[SRV_REQUEST_ID_SIZE];
  char traceparent[SRV_TRACE_SIZE]; /* of the request, "" without a sane one */
  api_request request;
  api_ticket ticket;
  srv_body body;
  bool opened;                 /* headers were judged */
  bool answered;               /* answer is there, not yet taken */
  bool close;                  /* the connection cannot go on after the answer */
  bool is_reserve;             /* only health checks are answered, by the connection's reserve */
  int status;                  /* of the answer, also after it was taken; 400 when no whole request came */
  unsigned refusal;            /* why it was turned away, see metrics.h */
  const char *route;           /* as of api_answer */
  srv_client client;           /* set by intake.c before open */
  bool is_forwarded;           /* the client is not the peer */
  srv_allowance allowances[2]; /* of the address, of the API key */
  uint64_t bytes_in, bytes_out;
  uint64_t held; /* bytes of the body in memory, counted against the budget */
  uint64_t started_ns, received_ns, worked_ns, answered_ns;
  uint64_t computed_ns; /* in calls of the api, waits between them not counted */
  uint64_t leg_ns;      /* until when computed_ns has counted */
  /* Set by intake.c before finish. */
  bool (*wanted)(struct srv_exchange *exchange); /* is the client still there? On any thread */
  void (*ready)(struct srv_exchange *exchange);  /* the answer is there. On the compute thread, last */
  api_answer answer;                             /* valid with `answered`; not cleared between two requests */
} srv_exchange;

/* What /metrics shows, malloc'ed; NULL without memory. context: an srv_server. */
char *srv_server_metrics(void *context, size_t *size);

/* Begins with the target as it came. False without memory: drop the connection. */
bool srv_exchange_begin(srv_exchange *exchange, srv_server *server, const char *target);

typedef enum srv_exchange_step {
  SRV_EXCHANGE_MORE,  /* go on: take the body, then finish */
  SRV_EXCHANGE_NOW,   /* deliver the answer */
  SRV_EXCHANGE_LATER, /* `ready` will be called */
} srv_exchange_step;

/* Judges the headers. header, context: as in api_request, valid until the end. MORE, or NOW: refused with
 * the body unread. */
srv_exchange_step srv_exchange_open(srv_exchange *exchange, const char *method, const srv_framing *framing,
                                    const char *(*header)(void *context, const char *name), void *context);

/* Takes a piece of the body. MORE, or NOW: refused in the middle of the body; further pieces may still be
 * passed and are thrown away. */
srv_exchange_step srv_exchange_take(srv_exchange *exchange, const void *data, size_t size);

/* The body is complete. NOW or LATER. */
srv_exchange_step srv_exchange_finish(srv_exchange *exchange);

/* Refuses a request that waits for memory, or for what another one makes, once it has waited too long or its
 * client is gone: few may wait. True when the answer is there: deliver it. On the exchange's I/O thread. */
bool srv_exchange_give_up(srv_exchange *exchange);

/* Replaces what answer there may be by a problem document. reason: a refusal of metrics.h. */
void srv_exchange_refuse(srv_exchange *exchange, unsigned reason, int status, const char *detail,
                         unsigned retry_after);

/* The answer as bytes on the wire with "Connection: close", for refusals beside the HTTP library.
 * reason: of the status line. malloc'ed, NULL without memory. */
char *srv_exchange_print(const srv_exchange *exchange, const char *reason, size_t *size);

/* Value of the Server-Timing header. */
void srv_exchange_timing(const srv_exchange *exchange, char out[SRV_TIMING_SIZE]);

/* Values of RateLimit-Policy and RateLimit (draft-ietf-httpapi-ratelimit-headers-10); false where no rate
 * applies. */
bool srv_exchange_rates(const srv_exchange *exchange, char policy[SRV_RATES_SIZE], char left[SRV_RATES_SIZE]);

/* Logs, counts and frees. A zeroed exchange is fine. */
void srv_exchange_end(srv_exchange *exchange, const char *peer, bool aborted);

#endif
