/* What the machine, or the container, lets this process have. */
#ifndef SRV_MACHINE_H
#define SRV_MACHINE_H

#include <stdint.h>

/* The least memory limit of the cgroups that this process is in (versions 1 and 2), in bytes; UINT64_MAX
 * without one. root: of the file system, "" but for tests. */
uint64_t srv_machine_memory_limit(const char *root);

/* Gives pages that the allocator keeps free back to the system: glibc keeps what lies below a block in use,
 * in every thread's arena, for ever. Takes milliseconds where much is free. */
void srv_machine_trim(void);

#endif
