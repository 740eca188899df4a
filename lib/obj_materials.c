/* Material names of an OBJ file, numbered in the order in which faces use them. */
#include "obj_parts.h"

#include <stdlib.h>
#include <string.h>

/* FNV-1a. A file built to collide only slows its own reading, within the limit on its size. */
static uint64_t hash(obj_word name) {
  uint64_t value = 14695981039346656037u;
  for (size_t i = 0; i < name.length; i++) value = (value ^ (uint8_t)name.text[i]) * 1099511628211u;
  return value ^ value >> 32;
}

static bool same(obj_word a, obj_word b) {
  return a.length == b.length && memcmp(a.text, b.text, a.length) == 0;
}

/* The slot that holds `name` or waits for it; slots are a power of two, never full. */
static uint32_t *find_slot(const obj_parts *parts, obj_word name) {
  size_t mask = parts->material_slots.capacity - 1;
  for (size_t at = (size_t)hash(name) & mask;; at = (at + 1) & mask) {
    uint32_t *slot = &parts->material_slots.values[at];
    if (*slot == 0 || same(parts->material_names[*slot - 1], name)) return slot;
  }
}

/* Doubles names and slots, so that at most half the slots are taken. */
static tw_status grow(obj_parts *parts, tw_error *error) {
  size_t capacity = parts->material_capacity ? parts->material_capacity * 2 : 32;
  if (capacity > INT32_MAX) return tw_fail(error, TW_LIMIT, "the file has too many materials");
  obj_word *names = realloc(parts->material_names, capacity * sizeof *names);
  if (names) parts->material_names = names;
  uint32_t *slots = tw_alloc_zero(capacity * 2, sizeof *slots);
  if (!names || !slots) {
    free(slots);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  free(parts->material_slots.values);
  parts->material_slots = (obj_indices){slots, 0, capacity * 2};
  parts->material_capacity = capacity;
  for (size_t i = 0; i < parts->material_count; i++) *find_slot(parts, names[i]) = (uint32_t)i + 1;
  return TW_OK;
}

tw_status obj_use_material(obj_parts *parts, obj_word name, tw_error *error) {
  if (name.length == 0) {
    parts->material = OBJ_NO_MATERIAL;
    return TW_OK;
  }
  if (parts->material_count == parts->material_capacity) {
    tw_status status = grow(parts, error);
    if (status != TW_OK) return status;
  }
  uint32_t *slot = find_slot(parts, name);
  if (*slot == 0) {
    parts->material_names[parts->material_count++] = name;
    *slot = (uint32_t)parts->material_count;
  }
  parts->material = *slot - 1;
  return TW_OK;
}
