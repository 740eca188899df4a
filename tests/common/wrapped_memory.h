/* Makes allocations fail when a test asks for it, and counts the memory in use. For programs linked with
 * malloc, calloc, realloc and free wrapped (the linker's --wrap); shared libraries are not affected. */
#ifndef WRAPPED_MEMORY_H
#define WRAPPED_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The state of one thread. */
typedef struct wrapped_memory {
  size_t left;    /* allocations that succeed before one fails; SIZE_MAX: none fails, as after the failure */
  bool is_spared; /* true: none fails, and none is counted in `left` */
  size_t asked;   /* bytes asked for so far */
  size_t held;    /* bytes allocated minus bytes freed; wraps when other threads free this one's memory */
  size_t most;    /* the greatest `held` since a test set it */
} wrapped_memory;

extern _Thread_local wrapped_memory test_memory;

/* Counts an allocation; whether it must fail. */
bool test_memory_fails(size_t size);

#endif
