/* What requests for poses have in common: parameters, nodes, and the text that makes them out. */
#include "pose_request.h"

#include "query.h"

#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>

/* ---- parameters --------------------------------------------------------------------------------- */

/* Parameters that need another one. */
static tw_status check_together(const api_query *query, const api_pose_query *pose, tw_error *error) {
  bool has_angles = pose->as == API_AS_EULER || pose->as == API_AS_AXIS_ANGLE;
  if (api_query_get(query, "order") && pose->as != API_AS_EULER)
    return tw_fail(error, TW_SYNTAX, "order goes with as=euler");
  if (api_query_get(query, "unit") && !has_angles)
    return tw_fail(error, TW_SYNTAX, "unit goes with as=euler and as=axis-angle");
  if (pose->is_skinning && pose->as != API_AS_MATRIX)
    return tw_fail(error, TW_SYNTAX, "skinning=true goes with as=matrix");
  if (pose->is_skinning && api_query_get(query, "nodes"))
    return tw_fail(error, TW_SYNTAX,
                   "skinning=true gives all joints of all skins: nodes has no place with it");
  return TW_OK;
}

api_outcome api_pose_request_read(api_call *call, api_pose_request *out) {
  static const char *const spaces[] = {"local", "world", NULL};
  static const char *const forms[] = {"trs", "matrix", "euler", "axis-angle", NULL};
  static const char *const orders[] = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", NULL};
  static const char *const units[] = {"radians", "degrees", NULL};
  static const char *const loops[] = {"clamp", "repeat", "pingpong", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int space = 0, as = 0, order = 0, unit = 0, loop = 0, interpolation = -1;
  bool is_skinning = false;
  *out =
      (api_pose_request){.clip_name = api_query_get(query, "clip"), .nodes = api_query_get(query, "nodes")};
  tw_status status = api_query_choice(query, "space", spaces, &space, error);
  if (status == TW_OK) status = api_query_choice(query, "as", forms, &as, error);
  if (status == TW_OK) status = api_query_choice(query, "order", orders, &order, error);
  if (status == TW_OK) status = api_query_choice(query, "unit", units, &unit, error);
  if (status == TW_OK) status = api_query_choice(query, "loop", loops, &loop, error);
  if (status == TW_OK)
    status = api_query_choice(query, "interpolation", api_interpolations, &interpolation, error);
  if (status == TW_OK) status = api_query_flag(query, "skinning", &is_skinning, error);
  if (status != TW_OK) return api_fail(call);
  out->force = api_interpolation_force(interpolation);
  out->query.as = (api_pose_as)as;
  out->query.is_world = space == 1;
  out->query.order = (tw_euler_order)order;
  out->query.in_degrees = unit == 1;
  out->query.loop = (tw_loop)loop;
  out->query.is_skinning = is_skinning;
  if (check_together(query, &out->query, error) != TW_OK) return api_fail(call);
  return API_DONE;
}

/* ---- nodes --------------------------------------------------------------------------------------- */

/* The node whose name the list begins with, and the length of that name. A name may itself hold
 * commas, which the list has no way to tell: the shortest name that exists counts. */
static uint32_t find_listed(const tw_model *model, const char *list, size_t *length) {
  enum { COMMAS_IN_A_NAME = 8 };
  size_t end = strcspn(list, ",");
  for (int commas = 0; commas <= COMMAS_IN_A_NAME; commas++) {
    uint32_t node = tw_model_find_node(model, list, end);
    *length = end;
    if (node != TW_NO_INDEX) return node;
    if (list[end] == '\0') break;
    end += 1 + strcspn(list + end + 1, ",");
  }
  return TW_NO_INDEX;
}

static api_outcome choose_listed(api_call *call, const tw_model *model, const char *list, bool *chosen) {
  for (;;) {
    size_t length;
    uint32_t node = find_listed(model, list, &length);
    if (node == TW_NO_INDEX) {
      length = strcspn(list, ",");
      return api_fail_with(call, 404, "no node is called \"%.*s\"", length < 60 ? (int)length : 60, list);
    }
    chosen[node] = true;
    if (list[length] == '\0') return API_DONE;
    list += length + 1;
  }
}

/* Whether a light call leaves it to a heavy one to hold each name of the list against all nodes. */
static bool is_long_search(const tw_model *model, const char *list) {
  enum { COMPARISONS_MOST = 1 << 18 };
  uint64_t names = 1;
  for (const char *c = list; *c; c++) names += *c == ',';
  return names * model->node_count > COMPARISONS_MOST;
}

/* The nodes of the list, or all, in the file's order. */
static api_outcome choose_named(api_call *call, const tw_model *model, api_pose_request *request) {
  if (request->nodes && call->effort == API_LIGHT && is_long_search(model, request->nodes))
    return API_NEEDS_THREAD;
  bool *chosen = request->nodes ? tw_arena_alloc(call->arena, model->node_count, sizeof *chosen) : NULL;
  uint32_t *nodes = tw_arena_alloc(call->arena, model->node_count, sizeof *nodes);
  if ((request->nodes && !chosen) || !nodes) return api_fail_without_memory(call);
  if (chosen) {
    api_outcome outcome = choose_listed(call, model, request->nodes, chosen);
    if (outcome != API_DONE) return outcome;
  }
  uint32_t count = 0;
  for (uint32_t i = 0; i < model->node_count; i++)
    if (!chosen || chosen[i]) nodes[count++] = i;
  request->query.nodes = nodes;
  request->query.node_count = count;
  return API_DONE;
}

/* The joints of all skins, skin by skin. */
static api_outcome choose_joints(api_call *call, const tw_model *model, api_pose_request *request) {
  if (model->skin_count == 0) return api_fail_with(call, 422, "the model has no skin");
  uint64_t count = 0;
  for (uint32_t i = 0; i < model->skin_count; i++) count += model->skins[i].joint_count;
  if (count >= UINT32_MAX) return api_fail_with(call, 422, "the skins have too many joints");
  uint32_t *nodes = tw_arena_alloc(call->arena, (size_t)count, sizeof *nodes), *end = nodes;
  if (!nodes) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < model->skin_count; i++)
    for (uint32_t j = 0; j < model->skins[i].joint_count; j++) *end++ = model->skins[i].joints[j];
  request->query.nodes = nodes;
  request->query.node_count = (uint32_t)count;
  return API_DONE;
}

