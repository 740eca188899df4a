/* Disjoint sets of indices (union-find): each item stores a parent in its set, and the least item of a set is
 * the root, its own parent. */
#ifndef TWEEND_UNION_FIND_H
#define TWEEND_UNION_FIND_H

#include <stdbool.h>
#include <stdint.h>

/* Makes every item a set of its own. */
static inline void tw_union_find_init(uint32_t *sets, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) sets[i] = i;
}

/* The root, which is the least item of the set. Halves the path on the way. */
static inline uint32_t tw_union_find_root(uint32_t *sets, uint32_t item) {
  while (sets[item] != item) {
    sets[item] = sets[sets[item]];
    item = sets[item];
  }
  return item;
}

/* False when both are in one set already. */
static inline bool tw_union_find_join(uint32_t *sets, uint32_t a, uint32_t b) {
  a = tw_union_find_root(sets, a);
  b = tw_union_find_root(sets, b);
  if (a < b)
    sets[b] = a;
  else
    sets[a] = b;
  return a != b;
}

#endif
