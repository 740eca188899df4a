/* Arrays of tw_alloc that grow. */
#ifndef TWEEND_ARRAY_H
#define TWEEND_ARRAY_H

#include "tweend/base.h"

/* Makes room for one more element behind the first `count`, by doubling. *room: the elements that fit, 0 for
 * an array that is NULL. Returns the array, which may have moved; NULL without memory, and it is what it was.
 */
static inline void *tw_array_grow(void *items, size_t count, size_t size, size_t *room) {
  if (count < *room) return items;
  size_t wider = *room > 0 ? 2 * *room : 32;
  void *grown = wider <= SIZE_MAX / 2 / size ? tw_resize(items, wider * size) : NULL;
  if (grown) *room = wider;
  return grown;
}

#endif
