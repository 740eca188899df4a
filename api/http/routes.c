/* The table of routes, and the stages of every request: route, key or origin, query, representation, length
 * and type of the body; then the handler. */
#include "handlers.h"

#include "access.h"
#include "codings.h"
#include "models.h"
#include "near_names.h"
#include "service.h"
#include "stored.h"
#include "surface_query.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Read by the handlers. */
static const api_rule no_parameters[] = {{0}};
static const api_rule name_parameters[] = {{.name = "name"}, {0}};
static const api_rule source_parameters[] = {{.name = "download"}, {0}};
static const api_rule list_parameters[] = {{.name = "limit"}, {.name = "after"}, {0}};
static const api_rule coarsen_parameters[] = {{.name = "mesh"},
                                              {.name = "levels"},
                                              {.name = "scheme"},
                                              {.name = "boundary"},
                                              {.name = "quads"},
                                              {.name = "name"},
                                              {0}};
static const api_rule edits_parameters[] = {{.name = "quads"}, {.name = "name"}, {0}};
static const api_rule detail_parameters[] = {
    {.name = "mesh"}, {.name = "level"}, {.name = "quads"}, {.name = "name"}, {0}};
static const api_rule tracks_parameters[] = {{.name = "clip"}, {.more = api_clip_term_rules}};
static const api_rule evaluation_parameters[] = {
    {.name = "space"}, {.name = "as"},       {.name = "order"},
    {.name = "unit"},  {.name = "nodes"},    {.name = "interpolation"},
    {.name = "loop"},  {.name = "skinning"}, {.more = api_clip_term_rules}};
static const api_rule pose_parameters[] = {{.name = "clip"}, {.name = "at"},
                                           {.name = "from"}, {.name = "to"},
                                           {.name = "fps"},  {.more = evaluation_parameters}};
static const api_rule bvh_parameters[] = {
    {.name = "clip"},          {.name = "from"},  {.name = "to"},
    {.name = "fps"},           {.name = "order"}, {.name = "nodes"},
    {.name = "interpolation"}, {.name = "loop"},  {.more = api_clip_term_rules}};
static const api_rule live_parameters[] = {{.name = "clip"},  {.name = "speed"},
                                           {.name = "fps"},   {.name = "from"},
                                           {.name = "start"}, {.more = evaluation_parameters}};

static const api_offer json_offers[] = {{"json", "application/json", true}, {0}};
static const api_offer page_offers[] = {{"", "text/html", true}, {0}};
static const api_offer script_offers[] = {{"", "text/javascript", true}, {0}};
static const api_offer types_offers[] = {{"", "application/typescript", true}, {0}};
static const api_offer text_offers[] = {{"", "text/plain", true}, {0}};
/* Any type: the handler sends the media type of the format in which the model is stored. */
static const api_offer source_offers[] = {{"source", "*/*", false}, {0}};
static const api_offer surface_offers[] = {[API_SURFACE_GLB] = {"glb", "model/gltf-binary", false},
                                           [API_SURFACE_GLTF] = {"gltf", "model/gltf+json", false},
                                           [API_SURFACE_OBJ] = {"obj", "model/obj", true},
                                           [API_SURFACE_COUNTS] = {"json", "application/json", true},
                                           [API_SURFACE_STL] = {"stl", "model/stl", false},
                                           [API_SURFACE_PLY] = {"ply", "model/ply", false},
                                           [API_SURFACE_3MF] = {"3mf", "model/3mf", false},
                                           [API_SURFACE_POINTS] = {"bin", "application/octet-stream", false},
                                           [API_SURFACE_FORMS] = {0}};
/* In the order of api_pose_form. */
static const api_offer pose_offers[] = {{"json", "application/json", true},
                                        {"ndjson", "application/x-ndjson", true},
                                        {"bin", "application/octet-stream", false},
                                        {"csv", "text/csv", true},
                                        {0}};
static const api_offer bvh_offers[] = {{"", "model/x-bvh", true}, {0}};
static const api_offer live_offers[] = {{"", "text/event-stream", false}, {0}};

/* The path and tail of a route. */
#define WHOLE(path)    path, NULL
#define OF_MODEL(tail) "/v1/models/{id}" tail, tail

