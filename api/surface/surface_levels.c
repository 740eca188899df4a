/* levels.json: counts, bytes and errors of all levels of a model. */
#include "auto_level.h"
#include "file_name.h"
#include "handlers.h"
#include "models.h"
#include "service.h"
#include "surface_forms.h"
#include "surfaces.h"

/* Makes the plan of a level, and finds the size of its GLB. first: the request of the first level, whose
 * clips the others have. */
static api_outcome measure_level(api_call *call, const api_surface_request *first,
                                 api_surface_request *request, uint64_t *size) {
  tw_scene *scene = &request->scene.content;
  api_outcome outcome = api_surface_query_complete(call, request->form, &request->query);
  if (outcome == API_DONE) outcome = api_surface_prepare(call, request, true);
  if (outcome == API_DONE && request->query.encoding == TW_ENCODING_QUANTIZED)
    outcome = api_surface_take_packs(call, request, true);
  if (outcome == API_DONE && request == first)
    outcome = api_scene_animate(call, api_entry_value(request->model), &request->scene);
  scene->clips = first->scene.content.clips;
  scene->clip_count = first->scene.content.clip_count;
  return outcome == API_DONE ? api_surface_predict(call, request, size) : outcome;
}

/* The levels that are printed. */
typedef struct level_list {
  const api_surface_query *query;
  api_surface_request *first;
  api_level_errors errors; /* of as many levels as there may be; none where levels shrink */
  bool is_last;
} level_list;

/* Finds the errors of all levels, once a request has the scene that all of them have. */
static api_outcome take_errors(api_call *call, level_list *list) {
  if (list->errors.levels > 0 || list->query->boundary == TW_BOUNDARY_OPEN) return API_DONE;
  return api_level_errors_take(call, &list->first->scene, &list->errors);
}

/* Prints a level; one that is over a limit with the reason, and list->is_last. The call's fault is then taken
 * back. */
static api_outcome print_level(api_call *call, level_list *list, api_surface_request *request,
                               tw_text *text) {
  uint64_t size = 0, bytes;
  api_outcome outcome = measure_level(call, list->first, request, &size);
  const api_fault *fault = &call->fault;
  bool is_over = outcome == API_FAILED && fault->stall == API_STALL_NONE && fault->is_predicted &&
                 fault->status == 422; /* a lack of memory tells counts too */
  if (outcome != API_DONE && !is_over) return outcome;
  const tw_surface_counts *counts = is_over ? &fault->predicted : &api_plan_of(request)->total;
  bytes = !is_over ? size : fault->predicted_bytes > 0 ? fault->predicted_bytes : API_SIZE_UNKNOWN;
  if (!is_over) outcome = take_errors(call, list);
  if (outcome != API_DONE && !is_over) return outcome;
  tw_text_element(text);
  tw_text_add(text, "{");
  api_surface_print_counts(text, request->query.level, counts, bytes);
  if (list->errors.levels > 0)
    api_surface_print_error(text, api_level_error_of(&list->errors, (uint32_t)request->query.level));
  if (is_over) tw_member_string(text, "refused", fault->error.detail);
  tw_text_add(text, "}");
  if (is_over) call->fault = (api_fault){0};
  list->is_last = is_over;
  return API_DONE;
}

/* What the answer depends on: the query with its clips, and the limits, which decide which levels there are.
 * NULL without memory. */
static const char *print_key(api_call *call, const api_surface_query *query) {
  const api_limits *limits = &call->service->limits;
  const char *parameters = api_surface_key_print(call, query, API_KEY_ANSWER, NULL);
  if (!parameters) return NULL;
  tw_text text = {0};
  tw_text_add(&text, parameters);
  const uint64_t values[] = {limits->max_level, limits->max_faces, limits->max_output};
  for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
    tw_text_add(&text, "/");
    tw_text_count(&text, values[i]);
  }
  return api_text_move(&text, call->arena);
}

/* Takes the clips for the key alone: each level takes them anew, and tells of them. */
static api_outcome validate_levels(api_call *call, const tw_model *model, api_surface_query *query) {
  api_surface_scene scene = {.query = query};
  uint32_t warnings = call->warning_count;
  api_outcome outcome = api_scene_take_clips(call, model, true, &scene);
  call->warning_count = warnings;
  const char *key = outcome == API_DONE ? print_key(call, query) : NULL;
  if (key)
    outcome = (scene.lacks_clips ? api_validate_partial : api_validate)(call, "levels.json", key);
  else if (outcome == API_DONE)
    outcome = api_fail_without_memory(call);
  api_scene_release(&scene);
  return outcome;
}

/* The model is the caller's. */
static void release_level(api_surface_request *request) {
  request->model = NULL;
  api_surface_release(request);
}

static api_outcome print_levels(api_call *call, const api_surface_query *query, api_entry *model,
                                tw_text *text) {
  level_list list = {.query = query};
  api_outcome outcome = API_DONE;
  for (uint32_t level = 0; level <= call->service->limits.max_level && !list.is_last; level++) {
    api_surface_request *request = api_surface_begin(call, api_surface_form_at(API_SURFACE_COUNTS));
    if (!request) outcome = api_fail_without_memory(call);
    if (!request) break;
    if (!list.first) list.first = request;
    request->query = *query;
    request->query.level = level;
    request->model = model;
    uint32_t warnings = call->warning_count;
    outcome = print_level(call, &list, request, text);
    if (request != list.first) call->warning_count = warnings; /* those of the first level, once more */
    list.is_last |= outcome != API_DONE;
    if (request != list.first) release_level(request);
  }
  if (list.first) release_level(list.first);
  return outcome;
}

api_outcome api_get_levels(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_surface_query query;
  api_entry *model = NULL;
  if (api_surface_query_read(call, &query) != API_DONE) return API_FAILED;
  api_outcome outcome = api_model_take(call, call->id, &query.reading, &model);
  if (outcome != API_DONE) return outcome;
  api_surface_settle(&query, api_entry_value(model));
  outcome = validate_levels(call, api_entry_value(model), &query);
  tw_text text = {0};
  tw_text_add(&text, "{\"levels\":[");
  if (outcome == API_CONTINUE) outcome = print_levels(call, &query, model, &text);
  if (outcome == API_DONE)
    outcome = api_file_name_suggest(call, api_model_name(api_entry_value(model)), "json");
  api_entry_release(model);
  tw_text_add(&text, "]}\n");
  if (outcome == API_DONE && call->answer.status == 0) return api_reply(call, &text);
  tw_text_deinit(&text);
  return outcome;
}
