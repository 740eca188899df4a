/* The life of connections: accepting, deadlines, lingering and closing. */
#include "io_loop.h"

#include "listen.h"
#include "machine.h"
#include "raw_socket.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <unistd.h>

/* A client receives this many bytes within a round trip. Outside the drain, a socket with fewer unsent bytes
 * does not linger. */
static const size_t UNSENT_LEAST = 64 << 10;

/* ---- accepting ------------------------------------------------------------------------------- */

/* Answers a connection that is refused with 503. Not over TLS, where an answer would need a handshake. */
static void turn_away(const srv_loop *l, int fd, unsigned reason) {
  static const char busy[] = "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nRetry-After: 1\r\n"
                             "Content-Length: 0\r\n\r\n";
  if (!l->http->tls) srv_raw_send(fd, busy, sizeof busy - 1); /* the send buffer of a fresh socket has room */
  shutdown(fd, SHUT_WR);
  srv_metrics_refusal(l->http->server->metrics, reason);
}

void srv_connections_listen(srv_loop *l) {
  /* EPOLLEXCLUSIVE: a new connection wakes one thread, not all. */
  l->accepting = true;
  for (size_t i = 0; i < l->http->listeners.count; i++) {
    struct epoll_event interest = {.events = EPOLLIN | EPOLLEXCLUSIVE, .data.fd = l->http->listeners.fds[i]};
    bool is_watched = epoll_ctl(l->epoll, EPOLL_CTL_ADD, interest.data.fd, &interest) == 0 || errno == EEXIST;
    l->accepting = l->accepting && is_watched;
  }
}

/* Stops watching the listening sockets until the next sweep: they stay ready, so the loop would spin. */
static void stop_listening(srv_loop *l) {
  for (size_t i = 0; i < l->http->listeners.count; i++)
    epoll_ctl(l->epoll, EPOLL_CTL_DEL, l->http->listeners.fds[i], NULL);
  l->accepting = false;
}

static void cut(srv_connection *c) {
  c->is_cut = true;
  shutdown(c->fd, SHUT_RDWR); /* the library finds the socket closed */
}

/* Whether the reserve has room for a connection over the limit. A full reserve cuts its oldest connection
 * that has no request, so that idle connections cannot keep a health check out. */
static bool has_reserve(srv_loop *l) {
  if (l->reserve < SRV_RESERVE_MAX) return true;
  srv_connection *oldest = NULL;
  for (srv_connection *c = l->connections; c; c = c->next)
    if (c->is_reserve && !c->is_cut && !c->exchange.target) oldest = c;
  if (oldest) cut(oldest);
  return oldest != NULL;
}

static void take_connection(srv_loop *l, int fd, bool is_over, const srv_address *peer) {
  if (is_over && !has_reserve(l)) {
    turn_away(l, fd, SRV_REFUSAL_CONNECTIONS);
    close(fd);
  } else if (MHD_add_connection(l->daemon, fd, &peer->any, peer->size) != MHD_YES) {
    srv_log(SRV_LOG_ERROR, "cannot serve a connection: %s", strerror(errno));
  }
}

void srv_connections_accept(srv_loop *l, int listener) {
  const srv_server *server = l->http->server;
  bool is_full = false; /* accept one connection only, as the library may count new ones later in the turn */
  for (size_t i = 0; i < SRV_ACCEPT_MAX && !is_full; i++) {
    srv_address peer = {.size = sizeof peer.local};
    int fd = accept4(listener, &peer.any, &peer.size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) {
      if (errno == EAGAIN || errno == EINTR || errno == ECONNABORTED) return;
      srv_log(SRV_LOG_ERROR, "cannot accept: %s", strerror(errno)); /* out of descriptors or memory */
      stop_listening(l);
      return;
    }
    size_t open = l->http->is_admin ? 0 : atomic_load(&server->connections);
    is_full = open + i >= server->config->max_connections;
    take_connection(l, fd, open >= server->config->max_connections, &peer);
  }
}

/* ---- lingering ------------------------------------------------------------------------------- */

/* A socket is kept open after its connection for two reasons. Closing it with unread bytes would reset the
 * connection before the client has read the answer. And once the process and its network are gone, nobody
 * sends the unsent bytes. */
struct srv_lingering {
  srv_lingering *next;
  int fd;
  bool discards;   /* reads and drops input until the client closes; else waits until all is sent */
  size_t unsent;   /* above 0: counted in srv_server.unsent */
  uint64_t end_ms; /* when lingering ends at the latest */
};

/* Keeps the socket of a closing connection open where that is needed. True when it does: the socket still
 * counts as a connection. */