/* The most frequent route comes first: the table is searched in this order. */
static const api_route routes[] = {
    {"GET", OF_MODEL("/pose"), API_TAKES_NOTHING, API_READS, true, pose_offers, pose_parameters,
     api_get_pose},
    {"GET", WHOLE("/healthz"), API_TAKES_NOTHING, API_OPEN, false, json_offers, no_parameters,
     api_get_health},
    {"GET", WHOLE("/readyz"), API_TAKES_NOTHING, API_OPEN, false, json_offers, no_parameters, api_get_ready},
    {"GET", WHOLE("/version"), API_TAKES_NOTHING, API_OPEN, false, json_offers, no_parameters,
     api_get_version},
    {"GET", WHOLE("/openapi.json"), API_TAKES_NOTHING, API_OPEN, false, json_offers, no_parameters,
     api_get_openapi},
    {"GET", WHOLE("/"), API_TAKES_NOTHING, API_OPEN, false, page_offers, no_parameters, api_get_page},
    {"GET", WHOLE("/docs"), API_TAKES_NOTHING, API_OPEN, false, page_offers, no_parameters, api_get_docs},
    {"GET", WHOLE("/example.html"), API_TAKES_NOTHING, API_OPEN, false, page_offers, no_parameters,
     api_get_example},
    {"GET", WHOLE("/tweend.js"), API_TAKES_NOTHING, API_OPEN, false, script_offers, no_parameters,
     api_get_client},
    {"GET", WHOLE("/tweend.d.ts"), API_TAKES_NOTHING, API_OPEN, false, types_offers, no_parameters,
     api_get_client_types},
    {"GET", WHOLE("/viewer.js"), API_TAKES_NOTHING, API_OPEN, false, script_offers, no_parameters,
     api_get_viewer},
    {"POST", WHOLE("/v1/models"), API_TAKES_MODEL, API_WRITES, false, json_offers, name_parameters,
     api_post_model},
    {"GET", WHOLE("/v1/models"), API_TAKES_NOTHING, API_READS_ALL, false, json_offers, list_parameters,
     api_list_models},
    {"GET", OF_MODEL(""), API_TAKES_NOTHING, API_READS, false, json_offers, no_parameters, api_get_model},
    {"DELETE", OF_MODEL(""), API_TAKES_NOTHING, API_DELETES, false, json_offers, no_parameters,
     api_delete_model},
    {"POST", OF_MODEL("/edits"), API_TAKES_JSON, API_WRITES, false, json_offers, edits_parameters,
     api_post_edits},
    {"POST", OF_MODEL("/detail"), API_TAKES_MODEL, API_WRITES, false, json_offers, detail_parameters,
     api_post_detail},
    {"POST", OF_MODEL("/coarsen"), API_TAKES_NOTHING, API_WRITES, false, json_offers, coarsen_parameters,
     api_post_coarsen},
    {"GET", OF_MODEL("/source"), API_TAKES_NOTHING, API_READS, false, source_offers, source_parameters,
     api_get_source},
    {"GET", OF_MODEL("/surface"), API_TAKES_NOTHING, API_READS, true, surface_offers, api_surface_rules,
     api_get_surface},
    {"POST", WHOLE("/v1/surface"), API_TAKES_MODEL, API_READS, true, surface_offers, api_surface_rules,
     api_post_surface},
    {"GET", OF_MODEL("/levels.json"), API_TAKES_NOTHING, API_READS, false, json_offers, api_levels_rules,
     api_get_levels},
    {"GET", OF_MODEL("/tracks"), API_TAKES_NOTHING, API_READS, false, json_offers, tracks_parameters,
     api_get_tracks},
    {"POST", OF_MODEL("/pose"), API_TAKES_JSON, API_READS, true, pose_offers, pose_parameters,
     api_post_times},
    {"GET", OF_MODEL("/pose.bvh"), API_TAKES_NOTHING, API_READS, false, bvh_offers, bvh_parameters,
     api_get_pose_bvh},
    {"POST", WHOLE("/v1/pose.bvh"), API_TAKES_MODEL, API_READS, false, bvh_offers, bvh_parameters,
     api_post_pose_bvh},
    {"GET", OF_MODEL("/live"), API_TAKES_NOTHING, API_READS, false, live_offers, live_parameters,
     api_get_live},
    {"POST", WHOLE("/v1/pose"), API_TAKES_MODEL, API_READS, true, pose_offers, pose_parameters,
     api_post_pose},
    {"POST", WHOLE("/v1/rotations"), API_TAKES_JSON, API_READS, false, json_offers, no_parameters,
     api_post_rotations},
    {"GET", WHOLE("/metrics"), API_TAKES_NOTHING, API_READS_ALL, false, text_offers, no_parameters,
     api_get_metrics},
    {"POST", WHOLE("/v1/sign"), API_TAKES_JSON, API_READS, false, json_offers, no_parameters, api_post_sign},
};

