/* Requests for poses, up to the point where poses can be evaluated. */
#include "pose_request.h"

#include "node_names.h"
#include "service.h"

#include <string.h>

/* ---- parameters ------------------------------------------------------------------------------ */

static const char *const interpolations[] = {"step",  "linear", "cubicspline", "slerp",
                                             "nlerp", "squad",  "euler",       NULL};

static const char *const loops[] = {"clamp", "repeat", "pingpong", NULL};

/* The interpolation of a choice, -1 for none. */
static int force_of(int choice) {
  static const tw_interpolation forces[] = {TW_STEP,  TW_LINEAR, TW_CUBICSPLINE, TW_LINEAR,
                                            TW_NLERP, TW_SQUAD,  TW_EULER};
  return choice < 0 ? -1 : (int)forces[choice];
}

/* Checks parameters that need another one. */
static tw_status check_together(const api_query *query, const api_pose_request *pose, tw_error *error) {
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
  static const char *const units[] = {"radians", "degrees", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int space = 0, as = 0, order = 0, unit = 0, loop = 0, interpolation = -1;
  bool is_skinning = false;
  *out =
      (api_pose_request){.clips = api_query_get(query, "clip"), .node_list = api_query_get(query, "nodes")};
  tw_status status = api_query_choice(query, "space", spaces, &space, error);
  if (status == TW_OK) status = api_query_choice(query, "as", forms, &as, error);
  if (status == TW_OK) status = api_query_choice(query, "order", tw_euler_order_names, &order, error);
  if (status == TW_OK) status = api_query_choice(query, "unit", units, &unit, error);
  if (status == TW_OK) status = api_query_choice(query, "loop", loops, &loop, error);
  if (status == TW_OK)
    status = api_query_choice(query, "interpolation", interpolations, &interpolation, error);
  if (status == TW_OK) status = api_query_flag(query, "skinning", &is_skinning, error);
  if (status != TW_OK) return api_fail(call);
  out->force = force_of(interpolation);
  out->as = (api_pose_as)as;
  out->is_world = space == 1;
  out->order = (tw_euler_order)order;
  out->in_degrees = unit == 1;
  out->loop = (tw_loop)loop;
  out->is_skinning = is_skinning;
  if (check_together(query, out, error) != TW_OK) return api_fail(call);
  return api_clip_terms_read(call, false, &out->terms);
}

api_outcome api_bvh_request_read(api_call *call, api_pose_request *out) {
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int order = -1, loop = 0, interpolation = -1;
  *out =
      (api_pose_request){.clips = api_query_get(query, "clip"), .node_list = api_query_get(query, "nodes")};
  tw_status status = api_query_choice(query, "order", tw_euler_order_names, &order, error);
  if (status == TW_OK) status = api_query_choice(query, "loop", loops, &loop, error);
  if (status == TW_OK)
    status = api_query_choice(query, "interpolation", interpolations, &interpolation, error);
  if (status != TW_OK) return api_fail(call);
  out->force = force_of(interpolation);
  out->loop = (tw_loop)loop;
  out->has_order = order >= 0;
  out->order = (tw_euler_order)(order >= 0 ? order : 0);
  out->has_moved_nodes = !out->node_list;
  out->has_all_nodes = out->node_list && strcmp(out->node_list, "all") == 0;
  if (out->has_all_nodes) out->node_list = NULL;
  api_outcome outcome = api_clip_terms_read(call, false, &out->terms);
  if (outcome == API_DONE && out->terms.root.is_on && !out->terms.root.in_place)
    return api_fail_with(call, 400, "BVH has no place for root motion: in_place=true drops it");
  return outcome;
}

/* ---- nodes ----------------------------------------------------------------------------------- */

/* Finds the node that the list begins with, and the length of its name. A name may itself contain commas,
 * which the list does not escape: the shortest name that exists counts. */
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

static api_outcome fail_absent(api_call *call, const tw_model *model, const char *name, size_t length) {
  return api_fail_with(call, 404, "no node is called \"%.*s\"%s", length < 60 ? (int)length : 60, name,
                       api_node_names_near(model, name, length).text);
}

static void choose(const tw_model *model, uint32_t node, bool *chosen) {
  const uint32_t *namesakes = NULL;
  uint32_t count = chosen[node] ? 0 : tw_model_namesakes(model, node, &namesakes);
  for (uint32_t i = 0; i < count; i++) chosen[namesakes[i]] = true;
  chosen[node] = true; /* a node without a name has no namesakes */
}

/* Chooses the one node that the whole list names, or several. */
static api_outcome choose_listed(api_call *call, const tw_model *model, const char *list, bool *chosen) {
  size_t length = strlen(list);
  uint32_t node = tw_model_find_node(model, list, length);
  for (;;) {
    if (node == TW_NO_INDEX) node = find_listed(model, list, &length);
    if (node == TW_NO_INDEX) return fail_absent(call, model, list, strcspn(list, ","));
    choose(model, node, chosen);
    if (list[length] == '\0') return API_DONE;
    list += length + 1;
    node = TW_NO_INDEX;
  }
}

/* Whether comparing the names of the list with all nodes takes too long for a light call. */
static bool is_long_search(const tw_model *model, const char *list) {
  enum { COMPARISONS_MOST = 1 << 18 };
  uint64_t names = 1;
  for (const char *c = list; *c; c++) names += *c == ',';
  return names * model->node_count > COMPARISONS_MOST;
}

api_outcome api_nodes_choose(api_call *call, const tw_model *model, const char *list, const uint32_t **out,
                             uint32_t *count) {
  *count = 0;
  if (list && call->effort != API_HEAVY && is_long_search(model, list)) return API_NEEDS_THREAD;
  bool *chosen = list ? tw_arena_alloc(call->arena, model->node_count, sizeof *chosen) : NULL;
  uint32_t *nodes = tw_arena_alloc_raw(call->arena, model->node_count, sizeof *nodes);
  if ((list && !chosen) || !nodes) return api_fail_without_memory(call);
  api_outcome outcome = list ? choose_listed(call, model, list, chosen) : API_DONE;
  for (uint32_t i = 0; outcome == API_DONE && i < model->node_count; i++)
    if (!chosen || chosen[i]) nodes[(*count)++] = i;
  *out = nodes;
  return outcome;
}

/* Chooses the joints of all skins, one skin after the other. */
static api_outcome choose_joints(api_call *call, api_pose_request *request) {
  const tw_model *model = request->model;
  if (model->skin_count == 0) return api_fail_with(call, 422, "the model has no skin");
  uint64_t count = 0;
  for (uint32_t i = 0; i < model->skin_count; i++) count += model->skins[i].joint_count;
  if (count >= UINT32_MAX) return api_fail_with(call, 422, "the skins have too many joints");
  uint32_t *nodes = tw_arena_alloc_raw(call->arena, (size_t)count, sizeof *nodes), *end = nodes;
  if (!nodes) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < model->skin_count; i++)
    for (uint32_t j = 0; j < model->skins[i].joint_count; j++) *end++ = model->skins[i].joints[j];
  request->nodes = nodes;
  request->node_count = (uint32_t)count;
  return API_DONE;
}

