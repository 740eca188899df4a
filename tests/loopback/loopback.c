/* The harness of the loopback tests. */
#include "loopback.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "wrapped_memory.h"

/* ---- store ----------------------------------------------------------------------------------- */

typedef struct memory_object {
  char id[API_ID_TEXT];
  uint8_t *bytes;
  size_t size;
  char *summary;
  bool is_damaged;
} memory_object;

typedef struct memory_store {
  pthread_mutex_t lock;
  memory_object *objects; /* ascending ids */
  size_t count, opens;
  bool fails, forgets, cuts;
  uint64_t room;         /* 0: without end */
  const char *first_put; /* another's summary, which the next put finds stored; or NULL */
} memory_store;

/* Locks the store. Its own allocations never fail. */
static void enter(memory_store *store) {
  pthread_mutex_lock(&store->lock);
  test_memory.is_spared = true;
}

static void leave(memory_store *store) {
  test_memory.is_spared = false;
  pthread_mutex_unlock(&store->lock);
}

/* The index of the object with this id, or the index at which to insert it. */
static size_t find_object(const memory_store *store, const char *id, bool *found) {
  size_t i = 0;
  while (i < store->count && strcmp(store->objects[i].id, id) < 0) i++;
  *found = i < store->count && strcmp(store->objects[i].id, id) == 0;
  return i;
}

static api_store_status store_put(void *context, const char *id, api_bytes bytes, const char *summary,
                                  bool *existed) {
  memory_store *store = context;
  enter(store);
  bool fails = store->fails;
  size_t i = find_object(store, id, existed);
  bool is_second = !*existed && store->first_put;
  if (is_second) summary = store->first_put;
  store->first_put = NULL;
  if (!fails && !*existed) {
    store->objects = realloc(store->objects, (store->count + 1) * sizeof *store->objects);
    memmove(store->objects + i + 1, store->objects + i, (store->count - i) * sizeof *store->objects);
    memory_object *object = &store->objects[i];
    *object =
        (memory_object){.bytes = malloc(bytes.size + 1), .size = bytes.size, .summary = strdup(summary)};
    memcpy(object->id, id, API_ID_TEXT);
    memcpy(object->bytes, bytes.data, bytes.size);
    store->count++;
  }
  if (!fails && *existed && store->objects[i].is_damaged) *existed = store->objects[i].is_damaged = false;
  *existed |= is_second;
  leave(store);
  return fails ? API_STORE_UNAVAILABLE : API_STORE_OK;
}

/* A blob's own copy of the object. */
typedef struct memory_copy {
  memory_store *store;
  uint8_t bytes[];
} memory_copy;

static bool read_blob(const api_blob *blob, uint64_t offset, uint8_t *out, size_t size) {
  const memory_copy *copy = blob->owner;
  assert_true(offset <= blob->size && size <= blob->size - offset);
  memcpy(out, copy->bytes + offset, size);
  enter(copy->store);
  bool cuts = copy->store->cuts;
  leave(copy->store);
  return !cuts;
}

static void close_blob(api_blob *blob) {
  free(blob->owner);
}

static api_store_status store_open(void *context, const char *id, api_blob *out) {
  memory_store *store = context;
  enter(store);
  store->opens++;
  bool found, fails = store->fails;
  size_t i = find_object(store, id, &found);
  bool is_damaged = found && store->objects[i].is_damaged;
  if (found && !fails && !is_damaged) {
    const memory_object *object = &store->objects[i];
    memory_copy *copy = malloc(sizeof *copy + object->size);
    copy->store = store;
    memcpy(copy->bytes, object->bytes, object->size);
    *out = (api_blob){.size = object->size, .owner = copy, .read = read_blob, .close = close_blob};
  }
  leave(store);
  if (fails) return API_STORE_UNAVAILABLE;
  return is_damaged ? API_STORE_DAMAGED : found ? API_STORE_OK : API_STORE_ABSENT;
}

static api_store_status store_look(void *context, const char *id, bool may_wait) {
  memory_store *store = context;
  (void)may_wait;
  enter(store);
  bool found, fails = store->fails;
  size_t i = find_object(store, id, &found);
  bool is_damaged = found && store->objects[i].is_damaged;
  leave(store);
  if (fails) return API_STORE_UNAVAILABLE;
  return is_damaged ? API_STORE_DAMAGED : found ? API_STORE_OK : API_STORE_ABSENT;
}

