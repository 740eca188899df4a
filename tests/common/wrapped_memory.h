/* Allocations that fail when a test says so, and how much is held. For programs that are linked with malloc,
 * calloc, realloc and free wrapped (the linker's --wrap): libraries that are linked already are not reached.
 */
#ifndef WRAPPED_MEMORY_H
#define WRAPPED_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of one thread. */
typedef struct wrapped_memory {
  size_t left;    /* allocations until one fails; SIZE_MAX: none does, as after one has failed */
  bool is_spared; /* none fails for now, nor counts */
  size_t asked;   /* bytes asked for so far */
  size_t held;    /* bytes allocated less bytes freed; wraps where others free what this one allocated */
} wrapped_memory;

extern _Thread_local wrapped_memory test_memory;

/* Whether the allocation that is asked for now is the one that fails. */
bool test_memory_fails(size_t size);

#endif
