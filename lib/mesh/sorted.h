/* Sorting arrays that are usually short, and searching sorted arrays. */
#ifndef TWEEND_SORTED_H
#define TWEEND_SORTED_H

#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Sorts as qsort does, but faster for a few items that are nearly in order: inlined for each size and order.
 * size: at most 64. */
static inline __attribute__((always_inline)) void tw_small_sort(void *items, uint32_t count, size_t size,
                                                                int (*compare)(const void *, const void *)) {
  enum { FEW = 16, SIZE_MOST = 64 };
  unsigned char *first = items, item[SIZE_MOST];
  assert(size <= SIZE_MOST);
  if (count > FEW) {
    qsort(items, count, size, compare);
    return;
  }
  for (uint32_t i = 1; i < count; i++) {
    unsigned char *at = first + i * size;
    memcpy(item, at, size);
    for (; at > first && compare(item, at - size) < 0; at -= size) memcpy(at, at - size, size);
    memcpy(at, item, size);
  }
}

static inline int tw_compare_uint32(const void *left, const void *right) {
  uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return a < b ? -1 : a > b;
}

/* The index of the first of `count` ascending numbers that is at least `least`; count where there is none. */
static inline uint32_t tw_lower_bound(const uint32_t *numbers, uint32_t count, uint32_t least) {
  uint32_t begin = 0, end = count;
  while (begin < end) {
    uint32_t middle = begin + (end - begin) / 2;
    if (numbers[middle] < least)
      begin = middle + 1;
    else
      end = middle;
  }
  return begin;
}

/* The run that contains an index. offsets: [count + 1] starts of runs, the first one 0. */
static inline uint32_t tw_run_of(const uint32_t *offsets, uint32_t count, uint32_t place) {
  return tw_lower_bound(offsets + 1, count, place + 1);
}

#endif
