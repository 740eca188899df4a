/* Disjoint sets of indices (union-find): every item has a parent in its set, the least item of a set is its
 * own. */
#ifndef TWEEND_UNION_FIND_H
#define TWEEND_UNION_FIND_H

#include <stdbool.h>
#include <stdint.h>

/* Every item a set of its own. */
static inline void tw_union_find_init(uint32_t *sets, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) sets[i] = i;
}

/* The least item of the set; the path to it is halved on the way. */
static inline uint32_t tw_union_find_root(uint32_t *sets, uint32_t item) {
  while (sets[item] != item) {
    sets[item] = sets[sets[item]];
    item = sets[item];
  }
  return item;
}

/* False when they are of one set already. */
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
