/* Requests that wait for memory beside each other, each call of the api made by hand. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "loopback.h"
#include "service.h"
#include "tweend/format.h"

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
