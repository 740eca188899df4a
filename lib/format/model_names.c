/* The names of nodes and clips that clients see, and what has them. */
#include <stdio.h>
#include <string.h>

#include "model_checks.h"
#include "tweend/base.h"

const char *tw_model_node_name(const tw_model *model, uint32_t node, char buffer[24]) {
  if (model->nodes[node].name) return model->nodes[node].name;
  snprintf(buffer, 24, "node_%u", node);
  return buffer;
}

const char *tw_model_clip_name(const tw_model *model, uint32_t clip, char buffer[24]) {
  if (model->clips[clip].name) return model->clips[clip].name;
  snprintf(buffer, 24, "clip_%u", clip);
  return buffer;
}

typedef struct named_node {
  const char *name;
  uint32_t index;
} named_node;

static int compare_named_nodes(const void *a, const void *b) {
  const named_node *left = a, *right = b;
  int order = strcmp(left->name, right->name);
  if (order != 0) return order;
  return left->index < right->index ? -1 : left->index > right->index;
}

/* Sorts the named nodes for binary search: a model may have many nodes, and requests may ask for many. */
tw_status tw_model_sort_names(tw_model *model, tw_error *error) {
  uint32_t count = 0, next = 0;
  for (uint32_t i = 0; i < model->node_count; i++) count += model->nodes[i].name != NULL;
  named_node *sorted = tw_alloc(count, sizeof *sorted);
  uint32_t *nodes = tw_arena_alloc(model->arena, count, sizeof *nodes);
  if (!sorted || !nodes) {
    tw_free(sorted);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  for (uint32_t i = 0; i < model->node_count; i++)
    if (model->nodes[i].name) sorted[next++] = (named_node){model->nodes[i].name, i};
  tw_status status = tw_sort(sorted, count, sizeof *sorted, compare_named_nodes);
  for (uint32_t i = 0; status == TW_OK && i < count; i++) nodes[i] = sorted[i].index;
  tw_free(sorted);
  if (status != TW_OK) return tw_fail(error, status, "the names of the nodes cannot be sorted");
  model->named_node_count = count;
  model->named_nodes = nodes;
  return TW_OK;
}

/* Compares a name with text[0..length) as strcmp does. */
static int compare_text(const char *name, const char *text, size_t length) {
  int order = strncmp(name, text, length);
  return order != 0 ? order : name[strnlen(name, length)] != '\0';
}

/* The index in a generated name, such as "node_3" for kind "node_"; TW_NO_INDEX if the text is no such
 * name. */
static uint32_t made_up_index(const char *kind, const char *text, size_t length, uint32_t count) {
  char buffer[24];
  size_t start = strlen(kind);
  uint64_t index = 0;
  if (length <= start || length >= sizeof buffer || memcmp(text, kind, start) != 0) return TW_NO_INDEX;
  for (size_t i = start; i < length && index < count; i++) index = 10 * index + (uint64_t)(text[i] - '0');
  if (index >= count) return TW_NO_INDEX;
  size_t printed = (size_t)snprintf(buffer, sizeof buffer, "%s%u", kind, (uint32_t)index);
  return printed == length && memcmp(buffer, text, length) == 0 ? (uint32_t)index : TW_NO_INDEX;
}

/* The place in named_nodes of the first name that is not less than name[0..length). */
static uint32_t lower_bound(const tw_model *model, const char *name, size_t length) {
  uint32_t low = 0, high = model->named_node_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (compare_text(model->nodes[model->named_nodes[middle]].name, name, length) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

uint32_t tw_model_namesakes(const tw_model *model, uint32_t node, const uint32_t **out) {
  const char *name = model->nodes[node].name;
  uint32_t first = name ? lower_bound(model, name, strlen(name)) : 0, end = first;
  while (name && end < model->named_node_count && !strcmp(model->nodes[model->named_nodes[end]].name, name))
    end++;
  *out = model->named_nodes + first;
  return end - first;
}

uint32_t tw_model_find_node(const tw_model *model, const char *name, size_t length) {
  uint32_t low = lower_bound(model, name, length);
  uint32_t named = low < model->named_node_count ? model->named_nodes[low] : TW_NO_INDEX;
  if (named != TW_NO_INDEX && compare_text(model->nodes[named].name, name, length) != 0) named = TW_NO_INDEX;
  uint32_t nameless = made_up_index("node_", name, length, model->node_count);
  if (nameless != TW_NO_INDEX && model->nodes[nameless].name) nameless = TW_NO_INDEX;
  return named < nameless ? named : nameless;
}

uint32_t tw_model_find_clip(const tw_model *model, const char *name, size_t length) {
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].name && compare_text(model->clips[i].name, name, length) == 0) return i;
  return made_up_index("clip_", name, length, model->clip_count);
}
