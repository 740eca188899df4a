/* Live poses: a clip played in real time as an event stream (WHATWG HTML, section 9.2). Frame n shows the
 * clip at from + n * speed / fps seconds, folded onto the clip; n is the event's id. The server decides when
 * frames are due and adds the time to each event. */
#include "handlers.h"
#include "models.h"
#include "pose_body.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The most numbers and nodes of a frame: some milliseconds of work, because many streams share a thread. */
enum { FRAME_NUMBERS = 50000, FRAME_NODES = 10000 };

static const double FPS_MIN = 0.01, FPS_MAX = 240;
static const double SPEED_MAX = 1000;
static const double START_MAX = 1e13; /* milliseconds, in the year 2286 */

/* Doubles count frames exactly up to here; an id has no more digits. */
static const double FRAMES_MAX = 1e15;
enum { ID_DIGITS = 15 };

typedef struct live_request {
  api_pose_request pose;
  double speed, fps, from, start_ms;
  bool has_from, has_start, has_last;
  uint64_t last_id; /* from Last-Event-ID */
} live_request;

/* What a stream holds; lives in its own arena. */
typedef struct live_poses {
  tw_arena *arena;
  const char *key;
  api_pose_body *body; /* holds the entries of model and clip */
  double speed, fps, from, duration;
  tw_loop loop;
} live_poses;

/* ---- parameters ------------------------------------------------------------------------------ */

/* Reads the frame that the client saw last. */
static api_outcome read_last_id(api_call *call, live_request *request) {
  const char *text = api_call_header(call, "Last-Event-ID");
  if (!text || !*text) return API_DONE;
  size_t digits = strspn(text, "0123456789");
  if (digits > ID_DIGITS || text[digits] != '\0')
    return api_fail_with(call, 400, "Last-Event-ID is not the id of an event of this stream");
  request->has_last = true;
  request->last_id = strtoull(text, NULL, 10);
  return API_DONE;
}

static api_outcome read_request(api_call *call, live_request *out) {
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  *out = (live_request){.speed = 1,
                        .fps = 30,
                        .has_from = api_query_get(query, "from") != NULL,
                        .has_start = api_query_get(query, "start") != NULL};
  api_outcome outcome = api_pose_request_read(call, &out->pose);
  if (outcome != API_DONE) return outcome;
  tw_status status = api_query_number(query, "speed", &out->speed, error);
  if (status == TW_OK) status = api_query_number(query, "fps", &out->fps, error);
  if (status == TW_OK) status = api_query_number(query, "from", &out->from, error);
  if (status == TW_OK) status = api_query_number(query, "start", &out->start_ms, error);
  if (status != TW_OK) return api_fail(call);
  if (out->speed == 0 || fabs(out->speed) > SPEED_MAX)
    return api_fail_with(call, 400, "speed must not be 0, nor beyond %g", SPEED_MAX);
  if (out->fps < FPS_MIN || out->fps > FPS_MAX)
    return api_fail_with(call, 400, "fps must be from %g to %g", FPS_MIN, FPS_MAX);
  if (!isfinite((float)out->from)) return api_fail_with(call, 400, "from must fit a float");
  if (!(out->start_ms >= 0 && out->start_ms <= START_MAX))
    return api_fail_with(call, 400, "start must be a Unix time in milliseconds");
  return read_last_id(call, out);
}

/* ---- frames ---------------------------------------------------------------------------------- */

/* Folds a time onto the clip, in double precision: after hours a float would stutter. */
static double fold(const live_poses *live, double time) {
  double duration = live->duration;
  if (live->loop == TW_CLAMP) {
    /* The last frame shows the clip's end even where that falls between two steps. */
    double end = live->speed > 0 ? fmax(duration, live->from) : fmin(0, live->from);
    return live->speed > 0 ? fmin(time, end) : fmax(time, end);
  }
  if (duration <= 0) return 0;
  double period = live->loop == TW_PINGPONG ? 2 * duration : duration;
  double phase = fmod(time, period);
  if (phase < 0) phase += period;
  if ((float)phase >= (float)period) return 0; /* what rounding puts just before the end, as tw_loop_time */
  return phase > duration ? period - phase : phase;
}

/* The index of the last frame, UINT64_MAX for an endless stream. */
static uint64_t last_frame(const live_poses *live) {
  if (live->loop != TW_CLAMP) return UINT64_MAX;
  double way = live->speed > 0 ? live->duration - live->from : live->from;
  /* Rounding may put a step just beyond the end. */
  double frames = ceil(way * live->fps / fabs(live->speed) - 1e-6);
  return frames >= FRAMES_MAX ? UINT64_MAX : frames > 0 ? (uint64_t)frames : 0;
}

static bool print_frame(void *context, uint64_t index, api_bytes *out) {
  live_poses *live = context;
  double time = fold(live, live->from + (double)index * live->speed / live->fps);
  tw_text text = {0};
  tw_text_add(&text, "id: ");
  tw_text_count(&text, index);
  tw_text_add(&text, "\ndata: ");
  api_pose_body_print_at(live->body, time, &text);
  if (!text.failed) text.size -= strlen("}\n"); /* the stamp closes the object */
  if (text.failed) {
    tw_text_deinit(&text);
    return false;
  }
  tw_text_fit(&text); /* listeners may hold it for long */
  *out = (api_bytes){(const uint8_t *)text.data, text.size};
  return true;
}

static size_t print_stamp(uint64_t now_ms, char out[API_LIVE_STAMP]) {
  int size = snprintf(out, API_LIVE_STAMP, ",\"now\":%llu}\n\n", (unsigned long long)now_ms);
  return (size_t)size;
}

