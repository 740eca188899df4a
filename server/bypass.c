/* Plain calls on a socket that never block. */
#include "bypass.h"

#include <errno.h>
#include <poll.h>
#include <sys/socket.h>

bool srv_bypass_say(int fd, const char *text, size_t size) {
  return send(fd, text, size, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)size;
}

bool srv_bypass_discard(int fd) {
  char rest[16 << 10];
  ssize_t got = 0;
  for (int i = 0; i < 64; i++) {
    got = recv(fd, rest, sizeof rest, MSG_DONTWAIT);
    if (got <= 0) break;
  }
  return got > 0 || (got < 0 && errno == EAGAIN);
}

bool srv_bypass_waits(int fd) {
  struct pollfd state = {.fd = fd, .events = POLLRDHUP};
  return poll(&state, 1, 0) <= 0 || (state.revents & (POLLRDHUP | POLLHUP | POLLERR)) == 0;
}
