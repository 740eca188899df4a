/* The connections of an I/O thread, which alone calls these. */
#ifndef SRV_CONNECTIONS_H
#define SRV_CONNECTIONS_H

#include <microhttpd.h>

enum {
  SRV_ACCEPT_MAX = 64, /* that a thread takes before it serves those it has */
  SRV_RESERVE_MAX = 8, /* connections of a thread over --max-connections, for health checks */
  SRV_SWEEP_MS = 250,
  SRV_DRAIN_SWEEP_MS = 10
};

typedef struct srv_loop srv_loop;

/* Watches the listening socket. */
void srv_connections_listen(srv_loop *loop);
void srv_connections_accept(srv_loop *loop);

/* What the library calls where one comes or goes; context is the loop. */
void srv_connections_notify(void *context, struct MHD_Connection *mhd, void **socket_context,
                            enum MHD_ConnectionNotificationCode what);

/* Reads from a socket that lingers: one that the library has closed, and that is kept open until its client
 * has what was sent. */
void srv_connections_discard(srv_loop *loop, int fd);

/* Ends those that have had their time, every SRV_SWEEP_MS; listens again where descriptors had run out. */
void srv_connections_sweep(srv_loop *loop);

/* Closes those that linger. */
void srv_connections_end(srv_loop *loop);

#endif