enum { ROUTES = sizeof routes / sizeof *routes };

const api_route *api_routes(size_t *count) {
  *count = ROUTES;
  return routes;
}

/* ---- matching ------------------------------------------------------------------------------ */

enum { ID_LENGTH = API_ID_TEXT - 1 };

/* A path, parsed once before it is compared with every route. */
typedef struct parsed_path {
  const char *whole;
  const char *id; /* a model's id within the path; else NULL */
} parsed_path;

static parsed_path parse_path(const char *path) {
  static const char models[] = "/v1/models/";
  size_t head = strlen(models);
  if (strncmp(path, models, head) != 0) return (parsed_path){path, NULL};
  const char *id = path + head;
  return (parsed_path){path, api_is_model_id(id, strnlen(id, ID_LENGTH)) ? id : NULL};
}

/* The part of the path behind the route's path; NULL where the path does not begin with that. */
static const char *match_path(const api_route *route, const parsed_path *path) {
  const char *text = route->tail ? path->id + ID_LENGTH : path->whole;
  const char *pattern = route->tail ? route->tail : route->path;
  while (*pattern && *text == *pattern) text++, pattern++;
  return *pattern ? NULL : text;
}

/* Whether the path matches the route. *offer: the one that the path's extension names, NULL without an
 * extension. A path with a model's id matches only routes with an id. */
static bool match_route(const api_route *route, const parsed_path *path, const api_offer **offer) {
  *offer = NULL;
  if (!route->tail != !path->id) return false;
  const char *rest = match_path(route, path);
  if (!rest) return false;
  if (*rest == '\0') return true;
  if (!route->has_extensions || *rest != '.') return false;
  for (const api_offer *o = route->offers; o->type; o++) {
    if (strcmp(rest + 1, o->extension) != 0) continue;
    *offer = o;
    return true;
  }
  return false;
}

const char *api_route_name(const char *path) {
  const parsed_path pieces = parse_path(path);
  const api_offer *offer;
  for (size_t i = 0; i < ROUTES; i++)
    if (match_route(&routes[i], &pieces, &offer)) return routes[i].path;
  return "other";
}

static const api_route *find(const char *method, const parsed_path *path, const api_offer **offer) {
  for (size_t i = 0; i < ROUTES; i++)
    if (match_route(&routes[i], path, offer) && strcmp(routes[i].method, method) == 0) return &routes[i];
  return NULL;
}

static const api_route *find_any(const char *method, const char *path) {
  const parsed_path pieces = parse_path(path);
  const api_offer *offer;
  return find(method, &pieces, &offer);
}

/* Finds the route of method and path; false when the path has none of that method. */
static bool find_route(api_call *call, const char *method) {
  const parsed_path path = parse_path(call->request->path);
  call->route = find(method, &path, &call->offer);
  if (call->route && call->route->offers == source_offers) call->offer = source_offers;
  call->has_one_form = call->offer;
  if (call->route && path.id) memcpy(call->id, path.id, ID_LENGTH);
  return call->route;
}

/* The methods of the path as an Allow list; NULL without any, or without memory. */
static const char *list_methods(const api_call *call) {
  const parsed_path path = parse_path(call->request->path);
  char allow[64];
  size_t length = 0;
  for (size_t i = 0; i < ROUTES; i++) {
    const api_offer *offer;
    if (!match_route(&routes[i], &path, &offer)) continue;
    bool is_get = strcmp(routes[i].method, "GET") == 0;
    length += (size_t)snprintf(allow + length, sizeof allow - length, "%s%s", routes[i].method,
                               is_get ? ", HEAD, " : ", ");
  }
  if (length == 0) return NULL;
  length += (size_t)snprintf(allow + length, sizeof allow - length, "OPTIONS");
  return tw_arena_text(call->arena, allow, length);
}

/* ---- the stages before the body -------------------------------------------------------------- */

