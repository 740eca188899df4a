/* Connections: how they come, how long they may take, and how they go. */
#include "connections.h"

#include "bypass.h"
#include "clock.h"
#include "intake.h"
#include "io_loop.h"
#include "listen.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

/* ---- accepting ------------------------------------------------------------------------------- */

/* Says why before it closes; without TLS, where that takes a handshake. */
static void turn_away(const srv_loop *l, int fd) {
  static const char BUSY[] = "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 1\r\n"
                             "Content-Length: 0\r\n\r\n";
  if (!l->http->tls) {
    srv_bypass_say(fd, BUSY, sizeof BUSY - 1); /* a fresh socket has room */
    shutdown(fd, SHUT_WR);
  }
  close(fd);
}

void srv_connections_listen(srv_loop *l) {
  /* One thread, not all, is woken for a connection. */
  struct epoll_event interest = {.events = EPOLLIN | EPOLLEXCLUSIVE, .data.fd = l->http->listener};
  l->accepting = epoll_ctl(l->epoll, EPOLL_CTL_ADD, l->http->listener, &interest) == 0;
}

void srv_connections_accept(srv_loop *l) {
  const srv_server *server = l->http->server;
  for (int i = 0; i < SRV_ACCEPT_MAX; i++) {
    struct sockaddr_storage peer = {0};
    socklen_t peer_size = sizeof peer;
    int fd = accept4(l->http->listener, (struct sockaddr *)&peer, &peer_size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) {
      if (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED) return;
      /* Out of descriptors or memory: without a pause this would spin. The next sweep tries again. */
      srv_log(SRV_LOG_ERROR, "cannot accept: %s", strerror(errno));
      epoll_ctl(l->epoll, EPOLL_CTL_DEL, l->http->listener, NULL);
      l->accepting = false;
      return;
    }
    if (atomic_load(&server->connections) >= server->config->max_connections) {
      turn_away(l, fd);
    } else if (MHD_add_connection(l->daemon, fd, (struct sockaddr *)&peer, peer_size) != MHD_YES) {
      srv_log(SRV_LOG_ERROR, "cannot serve a connection: %s", strerror(errno));
    }
  }
}

/* ---- their lives ------------------------------------------------------------------------------ */

static void add_connection(srv_loop *l, struct MHD_Connection *mhd, void **socket_context) {
  srv_connection *c = calloc(1, sizeof *c);
  atomic_fetch_add(&l->http->server->connections, 1);
  *socket_context = c;
  if (c == NULL) return;
  c->mhd = mhd;
  c->owner = l;
  c->fd = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
  srv_address peer = {.size = sizeof peer};
  if (getpeername(c->fd, &peer.any, &peer.size) == 0) srv_address_peer(&peer, c->peer, sizeof c->peer);
  c->next = l->connections;
  if (c->next != NULL) c->next->previous = c;
  l->connections = c;
  srv_enter(c, SRV_PHASE_HEAD);
}

static void drop_connection(srv_loop *l, void **socket_context) {
  srv_connection *c = *socket_context;
  atomic_fetch_sub(&l->http->server->connections, 1);
  *socket_context = NULL;
  if (c == NULL) return;
  if (c->previous != NULL) {
    c->previous->next = c->next;
  } else {
    l->connections = c->next;
  }
  if (c->next != NULL) c->next->previous = c->previous;
  /* Where the library fails before it has called srv_intake_take, it does not call srv_intake_end either. */
  srv_exchange_end(&c->exchange, c->peer, c->watch.phase < SRV_PHASE_LINGER);
  free(c);
}

void srv_connections_notify(void *context, struct MHD_Connection *mhd, void **socket_context,
                            enum MHD_ConnectionNotificationCode what) {
  srv_loop *l = context;
  if (what == MHD_CONNECTION_NOTIFY_STARTED) {
    add_connection(l, mhd, socket_context);
  } else {
    drop_connection(l, socket_context);
  }
}

/* ---- watching -------------------------------------------------------------------------------- */

static uint64_t moved(const srv_connection *c) {
  if (!srv_watch_paces(&c->watch)) return 0;
  return srv_watch_moved(c->fd, c->exchange.bytes_in + c->exchange.bytes_out);
}

void srv_enter(srv_connection *c, srv_phase phase) {
  srv_watch_enter(&c->watch, phase, c->owner->turn_ms);
}

void srv_connection_give_up(srv_connection *c) {
  c->watch.phase = SRV_PHASE_OVER;
  shutdown(c->fd, SHUT_RDWR);
  MHD_resume_connection(c->mhd);
}

static void expire(srv_connection *c) {
  if (c->watch.phase == SRV_PHASE_DISCARD) {
    srv_connection_give_up(c);
    return;
  }
  bool late_request =
      c->watch.phase == SRV_PHASE_BODY || (c->watch.phase == SRV_PHASE_HEAD && c->exchange.target != NULL);
  if (!late_request) {
    shutdown(c->fd, SHUT_RDWR);
    return;
  }
  srv_exchange_refuse(&c->exchange, 408, "the request did not arrive in time", 0);
  srv_intake_refuse(c);
}

void srv_connections_sweep(srv_loop *l) {
  uint64_t now = srv_now_ms();
  if (now - l->swept_ms < SRV_SWEEP_MS) return;
  l->swept_ms = now;
  bool draining = atomic_load(&l->http->server->draining);
  for (srv_connection *c = l->connections; c != NULL; c = c->next) {
    if (c->watch.phase == SRV_PHASE_DISCARD && !srv_bypass_discard(c->fd)) {
      srv_connection_give_up(c);
    } else if (c->watch.phase == SRV_PHASE_WORK && srv_exchange_give_up(&c->exchange)) {
      srv_hand_back(c);
    } else if (srv_watch_expired(&c->watch, &l->http->patience, draining, now, moved(c))) {
      expire(c);
    }
  }
}
