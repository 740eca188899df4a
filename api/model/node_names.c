#include "node_names.h"

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
