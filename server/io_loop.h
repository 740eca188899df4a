/* The I/O loops and their connections, shared by http.c, connections.c, intake.c and deliver.c. Each thread
 * touches only its own loop and connections, except for `done` and the atomics. */
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
  SRV_CONNECTION_MEMORY = 32 << 10 /* the library's: request head, its records, answer head */
};

enum {
  SRV_ACCEPT_MAX = 64, /* connections that a thread accepts before it serves those it has */
  SRV_RESERVE_MAX = 8, /* connections per thread over --max-connections, for health checks */
  SRV_SWEEP_MS = 250,
  SRV_DRAIN_SWEEP_MS = 10
};

typedef struct srv_http srv_http;
typedef struct srv_loop srv_loop;
typedef struct srv_lingering srv_lingering;
typedef struct srv_trimmed srv_trimmed;

typedef struct srv_connection {
  srv_exchange exchange; /* first: compute threads know only the exchange */
  struct MHD_Connection *mhd;
  srv_loop *owner;
  int fd;
  srv_framing framing;
  srv_trimmed *trimmed; /* trimmed values of fields, until the request ends */
  srv_watch watch;
  struct srv_connection *previous, *next; /* in the owner's list */
  struct srv_connection *next_done;
  srv_client client; /* the peer's address */
  atomic_uint_fast64_t
      half_ns;     /* when the client was seen to have ended its side, or was asked last; 0: never */
  bool is_reserve; /* over --max-connections */
  bool is_local;   /* came in through a listener on a loopback address */
  bool is_counted; /* counted for its address */
  bool is_unread;  /* answered before its request was read to the end */
  bool is_cut;     /* ended as too slow; unsent bytes are dropped */
  bool waits;      /* suspended in the middle of an answer until srv_hand_back */
  size_t unsent;   /* bytes, as of the last srv_note_unsent */
  char peer[SRV_PEER_SIZE];
} srv_connection;

struct srv_loop {
  srv_http *http;
  struct MHD_Daemon *daemon;
  pthread_t thread;
  bool started;
  int epoll, event, library; /* descriptors; library: the library's epoll */
  bool accepting;
  atomic_bool has_turned; /* since the last srv_http_turns */
  srv_connection *connections;
  size_t reserve; /* connections over --max-connections */
  srv_lingering *lingering;
  uint64_t turn_ms;             /* when the present turn began */
  size_t blocks, blocks_before; /* blocks of answers read in this turn and in the one before */
  uint64_t swept_ms;
  atomic_bool drains; /* has counted its unsent answers since the drain began */
  pthread_mutex_t lock;
  srv_connection *done; /* connections to resume; guarded by lock */
};

struct srv_http {
  srv_server *server;
  srv_patience patience;
  srv_listeners listeners;
  bool tls;
  bool is_admin; /* of --admin-listen: its connections are not limited */
  atomic_bool stop;
  atomic_bool unfinished; /* a loop ended while compute threads held its requests */
  size_t loop_count;
  srv_loop loops[];
};

/* ---- io_loop.c ------------------------------------------------------------------------------- */

/* Wakes the loop's thread. Any thread. */
void srv_wake(srv_loop *loop);

/* Hands a connection (owner) back to its I/O thread, which resumes it. Any thread. */
void srv_hand_back(void *owner);

void srv_enter(srv_connection *connection, srv_phase phase);

/* Keeps a count of unsent bytes, and srv_server.unsent, which counts clients with any. */
void srv_set_unsent(srv_loop *loop, size_t *unsent, size_t now_unsent);

/* While draining: counts the connection in srv_server.unsent as long as its client has not received
 * everything. */
void srv_note_unsent(srv_connection *connection);

/* ---- deliver.c ------------------------------------------------------------------------------- */

/* Hands the exchange's answer over to the library. MHD_NO: the connection has to be closed. */
enum MHD_Result srv_deliver(srv_connection *connection);

/* ---- connections.c --------------------------------------------------------------------------- */

/* Starts watching the listening sockets. */
void srv_connections_listen(srv_loop *loop);
void srv_connections_accept(srv_loop *loop, int listener);

/* Callback of the library for the start and end of a connection. context: the loop. */
void srv_connections_notify(void *context, struct MHD_Connection *mhd, void **socket_context,
                            enum MHD_ConnectionNotificationCode what);

/* Reads and drops the input of a lingering socket: one that the library has closed, and that is kept open
 * until its client has received what was sent. */
void srv_connections_discard(srv_loop *loop, int fd);

/* Ends connections and lingering sockets that are over their deadlines or whose client has left, every
 * SRV_SWEEP_MS. Listens again after descriptors had run out. */
void srv_connections_sweep(srv_loop *loop);

/* Closes all lingering sockets. */
void srv_connections_end(srv_loop *loop);

/* ---- intake.c: callbacks of the library for a request ---------------------------------------- */

/* Called with the raw target, before the library splits its arguments. Returns the connection, or NULL
 * without memory. */
void *srv_intake_begin(void *context, const char *target, struct MHD_Connection *mhd);

/* Called with the headers, then with each piece of the body, then once more. */
enum MHD_Result srv_intake_take(void *context, struct MHD_Connection *mhd, const char *url,
                                const char *method, const char *version, const char *data, size_t *size,
                                void **request);

/* Called when the answer has been sent or the connection is lost. */
void srv_intake_end(void *context, struct MHD_Connection *mhd, void **request,
                    enum MHD_RequestTerminationCode how);

/* Called when the library logs: it may be about to refuse the head of one of the loop's connections. */
void srv_intake_complaint(srv_loop *loop);

/* Sends the answer directly, since the library cannot answer before a request has been read to its end. Over
 * TLS the connection ends without an answer. */
void srv_intake_refuse(srv_connection *connection);

#endif
