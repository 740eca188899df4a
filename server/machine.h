/* What the machine gives: time, and the memory and processors that it, or the container, lets this process
 * have. */
#ifndef SRV_MACHINE_H
#define SRV_MACHINE_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

/* Time that no setting of the clock moves. srv_now_ms is cheaper, and behind by a tick of the kernel at most,
 * which is some milliseconds. */
uint64_t srv_now_ns(void);
uint64_t srv_now_ms(void);

/* Unix time. */
uint64_t srv_unix_ns(void);

/* A condition whose waits end at a time of srv_now_ns, at the latest. */
void srv_timed_init(pthread_cond_t *condition);
void srv_timed_wait(pthread_cond_t *condition, pthread_mutex_t *lock, uint64_t end_ns);
/* Joins a thread that ends within a second; false where it does not. */
bool srv_join_soon(pthread_t thread);

/* The least memory limit of the cgroups that this process is in (versions 1 and 2), in bytes; UINT64_MAX
 * without one. root: of the file system, "" but for tests. */
uint64_t srv_machine_memory_limit(const char *root);

/* How many processors this process may use: those of its affinity, or fewer where the quota of its cgroups
 * (versions 1 and 2) is less, rounded up. root as above. */
uint64_t srv_machine_cpus(const char *root);

/* Before the first thread: all threads share one arena of glibc's. It trims the free memory at the end of
 * that one alone, and of the others keeps up to 64 MiB each. */
void srv_machine_share_arena(void);

/* Gives pages that the allocator keeps free back to the system: glibc keeps what lies below a block in use
 * for ever. Takes milliseconds where much is free. */
void srv_machine_trim(void);

#endif
