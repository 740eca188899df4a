/* The I/O threads. intake.c handles requests on their way in, deliver.c answers on their way out.
 *
 * Each I/O thread owns one libmicrohttpd daemon ("the library" below) and one epoll set. The set holds the
 * library's own epoll descriptor, an eventfd by which compute threads and the main thread wake the I/O
 * thread, the listening sockets that all threads share, and lingering sockets (connections.c). An idle thread
 * accepts, so a thread that is computing a block of an answer gets no new connections. Only the owning thread
 * touches a connection, its timers and its request. While a compute thread works on a request, the connection
 * is suspended in the library, which then neither reads, writes nor closes it. The finished request comes
 * back through `done` and the eventfd. */
#include "http.h"
#include "io_loop.h"
#include "machine.h"
#include "tls.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum {
  CONNECTION_SLACK = 64, /* library's limit minus --max-connections */
  STOP_MS = 2000         /* wait for blocks that compute threads are making */
};

/* ---- loop ------------------------------------------------------------------------------------ */

static void resume_done(srv_loop *l) {
  uint64_t count;
  ssize_t got = read(l->event, &count, sizeof count);
  (void)got; /* the read only resets the eventfd */
  pthread_mutex_lock(&l->lock);
  srv_connection *c = l->done;
  l->done = NULL;
  pthread_mutex_unlock(&l->lock);
  while (c) {
    srv_connection *next = c->next_done;
    c->waits = false;
    MHD_resume_connection(c->mhd);
    c = next;
  }
}

static int wait_ms(const srv_loop *l) {
  unsigned long long wanted;
  bool watches = l->connections || l->lingering || !l->accepting;
  int most = atomic_load(&l->http->server->draining) ? SRV_DRAIN_SWEEP_MS : watches ? SRV_SWEEP_MS : -1;
  if (MHD_get_timeout(l->daemon, &wanted) != MHD_YES) return most;
  return most < 0 || wanted < (unsigned long long)most ? (int)(wanted < SRV_SWEEP_MS ? wanted : SRV_SWEEP_MS)
                                                       : most;
}

static bool is_listener(const srv_http *http, int fd) {
  for (size_t i = 0; i < http->listeners.count; i++)
    if (http->listeners.fds[i] == fd) return true;
  return false;
}

static void handle(srv_loop *l, const struct epoll_event *event) {
  int fd = event->data.fd;
  if (is_listener(l->http, fd)) {
    srv_connections_accept(l, fd);
  } else if (fd == l->event) {
    resume_done(l);
  } else if (fd != l->library) {
    srv_connections_discard(l, fd);
  }
}

static void run_turn(srv_loop *l) {
  enum { EVENTS_MAX = 16 };
  struct epoll_event events[EVENTS_MAX];
  int count = epoll_wait(l->epoll, events, EVENTS_MAX, wait_ms(l));
  l->turn_ms = srv_now_ms();
  srv_work_outside(l->http->server->work, true);
  l->blocks_before = l->blocks;
  l->blocks = 0;
  for (int i = 0; i < count; i++) handle(l, &events[i]);
  MHD_run(l->daemon);
  srv_connections_sweep(l);
  srv_work_outside(l->http->server->work, false);
  atomic_store(&l->has_turned, true);
}

/* Waits for the blocks that compute threads are making, up to STOP_MS. Suspended streams have been handed
 * back already, and a block takes a few milliseconds. */
static void await_suspended(srv_loop *l) {
  bool waits = true;
  for (int i = 0; waits && i < STOP_MS; i++) {
    struct pollfd event = {.fd = l->event, .events = POLLIN};
    if (i > 0) poll(&event, 1, 1);
    resume_done(l);
    waits = false;
    for (const srv_connection *c = l->connections; c; c = c->next) waits |= c->waits;
  }
}

/* Whether no connection is suspended any more: the library panics when it is stopped with one. */
static bool all_back(srv_loop *l) {
  await_suspended(l);
  MHD_run(l->daemon);
  for (const srv_connection *c = l->connections; c; c = c->next) {
    if (c->watch.phase == SRV_PHASE_WORK || c->waits) return false;
  }
  return true;
}

static void *run_loop(void *context) {
  srv_loop *l = context;
  while (!atomic_load(&l->http->stop)) run_turn(l);
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
  srv_intake_complaint(context);
  char text[512];
  vsnprintf(text, sizeof text, format, arguments);
  text[strcspn(text, "\n")] = '\0';
  srv_log(SRV_LOG_DEBUG, "libmicrohttpd: %s", text);
}

/* Leaves the library's copy of the target escaped: the exchange uses the target as it arrived. */
static size_t keep_escaped(void *context, struct MHD_Connection *mhd, char *text) {
  (void)context;
  (void)mhd;
  return strlen(text);
}

