/* The I/O threads and their connections, for http.c, connections.c, intake.c and deliver.c. Each thread
 * touches its own alone, but for `done`. */
#ifndef SRV_LOOP_H
#define SRV_LOOP_H

#include "exchange.h"
#include "http.h"
#include "log.h"
#include "reply.h"
#include "watch.h"

#include <pthread.h>

enum { SRV_PEER_SIZE = 64 };

typedef struct srv_loop srv_loop;

typedef struct srv_connection {
  srv_exchange exchange; /* first: compute threads hand it back */
  struct MHD_Connection *mhd;
  srv_loop *owner;
  int fd;
  srv_framing framing;
  srv_watch watch;
  struct srv_connection *previous, *next; /* among the owner's */
  struct srv_connection *next_done;
  srv_reply *reply; /* being sent; NULL: what is sent is no such one */
  bool waits;       /* suspended in the middle of an answer, until srv_hand_back */
  uint64_t begun;   /* turn of the loop in which the exchange did */
  char peer[SRV_PEER_SIZE];
} srv_connection;

struct srv_loop {
  srv_http *http;
  struct MHD_Daemon *daemon;
  pthread_t thread;
  bool started;
  int epoll, event;
  bool accepting;
  srv_connection *connections;
  srv_replies *replies;
  srv_log_lines *log_lines;
  uint64_t turns, turn_ms; /* the present turn's number, and when it began */
  uint64_t swept_ms;
  pthread_mutex_t lock;
  srv_connection *done; /* to be resumed: answered, or with a frame to send; guarded by lock */
};

struct srv_http {
  srv_server *server;
  srv_patience patience;
  int listener;
  bool tls, rewrites; /* rewrites: see srv_rewrites */
  atomic_bool stop;
  atomic_bool unfinished; /* a loop ended with requests at compute threads */
  size_t loop_count;
  srv_loop loops[];
};

void srv_enter(srv_connection *connection, srv_phase phase);

/* Gives a connection (owner) back to its thread, which resumes it. On any thread. */
void srv_hand_back(void *owner);

/* Hands the exchange's answer over to the library. False: the connection has to be closed. */
bool srv_deliver(srv_connection *connection);

#endif