static api_store_status store_remove(void *context, const char *id) {
  memory_store *store = context;
  enter(store);
  bool found, fails = store->fails;
  size_t i = find_object(store, id, &found);
  if (found && !fails) {
    free(store->objects[i].bytes);
    free(store->objects[i].summary);
    store->count--;
    memmove(store->objects + i, store->objects + i + 1, (store->count - i) * sizeof *store->objects);
  }
  leave(store);
  return fails ? API_STORE_UNAVAILABLE : found ? API_STORE_OK : API_STORE_ABSENT;
}

static char *store_summary(void *context, const char *id) {
  memory_store *store = context;
  enter(store);
  bool found;
  size_t i = find_object(store, id, &found);
  char *copy =
      found && !store->forgets && store->objects[i].summary ? strdup(store->objects[i].summary) : NULL;
  leave(store);
  return copy;
}

static api_store_status store_list(void *context, const char *after, size_t limit, api_listed *out,
                                   size_t *count, bool *more) {
  memory_store *store = context;
  enter(store);
  bool fails = store->fails;
  size_t i = 0, n = 0;
  while (i < store->count && strcmp(store->objects[i].id, after) <= 0) i++;
  for (; !fails && i < store->count && n < limit; i++, n++) {
    out[n] = (api_listed){.size = store->objects[i].size,
                          .summary = store->forgets ? NULL : strdup(store->objects[i].summary)};
    memcpy(out[n].id, store->objects[i].id, API_ID_TEXT);
  }
  *count = n;
  *more = i < store->count;
  leave(store);
  return fails ? API_STORE_UNAVAILABLE : API_STORE_OK;
}

static api_store_status store_probe(void *context) {
  memory_store *store = context;
  enter(store);
  bool fails = store->fails;
  leave(store);
  return fails ? API_STORE_UNAVAILABLE : API_STORE_OK;
}

static api_store_status store_room(void *context, uint64_t size) {
  memory_store *store = context;
  enter(store);
  bool has_room = store->room == 0 || size <= store->room;
  leave(store);
  return has_room ? API_STORE_OK : API_STORE_FULL;
}

void loopback_store_fail(loopback *loop, bool fails) {
  pthread_mutex_lock(&loop->store->lock);
  loop->store->fails = fails;
  pthread_mutex_unlock(&loop->store->lock);
}

void loopback_store_damage(loopback *loop, const char *id) {
  bool found;
  pthread_mutex_lock(&loop->store->lock);
  size_t i = find_object(loop->store, id, &found);
  assert_true(found);
  loop->store->objects[i].is_damaged = true;
  pthread_mutex_unlock(&loop->store->lock);
}

void loopback_store_cut(loopback *loop, bool cuts) {
  pthread_mutex_lock(&loop->store->lock);
  loop->store->cuts = cuts;
  pthread_mutex_unlock(&loop->store->lock);
}

void loopback_store_narrow(loopback *loop, uint64_t room) {
  loop->store->room = room;
}

void loopback_store_come_second(loopback *loop, const char *summary) {
  loop->store->first_put = summary;
}

void loopback_store_forget_summaries(loopback *loop) {
  loop->store->forgets = true;
}

size_t loopback_store_count(loopback *loop) {
  return loop->store->count;
}

size_t loopback_store_opens(loopback *loop) {
  return loop->store->opens;
}

/* ---- service --------------------------------------------------------------------------------- */

static char *print_metrics(void *owner, size_t *size) {
  (void)owner;
  char *text = strdup("up 1\n");
  *size = text ? strlen(text) : 0;
  return text;
}

api_settings loopback_settings(void) {
  return (api_settings){
      .limits = {.max_upload = 1 << 20,
                 .max_level = 10,
                 .max_faces = 80000000,
                 .max_output = (uint64_t)4 << 30,
                 .max_times = 1000000,
                 .plan_cache = 64 << 20,
                 .max_memory = 1 << 30,
                 .max_waiting = 8},
      .metrics = {NULL, print_metrics},
      .cors_origins = "*",
  };
}

loopback *loopback_start(const api_settings *settings) {
  loopback *loop = calloc(1, sizeof *loop);
  loop->store = calloc(1, sizeof *loop->store);
  pthread_mutex_init(&loop->store->lock, NULL);
  loop->settings = *settings;
  loop->settings.store = (api_store){loop->store,   store_put,  store_open,  store_look, store_remove,
                                     store_summary, store_list, store_probe, store_room};
  loop->service = api_service_create(&loop->settings);
  assert_non_null(loop->service);
  return loop;
}

