/* Requests that wait for memory beside each other, each call of the api made by hand. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "call.h"
#include "glb.h"
#include "loopback.h"
#include "service.h"
#include "tweend/format.h"
#include "wrapped_memory.h"

static const char *find_header(void *context, const char *name) {
  (void)context;
  return strcmp(name, "Content-Length") == 0 ? "1" : NULL;
}

/* An OBJ of [cells][cells] quads, terminated; freed by the caller. */
static char *print_grid(int cells) {
  size_t capacity = (size_t)(cells + 1) * (size_t)(cells + 1) * 64, size = 0;
  char *text = malloc(capacity);
  assert_non_null(text);
  for (int y = 0; y <= cells; y++)
    for (int x = 0; x <= cells; x++)
      size += (size_t)snprintf(text + size, capacity - size, "v %d %d 0\n", x, y);
  for (int y = 0; y < cells; y++) {
    for (int x = 0; x < cells; x++) {
      int corner = y * (cells + 1) + x + 1;
      size += (size_t)snprintf(text + size, capacity - size, "f %d %d %d %d\n", corner, corner + 1,
                               corner + cells + 2, corner + cells + 1);
    }
  }
  return text;
}

typedef struct waiter {
  loopback_ticket *ticket;
  api_request request;
  api_answer answer;
  api_progress progress;
} waiter;

static void begin(waiter *w, const char *path, const char *query, const char *body) {
  w->ticket = loopback_ticket_create();
  w->request = (api_request){.method = body ? "POST" : "GET",
                             .path = path,
                             .query = query,
                             .id = "request-1",
                             .header = find_header,
                             .ticket = &w->ticket->ticket};
  if (body) w->request.body = (api_bytes){(const uint8_t *)body, strlen(body)};
}

static void call(loopback *loop, waiter *w) {
  w->progress = api_handle(loop->service, &w->request, API_HEAVY, &w->answer);
}

static void end(loopback *loop, waiter *w) {
  assert_int_equal(w->answer.status, 200);
  api_answer_deinit(&w->answer);
  loopback_ticket_destroy(loop, w->ticket);
}

/* Each first asks for the memory to read the body, then for more: the surface's. Only the first part of both
 * fits at a time, or the second of one beside the first of the other. */
TEST(two_that_wait_for_more_do_not_take_it_from_each_other_for_ever) {
  enum { CELLS = 60, CALLS = 20 };
  char *grid = print_grid(CELLS);
  uint64_t reading = tw_reading_size(TW_FORMAT_OBJ, strlen(grid)),
           planning = CELLS * CELLS * 4 * 656 + (CELLS + 1) * (CELLS + 1) * 24;
  assert_true(reading < planning);
  api_settings settings = loopback_settings();
  uint64_t room = reading / 2 + planning / 2 + planning;
  settings.limits.max_memory = room + room / 15 + 1; /* a sixteenth is for small requests */
  settings.limits.max_waiting = 2;
  loopback *loop = loopback_start(&settings);
  api_budget *budget = loop->service->budget;
  api_ticket holder = {0};
  assert_true(api_budget_grant(budget, &holder, room - reading / 2 - planning / 2));
  waiter waiters[2] = {0};
  for (int i = 0; i < 2; i++) {
    begin(&waiters[i], "/v1/surface.glb", "level=3", grid);
    call(loop, &waiters[i]);
    assert_int_equal(waiters[i].progress, API_WAITS);
  }
  api_budget_grant(budget, &holder, 0);
  for (int calls = 0; waiters[0].progress == API_WAITS || waiters[1].progress == API_WAITS; calls++) {
    assert_true(calls < CALLS);
    waiter *next = &waiters[waiters[1].progress == API_WAITS && waiters[1].ticket->woken > 0];
    loopback_ticket_await(next->ticket);
    call(loop, next);
    /* An answer is read to its end at once. */
    if (next->progress == API_ANSWERED) end(loop, next);
  }
  free(grid);
  loopback_stop(loop);
}

/* A mesh of `triangles` triangles that a morph target moves, shown by `nodes` nodes. */
static glb_file build_moved(uint32_t triangles, uint32_t nodes) {
  uint32_t points = 3 * triangles;
  float *positions = calloc(points, sizeof(float[3]));
  size_t capacity = 2000 + 64 * (size_t)nodes, size;
  char *json = malloc(capacity);
  assert_true(positions && json);
  for (uint32_t p = 0; p < points; p++) {
    positions[3 * p] = (float)p;
    positions[3 * p + 1] = (float)(p % 3 / 2);
  }
  size = (size_t)snprintf(
      json, capacity,
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,'byteLength':%zu}"
      "],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':%u,'type':'VEC3','min':[0,0,0],"
      "'max':[%u,1,0]},{'componentType':5126,'count':%u,'type':'VEC3','min':[0,0,0],'max':[0,0,0]},"
      "{'componentType':5126,'count':1,'type':'SCALAR','min':[0],'max':[0]},"
      "{'componentType':5126,'count':1,'type':'SCALAR'}],'meshes':[{'primitives':[{'attributes':"
      "{'POSITION':0},'targets':[{'POSITION':1}]}]}],'animations':[{'samplers':[{'input':2,'output':3}],"
      "'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}]}],'nodes':[{'mesh':0}",
      points * sizeof(float[3]), points * sizeof(float[3]), points, points - 1, points);
  for (uint32_t n = 1; n < nodes; n++) size += (size_t)snprintf(json + size, capacity - size, ",{'mesh':0}");
  snprintf(json + size, capacity - size, "]}");
  glb_file file = glb_build(json, positions, points * sizeof(float[3]));
  free(positions);
  free(json);
  return file;
}

