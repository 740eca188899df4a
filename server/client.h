/* Who asks: the address of a client, also behind proxies that are trusted to tell it (--trusted-proxies). */
#ifndef SRV_CLIENT_H
#define SRV_CLIENT_H

#include "listen.h"

#include <stdint.h>

/* An address in the form of IPv6, IPv4 as ::ffff:a.b.c.d; zeroed: a local one, without an address. */
typedef struct srv_client {
  uint8_t address[16];
} srv_client;

srv_client srv_client_of(const srv_address *peer);

/* What limits by address count together: an IPv4 address, or a /64 of IPv6, which one host may have whole. */
srv_client srv_client_group(const srv_client *client);

enum { SRV_CLIENT_TEXT = 46 };
void srv_client_print(const srv_client *client, char out[SRV_CLIENT_TEXT]);

/* Networks, a value. */
typedef struct srv_networks {
  struct srv_network *list;
  size_t count;
} srv_networks;

/* text: comma-separated addresses, ADDRESS/BITS, or "unix" for local sockets. False with one line in error.
 */
bool srv_networks_read(const char *text, srv_networks *out, srv_error *error);
void srv_networks_deinit(srv_networks *networks);
bool srv_networks_hold(const srv_networks *networks, const srv_client *client);

/* Goes from the peer back along [count] values of X-Forwarded-For, in the order in which they came, as long
 * as those who tell are trusted; the first who is not is the client. */
srv_client srv_client_forwarded(const srv_networks *trusted, srv_client peer, const char *const *values,
                                size_t count);

#endif
