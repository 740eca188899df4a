/* The I/O threads and their connections, for http.c, connections.c, intake.c and deliver.c. Each thread
 * touches its own alone, but for `done`. */
#ifndef SRV_IO_LOOP_H
#define SRV_IO_LOOP_H

#include "exchange.h"
#include "listen.h"
#include "log.h"
#include "watch.h"

#include <microhttpd.h>
#include <pthread.h>

enum {
  SRV_PEER_SIZE = 64,
  SRV_CONNECTION_MEMORY = 32 << 10 /* of the library, for a head, its records of it and the answer's head */
};

enum {
  SRV_ACCEPT_MAX = 64, /* that a thread takes before it serves those it has */
  SRV_RESERVE_MAX = 8, /* connections of a thread over --max-connections, for health checks */
  SRV_SWEEP_MS = 250,
  SRV_DRAIN_SWEEP_MS = 10
};

typedef struct srv_http srv_http;
typedef struct srv_loop srv_loop;
typedef struct srv_lingering srv_lingering;
typedef struct srv_trimmed srv_trimmed;

typedef struct srv_connection {
  srv_exchange exchange; /* first: compute threads hand it back */
  struct MHD_Connection *mhd;
  srv_loop *owner;
  int fd;
  srv_framing framing;
  srv_trimmed *trimmed; /* values of fields without the blanks behind them, until the request's end */
  srv_watch watch;
  struct srv_connection *previous, *next; /* among the owner's */
  struct srv_connection *next_done;
  srv_client client; /* the peer */
  bool is_reserve;   /* over --max-connections */
  bool is_counted;   /* among those of its address */
  bool is_unread;    /* answered before its request had been read to the end */
  bool is_cut;       /* ended for its slowness, with what is unsent */
  bool waits;        /* suspended in the middle of an answer, until srv_hand_back */
  size_t unsent;     /* as srv_note_unsent found it */
  char peer[SRV_PEER_SIZE];
} srv_connection;

struct srv_loop {
  srv_http *http;
  struct MHD_Daemon *daemon;
  pthread_t thread;
  bool started;
  int epoll, event, library; /* library: its own epoll descriptor */
  bool accepting;
  atomic_bool has_turned; /* since srv_http_turns asked */
  srv_connection *connections;
  size_t reserve; /* of them over --max-connections */
  srv_lingering *lingering;
  uint64_t turn_ms;             /* when the present turn of the loop began */
  size_t blocks, blocks_before; /* of answers, asked for in this turn and in the one before */
  uint64_t swept_ms;
  atomic_bool drains; /* has counted what was unsent when the drain began */
  pthread_mutex_t lock;
  srv_connection *done; /* to be resumed: answered, or with a frame to send; guarded by lock */
};

struct srv_http {
  srv_server *server;
  srv_patience patience;
  srv_listeners listeners;
  bool tls;
  bool is_admin; /* of --admin-listen: not among the connections that are limited */
  atomic_bool stop;
  atomic_bool unfinished; /* a loop ended with requests at compute threads */
  size_t loop_count;
  srv_loop loops[];
};

void srv_enter(srv_connection *connection, srv_phase phase);

/* While draining: counts the connection in the server's `unsent` as long as its client has not taken all. */
void srv_note_unsent(srv_connection *connection);

/* Gives a connection (owner) back to its thread, which resumes it. On any thread. */
void srv_hand_back(void *owner);

/* Hands the exchange's answer over to the library. MHD_NO: the connection has to be closed. */
enum MHD_Result srv_deliver(srv_connection *connection);

/* ---- connections.c ------------------------------------------------------------------------------ */

/* Watches the listening sockets. */
void srv_connections_listen(srv_loop *loop);
void srv_connections_accept(srv_loop *loop, int listener);

/* What the library calls where one comes or goes; context is the loop. */
void srv_connections_notify(void *context, struct MHD_Connection *mhd, void **socket_context,
                            enum MHD_ConnectionNotificationCode what);

/* Reads from a socket that lingers: one that the library has closed, and that is kept open until its client
 * has what was sent. */
void srv_connections_discard(srv_loop *loop, int fd);

/* Ends those that have had their time or whose client has left, every SRV_SWEEP_MS; listens again where
 * descriptors had run out. */
void srv_connections_sweep(srv_loop *loop);

/* Closes those that linger. */
void srv_connections_end(srv_loop *loop);

/* ---- intake.c: requests on their way in, as the library calls for them ---------------------------- */

/* With the untouched target, before the library looks for arguments in it. Returns the connection, or NULL
 * without memory. */
void *srv_intake_begin(void *context, const char *target, struct MHD_Connection *mhd);

/* With the headers, then with pieces of the body, then once more. */
enum MHD_Result srv_intake_take(void *context, struct MHD_Connection *mhd, const char *url,
                                const char *method, const char *version, const char *data, size_t *size,
                                void **request);

/* With the answer sent, or the connection lost. */
void srv_intake_end(void *context, struct MHD_Connection *mhd, void **request,
                    enum MHD_RequestTerminationCode how);

/* Where the library logs: it is about to refuse the head of one of the loop's connections, perhaps. */
void srv_intake_complaint(srv_loop *loop);

/* Answers beside the library, which cannot answer before a request has come to its end. Over TLS the
 * connection ends without an answer. */
void srv_intake_refuse(srv_connection *connection);

#endif
