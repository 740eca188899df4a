/* Socket addresses: where the daemon listens, and what its health check connects to. */
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

/* A non-blocking listening socket, -1 with one line in error. Fails where another process listens; replaces
 * the file of a unix socket that a dead process has left. */
int srv_address_listen(const srv_address *address, srv_error *error);

/* Whether srv_address_listen could succeed, without listening. *is_used: a process listens there, perhaps the
 * daemon itself; the result is true then. False with one line in error. */
bool srv_address_check(const srv_address *address, bool *is_used, srv_error *error);

/* A blocking connected socket, -1 with errno. Wildcard addresses are reached over loopback. */
int srv_address_connect(const srv_address *address, int timeout_ms);

/* The address that a socket is bound to, with the port that the kernel chose for port 0. */
srv_address srv_address_of(int fd);

/* Whether only this machine can reach the address: 127.0.0.0/8 or ::1. Not for unix sockets. */
bool srv_address_is_loopback(const srv_address *address);

enum { SRV_LISTENERS_MAX = 16 };

/* Listening, non-blocking sockets. */
typedef struct srv_listeners {
  int fds[SRV_LISTENERS_MAX];
  size_t count;
  bool is_passed; /* by a supervisor that keeps the sockets for the next process: while this one drains, it
                     accepts no connection */
} srv_listeners;

void srv_listeners_close(const srv_listeners *listeners);

/* Whether the connection came in through a listener that is bound to a loopback address. */
bool srv_listeners_are_loopback(const srv_listeners *listeners, int connection);

/* Prints the address as in the ready line: "http://127.0.0.1:8080", "unix:PATH", with @ for an abstract
 * name. */
void srv_address_print(const srv_address *address, bool tls, char *out, size_t out_size);

/* Prints a client's host and port, "unix" for a local one. */
void srv_address_peer(const srv_address *peer, char *out, size_t out_size);

/* Removes the file of a unix socket. */
void srv_address_unlink(const srv_address *address);

#endif
