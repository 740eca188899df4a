/* The bounded pool of compute threads. */
#ifndef SRV_WORK_H
#define SRV_WORK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Embedded in the caller's struct, which must live until run is called. */
typedef struct srv_job {
  void (*run)(struct srv_job *job); /* on a compute thread; may free the job */
  struct srv_job *next;
  bool is_admitted; /* counts against queue_max */
} srv_job;

typedef struct srv_work srv_work;

/* threads: jobs and parts that run at once. queue_max: jobs that may wait for a thread. long_max: jobs that,
 * once they have run for 50 ms, no longer count among `threads`; each has a thread of its own. NULL with
 * errno. */
srv_work *srv_work_create(size_t threads, size_t queue_max, size_t long_max);

/* Runs all queued jobs, then ends the threads. NULL accepted. */
void srv_work_destroy(srv_work *work);

/* Queues a job. False, at once, when the queue is full. Any thread. */
bool srv_work_submit(srv_work *work, srv_job *job);

/* Queues a job that was admitted before, or a short one. It takes no place in the queue, and runs before the
 * submitted jobs, after those that were resumed earlier. Any thread. */
void srv_work_resume(srv_work *work, srv_job *job);

/* Queues a job that gives way to all others: it runs when no other waits, but one of these a second runs even
 * so. At most `threads` of these run at once, however long they take. Any thread. */
void srv_work_give_way(srv_work *work, srv_job *job);

/* As srv_work_resume for work that pays off only on an idle core; false when there is none. The pool has a
 * thread a core; busy threads outside the pool count too. */
bool srv_work_spare(srv_work *work, srv_job *job);

/* Tells the pool that a thread outside it begins or ends work. */
void srv_work_outside(srv_work *work, bool begins);

/* Calls part(context, i) once for each i below count, in any order, on this thread and on threads that are or
 * become idle; returns when all calls have returned. Never waits for a thread to become free, so jobs and
 * parts may both call it; jobs have precedence over parts. owner: a srv_work, as in api_parallel_for. */
void srv_work_parallel_for(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                           void *context);

/* For /metrics: the number of waiting jobs and of busy threads. */
void srv_work_load(srv_work *work, size_t *waiting, size_t *busy);

#endif
