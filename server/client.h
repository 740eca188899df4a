/* The address of a client: the peer, or the address that trusted proxies report (--trusted-proxies). */
#ifndef SRV_CLIENT_H
#define SRV_CLIENT_H

#include "listen.h"

#include <stdint.h>

/* An IPv6 address, IPv4 as ::ffff:a.b.c.d. Zeroed: a local peer, which has no address. */
typedef struct srv_client {
  uint8_t address[16];
} srv_client;

srv_client srv_client_of(const srv_address *peer);

/* The address that per-address limits count by: an IPv4 address, or the /64 of an IPv6 address, since one
 * host may have a whole /64. */
srv_client srv_client_group(const srv_client *client);

enum { SRV_CLIENT_TEXT = 46 };
void srv_client_print(const srv_client *client, char out[SRV_CLIENT_TEXT]);

/* A list of networks. A value; a zeroed one may be deinited. */
typedef struct srv_networks {
  struct srv_network *list;
  size_t count;
} srv_networks;

/* text: ADDRESS, ADDRESS/BITS or "unix" (local sockets), separated by commas or blanks. False with one line
 * in error. */
bool srv_networks_read(const char *text, srv_networks *out, srv_error *error);
void srv_networks_deinit(srv_networks *networks);
bool srv_networks_hold(const srv_networks *networks, const srv_client *client);

/* The client behind trusted proxies. values: [count] fields of X-Forwarded-For, in the order of the request.
 * Reads the addresses from the last to the first, as long as the one before, beginning with the peer, is
 * trusted; the first that is not trusted is the client. A malformed entry ends the search too. */
srv_client srv_client_forwarded(const srv_networks *trusted, srv_client peer, const char *const *values,
                                size_t count);

#endif
