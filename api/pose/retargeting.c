/* Carries borrowed clips over to a model's own skeleton (tweend/retarget.h). */
#include "retargeting.h"

#include "answer.h"
#include "names_in.h"
#include "node_names.h"
#include "tweend/json_print.h"

#include <string.h>

/* ---- parameters ------------------------------------------------------------------------------ */

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

api_outcome api_retarget_read(api_call *call, bool names_feet, tw_retarget_wish *out) {
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

api_outcome api_retarget_check(api_call *call, const tw_retarget_wish *retarget) {
  if (retarget->is_auto || (!retarget->has_map && !retarget->holds_feet)) return API_DONE;
  return api_fail_with(call, 400, "%s goes with retarget=auto", retarget->has_map ? "map" : "feet=hold");
}

void api_retarget_print(const tw_retarget_wish *retarget, tw_text *text) {
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

/* ---- the job --------------------------------------------------------------------------------- */

/* Marks the joints of skins and the bones of the humanoid map. *out stays NULL where the model has neither:
 * then any node is a bone. False without memory. */
static bool mark_bones(const tw_model *model, tw_arena *arena, const bool **out) {
  *out = NULL;
  if (model->skin_count == 0 && !model->humanoid) return true;
  bool *is_bone = tw_arena_alloc(arena, model->node_count, sizeof *is_bone);
  if (!is_bone) return false;
  for (uint32_t i = 0; i < model->skin_count; i++)
    for (uint32_t j = 0; j < model->skins[i].joint_count; j++) is_bone[model->skins[i].joints[j]] = true;
  for (uint32_t i = 0; model->humanoid && i < TW_BONES; i++)
    if (model->humanoid[i] != TW_NO_INDEX) is_bone[model->humanoid[i]] = true;
  *out = is_bone;
  return true;
}

static bool make_skeleton(const tw_model *model, tw_arena *arena, tw_skeleton *out) {
  *out = (tw_skeleton){.nodes = model->nodes,
                       .order = model->node_order,
                       .node_count = model->node_count,
                       .humanoid = model->humanoid};
  return mark_bones(model, arena, &out->is_bone);
}

static bool find_mapped(const tw_model *model, const char *name, const char *whose, uint32_t *out,
                        tw_error *error) {
  *out = tw_model_find_node(model, name, strlen(name));
  if (*out != TW_NO_INDEX) return true;
  tw_fail(error, TW_INVALID, "map: no node of %s is called \"%.60s\"%s", whose, name,
          api_node_names_near(model, name, strlen(name)).text);
  return false;
}

static bool find_pairs(const tw_model *lender, const tw_model *model, const tw_retarget_wish *retarget,
                       tw_bone_pair *out, tw_error *error) {
  for (uint32_t i = 0; i < retarget->pair_count; i++) {
    const tw_bone_names_pair *pair = &retarget->pairs[i];
    out[i].target = TW_NO_INDEX;
    if (!find_mapped(lender, pair->source, "the clip's model", &out[i].source, error)) return false;
    if (pair->target && !find_mapped(model, pair->target, "the model", &out[i].target, error)) return false;
  }
  return true;
}

/* ---- what is told ---------------------------------------------------------------------------- */

static const char *print_report(const tw_model *lender, const tw_model *model, const tw_retargeted *found,
                                tw_arena *arena) {
  tw_text text = {0};
  tw_text_add(&text, "{");
  tw_member_open(&text, "bones", "[");
  for (uint32_t i = 0; i < found->bone_count; i++) {
    const tw_matched_bone *bone = &found->bones[i];
    tw_text_element(&text);
    tw_text_add(&text, "{");
    api_node_name_member(&text, "source", lender, bone->source);
    api_node_name_member(&text, "target", model, bone->target);
    tw_member_string(&text, "by", tw_match_names[bone->by]);
    tw_member_float(&text, "aligned", (float)(bone->aligned * TW_DEGREES));
    tw_text_add(&text, "}");
  }
  tw_text_add(&text, "]");
  tw_member_float(&text, "scale", (float)found->scale);
  tw_text_member(&text, "without_target");
  api_node_names_print(lender, found->without_target, found->without_target_count, &text);
  tw_text_member(&text, "without_source");
  api_node_names_print(model, found->without_source, found->without_source_count, &text);
  tw_text_add(&text, "}");
  return api_text_move(&text, arena);
}

/* Adds a warning. False without memory. */
static bool warn(api_carried *out, tw_text *text, tw_arena *arena) {
  out->warnings[out->warning_count] = api_text_move(text, arena);
  return out->warnings[out->warning_count++] != NULL;
}

/* The first names, and how many more there are. */
static void add_names(tw_text *text, const tw_model *model, const uint32_t *nodes, uint32_t count) {
  enum { NAMES_SHOWN = 4 };
  char buffer[24];
  uint32_t shown = count <= NAMES_SHOWN + 1 ? count : NAMES_SHOWN;
  for (uint32_t i = 0; i < shown; i++) {
    if (i > 0) tw_text_add(text, ", ");
    tw_text_add(text, tw_model_node_name(model, nodes[i], buffer));
  }
  if (shown == count) return;
  tw_text_add(text, " and ");
  tw_text_count(text, count - shown);
  tw_text_add(text, " more, which /tracks names (retarget.without_target)");
}

static bool warn_of_losses(const tw_model *lender, const tw_retargeted *found, bool holds_feet,
                           tw_arena *arena, api_carried *out) {
  bool is_warned = true;
  if (found->without_target_count > 0) {
    tw_text text = {0};
    tw_text_add(&text, "the clip moves bones that have no counterpart in the model: ");
    add_names(&text, lender, found->without_target, found->without_target_count);
    is_warned = warn(out, &text, arena);
  }
  if (found->lost_count > 0) {
    tw_text text = {0};
    tw_text_count(&text, found->lost_count);
    tw_text_add(
        &text,
        tw_plural(
            found->lost_count,
            " translation or scale of a bone is not carried over: the bone rests otherwise in the model",
            " translations and scales of bones are not carried over: the bones rest otherwise in "
            "the model"));
    is_warned = warn(out, &text, arena) && is_warned;
  }
  if (holds_feet && found->held_count == 0) {
    tw_text text = {0};
    tw_text_add(&text, "feet=hold held none: no leg has matched bones down to the foot, or no foot of the "
                       "clip touches the ground");
    is_warned = warn(out, &text, arena) && is_warned;
  }
  return is_warned;
}

bool api_clip_retarget(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                       const tw_retarget_wish *retarget, uint32_t max_keys, tw_arena *arena, api_carried *out,
                       api_fault *fault) {
  static const tw_tolerance tolerance = {0.05 / TW_DEGREES, 1e-4};
  tw_bone_pair *map = tw_arena_alloc(arena, retarget->pair_count, sizeof *map);
  tw_retarget_job job = {.keys = keys,
                         .map_count = retarget->pair_count,
                         .map = map,
                         .tolerance = tolerance,
                         .max_keys = max_keys,
                         .holds_feet = retarget->holds_feet};
  if (!map || !make_skeleton(lender, arena, &job.source) || !make_skeleton(model, arena, &job.target))
    return api_fault_without_memory(fault);
  tw_retargeted found;
  if (!find_pairs(lender, model, retarget, map, &fault->error)) return api_fault_complete(fault);
  if (tw_retarget_run(&job, arena, &found, &fault->error) != TW_OK) return api_fault_complete(fault);
  *out = (api_carried){.keys = found.keys, .report = print_report(lender, model, &found, arena)};
  return (out->report && warn_of_losses(lender, &found, retarget->holds_feet, arena, out)) ||
         api_fault_without_memory(fault);
}
