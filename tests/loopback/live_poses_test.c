/* Live poses: what the frames are; when they are due is the server's part. */
#include "loopback.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A node that turns by a full turn about z and moves by 2 along x in 2 seconds. */
static const char spinner[] =
    "{'nodes':[{'name':'spinner'},{'name':'still'}],'clips':[{'name':'spin','tracks':[{'node':'spinner',"
    "'path':'rotation','times':[0,2],'unit':'degrees','axis_angles':[[0,0,1,0],[0,0,1,360]]},"
    "{'node':'spinner','path':'translation','times':[0,2],'values':[[0,0,0],[2,0,0]]}]}]}";

static int setup(void **state) {
  *state = one_model_start(NULL, spinner);
  return 0;
}

static reply ask_with(const one_model *f, const char *method, const char *query, const char *headers) {
  char target[512];
  snprintf(target, sizeof target, "/v1/models/%s/live?%s", f->id, query);
  return loopback_ask(f->loop, method, target, headers, NULL, 0);
}

static reply ask(const one_model *f, const char *query) {
  return ask_with(f, "GET", query, NULL);
}

/* A stream's answer. */
static reply open_stream(const one_model *f, const char *query) {
  reply r = ask(f, query);
  if (r.status != 200) fail_msg("%s: %d %s", query, r.status, r.body);
  assert_non_null(r.answer.live.frame);
  return r;
}

/* When frames are sent. */
#define NOW "1800000000123"

/* One frame's bytes with its stamp, terminated. */
static char *print_frame(const reply *r, uint64_t index) {
  api_bytes bytes;
  assert_true(r->answer.live.frame(r->answer.live.context, index, &bytes));
  char *text = malloc(bytes.size + API_LIVE_STAMP + 1);
  memcpy(text, bytes.data, bytes.size);
  size_t stamp = r->answer.live.stamp(strtoull(NOW, NULL, 10), text + bytes.size);
  text[bytes.size + stamp] = '\0';
  free((void *)(uintptr_t)bytes.data);
  return text;
}

/* The pose of a frame, after its form was looked at. */
static cJSON *read_frame(const reply *r, uint64_t index) {
  char *text = print_frame(r, index), head[64];
  size_t length = (size_t)snprintf(head, sizeof head, "id: %llu\ndata: {", (unsigned long long)index);
  assert_memory_equal(text, head, length);
  size_t size = strlen(text);
  assert_string_equal(text + size - 3, "}\n\n");
  assert_ptr_equal(strchr(text + length, '\n'), text + size - 2);
  cJSON *pose = cJSON_Parse(text + length - 1);
  assert_non_null(pose);
  free(text);
  return pose;
}

static double time_of(const reply *r, uint64_t index) {
  cJSON *pose = read_frame(r, index);
  double t = cJSON_GetObjectItem(pose, "t")->valuedouble;
  double x =
      cJSON_GetArrayItem(cJSON_GetArrayItem(cJSON_GetObjectItem(pose, "translation"), 0), 0)->valuedouble;
  assert_true(fabs(x - t) < 1e-5); /* the node's way is the clip's time */
  cJSON_Delete(pose);
  return t;
}

static void assert_times(const one_model *f, const char *query, size_t count, const double *expected) {
  reply r = open_stream(f, query);
  for (size_t i = 0; i < count; i++) {
    double t = time_of(&r, i);
    if (fabs(t - expected[i]) > 1e-6) fail_msg("%s: frame %zu is at %g, not %g", query, i, t, expected[i]);
  }
  reply_free(&r);
}