bool api_pose_has_root(const api_pose_request *request) {
  return request->clip && request->clip->has_root && !request->choices.terms.root.in_place;
}

bool api_pose_has_all_nodes(const api_pose_request *request) {
  return request->node_count == request->model->node_count && !request->is_skinning;
}

/* ---- resolving ------------------------------------------------------------------------------- */

static api_outcome complete_times(api_call *call, api_pose_request *request) {
  static const double start = 0;
  api_times *times = &request->times;
  double duration = request->clip ? request->clip->duration : 0;
  if (!times->is_given) *times = (api_times){.is_given = true, .count = 1, .list = &start};
  tw_status status = api_times_complete(times, duration, call->service->limits.max_times, &call->fault.error);
  return api_outcome_of(call, status);
}

uint32_t api_pose_place(const api_pose_request *request, uint32_t node) {
  uint32_t low = 0, high = request->node_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (request->nodes[middle] < node)
      low = middle + 1;
    else
      high = middle;
  }
  return low < request->node_count && request->nodes[low] == node ? low : TW_NO_INDEX;
}

/* Whether a track moves morph weights of the answer's nodes. */
static bool moves_weights(const api_pose_request *request, uint32_t track) {
  tw_path path;
  uint32_t node = tw_clip_target(request->clip->compiled, track, &path);
  return path == TW_WEIGHTS && !request->is_skinning && api_pose_place(request, node) != TW_NO_INDEX;
}

