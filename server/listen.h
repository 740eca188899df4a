/* The address that the daemon serves on and its health check asks. */
#ifndef SRV_LISTEN_H
#define SRV_LISTEN_H

#include "fail.h"

#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>
#include <sys/socket.h>
#include <sys/un.h>

typedef struct srv_address {
  union {
    sa_family_t family;
    struct sockaddr any;
    struct sockaddr_in v4;
    struct sockaddr_in6 v6;
    struct sockaddr_un local;
  };
  socklen_t size;
} srv_address;

/* "127.0.0.1:8080", "[::1]:8080", "localhost:8080", "unix:PATH". False with one line in error. */
bool srv_address_parse(const char *text, srv_address *out, srv_error *error);

/* A non-blocking listening socket, -1 with one line in error. Refuses a place where another process
 * listens; a unix socket that a dead process left is replaced. */
int srv_address_listen(const srv_address *address, srv_error *error);

/* Whether it could be listened on, without doing so. *is_used: somebody does, perhaps the daemon itself.
 * False with one line in error. */
bool srv_address_check(const srv_address *address, bool *is_used, srv_error *error);

/* A blocking connected socket, -1 with errno. Wildcard addresses are asked over loopback. */
int srv_address_connect(const srv_address *address, int timeout_ms);

/* The address that a socket is bound to: with the port that the kernel gave in place of 0. */
srv_address srv_address_of(int fd);

enum { SRV_LISTENERS_MAX = 16 };

/* Listening, non-blocking sockets. */
typedef struct srv_listeners {
  int fds[SRV_LISTENERS_MAX];
  size_t count;
  bool is_passed; /* by a supervisor that keeps them for the next process: no connection is taken any more
                     while this one drains */
} srv_listeners;

void srv_listeners_close(const srv_listeners *listeners);

/* As the ready line names it: "http://127.0.0.1:8080", "unix:PATH", with @ for an abstract name. */
void srv_address_print(const srv_address *address, bool tls, char *out, size_t out_size);

/* The host and port of a client, "unix" for a local one. */
void srv_address_peer(const srv_address *peer, char *out, size_t out_size);

/* Removes the file of a unix socket. */
void srv_address_unlink(const srv_address *address);

#endif
