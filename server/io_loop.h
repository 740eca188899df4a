/* The I/O threads and their connections, for http.c, connections.c, intake.c and deliver.c. Each thread
 * touches its own alone, but for `done`. */
#ifndef SRV_LOOP_H
#define SRV_LOOP_H

#include "exchange.h"
#include "http.h"
#include "log.h"
#include "watch.h"

#include <pthread.h>

enum {
  SRV_PEER_SIZE = 64,
  SRV_CONNECTION_MEMORY = 32 << 10 /* of the library, for a head, its records of it and the answer's head */
};

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
  bool is_reserve; /* over --max-connections */
  bool is_unread;  /* answered before its request had been read to the end */
  bool is_cut;     /* ended for its slowness, with what is unsent */
  bool waits;      /* suspended in the middle of an answer, until srv_hand_back */
  size_t unsent;   /* as srv_note_unsent found it */
  uint64_t begun;  /* turn of the loop in which the exchange did */
  char peer[SRV_PEER_SIZE];
} srv_connection;

struct srv_loop {
  srv_http *http;
  struct MHD_Daemon *daemon;
  pthread_t thread;
  bool started;
  int epoll, event, library; /* library: its own epoll descriptor */
  bool accepting;
  srv_connection *connections;
  size_t reserve; /* of them over --max-connections */
  srv_lingering *lingering;
  uint64_t turns, turn_ms;      /* the present turn's number, and when it began */
  size_t blocks, blocks_before; /* of answers, asked for in this turn and in the one before */
  uint64_t swept_ms;
  atomic_bool drains; /* has counted what was unsent when the drain began */
  pthread_mutex_t lock;
  srv_connection *done; /* to be resumed: answered, or with a frame to send; guarded by lock */
};

struct srv_http {
  srv_server *server;
  srv_patience patience;
  int listener;
  bool tls;
  atomic_bool stop;
  atomic_bool unfinished; /* a loop ended with requests at compute threads */
  atomic_uint_fast64_t complained_ms;
  size_t loop_count;
  srv_loop loops[];
};

void srv_enter(srv_connection *connection, srv_phase phase);

/* While draining: counts the connection in the server's `unsent` as long as its client has not taken all. */
void srv_note_unsent(srv_connection *connection);

/* Gives a connection (owner) back to its thread, which resumes it. On any thread. */
void srv_hand_back(void *owner);

/* Hands the exchange's answer over to the library. False: the connection has to be closed. */
bool srv_deliver(srv_connection *connection);

#endif
