/* Addresses: parsing, listening, connecting and printing. */
#include "listen.h"

#include <arpa/inet.h>
#include <errno.h>
#include <libgen.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

enum { LISTEN_BACKLOG = 1024, HOST_SIZE = 256 };

static bool parse_unix(const char *path, srv_address *out, srv_error *error) {
  size_t size = strlen(path);
  if (size == 0 || size >= sizeof out->local.sun_path)
    return srv_fail(error, "the path of a unix socket has 1 to %zu characters",
                    sizeof out->local.sun_path - 1);
  out->local.sun_family = AF_UNIX;
  memcpy(out->local.sun_path, path, size + 1);
  out->size = sizeof out->local;
  return true;
}

static bool parse_port(const char *text, in_port_t *out) {
  size_t digits = strspn(text, "0123456789");
  if (digits == 0 || digits > 5 || text[digits] != '\0') return false;
  unsigned long port = strtoul(text, NULL, 10);
  if (port > 65535) return false;
  *out = htons((uint16_t)port);
  return true;
}

static bool parse_inet(const char *host, in_port_t port, srv_address *out) {
  out->v4.sin_family = AF_INET;
  out->v4.sin_port = port;
  out->size = sizeof out->v4;
  return inet_pton(AF_INET, host, &out->v4.sin_addr) == 1;
}

static bool parse_inet6(const char *host, in_port_t port, srv_address *out) {
  out->v6.sin6_family = AF_INET6;
  out->v6.sin6_port = port;
  out->size = sizeof out->v6;
  return inet_pton(AF_INET6, host, &out->v6.sin6_addr) == 1;
}

/* Resolves a host name, IPv4 first. Digits and dots are no name. */
static bool resolve(const char *host, in_port_t port, srv_address *out) {
  static const int families[] = {AF_INET, AF_INET6};
  if (host[strspn(host, "0123456789.")] == '\0' || strchr(host, ':')) return false;
  for (size_t i = 0; i < 2; i++) {
    const struct addrinfo wanted = {.ai_family = families[i], .ai_socktype = SOCK_STREAM};
    struct addrinfo *found = NULL;
    if (getaddrinfo(host, NULL, &wanted, &found) != 0) continue;
    memcpy(&out->any, found->ai_addr, found->ai_addrlen);
    out->size = found->ai_addrlen;
    freeaddrinfo(found);
    *(out->family == AF_INET ? &out->v4.sin_port : &out->v6.sin6_port) = port;
    return true;
  }
  return false;
}

bool srv_address_parse(const char *text, srv_address *out, srv_error *error) {
  srv_address address;
  memset(&address, 0, sizeof address);
  if (strncmp(text, "unix:", 5) == 0) {
    if (!parse_unix(text + 5, &address, error)) return false;
    *out = address;
    return true;
  }
  char host[HOST_SIZE];
  bool bracketed = text[0] == '[';
  const char *start = bracketed ? text + 1 : text;
  const char *colon = strrchr(text, ':');
  size_t size = colon ? (size_t)(colon - start) : 0;
  bool closed = !bracketed || (size > 0 && start[size - 1] == ']');
  if (bracketed && size > 0) size--;
  in_port_t port;
  bool parsed = colon && colon > start && closed && size < sizeof host && parse_port(colon + 1, &port);
  if (parsed) {
    memcpy(host, start, size);
    host[size] = '\0';
    parsed = bracketed ? parse_inet6(host, port, &address)
                       : parse_inet(host, port, &address) || resolve(host, port, &address);
  }
  if (!parsed)
    return srv_fail(error, "'%s' is not address:port, [address]:port, name:port or unix:PATH", text);
  *out = address;
  return true;
}

void srv_address_unlink(const srv_address *address) {
  if (address->family == AF_UNIX) unlink(address->local.sun_path);
}

/* Removes a socket file that refuses connections: its process is dead. */
static void remove_stale(const srv_address *address) {
  struct stat facts;
  if (stat(address->local.sun_path, &facts) != 0 || !S_ISSOCK(facts.st_mode)) return;
  int fd = srv_address_connect(address, 1000);
  if (fd < 0 && errno == ECONNREFUSED) unlink(address->local.sun_path);
  if (fd >= 0) close(fd);
}

/* Reports that listening failed, with the reason in errno. */
static bool fail_to_listen(const srv_address *address, srv_error *error) {
  int reason = errno;
  char place[sizeof address->local.sun_path + 8];
  srv_address_print(address, false, place, sizeof place);
  return srv_fail(error, "cannot listen on %s: %s", place, strerror(reason));
}