static api_outcome choose_offer(api_call *call) {
  if (call->has_one_form) return API_CONTINUE;
  int best = api_negotiate(api_call_header(call, "Accept"), call->route->offers);
  if (best >= 0) {
    call->offer = &call->route->offers[best];
    return API_CONTINUE;
  }
  char list[256];
  size_t length = 0;
  for (const api_offer *o = call->route->offers; o->type; o++)
    length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", length ? ", " : "", o->type);
  call->fault.supported = tw_arena_text(call->arena, list, length);
  return api_fail_with(call, 406, "Accept names none of: %s", list);
}

static void choose_coding(api_call *call) {
  const char *accepted = api_call_header(call, "Accept-Encoding");
  call->coding = api_coding_accepted(accepted, call->offer->is_text);
}

static api_outcome check_length(api_call *call) {
  const char *length = api_call_header(call, "Content-Length");
  if (!length && !api_call_header(call, "Transfer-Encoding"))
    return api_fail_with(call, 411, "the request has no body: Content-Length or chunked coding is asked for");
  uint64_t limit = call->service->limits.max_upload;
  size_t digits = length ? strspn(length, "0123456789") : 0;
  uint64_t size = 0;
  for (size_t i = 0; i < digits && size <= limit; i++) size = size * 10 + (uint64_t)(length[i] - '0');
  if (size > limit)
    return api_fail_with(call, 413, "the body is over the limit of %llu %s", (unsigned long long)limit,
                         tw_plural(limit, "byte", "bytes"));
  return API_CONTINUE;
}

/* Refuses a body that the store has no room for, before it is read. */
static api_outcome check_room(api_call *call) {
  const api_store *store = &call->service->store;
  const char *length = api_call_header(call, "Content-Length");
  uint64_t size = length ? strtoull(length, NULL, 10) : 0;
  if (call->route->access != API_WRITES || !store->room) return API_CONTINUE;
  return store->room(store->context, size) == API_STORE_FULL ? api_model_fail_full(call) : API_CONTINUE;
}

static api_outcome check_type(api_call *call) {
  if (api_coding_of(api_call_header(call, "Content-Encoding")) == API_CODING_OTHER) {
    call->fault.supported = api_codings;
    call->fault.header = (api_header){"Accept-Encoding", api_codings};
    return api_fail_with(call, 415, "Content-Encoding is none of: %s", api_codings);
  }
  api_upload_type type = api_upload_type_of(api_call_header(call, "Content-Type"));
  bool is_json = call->route->takes == API_TAKES_JSON;
  bool fits = is_json ? type == API_TYPE_JSON || type == API_TYPE_BYTES : type != API_TYPE_OTHER;
  if (fits) return API_CONTINUE;
  call->fault.supported = is_json ? "application/json" : api_upload_types;
  return api_fail_with(call, 415, "Content-Type is none of: %s", call->fault.supported);
}

/* Considers the paths of a route as what the client may have meant. */
static void consider_route(api_near *near, const api_route *route) {
  char path[API_NEAR_TEXT];
  api_near_consider(near, route->path);
  for (const api_offer *form = route->offers; route->has_extensions && form->type; form++) {
    snprintf(path, sizeof path, "%s.%s", route->path, form->extension);
    api_near_consider(near, path);
  }
}

/* Prints the path with "{id}" in place of ids, and of what stands where a model's id belongs, which
 * *has_false_id tells. */
static void print_pattern(const char *path, char out[API_NEAR_TEXT], bool *has_false_id) {
  static const char models[] = "/v1/models", pattern[] = "/{id}";
  bool is_of_models = strncmp(path, models, sizeof models - 1) == 0;
  size_t length = 0;
  *has_false_id = false;
  for (const char *segment = path; *segment && length < API_NEAR_TEXT;) {
    size_t size = 1 + strcspn(segment + 1, "/");
    bool is_id = size == 1 + ID_LENGTH && api_is_model_id(segment + 1, ID_LENGTH);
    bool is_false = is_of_models && segment == path + sizeof models - 1 && size > 1 && !is_id;
    *has_false_id |= is_false;
    length += (size_t)snprintf(out + length, API_NEAR_TEXT - length, "%.*s",
                               is_id || is_false ? (int)sizeof pattern - 1 : (int)size,
                               is_id || is_false ? pattern : segment);
    segment += size;
  }
}