void loopback_stop(loopback *loop) {
  api_service_destroy(loop->service);
  for (size_t i = 0; i < loop->store->count; i++) {
    free(loop->store->objects[i].bytes);
    free(loop->store->objects[i].summary);
  }
  pthread_mutex_destroy(&loop->store->lock);
  free(loop->store->objects);
  free(loop->store);
  free(loop);
}

int loopback_setup(void **state) {
  api_settings settings = loopback_settings();
  *state = loopback_start(&settings);
  return 0;
}

int loopback_teardown(void **state) {
  loopback_stop(*state);
  return 0;
}

one_model *one_model_start(const api_settings *settings, const char *json) {
  api_settings usual = loopback_settings();
  one_model *m = calloc(1, sizeof *m);
  m->loop = loopback_start(settings ? settings : &usual);
  loopback_upload(m->loop, "application/json", json, m->id);
  return m;
}

int fixture_stop(void **state) {
  loopback **first = *state;
  loopback_stop(*first);
  free(first);
  return 0;
}

/* ---- requests -------------------------------------------------------------------------------- */

enum { HEADERS_MAX = 16, HEADER_TEXT = 4096 };

typedef struct header_list {
  char text[HEADER_TEXT]; /* split into terminated names and values */
  const char *names[HEADERS_MAX], *values[HEADERS_MAX];
  size_t count;
  char length[24];
} header_list;

static const char *find_header(void *context, const char *name) {
  const header_list *list = context;
  for (size_t i = 0; i < list->count; i++)
    if (strcasecmp(list->names[i], name) == 0) return list->values[i];
  return NULL;
}

static void split_headers(header_list *list, const char *text) {
  assert_true(strlen(text) < HEADER_TEXT);
  strcpy(list->text, text);
  for (char *line = list->text; *line;) {
    char *end = strchr(line, '\n');
    char *colon = strstr(line, ": ");
    assert_true(end && colon && colon < end && list->count < HEADERS_MAX - 1);
    *end = *colon = '\0';
    list->names[list->count] = line;
    list->values[list->count++] = colon + 2;
    line = end + 1;
  }
}

static void read_body(reply *r) {
  api_answer *answer = &r->answer;
  if (!answer->body.read) {
    r->size = answer->bytes.size;
    r->body = malloc(r->size + 1);
    if (r->size) memcpy(r->body, answer->bytes.data, r->size);
    r->body[r->size] = '\0';
    return;
  }
  size_t capacity = 0;
  for (;;) {
    if (capacity - r->size < 5001) r->body = realloc(r->body, capacity = capacity * 2 + 20000);
    int64_t count = answer->body.read(answer->body.context, (uint8_t *)r->body + r->size, 5000);
    assert_true(count >= 0 && count <= 5000);
    if (count == 0) break;
    r->size += (size_t)count;
  }
  r->body[r->size] = '\0';
  if (answer->body.size != API_SIZE_UNKNOWN) assert_int_equal(r->size, answer->body.size);
}

static void prepare(api_request *request, header_list *list, char *path, const char *method,
                    const char *target, const char *headers, const void *body, size_t size) {
  *list = (header_list){.count = 0};
  split_headers(list, headers ? headers : "");
  if (body && !find_header(list, "Content-Length") && !find_header(list, "Transfer-Encoding")) {
    snprintf(list->length, sizeof list->length, "%zu", size);
    list->names[list->count] = "Content-Length";
    list->values[list->count++] = list->length;
  }
  strcpy(path, target);
  char *query = strchr(path, '?');
  if (query) *query++ = '\0';
  *request = (api_request){.method = method,
                           .path = path,
                           .query = query ? query : "",
                           .id = "request-1",
                           .host = find_header(list, "Host"),
                           .header = find_header,
                           .context = list,
                           .body = {body, size}};
}

/* ---- tickets --------------------------------------------------------------------------------- */

static void wake(api_ticket *ticket) {
  loopback_ticket *t = (loopback_ticket *)(void *)ticket;
  pthread_mutex_lock(&t->lock);
  t->woken++;
  pthread_cond_signal(&t->changed);
  pthread_mutex_unlock(&t->lock);
}

loopback_ticket *loopback_ticket_create(void) {
  loopback_ticket *t = calloc(1, sizeof *t);
  assert_non_null(t);
  t->ticket.wake = wake;
  pthread_mutex_init(&t->lock, NULL);
  pthread_cond_init(&t->changed, NULL);
  return t;
}

void loopback_ticket_await(loopback_ticket *t) {
  pthread_mutex_lock(&t->lock);
  while (t->woken == 0) pthread_cond_wait(&t->changed, &t->lock);
  t->woken--;
  pthread_mutex_unlock(&t->lock);
}

