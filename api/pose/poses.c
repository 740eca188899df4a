/* Poses: a clip evaluated at the times of a request. */
#include "pose_print.h"
#include "pose_request.h"

#include "handlers.h"
#include "models.h"
#include "routes.h"
#include "service.h"
#include "upload.h"

#include <stdlib.h>
#include <string.h>

/* Below this many numbers an answer is printed at once, and evaluated without a thread of its own. */
enum { SMALL_NUMBERS = 20000 };

/* About what a number takes in text. */
enum { NUMBER_BYTES = 10 };

/* What an answer holds on to. */
typedef struct pose_answer {
  api_entry *model, *clip;
  api_pose_body *body;
} pose_answer;

/* ---- the answer ---------------------------------------------------------------------------------- */

static uint64_t count_numbers(const api_pose_query *query) {
  /* At most 2^32 nodes of 16 numbers, and max_times: no overflow below 2^28 times. */
  uint64_t per_pose = query->node_count * (uint64_t)api_pose_width(query->as);
  if (per_pose == 0) per_pose = 1; /* a model without nodes has its times told all the same */
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

static api_outcome validate(api_call *call, const api_pose_request *request, const api_clip_choice *choice) {
  api_stamp stamp;
  char mark[API_TIMES_MARK];
  bool is_stamped = api_pose_request_stamp(call, request, choice, &stamp);
  return is_stamped && api_times_mark(&request->query.times, mark) ? api_validate_stamp(call, &stamp, mark)
                                                                   : api_fail_without_memory(call);
}

static void destroy_answer(void *context) {
  pose_answer *answer = context;
  api_pose_body_deinit(answer->body);
  api_entry_release(answer->clip);
  api_entry_release(answer->model);
}

/* What an answer under way holds: a block of poses, its text, and a block of the host's. */
enum { STREAM_COST = 512 << 10 };

static int64_t read_answer(void *context, uint8_t *out, size_t capacity) {
  return api_pose_body_read(((pose_answer *)context)->body, out, capacity);
}

/* Prints a small answer at once: its length is then known, and nothing is held. */
static api_outcome print_now(api_call *call, pose_answer *answer) {
  api_text text;
  api_pose_body_print_whole(answer->body, &text);
  destroy_answer(answer);
  return api_reply(call, &text);
}

/* Fills the answer; takes over the entries in any case. */
static api_outcome reply_poses(api_call *call, const api_pose_request *request, api_entry *model,
                               api_entry *clip) {
  pose_answer *answer = tw_arena_alloc(call->arena, 1, sizeof *answer);
  api_pose_body *body =
      answer ? api_pose_body_create(&request->query, NULL, call->arena, (api_room){0}) : NULL;
  if (!body) {
    api_entry_release(clip);
    api_entry_release(model);
    return api_fail_without_memory(call);
  }
  *answer = (pose_answer){model, clip, body};
  bool is_borrowed = request->query.clip && request->query.clip->keys;
  if (is_borrowed && request->query.clip->missing_count > 0) api_clip_warning(call, request->query.clip);
  if (count_numbers(&request->query) <= SMALL_NUMBERS) return print_now(call, answer);
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  call->answer.body = (api_body){api_pose_body_size(body), answer, read_answer, destroy_answer};
  call->held = call->is_head ? 0 : STREAM_COST;
  return API_DONE;
}

/* A light call answers what is small and needs nothing built. */
static bool is_too_much(const api_call *call, const api_pose_request *request, const tw_model *model) {
  if (call->effort == API_HEAVY) return false;
  uint64_t transforms = request->query.times.count * (uint64_t)model->node_count;
  return count_numbers(&request->query) > SMALL_NUMBERS || transforms > SMALL_NUMBERS;
}

/* From a request and a model, which is held, to the answer. Takes over the model's entry. */
static api_outcome answer_poses(api_call *call, api_pose_request *request, api_entry *entry, bool is_stored) {
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
  if (outcome == API_DONE) outcome = api_pose_choose_nodes(call, model, request);
  if (outcome == API_DONE) outcome = check_size(call, &request->query);
  if (outcome == API_DONE && is_too_much(call, request, model)) outcome = API_NEEDS_THREAD;
  if (outcome == API_DONE && is_stored && call->request->body.size == 0) {
    outcome = validate(call, request, &choice);
    if (outcome == API_CONTINUE) return reply_poses(call, request, entry, clip);
  } else if (outcome == API_DONE) {
    return reply_poses(call, request, entry, clip);
  }
  api_entry_release(clip);
  api_entry_release(entry);
  return outcome;
}

static api_outcome read_request(api_call *call, api_pose_request *out) {
  api_outcome outcome = api_pose_request_read(call, out);
  if (outcome != API_DONE) return outcome;
  out->query.form = (api_pose_form)(call->offer - call->route->offers);
  tw_status status = api_times_read(&call->query, call->service->limits.max_times, call->arena,
                                    &out->query.times, &call->fault.error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

api_outcome api_get_pose(api_call *call) {
  api_pose_request request;
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
  if (call->effort == API_LIGHT) return API_NEEDS_THREAD;
  api_pose_request request;
  api_entry *entry;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = read_times(call, &request.query.times);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, TW_QUADS_NGON, &entry);
  return outcome == API_DONE ? answer_poses(call, &request, entry, true) : outcome;
}

api_outcome api_post_pose(api_call *call) {
  if (call->effort == API_LIGHT) return API_NEEDS_THREAD;
  api_pose_request request;
  api_entry *entry;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_of_body(call, TW_QUADS_NGON, &entry);
  return outcome == API_DONE ? answer_poses(call, &request, entry, false) : outcome;
}
