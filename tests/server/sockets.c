/* The daemon of a test, and its client. */
#include "sockets.h"

#include "fake_api.h"
#include "listen.h"

#include <ctype.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Times are longer than any test, so that a busy machine does not matter; tests of one of them make it short.
 */
static const srv_config PATIENT = {.threads = 2,
                                   .io_threads = 2,
                                   .queue = 2,
                                   .max_connections = 64,
                                   .max_listeners = 2,
                                   .max_upload = 3 << 20,
                                   .header_timeout = 60000,
                                   .idle_timeout = 60000,
                                   .request_timeout = 60000,
                                   .min_rate = 0};

void start(fixture *f) {
  srv_error error = {""};
  assert_true(srv_address_parse("127.0.0.1:0", &f->address, &error));
  int listener = srv_address_listen(&f->address, &error);
  assert_true(listener >= 0);
  socklen_t size = sizeof f->address.v4;
  assert_int_equal(getsockname(listener, &f->address.any, &size), 0);
  f->server = (srv_server){.config = &f->config, .spool.folder = "/tmp"};
  f->server.metrics = srv_metrics_create();
  f->server.rates = srv_rates_create();
  f->server.peers = srv_peers_create(f->config.max_connections_per_address);
  f->server.work = srv_work_create((size_t)f->config.threads, (size_t)f->config.queue, 0);
  f->server.live = srv_live_create(NULL, (size_t)f->config.max_listeners, SRV_LIVE_PULSE_NS);
  f->http = srv_http_start(&f->server, &(srv_listeners){.fds = {listener}, .count = 1},
                           f->is_tls ? SRV_HTTP_TLS : SRV_HTTP_PLAIN, &error);
  assert_non_null(f->http);
}

int set_up(void **state) {
  signal(SIGPIPE, SIG_IGN);
  fixture *f = calloc(1, sizeof *f);
  f->config = PATIENT;
  f->answer = malloc(ANSWER_MAX + 1);
  start(f);
  *state = f;
  return 0;
}

bool stop(fixture *f) {
  fake_api_release();
  bool stopped = srv_http_stop(f->http);
  srv_live_destroy(f->server.live);
  srv_work_destroy(f->server.work);
  srv_metrics_destroy(f->server.metrics);
  srv_rates_destroy(f->server.rates);
  srv_peers_destroy(f->server.peers);
  return stopped;
}

void restart(fixture *f) {
  assert_true(stop(f));
  start(f);
}

void wait_in_flight(fixture *f, size_t count) {
  for (int waited = 0; waited < PATIENCE_MS && atomic_load(&f->server.in_flight) != count; waited++)
    pause_ms(1);
  assert_int_equal(atomic_load(&f->server.in_flight), count);
}

int tear_down(void **state) {
  fixture *f = *state;
  bool stopped = stop(f);
  bool clean = atomic_load(&f->server.in_flight) == 0 && atomic_load(&f->server.connections) == 0 &&
               fake_api_open_bodies() == 0;
  free(f->answer);
  free(f);
  return stopped && clean ? 0 : -1;
}

/* ---- the client ------------------------------------------------------------------------------ */

uint64_t clock_ms(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000 + (uint64_t)now.tv_nsec / 1000000;
}

void pause_ms(long ms) {
  nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

int connect_client(fixture *f) {
  int fd = srv_address_connect(&f->address, PATIENCE_MS);
  assert_true(fd >= 0);
  return fd;
}

void say(int fd, const char *text) {
  (void)!send(fd, text, strlen(text), MSG_NOSIGNAL);
}

/* Reads until the other side closes; false when it resets or stays open. */
bool read_all(fixture *f, int fd) {
  f->answer_size = 0;
  for (;;) {
    ssize_t got = recv(fd, f->answer + f->answer_size, ANSWER_MAX - f->answer_size, 0);
    if (got <= 0) {
      f->answer[f->answer_size] = '\0';
      return got == 0;
    }
    f->answer_size += (size_t)got;
  }
}

/* Reads until `text` has come. */
void read_until(fixture *f, int fd, const char *text) {
  uint64_t end = clock_ms() + PATIENCE_MS;
  f->answer_size = 0;
  f->answer[0] = '\0';
  while (strstr(f->answer, text) == NULL) {
    ssize_t got = recv(fd, f->answer + f->answer_size, ANSWER_MAX - f->answer_size, 0);
    assert_true(got > 0 && clock_ms() < end);
    f->answer_size += (size_t)got;
    f->answer[f->answer_size] = '\0';
  }
}

/* One request on a connection of its own, up to its close. */
bool ask(fixture *f, const char *request) {
  int fd = connect_client(f);
  say(fd, request);
  bool closed = read_all(f, fd);
  close(fd);
  return closed;
}

int status(const fixture *f) {
  return f->answer_size > 12 && memcmp(f->answer, "HTTP/1.1 ", 9) == 0 ? (int)strtol(f->answer + 9, NULL, 10)
                                                                       : 0;
}

/* Text of the library's own may speak of HTTP/1.1, too. */
size_t answers(const fixture *f) {
  static const char START[] = "HTTP/1.1 ";
  size_t count = 0;
  for (const char *at = f->answer; (at = strstr(at, START)) != NULL; at++)
    count += isdigit((unsigned char)at[strlen(START)]) != 0;
  return count;
}

const char *body(const fixture *f) {
  const char *end = strstr(f->answer, "\r\n\r\n");
  return end != NULL ? end + 4 : "";
}

size_t body_size(const fixture *f) {
  return f->answer_size - (size_t)(body(f) - f->answer);
}

bool has(const fixture *f, const char *text) {
  return strstr(f->answer, text) != NULL;
}

void assert_refused(fixture *f, int expected, const char *request) {
  assert_true(ask(f, request));
  assert_int_equal(status(f), expected);
  assert_int_equal(answers(f), 1);
  assert_true(has(f, "Connection: close"));
}