void loopback_ticket_destroy(loopback *loop, loopback_ticket *t) {
  if (!t) return;
  if (loop) api_ticket_end(loop->service, &t->ticket);
  pthread_cond_destroy(&t->changed);
  pthread_mutex_destroy(&t->lock);
  free(t);
}

/* Handles a request as light, then as heavy if needed, and again whenever it has waited. */
static void loopback_handle(loopback *loop, const api_request *request, api_answer *answer) {
  api_effort effort = API_LIGHT;
  for (;;) {
    switch (api_handle(loop->service, request, effort, answer)) {
    case API_ANSWERED: return;
    case API_LOOK_ON_THREAD: assert_int_equal(effort, API_LIGHT); break;
    case API_AGAIN_ON_THREAD: assert_int_not_equal(effort, API_HEAVY); break;
    case API_WAITS: loopback_ticket_await((loopback_ticket *)(void *)request->ticket); break;
    }
    effort = API_HEAVY;
  }
}

/* Asserts that no noun behind a count of 1 is a plural ("1 faces") in the members of a body that begin so, up
 * to their end. Verbs follow numbers of things: "mesh 1 has". */
static void assert_counts_agree(const char *body, const char *member) {
  static const char letters[] = "abcdefghijklmnopqrstuvwxyz", verbs[] = " is was has lies moves does occurs ";
  for (const char *at = strstr(body, member); at; at = strstr(at, member)) {
    const char *end = strpbrk(at, "]}");
    if (!end) return;
    for (; at < end; at++) {
      if (strncmp(at, "1 ", 2) != 0 || !strchr(" \"'(", at[-1])) continue;
      size_t length = strspn(at + 2, letters);
      char word[32];
      snprintf(word, sizeof word, " %.*s ", (int)length, at + 2);
      if (length > 1 && at[1 + length] == 's' && !strstr(verbs, word))
        fail_msg("a count of 1 before a plural: %.100s", at);
    }
  }
}

reply loopback_ask(loopback *loop, const char *method, const char *target, const char *headers,
                   const void *body, size_t size) {
  header_list list;
  char *path = malloc(strlen(target) + 1);
  api_request request;
  prepare(&request, &list, path, method, target, headers, body, size);
  request.now_s = loop->now_s;
  request.is_local = loop->is_local;
  request.is_admin = loop->is_admin;
  reply r = {0};
  if (api_open(loop->service, &request, &r.answer) == API_REFUSED) {
    r.refused = true;
  } else {
    r.ticket = loopback_ticket_create();
    request.ticket = &r.ticket->ticket;
    loopback_handle(loop, &request, &r.answer);
  }
  r.loop = loop;
  free(path);
  r.status = r.answer.status;
  if (strcmp(method, "HEAD") != 0) read_body(&r);
  const char *type = reply_header(&r, "Content-Type");
  bool is_problem = type && strstr(type, "problem+json"), is_json = type && strstr(type, "json");
  if (r.body && is_json) assert_counts_agree(r.body, is_problem ? "\"detail\":" : "\"warnings\":[");
  return r;
}

bool loopback_is_light(loopback *loop, const char *target) {
  header_list list;
  char *path = malloc(strlen(target) + 1);
  api_request request;
  prepare(&request, &list, path, "GET", target, NULL, NULL, 0);
  api_answer answer = {0};
  loopback_ticket *ticket = loopback_ticket_create();
  request.ticket = &ticket->ticket;
  bool done = api_handle(loop->service, &request, API_LIGHT, &answer) == API_ANSWERED;
  api_answer_deinit(&answer);
  loopback_ticket_destroy(loop, ticket);
  free(path);
  return done;
}

reply loopback_get(loopback *loop, const char *target) {
  return loopback_ask(loop, "GET", target, NULL, NULL, 0);
}

reply loopback_post_with(loopback *loop, const char *target, const char *headers, const char *body) {
  char *text = quoted(body);
  reply r = loopback_ask(loop, "POST", target, headers, text, strlen(text));
  free(text);
  return r;
}

reply loopback_post(loopback *loop, const char *target, const char *type, const char *body) {
  char headers[256];
  snprintf(headers, sizeof headers, "Content-Type: %s\n", type);
  return loopback_post_with(loop, target, headers, body);
}

void loopback_upload(loopback *loop, const char *type, const char *body, char id[API_ID_TEXT]) {
  reply r = loopback_post(loop, "/v1/models", type, body);
  if (r.status != 201 && r.status != 200) fail_msg("upload: %d %s", r.status, r.body);
  const char *location = reply_header(&r, "Location");
  assert_non_null(location);
  memcpy(id, strrchr(location, '/') + 1, API_ID_TEXT);
  reply_free(&r);
}

