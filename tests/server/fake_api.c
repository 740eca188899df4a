#include "fake_api.h"

#include "api.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct api_service {
  char unused;
};

static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t opened = PTHREAD_COND_INITIALIZER;
static bool held = false;
static atomic_size_t started, open_bodies, block_size, kept_promises;
static atomic_bool is_memory_full;
static atomic_uint_fast64_t held_bytes[API_HELD_COUNT];

void fake_api_hold(void) {
  pthread_mutex_lock(&gate);
  held = true;
  pthread_mutex_unlock(&gate);
}

void fake_api_release(void) {
  pthread_mutex_lock(&gate);
  held = false;
  pthread_cond_broadcast(&opened);
  pthread_mutex_unlock(&gate);
}

void fake_api_fill_memory(bool is_full) {
  atomic_store(&is_memory_full, is_full);
}

uint64_t fake_api_held(api_held what) {
  return atomic_load(&held_bytes[what]);
}

size_t fake_api_started(void) {
  return atomic_load(&started);
}
size_t fake_api_open_bodies(void) {
  return atomic_load(&open_bodies);
}

size_t fake_api_kept_promises(void) {
  return atomic_load(&kept_promises);
}

size_t fake_api_block_size(void) {
  return atomic_load(&block_size);
}

static void wait_at_gate(void) {
  atomic_fetch_add(&started, 1);
  pthread_mutex_lock(&gate);
  while (held) pthread_cond_wait(&opened, &gate);
  pthread_mutex_unlock(&gate);
}

static void answer_bytes(api_answer *answer, int status, const void *bytes, size_t size) {
  uint8_t *copy = malloc(size + 1);
  if (copy == NULL) abort();
  memcpy(copy, bytes, size);
  *answer = (api_answer){.status = status,
                         .header_count = 1,
                         .headers = {{"Content-Type", "text/plain"}},
                         .bytes = {copy, size}};
}

/* What a handler sees of a field. */
static void answer_header(api_answer *answer, const api_request *request) {
  const char *value = request->header(request->context, request->query);
  answer_bytes(answer, 200, value != NULL ? value : "none", strlen(value != NULL ? value : "none"));
}

/* With fields of 2 KiB. */
static void answer_wide(api_answer *answer) {
  static char value[100];
  memset(value, 'v', sizeof value - 1);
  answer_bytes(answer, 200, "wide", 4);
  while (answer->header_count < 20) answer->headers[answer->header_count++] = (api_header){"X-Wide", value};
}

typedef struct stream {
  uint64_t position, end, breaks_at;
} stream;

static int64_t read_stream(void *context, uint8_t *out, size_t capacity) {
  stream *s = context;
  atomic_store(&block_size, capacity);
  if (s->position >= s->breaks_at) return -1;
  enum { PERIOD = 251 };
  uint64_t end = s->end < s->breaks_at ? s->end : s->breaks_at, left = end - s->position;
  size_t size = left < capacity ? (size_t)left : capacity;
  for (size_t i = 0; i < size && i < PERIOD; i++) out[i] = (uint8_t)((s->position + i) % PERIOD);
  for (size_t i = PERIOD; i < size; i += PERIOD) memcpy(out + i, out, size - i < PERIOD ? size - i : PERIOD);
  s->position += size;
  return (int64_t)size;
}

static void destroy_stream(void *context) {
  atomic_fetch_sub(&open_bodies, 1);
  free(context);
}

static int64_t read_slowly(void *context, uint8_t *out, size_t capacity) {
  wait_at_gate();
  return read_stream(context, out, capacity);
}

static void answer_stream(api_answer *answer, uint64_t size, uint64_t end, uint64_t breaks_at) {
  stream *s = malloc(sizeof *s);
  if (s == NULL) abort();
  *s = (stream){0, end, breaks_at};
  atomic_fetch_add(&open_bodies, 1);
  *answer = (api_answer){
      .status = 200, .body = {.size = size, .context = s, .read = read_stream, .destroy = destroy_stream}};
}

static bool print_frame(void *context, uint64_t index, api_bytes *out) {
  const stream *s = context;
  char *text = malloc(32 + s->end);
  if (text == NULL) return false;
  int size = snprintf(text, 32, "frame %llu\n", (unsigned long long)index);
  memset(text + size, 'x', s->end);
  *out = (api_bytes){(uint8_t *)text, (size_t)size + s->end};
  return true;
}

static size_t print_stamp(uint64_t now_ms, char out[API_LIVE_STAMP]) {
  (void)now_ms;
  (void)out;
  return 0;
}

static void answer_live(api_answer *answer, const char *query) {
  stream *s = malloc(sizeof *s);
  char *rest;
  if (s == NULL) abort();
  uint64_t last = strtoull(query, &rest, 10);
  *s = (stream){.end = *rest == ',' ? strtoull(rest + 1, NULL, 10) : 0};
  atomic_fetch_add(&open_bodies, 1);
  *answer = (api_answer){.status = 200,
                         .header_count = 1,
                         .headers = {{"Content-Type", "text/event-stream"}},
                         .live = {.key = "live",
                                  .fps = 100,
                                  .last = last,
                                  .opening = "opening\n",
                                  .pulse = ":\n",
                                  .closing = "closing\n",
                                  .context = s,
                                  .frame = print_frame,
                                  .stamp = print_stamp,
                                  .destroy = destroy_stream}};
}

/* Computes for as long in each of three calls, with waits between them. */
static api_progress run_leg(const api_request *request, api_answer *answer) {
  long ms = strtol(request->query, NULL, 10);
  nanosleep(&(struct timespec){.tv_nsec = ms * 1000000}, NULL);
  if (request->ticket->needed++ == 2) {
    answer_stream(answer, 10, 10, UINT64_MAX);
    return API_ANSWERED;
  }
  request->ticket->pauses(request->ticket);
  request->ticket->wake(request->ticket);
  return API_WAITS;
}

