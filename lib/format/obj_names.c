/* Names in an OBJ file, of materials and of sets of groups, numbered in the order of their first use. */
#include "obj_names.h"

#include <stdlib.h>
#include <string.h>

/* FNV-1a over the words, a blank behind each. A file built to collide only slows its own reading, within
 * the limit on its size. */
static uint64_t hash(obj_word name) {
  uint64_t value = 14695981039346656037u;
  obj_text text = obj_text_of(name);
  for (obj_word word = obj_read_word(&text); word.length > 0; word = obj_read_word(&text)) {
    for (size_t i = 0; i < word.length; i++) value = (value ^ (uint8_t)word.text[i]) * 1099511628211u;
    value = (value ^ ' ') * 1099511628211u;
  }
  return value ^ value >> 32;
}

static bool same(obj_word a, obj_word b) {
  obj_text left = obj_text_of(a), right = obj_text_of(b);
  for (;;) {
    a = obj_read_word(&left);
    b = obj_read_word(&right);
    if (a.length != b.length || memcmp(a.text, b.text, a.length) != 0) return false;
    if (a.length == 0) return true;
  }
}

/* The slot that holds `name` or waits for it; slots are a power of two, never full. */
static uint32_t *find_slot(const obj_names *names, obj_word name) {
  size_t mask = 2 * names->capacity - 1;
  for (size_t at = (size_t)hash(name) & mask;; at = (at + 1) & mask) {
    uint32_t *slot = &names->slots[at];
    if (*slot == 0 || same(names->names[*slot - 1], name)) return slot;
  }
}

/* Doubles names and slots, so that at most half the slots are taken. */
static tw_status grow(obj_names *names, tw_error *error) {
  size_t capacity = names->capacity ? names->capacity * 2 : 32;
  if (capacity > INT32_MAX) return tw_fail(error, TW_LIMIT, "the file has too many names");
  obj_word *grown = realloc(names->names, capacity * sizeof *grown);
  if (grown) names->names = grown;
  uint32_t *slots = tw_alloc_zero(capacity * 2, sizeof *slots);
  if (!grown || !slots) {
    free(slots);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  free(names->slots);
  names->slots = slots;
  names->capacity = capacity;
  for (size_t i = 0; i < names->count; i++) *find_slot(names, grown[i]) = (uint32_t)i + 1;
  return TW_OK;
}

tw_status obj_number_name(obj_names *names, obj_word name, uint32_t *out, tw_error *error) {
  if (names->count == names->capacity) {
    tw_status status = grow(names, error);
    if (status != TW_OK) return status;
  }
  uint32_t *slot = find_slot(names, name);
  if (*slot == 0) {
    names->names[names->count++] = name;
    *slot = (uint32_t)names->count;
  }
  *out = *slot - 1;
  return TW_OK;
}

void obj_names_deinit(obj_names *names) {
  free(names->names);
  free(names->slots);
}
