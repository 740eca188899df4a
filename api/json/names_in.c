/* The names of a document's elements: gathered, and found again. */
#include "names_in.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "near_names.h"
#include "tweend/model.h"

static int compare_names(const void *a, const void *b) {
  const api_names_entry *left = a, *right = b;
  int order = strcmp(left->text, right->text);
  if (order != 0) return order;
  return left->index < right->index ? -1 : left->index > right->index;
}

/* Any other mistake in the element is reported by the element's own reader. */
static tw_status collect_name(void *context, const api_value *object) {
  api_names *out = context;
  const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object->item, "name"));
  if (!text || !text[0]) return TW_OK;
  const char *copy = tw_arena_text(out->arena, text, strlen(text));
  if (!copy) return api_json_no_memory(object->json);
  out->texts[object->at.index] = copy;
  out->sorted_count++;
  return TW_OK;
}

tw_status api_names_read(const api_value *array, uint32_t count, const char *kind, tw_arena *arena,
                         api_names *out) {
  *out = (api_names){.kind = kind, .arena = arena, .count = count};
  out->texts = tw_arena_alloc(arena, count, sizeof *out->texts);
  if (!out->texts) return api_json_no_memory(array->json);
  tw_status status = api_json_each(array, collect_name, out);
  if (status != TW_OK) return status;
  out->sorted = tw_arena_alloc(arena, out->sorted_count, sizeof *out->sorted);
  if (!out->sorted) return api_json_no_memory(array->json);
  uint32_t next = 0;
  for (uint32_t i = 0; i < count; i++)
    if (out->texts[i]) out->sorted[next++] = (api_names_entry){out->texts[i], i};
  if (next > 0) qsort(out->sorted, next, sizeof *out->sorted, compare_names);
  return TW_OK;
}

/* The element that is called kind_index by its place; TW_NO_INDEX for none. */
static uint32_t find_place(const api_names *all, const char *text) {
  char made_up[32];
  size_t length = strlen(all->kind);
  if (strncmp(text, all->kind, length) != 0 || text[length] != '_') return TW_NO_INDEX;
  unsigned long index = strtoul(text + length + 1, NULL, 10);
  if (index >= all->count || (all->texts[index] && !all->has_places)) return TW_NO_INDEX;
  snprintf(made_up, sizeof made_up, "%s_%lu", all->kind, index);
  return strcmp(made_up, text) == 0 ? (uint32_t)index : TW_NO_INDEX;
}

static tw_status fail_absent(const api_value *value, const api_names *all, const char *text) {
  api_near near = {.name = text, .length = strlen(text)};
  for (uint32_t i = 0; i < all->sorted_count; i++) api_near_consider(&near, all->sorted[i].text);
  return api_json_fail(value, TW_INVALID, "no %s is called \"%.60s\"%s", all->kind, text,
                       api_near_print(&near, "; ").text);
}

/* Tells of a name that several elements bear. named: the first of these, but one without a name. */
static tw_status fail_ambiguous(const api_value *value, const api_names *all, const char *text,
                                const api_names_entry *named) {
  if (!all->has_places)
    return api_json_fail(value, TW_INVALID, "more than one %s is called \"%.60s\"", all->kind, text);
  return api_json_fail(value, TW_INVALID,
                       "more than one %s is called \"%.60s\": %s_%u names the first, %s_%u the second",
                       all->kind, text, all->kind, named[0].index, all->kind, named[1].index);
}

tw_status api_name_find(const api_value *value, const api_names *all, uint32_t *out) {
  if (!value->item) return TW_OK;
  const char *text = cJSON_GetStringValue(value->item);
  if (!text) return api_json_fail(value, TW_SYNTAX, "the name of a %s is expected", all->kind);
  uint32_t low = 0, high = all->sorted_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(all->sorted[middle].text, text) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  uint32_t end = low;
  while (end < all->sorted_count && end < low + 2 && strcmp(all->sorted[end].text, text) == 0) end++;
  bool is_named = end > low;
  uint32_t placed = is_named && all->has_places ? TW_NO_INDEX : find_place(all, text);
  uint32_t found = end - low + (placed != TW_NO_INDEX);
  if (found == 0) return fail_absent(value, all, text);
  if (found > 1) return fail_ambiguous(value, all, text, &all->sorted[low]);
  *out = is_named ? all->sorted[low].index : placed;
  return TW_OK;
}

static int compare_pairs(const void *left, const void *right) {
  return strcmp(((const tw_bone_names_pair *)left)->source, ((const tw_bone_names_pair *)right)->source);
}

/* A JSON object has no order: the pairs have that of their names. */
tw_status api_bone_map_read(void *context, const api_value *object) {
  tw_retarget_wish *out = context;
  const api_json *json = object->json;
  uint32_t count = 0;
  for (const cJSON *child = object->item->child; child; child = child->next) count++;
  if (count > TW_BONE_PAIRS_MAX)
    return api_json_fail(object, TW_LIMIT, "the map has %u pairs of bones, and at most %d are read", count,
                         TW_BONE_PAIRS_MAX);
  tw_bone_names_pair *pairs = tw_arena_alloc(json->arena, count, sizeof *pairs);
  if (!pairs) return api_json_no_memory(json);
  tw_status status = TW_OK;
  const cJSON *child = object->item->child;
  for (uint32_t i = 0; i < count && status == TW_OK; i++, child = child->next) {
    const api_value value = {json, child, {&object->at, child->string, 0}};
    pairs[i].source = tw_arena_text(json->arena, child->string, strlen(child->string));
    if (!pairs[i].source) return api_json_no_memory(json);
    if (!cJSON_IsNull(child)) status = api_json_name(&value, &pairs[i].target);
  }
  if (status == TW_OK) status = tw_sort(pairs, count, sizeof *pairs, compare_pairs);
  if (status == TW_NO_MEMORY) return api_json_no_memory(json);
  out->has_map = true;
  out->pairs = pairs;
  out->pair_count = count;
  return status;
}
