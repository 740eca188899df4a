/* Passed sockets are the descriptors from 3 on. Ignores variables that are meant for another process, as
 * inherited through a shell. */
#include "systemd.h"

#include "log.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FIRST_PASSED = 3 };

static bool read_number(const char *text, uint64_t most, uint64_t *out) {
  size_t digits = strspn(text, "0123456789");
  if (digits == 0 || digits > 18 || text[digits] != '\0') return false;
  *out = strtoull(text, NULL, 10);
  return *out <= most;
}

/* The value of a variable that is meant for this process, else NULL. pid_name: the variable that holds the
 * process id. */
static const char *find_own(char *(*environment)(const char *name), const char *name, const char *pid_name) {
  const char *value = environment(name), *pid = environment(pid_name);
  uint64_t number;
  bool is_own = pid && read_number(pid, UINT64_MAX, &number) && number == (uint64_t)getpid();
  return is_own ? value : NULL;
}

/* ---- sockets --------------------------------------------------------------------------------- */

static bool is_listening(int fd) {
  int accepts = 0, type = 0, family = 0;
  socklen_t size = sizeof accepts;
  return getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &accepts, &size) == 0 && accepts != 0 &&
         getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM &&
         getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &family, &size) == 0 &&
         (family == AF_INET || family == AF_INET6 || family == AF_UNIX);
}

/* Whether the first name in the list is `name`; removes it from the list. */
static bool is_called(const char **names, const char *name) {
  size_t size = strcspn(*names, ":");
  bool is_same = size == strlen(name) && memcmp(*names, name, size) == 0;
  *names += size + ((*names)[size] == ':');
  return is_same;
}

static bool read_sockets(srv_systemd *out, char *(*environment)(const char *name), srv_error *error) {
  const char *value = find_own(environment, "LISTEN_FDS", "LISTEN_PID"),
             *names = environment("LISTEN_FDNAMES");
  uint64_t count = 0;
  if (!value) return true;
  if (!read_number(value, SRV_LISTENERS_MAX, &count))
    return srv_fail(error, "LISTEN_FDS: '%s' is not a number of sockets up to 16", value);
  if (!names) names = "";
  for (int fd = FIRST_PASSED; fd < FIRST_PASSED + (int)count; fd++) {
    if (!is_listening(fd))
      return srv_fail(
          error,
          "LISTEN_FDS: descriptor %d is not a listening stream socket; a socket unit needs ListenStream= "
          "and Accept=no",
          fd);
    fcntl(fd, F_SETFD, FD_CLOEXEC);
    fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
    srv_listeners *listeners = is_called(&names, "admin") ? &out->admin_sockets : &out->sockets;
    listeners->fds[listeners->count++] = fd;
    listeners->is_passed = true;
  }
  return true;
}

/* ---- states ---------------------------------------------------------------------------------- */

/* Reads the address of NOTIFY_SOCKET: a path, or @ and an abstract name. */
static bool read_notified(srv_systemd *out, const char *value, srv_error *error) {
  size_t size = strlen(value);
  if ((value[0] != '/' && value[0] != '@') || size < 2 || size >= sizeof out->notified.local.sun_path)
    return srv_fail(error, "NOTIFY_SOCKET: '%s' is not the path of a unix socket", value);
  out->notified.local.sun_family = AF_UNIX;
  memcpy(out->notified.local.sun_path, value, size);
  if (value[0] == '@') out->notified.local.sun_path[0] = '\0';
  out->notified.size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + size);
  out->is_notified = true;
  return true;
}

static bool read_watchdog(srv_systemd *out, char *(*environment)(const char *name), srv_error *error) {
  const char *value = !environment("WATCHDOG_PID") ? environment("WATCHDOG_USEC")
                                                   : find_own(environment, "WATCHDOG_USEC", "WATCHDOG_PID");
  uint64_t us = 0;
  if (!value) return true;
  if (!read_number(value, UINT64_MAX, &us) || us < 1000)
    return srv_fail(error, "WATCHDOG_USEC: '%s' is not a number of microseconds from 1000 on", value);
  out->watchdog_ms = us / 1000;
  return true;
}

bool srv_systemd_read(srv_systemd *out, char *(*environment)(const char *name), srv_error *error) {
  const char *notified = environment("NOTIFY_SOCKET");
  *out = (srv_systemd){.is_notified = false};
  return read_sockets(out, environment, error) && read_watchdog(out, environment, error) &&
         (!notified || read_notified(out, notified, error));
}

void srv_systemd_notify(const srv_systemd *systemd, const char *state) {
  if (!systemd->is_notified) return;
  int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  bool is_told = fd >= 0 && sendto(fd, state, strlen(state), MSG_NOSIGNAL, &systemd->notified.any,
                                   systemd->notified.size) == (ssize_t)strlen(state);
  if (!is_told) srv_log(SRV_LOG_WARN, "cannot tell the supervisor at NOTIFY_SOCKET: %s", strerror(errno));
  if (fd >= 0) close(fd);
}