void loopback_upload_sample(loopback *loop, const char *type, const char *name, char id[API_ID_TEXT]) {
  char path[64];
  snprintf(path, sizeof path, "server/samples/%s", name);
  char *text = loopback_file(path, NULL);
  loopback_upload(loop, type, text, id);
  free(text);
}

reply model_ask(loopback *loop, const char *method, const char *id, const char *rest, const char *headers) {
  size_t size = strlen(rest) + 64;
  char *target = malloc(size);
  snprintf(target, size, "/v1/models/%s%s%s", id, *rest ? "/" : "", rest);
  reply r = loopback_ask(loop, method, target, headers, NULL, 0);
  free(target);
  return r;
}

reply model_get(loopback *loop, const char *id, const char *rest) {
  return model_ask(loop, "GET", id, rest, NULL);
}

reply model_get_ok(loopback *loop, const char *id, const char *rest) {
  reply r = model_get(loop, id, rest);
  if (r.status != 200) fail_msg("%s: %d %s", rest, r.status, r.body);
  return r;
}

cJSON *model_get_json(loopback *loop, const char *id, const char *rest) {
  reply r = model_get_ok(loop, id, rest);
  cJSON *tree = cJSON_Parse(r.body);
  assert_non_null(tree);
  reply_free(&r);
  return tree;
}

void reply_free(reply *r) {
  api_answer_deinit(&r->answer);
  if (r->loop) loopback_ticket_destroy(r->loop, r->ticket);
  free(r->body);
  *r = (reply){0};
}

bool reply_says(const reply *r, const char *text) {
  return says(r->body, text);
}

void assert_says(const reply *r, const char *text) {
  if (!reply_says(r, text)) fail_msg("no %s in: %s", text, r->body);
}

void assert_body(const reply *r, const char *text) {
  char *wanted = quoted(text);
  assert_string_equal(r->body, wanted);
  free(wanted);
}

const char *reply_header(const reply *r, const char *name) {
  for (size_t i = 0; i < r->answer.header_count; i++)
    if (strcasecmp(r->answer.headers[i].name, name) == 0) return r->answer.headers[i].value;
  return NULL;
}

void assert_problem(reply r, int status, const char *pointer, const char *word) {
  if (r.status != status) fail_msg("expected %d, got %d: %s", status, r.status, r.body);
  assert_string_equal(reply_header(&r, "Content-Type"), "application/problem+json");
  cJSON *problem = cJSON_Parse(r.body);
  assert_non_null(problem);
  assert_int_equal(cJSON_GetObjectItem(problem, "status")->valueint, status);
  assert_string_equal(cJSON_GetObjectItem(problem, "instance")->valuestring, "request-1");
  assert_non_null(cJSON_GetStringValue(cJSON_GetObjectItem(problem, "type")));
  assert_non_null(cJSON_GetStringValue(cJSON_GetObjectItem(problem, "title")));
  const char *detail = cJSON_GetStringValue(cJSON_GetObjectItem(problem, "detail"));
  assert_true(detail && *detail);
  if (word && !strstr(detail, word)) fail_msg("no \"%s\" in: %s", word, r.body);
  if (pointer) {
    const cJSON *first = cJSON_GetArrayItem(cJSON_GetObjectItem(problem, "errors"), 0);
    const char *place = cJSON_GetStringValue(cJSON_GetObjectItem(first, "pointer"));
    if (!place || strcmp(place, pointer) != 0) fail_msg("expected pointer %s in: %s", pointer, r.body);
  }
  cJSON_Delete(problem);
  reply_free(&r);
}

const cJSON *json_member(const cJSON *object, const char *name) {
  const cJSON *value = cJSON_GetObjectItemCaseSensitive(object, name);
  if (!value) fail_msg("no member %s", name);
  return value;
}

char *loopback_file(const char *path, size_t *size) {
  char full[1024];
  snprintf(full, sizeof full, "%s/%s", TWEEND_SOURCE_DIR, path);
  FILE *file = fopen(full, "rb");
  if (!file) fail_msg("no file %s", full);
  fseek(file, 0, SEEK_END);
  long length = ftell(file);
  rewind(file);
  char *text = malloc((size_t)length + 1);
  assert_int_equal(fread(text, 1, (size_t)length, file), length);
  text[length] = '\0';
  fclose(file);
  if (size) *size = (size_t)length;
  return text;
}
