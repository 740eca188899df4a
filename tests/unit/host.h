/* What a host lends to work: ways to run the parts of a loop, and questions whether the result is wanted. */
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stdint.h>

static inline void run_in_order(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                                void *context) {
  (void)owner;
  for (uint32_t i = 0; i < count; i++) part(context, i);
}

/* The last part first; adds how many they are to *owner, a uint32_t, or NULL. */
static inline void run_backwards(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                                 void *context) {
  if (owner) *(uint32_t *)owner += count;
  while (count > 0) part(context, --count);
}

/* owner: a uint32_t, how many times more the result is wanted. */
static inline bool wants_no_more(void *owner) {
  uint32_t *left = owner;
  if (*left == 0) return true;
  --*left;
  return false;
}

#endif
