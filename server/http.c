/* The I/O threads, and requests on their way in; deliver.c has the way out.
 *
 * Each I/O thread owns a daemon of the library and an epoll set of three: the library's own descriptor, an
 * eventfd by which compute threads and the main thread wake it, and the listening socket that all share.
 * The thread that is idle accepts; so a thread that computes a block of an answer gets no new connections.
 * A connection, its timers and its request are only touched by their thread. While a compute thread works
 * on a request, the connection is suspended in the library, which then neither reads, writes nor closes
 * it; the finished request comes back through `done` and the eventfd. */
#include "bypass.h"
#include "clock.h"
#include "listen.h"
#include "loop.h"

#include <errno.h>
#include <microhttpd.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum {
  /* The library's pool: the head, in which it reads, its records of it, and the answer's fields. It clears
   * the pool behind each request, so that more than it takes costs time; with less, the library would close
   * without a word on some of the heads that framing.h admits. It reads into the first half at least, so that
   * what comes behind a head leaves no more than the other half to the records. */
  CONNECTION_MEMORY = SRV_HEAD_MAX + (2 << 10),
  ACCEPT_MAX = 8, /* connections a thread takes before it serves those it has */
  SWEEP_MS = 250,
  STOP_MS = 2000 /* for what compute threads have begun of answers that are cut off */
};

static void wake(srv_loop *l) {
  uint64_t one = 1;
  /* Fails only when the counter is full, and then the loop wakes anyway. */
  ssize_t written = write(l->event, &one, sizeof one);
  (void)written;
}

/* ---- watching -------------------------------------------------------------------------------- */

static uint64_t moved(const srv_connection *c) {
  if (!srv_watch_paces(&c->watch)) return 0;
  return srv_watch_moved(c->fd, c->exchange.body.size + c->exchange.bytes_out);
}

void srv_enter(srv_connection *c, srv_phase phase) {
  srv_watch_enter(&c->watch, phase, c->owner->turn_ms);
}

/* Writes the answer past the library, which cannot answer in the middle of a request, and lets the client
 * read it: the sending side is closed and what still arrives is thrown away for a while, because closing
 * with bytes unread would reset the connection under the answer. */
static enum MHD_Result refuse_midway(srv_connection *c) {
  const char *reason = MHD_get_reason_phrase_for((unsigned)c->exchange.status);
  size_t size = 0;
  char *text = c->owner->http->tls ? NULL : srv_exchange_print(&c->exchange, reason, &size);
  bool sent = text != NULL && srv_bypass_say(c->fd, text, size);
  free(text);
  shutdown(c->fd, sent ? SHUT_WR : SHUT_RDWR);
  srv_enter(c, SRV_PHASE_LINGER);
  return MHD_YES;
}

/* The request is over and was refused: the library stops reading, sweeps throw away what comes. */
static enum MHD_Result discard_rest(srv_connection *c) {
  if (c->watch.phase != SRV_PHASE_LINGER) return MHD_NO;
  c->watch.phase = SRV_PHASE_DISCARD;
  MHD_suspend_connection(c->mhd);
  return MHD_YES;
}

static void end_discarding(srv_connection *c) {
  c->watch.phase = SRV_PHASE_OVER;
  shutdown(c->fd, SHUT_RDWR);
  MHD_resume_connection(c->mhd);
}

static void expire(srv_connection *c) {
  if (c->watch.phase == SRV_PHASE_DISCARD) {
    end_discarding(c);
    return;
  }
  bool late_request =
      c->watch.phase == SRV_PHASE_BODY || (c->watch.phase == SRV_PHASE_HEAD && c->exchange.target != NULL);
  if (!late_request) {
    shutdown(c->fd, SHUT_RDWR);
    return;
  }
  srv_exchange_refuse(&c->exchange, 408, "the request did not arrive in time", 0);
  refuse_midway(c);
}

static void sweep(srv_loop *l) {
  uint64_t now = srv_now_ms();
  if (now - l->swept_ms < SWEEP_MS) return;
  l->swept_ms = now;
  bool draining = atomic_load(&l->http->server->draining);
  for (srv_connection *c = l->connections; c != NULL; c = c->next) {
    if (c->watch.phase == SRV_PHASE_DISCARD && !srv_bypass_discard(c->fd)) {
      end_discarding(c);
    } else if (srv_watch_expired(&c->watch, &l->http->patience, draining, now, moved(c))) {
      expire(c);
    }
  }
}

/* ---- receiving ------------------------------------------------------------------------------- */

