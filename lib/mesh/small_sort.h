/* Sorting what is mostly a handful. */
#ifndef TWEEND_SMALL_SORT_H
#define TWEEND_SMALL_SORT_H

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* As qsort, which takes longer for a few items that are nearly in order: compiled for each size and order. */
static inline __attribute__((always_inline)) void tw_small_sort(void *items, uint32_t count, size_t size,
                                                                int (*compare)(const void *, const void *)) {
  enum { FEW = 16, SIZE_MOST = 64 };
  unsigned char *first = items, item[SIZE_MOST];
  assert(size <= SIZE_MOST);
  if (count > FEW) {
    qsort(items, count, size, compare);
    return;
  }
  for (uint32_t i = 1; i < count; i++)
    for (unsigned char *at = first + i * size; at > first && compare(at, at - size) < 0; at -= size) {
      memcpy(item, at, size);
      memcpy(at, at - size, size);
      memcpy(at - size, item, size);
    }
}

#endif
