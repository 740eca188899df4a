/* The bounded pool of compute threads. */
#ifndef SRV_WORK_H
#define SRV_WORK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Lives in the struct of whoever submits it, until run has been called. */
typedef struct srv_job {
  void (*run)(struct srv_job *job); /* on a compute thread; the pool does not touch the job afterwards */
  struct srv_job *next;
  bool is_admitted; /* took a place in the queue */
} srv_job;

typedef struct srv_work srv_work;

/* queue_max: jobs that may wait for a thread. NULL without memory or threads. */
srv_work *srv_work_create(size_t threads, size_t queue_max);

/* Runs what is queued, then ends the threads. NULL is fine. */
void srv_work_destroy(srv_work *work);

/* False at once when the queue is full. Any thread. */
bool srv_work_submit(srv_work *work, srv_job *job);

/* Goes on with a job that was begun before, or runs a short one: it takes no place in the queue, and goes
 * before those that have one, behind those that were resumed earlier. Any thread. */
void srv_work_resume(srv_work *work, srv_job *job);

/* The same for work that only pays on a core that has nothing else to do: false when there is none. The pool
 * has a thread a core; those outside it that are at work count as well. */
bool srv_work_spare(srv_work *work, srv_job *job);

/* A thread outside the pool begins work, or ends it. */
void srv_work_outside(srv_work *work, bool begins);

/* Calls part(context, i) once for each i below count, in any order, on this thread and on those that are idle
 * or become so; returns when all calls have. Never waits for a thread: jobs go first, and parts call it as
 * well as jobs do. owner: a srv_work, as api_parallel_for has it. */
void srv_work_parallel_for(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                           void *context);

/* For /metrics. waiting: jobs; busy: threads. */
void srv_work_load(srv_work *work, size_t *waiting, size_t *busy);

#endif