static struct MHD_Daemon *start_daemon(srv_loop *l) {
  unsigned flags = MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
  if (l->http->tls) flags |= MHD_USE_TLS;
  struct MHD_OptionItem options[] = {
#if MHD_VERSION >= 0x01000000
    {MHD_OPTION_CLIENT_DISCIPLINE_LVL, 1, NULL},
#endif
    {l->http->tls ? MHD_OPTION_HTTPS_CERT_CALLBACK : MHD_OPTION_END, 0, (void *)(intptr_t)srv_tls_choose},
    {MHD_OPTION_HTTPS_PRIORITIES, 0, (void *)(uintptr_t)SRV_TLS_PRIORITIES},
    {MHD_OPTION_END, 0, NULL}
  };
  unsigned limit = (unsigned)l->http->server->config->max_connections + CONNECTION_SLACK;
  return MHD_start_daemon(flags, 0, NULL, NULL, srv_intake_take, l, MHD_OPTION_EXTERNAL_LOGGER, log_library,
                          l, MHD_OPTION_URI_LOG_CALLBACK, srv_intake_begin, NULL,
                          MHD_OPTION_UNESCAPE_CALLBACK, keep_escaped, NULL, MHD_OPTION_NOTIFY_COMPLETED,
                          srv_intake_end, NULL, MHD_OPTION_NOTIFY_CONNECTION, srv_connections_notify, l,
                          MHD_OPTION_CONNECTION_LIMIT, limit, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
                          (size_t)SRV_CONNECTION_MEMORY, MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1,
                          MHD_OPTION_ARRAY, options, MHD_OPTION_END);
}

static bool watch_descriptor(srv_loop *l, int fd) {
  struct epoll_event interest = {.events = EPOLLIN, .data.fd = fd};
  return epoll_ctl(l->epoll, EPOLL_CTL_ADD, fd, &interest) == 0;
}

static bool start_loop(srv_http *http, srv_loop *l) {
  l->http = http;
  pthread_mutex_init(&l->lock, NULL);
  l->epoll = epoll_create1(EPOLL_CLOEXEC);
  l->event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  http->loop_count++;
  atomic_init(&l->has_turned, true);
  if (l->epoll < 0 || l->event < 0) return false;
  l->daemon = start_daemon(l);
  if (!l->daemon) return false;
  const union MHD_DaemonInfo *info = MHD_get_daemon_info(l->daemon, MHD_DAEMON_INFO_EPOLL_FD);
  if (!info) return false;
  l->library = info->epoll_fd;
  if (!watch_descriptor(l, l->library) || !watch_descriptor(l, l->event)) return false;
  srv_connections_listen(l);
  bool is_accepting = l->accepting; /* the thread's from its start on */
  int reason = is_accepting ? pthread_create(&l->thread, NULL, run_loop, l) : errno;
  l->started = is_accepting && reason == 0;
  errno = reason;
  return l->started;
}

static void panic(void *context, const char *file, unsigned line, const char *reason) {
  (void)context;
  srv_log(SRV_LOG_ERROR, "libmicrohttpd gave up at %s:%u: %s", file, line, reason ? reason : "");
  abort();
}

srv_http *srv_http_start(srv_server *server, const srv_listeners *listeners, srv_http_kind kind,
                         srv_error *error) {
  const srv_config *config = server->config;
  size_t loops = kind == SRV_HTTP_ADMIN ? 1 : (size_t)config->io_threads;
  srv_http *http = calloc(1, sizeof *http + loops * sizeof *http->loops);
  if (!http) {
    srv_fail(error, "out of memory");
    srv_listeners_close(listeners);
    return NULL;
  }
  http->server = server;
  http->listeners = *listeners;
  http->tls = kind == SRV_HTTP_TLS;
  http->is_admin = kind == SRV_HTTP_ADMIN;
  http->patience = (srv_patience){.header_ms = config->header_timeout,
                                  .idle_ms = config->idle_timeout,
                                  .request_ms = config->request_timeout,
                                  .min_rate = config->min_rate};
  MHD_set_panic_func(panic, NULL);
  for (size_t i = 0; i < loops; i++) {
    if (start_loop(http, &http->loops[i])) continue;
    srv_fail(error, "--io-threads: cannot start socket thread %zu of %zu: %s", i + 1, loops, strerror(errno));
    srv_http_stop(http);
    return NULL;
  }
  return http;
}

bool srv_http_turns(srv_http *http) {
  bool all = true;
  for (size_t i = 0; i < http->loop_count; i++) {
    all = atomic_exchange(&http->loops[i].has_turned, false) && all;
    srv_wake(&http->loops[i]);
  }
  return all;
}

void srv_http_drain(srv_http *http) {
  for (size_t i = 0; i < http->loop_count; i++) srv_wake(&http->loops[i]);
}

bool srv_http_is_drained(const srv_http *http) {
  for (size_t i = 0; i < http->loop_count; i++)
    if (!atomic_load(&http->loops[i].drains)) return false;
  /* Read in_flight first: unsent bytes of an answer are counted before its request leaves in_flight. */
  return atomic_load(&http->server->in_flight) == 0 && atomic_load(&http->server->unsent) == 0;
}

bool srv_http_stop(srv_http *http) {
  srv_live_end(http->server->live); /* hands back every suspended stream */
  atomic_store(&http->stop, true);
  for (size_t i = 0; i < http->loop_count; i++) {
    srv_loop *l = &http->loops[i];
    srv_wake(l);
    if (l->started) pthread_join(l->thread, NULL);
  }
  if (atomic_load(&http->unfinished)) return false;
  for (size_t i = 0; i < http->loop_count; i++) {
    srv_loop *l = &http->loops[i];
    if (l->daemon) MHD_stop_daemon(l->daemon);
    srv_connections_end(l);
    if (l->epoll >= 0) close(l->epoll);
    if (l->event >= 0) close(l->event);
    pthread_mutex_destroy(&l->lock);
  }
  srv_listeners_close(&http->listeners);
  free(http);
  return true;
}
