/* Which clips a query names, and how they come to the model: read, found, and printed for keys. */
#include "clip_choice.h"

#include "clips_in.h"
#include "json_value.h"
#include "models.h"
#include "names_in.h"
#include "near_names.h"
#include "node_names.h"
#include "stored.h"

#include <stdio.h>
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

/* Fails with 400 for a map or feet=hold without retarget=auto. */
static api_outcome check_retarget(api_call *call, const tw_retarget_wish *retarget) {
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

/* Finds the node that root_motion names. 404. */
static api_outcome find_root(api_call *call, const tw_model *model, api_root *root) {
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

api_outcome api_clip_terms_read(api_call *call, bool names_feet, api_clip_terms *out) {
  api_outcome outcome = read_retarget(call, names_feet, &out->retarget);
  return outcome == API_DONE ? read_root(call, &out->root) : outcome;
}

/* ---- a clip by its name --------------------------------------------------------------------- */

/* What a name may mean that begins as `{model id}/{name}` does, and is none. */
static const char *hint_of(const char *name, size_t length) {
  enum { ID = API_ID_TEXT - 1 };
  bool begins = strspn(name, "0123456789abcdefABCDEF") == ID && (length == ID || name[ID] == '/');
  return begins ? " a clip of another model is {model id}/{name}, the id in lower case;" : "";
}

/* Fails with 404: the model has no clip of that name, but others. lender: the model's id where it is not that
 * of the request, else NULL. */
static api_outcome fail_absent(api_call *call, const tw_model *model, const char *lender, const char *name,
                               size_t length) {
  char buffer[24];
  api_near near = {.name = name, .length = length};
  for (uint32_t i = 0; i < model->clip_count; i++)
    api_near_consider(&near, tw_model_clip_name(model, i, buffer));
  char list[160] = "";
  size_t used = 0;
  for (uint32_t i = 0; i < model->clip_count; i++) {
    int more = snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                        tw_model_clip_name(model, i, buffer));
    if (more < 0 || (size_t)more >= sizeof list - used) break;
    used += (size_t)more;
  }
  list[used] = '\0';
  return api_fail_with(call, 404, "no clip%s%s is called \"%.*s\";%s%s %s%s", lender ? " of model " : "",
                       lender ? lender : "", length < 60 ? (int)length : 60, name, hint_of(name, length),
                       api_near_print(&near, " ").text,
                       model->clip_count ? "there are: " : "the model has no clips", list);
}

api_outcome api_clip_find_borrowed(api_call *call, const char *name, size_t length, api_borrowed *out) {
  *out = (api_borrowed){0};
  memcpy(out->lender, name, API_ID_TEXT - 1);
  name += API_ID_TEXT;
  length -= API_ID_TEXT;
  api_outcome outcome = api_model_look(call, out->lender);
  if (outcome == API_CONTINUE) outcome = api_model_take(call, out->lender, NULL, &out->entry);
  if (outcome != API_DONE) return outcome;
  const tw_model *lender = api_entry_value(out->entry);
  out->index = tw_model_find_clip(lender, name, length);
  if (out->index != TW_NO_INDEX) return API_DONE;
  fail_absent(call, lender, out->lender, name, length);
  return API_CONTINUE;
}

/* ---- choosing -------------------------------------------------------------------------------- */

enum {
  COMMAS_IN_A_NAME = 8,
  CLIPS_IN_A_LIST = 256,
  COMPARISONS_MOST = 1 << 18 /* comparisons of names in a light call */
};

/* Finds a clip of another stored model. */
static api_outcome find_borrowed(api_call *call, const char *name, size_t length, api_clip_choice *out) {
  api_borrowed borrowed;
  api_outcome outcome = api_clip_find_borrowed(call, name, length, &borrowed);
  memcpy(out->lender, borrowed.lender, sizeof out->lender);
  out->index = borrowed.index;
  api_entry_release(borrowed.entry);
  return outcome;
}

/* Finds the clip of a name, own or borrowed. API_CONTINUE: there is none, as the fault says. */
static api_outcome find_named(api_call *call, const tw_model *model, const char *name, size_t length,
                              api_clip_choice *out) {
  *out = (api_clip_choice){.index = tw_model_find_clip(model, name, length)};
  if (out->index != TW_NO_INDEX) return API_DONE;
  if (api_clip_is_borrowed(name, length)) return find_borrowed(call, name, length, out);
  fail_absent(call, model, NULL, name, length);
  return API_CONTINUE;
}

/* Finds the clip that the list begins with, and the length of its name. A name may itself contain commas: the
 * shortest name that exists counts. */
static api_outcome find_first(api_call *call, const tw_model *model, const char *list, size_t *length,
                              api_clip_choice *out) {
  api_fault first; /* about the name up to the first comma */
  size_t end = strcspn(list, ",");
  for (int commas = 0;; commas++) {
    *length = end;
    api_outcome outcome = find_named(call, model, list, end, out);
    if (outcome != API_CONTINUE) return outcome;
    if (commas == 0) first = call->fault;
    if (list[end] == '\0' || commas == COMMAS_IN_A_NAME) break;
    end += 1 + strcspn(list + end + 1, ",");
  }
  call->fault = first;
  return API_FAILED;
}

static bool is_among(const api_clip_choice *choice, const api_clip_choice *list, uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    if (list[i].index == choice->index && strcmp(list[i].lender, choice->lender) == 0) return true;
  return false;
}

static api_outcome find_listed(api_call *call, const tw_model *model, const char *text,
                               api_clip_choices *out) {
  uint64_t names = 1;
  for (const char *c = text; *c; c++) names += *c == ',';
  if (call->effort != API_HEAVY && names * model->clip_count > COMPARISONS_MOST) return API_NEEDS_THREAD;
  if (names > CLIPS_IN_A_LIST)
    return api_fail_with(call, 400, "clip: more than %d names are in the list", CLIPS_IN_A_LIST);
  api_clip_choice *list = tw_arena_alloc(call->arena, (size_t)names, sizeof *list);
  if (!list) return api_fail_without_memory(call);
  *out = (api_clip_choices){.list = list};
  for (;;) {
    size_t length;
    api_outcome outcome = find_first(call, model, text, &length, &list[out->count]);
    if (outcome != API_DONE) return outcome;
    if (is_among(&list[out->count], list, out->count))
      return api_fail_with(call, 400, "clip: \"%.*s\" is in the list twice", length < 60 ? (int)length : 60,
                           text);
    out->count++;
    if (text[length] == '\0') return API_DONE;
    text += length + 1;
  }
}

/* Finds the one clip that the whole text names, or none, or several. */
static api_outcome find_chosen(api_call *call, const tw_model *model, const char *text,
                               api_clip_choices *out) {
  api_clip_choice *whole = tw_arena_alloc(call->arena, 1, sizeof *whole);
  if (!whole) return api_fail_without_memory(call);
  api_outcome outcome = find_named(call, model, text, strlen(text), whole);
  *out = (api_clip_choices){.count = 1, .list = whole};
  if (outcome != API_CONTINUE) return outcome;
  if (strcmp(text, "none") != 0) return find_listed(call, model, text, out);
  *out = (api_clip_choices){0};
  return API_DONE;
}

/* Turns a list of the model's own first clips, in order, into the form without a list, so that equal choices
 * print equally. */
static void normalise_choices(api_clip_choices *choices) {
  uint32_t i = 0;
  while (i < choices->count && choices->list[i].index == i && !choices->list[i].lender[0]) i++;
  if (i == choices->count) choices->list = NULL;
}

static bool has_borrowed(const api_clip_choices *choices) {
  for (uint32_t i = 0; choices->list && i < choices->count; i++)
    if (choices->list[i].lender[0]) return true;
  return false;
}

api_outcome api_clips_choose(api_call *call, const tw_model *model, const char *text, uint32_t otherwise,
                             const api_clip_terms *terms, api_clip_choices *out) {
  static const char *const own =
      "retarget=auto, and what goes with it, does nothing: no clip of another model "
      "is asked for, as {model id}/{name}";
  api_outcome outcome = check_retarget(call, &terms->retarget);
  if (outcome != API_DONE) return outcome;
  if (text) {
    outcome = find_chosen(call, model, text, out);
    if (outcome != API_DONE) return outcome;
    call->fault = (api_fault){0}; /* drops the faults of names that were only tried */
    if (out->list) normalise_choices(out);
  } else {
    *out = (api_clip_choices){.count = otherwise < model->clip_count ? otherwise : model->clip_count};
  }
  out->terms = *terms;
  if (terms->retarget.is_auto && !has_borrowed(out)) api_call_warn(call, &own, 1);
  return find_root(call, model, &out->terms.root);
}

api_clip_choice api_clips_get(const api_clip_choices *choices, uint32_t i) {
  return choices->list ? choices->list[i] : (api_clip_choice){.index = i};
}

void api_clips_print(const api_clip_choices *choices, tw_text *text) {
  if (!choices->list) tw_text_count(text, choices->count);
  for (uint32_t i = 0; choices->list && i < choices->count; i++) {
    tw_text_add(text, choices->list[i].lender);
    tw_text_add(text, "/");
    tw_text_count(text, choices->list[i].index);
    tw_text_add(text, ",");
  }
  print_retarget(&choices->terms.retarget, text);
  print_root(&choices->terms.root, text);
}
