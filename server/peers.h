/* How many connections each address has open. */
#ifndef SRV_PEERS_H
#define SRV_PEERS_H

#include "client.h"

typedef struct srv_peers srv_peers;
/* most: connections of one address, 0: no limit. NULL without memory. */
srv_peers *srv_peers_create(uint64_t most);
void srv_peers_destroy(srv_peers *peers);

/* Counts a connection; false when its address has as many as it may. group: of srv_client_group. Any
 * thread. */
bool srv_peers_enter(srv_peers *peers, const srv_client *group);
void srv_peers_leave(srv_peers *peers, const srv_client *group); /* one that srv_peers_enter counted */

#endif
