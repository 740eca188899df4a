/* Socket calls that do not block. */
#include "raw_socket.h"

#include <errno.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

bool srv_raw_send(int fd, const char *text, size_t size) {
  return send(fd, text, size, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)size;
}

bool srv_raw_discard(int fd) {
  char rest[16 << 10];
  ssize_t got = 0;
  for (int i = 0; i < 64; i++) { /* at most 1 MiB, so that other connections get their turn */
    got = recv(fd, rest, sizeof rest, MSG_DONTWAIT);
    if (got <= 0) break;
  }
  return got > 0 || (got < 0 && errno == EAGAIN);
}

srv_raw_state srv_raw_state_of(int fd) {
  struct pollfd state = {.fd = fd, .events = POLLRDHUP};
  if (poll(&state, 1, 0) <= 0) return SRV_RAW_OPEN;
  if ((state.revents & (POLLHUP | POLLERR)) != 0) return SRV_RAW_GONE;
  return (state.revents & POLLRDHUP) != 0 ? SRV_RAW_HALF : SRV_RAW_OPEN;
}

bool srv_raw_is_read_out(int fd) {
  char next;
  ssize_t got = recv(fd, &next, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
}

/* Whether the connection was reset: the kernel then still counts unsent bytes that it has discarded. */
static bool is_reset(int fd) {
  struct tcp_info info;
  socklen_t size = sizeof info;
  return getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 && info.tcpi_state == TCP_CLOSE;
}

size_t srv_raw_unsent(int fd) {
  int size = 0;
  if (is_reset(fd)) return 0;
  return ioctl(fd, SIOCOUTQ, &size) == 0 && size > 0 ? (size_t)size : 0;
}