/* Fails with 404 and names similar paths. */
static api_outcome fail_path(api_call *call) {
  char pattern[API_NEAR_TEXT] = "";
  bool has_false_id;
  print_pattern(call->request->path, pattern, &has_false_id);
  api_near near = {.name = pattern, .length = strlen(pattern)};
  for (size_t i = 0; i < ROUTES; i++) consider_route(&near, &routes[i]);
  if (has_false_id && near.count && near.names[0].distance == 0)
    return api_fail_with(call, 404, "nothing is at this path: a model's id is 32 hex digits, in lower case");
  return api_fail_with(call, 404, "nothing is at this path%s", api_near_print(&near, "; ").text);
}

/* Answers OPTIONS, or fails with 405 for a method that the path does not have. */
static api_outcome answer_methods(api_call *call) {
  const char *methods = list_methods(call);
  bool is_options = strcmp(call->request->method, "OPTIONS") == 0;
  if (!methods && is_options && strcmp(call->request->path, "*") == 0)
    methods = "GET, HEAD, POST, DELETE, OPTIONS"; /* "*" means the server as a whole */
  if (!methods) return fail_path(call);
  if (is_options) {
    api_access_options(call, methods);
    return API_DONE;
  }
  call->fault.allow = methods;
  return api_fail_with(call, 405, "this path answers %s", methods);
}

/* Checks host, path, method and key. API_CONTINUE: go on with the rest. */
static api_outcome admit_route(api_call *call) {
  call->is_head = strcmp(call->request->method, "HEAD") == 0;
  bool has_route = find_route(call, call->is_head ? "GET" : call->request->method);
  if (!api_access_serves_host(call)) return API_FAILED;
  if (!has_route) return answer_methods(call);
  return api_access_allowed(call) ? API_CONTINUE : API_FAILED;
}

/* Checks the query and the other headers. API_CONTINUE: the body may come. */
static api_outcome admit_rest(api_call *call) {
  tw_error *error = &call->fault.error;
  if (api_query_read(call->request->query, call->arena, &call->query, error) != TW_OK ||
      api_rules_admit(call->route->parameters, &call->query, error) != TW_OK)
    return api_fail(call);
  api_outcome outcome = choose_offer(call);
  if (outcome == API_CONTINUE) choose_coding(call);
  bool takes_body = call->route->takes != API_TAKES_NOTHING;
  if (outcome == API_CONTINUE && takes_body) outcome = check_length(call);
  if (outcome == API_CONTINUE && takes_body) outcome = check_type(call);
  if (outcome == API_CONTINUE && takes_body) outcome = check_room(call);
  return outcome;
}

/* ---- entry points ---------------------------------------------------------------------------- */

static bool begin(api_call *call, api_service *service, const api_request *request, api_effort effort) {
  *call = (api_call){.service = service, .request = request, .effort = effort, .find_route = find_any};
  call->arena = tw_arena_create();
  call->answer.memory = call->arena;
  return call->arena != NULL;
}

/* Lists the request headers on which the choice among the URL's answers depends. Any answer of a route may
 * be coded: one that is no text for clients that refuse it uncoded. */
static void add_vary(api_call *call) {
  static const char *const fields[] = {"Accept", "Accept-Encoding", "Authorization, X-API-Key", "Origin"};
  bool has_coding = call->offer != NULL;
  const bool counts[] = {!call->has_one_form, has_coding, api_access_asks(call), api_access_varies(call)};
  char list[80], *end = list;
  for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
    if (counts[i]) end = stpcpy(end > list ? stpcpy(end, ", ") : end, fields[i]);
  if (end > list) api_answer_header_copy(&call->answer, "Vary", list);
}

/* Marks an answer that needed a key as private: a shared cache would give it to clients without a key. */
static void make_private(api_call *call) {
  static const char name[] = "Cache-Control", shared[] = "public, ";
  api_header *header = NULL;
  for (size_t i = 0; i < call->answer.header_count && !header; i++)
    if (strcmp(call->answer.headers[i].name, name) == 0) header = &call->answer.headers[i];
  if (!header) {
    api_answer_header(&call->answer, name, "private");
    return;
  }
  size_t drop = strncmp(header->value, shared, sizeof shared - 1) == 0 ? sizeof shared - 1 : 0;
  char value[96];
  int length = snprintf(value, sizeof value, "private, %s", header->value + drop);
  const char *copy = call->arena ? tw_arena_text(call->arena, value, (size_t)length) : NULL;
  header->value = copy ? copy : "private";
}

