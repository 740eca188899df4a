/* Decides when a connection has had its time. The HTTP library's timeout restarts with every byte, so a
 * client that sends one byte a second would live for ever. These deadlines do not move, and bodies and
 * answers must keep a minimum rate. */
#ifndef SRV_WATCH_H
#define SRV_WATCH_H

#include <stdbool.h>
#include <stdint.h>

enum {
  SRV_LINGER_MS = 5000, /* how long a client may take to close after a refusal */
  SRV_STALL_MS = 45000  /* how long it may receive nothing: three keep-alive intervals of a live stream */
};

typedef enum srv_phase {
  SRV_PHASE_HEAD,  /* waits for a request's first byte or the rest of its headers */
  SRV_PHASE_IDLE,  /* between two requests */
  SRV_PHASE_BODY,  /* a body is arriving */
  SRV_PHASE_WORK,  /* the daemon works on the request */
  SRV_PHASE_SEND,  /* an answer is being sent */
  SRV_PHASE_LIVE,  /* a live stream is being sent */
  SRV_PHASE_LINGER /* refused early: the rest of the request is dropped */
} srv_phase;

typedef struct srv_patience {
  uint64_t header_ms, idle_ms, request_ms;
  uint64_t min_rate; /* bytes a second, 0: no minimum */
} srv_patience;

typedef struct srv_watch {
  srv_phase phase;
  uint64_t since_ms;
  bool marked;
  uint64_t mark_ms, mark_bytes; /* start of the current rate window, when marked */
} srv_watch;

void srv_watch_enter(srv_watch *watch, srv_phase phase, uint64_t now_ms);

/* Whether the client must send or receive bytes now: at the minimum rate or, of a live stream, any at all. */
bool srv_watch_paces(const srv_watch *watch);

/* Forgets the rate so far. Call while the client can neither send nor receive, as it waits for the daemon. */
void srv_watch_rest(srv_watch *watch);

/* Bytes that the client has sent and acknowledged on this socket, by the kernel's count, which does not
 * include bytes in send buffers. counted: the caller's own count, used for sockets that are not TCP. */
uint64_t srv_watch_moved(int fd, uint64_t counted);

/* True when the connection must be ended. draining: connections without a request end too. moved: a count of
 * bytes that grows as the client sends and receives; used only where srv_watch_paces. */
bool srv_watch_expired(srv_watch *watch, const srv_patience *patience, bool draining, uint64_t now_ms,
                       uint64_t moved);

#endif
