/* What a supervisor hands over and is told, in systemd's protocols: sockets (sd_listen_fds(3)), states
 * (sd_notify(3)) and a watchdog (sd_watchdog_enabled(3)). Spoken here without libsystemd: the manual calls
 * them stable for that, and they are a few variables and datagrams, where the library brings four others into
 * every image. */
#ifndef SRV_SYSTEMD_H
#define SRV_SYSTEMD_H

#include "listen.h"

#include <stdint.h>

/* A value that owns nothing: the sockets are for whoever serves on them. */
typedef struct srv_systemd {
  srv_listeners sockets, admin_sockets; /* passed; admin: of that name */
  uint64_t watchdog_ms;                 /* 0: none */
  bool is_notified;                     /* at the address that follows */
  srv_address notified;
} srv_systemd;

/* Reads what is meant for this process; environment answers as getenv does. False with one line in error. */
bool srv_systemd_read(srv_systemd *out, char *(*environment)(const char *name), srv_error *error);

/* Tells a state: lines NAME=VALUE, "READY=1". Does nothing where nobody asked for it. */
void srv_systemd_notify(const srv_systemd *systemd, const char *state);

#endif
