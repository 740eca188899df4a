/* Files that are read through mappings, whose pages count as resident memory of this process although the
 * kernel could take them back at any time. */
#ifndef SRV_MAPPED_H
#define SRV_MAPPED_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A value; a zeroed one is no mapping. */
typedef struct srv_mapping {
  void *start;
  size_t size;
  struct srv_mapping *next, **link;
} srv_mapping;

/* While there are mappings, a thread looks how much memory the process has resident, and unmaps their pages
 * when it is over resident_max: who reads on finds them in the system's cache of files. */
typedef struct srv_mapped {
  uint64_t resident_max;
  pthread_t thread;     /* valid with is_started */
  pthread_mutex_t lock; /* guards the members below */
  pthread_cond_t wake;
  srv_mapping *first;
  uint64_t dropped; /* how many times pages were unmapped */
  bool is_started, is_closing;
} srv_mapped;

/* resident_max: bytes. */
void srv_mapped_init(srv_mapped *mapped, uint64_t resident_max);
/* Once all mappings are removed. */
void srv_mapped_deinit(srv_mapped *mapped);

/* Maps the first `size` bytes of a file for reading; size > 0. The mapping stays where it is until it is
 * removed. mapped: NULL to map without a limit. NULL and errno on failure. */
const void *srv_mapped_add(srv_mapped *mapped, srv_mapping *mapping, int file, size_t size);
/* A zeroed mapping is left alone. */
void srv_mapped_remove(srv_mapped *mapped, srv_mapping *mapping);

#endif
