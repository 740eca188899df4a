/* A ring of blocks between the reader and a compute thread. The compute thread owns the body while `going` is
 * true, the reader owns it otherwise. */
#include "readahead.h"

#include "machine.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* A client that takes longer than this for a block would not gain from a faster next one. */
static const uint64_t QUICK_MS = 10;

struct srv_readahead {
  srv_job job; /* first: the pool passes it to fill_ring */
  srv_work *work;
  api_service *service; /* its memory budget counts the ring */
  api_answer answer;
  srv_reader reader;
  uint64_t asked_ms; /* when the last block was read */

  pthread_mutex_t lock;
  bool going;      /* a compute thread fills the ring, or is about to */
  bool waits;      /* the reader waits for `ready` */
  bool left;       /* srv_readahead_leave was called */
  bool ended;      /* a read of the body returned `last` */
  int64_t last;    /* 0: the end, -1: an error */
  unsigned first;  /* index of the block to read next */
  unsigned filled; /* number of filled blocks from `first` on */
  size_t taken;    /* bytes of block `first` that were read */
  size_t sizes[SRV_READAHEAD_BLOCKS];
  uint8_t *ring; /* [block_count][SRV_BLOCK_SIZE], NULL while unused */
};

/* ---- rings ----------------------------------------------------------------------------------- */

static bool is_slow(const srv_readahead *ahead) {
  return ahead->answer.body.is_slow;
}

/* One block is the most of a slow body: who reads it has that much of the budget already. */
static unsigned block_count(const srv_readahead *ahead) {
  return is_slow(ahead) ? 1 : SRV_READAHEAD_BLOCKS;
}

/* Bytes of the ring that the budget has to give. */
static uint64_t ring_cost(const srv_readahead *ahead) {
  return is_slow(ahead) ? 0 : (uint64_t)SRV_READAHEAD_BLOCKS * SRV_BLOCK_SIZE;
}

/* Allocates the ring; it stays NULL when the budget or the memory has no room. */
static void take_ring(srv_readahead *ahead) {
  uint64_t cost = ring_cost(ahead);
  if (cost > 0 && !api_service_try_hold(ahead->service, API_HELD_BLOCK, cost)) return;
  ahead->ring = malloc((size_t)block_count(ahead) * SRV_BLOCK_SIZE);
  if (!ahead->ring && cost > 0) api_service_let_go(ahead->service, API_HELD_BLOCK, cost);
}

static void give_ring_back(srv_readahead *ahead) {
  uint64_t cost = ring_cost(ahead);
  if (!ahead->ring) return;
  free(ahead->ring);
  ahead->ring = NULL;
  if (cost > 0) api_service_let_go(ahead->service, API_HELD_BLOCK, cost);
}

static void destroy(srv_readahead *ahead) {
  api_answer_deinit(&ahead->answer);
  pthread_mutex_destroy(&ahead->lock);
  give_ring_back(ahead);
  free(ahead);
}

/* ---- going ahead ----------------------------------------------------------------------------- */

/* Reads the next block, unless nobody wants it any more. */
static int64_t read_wanted(srv_readahead *ahead, uint8_t *block) {
  if (is_slow(ahead) && !ahead->reader.is_wanted(ahead->reader.owner)) return -1;
  return ahead->answer.body.read(ahead->answer.body.context, block, SRV_BLOCK_SIZE);
}

/* Computes one block into the ring. Called with the lock held; releases it while computing. */
static void fill_block(srv_readahead *ahead) {
  unsigned place = (ahead->first + ahead->filled) % block_count(ahead);
  pthread_mutex_unlock(&ahead->lock);
  uint8_t *block = ahead->ring + (size_t)place * SRV_BLOCK_SIZE;
  int64_t size = read_wanted(ahead, block);
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
    ahead->reader.ready(ahead->reader.owner);
  }
}

