/* What of the supervisor's variables is taken; tests/systemd has the sockets. */
#include "systemd.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/un.h>
#include <unistd.h>

#include "test.h"

/* Pairs of name and value, the last name NULL. */
static const char *const *variables;

static char *find(const char *name) {
  for (const char *const *at = variables; *at != NULL; at += 2)
    if (strcmp(*at, name) == 0) return (char *)(uintptr_t)at[1];
  return NULL;
}

static bool read_from(const char *const *environment, srv_systemd *out, srv_error *error) {
  variables = environment;
  error->text[0] = '\0';
  return srv_systemd_read(out, find, error);
}

static void assert_refused(const char *name, const char *value) {
  char pid[32];
  srv_error error;
  srv_systemd systemd;
  snprintf(pid, sizeof pid, "%d", (int)getpid());
  assert_false(read_from((const char *const[]){name, value, "LISTEN_PID", pid, NULL}, &systemd, &error));
  assert_memory_equal(error.text, name, strlen(name));
}

TEST(malformed_variables_are_refused_by_name) {
  static const char *const NUMBERS[] = {"", "x", "-1", "1x", " 1", "17", "99999999999999999999999"};
  for (size_t i = 0; i < sizeof NUMBERS / sizeof *NUMBERS; i++) assert_refused("LISTEN_FDS", NUMBERS[i]);
  static const char *const TIMES[] = {"", "0", "999", "1s", "99999999999999999999999"};
  for (size_t i = 0; i < sizeof TIMES / sizeof *TIMES; i++) assert_refused("WATCHDOG_USEC", TIMES[i]);
  char path[sizeof((struct sockaddr_un *)NULL)->sun_path + 1];
  memset(path, 'a', sizeof path - 1);
  path[sizeof path - 1] = '\0';
  path[0] = '/';
  static const char *const PLACES[] = {"", "/", "@", "here", "vsock:2:1"};
  for (size_t i = 0; i < sizeof PLACES / sizeof *PLACES; i++) assert_refused("NOTIFY_SOCKET", PLACES[i]);
  assert_refused("NOTIFY_SOCKET", path);
}

TEST(what_is_for_another_process_is_left_aside) {
  srv_error error;
  srv_systemd systemd;
  static const char *const OTHERS[] = {"LISTEN_FDS",   "1", "LISTEN_PID", "1", "WATCHDOG_USEC", "1000000",
                                       "WATCHDOG_PID", "1", NULL};
  assert_true(read_from(OTHERS, &systemd, &error));
  assert_int_equal(systemd.sockets.count + systemd.admin_sockets.count, 0);
  assert_int_equal(systemd.watchdog_ms, 0);
  assert_false(systemd.is_notified);
  static const char *const NOBODYS[] = {"LISTEN_FDS", "1", "WATCHDOG_USEC", "1500000", NULL};
  assert_true(read_from(NOBODYS, &systemd, &error));
  assert_int_equal(systemd.sockets.count, 0);
  assert_int_equal(systemd.watchdog_ms, 1500);
}

TEST(states_are_told_at_an_abstract_address) {
  char name[64], told[64] = "";
  srv_error error;
  srv_systemd systemd;
  snprintf(name, sizeof name, "@tweend-systemd-test-%d", (int)getpid());
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  memcpy(address.sun_path + 1, name + 1, strlen(name + 1));
  int fd = socket(AF_UNIX, SOCK_DGRAM, 0);
  socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(name));
  assert_int_equal(bind(fd, (const struct sockaddr *)&address, size), 0);
  assert_true(read_from((const char *const[]){"NOTIFY_SOCKET", name, NULL}, &systemd, &error));
  srv_systemd_notify(&systemd, "READY=1");
  assert_int_equal(recv(fd, told, sizeof told - 1, MSG_DONTWAIT), 7);
  assert_string_equal(told, "READY=1");
  close(fd);
}
