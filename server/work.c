/* A pool with one lock, three lists of jobs and one of loops. Jobs take milliseconds, and parts not much
 * less, so the lock is never contended enough to matter.
 *
 * A job that takes long gives up its turn: another thread then runs what waits, so that long jobs never keep
 * short ones waiting. How many jobs may take long at once is limited.
 *
 * Jobs that give way would wait without end on a busy daemon: so one of them a second goes before all others.
 */
#include "work.h"

#include "machine.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

/* A parallel loop, on the stack of the thread that runs it. It is listed as long as parts are left to begin;
 * its thread stays until the parts that other threads have begun are done. Guarded by the pool's lock. */
typedef struct loop {
  void (*part)(void *context, uint32_t index);
  void *context;
  uint32_t begun, count;
  size_t helpers; /* other threads that run a part */
  pthread_cond_t idle;
  struct loop *next;
} loop;

static const uint64_t LONG_NS = 50000000; /* a job that has run this long gives up its turn */
static const uint64_t DUE_NS = 1000000000;

typedef struct srv_worker srv_worker;

/* First in, first out. */
typedef struct job_list {
  srv_job *first, *last;
} job_list;

struct srv_work {
  pthread_mutex_t lock;
  pthread_cond_t wake;
  job_list resumed, queued; /* resumed jobs go first */
  job_list yielding;        /* from srv_work_give_way; do not count as waiting */
  uint64_t due_ns;          /* when the first of these goes before all others */
  size_t giving_way;        /* running jobs that were in `yielding` */
  loop *loops;
  size_t queue_max, waiting, running;
  size_t admitted;       /* waiting jobs from srv_work_submit */
  atomic_size_t outside; /* busy threads outside the pool; not guarded */
  bool stopping;
  size_t turns;    /* jobs and parts that may run at once, but for long jobs */
  size_t long_max; /* jobs that may take long at once */
  size_t thread_count;
  srv_worker *workers; /* [thread_count] */
};

/* A thread of the pool; guarded by the pool's lock. */
struct srv_worker {
  srv_work *work;
  pthread_t thread;
  bool has_job;
  uint64_t began_ns; /* its job */
};

/* ---- threads; under the lock ----------------------------------------------------------------- */

static srv_job *take_first(job_list *list) {
  srv_job *job = list->first;
  list->first = job->next;
  if (!list->first) list->last = NULL;
  return job;
}

/* Whether a job that gives way has waited for long enough, and so has its turn like any other. */
static bool is_due(const srv_work *work) {
  return work->yielding.first && work->giving_way < work->turns && srv_now_ns() >= work->due_ns;
}

static srv_job *take(srv_work *work, bool gives_way) {
  if (gives_way) {
    work->due_ns = srv_now_ns() + DUE_NS;
    return take_first(&work->yielding);
  }
  srv_job *job = take_first(work->resumed.first ? &work->resumed : &work->queued);
  work->waiting--;
  work->admitted -= job->is_admitted;
  return job;
}

static void put_last(srv_work *work, job_list *list, srv_job *job) {
  job->next = NULL;
  *(!list->last ? &list->first : &list->last->next) = job;
  list->last = job;
  pthread_cond_signal(&work->wake);
}

static void put(srv_work *work, job_list *list, srv_job *job) {
  work->waiting++;
  put_last(work, list, job);
}

static void unlist(srv_work *work, const loop *l) {
  loop **link = &work->loops;
  while (*link != l) link = &(*link)->next;
  *link = l->next;
}

/* Runs the next part of a listed loop. Releases the lock meanwhile. */
static void run_part(srv_work *work, loop *l) {
  uint32_t index = l->begun++;
  if (l->begun == l->count) unlist(work, l);
  pthread_mutex_unlock(&work->lock);
  l->part(l->context, index);
  pthread_mutex_lock(&work->lock);
}

static void help(srv_work *work, loop *l) {
  l->helpers++;
  run_part(work, l);
  if (--l->helpers == 0) pthread_cond_signal(&l->idle);
}

/* How many turns are taken. *next_ns: when the next running job will have taken long. */
static size_t taken_turns(const srv_work *work, uint64_t *next_ns) {
  uint64_t now_ns = work->long_max > 0 ? srv_now_ns() : 0;
  size_t long_jobs = 0;
  *next_ns = UINT64_MAX;
  for (size_t i = 0; work->long_max > 0 && i < work->thread_count; i++) {
    const srv_worker *worker = &work->workers[i];
    uint64_t long_ns = worker->began_ns + LONG_NS;
    if (worker->has_job && now_ns >= long_ns) long_jobs++;
    if (worker->has_job && now_ns < long_ns && long_ns < *next_ns) *next_ns = long_ns;
  }
  return work->running - (long_jobs < work->long_max ? long_jobs : work->long_max);
}

/* Waits until there is a job or a part, and a turn for it. False: the pool ends. */
static bool await_turn(srv_work *work) {
  for (;;) {
    uint64_t next_ns = UINT64_MAX;
    bool has_job = work->waiting > 0 || is_due(work),
         has_turn = has_job && taken_turns(work, &next_ns) < work->turns;
    bool has_rest = work->loops || (!has_job && work->yielding.first);
    if (has_turn || (has_rest && work->running < work->turns)) return true;
    if (work->stopping && !has_job && !has_rest) return false;
    if (has_job && next_ns != UINT64_MAX)
      srv_timed_wait(&work->wake, &work->lock, next_ns);
    else if (!has_job && work->yielding.first && work->giving_way < work->turns)
      srv_timed_wait(&work->wake, &work->lock, work->due_ns);
    else
      pthread_cond_wait(&work->wake, &work->lock);
  }
}

