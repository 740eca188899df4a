/* What the files of the I/O loops share: waking a loop, phases of a connection, answers that are not sent
 * yet. */
#include "io_loop.h"
#include "raw_socket.h"

#include <unistd.h>

void srv_wake(srv_loop *l) {
  uint64_t one = 1;
  /* write fails only when the counter is full, and then the loop wakes anyway. */
  ssize_t written = write(l->event, &one, sizeof one);
  (void)written;
}

void srv_hand_back(void *owner) {
  srv_connection *c = owner;
  srv_loop *l = c->owner;
  pthread_mutex_lock(&l->lock);
  if (!l->done) srv_wake(l); /* under the lock: once the thread sees c, it may end and free l */
  c->next_done = l->done;
  l->done = c;
  pthread_mutex_unlock(&l->lock);
}

void srv_enter(srv_connection *c, srv_phase phase) {
  srv_watch_enter(&c->watch, phase, c->owner->turn_ms);
}

void srv_set_unsent(srv_loop *l, size_t *unsent, size_t now_unsent) {
  atomic_size_t *clients = &l->http->server->unsent;
  if (*unsent == 0 && now_unsent > 0) atomic_fetch_add(clients, 1);
  if (*unsent > 0 && now_unsent == 0) atomic_fetch_sub(clients, 1);
  *unsent = now_unsent;
}

void srv_note_unsent(srv_connection *c) {
  srv_set_unsent(c->owner, &c->unsent, srv_raw_unsent(c->fd));
}
