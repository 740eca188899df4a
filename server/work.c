/* A pool with one lock, two lists of jobs and one of loops. Jobs take milliseconds, and parts not much less,
 * so the lock is never contended enough to matter. */
#include "work.h"

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

/* First in, first out. */
typedef struct job_list {
  srv_job *first, *last;
} job_list;

struct srv_work {
  pthread_mutex_t lock;
  pthread_cond_t wake;
  job_list resumed, queued; /* resumed jobs go first */
  loop *loops;
  size_t queue_max, waiting, running;
  size_t admitted;       /* waiting jobs from srv_work_submit */
  atomic_size_t outside; /* busy threads outside the pool; not guarded */
  bool stopping;
  size_t thread_count;
  pthread_t threads[];
};

/* ---- threads; under the lock ----------------------------------------------------------------- */

static srv_job *take(srv_work *work) {
  job_list *list = work->resumed.first != NULL ? &work->resumed : &work->queued;
  srv_job *job = list->first;
  list->first = job->next;
  if (list->first == NULL) list->last = NULL;
  work->waiting--;
  work->admitted -= job->is_admitted;
  return job;
}

static void put(srv_work *work, job_list *list, srv_job *job) {
  job->next = NULL;
  *(list->last == NULL ? &list->first : &list->last->next) = job;
  list->last = job;
  work->waiting++;
  pthread_cond_signal(&work->wake);
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

static void *run_threads(void *context) {
  srv_work *work = context;
  pthread_mutex_lock(&work->lock);
  for (;;) {
    while (work->waiting == 0 && work->loops == NULL && !work->stopping)
      pthread_cond_wait(&work->wake, &work->lock);
    if (work->waiting == 0 && work->loops == NULL) break;
    work->running++;
    if (work->waiting > 0) {
      srv_job *job = take(work);
      pthread_mutex_unlock(&work->lock);
      job->run(job);
      pthread_mutex_lock(&work->lock);
    } else {
      help(work, work->loops);
    }
    work->running--;
  }
  pthread_mutex_unlock(&work->lock);
  return NULL;
}

/* ---- the pool -------------------------------------------------------------------------------- */

srv_work *srv_work_create(size_t threads, size_t queue_max) {
  if (threads == 0 || threads > (SIZE_MAX - sizeof(srv_work)) / sizeof(pthread_t)) return NULL;
  srv_work *work = calloc(1, sizeof *work + threads * sizeof *work->threads);
  if (work == NULL) return NULL;
  pthread_mutex_init(&work->lock, NULL);
  pthread_cond_init(&work->wake, NULL);
  work->queue_max = queue_max;
  for (; work->thread_count < threads; work->thread_count++) {
    int reason = pthread_create(&work->threads[work->thread_count], NULL, run_threads, work);
    if (reason == 0) continue;
    srv_work_destroy(work);
    errno = reason;
    return NULL;
  }
  return work;
}

void srv_work_destroy(srv_work *work) {
  if (work == NULL) return;
  pthread_mutex_lock(&work->lock);
  work->stopping = true;
  pthread_cond_broadcast(&work->wake);
  pthread_mutex_unlock(&work->lock);
  for (size_t i = 0; i < work->thread_count; i++) pthread_join(work->threads[i], NULL);
  pthread_cond_destroy(&work->wake);
  pthread_mutex_destroy(&work->lock);
  free(work);
}

bool srv_work_submit(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  /* Jobs that an idle thread is about to take do not count as waiting. */
  size_t busy = work->running + work->waiting - work->admitted;
  size_t idle = work->thread_count > busy ? work->thread_count - busy : 0;
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

bool srv_work_spare(srv_work *work, srv_job *job) {
  pthread_mutex_lock(&work->lock);
  size_t busy = work->running + work->waiting + atomic_load(&work->outside);
  bool accepted = !work->stopping && busy < work->thread_count;
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
  if (count > 1 && work->running < work->thread_count) pthread_cond_broadcast(&work->wake);
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
