/* The connections of an I/O thread, which alone calls these. */
#ifndef SRV_CONNECTIONS_H
#define SRV_CONNECTIONS_H

#include <microhttpd.h>

enum {
  SRV_ACCEPT_MAX = 8, /* that a thread takes before it serves those it has */
  SRV_SWEEP_MS = 250
};

typedef struct srv_loop srv_loop;
typedef struct srv_connection srv_connection;

/* Watches the listening socket. */
void srv_connections_listen(srv_loop *loop);
void srv_connections_accept(srv_loop *loop);

/* What the library calls where one comes or goes; context is the loop. */
void srv_connections_notify(void *context, struct MHD_Connection *mhd, void **socket_context,
                            enum MHD_ConnectionNotificationCode what);

/* Ends those that have had their time, every SRV_SWEEP_MS. */
void srv_connections_sweep(srv_loop *loop);

/* Ends one that throws away what arrives. */
void srv_connection_give_up(srv_connection *connection);

#endif
