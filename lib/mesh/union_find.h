/* Disjoint sets of indices (union-find): every item has a parent in its set, the least item of a set is its
 * own. */
#ifndef TWEEND_UNION_FIND_H
#define TWEEND_UNION_FIND_H

#include <stdbool.h>
#include <stdint.h>

/* Every item a set of its own. */
static inline void tw_union_find_init(uint32_t *forest, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) forest[i] = i;
}

/* The least item of the set; the path to it is halved on the way. */
static inline uint32_t tw_union_find_root(uint32_t *forest, uint32_t item) {
  while (forest[item] != item) {
    forest[item] = forest[forest[item]];
    item = forest[item];
  }
  return item;
}

/* False when they are of one set already. */
static inline bool tw_union_find_join(uint32_t *forest, uint32_t a, uint32_t b) {
  a = tw_union_find_root(forest, a);
  b = tw_union_find_root(forest, b);
  if (a < b)
    forest[b] = a;
  else
    forest[a] = b;
  return a != b;
}

#endif
