/* Reads which motion is taken out of clips. */
#include "root_request.h"

#include "node_names.h"

#include <string.h>

static const char *const axis_names[] = {"x", "y", "z", "yaw", NULL};

/* Reads a list of axes, each once. */
static tw_status read_axes(const char *text, unsigned *out, tw_error *error) {
  *out = 0;
  for (;;) {
    size_t length = strcspn(text, ",");
    unsigned axis = 0;
    while (axis_names[axis] &&
           (strlen(axis_names[axis]) != length || strncmp(axis_names[axis], text, length) != 0))
      axis++;
    if (!axis_names[axis])
      return tw_fail(error, TW_SYNTAX, "root_axes: \"%.*s\" is none of x, y, z and yaw",
                     length < 60 ? (int)length : 60, text);
    if (*out & 1u << axis) return tw_fail(error, TW_SYNTAX, "root_axes has %s twice", axis_names[axis]);
    *out |= 1u << axis;
    if (text[length] == '\0') return TW_OK;
    text += length + 1;
  }
}

api_outcome api_root_read(api_call *call, api_root *out) {
  const api_query *query = &call->query;
  const char *node = api_query_get(query, "root_motion"), *axes = api_query_get(query, "root_axes");
  *out = (api_root){.node = TW_NO_INDEX};
  if (api_query_flag(query, "in_place", &out->in_place, &call->fault.error) != TW_OK) return api_fail(call);
  out->is_on = node || out->in_place;
  if (node && strcmp(node, "auto") != 0) out->name = node;
  if (!out->is_on)
    return axes ? api_fail_with(call, 400, "root_axes goes with root_motion or in_place=true") : API_DONE;
  if (read_axes(axes ? axes : "x,z,yaw", &out->axes, &call->fault.error) != TW_OK) return api_fail(call);
  return API_DONE;
}

api_outcome api_root_find(api_call *call, const tw_model *model, api_root *root) {
  if (!root->name) return API_DONE;
  root->node = tw_model_find_node(model, root->name, strlen(root->name));
  if (root->node != TW_NO_INDEX) return API_DONE;
  return api_fail_with(call, 404, "root_motion: no node is called \"%.60s\"%s", root->name,
                       api_node_names_near(model, root->name, strlen(root->name)).text);
}

void api_root_axes_print(unsigned axes, tw_text *text) {
  bool has_one = false;
  for (unsigned axis = 0; axis_names[axis]; axis++) {
    if (!(axes & 1u << axis)) continue;
    if (has_one) tw_text_add(text, ",");
    tw_text_add(text, axis_names[axis]);
    has_one = true;
  }
}

void api_root_print(const api_root *root, tw_text *text) {
  if (!root->is_on) return;
  tw_text_add(text, root->in_place ? "&in_place=" : root->is_carried ? "&root_carried=" : "&root=");
  tw_text_count(text, (uint64_t)root->node + 1);
  tw_text_add(text, "/");
  api_root_axes_print(root->axes, text);
}