int srv_address_listen(const srv_address *address, srv_error *error) {
  if (address->family == AF_UNIX) remove_stale(address);
  int fd = socket(address->family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  int on = 1;
  bool listening = fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                   bind(fd, &address->any, address->size) == 0 && listen(fd, LISTEN_BACKLOG) == 0;
  if (listening) return fd;
  fail_to_listen(address, error);
  if (fd >= 0) close(fd);
  return -1;
}

/* Whether the file of a unix socket can be created, or already exists. */
static bool can_make_file(const srv_address *address) {
  char folder[sizeof address->local.sun_path];
  struct stat facts;
  if (stat(address->local.sun_path, &facts) == 0 && !S_ISSOCK(facts.st_mode)) {
    errno = EADDRINUSE;
    return false;
  }
  strcpy(folder, address->local.sun_path);
  return access(dirname(folder), W_OK | X_OK) == 0;
}

bool srv_address_check(const srv_address *address, bool *is_used, srv_error *error) {
  bool can_listen;
  *is_used = false;
  if (address->family == AF_UNIX) {
    can_listen = can_make_file(address);
  } else {
    int fd = socket(address->family, SOCK_STREAM | SOCK_CLOEXEC, 0), on = 1;
    can_listen = fd >= 0 && setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                 bind(fd, &address->any, address->size) == 0;
    *is_used = fd >= 0 && !can_listen && errno == EADDRINUSE;
    int reason = errno;
    if (fd >= 0) close(fd);
    errno = reason;
  }
  if (!can_listen && !*is_used) fail_to_listen(address, error);
  return can_listen || *is_used;
}

void srv_listeners_close(const srv_listeners *listeners) {
  for (size_t i = 0; i < listeners->count; i++) close(listeners->fds[i]);
}

bool srv_address_is_loopback(const srv_address *address) {
  if (address->family == AF_INET) return ntohl(address->v4.sin_addr.s_addr) >> 24 == 127;
  if (address->family != AF_INET6) return false;
  const struct in6_addr *host = &address->v6.sin6_addr;
  return IN6_IS_ADDR_LOOPBACK(host) || (IN6_IS_ADDR_V4MAPPED(host) && host->s6_addr[12] == 127);
}

/* Whether both are the same host and port. */
static bool is_same(const srv_address *a, const srv_address *b) {
  if (a->family != b->family) return false;
  if (a->family == AF_INET)
    return a->v4.sin_port == b->v4.sin_port && a->v4.sin_addr.s_addr == b->v4.sin_addr.s_addr;
  return a->family == AF_INET6 && a->v6.sin6_port == b->v6.sin6_port &&
         IN6_ARE_ADDR_EQUAL(&a->v6.sin6_addr, &b->v6.sin6_addr);
}

/* The kernel gives a connection to the listener that is bound to exactly its address, where there is one, and
 * to one of a wildcard address else. */
bool srv_listeners_are_loopback(const srv_listeners *listeners, int connection) {
  const srv_address own = srv_address_of(connection);
  if (!srv_address_is_loopback(&own)) return false;
  for (size_t i = 0; i < listeners->count; i++) {
    const srv_address bound = srv_address_of(listeners->fds[i]);
    if (is_same(&bound, &own)) return true;
  }
  return false;
}

static srv_address reachable(const srv_address *address) {
  srv_address target = *address;
  if (target.family == AF_INET && target.v4.sin_addr.s_addr == htonl(INADDR_ANY)) {
    target.v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  if (target.family == AF_INET6 && IN6_IS_ADDR_UNSPECIFIED(&target.v6.sin6_addr)) {
    target.v6.sin6_addr = in6addr_loopback;
  }
  return target;
}

int srv_address_connect(const srv_address *address, int timeout_ms) {
  srv_address target = reachable(address);
  int fd = socket(target.family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  struct timeval patience = {.tv_sec = timeout_ms / 1000, .tv_usec = timeout_ms % 1000 * 1000L};
  bool connected = setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
                   setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) == 0 &&
                   connect(fd, &target.any, target.size) == 0;
  if (connected) return fd;
  int reason = errno;
  close(fd);
  errno = reason;
  return -1;
}

void srv_address_peer(const srv_address *peer, char *out, size_t out_size) {
  char host[INET6_ADDRSTRLEN] = "";
  if (peer->family == AF_INET) {
    inet_ntop(AF_INET, &peer->v4.sin_addr, host, sizeof host);
    snprintf(out, out_size, "%s:%u", host, (unsigned)ntohs(peer->v4.sin_port));
  } else if (peer->family == AF_INET6) {
    inet_ntop(AF_INET6, &peer->v6.sin6_addr, host, sizeof host);
    snprintf(out, out_size, "[%s]:%u", host, (unsigned)ntohs(peer->v6.sin6_port));
  } else {
    snprintf(out, out_size, "unix");
  }
}

srv_address srv_address_of(int fd) {
  srv_address address = {.size = sizeof address.local};
  getsockname(fd, &address.any, &address.size);
  return address;
}

void srv_address_print(const srv_address *address, bool tls, char *out, size_t out_size) {
  if (address->family == AF_UNIX) {
    const char *path = address->local.sun_path;
    bool is_abstract = path[0] == '\0' && path[1] != '\0';
    int most =
        (int)sizeof address->local.sun_path - is_abstract; /* the kernel does not terminate abstract names */
    snprintf(out, out_size, "unix:%s%.*s", is_abstract ? "@" : "", most, path + is_abstract);
    return;
  }
  char place[INET6_ADDRSTRLEN + 16];
  srv_address_peer(address, place, sizeof place);
  snprintf(out, out_size, "%s://%s", tls ? "https" : "http", place);
}
