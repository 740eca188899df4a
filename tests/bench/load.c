/* The client of the request benchmark. */
#include "load.h"

#include "report.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CONNECTIONS_MAX = 64, BUFFER_SIZE = 64 << 10 };

/* A connection and the answer that it is receiving. */
typedef struct link_state {
  uint64_t size, left; /* bytes of the answer, once its head is complete; of its body to come */
  size_t head_size;    /* bytes of the head so far */
  int fd;
  bool in_body;
  char head[LOAD_HEAD_MAX + 1];
} link_state;

static void fail(const char *what) {
  fprintf(stderr, "load: %s\n", what);
  exit(1);
}

int load_connect(uint16_t port) {
  struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(port)};
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  int fd = socket(AF_INET, SOCK_STREAM, 0), one = 1;
  if (fd < 0 || connect(fd, (struct sockaddr *)&address, sizeof address) != 0) fail("no connection");
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
  return fd;
}

static void ask(load *l, const link_state *link) {
  char text[LOAD_REQUEST_SIZE];
  size_t size = l->request(l->context, l->sent++, text);
  if (send(link->fd, text, size, MSG_NOSIGNAL) != (ssize_t)size) fail("a request could not be sent");
}

/* Appends bytes to the head; returns how many belonged to it. */
static size_t take_head(link_state *link, const char *bytes, size_t size) {
  size_t before = link->head_size, room = LOAD_HEAD_MAX - before, count = size < room ? size : room;
  memcpy(link->head + before, bytes, count);
  link->head[before + count] = '\0';
  char *end = strstr(link->head, "\r\n\r\n");
  if (!end && count == room) fail("an answer's head is too long");
  link->head_size += count;
  if (!end) return count;
  size_t head = (size_t)(end + 4 - link->head);
  end[2] = '\0';
  const char *length = strcasestr(link->head, "\r\nContent-Length:");
  if (strncmp(link->head, "HTTP/1.1 200 ", 13) != 0 || !length) fail(link->head);
  link->left = strtoull(length + 17, NULL, 10);
  link->size = head + link->left;
  link->in_body = true;
  return head - before;
}

/* Reads available bytes; true when the answer is complete. */
static bool read_answer(link_state *link) {
  static char buffer[BUFFER_SIZE];
  ssize_t got = recv(link->fd, buffer, sizeof buffer, 0);
  if (got <= 0) fail("the server closed a connection");
  size_t size = (size_t)got, used = 0;
  if (!link->in_body) used = take_head(link, buffer, size);
  if (!link->in_body) return false;
  if (size - used > link->left) fail("an answer is longer than it says");
  link->left -= size - used;
  if (link->left > 0) return false;
  link->in_body = false;
  link->head_size = 0;
  return true;
}

double load_run(load *l, int connections, double seconds) {
  static link_state links[CONNECTIONS_MAX];
  struct epoll_event events[CONNECTIONS_MAX];
  int poller = epoll_create1(0);
  if (poller < 0 || connections > CONNECTIONS_MAX) fail("no epoll");
  for (int i = 0; i < connections; i++) {
    links[i] = (link_state){.fd = load_connect(l->port)};
    struct epoll_event interest = {.events = EPOLLIN, .data.ptr = &links[i]};
    epoll_ctl(poller, EPOLL_CTL_ADD, links[i].fd, &interest);
  }
  double start = bench_now(), end = start;
  uint64_t answers = 0;
  const link_state *last = links;
  for (int i = 0; i < connections; i++) ask(l, &links[i]);
  while (end - start < seconds) {
    int count = epoll_wait(poller, events, CONNECTIONS_MAX, 1000);
    if (count <= 0) fail("no answer within a second");
    for (int i = 0; i < count; i++) {
      link_state *link = events[i].data.ptr;
      if (!read_answer(link)) continue;
      last = link;
      answers++;
      ask(l, link);
    }
    end = bench_now();
  }
  l->answer_size = last->size;
  memcpy(l->head, last->head, sizeof l->head);
  for (int i = 0; i < connections; i++) close(links[i].fd);
  close(poller);
  return (double)answers / (end - start);
}
