#include "work.h"

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "test.h"

static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
static atomic_size_t begun, done;

static void run_at_gate(srv_job *job) {
  (void)job;
  atomic_fetch_add(&begun, 1);
  pthread_mutex_lock(&gate);
  pthread_mutex_unlock(&gate);
  atomic_fetch_add(&done, 1);
}

static void wait_until_begun(size_t count) {
  while (atomic_load(&begun) < count) nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
}

static int reset(void **state) {
  (void)state;
  atomic_store(&begun, 0);
  atomic_store(&done, 0);
  return 0;
}

TEST_WITH(no_threads_is_refused, reset, NULL) {
  assert_null(srv_work_create(0, 5, 0));
  srv_work_destroy(NULL);
}

TEST_WITH(queue_takes_what_waits_and_no_more, reset, NULL) {
  enum { THREADS = 2, QUEUE = 3 };
  srv_work *work = srv_work_create(THREADS, QUEUE, 0);
  srv_job jobs[THREADS + QUEUE + 1];
  pthread_mutex_lock(&gate);
  for (size_t i = 0; i < THREADS + QUEUE; i++) {
    jobs[i] = (srv_job){.run = run_at_gate};
    assert_true(srv_work_submit(work, &jobs[i]));
  }
  jobs[THREADS + QUEUE] = (srv_job){.run = run_at_gate};
  assert_false(srv_work_submit(work, &jobs[THREADS + QUEUE]));
  wait_until_begun(THREADS);
  assert_false(srv_work_submit(work, &jobs[THREADS + QUEUE]));
  size_t waiting, running;
  srv_work_load(work, &waiting, &running);
  assert_int_equal(waiting, QUEUE);
  assert_int_equal(running, THREADS);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), THREADS + QUEUE);
}

static srv_job *order[4]; /* in which jobs were begun, by the only thread */
static size_t order_size;

static void note_turn(srv_job *job) {
  order[order_size++] = job;
}

TEST_WITH(who_goes_on_takes_no_place_and_goes_first_in_turn, reset, NULL) {
  srv_work *work = srv_work_create(1, 1, 0);
  srv_job busy = {.run = run_at_gate}, admitted = {.run = note_turn}, refused = {.run = note_turn};
  srv_job resumed[3] = {{.run = note_turn}, {.run = note_turn}, {.run = note_turn}};
  order_size = 0;
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &busy));
  wait_until_begun(1);
  for (size_t i = 0; i < 2; i++) srv_work_resume(work, &resumed[i]);
  assert_true(srv_work_submit(work, &admitted));
  assert_false(srv_work_submit(work, &refused));
  srv_work_resume(work, &resumed[2]);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(order_size, 4);
  for (size_t i = 0; i < 3; i++) assert_ptr_equal(order[i], &resumed[i]);
  assert_ptr_equal(order[3], &admitted);
}

TEST_WITH(who_gives_way_goes_last, reset, NULL) {
  srv_work *work = srv_work_create(1, 2, 0);
  srv_job busy = {.run = run_at_gate}, admitted = {.run = note_turn}, resumed = {.run = note_turn};
  srv_job yielding[2] = {{.run = note_turn}, {.run = note_turn}}, spare = {.run = note_turn};
  order_size = 0;
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &busy));
  wait_until_begun(1);
  for (size_t i = 0; i < 2; i++) srv_work_give_way(work, &yielding[i]);
  assert_false(srv_work_spare(work, &spare));
  assert_true(srv_work_submit(work, &admitted));
  srv_work_resume(work, &resumed);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(order_size, 4);
  assert_ptr_equal(order[0], &resumed);
  assert_ptr_equal(order[1], &admitted);
  for (size_t i = 0; i < 2; i++) assert_ptr_equal(order[2 + i], &yielding[i]);
}

TEST_WITH(who_gives_way_takes_no_turn_of_a_long_job, reset, NULL) {
  srv_work *work = srv_work_create(1, 2, 4);
  srv_job busy = {.run = run_at_gate}, yielding = {.run = run_at_gate}, admitted = {.run = run_at_gate};
  pthread_mutex_lock(&gate);
  srv_work_give_way(work, &busy);
  wait_until_begun(1);
  srv_work_give_way(work, &yielding);
  assert_true(srv_work_submit(work, &admitted));
  wait_until_begun(2); /* once the first has taken long */
  nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
  assert_int_equal(atomic_load(&begun), 2);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), 3);
}

/* ---- what gives way, on a busy pool ---------------------------------------------------------- */

/* A job that is there again as soon as it has run, until `stops`. */
typedef struct repeated {
  srv_job job;
  srv_work *work;
} repeated;

static atomic_bool stops;

static void run_again(srv_job *job) {
  const repeated *r = (const repeated *)(void *)job;
  nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
  if (!atomic_load(&stops)) srv_work_resume(r->work, job);
}

static void count_run(srv_job *job) {
  (void)job;
  atomic_fetch_add(&done, 1);
}

static uint64_t now_ms(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000 + (uint64_t)now.tv_nsec / 1000000;
}

/* Until so many have run, but ten seconds at most. */
static void await_done(size_t count) {
  uint64_t end = now_ms() + 10000;
  while (atomic_load(&done) < count && now_ms() < end)
    nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
}

TEST_WITH(of_those_who_give_way_one_a_second_runs_on_a_busy_pool, reset, NULL) {
  srv_work *work = srv_work_create(1, 1, 0);
  repeated busy[2] = {{{.run = run_again}, work}, {{.run = run_again}, work}};
  srv_job yielding[3] = {{.run = count_run}, {.run = count_run}, {.run = count_run}};
  atomic_store(&stops, false);
  for (size_t i = 0; i < 2; i++) srv_work_resume(work, &busy[i].job);
  uint64_t start = now_ms();
  for (size_t i = 0; i < 3; i++) srv_work_give_way(work, &yielding[i]);
  await_done(3);
  uint64_t took = now_ms() - start;
  atomic_store(&stops, true);
  srv_work_destroy(work);
  assert_true(took >= 3000 && took < 10000);
}

