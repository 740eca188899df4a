/* Poses: a clip evaluated at the times of a request. */
#include "pose_body.h"

#include "handlers.h"
#include "models.h"
#include "response_cache.h"
#include "service.h"
#include "upload.h"

#include <stdio.h>
#include <string.h>

/* ---- sizes ----------------------------------------------------------------------------------- */

static uint64_t count_numbers(const api_pose_request *request) {
  uint64_t per_pose = api_pose_numbers(request), times = request->times.count;
  return times && per_pose > UINT64_MAX / times ? UINT64_MAX : per_pose * times;
}

/* The bytes of the nodes' names, which may have any length. */
static uint64_t count_name_bytes(const api_pose_request *request) {
  uint64_t size = 0;
  char buffer[24];
  for (uint32_t i = 0; i < request->node_count; i++)
    size += strlen(tw_model_node_name(request->model, request->nodes[i], buffer));
  return size;
}

/* In CSV each line repeats a node's name. */
static api_outcome check_size(api_call *call, const api_pose_request *request) {
  uint64_t limit = call->service->limits.max_output, numbers = count_numbers(request),
           names = request->form == API_POSE_CSV ? count_name_bytes(request) : 0,
           times = request->times.count;
  uint64_t each = request->form == API_POSE_BIN ? sizeof(float) : API_POSE_NUMBER_BYTES;
  if (numbers > limit / each)
    return api_fail_with(call, 422, "%llu %s of %u %s %s %llu numbers, more than %llu bytes hold",
                         (unsigned long long)times, tw_plural(times, "pose", "poses"), request->node_count,
                         tw_plural(request->node_count, "node", "nodes"), tw_plural(times, "makes", "make"),
                         (unsigned long long)numbers, (unsigned long long)limit);
  if (names > 0 && times > (limit - numbers * each) / names)
    return api_fail_with(call, 422, "%llu %s with %llu %s of names each %s more than %llu bytes hold",
                         (unsigned long long)times, tw_plural(times, "pose", "poses"),
                         (unsigned long long)names, tw_plural(names, "byte", "bytes"),
                         tw_plural(times, "is", "are"), (unsigned long long)limit);
  return API_DONE;
}

/* A bound on the bytes of one pose: its numbers, and its time twice. In CSV each line repeats the time and
 * the node's name, whose quotes are doubled. */
static uint64_t bound_pose(const api_pose_request *request) {
  uint64_t numbers = api_pose_numbers(request);
  if (request->form == API_POSE_BIN) return numbers * sizeof(float);
  uint64_t size = numbers * TW_FLOAT_TEXT + (uint64_t)2 * TW_NUMBER_TEXT;
  if (request->form != API_POSE_CSV) return size;
  return size + 2 * ((uint64_t)request->node_count * TW_NUMBER_TEXT + count_name_bytes(request));
}

static uint64_t bound_bytes(const api_pose_request *request) {
  return request->times.count * bound_pose(request);
}

/* Whether the answer takes little time to evaluate and print. */
static bool is_light(const api_pose_request *request) {
  uint64_t transforms = request->times.count * api_pose_transforms(request);
  return transforms <= API_POSE_LIGHT && count_numbers(request) <= API_POSE_LIGHT &&
         bound_bytes(request) <= API_RESPONSE_MAX;
}

/* ---- the canonical request ------------------------------------------------------------------- */

/* All parameters with defaults, and the times, as text; NULL without memory. */
static const char *print_canonical(api_call *call, const api_pose_request *request) {
  tw_text text = {0};
  api_pose_request_print(request, &text);
  tw_text_add(&text, "&at=");
  api_times_print(&request->times, &text);
  return api_text_move(&text, call->arena);
}

/* The cache key of the answer; NULL without memory. */
static const char *make_key(api_call *call, const char *representation, const char *canonical) {
  size_t size = strlen(call->id) + strlen(representation) + strlen(canonical) + sizeof "/?";
  char *key = tw_arena_alloc_raw(call->arena, size, 1);
  if (key) snprintf(key, size, "%s/%s?%s", call->id, representation, canonical);
  return key;
}

/* ---- the answer ------------------------------------------------------------------------------ */

/* Prints all poses at once: their length is then known, and the answer holds no entries. */
static bool print_poses(api_call *call, api_pose_request *request, tw_text *out, api_fault *fault) {
  api_pose_body *body = api_pose_body_create(request, call->service, call->arena);
  if (!body) return api_fault_without_memory(fault);
  api_pose_body_print_all(body, out);
  api_pose_body_destroy(body);
  return true;
}

typedef struct pose_source {
  api_call *call;
  api_pose_request *request;
} pose_source;