static bool linger(srv_loop *l, const srv_connection *c) {
  if (c->is_cut || atomic_load(&l->http->stop)) return false;
  size_t unsent = srv_raw_unsent(c->fd);
  if (unsent < UNSENT_LEAST && !atomic_load(&l->http->server->draining)) unsent = 0;
  bool discards = c->is_unread && srv_raw_discard(c->fd);
  if (unsent == 0 && !discards) return false;
  srv_lingering *kept = malloc(sizeof *kept);
  int fd = kept ? fcntl(c->fd, F_DUPFD_CLOEXEC, 0) : -1;
  if (fd < 0) {
    free(kept);
    return false;
  }
  uint64_t end_ms = srv_now_ms() + (discards ? SRV_LINGER_MS : SRV_STALL_MS);
  *kept = (srv_lingering){.next = l->lingering, .fd = fd, .discards = discards, .end_ms = end_ms};
  l->lingering = kept;
  srv_set_unsent(l, &kept->unsent, unsent);
  struct epoll_event interest = {.events = EPOLLIN, .data.fd = fd};
  if (discards) epoll_ctl(l->epoll, EPOLL_CTL_ADD, fd, &interest);
  return true;
}

static void end_lingering(srv_loop *l, srv_lingering **link) {
  srv_lingering *kept = *link;
  *link = kept->next;
  srv_set_unsent(l, &kept->unsent, 0);
  atomic_fetch_sub(&l->http->server->connections, 1);
  close(kept->fd);
  free(kept);
}

/* True when the socket need not linger any more. */
static bool update_lingering(srv_loop *l, srv_lingering *kept, uint64_t now, bool draining) {
  size_t unsent = srv_raw_unsent(kept->fd);
  if (unsent < kept->unsent && !kept->discards) kept->end_ms = now + SRV_STALL_MS;
  srv_set_unsent(l, &kept->unsent, unsent);
  if (kept->discards) return now >= kept->end_ms;
  return unsent == 0 || (now >= kept->end_ms && !draining); /* --drain-timeout ends the drain */
}

void srv_connections_discard(srv_loop *l, int fd) {
  for (srv_lingering **link = &l->lingering; *link; link = &(*link)->next) {
    if ((*link)->fd != fd) continue;
    if (!srv_raw_discard(fd)) end_lingering(l, link);
    return;
  }
}

void srv_connections_end(srv_loop *l) {
  while (l->lingering) end_lingering(l, &l->lingering);
}

/* ---- start and end --------------------------------------------------------------------------- */

/* The peer's address as accepted: the socket no longer knows it once the client has reset the connection. */
static srv_address peer_of(struct MHD_Connection *mhd) {
  const struct sockaddr *address =
      MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CLIENT_ADDRESS)->client_addr;
  srv_address peer = {0};
  if (address && address->sa_family == AF_INET) memcpy(&peer.v4, address, sizeof peer.v4);
  if (address && address->sa_family == AF_INET6) memcpy(&peer.v6, address, sizeof peer.v6);
  return peer;
}

/* Whether --max-connections-per-address applies. Not to local sockets and trusted proxies, which serve many
 * clients. */
static bool is_limited(const srv_loop *l, const srv_client *client) {
  static const srv_client LOCAL;
  return !l->http->is_admin && memcmp(client, &LOCAL, sizeof LOCAL) != 0 &&
         !srv_networks_hold(&l->http->server->trusted, client);
}

/* Counts the connection for its address, or refuses it. Here and not in srv_connections_accept, since the
 * library certainly calls srv_connections_notify at the end of each connection whose start it has
 * reported. */
static void enter_address(srv_connection *c) {
  const srv_loop *l = c->owner;
  if (!is_limited(l, &c->client)) return;
  srv_client group = srv_client_group(&c->client);
  c->is_counted = srv_peers_enter(l->http->server->peers, &group);
  if (c->is_counted) return;
  turn_away(l, c->fd, SRV_REFUSAL_ADDRESS_CONNECTIONS);
  srv_enter(c, SRV_PHASE_LINGER); /* a request that has already arrived is not answered */
  cut(c);
}

static void leave_address(const srv_connection *c) {
  srv_client group = srv_client_group(&c->client);
  if (c->is_counted) srv_peers_leave(c->owner->http->server->peers, &group);
}