TEST_WITH(who_has_given_way_for_long_waits_for_no_long_job, reset, NULL) {
  srv_work *work = srv_work_create(1, 1, 2);
  srv_job busy = {.run = run_at_gate}, yielding = {.run = count_run};
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &busy));
  wait_until_begun(1);
  srv_work_give_way(work, &yielding);
  await_done(1);
  size_t before = atomic_load(&done);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(before, 1);
}

TEST_WITH(without_a_queue_idle_threads_still_work, reset, NULL) {
  srv_work *work = srv_work_create(1, 0, 0);
  srv_job jobs[2] = {{.run = run_at_gate}, {.run = run_at_gate}};
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &jobs[0]));
  assert_false(srv_work_submit(work, &jobs[1]));
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), 1);
}

/* ---- spare cores and shared work ------------------------------------------------------------- */

TEST_WITH(spare_work_is_refused_where_no_core_is_idle, reset, NULL) {
  srv_work *work = srv_work_create(2, 4, 0);
  srv_job jobs[3] = {{.run = run_at_gate}, {.run = run_at_gate}, {.run = run_at_gate}};
  pthread_mutex_lock(&gate);
  assert_true(srv_work_spare(work, &jobs[0]));
  srv_work_outside(work, true); /* a thread that is not the pool's takes the other core */
  assert_false(srv_work_spare(work, &jobs[1]));
  srv_work_outside(work, false);
  assert_true(srv_work_spare(work, &jobs[1]));
  assert_false(srv_work_spare(work, &jobs[2]));
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), 2);
}

/* It is taken by the thread that was idle, before whatever is resumed while that thread wakes up: a job that
 * is resumed may take as long as a surface does. */
TEST_WITH(spare_work_is_not_overtaken, reset, NULL) {
  for (int i = 0; i < 100; i++) {
    srv_work *work = srv_work_create(1, 1, 0);
    srv_job spare = {.run = note_turn}, resumed = {.run = note_turn};
    order_size = 0;
    assert_true(srv_work_spare(work, &spare));
    srv_work_resume(work, &resumed);
    srv_work_destroy(work);
    assert_int_equal(order_size, 2);
    assert_ptr_equal(order[0], &spare);
  }
}

enum { PARTS = 1000 };

typedef struct parts {
  atomic_uint calls[PARTS];
  atomic_size_t in, most; /* at the same time */
  bool meet;              /* each waits a while for another one */
} parts;

static void run_part(void *context, uint32_t index) {
  parts *p = context;
  atomic_fetch_add(&p->calls[index], 1);
  atomic_fetch_add(&p->in, 1);
  for (int i = 0; p->meet && i < 2000 && atomic_load(&p->most) < 2; i++) {
    nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    size_t in = atomic_load(&p->in);
    if (in > atomic_load(&p->most)) atomic_store(&p->most, in);
  }
  atomic_fetch_sub(&p->in, 1);
}

TEST_WITH(every_part_is_called_once, reset, NULL) {
  srv_work *work = srv_work_create(3, 4, 0);
  static const uint32_t counts[] = {0, 1, 2, PARTS};
  for (int i = 0; i < 4; i++) {
    parts p = {.meet = false};
    srv_work_parallel_for(work, counts[i], run_part, &p);
    for (uint32_t k = 0; k < PARTS; k++) assert_int_equal(atomic_load(&p.calls[k]), k < counts[i]);
    assert_int_equal(atomic_load(&p.in), 0);
  }
  srv_work_destroy(work);
}

TEST_WITH(idle_threads_join_in, reset, NULL) {
  srv_work *work = srv_work_create(1, 4, 0);
  parts p = {.meet = true};
  srv_work_parallel_for(work, 2, run_part, &p);
  assert_int_equal(atomic_load(&p.most), 2);
  srv_work_destroy(work);
}

TEST_WITH(a_busy_pool_leaves_all_parts_to_the_caller, reset, NULL) {
  srv_work *work = srv_work_create(1, 4, 0);
  srv_job job = {.run = run_at_gate};
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &job));
  wait_until_begun(1);
  parts p = {.meet = false};
  srv_work_parallel_for(work, PARTS, run_part, &p);
  for (uint32_t k = 0; k < PARTS; k++) assert_int_equal(atomic_load(&p.calls[k]), 1);
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
}

/* Jobs that share work of their own, on all threads at once: each helps or does without help. */
typedef struct sharing_job {
  srv_job job;
  srv_work *work;
  parts parts;
} sharing_job;

static void share_in_job(srv_job *job) {
  sharing_job *s = (sharing_job *)(void *)job;
  srv_work_parallel_for(s->work, PARTS, run_part, &s->parts);
  atomic_fetch_add(&done, 1);
}

TEST_WITH(jobs_that_share_at_once_all_end, reset, NULL) {
  enum { JOBS = 8 };
  srv_work *work = srv_work_create(2, JOBS, 0);
  static sharing_job jobs[JOBS];
  for (int i = 0; i < JOBS; i++) {
    jobs[i] = (sharing_job){.job = {.run = share_in_job}, .work = work};
    assert_true(srv_work_submit(work, &jobs[i].job));
  }
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), JOBS);
  for (int i = 0; i < JOBS; i++)
    for (uint32_t k = 0; k < PARTS; k++) assert_int_equal(atomic_load(&jobs[i].parts.calls[k]), 1);
}