TEST_WITH(bad_parameters_are_400, setup, fixture_stop) {
  const char *const bad[] = {
      "speed=0",      "speed=1001", "speed=nan",  "fps=0",        "fps=241",
      "fps=-1",       "fps=x",      "from=inf",   "from=1e39",    "loop=on",
      "at=1",         "to=1",       "as=degrees", "unit=degrees", "as=trs&skinning=true",
      "space=screen", "start=-1",   "start=nan",  "start=1e14",   "start=noon"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_problem(ask(*state, bad[i]), 400, NULL, NULL);
  const char *const ids[] = {"Last-Event-ID: -1\n", "Last-Event-ID: 1x\n",
                             "Last-Event-ID: 1234567890123456\n"};
  for (size_t i = 0; i < sizeof ids / sizeof *ids; i++)
    assert_problem(ask_with(*state, "GET", "", ids[i]), 400, NULL, "Last-Event-ID");
}

TEST_WITH(times_of_frames_print_as_doubles, setup, fixture_stop) {
  reply r = open_stream(*state, "fps=30");
  char *text = print_frame(&r, 1);
  assert_non_null(strstr(text, "{\"t\":0.03333333333333333,"));
  free(text);
  reply_free(&r);
}

TEST_WITH(names_that_are_not_there_are_404, setup, fixture_stop) {
  assert_problem(ask(*state, "clip=dance"), 404, NULL, "spin");
  assert_problem(ask(*state, "nodes=leg"), 404, NULL, "leg");
  reply r = ask_with(*state, "GET", "", "Accept: application/json\n");
  assert_problem(r, 406, NULL, NULL);
}

TEST_WITH(too_large_a_pose_is_422, setup, fixture_stop) {
  const one_model *f = *state;
  enum { NODES = 6000 };
  char *text = malloc(NODES * 3 + 32), *end = text + sprintf(text, "{'nodes':[{}");
  for (int i = 1; i < NODES; i++) end += sprintf(end, ",{}");
  strcpy(end, "]}");
  char id[API_ID_TEXT], target[128];
  loopback_upload(f->loop, "application/json", text, id);
  free(text);
  snprintf(target, sizeof target, "/v1/models/%s/live", id);
  assert_problem(loopback_get(f->loop, target), 422, NULL, "60000 numbers");
  strcat(target, "?nodes=node_7,node_9");
  reply r = loopback_get(f->loop, target);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(a_clamped_stream_ends_exactly_at_the_clips_end, setup, fixture_stop) {
  assert_times(*state, "fps=0.7", 3, (double[]){0, 1 / 0.7, 2});
  reply r = open_stream(*state, "fps=0.7");
  assert_int_equal(r.answer.live.last, 2);
  assert_string_equal(r.answer.live.closing, "event: end\ndata: {}\n\n");
  reply_free(&r);
  r = open_stream(*state, "fps=60&speed=2");
  assert_int_equal(r.answer.live.last, 60);
  reply_free(&r);
  r = open_stream(*state, "from=5"); /* behind the end: one frame, which shows the last keys */
  assert_int_equal(r.answer.live.last, 0);
  reply_free(&r);
}

TEST_WITH(loops_fold_the_time, setup, fixture_stop) {
  assert_times(*state, "fps=2&speed=3&loop=repeat", 4, (double[]){0, 1.5, 1, 0.5});
  assert_times(*state, "fps=2&speed=3&loop=pingpong", 5, (double[]){0, 1.5, 1, 0.5, 2});
  assert_times(*state, "fps=2&from=1.25&loop=repeat", 3, (double[]){1.25, 1.75, 0.25});
  reply r = open_stream(*state, "loop=repeat");
  assert_true(r.answer.live.last == UINT64_MAX);
  reply_free(&r);
}

/* 86 steps of 0.1 / 0.1 seconds are 85.99999999999999; a pose at 86 s is the start of a round, too. */
TEST_WITH(a_round_begins_at_its_start_however_its_time_is_rounded, setup, fixture_stop) {
  reply r = open_stream(*state, "fps=0.1&speed=0.1&from=0&loop=repeat");
  const uint64_t frames[] = {84, 86, 162, 334, 374};
  for (size_t i = 0; i < sizeof frames / sizeof *frames; i++) assert_true(time_of(&r, frames[i]) == 0);
  assert_true(fabs(time_of(&r, 87) - 1) < 1e-6);
  reply_free(&r);
}

TEST_WITH(time_goes_backwards_from_the_end, setup, fixture_stop) {
  assert_times(*state, "fps=1&speed=-0.75", 4, (double[]){2, 1.25, 0.5, 0});
  assert_times(*state, "fps=1&speed=-1.5&loop=repeat&from=1", 3, (double[]){1, 1.5, 0});
  reply r = open_stream(*state, "fps=1&speed=-0.75");
  assert_int_equal(r.answer.live.last, 3);
  reply_free(&r);
}

/* A year at 60 frames a second: single precision would stand still for minutes. */
TEST_WITH(time_is_exact_after_a_year, setup, fixture_stop) {
  reply r = open_stream(*state, "fps=60&loop=repeat");
  const uint64_t frame = UINT64_C(60) * 86400 * 365 + 31;
  assert_true(fabs(time_of(&r, frame) - 31 / 60.0) < 1e-6);
  reply_free(&r);
}

TEST_WITH(angles_go_on_from_frame_to_frame, setup, fixture_stop) {
  reply r = open_stream(*state, "fps=4&as=euler&unit=degrees&nodes=spinner");
  for (uint64_t i = 0; i <= 8; i++) {
    cJSON *pose = read_frame(&r, i);
    const cJSON *angles = cJSON_GetArrayItem(cJSON_GetObjectItem(pose, "euler"), 0);
    double z = cJSON_GetArrayItem(angles, 2)->valuedouble;
    if (fabs(z - 45 * (double)i) > 1e-3) fail_msg("frame %d is at %g degrees", (int)i, z);
    cJSON_Delete(pose);
  }
  reply_free(&r);
}

TEST_WITH(a_frame_is_a_line_of_ndjson_and_the_time, setup, fixture_stop) {
  const one_model *f = *state;
  reply r = open_stream(f, "fps=4&as=matrix&space=world");
  char *frame = print_frame(&r, 3), target[128];
  snprintf(target, sizeof target, "/v1/models/%s/pose.ndjson?at=0.75&as=matrix&space=world", f->id);
  reply line = loopback_get(f->loop, target);
  const char *pose = strchr(frame, '{');
  assert_memory_equal(pose, line.body, line.size - 2);
  assert_string_equal(pose + line.size - 2, ",\"now\":" NOW "}\n\n");
  free(frame);
  reply_free(&line);
  reply_free(&r);
}

TEST_WITH(streams_are_not_stored_and_show_their_kind, setup, fixture_stop) {
  reply r = ask_with(*state, "GET", "", "Accept: text/event-stream\n");
  assert_string_equal(reply_header(&r, "Content-Type"), "text/event-stream");
  assert_string_equal(reply_header(&r, "Cache-Control"), "no-store");
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
  assert_null(reply_header(&r, "ETag"));
  reply_free(&r);
  r = ask_with(*state, "HEAD", "", NULL);
  assert_int_equal(r.status, 200);
  assert_string_equal(reply_header(&r, "Content-Type"), "text/event-stream");
  reply_free(&r);
}

TEST_WITH(last_event_id_goes_on_behind_it, setup, fixture_stop) {
  reply r = ask_with(*state, "GET", "fps=30", "Last-Event-ID: 41\n");
  assert_int_equal(r.status, 200);
  assert_int_equal(r.answer.live.first, 42);
  assert_false(r.answer.live.joins);
  reply_free(&r);
  r = ask_with(*state, "GET", "fps=30", "Last-Event-ID: 60\n");
  assert_int_equal(r.status, 204);
  assert_null(r.answer.live.frame);
  reply_free(&r);
}

static bool shares(const one_model *f, const char *one, const char *other) {
  reply a = open_stream(f, one), b = open_stream(f, other);
  bool same = strcmp(a.answer.live.key, b.answer.live.key) == 0;
  reply_free(&a);
  reply_free(&b);
  return same;
}

TEST_WITH(equal_parameters_have_equal_keys, setup, fixture_stop) {
  assert_true(shares(*state, "", "fps=30&from=0&speed=1.0&loop=clamp&nodes=still,spinner"));
  const char *const others[] = {"fps=29",   "from=0.5",  "speed=2",     "loop=repeat",        "nodes=still",
                                "as=euler", "as=matrix", "space=world", "interpolation=nlerp"};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++)
    if (shares(*state, "", others[i])) fail_msg("%s has the key of the defaults", others[i]);
}

TEST_WITH(looping_streams_join_unless_told_where_to_begin, setup, fixture_stop) {
  const struct {
    const char *query;
    bool joins;
  } cases[] = {{"loop=repeat", true}, {"loop=pingpong", true}, {"loop=repeat&from=0", false}, {"", false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = open_stream(*state, cases[i].query);
    assert_int_equal(r.answer.live.joins, cases[i].joins);
    assert_int_equal(r.answer.live.first, 0);
    reply_free(&r);
  }
}

TEST_WITH(streams_with_a_start_join_those_of_the_same, setup, fixture_stop) {
  const one_model *f = *state;
  reply r = open_stream(f, "start=1800000000000&from=1");
  assert_true(r.answer.live.joins && r.answer.live.has_start);
  assert_true(r.answer.live.start_ms == 1.8e12);
  reply_free(&r);
  r = open_stream(f, "loop=repeat");
  assert_false(r.answer.live.has_start);
  reply_free(&r);
  assert_true(shares(f, "start=1800000000000", "start=1.8e12"));
  assert_false(shares(f, "start=1800000000000", "start=1800000000001"));
  assert_false(shares(f, "start=0", ""));
}

TEST_WITH(a_model_without_clips_rests, setup, fixture_stop) {
  const one_model *f = *state;
  char id[API_ID_TEXT], target[128];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'a','translation':[1,2,3]}]}", id);
  snprintf(target, sizeof target, "/v1/models/%s/live", id);
  reply r = loopback_get(f->loop, target);
  assert_int_equal(r.answer.live.last, 0);
  char *text = print_frame(&r, 0);
  assert_true(says(text, "'translation':[[1,2,3]]"));
  free(text);
  reply_free(&r);
}

