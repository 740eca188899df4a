#include "vertex_set.h"

#include <string.h>

/* The sender of a model chooses its rows, and could make them share slots: so the address of the table, which
 * is random, seeds the hash. Places do not depend on it. */
bool tw_vertex_set_init(tw_vertex_set *set) {
  *set = (tw_vertex_set){.rows = tw_alloc(TW_PACK_VERTICES_MAX, sizeof *set->rows),
                         .slots = tw_alloc(1 << TW_VERTEX_SLOT_BITS, sizeof *set->slots)};
  uint64_t mixed = (uint64_t)(uintptr_t)set->slots * 0x9E3779B97F4A7C15u;
  set->multiplier = (uint32_t)(mixed >> 32) | 1;
  return set->rows && set->slots;
}

void tw_vertex_set_deinit(tw_vertex_set *set) {
  tw_free(set->rows);
  tw_free(set->slots);
}

void tw_vertex_set_clear(tw_vertex_set *set) {
  set->count = 0;
  memset(set->slots, 0, sizeof *set->slots << TW_VERTEX_SLOT_BITS);
}

/* The row's place, a new one where it has none yet; TW_NO_INDEX: the pack is full. */
static uint32_t add(tw_vertex_set *set, uint32_t row) {
  uint32_t slot = row * set->multiplier >> (32 - TW_VERTEX_SLOT_BITS);
  while (set->slots[slot] > 0) {
    uint32_t place = set->slots[slot] - 1;
    if (set->rows[place] == row) return place;
    slot = (slot + 1) & ((1u << TW_VERTEX_SLOT_BITS) - 1);
  }
  if (set->count == TW_PACK_VERTICES_MAX) return TW_NO_INDEX;
  set->rows[set->count] = row;
  set->slots[slot] = ++set->count;
  return set->count - 1;
}

bool tw_vertex_set_add_triangle(tw_vertex_set *set, const uint32_t rows[3], uint32_t places[3]) {
  for (int i = 0; i < 3; i++) {
    places[i] = add(set, rows[i]);
    if (places[i] == TW_NO_INDEX) return false;
  }
  return true;
}