static void *run_worker(void *context) {
  srv_worker *worker = context;
  srv_work *work = worker->work;
  pthread_mutex_lock(&work->lock);
  while (await_turn(work)) {
    work->running++;
    bool gives_way = is_due(work) || (work->waiting == 0 && !work->loops);
    if (work->waiting > 0 || gives_way) {
      srv_job *job = take(work, gives_way);
      work->giving_way += gives_way;
      worker->has_job = true;
      worker->began_ns = srv_now_ns();
      /* Whoever waited without a limit has to look at this job's time too. */
      if (work->waiting > 0) pthread_cond_signal(&work->wake);
      pthread_mutex_unlock(&work->lock);
      job->run(job);
      pthread_mutex_lock(&work->lock);
      worker->has_job = false;
      work->giving_way -= gives_way;
    } else {
      help(work, work->loops);
    }
    work->running--;
    if (work->waiting > 0 || work->yielding.first || work->stopping) pthread_cond_signal(&work->wake);
  }
  pthread_cond_signal(&work->wake); /* the next one ends too */
  pthread_mutex_unlock(&work->lock);
  return NULL;
}

/* ---- the pool -------------------------------------------------------------------------------- */

srv_work *srv_work_create(size_t threads, size_t queue_max, size_t long_max) {
  if (threads == 0 || threads > SIZE_MAX / 2 / sizeof(srv_worker) ||
      long_max > SIZE_MAX / 2 / sizeof(srv_worker))
    return NULL;
  srv_work *work = calloc(1, sizeof *work);
  if (!work) return NULL;
  pthread_mutex_init(&work->lock, NULL);
  srv_timed_init(&work->wake);
  work->turns = threads;
  work->queue_max = queue_max;
  work->long_max = long_max;
  work->workers = calloc(threads + long_max, sizeof *work->workers);
  for (size_t i = 0; work->workers && i < threads + long_max; i++) {
    srv_worker *worker = &work->workers[i];
    worker->work = work;
    pthread_mutex_lock(&work->lock);
    int reason = pthread_create(&worker->thread, NULL, run_worker, worker);
    work->thread_count += reason == 0;
    pthread_mutex_unlock(&work->lock);
    if (reason == 0) continue;
    srv_work_destroy(work);
    errno = reason;
    return NULL;
  }
  if (work->workers) return work;
  srv_work_destroy(work);
  errno = ENOMEM;
  return NULL;
}

void srv_work_destroy(srv_work *work) {
  if (!work) return;
  pthread_mutex_lock(&work->lock);
  work->stopping = true;
  pthread_cond_broadcast(&work->wake);
  pthread_mutex_unlock(&work->lock);
  for (size_t i = 0; i < work->thread_count; i++) pthread_join(work->workers[i].thread, NULL);
  pthread_cond_destroy(&work->wake);
  pthread_mutex_destroy(&work->lock);
  free(work->workers);
  free(work);
}

bool srv_work_submit(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  /* Jobs that an idle thread is about to take do not count as waiting. */
  uint64_t next_ns;
  size_t busy = taken_turns(work, &next_ns) + work->waiting - work->admitted;
  size_t idle = work->turns > busy ? work->turns - busy : 0;
  bool accepted = work->admitted < work->queue_max + idle;
  job->is_admitted = true;
  work->admitted += accepted;
  if (accepted) put(work, &work->queued, job);
  pthread_mutex_unlock(&work->lock);
  return accepted;
}

void srv_work_resume(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  job->is_admitted = false;
  put(work, &work->resumed, job);
  pthread_mutex_unlock(&work->lock);
}

void srv_work_give_way(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  job->is_admitted = false;
  if (!work->yielding.first) work->due_ns = srv_now_ns() + DUE_NS;
  put_last(work, &work->yielding, job);
  pthread_mutex_unlock(&work->lock);
}

bool srv_work_spare(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  size_t busy = work->running + work->waiting + (work->yielding.first != NULL) + atomic_load(&work->outside);
  bool accepted = !work->stopping && busy < work->turns;
  job->is_admitted = false;
  /* Listed as resumed: the idle thread takes this job before any other that arrives while it wakes up. */
  if (accepted) put(work, &work->resumed, job);
  pthread_mutex_unlock(&work->lock);
  return accepted;
}

void srv_work_outside(srv_work *work, bool begins) {
  if (begins)
    atomic_fetch_add(&work->outside, 1);
  else
    atomic_fetch_sub(&work->outside, 1);
}

void srv_work_parallel_for(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                           void *context) {
  srv_work *work = owner;
  if (count == 0) return;
  loop l = {.part = part, .context = context, .count = count};
  pthread_cond_init(&l.idle, NULL);
  pthread_mutex_lock(&work->lock);
  l.next = work->loops;
  work->loops = &l;
  if (count > 1 && work->running < work->turns) pthread_cond_broadcast(&work->wake);
  while (l.begun < count) run_part(work, &l);
  while (l.helpers > 0) pthread_cond_wait(&l.idle, &work->lock);
  pthread_mutex_unlock(&work->lock);
  pthread_cond_destroy(&l.idle);
}

void srv_work_load(srv_work *work, size_t *waiting, size_t *busy) {
  pthread_mutex_lock(&work->lock);
  *waiting = work->waiting;
  *busy = work->running;
  pthread_mutex_unlock(&work->lock);
}