TEST_WITH(a_borrowed_clip_names_what_is_missing, setup, fixture_stop) {
  const one_model *f = *state;
  char id[API_ID_TEXT], target[160];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'other'}]}", id);
  snprintf(target, sizeof target, "/v1/models/%s/live?clip=%s/spin", id, f->id);
  reply r = loopback_get(f->loop, target);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "spinner"));
  reply_free(&r);
}

TEST_WITH(a_played_model_needs_no_thread, setup, fixture_stop) {
  const one_model *f = *state;
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s/live", f->id);
  reply r = loopback_get(f->loop, target);
  reply_free(&r);
  assert_true(loopback_is_light(f->loop, target));
}

/* Frames of long numbers, on which the estimate may be off by a third. */
TEST_WITH(a_stream_tells_what_it_holds, setup, fixture_stop) {
  enum { NODES = 2000, TRS = 10, MATRIX = 16 };
  const one_model *f = *state;
  char *model = malloc(64 * NODES), id[API_ID_TEXT], target[128];
  size_t size = (size_t)sprintf(model, "{'nodes':[");
  for (int i = 0; i < NODES; i++)
    size +=
        (size_t)sprintf(model + size, "%s{'translation':[%d.12345,0.12345,1.23456]}", i ? "," : "", i % 9);
  sprintf(model + size, "]}");
  loopback_upload(f->loop, "application/json", model, id);
  free(model);
  snprintf(target, sizeof target, "/v1/models/%s/live?space=world", id);
  reply r = loopback_get(f->loop, target);
  const api_live *live = &r.answer.live;
  /* Local transforms, world matrices, a row, the nodes' list. */
  uint64_t least = NODES * (uint64_t)(sizeof(float) * (TRS + MATRIX + TRS) + sizeof(uint32_t));
  assert_true(live->size >= least && live->size < 2 * least);
  api_bytes frame;
  assert_true(live->frame(live->context, 0, &frame));
  assert_true(live->frame_size > frame.size * 2 / 3 && live->frame_size < frame.size * 4);
  free((void *)(uintptr_t)frame.data);
  reply_free(&r);
}

