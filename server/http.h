/* The sockets: I/O threads that run libmicrohttpd and deliver what exchanges answer. */
#ifndef SRV_HTTP_H
#define SRV_HTTP_H

#include "exchange.h"

typedef struct srv_http srv_http;

/* Serves on listener (owned from here on) until stopped. The server's config names threads and limits;
 * certificate and key are PEM text, NULL without TLS. NULL with one line in error. */
srv_http *srv_http_start(srv_server *server, int listener, const char *certificate, const char *key,
                         char *error, size_t error_size);

/* Closes connections without a request, and others after their answer; call once server->draining is set. */
void srv_http_drain(srv_http *http);

/* Ends all connections and threads and frees. False when requests are still with compute threads: they
 * would answer into freed memory, so nothing is freed and the process has to exit. */
bool srv_http_stop(srv_http *http);

#endif
