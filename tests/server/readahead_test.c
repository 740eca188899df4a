/* Blocks made ahead of a reader: the same bytes, never too many, and nothing left behind. */
#include "readahead.h"

#include "fake_api.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "test.h"

enum { THREADS = 2, PIECE = SRV_BLOCK_SIZE };

/* A body that counts. Where the gate is closed its reads on other threads than the test's wait. */
typedef struct counter {
  _Atomic uint64_t position;
  uint64_t end;
  int64_t last;
  atomic_size_t reads, reads_elsewhere;
  pthread_t reader;
} counter;

static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
static atomic_size_t destroyed;

static int64_t count_on(void *context, uint8_t *out, size_t capacity) {
  counter *c = context;
  atomic_fetch_add(&c->reads, 1);
  if (!pthread_equal(pthread_self(), c->reader)) {
    atomic_fetch_add(&c->reads_elsewhere, 1);
    pthread_mutex_lock(&gate);
    pthread_mutex_unlock(&gate);
  }
  uint64_t position = atomic_load(&c->position);
  if (position == c->end) return c->last;
  size_t size = 0;
  for (; size < capacity && position < c->end; size++) out[size] = (uint8_t)(position++ % 251);
  atomic_store(&c->position, position);
  return (int64_t)size;
}

static void count_destroyed(void *context) {
  (void)context;
  atomic_fetch_add(&destroyed, 1);
}

typedef struct fixture {
  srv_work *work;
  counter body;
  srv_readahead *ahead;
  atomic_bool ready, unwanted;
  uint8_t *out;
} fixture;