static void destroy_live(void *context) {
  live_poses *live = context;
  api_pose_body_destroy(live->body);
  tw_arena_destroy(live->arena); /* holds the struct itself */
}

/* ---- the answer ------------------------------------------------------------------------------ */

/* Everything that determines the frames, as text; NULL without memory. */
static const char *make_key(api_call *call, const live_request *request) {
  tw_text text = {0};
  tw_text_add(&text, call->id);
  api_pose_request_print(&request->pose, &text);
  const double numbers[] = {request->speed, request->fps, request->from,
                            request->has_start ? request->start_ms : -1};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    tw_text_add(&text, "&");
    tw_text_double(&text, numbers[i]);
  }
  return api_text_move(&text, call->arena);
}

static double duration_of(const api_pose_request *pose) {
  return pose->clip ? pose->clip->duration : 0;
}

/* Takes over the request's entries. NULL without memory. */
static live_poses *create_live(live_request *request, api_service *service, const char *key) {
  api_pose_request *pose = &request->pose;
  tw_arena *arena = tw_arena_create();
  live_poses *live = arena ? tw_arena_alloc(arena, 1, sizeof *live) : NULL;
  uint32_t *nodes = live ? tw_arena_alloc(arena, pose->node_count, sizeof *nodes) : NULL;
  if (nodes) {
    *live = (live_poses){.arena = arena,
                         .key = tw_arena_text(arena, key, strlen(key)),
                         .speed = request->speed,
                         .fps = request->fps,
                         .from = request->from,
                         .duration = duration_of(pose),
                         .loop = pose->loop};
    memcpy(nodes, pose->nodes, pose->node_count * sizeof *nodes);
    pose->nodes = nodes;
    pose->form = API_POSE_NDJSON;
    pose->loop = TW_CLAMP; /* fold has applied the loop already */
    if (live->key) live->body = api_pose_body_create(pose, service, arena);
    if (live->body) return live;
  }
  tw_arena_destroy(arena);
  return NULL;
}

static api_outcome check_size(api_call *call, const api_pose_request *pose) {
  uint64_t numbers = api_pose_numbers(pose), cost = pose->clip ? tw_clip_cost(pose->clip->compiled) : 1;
  if (pose->model->node_count * cost > FRAME_NODES && cost > 1 && pose->model->node_count <= FRAME_NODES)
    return api_fail_with(call, 422, "a pose takes %llu clips of %u %s, over the limit of %d for live poses",
                         (unsigned long long)cost, pose->model->node_count,
                         tw_plural(pose->model->node_count, "node", "nodes"), FRAME_NODES);
  if (pose->model->node_count > FRAME_NODES)
    return api_fail_with(call, 422, "the model has %u nodes, over the limit of %d for live poses",
                         pose->model->node_count, FRAME_NODES);
  if (numbers > FRAME_NUMBERS)
    return api_fail_with(call, 422, "a pose has %llu numbers, over the limit of %d for live poses",
                         (unsigned long long)numbers, FRAME_NUMBERS);
  return API_DONE;
}

/* About the bytes of a frame of so many numbers. */
static uint64_t frame_size(uint64_t numbers) {
  enum { REST = 256 };
  return REST + numbers * API_POSE_NUMBER_BYTES;
}

static api_outcome reply_live(api_call *call, live_request *request) {
  const char *key = make_key(call, request);
  live_poses *live = key ? create_live(request, call->service, key) : NULL;
  if (!live) return api_fail_without_memory(call);
  uint64_t last = last_frame(live);
  api_answer_header(&call->answer, "Cache-Control", "no-store");
  if (request->has_last && request->last_id >= last) {
    destroy_live(live);
    call->answer.status = 204; /* tells an EventSource not to reconnect */
    return API_DONE;
  }
  const api_clip *played = request->pose.clip;
  if (played) api_call_warn(call, played->warnings, played->warning_count);
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  api_answer_header(&call->answer, "X-Accel-Buffering", "no"); /* keeps proxies from buffering */
  call->answer.live = (api_live){
      .key = live->key,
      .fps = request->fps,
      .first = request->has_last ? request->last_id + 1 : 0,
      .last = last,
      .joins = request->has_start || (live->loop != TW_CLAMP && !request->has_from && !request->has_last),
      .has_start = request->has_start,
      .start_ms = request->start_ms,
      .opening = "retry: 1000\n\n",
      .pulse = ":\n\n",
      .closing = "event: end\ndata: {}\n\n",
      .context = live,
      .size = tw_arena_size(live->arena),
      .frame_size = frame_size(api_pose_numbers(&request->pose)),
      .frame = print_frame,
      .stamp = print_stamp,
      .destroy = destroy_live,
  };
  return API_DONE;
}

static api_outcome answer_live(api_call *call, live_request *request) {
  api_outcome outcome = api_pose_request_resolve(call, true, &request->pose);
  if (outcome == API_DONE) outcome = check_size(call, &request->pose);
  if (outcome != API_DONE) return outcome;
  if (!request->has_from && request->speed < 0) request->from = duration_of(&request->pose);
  return reply_live(call, request);
}

api_outcome api_get_live(api_call *call) {
  live_request request;
  api_outcome outcome = read_request(call, &request);
  if (outcome == API_DONE) outcome = api_model_take(call, call->id, NULL, &request.pose.model_entry);
  if (outcome == API_DONE) outcome = answer_live(call, &request);
  api_pose_request_deinit(&request.pose);
  return outcome;
}