/* The library calls this with the untouched target, before it looks for arguments in it. */
static void *begin_request(void *context, const char *target, struct MHD_Connection *mhd) {
  (void)context;
  const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  srv_connection *c = info != NULL ? info->socket_context : NULL;
  if (c == NULL || !srv_exchange_begin(&c->exchange, c->owner->http->server, target)) return NULL;
  srv_enter(c, SRV_PHASE_HEAD);
  c->begun = c->owner->turns;
  c->framing = (srv_framing){0};
  srv_framing_target(&c->framing, target);
  if (c->framing.many_arguments) {
    srv_exchange_refuse(&c->exchange, c->framing.status, c->framing.detail, 0);
    refuse_midway(c);
  }
  return c;
}

static enum MHD_Result take_header(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                   const char *value, size_t value_size) {
  (void)kind;
  srv_framing_header(context, name, name_size, value != NULL ? value : "", value != NULL ? value_size : 0);
  return MHD_YES;
}

static const char *find_header(void *context, const char *name) {
  return MHD_lookup_connection_value(context, MHD_HEADER_KIND, name);
}

static bool client_waits(srv_exchange *exchange) {
  return srv_bypass_waits(((srv_connection *)(void *)exchange)->fd);
}

/* On a compute thread. The connection may be resumed, and freed, as soon as it is back. */
static void come_back(srv_exchange *exchange) {
  srv_hand_back(exchange);
}

static enum MHD_Result deliver(srv_connection *c) {
  return srv_deliver(c) ? MHD_YES : MHD_NO;
}

static enum MHD_Result open_request(srv_connection *c, const char *method, const char *version) {
  srv_framing *framing = &c->framing;
  srv_framing_version(framing, version);
  MHD_get_connection_values_n(c->mhd, MHD_HEADER_KIND, take_header, framing);
  srv_framing_end(framing);
  c->exchange.wanted = client_waits;
  c->exchange.ready = come_back;
  if (srv_exchange_open(&c->exchange, method, framing, find_header, c->mhd) == SRV_EXCHANGE_NOW) {
    /* The library would close with the body unread, which resets the connection under the answer. */
    return framing->continues || c->owner->http->tls ? deliver(c) : refuse_midway(c);
  }
  srv_enter(c, SRV_PHASE_BODY);
  return MHD_YES;
}

static enum MHD_Result take_body(srv_connection *c, const char *data, size_t *size) {
  size_t piece = *size;
  *size = 0;
  if (srv_exchange_take(&c->exchange, data, piece) == SRV_EXCHANGE_MORE) return MHD_YES;
  /* Over TLS the rest is read, and the answer follows it. */
  return c->owner->http->tls ? MHD_YES : refuse_midway(c);
}

static enum MHD_Result finish_request(srv_connection *c) {
  c->exchange.request.room = srv_replies_room(c->owner->replies); /* deliver is next to take from there */
  if (srv_exchange_finish(&c->exchange, c->begun == c->owner->turns) == SRV_EXCHANGE_NOW) return deliver(c);
  srv_enter(c, SRV_PHASE_WORK);
  MHD_suspend_connection(c->mhd);
  return MHD_YES;
}

static enum MHD_Result handle(void *context, struct MHD_Connection *mhd, const char *url, const char *method,
                              const char *version, const char *data, size_t *size, void **request) {
  (void)context;
  (void)url; /* decoded and cut at %00; the exchange has it as it came */
  srv_connection *c = *request;
  if (c == NULL) return MHD_NO;
  c->mhd = mhd;
  bool refused = c->watch.phase >= SRV_PHASE_LINGER;
  if (*size > 0 && refused) {
    *size = 0;
    return MHD_YES;
  }
  if (refused) return discard_rest(c);
  if (!c->exchange.opened) return open_request(c, method, version);
  return *size > 0 ? take_body(c, data, size) : finish_request(c);
}

static void end_request(void *context, struct MHD_Connection *mhd, void **request,
                        enum MHD_RequestTerminationCode how) {
  (void)context;
  (void)mhd;
  srv_connection *c = *request;
  if (c == NULL) return;
  bool refused = c->watch.phase >= SRV_PHASE_LINGER;
  srv_exchange_end(&c->exchange, c->peer, how != MHD_REQUEST_TERMINATED_COMPLETED_OK && !refused);
  *request = NULL;
  srv_reply_give_back(c->reply);
  c->reply = NULL;
  if (!refused) srv_enter(c, SRV_PHASE_IDLE);
}

/* ---- connections ----------------------------------------------------------------------------- */

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
  /* Where the library fails before it has called `handle`, it does not call end_request either. */
  srv_exchange_end(&c->exchange, c->peer, c->watch.phase < SRV_PHASE_LINGER);
  free(c);
}

static void notify_connection(void *context, struct MHD_Connection *mhd, void **socket_context,
                              enum MHD_ConnectionNotificationCode what) {
  srv_loop *l = context;
  if (what == MHD_CONNECTION_NOTIFY_STARTED) {
    add_connection(l, mhd, socket_context);
  } else {
    drop_connection(l, socket_context);
  }
}

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