static void pause_ms(long ms) {
  nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

static void be_ready(void *owner) {
  atomic_store(&((fixture *)owner)->ready, true);
}

static bool is_wanted(void *owner) {
  return !atomic_load(&((fixture *)owner)->unwanted);
}

static int set_up(void **state) {
  fixture *f = calloc(1, sizeof *f);
  f->work = srv_work_create(THREADS, 4, 0);
  f->out = malloc(PIECE);
  f->body.reader = pthread_self();
  atomic_store(&destroyed, 0);
  *state = f;
  return 0;
}

static int tear_down(void **state) {
  fixture *f = *state;
  srv_work_destroy(f->work);
  free(f->out);
  free(f);
  return 0;
}

static void open_any_body(fixture *f, uint64_t size, int64_t last, bool is_slow) {
  f->body.end = size;
  f->body.last = last;
  api_answer answer = {.body = {.size = size,
                                .context = &f->body,
                                .read = count_on,
                                .destroy = count_destroyed,
                                .is_slow = is_slow}};
  const srv_reader reader = {f, be_ready, is_wanted};
  f->ahead = srv_readahead_create(f->work, NULL, &answer, &reader);
  assert_non_null(f->ahead);
}

static void open_body(fixture *f, uint64_t size, int64_t last) {
  open_any_body(f, size, last, false);
}

/* As the daemon reads: when there is nothing it comes back once it is told to. */
static int64_t read_some(fixture *f, size_t capacity) {
  for (;;) {
    atomic_store(&f->ready, false);
    int64_t size = srv_readahead_read(f->ahead, f->out, capacity);
    if (size != SRV_READAHEAD_LATER) return size;
    while (!atomic_load(&f->ready)) pause_ms(1);
  }
}

static void read_right(fixture *f, size_t capacity, uint64_t *position) {
  int64_t size = read_some(f, capacity);
  assert_in_range(size, 1, capacity);
  for (int64_t i = 0; i < size; i++)
    if (f->out[i] != (*position + (uint64_t)i) % 251) fail_msg("wrong at %d", (int)i);
  *position += (uint64_t)size;
}

static void leave(fixture *f) {
  srv_readahead_leave(f->ahead);
  for (int i = 0; i < 10000 && atomic_load(&destroyed) == 0; i++) pause_ms(1);
  assert_int_equal(atomic_load(&destroyed), 1);
}

/* Until nobody is at work for the reader. */
static void settle(fixture *f) {
  size_t waiting = 1, running = 1;
  for (int i = 0; i < 10000 && waiting + running > 0; i++) {
    pause_ms(1);
    srv_work_load(f->work, &waiting, &running);
  }
  assert_int_equal(waiting + running, 0);
}

/* Reads little, which is quick even where each byte is slow, and lets others run: on a busy machine too the
 * reader is a quick one now and then. */
static void read_little(fixture *f, uint64_t *position) {
  enum { LITTLE = 1000 };
  read_right(f, LITTLE, position);
  pause_ms(1);
}

/* Reads until a compute thread has gone ahead. */
static void read_until_ahead(fixture *f, uint64_t *position) {
  for (int i = 0; i < 10000 && atomic_load(&f->body.reads_elsewhere) == 0; i++) read_little(f, position);
  assert_true(atomic_load(&f->body.reads_elsewhere) > 0);
}

/* ---- tests ----------------------------------------------------------------------------------- */

TEST_WITH(bytes_and_their_end_are_those_of_the_body, set_up, tear_down) {
  fixture *f = *state;
  static const size_t capacities[] = {PIECE, 1000, PIECE - 1};
  static const int64_t ends[] = {0, -1};
  for (int e = 0; e < 2; e++)
    for (int c = 0; c < 3; c++) {
      uint64_t position = 0, size = (c == 1 ? 1 : 24) * PIECE + 77;
      f->body.position = 0;
      atomic_store(&destroyed, 0);
      open_body(f, size, ends[e]);
      while (position < size) read_right(f, capacities[c], &position);
      assert_int_equal(position, size);
      for (int again = 0; again < 2; again++) assert_int_equal(read_some(f, PIECE), ends[e]);
      leave(f);
    }
}

TEST_WITH(a_quick_reader_is_gone_ahead_of, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  open_body(f, 1000 * PIECE, 0);
  read_until_ahead(f, &position);
  leave(f);
}

TEST_WITH(a_reader_that_stops_holds_no_thread_and_a_few_blocks, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  open_body(f, 2000 * PIECE, 0);
  read_until_ahead(f, &position);
  settle(f);
  assert_in_range(f->body.position, position, position + SRV_READAHEAD_BLOCKS * PIECE);
  leave(f);
}

TEST_WITH(a_reader_that_takes_its_time_is_not_gone_ahead_of, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  open_body(f, 2000 * PIECE, 0);
  read_until_ahead(f, &position);
  settle(f);
  while (position < f->body.position) { /* what had been made by then */
    pause_ms(30);
    read_right(f, PIECE, &position);
  }
  size_t elsewhere = atomic_load(&f->body.reads_elsewhere);
  for (int i = 0; i < 5; i++) {
    pause_ms(30);
    read_right(f, PIECE, &position);
    assert_int_equal(f->body.position, position);
  }
  assert_int_equal(atomic_load(&f->body.reads_elsewhere), elsewhere);
  leave(f);
}

TEST_WITH(without_an_idle_core_the_reader_computes, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  for (int i = 0; i < THREADS; i++) srv_work_outside(f->work, true);
  open_body(f, 200 * PIECE, 0);
  for (int i = 0; i < 100; i++) {
    assert_int_equal(srv_readahead_read(f->ahead, f->out, PIECE), PIECE);
    position += PIECE;
    assert_int_equal(f->body.position, position);
  }
  assert_int_equal(atomic_load(&f->body.reads_elsewhere), 0);
  for (int i = 0; i < THREADS; i++) srv_work_outside(f->work, false);
  leave(f);
}

TEST_WITH(a_reader_that_leaves_waits_for_nobody, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  open_body(f, 2000 * PIECE, 0);
  read_right(f, PIECE, &position);
  pthread_mutex_lock(&gate);
  size_t waiting = 0, running = 0;
  for (int i = 0; i < 10000 && waiting + running == 0; i++) {
    read_little(f, &position);
    srv_work_load(f->work, &waiting, &running);
  }
  for (int i = 0; i < 10000 && atomic_load(&f->body.reads_elsewhere) == 0; i++) pause_ms(1);
  assert_int_equal(atomic_load(&f->body.reads_elsewhere), 1);
  srv_readahead_leave(f->ahead);
  assert_int_equal(atomic_load(&destroyed), 0); /* the block is still being made */
  pthread_mutex_unlock(&gate);
  settle(f);
  assert_int_equal(atomic_load(&destroyed), 1);
  assert_int_equal(atomic_load(&f->body.reads_elsewhere), 1);
}

TEST_WITH(a_reader_for_whom_memory_lacks_computes, set_up, tear_down) {
  fixture *f = *state;
  uint64_t position = 0;
  open_body(f, 2000 * PIECE, 0);
  fake_api_fill_memory(true);
  for (int i = 0; i < 100; i++) read_right(f, PIECE, &position);
  assert_int_equal(atomic_load(&f->body.reads_elsewhere), 0);
  fake_api_fill_memory(false);
  read_until_ahead(f, &position);
  leave(f);
}

TEST_WITH(slow_bodies_are_read_by_compute_threads_alone, set_up, tear_down) {
  fixture *f = *state;
  for (int last = 0; last >= -1; last--) {
    uint64_t position = 0, size = 9 * PIECE + 77;
    f->body.position = 0;
    atomic_store(&destroyed, 0);
    open_any_body(f, size, last, true);
    fake_api_fill_memory(true); /* the block is not asked for */
    while (position < size) {
      read_right(f, 100000, &position);
      assert_in_range(f->body.position, position, position + 2 * PIECE);
    }
    assert_int_equal(read_some(f, PIECE), last);
    fake_api_fill_memory(false);
    assert_int_equal(atomic_load(&f->body.reads), atomic_load(&f->body.reads_elsewhere));
    leave(f);
  }
}

TEST_WITH(a_slow_body_that_nobody_wants_is_not_read, set_up, tear_down) {
  fixture *f = *state;
  open_any_body(f, 100 * PIECE, 0, true);
  atomic_store(&f->unwanted, true);
  assert_int_equal(read_some(f, PIECE), -1);
  assert_int_equal(atomic_load(&f->body.reads), 0);
  leave(f);
}