/* `count` times a piece of text between two others; freed by the caller. */
static char *print_repeated(const char *before, const char *piece, size_t count, const char *after) {
  char *text = malloc(strlen(before) + count * strlen(piece) + strlen(after) + 1);
  assert_non_null(text);
  char *end = stpcpy(text, before);
  for (size_t i = 0; i < count; i++) end = stpcpy(end, piece);
  strcpy(end, after);
  return text;
}

/* Asks when the service has memory for the request, then when it has ROOM: the request is refused before it
 * holds more. The model is cached, unless it was evicted to make room. */
static void assert_asks_first(const char *model, size_t size, const char *target, const char *body,
                              int status) {
  enum { ROOM = 4 << 20 };
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 32 << 20;
  settings.limits.max_memory = 256 << 20;
  settings.limits.max_waiting = 0;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], full[160];
  reply r = loopback_ask(loop, "POST", "/v1/models", NULL, model, size);
  if (r.status != 201) fail_msg("%d %s", r.status, r.body);
  memcpy(id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
  reply_free(&r);
  snprintf(full, sizeof full, "/v1/models/%s/%s", id, target);
  const char *method = body ? "POST" : "GET";
  size_t body_size = body ? strlen(body) : 0;
  r = loopback_ask(loop, method, full, NULL, body, body_size);
  if (r.status != status) fail_msg("%s: %d %.300s", target, r.status, r.body);
  reply_free(&r);
  api_ticket holder = {0};
  assert_true(
      api_budget_grant(loop->service->budget, &holder,
                       settings.limits.max_memory / 16 * 15 - ROOM - api_budget_used(loop->service->budget)));
  size_t before = test_memory.most = test_memory.held;
  r = loopback_ask(loop, method, full, NULL, body, body_size);
  if (test_memory.most - before > ROOM + API_UNGRANTED)
    fail_msg("%s: %d after %zu bytes", target, r.status, test_memory.most - before);
  assert_problem(r, 503, NULL, "memory");
  api_budget_grant(loop->service->budget, &holder, 0);
  loopback_stop(loop);
}

TEST(no_more_memory_is_taken_than_is_granted) {
  glb_file moved = build_moved(700, 1000);
  assert_asks_first((char *)moved.bytes, moved.size, "surface.glb?level=0&skin=bake&at=0", NULL, 200);
  free(moved.bytes);
  char *nodes = print_repeated("{\"nodes\":[{}", ",{}", 60000, "]}");
  assert_asks_first(nodes, strlen(nodes), "pose.json?space=world&from=0&to=50&fps=1", NULL, 200);
  free(nodes);
  const char turning[] =
      "{\"meshes\":[{\"shape\":{\"kind\":\"box\"}}],\"nodes\":[{\"name\":\"n\"}],\"clips\":"
      "[{\"tracks\":[{\"node\":\"n\",\"path\":\"rotation\",\"times\":[0],\"quaternions\":"
      "[[0,0,0,1]]}]}]}";
  assert_asks_first(turning, strlen(turning), "surface.glb?level=0&from=0&to=4000&fps=100", NULL, 200);
  char *points = print_repeated("", "v 0 0 0\n", 500000, "");
  assert_asks_first(turning, strlen(turning), "detail?level=1", points, 422);
  free(points);
}

TEST(small_models_are_answered_beside_one_that_takes_all_memory) {
  static const char triangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  api_settings settings = loopback_settings();
  settings.limits.max_waiting = 0;
  loopback *loop = loopback_start(&settings);
  api_budget *budget = loop->service->budget;
  api_ticket holder = {0};
  assert_true(api_budget_grant(budget, &holder, settings.limits.max_memory));
  assert_true(holder.granted > settings.limits.max_memory / 10 * 9);
  static const char *const targets[] = {"/v1/surface.glb?level=1", "/v1/surface.stl", "/v1/models"};
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
    reply r = loopback_post(loop, targets[i], "text/plain", triangle);
    if (r.status != 200 && r.status != 201) fail_msg("%s: %d %s", targets[i], r.status, r.body);
    reply_free(&r);
  }
  api_budget_grant(budget, &holder, 0);
  loopback_stop(loop);
}

TEST(probes_are_answered_whatever_memory_others_hold) {
  api_settings settings = loopback_settings();
  settings.limits.max_waiting = 0;
  loopback *loop = loopback_start(&settings);
  api_budget *budget = loop->service->budget;
  api_ticket holder = {0};
  assert_true(api_budget_grant(budget, &holder, 2 * settings.limits.max_memory));
  static const char *const paths[] = {"/healthz", "/readyz", "/version", "/metrics"};
  for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
    reply r = loopback_get(loop, paths[i]);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  api_budget_grant(budget, &holder, 0);
  loopback_stop(loop);
}
