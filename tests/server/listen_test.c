#include "listen.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

static srv_error error;

static srv_address parsed(const char *text) {
  srv_address address;
  if (!srv_address_parse(text, &address, &error)) fail_msg("%s", error.text);
  return address;
}

TEST(malformed_addresses_are_refused) {
  static const char *const BAD[] = {"",
                                    "8080",
                                    ":8080",
                                    "127.0.0.1",
                                    "127.0.0.1:",
                                    "127.0.0.1:x",
                                    "127.0.0.1:65536",
                                    "127.0.0.1:-1",
                                    "127.0.0.1:123456",
                                    "no_such.invalid:80",
                                    "[::1]",
                                    "[::1]80",
                                    "[::1:80",
                                    "::1:80",
                                    "[]:80",
                                    "[127.0.0.1]:80",
                                    "unix:",
                                    "256.0.0.1:80"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    srv_address address;
    if (srv_address_parse(BAD[i], &address, &error)) fail_msg("'%s' was taken", BAD[i]);
  }
  char path[200] = "unix:/";
  memset(path + 6, 'a', sizeof path - 7);
  path[sizeof path - 1] = '\0';
  srv_address address;
  assert_false(srv_address_parse(path, &address, &error));
}

static void assert_prints(const char *text, bool tls, const char *expected) {
  srv_address address = parsed(text);
  char out[256];
  srv_address_print(&address, tls, out, sizeof out);
  assert_string_equal(out, expected);
}

TEST(addresses_print_as_urls) {
  assert_prints("127.0.0.1:8080", false, "http://127.0.0.1:8080");
  assert_prints("localhost:8080", false, "http://127.0.0.1:8080");
  assert_prints("0.0.0.0:80", true, "https://0.0.0.0:80");
  assert_prints("[::]:8080", false, "http://[::]:8080");
  assert_prints("unix:/run/tweend", false, "unix:/run/tweend");
}

TEST(port_0_becomes_a_real_one) {
  srv_address address = parsed("127.0.0.1:0");
  int fd = srv_address_listen(&address, &error);
  assert_true(fd >= 0);
  char out[256];
  const srv_address bound = srv_address_of(fd);
  srv_address_print(&bound, false, out, sizeof out);
  assert_memory_equal(out, "http://127.0.0.1:", 17);
  assert_true(out[17] >= '1' && out[17] <= '9');

  srv_address same = parsed(out + strlen("http://"));
  int second = srv_address_listen(&same, &error);
  assert_int_equal(second, -1);
  assert_non_null(strstr(error.text, out + strlen("http://")));
  close(fd);
}

TEST(wildcard_is_asked_over_loopback) {
  srv_address address = parsed("0.0.0.0:0");
  int fd = srv_address_listen(&address, &error);
  socklen_t size = sizeof address.v4;
  assert_int_equal(getsockname(fd, &address.any, &size), 0);
  int client = srv_address_connect(&address, 1000);
  assert_true(client >= 0);
  close(client);
  close(fd);
}

TEST(left_socket_file_is_replaced_and_a_living_one_is_not) {
  char path[] = "/tmp/tweend-listen-XXXXXX", text[64];
  close(mkstemp(path));
  unlink(path);
  snprintf(text, sizeof text, "unix:%s", path);
  srv_address address = parsed(text);
  int dead = srv_address_listen(&address, &error);
  assert_true(dead >= 0);
  assert_int_equal(srv_address_listen(&address, &error), -1);
  close(dead);
  int fd = srv_address_listen(&address, &error);
  assert_true(fd >= 0);
  close(fd);
  srv_address_unlink(&address);
  assert_int_equal(access(path, F_OK), -1);
}

TEST(plain_file_is_not_taken_for_a_left_socket) {
  char path[] = "/tmp/tweend-listen-XXXXXX", text[64];
  close(mkstemp(path));
  snprintf(text, sizeof text, "unix:%s", path);
  srv_address address = parsed(text);
  assert_int_equal(srv_address_listen(&address, &error), -1);
  assert_int_equal(access(path, F_OK), 0);
  unlink(path);
}

TEST(loopback_addresses_are_told) {
  static const struct {
    const char *text;
    bool is_loopback;
  } cases[] = {{"127.0.0.1:80", true},  {"127.255.0.9:80", true},
               {"[::1]:80", true},      {"[::ffff:127.0.0.1]:80", true},
               {"0.0.0.0:80", false},   {"[::]:80", false},
               {"192.0.2.1:80", false}, {"[::ffff:192.0.2.1]:80", false},
               {"unix:/tmp/x", false},  {"128.0.0.1:80", false},
               {"[fe80::1]:80", false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    srv_address address = parsed(cases[i].text);
    assert_int_equal(srv_address_is_loopback(&address), cases[i].is_loopback);
  }
}

/* Whether a connection to `target`, at the port of a listener bound to `bound`, counts as local. `beside`: a
 * further listener at the same port, or NULL. */
static bool is_local(const char *bound, const char *beside, const char *target) {
  srv_address address = parsed(bound), to = parsed(target);
  srv_listeners listeners = {.count = 0};
  listeners.fds[listeners.count++] = srv_address_listen(&address, &error);
  assert_true(listeners.fds[0] >= 0);
  address = srv_address_of(listeners.fds[0]);
  to.v4.sin_port = address.v4.sin_port;
  if (beside != NULL) {
    srv_address other = parsed(beside);
    other.v4.sin_port = address.v4.sin_port;
    listeners.fds[listeners.count++] = srv_address_listen(&other, &error);
  }
  int client = srv_address_connect(&to, 1000), served = -1;
  assert_true(client >= 0);
  for (size_t i = 0; i < listeners.count && served < 0; i++) served = accept(listeners.fds[i], NULL, NULL);
  assert_true(served >= 0);
  bool local = srv_listeners_are_loopback(&listeners, served);
  close(client);
  close(served);
  srv_listeners_close(&listeners);
  return local;
}

TEST(what_a_listener_is_bound_to_makes_a_connection_local_not_where_it_comes_from) {
  assert_true(is_local("127.0.0.1:0", NULL, "127.0.0.1:1"));
  assert_false(is_local("0.0.0.0:0", NULL, "127.0.0.1:1"));
  assert_true(is_local("127.0.0.1:0", "127.0.0.2:0", "127.0.0.2:1"));
}
