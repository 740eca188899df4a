/* One request and its answer, from the request line to the log line. Knows no socket: intake.c feeds it, and
 * deliver.c sends its answer. An exchange moves between an I/O thread and compute threads, one at a time:
 * from srv_exchange_finish returning SRV_EXCHANGE_LATER until `ready` is called, the I/O thread must not
 * touch it, except by srv_exchange_give_up. */
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
#include "request_id.h"
#include "store_s3.h"
#include "work.h"

#include <stdatomic.h>

/* State that all exchanges share. */
typedef struct srv_server {
  const srv_config *config;
  api_service *service;
  srv_work *work;
  srv_live *live;
  srv_metrics *metrics;
  srv_rates *rates;
  srv_peers *peers;
  srv_store_fs *folder; /* for store_bytes in /metrics */
  srv_store_s3 *bucket; /* for its state in /metrics; NULL without a bucket */
  srv_networks trusted; /* --trusted-proxies */
  srv_spool spool;
  atomic_bool draining;       /* new requests get 503 */
  atomic_bool stopping;       /* no job may be queued any more */
  atomic_size_t connections;  /* open connections */
  atomic_size_t in_flight;    /* opened exchanges that have not ended */
  atomic_uint_fast64_t ended; /* exchanges that have ended so far */
  atomic_size_t unsent;       /* while draining: clients that have not received all */
} srv_server;

enum { SRV_METHOD_SIZE = 24, SRV_TIMING_SIZE = 100, SRV_RATES_SIZE = 128, SRV_TRACE_SIZE = 56 };

typedef struct srv_exchange {
  srv_job job; /* first: the pool passes it to run and look */
  srv_server *server;
  char *target; /* copy of the target, split in place; NULL: no exchange */
  char method[SRV_METHOD_SIZE];
  char id[SRV_REQUEST_ID_SIZE];
  char traceparent[SRV_TRACE_SIZE]; /* "" without a valid one */
  api_request request;
  api_ticket ticket;
  srv_body body;
  bool opened;                 /* the headers have been checked */
  bool answered;               /* `answer` is valid */
  bool close;                  /* the connection must close after the answer */
  bool is_reserve;             /* connection over the limit: answers only health checks */
  int status;                  /* kept after the answer was sent; 400 until there is one */
  unsigned refusal;            /* reason, see metrics.h */
  const char *route;           /* as in api_answer */
  srv_client client;           /* set by intake.c before srv_exchange_open */
  bool is_forwarded;           /* X-Forwarded-For named another client than the peer */
  srv_allowance allowances[2]; /* of the address, of the API key */
  uint64_t bytes_in, bytes_out;
  uint64_t held; /* bytes of the body counted against --max-memory */
  uint64_t started_ns, received_ns, worked_ns, answered_ns;
  uint64_t computed_ns; /* time inside api calls, without the waits between */
  uint64_t leg_ns;      /* time up to which computed_ns has counted */
  /* Set by intake.c before srv_exchange_open. */
  bool (*wanted)(
      struct srv_exchange *exchange); /* may the client still read the answer? Before it begins; any thread */
  void (*ready)(void *exchange);      /* the answer is complete. Last call of the compute thread */
  api_answer answer;                  /* not cleared between two requests */
} srv_exchange;

/* The text of /metrics, malloc'ed; NULL without memory. context: an srv_server. */
char *srv_server_metrics(void *context, size_t *size);

/* Starts the exchange. target: as on the wire. False without memory: drop the connection. */
bool srv_exchange_begin(srv_exchange *exchange, srv_server *server, const char *target);

typedef enum srv_exchange_step {
  SRV_EXCHANGE_MORE,  /* continue: take the body, then finish */
  SRV_EXCHANGE_NOW,   /* deliver the answer */
  SRV_EXCHANGE_LATER, /* `ready` will be called */
} srv_exchange_step;

/* Checks the headers. header, context: as in api_request, valid until srv_exchange_end. Returns MORE, or NOW:
 * refused with the body unread. */
srv_exchange_step srv_exchange_open(srv_exchange *exchange, const char *method, const srv_framing *framing,
                                    const char *(*header)(void *context, const char *name), void *context);

/* Takes a piece of the body. Returns MORE, or NOW: refused in the middle of the body; further pieces may
 * still be passed and are discarded. */
srv_exchange_step srv_exchange_take(srv_exchange *exchange, const void *data, size_t size);

/* The body is complete. Returns NOW or LATER. */
srv_exchange_step srv_exchange_finish(srv_exchange *exchange);

/* Refuses a request that waits for memory, or for a result that another request is making, once it has waited
 * too long or its client is gone: only few requests may wait. True when the answer is complete and must be
 * delivered. Call it on the exchange's I/O thread. */
bool srv_exchange_give_up(srv_exchange *exchange);

/* Replaces the answer, if there is one, by a problem document. reason: a refusal of metrics.h. */
void srv_exchange_refuse(srv_exchange *exchange, unsigned reason, int status, const char *detail,
                         unsigned retry_after);

/* The answer as bytes on the wire with "Connection: close", for refusals sent without the HTTP library.
 * reason: phrase of the status line. malloc'ed, NULL without memory. */
char *srv_exchange_print(const srv_exchange *exchange, const char *reason, size_t *size);

/* Value of the Server-Timing header. */
void srv_exchange_timing(const srv_exchange *exchange, char out[SRV_TIMING_SIZE]);

/* Values of RateLimit-Policy and RateLimit (draft-ietf-httpapi-ratelimit-headers-10); false where no rate
 * applies. */
bool srv_exchange_rates(const srv_exchange *exchange, char policy[SRV_RATES_SIZE], char left[SRV_RATES_SIZE]);

/* Logs and counts the request, and frees what the exchange holds. Accepts a zeroed exchange. */
void srv_exchange_end(srv_exchange *exchange, const char *peer, bool aborted);

#endif