static bool print_remembered(void *context, tw_text *out, api_fault *fault) {
  const pose_source *source = context;
  api_call *call = source->call;
  return api_grant(call, bound_bytes(source->request)) && print_poses(call, source->request, out, fault);
}

/* What a streamed answer holds besides the arena: a piece of text, which ends with a whole pose and begins
 * with all names, in a buffer that doubles; and a block of the host's. */
static uint64_t streaming_cost(const api_pose_request *request) {
  enum { BLOCKS = 512 << 10 };
  return BLOCKS + 2 * (bound_pose(request) + count_name_bytes(request));
}

static api_outcome reply_streamed(api_call *call, api_pose_request *request) {
  uint64_t cost = streaming_cost(request);
  bool is_slow = api_pose_transforms(request) + api_pose_numbers(request) > API_POSE_LIGHT;
  if (!api_grant(call, cost)) return API_FAILED;
  api_pose_body *body = api_pose_body_create(request, call->service, call->arena);
  if (!body) return api_fail_without_memory(call);
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  call->answer.body =
      (api_body){api_pose_body_size(body), body, api_pose_body_read, api_pose_body_destroy, is_slow};
  call->held = call->is_head ? 0 : cost;
  return API_DONE;
}

/* Light answers are printed at once, which takes about as long as a cache look-up. Others are cached, if they
 * have a key and are small enough, or streamed. */
static api_outcome reply_poses(api_call *call, api_pose_request *request, const char *key) {
  if (request->clip) api_call_warn(call, request->clip->warnings, request->clip->warning_count);
  api_pose_warn_of_weights(call, request);
  if (is_light(request)) {
    tw_text text = {0};
    return print_poses(call, request, &text, &call->fault) ? api_reply(call, &text) : API_FAILED;
  }
  if (key && bound_bytes(request) <= API_RESPONSE_MAX) {
    pose_source source = {call, request};
    api_outcome outcome = api_response_reply_repeated(call, key, print_remembered, &source);
    if (outcome != API_CONTINUE) return outcome;
  }
  return call->effort != API_HEAVY ? API_NEEDS_THREAD : reply_streamed(call, request);
}

/* Resolves the request and checks the answer's size. */
static api_outcome prepare(api_call *call, bool is_stored, api_pose_request *request) {
  api_outcome outcome = api_pose_request_resolve(call, is_stored, request);
  return outcome == API_DONE ? check_size(call, request) : outcome;
}

/* ---- requests -------------------------------------------------------------------------------- */

static api_outcome read_request(api_call *call, api_pose_request *out) {
  api_outcome outcome = api_pose_request_read(call, out);
  if (outcome != API_DONE) return outcome;
  out->form = (api_pose_form)(call->offer - call->route->offers);
  if (out->form == API_POSE_CSV && out->terms.root.is_on && !out->terms.root.in_place)
    return api_fail_with(call, 400, "CSV has no place for root motion: in_place=true drops it");
  tw_status status = api_times_read(&call->query, call->service->limits.max_times, call->arena, &out->times,
                                    &call->fault.error);
  return api_outcome_of(call, status);
}

/* A GET depends on the URL alone: it has an entity tag and may be cached. */
static api_outcome answer_get(api_call *call, api_pose_request *request) {
  api_outcome outcome = prepare(call, true, request);
  if (outcome != API_DONE) return outcome;
  static const char *const representations[] = {"pose.json", "pose.ndjson", "pose.bin", "pose.csv"};
  const char *representation = representations[request->form];
  const char *canonical = print_canonical(call, request), *key = NULL;
  if (!canonical) return api_fail_without_memory(call);
  outcome = api_validate(call, representation, canonical);
  if (outcome != API_CONTINUE) return outcome;
  if (!is_light(request)) key = make_key(call, representation, canonical);
  return reply_poses(call, request, key);
}

api_outcome api_get_pose(api_call *call) {
  api_pose_request request;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, NULL, &request.model_entry);
  if (outcome == API_DONE) outcome = answer_get(call, &request);
  api_pose_request_deinit(&request);
  return outcome;
}

/* Answers if `outcome` is API_DONE, and releases the request in any case. */
static api_outcome answer_post(api_call *call, api_outcome outcome, bool is_stored,
                               api_pose_request *request) {
  if (outcome == API_DONE) outcome = prepare(call, is_stored, request);
  if (outcome == API_DONE) outcome = reply_poses(call, request, NULL);
  api_pose_request_deinit(request);
  return outcome;
}

api_outcome api_post_times(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_pose_request request;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_times_of_body(call, &request.times, &request.terms.retarget);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, NULL, &request.model_entry);
  return answer_post(call, outcome, true, &request);
}

api_outcome api_post_pose(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_pose_request request;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_of_body(call, NULL, &request.model_entry);
  return answer_post(call, outcome, false, &request);
}