/* What streams hold is counted, evicts what nobody uses, and is at most half of all memory. */
TEST(streams_hold_at_most_half_of_the_memory) {
  api_settings settings = loopback_settings();
  uint64_t most = settings.limits.max_memory = 16000000;
  loopback *loop = loopback_start(&settings);
  api_usage usage;
  assert_true(api_service_hold_live(loop->service, most / 2 - 100));
  assert_false(api_service_hold_live(loop->service, 101));
  api_service_usage(loop->service, &usage);
  assert_int_equal(usage.held[API_HELD_LIVE], most / 2 - 100);
  assert_true(api_service_hold_live(loop->service, 100));
  api_service_let_go(loop->service, API_HELD_LIVE, most / 2);

  api_service_hold(loop->service, API_HELD_BODY, most * 7 / 8); /* which others have */
  assert_false(api_service_hold_live(loop->service, most / 8));
  assert_true(api_service_hold_live(loop->service, most / 32));
  api_service_let_go(loop->service, API_HELD_BODY, most * 7 / 8);
  api_service_let_go(loop->service, API_HELD_LIVE, most / 32);
  loopback_stop(loop);
}

TEST(idle_entries_make_room_for_streams) {
  enum { STREAM = 1000000 };
  api_settings settings = loopback_settings();
  settings.limits.max_memory = 16000000;
  settings.limits.plan_cache = UINT64_MAX;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT];
  loopback_upload(loop, "application/json", spinner, id);
  api_usage before, after;
  api_service_usage(loop->service, &before);
  assert_true(before.cached[API_CACHED_MODEL].bytes > 0);
  uint64_t others = settings.limits.max_memory * 15 / 16 - STREAM; /* all is in use with the stream */
  api_service_hold(loop->service, API_HELD_BODY, others);
  assert_true(api_service_hold_live(loop->service, STREAM));
  api_service_usage(loop->service, &after);
  assert_int_equal(after.cached[API_CACHED_MODEL].bytes, 0);
  api_service_let_go(loop->service, API_HELD_BODY, others);
  api_service_let_go(loop->service, API_HELD_LIVE, STREAM);
  loopback_stop(loop);
}
