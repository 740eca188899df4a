/* The sockets: I/O threads that run libmicrohttpd and deliver what exchanges answer. */
#ifndef SRV_HTTP_H
#define SRV_HTTP_H

#include "exchange.h"
#include "listen.h"

typedef struct srv_http srv_http;

typedef enum srv_http_kind {
  SRV_HTTP_PLAIN,
  SRV_HTTP_TLS,  /* as tls.h has it */
  SRV_HTTP_ADMIN /* probes and metrics alone, on one thread */
} srv_http_kind;

/* Serves on the listeners (owned from here on) until stopped. The server's config names threads and limits.
 * NULL with one line in error. */
srv_http *srv_http_start(srv_server *server, const srv_listeners *listeners, srv_http_kind kind,
                         srv_error *error);

/* Whether every I/O thread has been at work since the last call; wakes them for the next one. */
bool srv_http_turns(srv_http *http);

/* Closes connections without a request, and others after their answer; call once server->draining is set. */
void srv_http_drain(srv_http *http);

/* Whether no request is in flight any more and all clients have taken what they were sent. */
bool srv_http_is_drained(const srv_http *http);

/* Ends all connections and threads and frees. False when requests are still with compute threads: they
 * would answer into freed memory, so nothing is freed and the process has to exit. */
bool srv_http_stop(srv_http *http);

#endif
