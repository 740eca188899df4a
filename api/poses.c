/* Poses: a clip evaluated at the times of a request. */
#include "pose_print.h"

#include "handlers.h"
#include "models.h"
#include "routes.h"
#include "service.h"
#include "upload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Below this many numbers an answer is printed at once, and evaluated without a thread of its own. */
enum { SMALL_NUMBERS = 20000 };

/* About what a number takes in text. */
enum { NUMBER_BYTES = 10 };

/* A request for poses: parameters as read, before the model is known. */
typedef struct pose_request {
  const char *clip_name;
  const char *nodes; /* NULL: all */
  int force;
  api_pose_query query;
} pose_request;

/* What an answer holds on to. */
typedef struct pose_answer {
  api_entry *model, *clip;
  api_pose_body *body;
} pose_answer;

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

static api_outcome read_request(api_call *call, pose_request *out) {
  static const char *const spaces[] = {"local", "world", NULL};
  static const char *const forms[] = {"trs", "matrix", "euler", "axis-angle", NULL};
  static const char *const orders[] = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", NULL};
  static const char *const units[] = {"radians", "degrees", NULL};
  static const char *const loops[] = {"clamp", "repeat", "pingpong", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int space = 0, as = 0, order = 0, unit = 0, loop = 0, interpolation = -1;
  bool is_skinning = false;
  *out = (pose_request){.clip_name = api_query_get(query, "clip"), .nodes = api_query_get(query, "nodes")};
  tw_status status =
      api_times_read(query, call->service->limits.max_times, call->arena, &out->query.times, error);
  if (status == TW_OK) status = api_query_choice(query, "space", spaces, &space, error);
  if (status == TW_OK) status = api_query_choice(query, "as", forms, &as, error);
  if (status == TW_OK) status = api_query_choice(query, "order", orders, &order, error);
  if (status == TW_OK) status = api_query_choice(query, "unit", units, &unit, error);
  if (status == TW_OK) status = api_query_choice(query, "loop", loops, &loop, error);
  if (status == TW_OK)
    status = api_query_choice(query, "interpolation", api_interpolations, &interpolation, error);
  if (status == TW_OK) status = api_query_flag(query, "skinning", &is_skinning, error);
  if (status != TW_OK) return api_fail(call);
  out->force = api_interpolation_force(interpolation);
  out->query.form = (api_pose_form)(call->offer - call->route->offers);
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

/* The nodes that the answer tells of, in the file's order. */
static api_outcome choose_nodes(api_call *call, const tw_model *model, pose_request *request) {
  bool *chosen = tw_arena_alloc(call->arena, model->node_count, sizeof *chosen);
  uint32_t *nodes = tw_arena_alloc(call->arena, model->node_count, sizeof *nodes);
  if (!chosen || !nodes) return api_fail_without_memory(call);
  if (request->nodes) {
    api_outcome outcome = choose_listed(call, model, request->nodes, chosen);
    if (outcome != API_DONE) return outcome;
  }
  uint32_t count = 0;
  for (uint32_t i = 0; i < model->node_count; i++)
    if (!request->nodes || chosen[i]) nodes[count++] = i;
  request->query.nodes = nodes;
  request->query.node_count = count;
  return API_DONE;
}

/* The joints of all skins, skin by skin. */
static api_outcome choose_joints(api_call *call, const tw_model *model, pose_request *request) {
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

/* ---- the answer ---------------------------------------------------------------------------------- */

static uint64_t count_numbers(const api_pose_query *query) {
  /* At most 2^32 nodes of 16 numbers, and max_times: no overflow below 2^28 times. */
  uint64_t per_pose = query->node_count * (uint64_t)api_pose_width(query->as);
  uint64_t times = query->times.count;
  return times && per_pose > UINT64_MAX / times ? UINT64_MAX : per_pose * times;
}

static api_outcome check_size(api_call *call, const api_pose_query *query) {
  uint64_t limit = call->service->limits.max_output, numbers = count_numbers(query);
  uint64_t each = query->form == API_POSE_BIN ? sizeof(float) : NUMBER_BYTES;
  if (numbers <= limit / each) return API_DONE;
  return api_fail_with(call, 422, "%llu poses of %u nodes make %llu numbers, more than %llu bytes hold",
                       (unsigned long long)query->times.count, query->node_count, (unsigned long long)numbers,
                       (unsigned long long)limit);
}

/* All parameters with their defaults, as text; NULL without memory. */
static const char *canonical(api_call *call, const pose_request *request, const api_clip_choice *choice) {
  const api_pose_query *query = &request->query;
  api_text text = {0};
  char parts[160];
  snprintf(parts, sizeof parts, "clip=%s/%u&force=%d&as=%d&world=%d&order=%d&degrees=%d&loop=%d&skin=%d",
           choice->lender, choice->index, choice->force, query->as, query->is_world, query->order,
           query->in_degrees, query->loop, query->is_skinning);
  api_text_add(&text, parts);
  api_text_add(&text, "&nodes=");
  for (uint32_t i = 0; i < query->node_count; i++) {
    api_text_count(&text, query->nodes[i]);
    api_text_add(&text, ",");
  }
  api_text_add(&text, "&times=");
  api_times_print(&query->times, &text);
  const char *copy = text.failed ? NULL : tw_arena_text(call->arena, text.data, text.size);
  api_text_deinit(&text);
  return copy;
}

static void destroy_answer(void *context) {
  pose_answer *answer = context;
  api_pose_body_deinit(answer->body);
  api_entry_release(answer->clip);
  api_entry_release(answer->model);
}

static int64_t read_answer(void *context, uint8_t *out, size_t capacity) {
  return api_pose_body_read(((pose_answer *)context)->body, out, capacity);
}

/* Prints a small answer at once: its length is then known, and nothing is held. */
static api_outcome print_now(api_call *call, pose_answer *answer) {
  api_text text = {0};
  uint8_t piece[4096];
  int64_t count;
  while ((count = read_answer(answer, piece, sizeof piece)) > 0)
    api_text_bytes(&text, (const char *)piece, (size_t)count);
  text.failed |= count < 0;
  destroy_answer(answer);
  return api_reply(call, &text);
}

/* Fills the answer; takes over the entries in any case. */
static api_outcome reply_poses(api_call *call, const pose_request *request, api_entry *model,
                               api_entry *clip) {
  pose_answer *answer = tw_arena_alloc(call->arena, 1, sizeof *answer);
  api_pose_body *body = answer ? api_pose_body_create(&request->query, call->arena) : NULL;
  if (!body) {
    api_entry_release(clip);
    api_entry_release(model);
    return api_fail_without_memory(call);
  }
  *answer = (pose_answer){model, clip, body};
  if (request->query.clip && request->query.clip->missing_count > 0)
    api_clip_warning(call, request->query.clip);
  if (count_numbers(&request->query) <= SMALL_NUMBERS) return print_now(call, answer);
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  call->answer.body = (api_body){api_pose_body_size(body), answer, read_answer, destroy_answer};
  return API_DONE;
}

/* A light call answers what is small and needs nothing built. */
static bool is_too_much(const api_call *call, const pose_request *request, const tw_model *model) {
  if (call->effort == API_HEAVY) return false;
  uint64_t transforms = request->query.times.count * (uint64_t)model->node_count;
  return count_numbers(&request->query) > SMALL_NUMBERS || transforms > SMALL_NUMBERS;
}

/* From a request and a model, which is held, to the answer. Takes over the model's entry. */
static api_outcome answer_poses(api_call *call, pose_request *request, api_entry *entry, bool is_stored) {
  tw_model *model = api_entry_value(entry);
  api_clip_choice choice;
  api_entry *clip = NULL;
  api_times *times = &request->query.times;
  request->query.model = model;
  api_outcome outcome = api_clip_find(call, model, request->clip_name, request->force, &choice);
  if (outcome == API_DONE && choice.index != TW_NO_INDEX)
    outcome = api_clip_take(call, model, is_stored, &choice, &clip);
  if (outcome == API_DONE) {
    request->query.clip = clip ? api_entry_value(clip) : NULL;
    float duration = clip ? tw_clip_duration(request->query.clip->compiled) : 0;
    static const float start = 0;
    if (!times->is_given) *times = (api_times){.is_given = true, .count = 1, .list = &start};
    if (api_times_complete(times, duration, call->service->limits.max_times, &call->fault.error) != TW_OK)
      outcome = api_fail(call);
  }
  if (outcome == API_DONE)
    outcome =
        request->query.is_skinning ? choose_joints(call, model, request) : choose_nodes(call, model, request);
  if (outcome == API_DONE) outcome = check_size(call, &request->query);
  if (outcome == API_DONE && is_too_much(call, request, model)) outcome = API_LATER;
  if (outcome == API_DONE && is_stored && call->request->body.size == 0) {
    const char *text = canonical(call, request, &choice);
    char representation[16];
    snprintf(representation, sizeof representation, "pose.%s", call->offer->extension);
    outcome = text ? api_validate(call, representation, text) : api_fail_without_memory(call);
    if (outcome == API_LATER) return reply_poses(call, request, entry, clip);
  } else if (outcome == API_DONE) {
    return reply_poses(call, request, entry, clip);
  }
  api_entry_release(clip);
  api_entry_release(entry);
  return outcome;
}

api_outcome api_get_pose(api_call *call) {
  pose_request request;
  api_entry *entry;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, TW_QUADS_NGON, &entry);
  return outcome == API_DONE ? answer_poses(call, &request, entry, true) : outcome;
}

/* Reads the times out of the body. */
static api_outcome read_times(api_call *call, api_times *out) {
  api_upload upload = {0};
  if (out->is_given)
    return api_fail_with(call, 400, "the times are in the body: at, from, to, fps have no place");
  api_outcome outcome = api_upload_read(call, &upload);
  if (outcome != API_DONE) return outcome;
  if (api_times_from_json((const char *)upload.bytes.data, upload.bytes.size, call->service->limits.max_times,
                          call->arena, out, &call->fault.error) != TW_OK)
    outcome = api_fail_in_document(call);
  api_upload_deinit(&upload);
  return outcome;
}

api_outcome api_post_times(api_call *call) {
  if (call->effort == API_LIGHT) return API_LATER;
  pose_request request;
  api_entry *entry;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = read_times(call, &request.query.times);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, TW_QUADS_NGON, &entry);
  return outcome == API_DONE ? answer_poses(call, &request, entry, true) : outcome;
}

api_outcome api_post_pose(api_call *call) {
  if (call->effort == API_LIGHT) return API_LATER;
  pose_request request;
  api_entry *entry;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_of_body(call, TW_QUADS_NGON, &entry);
  return outcome == API_DONE ? answer_poses(call, &request, entry, false) : outcome;
}
