/* Tries a folder in a thread of its own, so that a file system that hangs blocks no other. */
#ifndef SRV_STORE_PROBER_H
#define SRV_STORE_PROBER_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Set `folder`, `attempt` and `context`, then init. */
typedef struct srv_prober {
  const char *folder;             /* for the log */
  bool (*attempt)(void *context); /* whether the folder can be used; else errno says why */
  void *context;
  pthread_t thread;     /* valid with is_started */
  pthread_mutex_t lock; /* guards the members below */
  pthread_cond_t wake;
  uint64_t asked_ns, trying_ns; /* time of the last question; start of the present try, 0: none */
  bool is_usable;               /* result of the last try */
  bool is_started, is_closing;
} srv_prober;

void srv_prober_init(srv_prober *prober);

/* Whether the folder could be used when it was last tried; begins to try it about once a second, until
 * nobody has asked for a minute. */
bool srv_prober_ask(srv_prober *prober);

/* Stops. False when a try hangs: the thread then goes on using the prober and its context. */
bool srv_prober_stop(srv_prober *prober);

#endif
