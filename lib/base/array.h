/* Arrays of tw_alloc that grow. */
#ifndef TWEEND_ARRAY_H
#define TWEEND_ARRAY_H

#include <string.h>

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

/* A list of items of `size` bytes. What it lacked memory for is known at its end. */
typedef struct tw_list {
  char *items; /* for tw_free */
  size_t count, room, size;
  bool failed;
} tw_list;

/* Copies an item to the list's end. */
static inline void tw_list_push(tw_list *list, const void *item) {
  char *items = tw_array_grow(list->items, list->count, list->size, &list->room);
  if (!items) {
    list->failed = true;
    return;
  }
  list->items = items;
  memcpy(items + list->size * list->count++, item, list->size);
}

/* Moves the list into the arena; the list is empty afterwards. NULL when the list or the copy had no memory.
 */
static inline void *tw_list_move(tw_list *list, tw_arena *arena) {
  void *out = list->failed ? NULL : tw_arena_alloc_raw(arena, list->count, list->size);
  if (out && list->count > 0) memcpy(out, list->items, list->count * list->size);
  tw_free(list->items);
  *list = (tw_list){.size = list->size};
  return out;
}

#endif
