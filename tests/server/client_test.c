#include "client.h"

#include <stdio.h>
#include <string.h>

#include "peers.h"
#include "test.h"

static srv_error error;

static srv_client client_of(const char *host) {
  char text[64];
  srv_address address;
  snprintf(text, sizeof text, strchr(host, ':') != NULL ? "[%s]:1" : "%s:1", host);
  if (!srv_address_parse(text, &address, &error)) fail_msg("%s", error.text);
  return srv_client_of(&address);
}

TEST(what_is_no_network_is_named) {
  static const char *const BAD[] = {"10.0.0.0/33", "::/129", "10.0.0.0/", "10.0.0.0/x",
                                    "10.0.0",      "host",   "unix/8"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    srv_networks networks;
    char list[64];
    snprintf(list, sizeof list, "127.0.0.1, %s", BAD[i]);
    if (srv_networks_read(list, &networks, &error)) fail_msg("%s is taken", BAD[i]);
    assert_non_null(strstr(error.text, BAD[i]));
  }
}

static void assert_holds(const char *list, const char *host, bool expected) {
  srv_networks networks;
  assert_true(srv_networks_read(list, &networks, &error));
  srv_client client = {{0}};
  if (strcmp(host, "unix") != 0) client = client_of(host);
  if (srv_networks_hold(&networks, &client) != expected) fail_msg("%s of %s", host, list);
  srv_networks_deinit(&networks);
}

TEST(networks_hold_their_addresses) {
  assert_holds("10.0.0.0/8,fd00::/8", "10.200.3.4", true);
  assert_holds("10.0.0.0/8,fd00::/8", "11.0.0.0", false);
  assert_holds("10.0.0.0/8,fd00::/8", "fd12::1", true);
  assert_holds("192.168.4.0/22", "192.168.7.255", true);
  assert_holds("192.168.4.0/22", "192.168.8.0", false);
  assert_holds("192.168.4.1", "192.168.4.2", false);
  assert_holds("0.0.0.0/0", "1.2.3.4", true);
  assert_holds("0.0.0.0/0", "2001:db8::1", false);
  assert_holds("unix", "unix", true);
  assert_holds("10.0.0.0/8", "unix", false);
  assert_holds("", "127.0.0.1", false);
}

static void assert_client(const char *peer, const char *const *values, size_t count, const char *expected) {
  srv_networks trusted;
  char text[SRV_CLIENT_TEXT];
  assert_true(srv_networks_read("127.0.0.1,10.0.0.0/8", &trusted, &error));
  srv_client client = srv_client_forwarded(&trusted, client_of(peer), values, count);
  srv_client_print(&client, text);
  assert_string_equal(text, expected);
  srv_networks_deinit(&trusted);
}

TEST(only_trusted_proxies_tell_the_client) {
  static const char *const chain[] = {"1.1.1.1, 203.0.113.9 ,10.1.2.3"};
  static const char *const lines[] = {"1.1.1.1", "203.0.113.9:4711", "10.1.2.3"};
  static const char *const v6[] = {"[2001:db8::7]:80"};
  static const char *const bare[] = {"2001:db8::7"};
  static const char *const broken[] = {"1.1.1.1, unknown, 10.1.2.3"};
  static const char *const inside[] = {"10.9.9.9"};
  static const char *const empty[] = {""};
  assert_client("127.0.0.1", chain, 1, "203.0.113.9");
  assert_client("127.0.0.1", lines, 3, "203.0.113.9");
  assert_client("192.0.2.1", chain, 1, "192.0.2.1"); /* says so himself */
  assert_client("127.0.0.1", v6, 1, "2001:db8::7");
  assert_client("127.0.0.1", bare, 1, "2001:db8::7");
  assert_client("127.0.0.1", broken, 1, "10.1.2.3");
  assert_client("127.0.0.1", inside, 1, "10.9.9.9");
  assert_client("127.0.0.1", empty, 1, "127.0.0.1");
  assert_client("127.0.0.1", NULL, 0, "127.0.0.1");
}

TEST(addresses_of_one_host_count_together) {
  srv_client a = client_of("2001:db8:1:2::1"), b = client_of("2001:db8:1:2:3::1"),
             c = client_of("2001:db8:1:3::1");
  srv_client d = client_of("192.0.2.1"), e = client_of("192.0.2.2");
  a = srv_client_group(&a), b = srv_client_group(&b), c = srv_client_group(&c);
  d = srv_client_group(&d), e = srv_client_group(&e);
  assert_memory_equal(&a, &b, sizeof a);
  assert_memory_not_equal(&a, &c, sizeof a);
  assert_memory_not_equal(&d, &e, sizeof d);
}

TEST(an_address_has_so_many_connections_and_no_more) {
  srv_peers *peers = srv_peers_create(2);
  srv_client a = client_of("192.0.2.1"), b = client_of("192.0.2.2");
  assert_true(srv_peers_enter(peers, &a));
  assert_true(srv_peers_enter(peers, &a));
  assert_false(srv_peers_enter(peers, &a));
  assert_true(srv_peers_enter(peers, &b));
  srv_peers_leave(peers, &a);
  assert_true(srv_peers_enter(peers, &a));
  assert_false(srv_peers_enter(peers, &a));
  srv_peers_destroy(peers);
}
