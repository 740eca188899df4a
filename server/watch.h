/* When a connection has had its time. The HTTP library's timeout starts again with every byte, so a
 * client that drips one byte a second would live for ever: these deadlines do not move, and bodies and
 * answers must keep a minimum rate. */
#ifndef SRV_WATCH_H
#define SRV_WATCH_H

#include <stdbool.h>
#include <stdint.h>

enum {
  SRV_LINGER_MS = 5000, /* that a client may take to close behind a refusal */
  SRV_STALL_MS = 45000  /* that it may take nothing of what it was sent: three signs of life of a stream */
};

typedef enum srv_phase {
  SRV_PHASE_HEAD,  /* a request's first byte is awaited or its headers are incomplete */
  SRV_PHASE_IDLE,  /* between two requests */
  SRV_PHASE_BODY,  /* a body is arriving */
  SRV_PHASE_WORK,  /* the daemon's turn */
  SRV_PHASE_SEND,  /* an answer is leaving */
  SRV_PHASE_LIVE,  /* a stream is leaving, in its own time */
  SRV_PHASE_LINGER /* refused half-way: the rest of the request is thrown away */
} srv_phase;

typedef struct srv_patience {
  uint64_t header_ms, idle_ms, request_ms;
  uint64_t min_rate; /* bytes a second, 0: any */
} srv_patience;

typedef struct srv_watch {
  srv_phase phase;
  uint64_t since_ms;
  bool marked;
  uint64_t mark_ms, mark_bytes; /* where the current rate window began, when marked */
} srv_watch;

void srv_watch_enter(srv_watch *watch, srv_phase phase, uint64_t now_ms);

/* Whether the client has to take or give bytes now: at the minimum rate, or some at least of a stream. */
bool srv_watch_paces(const srv_watch *watch);

/* Bytes that the client has sent and acknowledged on this socket, by the kernel's count: what waits in send
 * buffers does not count. counted: the caller's own count, for sockets that are not TCP. */
uint64_t srv_watch_moved(int fd, uint64_t counted);

/* True when the connection is to be ended. draining: connections without a request end as well. moved: a
 * count of bytes that grows as the client takes and gives; only looked at where srv_watch_paces. */
bool srv_watch_expired(srv_watch *watch, const srv_patience *patience, bool draining, uint64_t now_ms,
                       uint64_t moved);

#endif
