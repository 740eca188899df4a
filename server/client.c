#include "client.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct srv_network {
  uint8_t address[16];
  unsigned bits;
};

enum { BITS = 128, BITS_OF_V4 = 96 /* of the prefix before an IPv4 address */ };

static const uint8_t v4_prefix[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

static bool is_v4(const srv_client *client) {
  return memcmp(client->address, v4_prefix, sizeof v4_prefix) == 0;
}

srv_client srv_client_of(const srv_address *peer) {
  srv_client client = {{0}};
  if (peer->family == AF_INET) {
    memcpy(client.address, v4_prefix, sizeof v4_prefix);
    memcpy(client.address + sizeof v4_prefix, &peer->v4.sin_addr, 4);
  } else if (peer->family == AF_INET6) {
    memcpy(client.address, &peer->v6.sin6_addr, sizeof client.address);
  }
  return client;
}

srv_client srv_client_group(const srv_client *client) {
  srv_client group = *client;
  if (!is_v4(client)) memset(group.address + 8, 0, 8);
  return group;
}

void srv_client_print(const srv_client *client, char out[SRV_CLIENT_TEXT]) {
  bool short_form = is_v4(client);
  inet_ntop(short_form ? AF_INET : AF_INET6, client->address + (short_form ? sizeof v4_prefix : 0), out,
            SRV_CLIENT_TEXT);
}

/* Reads text[0..size), an IPv4 or IPv6 address. */
static bool read_address(const char *text, size_t size, srv_client *out) {
  char copy[SRV_CLIENT_TEXT];
  srv_address address = {0};
  if (size >= sizeof copy) return false;
  memcpy(copy, text, size);
  copy[size] = '\0';
  if (inet_pton(AF_INET, copy, &address.v4.sin_addr) == 1) {
    address.family = AF_INET;
  } else if (inet_pton(AF_INET6, copy, &address.v6.sin6_addr) == 1) {
    address.family = AF_INET6;
  } else {
    return false;
  }
  *out = srv_client_of(&address);
  return true;
}

/* ---- networks -------------------------------------------------------------------------------- */

static bool read_network(const char *text, struct srv_network *out) {
  srv_client first = {{0}};
  size_t size = strcspn(text, "/");
  *out = (struct srv_network){.bits = BITS};
  if (strcmp(text, "unix") == 0) return true;
  if (!read_address(text, size, &first)) return false;
  memcpy(out->address, first.address, sizeof out->address);
  if (text[size] == '\0') return true;
  const char *digits = text + size + 1;
  size_t length = strspn(digits, "0123456789");
  if (length == 0 || length > 3 || digits[length] != '\0') return false;
  out->bits = (unsigned)strtoul(digits, NULL, 10) + (is_v4(&first) ? BITS_OF_V4 : 0);
  return out->bits <= BITS;
}

bool srv_networks_read(const char *text, srv_networks *out, srv_error *error) {
  size_t size = strlen(text);
  char *copy = strdup(text), *rest = NULL;
  *out = (srv_networks){.list = calloc(size / 2 + 1, sizeof *out->list)};
  bool is_read = copy && out->list;
  if (!is_read) srv_fail(error, "out of memory");
  for (char *word = is_read ? strtok_r(copy, ", \t", &rest) : NULL; word && is_read;
       word = strtok_r(NULL, ", \t", &rest)) {
    is_read = read_network(word, &out->list[out->count++]);
    if (!is_read) srv_fail(error, "--trusted-proxies: '%s' is not ADDRESS, ADDRESS/BITS or unix", word);
  }
  free(copy);
  if (!is_read) srv_networks_deinit(out);
  return is_read;
}

void srv_networks_deinit(srv_networks *networks) {
  free(networks->list);
  *networks = (srv_networks){0};
}

static bool holds(const struct srv_network *network, const srv_client *client) {
  size_t whole = network->bits / 8;
  unsigned rest = network->bits % 8;
  if (memcmp(network->address, client->address, whole) != 0) return false;
  return rest == 0 || (network->address[whole] ^ client->address[whole]) >> (8 - rest) == 0;
}

bool srv_networks_hold(const srv_networks *networks, const srv_client *client) {
  for (size_t i = 0; i < networks->count; i++)
    if (holds(&networks->list[i], client)) return true;
  return false;
}

/* ---- X-Forwarded-For ------------------------------------------------------------------------- */

/* Reads one entry of the list, an address perhaps with a port: 192.0.2.1, 192.0.2.1:80, 2001:db8::1,
 * [2001:db8::1]:80. */
static bool read_entry(const char *text, size_t size, srv_client *out) {
  while (size > 0 && strchr(" \t", text[0])) text++, size--;
  while (size > 0 && strchr(" \t", text[size - 1])) size--;
  if (size > 0 && text[0] == '[') {
    const char *end = memchr(text, ']', size);
    return end && read_address(text + 1, (size_t)(end - text) - 1, out);
  }
  const char *colon = memchr(text, ':', size);
  bool has_port = colon && !memchr(colon + 1, ':', size - (size_t)(colon + 1 - text));
  return read_address(text, has_port ? (size_t)(colon - text) : size, out);
}

srv_client srv_client_forwarded(const srv_networks *trusted, srv_client peer, const char *const *values,
                                size_t count) {
  srv_client client = peer;
  for (size_t i = count; i-- > 0;) {
    const char *start = values[i], *end = start + strlen(start);
    for (;;) {
      const char *from = end;
      while (from > start && from[-1] != ',') from--;
      if (!srv_networks_hold(trusted, &client) || !read_entry(from, (size_t)(end - from), &client))
        return client;
      if (from == start) break;
      end = from - 1;
    }
  }
  return client;
}
