/* I/O threads that run libmicrohttpd over the listening sockets and deliver the answers of exchanges. */
#ifndef SRV_HTTP_H
#define SRV_HTTP_H

#include "exchange.h"
#include "listen.h"

typedef struct srv_http srv_http;

typedef enum srv_http_kind {
  SRV_HTTP_PLAIN,
  SRV_HTTP_TLS,  /* with the certificate of tls.h */
  SRV_HTTP_ADMIN /* only probes and metrics, on one thread */
} srv_http_kind;

/* Serves on the listening sockets, which it then owns, until srv_http_stop. Threads and limits come from the
 * server's config. NULL with one line in error; the sockets are closed then. */
srv_http *srv_http_start(srv_server *server, const srv_listeners *listeners, srv_http_kind kind,
                         srv_error *error);

/* Whether every I/O thread has completed a turn of its loop since the last call. Wakes the threads, so that
 * the next call can tell. */
bool srv_http_turns(srv_http *http);

/* Makes the I/O threads close connections that have no request, and others after their answer. Call once
 * server->draining is set. */
void srv_http_drain(srv_http *http);

/* Whether no request is in flight and all clients have received what was sent to them. */
bool srv_http_is_drained(const srv_http *http);

/* Ends all connections and threads and frees them. False when compute threads still hold requests: they would
 * answer into freed memory, so nothing is freed and the process must exit. */
bool srv_http_stop(srv_http *http);

#endif