/* Moves the answer to the caller, with the headers that all answers have. */
static void finish(api_call *call, api_outcome outcome, api_answer *answer) {
  if (outcome == API_FAILED) {
    call->answer.header_count = 0; /* these belong to the answer that failed */
    api_problem_fill(&call->fault, call->request->id, &call->answer);
  }
  if (outcome != API_FAILED && call->answer.status != 304 && call->first_warning && !call->leaves_warnings)
    api_answer_headerf(&call->answer, "X-Tweend-Warning", "%u; %s", call->warning_count, call->first_warning);
  api_answer_header(&call->answer, "X-Content-Type-Options", "nosniff");
  if (api_access_asks(call)) make_private(call);
  add_vary(call);
  api_access_headers(call);
  call->answer.route = call->route ? call->route->path : NULL;
  *answer = call->answer;
}

api_verdict api_open(api_service *service, const api_request *request, api_answer *answer) {
  api_call call;
  if (!begin(&call, service, request, API_LIGHT)) {
    api_problem(503, "out of memory", request->id, 1, answer);
    return API_REFUSED;
  }
  api_outcome outcome = admit_route(&call);
  if (outcome == API_CONTINUE) outcome = admit_rest(&call);
  if (outcome == API_CONTINUE) {
    api_answer_deinit(&call.answer);
    return API_READ_BODY;
  }
  finish(&call, outcome, answer);
  return API_REFUSED;
}

/* The meter of a running request. Threads that compute parts of it ask for memory too. */
typedef struct metered {
  tw_meter meter;
  api_call *call;
  pthread_mutex_t lock;
} metered;

/* Raises the ticket's grant a little above what is needed, so that the budget is rarely asked. */
static uint64_t raise_grant(void *owner, uint64_t needed) {
  metered *m = owner;
  api_ticket *ticket = m->call->request->ticket;
  api_budget *budget = m->call->service->budget;
  uint64_t limit = m->call->service->limits.max_memory, ample = needed + needed / 8;
  if (ample > limit) ample = limit;
  pthread_mutex_lock(&m->lock);
  if (needed <= limit && needed > ticket->granted + API_UNGRANTED && !api_budget_grant(budget, ticket, ample))
    api_budget_grant(budget, ticket, needed);
  uint64_t granted = ticket->granted + API_UNGRANTED;
  pthread_mutex_unlock(&m->lock);
  return granted;
}

static bool is_over(void *owner) {
  const tw_parallel_for *parallel = &((const metered *)owner)->call->service->parallel;
  return parallel->is_cancelled && parallel->is_cancelled(parallel->owner);
}

static void meter(metered *m, api_call *call) {
  m->call = call;
  pthread_mutex_init(&m->lock, NULL);
  const tw_meter_host host = {m, raise_grant, is_over};
  tw_meter_init(&m->meter, &host, call->request->ticket->granted + API_UNGRANTED);
}

static api_outcome run_stages(api_call *call) {
  api_outcome outcome = admit_route(call);
  if (outcome == API_CONTINUE) outcome = admit_rest(call);
  bool is_read = call->route && call->id[0] && strcmp(call->route->method, "DELETE") != 0;
  if (outcome == API_CONTINUE && is_read) outcome = api_model_look(call, call->id);
  if (outcome == API_CONTINUE) outcome = call->route->handle(call);
  if (outcome == API_DONE) outcome = api_encode(call);
  bool needs_thread = outcome == API_FAILED && call->fault.stall == API_STALL_THREAD;
  return needs_thread ? API_NEEDS_THREAD : outcome;
}

static api_outcome run_metered(api_call *call) {
  metered m;
  meter(&m, call);
  tw_meter *before = tw_meter_use(&m.meter);
  api_outcome outcome = run_stages(call);
  if (outcome == API_FAILED) api_fault_without_grant(&call->fault);
  tw_meter_use(before);
  pthread_mutex_destroy(&m.lock);
  return outcome;
}

/* Sets the grant to what the finished answer holds; an answer that does not fit makes the request wait like
 * any other stall. Up to UNCOUNTED bytes, about what a connection takes, do not count, so that probes never
 * wait. */
static api_outcome retain_grant(api_call *call, api_outcome outcome) {
  enum { UNCOUNTED = 32 << 10 };
  uint64_t held = outcome == API_DONE ? tw_arena_size(call->arena) + call->held + call->answer.bytes.size : 0;
  if (held <= UNCOUNTED) held = 0;
  if (api_budget_retain(call->service->budget, call->request->ticket, held)) return outcome;
  call->fault = (api_fault){.stall = API_STALL_MEMORY, .needed = held};
  return API_FAILED;
}

