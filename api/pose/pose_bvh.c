/* Poses as BVH: a frame each step, from the first time to the last. */
#include "handlers.h"
#include "models.h"
#include "pose_request.h"
#include "service.h"
#include "tweend/format.h"

/* ---- parameters ------------------------------------------------------------------------------ */

static api_outcome read_request(api_call *call, api_pose_request *out) {
  enum { USUAL_FPS = 30 };
  api_outcome outcome = api_bvh_request_read(call, out);
  if (outcome != API_DONE) return outcome;
  tw_status status = api_times_read_steps(&call->query, USUAL_FPS, call->service->limits.max_times,
                                          &out->times, &call->fault.error);
  return api_outcome_of(call, status);
}

/* ---- the answer ------------------------------------------------------------------------------ */

typedef struct bvh_body {
  tw_bvh_stream *stream;
  api_pose_request request; /* holds the entries */
} bvh_body;

static int64_t read_body(void *context, uint8_t *out, size_t capacity) {
  bvh_body *body = context;
  return tw_bvh_stream_read(body->stream, out, capacity);
}

static void destroy_body(void *context) {
  bvh_body *body = context;
  tw_bvh_stream_destroy(body->stream);
  api_pose_request_deinit(&body->request);
}

/* What a stream holds: of each node a joint and a transform, a piece of text, and the head's text. */
static uint64_t stream_cost(const tw_model *model) {
  enum { BLOCKS = 512 << 10, JOINT = 1024 };
  return BLOCKS + (uint64_t)model->node_count * JOINT;
}

/* [nodes of the model] which are asked for; NULL without a list, or without memory. */
static const bool *mark_listed(api_call *call, const api_pose_request *request) {
  bool *listed = tw_arena_alloc(call->arena, request->model->node_count, sizeof *listed);
  for (uint32_t i = 0; listed && i < request->node_count; i++) listed[request->nodes[i]] = true;
  return listed;
}

static api_outcome check_size(api_call *call, const tw_bvh_stream *stream) {
  enum { NUMBER_BYTES = 10 };
  uint64_t limit = call->service->limits.max_output, numbers = tw_bvh_stream_numbers(stream);
  if (numbers <= limit / NUMBER_BYTES) return API_DONE;
  return api_fail_with(call, 422, "%llu numbers are more than %llu bytes hold", (unsigned long long)numbers,
                       (unsigned long long)limit);
}

static api_outcome create_stream(api_call *call, const api_pose_request *request, tw_bvh_stream **out) {
  tw_bvh_options options = {.model = request->model,
                            .clip = request->clip ? request->clip->compiled : NULL,
                            .choice = request->has_all_nodes     ? TW_BVH_ALL
                                      : request->has_moved_nodes ? TW_BVH_MOVED
                                                                 : TW_BVH_LISTED,
                            .order = request->has_order ? (int)request->order : -1,
                            .from = request->times.from,
                            .fps = request->times.fps,
                            .frame_count = request->times.count,
                            .loop = request->loop,
                            .duration = request->clip ? request->clip->duration : 0};
  if (options.choice == TW_BVH_LISTED) {
    options.is_listed = mark_listed(call, request);
    if (!options.is_listed) return api_fail_without_memory(call);
  }
  return tw_bvh_stream_create(&options, out, &call->fault.error) == TW_OK ? API_DONE : api_fail(call);
}

static api_outcome reply(api_call *call, api_pose_request *request) {
  uint64_t cost = stream_cost(request->model);
  bvh_body *body = tw_arena_alloc(call->arena, 1, sizeof *body);
  if (!body) return api_fail_without_memory(call);
  api_outcome outcome = create_stream(call, request, &body->stream);
  if (outcome == API_DONE) outcome = check_size(call, body->stream);
  if (outcome != API_DONE) {
    tw_bvh_stream_destroy(body->stream);
    return outcome;
  }
  const char *const *warnings;
  uint32_t count = tw_bvh_stream_warnings(body->stream, &warnings);
  if (request->clip) api_call_warn(call, request->clip->warnings, request->clip->warning_count);
  if (count) api_call_warn(call, warnings, count);
  atomic_fetch_add(&call->service->joint_times, request->times.count * request->model->node_count);
  body->request = *request;
  request->model_entry = request->clip_entry = NULL;
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  bool is_slow = api_pose_transforms(&body->request) > API_POSE_LIGHT;
  call->answer.body = (api_body){API_SIZE_UNKNOWN, body, read_body, destroy_body, is_slow};
  call->held = call->is_head ? 0 : cost;
  return API_DONE;
}

/* All that the answer depends on, as text; NULL without memory. */
static const char *print_canonical(api_call *call, const api_pose_request *request) {
  tw_text text = {0};
  api_pose_request_print(request, &text);
  tw_text_add(&text, request->has_order ? "&order=1" : "&order=0");
  tw_text_add(&text, request->has_all_nodes ? "&all" : request->has_moved_nodes ? "&moved" : "&listed");
  tw_text_add(&text, "&at=");
  api_times_print(&request->times, &text);
  return api_text_move(&text, call->arena);
}

static api_outcome answer(api_call *call, bool is_stored, api_pose_request *request) {
  api_outcome outcome = api_pose_request_resolve(call, is_stored, request);
  if (outcome != API_DONE) return outcome;
  if (is_stored) {
    const char *canonical = print_canonical(call, request);
    if (!canonical) return api_fail_without_memory(call);
    outcome = api_validate(call, "pose.bvh", canonical);
    if (outcome != API_CONTINUE) return outcome;
  }
  return reply(call, request);
}

/* is_stored: the model is in the store, not in the body. */
static api_outcome handle(api_call *call, bool is_stored) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_pose_request request = {0};
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE)
    outcome = is_stored ? api_model_take(call, call->id, NULL, &request.model_entry)
                        : api_model_of_body(call, NULL, &request.model_entry);
  if (outcome == API_DONE) outcome = answer(call, is_stored, &request);
  api_pose_request_deinit(&request);
  return outcome;
}

api_outcome api_get_pose_bvh(api_call *call) {
  return handle(call, true);
}

api_outcome api_post_pose_bvh(api_call *call) {
  return handle(call, false);
}