static void add_connection(srv_loop *l, struct MHD_Connection *mhd, void **socket_context) {
  srv_connection *c = calloc(1, sizeof *c);
  const srv_config *config = l->http->server->config;
  bool is_reserve =
      atomic_fetch_add(&l->http->server->connections, 1) >= config->max_connections && !l->http->is_admin;
  *socket_context = c;
  if (!c) return;
  api_service_hold(l->http->server->service, API_HELD_CONNECTION, SRV_CONNECTION_MEMORY);
  srv_address peer = peer_of(mhd);
  l->reserve += is_reserve;
  c->mhd = mhd;
  c->owner = l;
  c->is_reserve = is_reserve;
  c->fd = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
  c->client = srv_client_of(&peer);
  c->is_local = srv_listeners_are_loopback(&l->http->listeners, c->fd);
  srv_address_peer(&peer, c->peer, sizeof c->peer);
  c->next = l->connections;
  if (c->next) c->next->previous = c;
  l->connections = c;
  srv_enter(c, SRV_PHASE_HEAD);
  enter_address(c);
}

static void unlink_connection(srv_loop *l, const srv_connection *c) {
  if (c->previous) {
    c->previous->next = c->next;
  } else {
    l->connections = c->next;
  }
  if (c->next) c->next->previous = c->previous;
}

static void drop_connection(srv_loop *l, void **socket_context) {
  srv_connection *c = *socket_context;
  *socket_context = NULL;
  bool lingers = c && linger(l, c);
  if (!lingers) atomic_fetch_sub(&l->http->server->connections, 1);
  if (!c) return;
  unlink_connection(l, c);
  leave_address(c);
  l->reserve -= c->is_reserve;
  /* When the library fails before it has called srv_intake_take, it does not call srv_intake_end either. */
  srv_exchange_end(&c->exchange, c->peer, c->watch.phase < SRV_PHASE_LINGER);
  srv_set_unsent(l, &c->unsent, 0);
  api_service_let_go(l->http->server->service, API_HELD_CONNECTION, SRV_CONNECTION_MEMORY);
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

static uint64_t bytes_moved(const srv_connection *c) {
  if (!srv_watch_paces(&c->watch)) return 0;
  return srv_watch_moved(c->fd, c->exchange.bytes_in + c->exchange.bytes_out);
}

/* Closes an idle connection. Its last answer is complete, so the socket may linger until the client has
 * received it. */
static void let_go(const srv_connection *c) {
  shutdown(c->fd, SHUT_RDWR);
}

static void expire(srv_connection *c) {
  bool late_request =
      c->watch.phase == SRV_PHASE_BODY || (c->watch.phase == SRV_PHASE_HEAD && c->exchange.target);
  if (late_request) {
    srv_exchange_refuse(&c->exchange, SRV_REFUSAL_SLOW, 408, "the request did not arrive in time", 0);
    srv_intake_refuse(c);
    return;
  }
  if (c->watch.phase == SRV_PHASE_IDLE) {
    let_go(c);
  } else {
    cut(c);
  }
}

/* Whether the client closed right after its last bytes: the library has read those bytes and does not notice
 * the end. Not asked of connections that have been idle for longer, where the library does notice. */
static bool has_left(const srv_connection *c, uint64_t now) {
  uint64_t age_ms = now - c->watch.since_ms;
  bool awaits = c->watch.phase == SRV_PHASE_HEAD || c->watch.phase == SRV_PHASE_BODY ||
                (c->watch.phase == SRV_PHASE_IDLE && age_ms < (uint64_t)4 * SRV_SWEEP_MS);
  return awaits && age_ms >= SRV_SWEEP_MS && srv_raw_is_read_out(c->fd);
}

void srv_connections_sweep(srv_loop *l) {
  bool draining = atomic_load(&l->http->server->draining);
  uint64_t now = srv_now_ms();
  if (now - l->swept_ms < (draining ? SRV_DRAIN_SWEEP_MS : SRV_SWEEP_MS)) return;
  l->swept_ms = now;
  if (draining && l->http->listeners.is_passed)
    stop_listening(l);
  else if (!l->accepting)
    srv_connections_listen(l);
  for (srv_connection *c = l->connections; c; c = c->next) {
    if (draining) srv_note_unsent(c);
    if (c->waits && c->watch.phase == SRV_PHASE_SEND) srv_watch_rest(&c->watch); /* for a compute thread */
    if (c->watch.phase == SRV_PHASE_WORK && srv_exchange_give_up(&c->exchange))
      srv_hand_back(c);
    else if (srv_watch_expired(&c->watch, &l->http->patience, draining, now, bytes_moved(c)))
      expire(c);
    else if (has_left(c, now))
      let_go(c);
  }
  for (srv_lingering **link = &l->lingering; *link;) {
    if (update_lingering(l, *link, now, draining)) {
      end_lingering(l, link);
    } else {
      link = &(*link)->next;
    }
  }
  if (draining) atomic_store(&l->drains, true);
}