api_outcome api_pose_choose_nodes(api_call *call, const tw_model *model, api_pose_request *request) {
  return request->query.is_skinning ? choose_joints(call, model, request)
                                    : choose_named(call, model, request);
}

void api_pose_request_print(const api_pose_request *request, const api_clip_choice *choice, api_text *text) {
  const api_pose_query *query = &request->query;
  const uint32_t facts[] = {choice->index, (uint32_t)(choice->force + 1),
                            query->as,     query->is_world,
                            query->order,  query->in_degrees,
                            query->loop,   query->is_skinning};
  api_text_add(text, choice->lender);
  for (size_t i = 0; i < sizeof facts / sizeof *facts; i++) {
    api_text_add(text, "&");
    api_text_count(text, facts[i]);
  }
  api_text_add(text, "&nodes=");
  if (api_pose_has_all_nodes(query)) {
    api_text_add(text, "*");
    return;
  }
  for (uint32_t i = 0; i < query->node_count; i++) {
    api_text_count(text, query->nodes[i]);
    api_text_add(text, ",");
  }
}

bool api_pose_request_stamp(const api_call *call, const api_pose_request *request,
                            const api_clip_choice *choice, api_stamp *out) {
  char representation[16];
  snprintf(representation, sizeof representation, "pose.%s", call->offer->extension);
  api_text text = {0};
  api_pose_request_print(request, choice, &text);
  api_text_bytes(&text, "", 1);
  if (!text.failed) api_stamp_make(call->id, representation, text.data, out);
  bool is_made = !text.failed;
  api_text_deinit(&text);
  return is_made;
}

void api_time_mark(float time, char out[API_TIMES_MARK]) {
  uint32_t bits;
  memcpy(&bits, &time, sizeof bits);
  for (int shift = 28; shift >= 0; shift -= 4) *out++ = "0123456789abcdef"[bits >> shift & 15];
  *out = '\0';
}

bool api_times_mark(const api_times *times, char out[API_TIMES_MARK]) {
  if (times->list && times->count == 1) {
    api_time_mark(times->list[0], out);
    return true;
  }
  api_text text = {0};
  api_times_print(times, &text);
  struct sha256_ctx hash;
  uint8_t digest[API_STAMP_DIGEST];
  sha256_init(&hash);
  sha256_update(&hash, text.size, (const uint8_t *)text.data);
  sha256_digest(&hash, sizeof digest, digest);
  api_hex(digest, sizeof digest, out);
  out[2 * sizeof digest] = '\0';
  bool is_made = !text.failed;
  api_text_deinit(&text);
  return is_made;
}
