/* One lock, one list: jobs take milliseconds, so the lock is never contended enough to matter. */
#include "work.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>

struct srv_work {
  pthread_mutex_t lock;
  pthread_cond_t wake;
  srv_job *first, *last;
  size_t queue_max, waiting, running;
  bool stopping;
  size_t thread_count;
  pthread_t threads[];
};

static srv_job *take(srv_work *work) {
  while (work->first == NULL && !work->stopping) pthread_cond_wait(&work->wake, &work->lock);
  srv_job *job = work->first;
  if (job == NULL) return NULL;
  work->first = job->next;
  if (work->first == NULL) work->last = NULL;
  work->waiting--;
  return job;
}

static void *run_jobs(void *context) {
  srv_work *work = context;
  pthread_mutex_lock(&work->lock);
  for (srv_job *job = take(work); job != NULL; job = take(work)) {
    work->running++;
    pthread_mutex_unlock(&work->lock);
    job->run(job);
    pthread_mutex_lock(&work->lock);
    work->running--;
  }
  pthread_mutex_unlock(&work->lock);
  return NULL;
}

srv_work *srv_work_create(size_t threads, size_t queue_max) {
  if (threads == 0 || threads > (SIZE_MAX - sizeof(srv_work)) / sizeof(pthread_t)) return NULL;
  srv_work *work = calloc(1, sizeof *work + threads * sizeof *work->threads);
  if (work == NULL) return NULL;
  pthread_mutex_init(&work->lock, NULL);
  pthread_cond_init(&work->wake, NULL);
  work->queue_max = queue_max;
  for (; work->thread_count < threads; work->thread_count++) {
    if (pthread_create(&work->threads[work->thread_count], NULL, run_jobs, work) != 0) {
      srv_work_destroy(work);
      return NULL;
    }
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
  job->next = NULL;
  pthread_mutex_lock(&work->lock);
  /* Jobs that an idle thread is about to take do not count as waiting. */
  size_t idle = work->thread_count - work->running;
  bool accepted = work->waiting < work->queue_max + idle;
  if (accepted) {
    if (work->last == NULL) {
      work->first = job;
    } else {
      work->last->next = job;
    }
    work->last = job;
    work->waiting++;
    pthread_cond_signal(&work->wake);
  }
  pthread_mutex_unlock(&work->lock);
  return accepted;
}

void srv_work_load(srv_work *work, size_t *waiting, size_t *running) {
  pthread_mutex_lock(&work->lock);
  *waiting = work->waiting;
  *running = work->running;
  pthread_mutex_unlock(&work->lock);
}