/* Refuses a request whose meter ran out of memory that no wait can give it. */
static bool is_hopeless(api_call *call) {
  api_fault *fault = &call->fault;
  uint64_t limit = call->service->limits.max_memory, waited_for = call->request->ticket->needed;
  uint64_t most = api_budget_most(limit);
  if (fault->stall != API_STALL_MEMORY || !fault->is_measured) return false;
  if (fault->needed <= most && fault->needed > waited_for) return false;
  bool had_all = waited_for >= limit || call->request->ticket->granted >= api_budget_most(most);
  if (fault->needed > most && !had_all && fault->needed / 2 <= limit) {
    fault->needed = limit; /* one attempt with all that there is */
    return false;
  }
  bool is_too_much = fault->needed > most;
  *fault = (api_fault){.is_predicted = is_too_much && fault->is_predicted, .predicted = fault->predicted};
  if (is_too_much)
    api_fail_with(call, 422, "this takes more memory than the limit of %llu %s (--max-memory)",
                  (unsigned long long)limit, tw_plural(limit, "byte", "bytes"));
  else
    api_fail_with(call, 503, "the memory for this is in use by other requests");
  fault->refusal = API_REFUSAL_MEMORY;
  if (!is_too_much) fault->retry_after_s = 1;
  return true;
}

/* Makes the ticket wait for the entry or the memory that the call stalled for. Frees the call. */
static api_wait wait_for(api_call *call) {
  api_ticket *ticket = call->request->ticket;
  const api_fault fault = call->fault;
  api_answer_deinit(&call->answer);
  if (ticket->pauses) ticket->pauses(ticket);
  /* The ticket may be woken from here on, before this function returns. */
  if (fault.stall == API_STALL_MEMORY) return api_budget_wait(call->service->budget, ticket, fault.needed);
  api_budget_grant(call->service->budget, ticket, 0); /* a waiting ticket holds no memory: no deadlock */
  return api_cache_wait(call->service->cache, ticket, fault.awaited);
}

/* Whether the call waits: run_stages leaves no other stall than those for an entry and for memory. */
static bool is_stalled(const api_call *call, api_outcome outcome) {
  return outcome == API_FAILED && call->fault.stall != API_STALL_NONE;
}

void api_refuse(api_service *service, const api_request *request, int status, const char *detail,
                unsigned retry_after, api_answer *answer) {
  api_call call;
  if (!begin(&call, service, request, API_LIGHT)) {
    api_problem(status, detail, request->id, retry_after, answer);
    return;
  }
  find_route(&call, strcmp(request->method, "HEAD") == 0 ? "GET" : request->method);
  api_fail_with(&call, status, "%s", detail);
  call.fault.retry_after_s = retry_after;
  finish(&call, API_FAILED, answer);
}

/* Answers 503: too many requests wait for memory. */
static void refuse_crowded(api_service *service, const api_request *request, api_answer *answer) {
  api_cache_end(service->cache, request->ticket);
  api_refuse(service, request, 503, "the memory for this is in use by other requests", 1, answer);
  answer->refusal = API_REFUSAL_MEMORY;
}

api_progress api_handle(api_service *service, const api_request *request, api_effort effort,
                        api_answer *answer) {
  for (;;) {
    api_call call;
    if (!begin(&call, service, request, effort)) {
      api_cache_end(service->cache, request->ticket);
      api_problem(503, "out of memory", request->id, 1, answer);
      return API_ANSWERED;
    }
    api_outcome outcome = run_metered(&call);
    if (outcome == API_NEEDS_THREAD || outcome == API_NEEDS_LOOK) {
      api_answer_deinit(&call.answer);
      return outcome == API_NEEDS_LOOK ? API_LOOK_ON_THREAD : API_AGAIN_ON_THREAD;
    }
    if (!is_stalled(&call, outcome)) outcome = retain_grant(&call, outcome);
    if (!is_stalled(&call, outcome) || is_hopeless(&call)) {
      api_cache_end(service->cache, request->ticket);
      finish(&call, outcome, answer);
      return API_ANSWERED;
    }
    switch (wait_for(&call)) {
    case API_WAIT_BEGUN: return API_WAITS;
    case API_WAIT_OVER: break;
    case API_WAIT_CROWDED: refuse_crowded(service, request, answer); return API_ANSWERED;
    }
  }
}
