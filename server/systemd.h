/* The systemd protocols between a supervisor and the daemon: passed sockets (sd_listen_fds(3)), state
 * notifications (sd_notify(3)) and the watchdog (sd_watchdog_enabled(3)). Implemented here without
 * libsystemd: its manual declares the protocols stable for that, they are a few variables and datagrams, and
 * the library would bring four others into every image. */
#ifndef SRV_SYSTEMD_H
#define SRV_SYSTEMD_H

#include "listen.h"

#include <stdint.h>

/* A value that owns nothing: the sockets belong to the caller that serves on them. */
typedef struct srv_systemd {
  srv_listeners sockets, admin_sockets; /* passed sockets; admin_sockets: those named "admin" */
  uint64_t watchdog_ms;                 /* 0: none */
  bool is_notified;                     /* notifications go to `notified` */
  srv_address notified;
} srv_systemd;

/* Reads the variables that are meant for this process. environment: like getenv. False with one line in
 * error. */
bool srv_systemd_read(srv_systemd *out, char *(*environment)(const char *name), srv_error *error);

/* Sends a state: lines NAME=VALUE, as in "READY=1". Does nothing without NOTIFY_SOCKET. */
void srv_systemd_notify(const srv_systemd *systemd, const char *state);

#endif
