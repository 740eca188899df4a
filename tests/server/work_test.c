#include "work.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <time.h>

#include <cmocka.h>

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

static void no_threads_is_refused(void **state) {
  (void)state;
  assert_null(srv_work_create(0, 5));
  srv_work_destroy(NULL);
}

static void queue_takes_what_waits_and_no_more(void **state) {
  (void)state;
  enum { THREADS = 2, QUEUE = 3 };
  srv_work *work = srv_work_create(THREADS, QUEUE);
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

static void without_a_queue_idle_threads_still_work(void **state) {
  (void)state;
  srv_work *work = srv_work_create(1, 0);
  srv_job jobs[2] = {{.run = run_at_gate}, {.run = run_at_gate}};
  pthread_mutex_lock(&gate);
  assert_true(srv_work_submit(work, &jobs[0]));
  assert_false(srv_work_submit(work, &jobs[1]));
  pthread_mutex_unlock(&gate);
  srv_work_destroy(work);
  assert_int_equal(atomic_load(&done), 1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup(no_threads_is_refused, reset),
      cmocka_unit_test_setup(queue_takes_what_waits_and_no_more, reset),
      cmocka_unit_test_setup(without_a_queue_idle_threads_still_work, reset),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