/* What light calls of heavy requests promise to make. */
static struct api_entry *const promise = (struct api_entry *)&opened;

static bool is(const api_request *request, const char *path) {
  return strcmp(request->path, path) == 0;
}

api_verdict api_open(api_service *service, const api_request *request, api_answer *answer) {
  (void)service;
  static const char *const KNOWN[] = {"/light",  "/heavy",   "/echo",      "/pull",   "/endless", "/chunks",
                                      "/broken", "/nothing", "/unchanged", "/readyz", "/healthz", "/live",
                                      "/header", "/wide",    "/stuck",     "/waits"};
  for (size_t i = 0; i < sizeof KNOWN / sizeof *KNOWN; i++) {
    if (is(request, KNOWN[i])) return API_READ_BODY;
  }
  api_problem(404, "nothing here", request->id, 0, answer);
  return API_REFUSED;
}

api_progress api_handle(api_service *service, const api_request *request, api_effort effort,
                        api_answer *answer) {
  (void)service;
  bool heavy = is(request, "/heavy") || is(request, "/echo"), has_legs = is(request, "/legs");
  if (heavy && effort == API_LIGHT) request->ticket->promised = promise;
  if ((heavy || has_legs) && effort == API_LIGHT) return API_AGAIN_ON_THREAD;
  if (has_legs) return run_leg(request, answer);
  if (is(request, "/waits")) {
    request->ticket->is_waiting_for_memory = true;
    return API_WAITS;
  }
  request->ticket->promised = NULL;
  uint64_t size = strtoull(request->query, NULL, 10);
  if (heavy || is(request, "/stuck")) wait_at_gate();
  if (is(request, "/echo")) {
    answer_bytes(answer, 200, request->body.data, request->body.size);
  } else if (is(request, "/wide")) {
    answer_wide(answer);
  } else if (is(request, "/header")) {
    answer_header(answer, request);
  } else if (is(request, "/pull")) {
    answer_stream(answer, size, size, UINT64_MAX);
  } else if (is(request, "/slow")) {
    answer_stream(answer, size, size, UINT64_MAX);
    answer->body.read = read_slowly;
    answer->body.is_slow = true;
  } else if (is(request, "/endless")) {
    answer_stream(answer, UINT64_C(1) << 40, UINT64_MAX, UINT64_MAX);
  } else if (is(request, "/chunks")) {
    answer_stream(answer, API_SIZE_UNKNOWN, size, UINT64_MAX);
  } else if (is(request, "/broken")) {
    answer_stream(answer, 1000000, UINT64_MAX, size);
  } else if (is(request, "/live")) {
    answer_live(answer, request->query);
  } else if (is(request, "/nothing")) {
    *answer = (api_answer){.status = 204};
  } else if (is(request, "/unchanged")) {
    *answer = (api_answer){.status = 304};
  } else {
    answer_bytes(answer, 200, request->path + 1, strlen(request->path) - 1);
  }
  return API_ANSWERED;
}

void api_service_hold(api_service *service, api_held what, uint64_t bytes) {
  (void)service;
  atomic_fetch_add(&held_bytes[what], bytes);
}

void api_service_let_go(api_service *service, api_held what, uint64_t bytes) {
  (void)service;
  atomic_fetch_sub(&held_bytes[what], bytes);
}

bool api_service_try_hold(api_service *service, api_held what, uint64_t bytes) {
  (void)service;
  if (atomic_load(&is_memory_full)) return false;
  atomic_fetch_add(&held_bytes[what], bytes);
  return true;
}

bool api_service_hold_live(api_service *service, uint64_t bytes) {
  return api_service_try_hold(service, API_HELD_LIVE, bytes);
}

void api_service_usage(const api_service *service, api_usage *out) {
  (void)service;
  *out = (api_usage){0};
}

bool api_ticket_cancel(api_service *service, api_ticket *ticket) {
  (void)service;
  bool waited = ticket->is_waiting_for_memory;
  ticket->is_waiting_for_memory = false;
  return waited;
}

void api_ticket_end(api_service *service, api_ticket *ticket) {
  (void)service;
  ticket->promised = NULL;
}

void api_problem(int status, const char *detail, const char *request_id, unsigned retry_after,
                 api_answer *answer) {
  char text[512];
  int size = snprintf(text, sizeof text, "%d %s (%s)", status, detail, request_id);
  answer_bytes(answer, status, text, (size_t)size);
  if (retry_after > 0) answer->headers[answer->header_count++] = (api_header){"Retry-After", "1"};
}

void api_refuse(api_service *service, const api_request *request, int status, const char *detail,
                unsigned retry_after, api_answer *answer) {
  (void)service;
  if (request->ticket != NULL && request->ticket->promised != NULL) atomic_fetch_add(&kept_promises, 1);
  api_problem(status, detail, request->id, retry_after, answer);
}

void api_answer_deinit(api_answer *answer) {
  if (answer->body.destroy != NULL) answer->body.destroy(answer->body.context);
  if (answer->live.destroy != NULL) answer->live.destroy(answer->live.context);
  free((void *)(uintptr_t)answer->bytes.data);
  *answer = (api_answer){0};
}

const api_keys *api_service_keys(const api_service *service) {
  (void)service;
  return NULL;
}

api_rate api_key_rate(const api_service *service, const api_request *request, uint8_t id[16]) {
  (void)service;
  (void)request;
  (void)id;
  return (api_rate){0};
}

void api_path_normalize(char *path) {
  (void)path; /* the paths here have nothing to undo */
}

const char *api_route_name(const char *path) {
  return strcmp(path, "/light") == 0 ? "/light" : "other";
}
