#include "node_names.h"

#include <string.h>

void api_node_name_member(tw_text *text, const char *name, const tw_model *model, uint32_t node) {
  char buffer[24];
  tw_member_string(text, name, node == TW_NO_INDEX ? NULL : tw_model_node_name(model, node, buffer));
}

void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text) {
  char buffer[24];
  tw_text_add(text, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(text);
    tw_text_string(text, tw_model_node_name(model, nodes ? nodes[i] : i, buffer));
  }
  tw_text_add(text, "]");
}

api_near_sentence api_node_names_near(const tw_model *model, const char *name, size_t length) {
  char buffer[24];
  api_near near = {.name = name, .length = length};
  for (uint32_t i = 0; i < model->node_count; i++)
    api_near_consider(&near, tw_model_node_name(model, i, buffer));
  return api_near_print(&near, "; ");
}

uint32_t *api_nodes_by_name(const tw_model *from, const tw_model *to, tw_arena *arena) {
  uint32_t *map = tw_arena_alloc_raw(arena, from->node_count, sizeof *map);
  char buffer[24];
  for (uint32_t i = 0; map && from == to && i < from->node_count; i++) map[i] = i;
  if (from == to) return map;
  for (uint32_t i = 0; map && i < from->node_count; i++) {
    if (from->nodes[i].name) continue;
    const char *name = tw_model_node_name(from, i, buffer);
    map[i] = tw_model_find_node(to, name, strlen(name));
  }
  for (uint32_t first = 0, end; map && first < from->named_node_count; first = end) {
    const uint32_t *own, *others;
    uint32_t count = tw_model_namesakes(from, from->named_nodes[first], &own), other_count = 0;
    const char *name = from->nodes[own[0]].name;
    uint32_t node = tw_model_find_node(to, name, strlen(name));
    if (node != TW_NO_INDEX) other_count = tw_model_namesakes(to, node, &others);
    for (uint32_t k = 0; k < count; k++) map[own[k]] = k < other_count ? others[k] : node;
    end = first + count;
  }
  return map;
}
