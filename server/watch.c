/* Deadlines of connections, and the kernel's count of transferred bytes. */
#include "watch.h"

#include <linux/tcp.h>
#include <netinet/in.h>
#include <stddef.h>
#include <sys/socket.h>

/* Long enough for a stalled mobile link and for one block of a slow reader. */
static const uint64_t RATE_WINDOW_MS = 15000;

/* The rate window starts at the first check, not here: most phases are over before it. */
void srv_watch_enter(srv_watch *watch, srv_phase phase, uint64_t now_ms) {
  *watch = (srv_watch){.phase = phase, .since_ms = now_ms};
}

bool srv_watch_paces(const srv_watch *watch) {
  return watch->phase == SRV_PHASE_BODY || watch->phase == SRV_PHASE_SEND || watch->phase == SRV_PHASE_LIVE;
}

void srv_watch_rest(srv_watch *watch) {
  watch->marked = false;
}

uint64_t srv_watch_moved(int fd, uint64_t counted) {
  struct tcp_info info;
  socklen_t size = sizeof info;
  bool known = getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
               size >= offsetof(struct tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received;
  return known ? info.tcpi_bytes_acked + info.tcpi_bytes_received : counted;
}

static bool too_slow(srv_watch *watch, uint64_t min_rate, uint64_t now_ms, uint64_t moved) {
  uint64_t elapsed_ms = now_ms - watch->mark_ms;
  if (watch->marked && elapsed_ms < RATE_WINDOW_MS) return false;
  bool slow = watch->marked && (moved - watch->mark_bytes) / (elapsed_ms / 1000) < min_rate;
  watch->marked = true;
  watch->mark_ms = now_ms;
  watch->mark_bytes = moved;
  return slow;
}

static bool stalls(srv_watch *watch, uint64_t now_ms, uint64_t moved) {
  if (watch->marked && moved == watch->mark_bytes) return now_ms - watch->mark_ms >= SRV_STALL_MS;
  watch->marked = true;
  watch->mark_ms = now_ms;
  watch->mark_bytes = moved;
  return false;
}

bool srv_watch_expired(srv_watch *watch, const srv_patience *patience, bool draining, uint64_t now_ms,
                       uint64_t moved) {
  uint64_t age_ms = now_ms - watch->since_ms;
  switch (watch->phase) {
  case SRV_PHASE_HEAD: return age_ms >= patience->header_ms;
  case SRV_PHASE_IDLE: return draining || age_ms >= patience->idle_ms;
  case SRV_PHASE_BODY:
    return age_ms >= patience->request_ms || too_slow(watch, patience->min_rate, now_ms, moved);
  case SRV_PHASE_WORK: return false;
  case SRV_PHASE_SEND: return too_slow(watch, patience->min_rate, now_ms, moved);
  case SRV_PHASE_LIVE: return stalls(watch, now_ms, moved);
  case SRV_PHASE_LINGER: return draining || age_ms >= SRV_LINGER_MS;
  }
  return false;
}