/* Fills the ring, on a compute thread. */
static void fill_ring(srv_job *job) {
  srv_readahead *ahead = (srv_readahead *)(void *)job;
  pthread_mutex_lock(&ahead->lock);
  while (!ahead->left && !ahead->ended && ahead->filled < block_count(ahead)) fill_block(ahead);
  ahead->going = false;
  bool left = ahead->left;
  pthread_mutex_unlock(&ahead->lock);
  if (left) destroy(ahead);
}

/* Starts a compute thread, or frees an empty ring. Called with the lock held and `going` false. */
static void start_or_free_ring(srv_readahead *ahead, bool quick) {
  if (quick && !ahead->ended && ahead->filled <= block_count(ahead) / 2) {
    if (!ahead->ring) take_ring(ahead);
    ahead->going = ahead->ring && srv_work_spare(ahead->work, &ahead->job);
  }
  if (!ahead->going && ahead->filled == 0) give_ring_back(ahead);
}

/* ---- reading --------------------------------------------------------------------------------- */

srv_readahead *srv_readahead_create(srv_work *work, api_service *service, const api_answer *answer,
                                    const srv_reader *reader) {
  srv_readahead *ahead = malloc(sizeof *ahead);
  if (!ahead) return NULL;
  *ahead = (srv_readahead){
      .job = {.run = fill_ring}, .work = work, .service = service, .answer = *answer, .reader = *reader};
  pthread_mutex_init(&ahead->lock, NULL);
  return ahead;
}

/* Reads from the first filled block. Called with the lock held; releases it while copying. */
static size_t read_ring(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  unsigned place = ahead->first;
  size_t left = ahead->sizes[place] - ahead->taken, size = left < capacity ? left : capacity;
  const uint8_t *from = ahead->ring + (size_t)place * SRV_BLOCK_SIZE + ahead->taken;
  pthread_mutex_unlock(&ahead->lock); /* no other thread touches a filled block */
  memcpy(out, from, size);
  pthread_mutex_lock(&ahead->lock);
  ahead->taken += size;
  if (size < left) return size;
  ahead->taken = 0;
  ahead->first = (place + 1) % block_count(ahead);
  ahead->filled--;
  return size;
}

/* Computes the next bytes directly. Called with the lock held and `going` false; releases the lock while
 * computing. */
static int64_t read_body(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  pthread_mutex_unlock(&ahead->lock);
  int64_t size = ahead->answer.body.read(ahead->answer.body.context, out, capacity);
  pthread_mutex_lock(&ahead->lock);
  ahead->ended = size <= 0;
  ahead->last = size;
  return size;
}

/* Lets a compute thread read a slow body. Called with the lock held and `going` false. */
static int64_t send_for_block(srv_readahead *ahead) {
  if (!ahead->ring) take_ring(ahead);
  if (!ahead->ring) {
    ahead->ended = true;
    ahead->last = -1;
    return ahead->last;
  }
  ahead->going = ahead->waits = true;
  srv_work_give_way(ahead->work, &ahead->job);
  return SRV_READAHEAD_LATER;
}

int64_t srv_readahead_read(srv_readahead *ahead, uint8_t *out, size_t capacity) {
  uint64_t now = srv_now_ms();
  bool quick = ahead->asked_ms != 0 && now - ahead->asked_ms <= QUICK_MS;
  ahead->asked_ms = now;
  int64_t size = SRV_READAHEAD_LATER;
  pthread_mutex_lock(&ahead->lock);
  if (ahead->filled > 0) {
    size = (int64_t)read_ring(ahead, out, capacity);
  } else if (ahead->ended) {
    size = ahead->last;
  } else if (ahead->going) {
    ahead->waits = true;
  } else if (is_slow(ahead)) {
    size = send_for_block(ahead);
  } else {
    size = read_body(ahead, out, capacity);
  }
  if (!ahead->going) start_or_free_ring(ahead, quick);
  pthread_mutex_unlock(&ahead->lock);
  return size;
}

void srv_readahead_leave(srv_readahead *ahead) {
  if (!ahead) return;
  pthread_mutex_lock(&ahead->lock);
  ahead->left = true;
  bool going = ahead->going;
  pthread_mutex_unlock(&ahead->lock);
  if (!going) destroy(ahead);
}
