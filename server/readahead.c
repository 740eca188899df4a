/* A ring of blocks between the reader and a compute thread. The compute thread owns the body while `going`
 * is true, the reader otherwise. */
#include "readahead.h"

#include "machine.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* A client that takes longer over a block would not notice how fast the next one is made. */
static const uint64_t QUICK_MS = 10;

struct srv_readahead {
  srv_job job; /* first: the pool hands it back */
  srv_work *work;
  api_service *service; /* whose budget the ring counts in */
  api_answer answer;
  void (*ready)(void *owner);
  void *owner;
  uint64_t asked_ms; /* when the last block was read */

  pthread_mutex_t lock;
  bool going;      /* a compute thread goes ahead, or is about to */
  bool waits;      /* the reader, for `ready` */
  bool left;       /* by the reader */
  bool ended;      /* the body said `last` */
  int64_t last;    /* 0 or -1 */
  unsigned first;  /* block of the ring */
  unsigned filled; /* blocks from there on */
  size_t taken;    /* bytes of the first one */
  size_t sizes[SRV_READAHEAD_BLOCKS];
  uint8_t *ring; /* [SRV_READAHEAD_BLOCKS][SRV_BLOCK_SIZE], NULL while it is not needed */
};

/* ---- rings ----------------------------------------------------------------------------------- */

static const uint64_t RING_SIZE = (uint64_t)SRV_READAHEAD_BLOCKS * SRV_BLOCK_SIZE;

/* Allocates the ring; it stays NULL where the budget or the memory has no room. */
static void take_ring(srv_readahead *ahead) {
  if (!api_service_try_hold(ahead->service, API_HELD_BLOCK, RING_SIZE)) return;
  ahead->ring = malloc(RING_SIZE);
  if (ahead->ring == NULL) api_service_let_go(ahead->service, API_HELD_BLOCK, RING_SIZE);
}

static void give_ring_back(srv_readahead *ahead) {
  if (ahead->ring == NULL) return;
  free(ahead->ring);
  ahead->ring = NULL;
  api_service_let_go(ahead->service, API_HELD_BLOCK, RING_SIZE);
}

static void destroy(srv_readahead *ahead) {
  api_answer_deinit(&ahead->answer);
  pthread_mutex_destroy(&ahead->lock);
  give_ring_back(ahead);
  free(ahead);
}

/* ---- going ahead ----------------------------------------------------------------------------- */

/* Makes one block, under the lock but for the work itself. */
static void fill(srv_readahead *ahead) {
  unsigned place = (ahead->first + ahead->filled) % SRV_READAHEAD_BLOCKS;
  pthread_mutex_unlock(&ahead->lock);
  uint8_t *block = ahead->ring + (size_t)place * SRV_BLOCK_SIZE;
  int64_t size = ahead->answer.body.read(ahead->answer.body.context, block, SRV_BLOCK_SIZE);
  pthread_mutex_lock(&ahead->lock);
  if (size > 0) {
    ahead->sizes[place] = (size_t)size;
    ahead->filled++;
  } else {
    ahead->ended = true;
    ahead->last = size;
  }
  if (ahead->waits) {
    ahead->waits = false;
    ahead->ready(ahead->owner);
  }
}

/* On a compute thread. */
static void go(srv_job *job) {
  srv_readahead *ahead = (srv_readahead *)(void *)job;
  pthread_mutex_lock(&ahead->lock);
  while (!ahead->left && !ahead->ended && ahead->filled < SRV_READAHEAD_BLOCKS) fill(ahead);
  ahead->going = false;
  bool left = ahead->left;
  pthread_mutex_unlock(&ahead->lock);
  if (left) destroy(ahead);
}

/* Under the lock, with `going` false: starts a compute thread, or frees an unused ring. */
static void consider(srv_readahead *ahead, bool quick) {
  if (quick && !ahead->ended && ahead->filled <= SRV_READAHEAD_BLOCKS / 2) {
    if (ahead->ring == NULL) take_ring(ahead);
    ahead->going = ahead->ring != NULL && srv_work_spare(ahead->work, &ahead->job);
  }
  if (!ahead->going && ahead->filled == 0) give_ring_back(ahead);
}

/* ---- reading --------------------------------------------------------------------------------- */

srv_readahead *srv_readahead_create(srv_work *work, api_service *service, const api_answer *answer,
                                    void (*ready)(void *owner), void *owner) {
  srv_readahead *ahead = malloc(sizeof *ahead);
  if (ahead == NULL) return NULL;
  *ahead = (srv_readahead){.job = {.run = go},
                           .work = work,
                           .service = service,
                           .answer = *answer,
                           .ready = ready,
                           .owner = owner};
  pthread_mutex_init(&ahead->lock, NULL);
  return ahead;
}

/* Under the lock. */
static size_t take(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  unsigned place = ahead->first;
  size_t left = ahead->sizes[place] - ahead->taken, size = left < capacity ? left : capacity;
  const uint8_t *from = ahead->ring + (size_t)place * SRV_BLOCK_SIZE + ahead->taken;
  pthread_mutex_unlock(&ahead->lock); /* nobody else touches a filled block */
  memcpy(out, from, size);
  pthread_mutex_lock(&ahead->lock);
  ahead->taken += size;
  if (size < left) return size;
  ahead->taken = 0;
  ahead->first = (place + 1) % SRV_READAHEAD_BLOCKS;
  ahead->filled--;
  return size;
}

/* Under the lock, with nobody ahead. */
static int64_t compute(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  pthread_mutex_unlock(&ahead->lock);
  int64_t size = ahead->answer.body.read(ahead->answer.body.context, out, capacity);
  pthread_mutex_lock(&ahead->lock);
  ahead->ended = size <= 0;
  ahead->last = size;
  return size;
}

int64_t srv_readahead_read(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  uint64_t now = srv_now_ms();
  bool quick = ahead->asked_ms != 0 && now - ahead->asked_ms <= QUICK_MS;
  ahead->asked_ms = now;
  int64_t size = SRV_READAHEAD_LATER;
  pthread_mutex_lock(&ahead->lock);
  if (ahead->filled > 0) {
    size = (int64_t)take(ahead, out, capacity);
  } else if (ahead->ended) {
    size = ahead->last;
  } else if (ahead->going) {
    ahead->waits = true;
  } else {
    size = compute(ahead, out, capacity);
  }
  if (!ahead->going) consider(ahead, quick);
  pthread_mutex_unlock(&ahead->lock);
  return size;
}

void srv_readahead_leave(srv_readahead *ahead) {
  if (ahead == NULL) return;
  pthread_mutex_lock(&ahead->lock);
  ahead->left = true;
  bool going = ahead->going;
  pthread_mutex_unlock(&ahead->lock);
  if (!going) destroy(ahead);
}