static void watch_listener(srv_loop *l) {
  /* One thread, not all, is woken for a connection. */
  struct epoll_event interest = {.events = EPOLLIN | EPOLLEXCLUSIVE, .data.fd = l->http->listener};
  l->accepting = epoll_ctl(l->epoll, EPOLL_CTL_ADD, l->http->listener, &interest) == 0;
}

static void accept_some(srv_loop *l) {
  const srv_server *server = l->http->server;
  for (int i = 0; i < ACCEPT_MAX; i++) {
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

/* ---- loop ------------------------------------------------------------------------------------ */

void srv_hand_back(void *owner) {
  srv_connection *c = owner;
  srv_loop *l = c->owner;
  pthread_mutex_lock(&l->lock);
  bool was_empty = l->done == NULL;
  c->next_done = l->done;
  l->done = c;
  pthread_mutex_unlock(&l->lock);
  if (was_empty) wake(l);
}

static void resume_done(srv_loop *l) {
  uint64_t count;
  ssize_t got = read(l->event, &count, sizeof count);
  (void)got; /* only clears it */
  pthread_mutex_lock(&l->lock);
  srv_connection *c = l->done;
  l->done = NULL;
  pthread_mutex_unlock(&l->lock);
  while (c != NULL) {
    srv_connection *next = c->next_done;
    c->waits = false;
    MHD_resume_connection(c->mhd);
    c = next;
  }
}

static int wait_ms(const srv_loop *l) {
  unsigned long long wanted;
  int most = l->connections != NULL || !l->accepting ? SWEEP_MS : -1;
  if (MHD_get_timeout(l->daemon, &wanted) != MHD_YES) return most;
  return most < 0 || wanted < (unsigned long long)most ? (int)(wanted < SWEEP_MS ? wanted : SWEEP_MS) : most;
}

static void turn(srv_loop *l) {
  struct epoll_event events[3];
  int count = epoll_wait(l->epoll, events, 3, wait_ms(l));
  l->turns++;
  l->turn_ms = srv_now_ms();
  srv_work_outside(l->http->server->work, true);
  for (int i = 0; i < count; i++) {
    if (events[i].data.fd == l->http->listener) accept_some(l);
    if (events[i].data.fd == l->event) resume_done(l);
  }
  srv_log_hold(l->log_lines);
  MHD_run(l->daemon);
  srv_log_release();
  sweep(l);
  if (!l->accepting) watch_listener(l);
  srv_work_outside(l->http->server->work, false);
}

/* Streams have been handed back by now; a block that is under way takes no time to speak of. */
static void await_waiting(srv_loop *l) {
  bool waits = true;
  for (int i = 0; waits && i < STOP_MS; i++) {
    struct pollfd event = {.fd = l->event, .events = POLLIN};
    if (i > 0) poll(&event, 1, 1);
    resume_done(l);
    waits = false;
    for (const srv_connection *c = l->connections; c != NULL; c = c->next) waits |= c->waits;
  }
}

/* The library panics when it is stopped with a suspended connection. */
static bool all_back(srv_loop *l) {
  await_waiting(l);
  for (srv_connection *c = l->connections; c != NULL; c = c->next) {
    if (c->watch.phase == SRV_PHASE_DISCARD) end_discarding(c);
  }
  MHD_run(l->daemon);
  for (const srv_connection *c = l->connections; c != NULL; c = c->next) {
    if (c->watch.phase == SRV_PHASE_WORK || c->waits) return false;
  }
  return true;
}

static void *run_loop(void *context) {
  srv_loop *l = context;
  while (!atomic_load(&l->http->stop)) turn(l);
  if (all_back(l)) {
    MHD_stop_daemon(l->daemon);
    l->daemon = NULL;
  } else {
    atomic_store(&l->http->unfinished, true);
  }
  return NULL;
}

/* ---- start and stop -------------------------------------------------------------------------- */

static void log_library(void *context, const char *format, va_list arguments)
    __attribute__((format(printf, 2, 0)));
static void log_library(void *context, const char *format, va_list arguments) {
  (void)context;
  char text[512];
  vsnprintf(text, sizeof text, format, arguments);
  text[strcspn(text, "\n")] = '\0';
  srv_log(SRV_LOG_DEBUG, "libmicrohttpd: %s", text);
}

/* Targets are taken as they came, so the library need not decode its copy. */
static size_t keep_escaped(void *context, struct MHD_Connection *mhd, char *text) {
  (void)context;
  (void)mhd;
  return strlen(text);
}

static struct MHD_Daemon *start_daemon(srv_loop *l, const char *certificate, const char *key) {
  unsigned flags = MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
  if (l->http->tls) flags |= MHD_USE_TLS;
  struct MHD_OptionItem tls[] = {{MHD_OPTION_HTTPS_MEM_CERT, 0, (void *)(uintptr_t)certificate},
                                 {MHD_OPTION_HTTPS_MEM_KEY, 0, (void *)(uintptr_t)key},
                                 {MHD_OPTION_END, 0, NULL}};
  if (!l->http->tls) tls[0] = tls[2];
  unsigned limit = (unsigned)l->http->server->config->max_connections + ACCEPT_MAX;
  return MHD_start_daemon(flags, 0, NULL, NULL, handle, l, MHD_OPTION_EXTERNAL_LOGGER, log_library, NULL,
                          MHD_OPTION_URI_LOG_CALLBACK, begin_request, NULL, MHD_OPTION_UNESCAPE_CALLBACK,
                          keep_escaped, NULL, MHD_OPTION_NOTIFY_COMPLETED, end_request, NULL,
                          MHD_OPTION_NOTIFY_CONNECTION, notify_connection, l, MHD_OPTION_CONNECTION_LIMIT,
                          limit, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY,
                          MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_ARRAY, tls, MHD_OPTION_END);
}

static bool watch_descriptor(srv_loop *l, int fd) {
  struct epoll_event interest = {.events = EPOLLIN, .data.fd = fd};
  return epoll_ctl(l->epoll, EPOLL_CTL_ADD, fd, &interest) == 0;
}

static bool start_loop(srv_http *http, srv_loop *l, const char *certificate, const char *key) {
  l->http = http;
  pthread_mutex_init(&l->lock, NULL);
  l->replies = srv_replies_create(http->rewrites);
  l->log_lines = srv_log_lines_create();
  l->epoll = epoll_create1(EPOLL_CLOEXEC);
  l->event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  http->loop_count++;
  if (l->replies == NULL || l->epoll < 0 || l->event < 0) return false;
  l->daemon = start_daemon(l, certificate, key);
  if (l->daemon == NULL) return false;
  const union MHD_DaemonInfo *info = MHD_get_daemon_info(l->daemon, MHD_DAEMON_INFO_EPOLL_FD);
  if (info == NULL || !watch_descriptor(l, info->epoll_fd) || !watch_descriptor(l, l->event)) return false;
  watch_listener(l);
  l->started = l->accepting && pthread_create(&l->thread, NULL, run_loop, l) == 0;
  return l->started;
}

static void panic(void *context, const char *file, unsigned line, const char *reason) {
  (void)context;
  srv_log(SRV_LOG_ERROR, "libmicrohttpd gave up at %s:%u: %s", file, line, reason != NULL ? reason : "");
  abort();
}

srv_http *srv_http_start(srv_server *server, int listener, const char *certificate, const char *key,
                         char *error, size_t error_size) {
  const srv_config *config = server->config;
  size_t loops = (size_t)config->io_threads;
  srv_http *http = calloc(1, sizeof *http + loops * sizeof *http->loops);
  if (http == NULL) {
    snprintf(error, error_size, "out of memory");
    close(listener);
    return NULL;
  }
  http->server = server;
  http->listener = listener;
  http->tls = certificate != NULL;
  http->rewrites = srv_rewrites();
  http->patience = (srv_patience){.header_ms = config->header_timeout,
                                  .idle_ms = config->idle_timeout,
                                  .request_ms = config->request_timeout,
                                  .min_rate = config->min_rate};
  MHD_set_panic_func(panic, NULL);
  for (size_t i = 0; i < loops; i++) {
    if (start_loop(http, &http->loops[i], certificate, key)) continue;
    snprintf(error, error_size, "cannot start an I/O thread%s",
             http->tls ? "; is the certificate the key's?" : "");
    srv_http_stop(http);
    return NULL;
  }
  return http;
}

void srv_http_drain(srv_http *http) {
  for (size_t i = 0; i < http->loop_count; i++) wake(&http->loops[i]);
}

bool srv_http_stop(srv_http *http) {
  srv_live_end(http->server->live); /* hands every suspended stream back */
  atomic_store(&http->stop, true);
  for (size_t i = 0; i < http->loop_count; i++) {
    srv_loop *l = &http->loops[i];
    wake(l);
    if (l->started) pthread_join(l->thread, NULL);
  }
  if (atomic_load(&http->unfinished)) return false;
  for (size_t i = 0; i < http->loop_count; i++) {
    srv_loop *l = &http->loops[i];
    if (l->daemon != NULL) MHD_stop_daemon(l->daemon);
    srv_replies_destroy(l->replies);
    srv_log_lines_destroy(l->log_lines);
    if (l->epoll >= 0) close(l->epoll);
    if (l->event >= 0) close(l->event);
    pthread_mutex_destroy(&l->lock);
  }
  close(http->listener);
  free(http);
  return true;
}
