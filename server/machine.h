/* The machine: clocks, and the memory and processors that it, or the container, allows this process. */
#ifndef SRV_MACHINE_H
#define SRV_MACHINE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Monotonic time, which setting the clock does not change. srv_now_ms is cheaper and lags by at most a tick
 * of the kernel, some milliseconds. */
uint64_t srv_now_ns(void);
uint64_t srv_now_ms(void);

/* Unix time. */
uint64_t srv_unix_ns(void);

/* A condition whose waits end at a time of srv_now_ns at the latest. */
void srv_timed_init(pthread_cond_t *condition);
void srv_timed_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t end_ns);
/* Joins a thread if it ends within a second; false otherwise. */
bool srv_join_soon(pthread_t thread);

/* The least memory limit of this process's cgroups (versions 1 and 2), in bytes; UINT64_MAX without one.
 * root: of the file system, "" except in tests. */
uint64_t srv_machine_memory_limit(const char *root);

/* How many processors this process may use: those of its affinity, or fewer when the CPU quota of its cgroups
 * (versions 1 and 2) is less, rounded up. root: as above. */
uint64_t srv_machine_cpus(const char *root);

/* Sets how glibc's allocator holds memory. Call before the first thread starts. All threads share one arena:
 * free memory is trimmed at the end of the main one only, and up to 64 MiB is kept in each of the others.
 * Blocks of some MiB come from it too, and up to 32 MiB of it stay for the next request: pages that the
 * system gives anew with each request cost, in virtual machines, more than what most requests compute. */
void srv_machine_set_malloc(void);

/* Returns the allocator's free pages to the system: glibc never returns those below a block in use. Takes
 * milliseconds when much is free. */
void srv_machine_trim(void);

#endif
