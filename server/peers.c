#include "peers.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { CHAINS = 4096 };

typedef struct peer {
  struct peer *next;
  srv_client group;
  uint64_t connections;
} peer;

struct srv_peers {
  pthread_mutex_t lock;
  uint64_t most;
  peer *chains[CHAINS]; /* hash table of the addresses with open connections */
};

srv_peers *srv_peers_create(uint64_t most) {
  srv_peers *peers = calloc(1, sizeof *peers);
  if (!peers) return NULL;
  pthread_mutex_init(&peers->lock, NULL);
  peers->most = most;
  return peers;
}

void srv_peers_destroy(srv_peers *peers) {
  if (!peers) return;
  for (size_t i = 0; i < CHAINS; i++) {
    while (peers->chains[i]) {
      peer *next = peers->chains[i]->next;
      free(peers->chains[i]);
      peers->chains[i] = next;
    }
  }
  pthread_mutex_destroy(&peers->lock);
  free(peers);
}

/* The link to the peer, or to the NULL at the end of its chain. Chains hold only addresses with open
 * connections: to make one long, a client needs that many addresses. */
static peer **find(srv_peers *peers, const srv_client *group) {
  uint64_t hash = UINT64_C(0xcbf29ce484222325); /* FNV-1a */
  for (size_t i = 0; i < sizeof group->address; i++)
    hash = (hash ^ group->address[i]) * UINT64_C(0x100000001b3);
  peer **link = &peers->chains[hash % CHAINS];
  while (*link && memcmp(&(*link)->group, group, sizeof *group) != 0) link = &(*link)->next;
  return link;
}

bool srv_peers_enter(srv_peers *peers, const srv_client *group) {
  if (peers->most == 0) return true;
  pthread_mutex_lock(&peers->lock);
  peer **link = find(peers, group);
  if (!*link && (*link = calloc(1, sizeof **link))) (*link)->group = *group;
  bool enters = *link && (*link)->connections < peers->most;
  if (enters) (*link)->connections++;
  pthread_mutex_unlock(&peers->lock);
  return enters;
}

void srv_peers_leave(srv_peers *peers, const srv_client *group) {
  if (peers->most == 0) return;
  pthread_mutex_lock(&peers->lock);
  peer **link = find(peers, group), *found = *link;
  if (found && --found->connections == 0) {
    *link = found->next;
    free(found);
  }
  pthread_mutex_unlock(&peers->lock);
}
