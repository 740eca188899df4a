/* The parameters that all routes with clips take: read, and printed for keys. */
#include "clip_terms.h"

#include "json_value.h"
#include "names_in.h"
#include "node_names.h"

#include <string.h>

const api_rule api_clip_term_rules[] = {{.name = "retarget"},
                                        {.name = "map"},
                                        {.name = "feet"},
                                        {.name = "root_motion"},
                                        {.name = "root_axes"},
                                        {.name = "in_place"},
                                        {0}};

/* ---- carrying over ---------------------------------------------------------------------------- */

/* Reads the map of the query. Its errors name the parameter, in front of the place in it. */
static tw_status read_map(api_call *call, const char *text, tw_retarget_wish *out) {
  enum { VALUES_MAX = 4096 };
  tw_error error = {0};
  api_json json = {call->arena, &error, NULL};
  api_value root;
  tw_status status = api_json_open(&json, text, strlen(text), VALUES_MAX, &root);
  if (status == TW_OK) status = api_bone_map_read(out, &root);
  api_json_close(&root);
  if (status == TW_OK) return TW_OK;
  return tw_fail(&call->fault.error, status == TW_NO_MEMORY ? status : TW_SYNTAX, "map: %s%s%s",
                 error.pointer, error.pointer[0] ? ": " : "", error.detail);
}

static tw_status read_feet(const char *feet, bool names_feet, tw_retarget_wish *out, tw_error *error) {
  out->holds_feet = feet && strcmp(feet, "hold") == 0 && (out->is_auto || !names_feet);
  if (!feet || out->holds_feet || names_feet) return TW_OK;
  return tw_fail(error, TW_SYNTAX, "feet=%.60s: expected hold", feet);
}

static api_outcome read_retarget(api_call *call, bool names_feet, tw_retarget_wish *out) {
  static const char *const ways[] = {"none", "auto", NULL};
  int way = 0;
  *out = (tw_retarget_wish){0};
  tw_status status = api_query_choice(&call->query, "retarget", ways, &way, &call->fault.error);
  const char *map = api_query_get(&call->query, "map");
  if (status == TW_OK && map) status = read_map(call, map, out);
  out->is_auto = way == 1;
  const char *feet = api_query_get(&call->query, "feet");
  if (status == TW_OK) status = read_feet(feet, names_feet, out, &call->fault.error);
  return api_outcome_of(call, status);
}

api_outcome api_clip_terms_check(api_call *call, const api_clip_terms *terms) {
  const tw_retarget_wish *retarget = &terms->retarget;
  if (retarget->is_auto || (!retarget->has_map && !retarget->holds_feet)) return API_DONE;
  return api_fail_with(call, 400, "%s goes with retarget=auto", retarget->has_map ? "map" : "feet=hold");
}

static void print_retarget(const tw_retarget_wish *retarget, tw_text *text) {
  if (!retarget->is_auto) return;
  tw_text_add(text, retarget->holds_feet ? "&feet=hold&retarget=[" : "&retarget=[");
  for (uint32_t i = 0; i < retarget->pair_count; i++) {
    tw_text_element(text);
    tw_text_string(text, retarget->pairs[i].source);
    tw_text_add(text, ":");
    tw_text_string(text, retarget->pairs[i].target);
  }
  tw_text_add(text, "]");
}

/* ---- root motion ----------------------------------------------------------------------------- */

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

static api_outcome read_root(api_call *call, api_root *out) {
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

api_outcome api_clip_terms_find_root(api_call *call, const tw_model *model, api_clip_terms *terms) {
  api_root *root = &terms->root;
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

static void print_root(const api_root *root, tw_text *text) {
  if (!root->is_on) return;
  tw_text_add(text, root->in_place ? "&in_place=" : root->is_carried ? "&root_carried=" : "&root=");
  tw_text_count(text, (uint64_t)root->node + 1);
  tw_text_add(text, "/");
  api_root_axes_print(root->axes, text);
}

/* ---- both ------------------------------------------------------------------------------------ */

api_outcome api_clip_terms_read(api_call *call, bool names_feet, api_clip_terms *out) {
  api_outcome outcome = read_retarget(call, names_feet, &out->retarget);
  return outcome == API_DONE ? read_root(call, &out->root) : outcome;
}

void api_clip_terms_print(const api_clip_terms *terms, tw_text *text) {
  print_retarget(&terms->retarget, text);
  print_root(&terms->root, text);
}
