/* Sends any bytes on a connection to a whole daemon that stores one model; "{id}" is replaced by the model's
 * id. The answer must begin as HTTP, the connection must end, and the next one must be served. The store is
 * in memory. */
#include "http.h"
#include "listen.h"
#include "loopback.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum {
  INPUT_MAX = 1 << 16,
  STORED_MAX = 32,
  SILENCE_MS = 2,
  STREAM_MS = 50,
  PIECES_MAX = 8,
  PATIENCE_MS = 60000
};

static const char model[] =
    "{\"meshes\":[{\"name\":\"m\",\"positions\":[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[2,0,1]],"
    "\"faces\":[[0,1,2,3],[1,4,2]]}],\"nodes\":[{\"name\":\"a\",\"mesh\":\"m\"}],"
    "\"clips\":[{\"name\":\"c\",\"tracks\":[{\"node\":\"a\",\"path\":\"rotation\",\"times\":[0,1],"
    "\"quaternions\":[[0,0,0,1],[0,0,1,0]]}]}]}";

typedef struct served {
  srv_config config;
  srv_server server;
  srv_address address;
  srv_http *http;
  loopback *loop;
  char id[API_ID_TEXT];
} served;

static void give_up(const char *what) {
  fprintf(stderr, "http_fuzz: %s\n", what);
  abort();
}

static served *start(void) {
  api_settings settings = loopback_settings();
  settings.hosts = "*"; /* the inputs name some */
  settings.limits.max_upload = INPUT_MAX;
  settings.limits.max_level = 3;
  settings.limits.max_faces = 10000;
  settings.limits.max_output = 1 << 20;
  settings.limits.max_times = 1000;
  served *d = calloc(1, sizeof *d);
  if (!d) abort();
  d->config = (srv_config){.threads = 2,
                           .io_threads = 1,
                           .queue = 8,
                           .max_connections = 16,
                           .max_listeners = 2,
                           .max_upload = settings.limits.max_upload,
                           .header_timeout = PATIENCE_MS,
                           .idle_timeout = PATIENCE_MS,
                           .request_timeout = PATIENCE_MS};
  d->server = (srv_server){.config = &d->config, .spool.folder = "/tmp"};
  d->server.metrics = srv_metrics_create();
  d->server.rates = srv_rates_create();
  d->server.peers = srv_peers_create(0);
  d->server.work = srv_work_create((size_t)d->config.threads, (size_t)d->config.queue, 0);
  settings.parallel = (api_parallel_for){.owner = d->server.work, .run = srv_work_parallel_for};
  d->loop = loopback_start(&settings);
  d->server.service = d->loop->service;
  d->server.live = srv_live_create(d->loop->service, (size_t)d->config.max_listeners, SRV_LIVE_PULSE_NS);
  loopback_upload(d->loop, "application/json", model, d->id);
  srv_error error = {""};
  if (!srv_address_parse("127.0.0.1:0", &d->address, &error)) give_up(error.text);
  int listener = srv_address_listen(&d->address, &error);
  if (listener < 0) give_up(error.text);
  d->address = srv_address_of(listener);
  const srv_listeners listeners = {.fds = {listener}, .count = 1};
  d->http = srv_http_start(&d->server, &listeners, SRV_HTTP_PLAIN, &error);
  if (!d->http) give_up(error.text);
  return d;
}

static void stop(served *d) {
  if (!srv_http_stop(d->http)) give_up("a request does not end");
  srv_live_destroy(d->server.live);
  srv_work_destroy(d->server.work);
  srv_metrics_destroy(d->server.metrics);
  srv_rates_destroy(d->server.rates);
  srv_peers_destroy(d->server.peers);
  loopback_stop(d->loop);
  free(d);
}

/* Copies the input with "{id}" replaced by the model's id; returns its length. */
static size_t fill_in(const served *d, const uint8_t *bytes, size_t size, char *out) {
  static const char MARK[] = "{id}";
  size_t length = 0;
  for (size_t i = 0; i < size && length < INPUT_MAX; i++) {
    if (size - i >= strlen(MARK) && memcmp(bytes + i, MARK, strlen(MARK)) == 0) {
      length += (size_t)sprintf(out + length, "%s", d->id);
      i += strlen(MARK) - 1;
    } else {
      out[length++] = (char)bytes[i];
    }
  }
  return length;
}

/* Sends the text, then reads until the daemon closes the connection or is silent: a live stream has no end.
 * head: the first bytes of the answer, terminated. */
static void converse(const served *d, const char *text, size_t size, int silence_ms, char *head,
                     size_t head_size) {
  int fd = srv_address_connect(&d->address, PATIENCE_MS);
  if (fd < 0) give_up("no connection");
  char piece[1 << 14];
  size_t sent = 0, kept = 0;
  ssize_t count = 1;
  for (int pieces = 0; count > 0 && pieces < PIECES_MAX; pieces++) {
    struct pollfd end = {.fd = fd, .events = (short)(sent < size ? POLLIN | POLLOUT : POLLIN)};
    bool works = atomic_load(&d->server.in_flight) > 0;
    int ready = poll(&end, 1, works && silence_ms < STREAM_MS ? STREAM_MS : silence_ms);
    if (ready < 0 && errno == EINTR) continue; /* the fuzzer's timer */
    if (ready <= 0) break;
    if (end.revents & POLLOUT) {
      ssize_t more = send(fd, text + sent, size - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      sent = more < 0 ? size : sent + (size_t)more;
    }
    if (!(end.revents & (POLLIN | POLLHUP | POLLERR))) continue;
    count = recv(fd, piece, sizeof piece, MSG_DONTWAIT);
    size_t room = head_size - 1 - kept, more = count < 0 ? 0 : (size_t)count < room ? (size_t)count : room;
    memcpy(head + kept, piece, more);
    kept += more;
  }
  head[kept] = '\0';
  /* Close with a reset, which ends any request in progress. */
  setsockopt(fd, SOL_SOCKET, SO_LINGER, &(struct linger){.l_onoff = 1}, sizeof(struct linger));
  close(fd);
}

static void wait_for_no_connection(served *d) {
  static const struct timespec STEP = {.tv_nsec = 100000};
  for (int waited = 0; atomic_load(&d->server.connections) > 0 || atomic_load(&d->server.in_flight) > 0;
       waited++) {
    if (waited == PATIENCE_MS * 10) give_up("the connection does not end");
    nanosleep(&STEP, NULL);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  static const char HEALTH[] = "GET /healthz HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n";
  static served *d;
  static char text[INPUT_MAX + API_ID_TEXT];
  char head[64];
  int status = 0;
  if (size > INPUT_MAX) return 0;
  signal(SIGPIPE, SIG_IGN);
  if (!d) d = start();
  converse(d, text, fill_in(d, bytes, size, text), SILENCE_MS, head, sizeof head);
  if (head[0] && (sscanf(head, "HTTP/1.%*1[01] %d", &status) != 1 || status < 100 || status > 599))
    give_up(head);
  wait_for_no_connection(d);
  converse(d, HEALTH, strlen(HEALTH), PATIENCE_MS, head, sizeof head);
  if (strncmp(head, "HTTP/1.1 200", strlen("HTTP/1.1 200")) != 0) give_up("not well afterwards");
  if (loopback_store_count(d->loop) != 1) { /* start again: the model is gone or the store has grown */
    stop(d);
    d = NULL;
  }
  return 0;
}
