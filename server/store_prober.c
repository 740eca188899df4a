#include "store_prober.h"

#include "log.h"
#include "machine.h"

#include <errno.h>
#include <string.h>

/* The folder is tried every PROBE_NS, until nobody has asked during QUIET_NS. A try that takes longer than
 * HANG_NS counts as failed. */
static const uint64_t PROBE_NS = 1000000000, QUIET_NS = 60000000000, HANG_NS = 5000000000;

/* Tries the folder once. Called with the lock held; releases it meanwhile. */
static void try_once(srv_prober *prober) {
  prober->trying_ns = srv_now_ns();
  pthread_mutex_unlock(&prober->lock);
  bool is_usable = prober->attempt(prober->context);
  int reason = errno;
  pthread_mutex_lock(&prober->lock);
  if (prober->is_usable && !is_usable)
    srv_log(SRV_LOG_ERROR, "store: cannot use folder '%s': %s", prober->folder, strerror(reason));
  if (!prober->is_usable && is_usable)
    srv_log(SRV_LOG_INFO, "store: folder '%s' can be used again", prober->folder);
  prober->is_usable = is_usable;
  prober->trying_ns = 0;
}

static void *run_probes(void *context) {
  srv_prober *prober = context;
  pthread_mutex_lock(&prober->lock);
  while (!prober->is_closing) {
    uint64_t now_ns = srv_now_ns();
    if (prober->asked_ns == 0 || now_ns - prober->asked_ns > QUIET_NS) {
      pthread_cond_wait(&prober->wake, &prober->lock);
    } else {
      try_once(prober);
      if (!prober->is_closing) srv_timed_wait(&prober->wake, &prober->lock, now_ns + PROBE_NS);
    }
  }
  pthread_mutex_unlock(&prober->lock);
  return NULL;
}

void srv_prober_init(srv_prober *prober) {
  pthread_mutex_init(&prober->lock, NULL);
  srv_timed_init(&prober->wake);
  prober->is_usable = true;
}

bool srv_prober_stop(srv_prober *prober) {
  pthread_mutex_lock(&prober->lock);
  prober->is_closing = true;
  pthread_cond_signal(&prober->wake);
  pthread_mutex_unlock(&prober->lock);
  if (prober->is_started && !srv_join_soon(prober->thread)) return false;
  pthread_mutex_destroy(&prober->lock);
  pthread_cond_destroy(&prober->wake);
  return true;
}

bool srv_prober_ask(srv_prober *prober) {
  pthread_mutex_lock(&prober->lock);
  uint64_t now_ns = srv_now_ns();
  bool rested = now_ns - prober->asked_ns > QUIET_NS;
  if (rested) pthread_cond_signal(&prober->wake);
  prober->asked_ns = now_ns;
  int reason = prober->is_started ? 0 : pthread_create(&prober->thread, NULL, run_probes, prober);
  if (reason != 0) srv_log(SRV_LOG_ERROR, "store: no thread to try the folder: %s", strerror(reason));
  prober->is_started = reason == 0;
  bool hangs = prober->trying_ns != 0 && now_ns - prober->trying_ns > HANG_NS;
  bool is_usable = prober->is_started && prober->is_usable && !hangs;
  pthread_mutex_unlock(&prober->lock);
  return is_usable;
}