bool api_pose_tells_weights(const api_pose_request *request, uint32_t track) {
  return request->form != API_POSE_CSV && moves_weights(request, track);
}

void api_pose_warn_of_weights(api_call *call, const api_pose_request *request) {
  static const char *const sentence = "the clip moves morph weights, which CSV has no place for: "
                                      "JSON and the binary form have them";
  bool is_lost = false;
  if (!request->clip || request->form != API_POSE_CSV) return;
  for (uint32_t i = 0; i < tw_clip_track_count(request->clip->compiled) && !is_lost; i++)
    is_lost = moves_weights(request, i);
  if (is_lost) api_call_warn(call, &sentence, 1);
}

/* Text repeats a node's name in each pose. */
static uint64_t count_weights(const api_pose_request *request) {
  const tw_clip *clip = request->clip ? request->clip->compiled : NULL;
  bool has_names = request->form != API_POSE_BIN;
  uint64_t count = 0;
  for (uint32_t i = 0; clip && i < tw_clip_track_count(clip); i++) {
    if (!api_pose_tells_weights(request, i)) continue;
    char buffer[24];
    tw_path path;
    const char *name = tw_model_node_name(request->model, tw_clip_target(clip, i, &path), buffer);
    count += tw_clip_width(clip, i) + (has_names ? strlen(name) / API_POSE_NUMBER_BYTES + 1 : 0);
  }
  return count;
}

uint64_t api_pose_transforms(const api_pose_request *request) {
  uint64_t cost = request->clip ? tw_clip_cost(request->clip->compiled) : 1;
  return (request->model->node_count + request->weights) * cost;
}

/* A pose is evaluated in one go. */
static api_outcome check_work(api_call *call, const api_pose_request *request) {
  enum { MOST = 1 << 25 }; /* half a second */
  uint64_t transforms = api_pose_transforms(request);
  if (transforms <= MOST) return API_DONE;
  return api_fail_with(call, 422, "a pose of %u %s takes %llu transforms, over the limit of %d",
                       request->model->node_count, tw_plural(request->model->node_count, "node", "nodes"),
                       (unsigned long long)transforms, MOST);
}

static api_outcome choose_nodes(api_call *call, api_pose_request *request) {
  if (request->is_skinning) return choose_joints(call, request);
  return api_nodes_choose(call, request->model, request->node_list, &request->nodes, &request->node_count);
}

api_outcome api_pose_request_resolve(api_call *call, bool is_stored, api_pose_request *request) {
  const tw_model *model = request->model = api_entry_value(request->model_entry);
  api_outcome outcome = api_clips_choose(call, model, request->clips, 1, &request->terms, &request->choices);
  if (outcome == API_DONE && request->choices.count > 0)
    outcome = api_clip_take(call, model, is_stored, &request->choices, request->force, &request->clip_entry);
  if (outcome != API_DONE) return outcome;
  if (request->clip_entry) request->clip = api_entry_value(request->clip_entry);
  outcome = complete_times(call, request);
  if (outcome == API_DONE) outcome = choose_nodes(call, request);
  if (outcome != API_DONE) return outcome;
  request->weights = count_weights(request);
  return check_work(call, request);
}

void api_pose_request_deinit(api_pose_request *request) {
  api_entry_release(request->clip_entry);
  api_entry_release(request->model_entry);
  request->clip_entry = request->model_entry = NULL;
}

/* ---- the canonical text ---------------------------------------------------------------------- */

void api_pose_request_print(const api_pose_request *request, tw_text *text) {
  const uint32_t values[] = {(uint32_t)(request->force + 1),
                             request->as,
                             request->is_world,
                             request->order,
                             request->in_degrees,
                             request->loop,
                             request->is_skinning};
  api_clips_print(&request->choices, text);
  enum { VALUES = sizeof values / sizeof *values };
  char digits[2 * VALUES]; /* one digit each: all are small enumerations */
  for (size_t i = 0; i < VALUES; i++) {
    digits[2 * i] = '&';
    digits[2 * i + 1] = (char)('0' + values[i]);
  }
  tw_text_bytes(text, digits, sizeof digits);
  tw_text_add(text, "&nodes=");
  if (api_pose_has_all_nodes(request)) {
    tw_text_add(text, "*");
    return;
  }
  for (uint32_t i = 0; i < request->node_count; i++) {
    tw_text_count(text, request->nodes[i]);
    tw_text_add(text, ",");
  }
}
