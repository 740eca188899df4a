/* Times: at=0.5,1,2 or from=0&to=4&fps=30, or a list in a body. */
#include "times.h"

#include "names_in.h"
#include "service.h"
#include "upload.h"

#include <math.h>
#include <string.h>

static tw_status fail_many(tw_error *error, double count, uint64_t max_times) {
  return tw_fail(error, TW_LIMIT, "%.0f times are over the limit of %llu", count,
                 (unsigned long long)max_times);
}

static tw_status read_list(const char *text, uint64_t max_times, tw_arena *arena, api_times *out,
                           tw_error *error) {
  uint64_t count = 1;
  for (const char *c = text; *c; c++) count += *c == ',';
  if (count > max_times) return fail_many(error, (double)count, max_times);
  double *list = tw_arena_alloc(arena, (size_t)count, sizeof *list);
  if (!list) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint64_t i = 0; i < count; i++) {
    size_t length = strcspn(text, ",");
    if (!api_number_read(text, length, &list[i]) || !isfinite((float)list[i]))
      return tw_fail(error, TW_SYNTAX, "at: \"%.*s\" is no time in seconds", length < 60 ? (int)length : 60,
                     text);
    text += length + 1;
  }
  *out = (api_times){.is_given = true, .count = count, .list = list};
  return TW_OK;
}

/* Counts the times from `from` to `to`, which is included if it falls on a step. */
static tw_status count_steps(api_times *times, uint64_t max_times, tw_error *error) {
  /* Rounding may put the last step just beyond `to`. */
  double count = floor((times->to - times->from) * times->fps + 1e-6) + 1;
  if (!(count <= (double)max_times)) return fail_many(error, count, max_times);
  times->count = (uint64_t)count;
  return TW_OK;
}

static tw_status check_range(const api_times *times, tw_error *error) {
  if (!(times->fps > 0)) return tw_fail(error, TW_SYNTAX, "fps must be more than 0");
  if (!isfinite((float)times->from) || !isfinite((float)times->to))
    return tw_fail(error, TW_SYNTAX, "from and to must fit a float");
  if (times->has_to && times->to < times->from)
    return tw_fail(error, TW_SYNTAX, "to=%.15g is before from=%.15g", times->to, times->from);
  return TW_OK;
}

tw_status api_times_read(const api_query *query, uint64_t max_times, tw_arena *arena, api_times *out,
                         tw_error *error) {
  const char *at = api_query_get(query, "at");
  bool has_from = api_query_get(query, "from") != NULL, has_to = api_query_get(query, "to") != NULL;
  bool has_fps = api_query_get(query, "fps") != NULL;
  if (at && (has_from || has_to || has_fps))
    return tw_fail(error, TW_SYNTAX, "at and from, to, fps exclude each other");
  if (at) return read_list(at, max_times, arena, out, error);
  api_times times = {.is_given = has_from || has_to || has_fps, .has_to = has_to};
  *out = times;
  if (!times.is_given) return TW_OK;
  if (!has_fps) return tw_fail(error, TW_SYNTAX, "from and to need fps");
  tw_status status = api_query_number(query, "from", &times.from, error);
  if (status == TW_OK) status = api_query_number(query, "to", &times.to, error);
  if (status == TW_OK) status = api_query_number(query, "fps", &times.fps, error);
  if (status == TW_OK) status = check_range(&times, error);
  if (status == TW_OK && has_to) status = count_steps(&times, max_times, error);
  if (status == TW_OK) *out = times;
  return status;
}

tw_status api_times_read_steps(const api_query *query, double usual_fps, uint64_t max_times, api_times *out,
                               tw_error *error) {
  api_times times = {.is_given = true, .has_to = api_query_get(query, "to") != NULL, .fps = usual_fps};
  tw_status status = api_query_number(query, "from", &times.from, error);
  if (status == TW_OK) status = api_query_number(query, "to", &times.to, error);
  if (status == TW_OK) status = api_query_number(query, "fps", &times.fps, error);
  if (status == TW_OK) status = check_range(&times, error);
  if (status == TW_OK && times.has_to) status = count_steps(&times, max_times, error);
  if (status == TW_OK) *out = times;
  return status;
}

tw_status api_times_complete(api_times *times, double duration, uint64_t max_times, tw_error *error) {
  if (!times->is_given || times->list || times->has_to) return TW_OK;
  if (duration < times->from)
    return tw_fail(error, TW_SYNTAX, "from=%.15g is behind the clip's end at %g", times->from, duration);
  times->to = duration;
  times->has_to = true;
  return count_steps(times, max_times, error);
}

typedef struct times_source {
  uint64_t max_times;
  api_times *out;
  tw_retarget_wish *retarget;
} times_source;

static tw_status read_document(void *context, const api_value *root) {
  const times_source *source = context;
  static const char *const names[] = {"times", "map", NULL};
  const api_json *json = root->json;
  api_value members[2];
  tw_status status = api_json_members(root, names, members);
  api_value times = members[0], map = members[1];
  uint32_t count;
  if (status == TW_OK && map.item && source->retarget->has_map)
    return api_json_fail(&map, TW_SYNTAX, "the map is in the query too");
  if (status == TW_OK && map.item) status = api_json_object(&map, api_bone_map_read, source->retarget);
  if (status == TW_OK && map.item && !times.item) return TW_OK;
  if (status == TW_OK && !times.item) return api_json_fail(root, TW_SYNTAX, "\"times\" is missing");
  if (status == TW_OK && source->out->is_given)
    return api_json_fail(&times, TW_SYNTAX, "the times are in the body: at, from, to, fps have no place");
  if (status == TW_OK) status = api_json_count(&times, UINT32_MAX, &count);
  if (status != TW_OK) return status;
  if (count == 0) return api_json_fail(&times, TW_SYNTAX, "a time is expected");
  if (count > source->max_times) return fail_many(json->error, (double)count, source->max_times);
  double *list = tw_arena_alloc(json->arena, count, sizeof *list);
  if (!list) return api_json_no_memory(json);
  status = api_json_double_list(&times, list);
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    const api_value time = {json, NULL, {&times.at, NULL, i}};
    if (!isfinite((float)list[i]))
      status = api_json_fail(&time, TW_INVALID, "the number is too large for a float");
  }
  if (status == TW_OK) *source->out = (api_times){.is_given = true, .count = count, .list = list};
  return status;
}

api_outcome api_times_of_body(api_call *call, api_times *out, tw_retarget_wish *retarget) {
  times_source source = {call->service->limits.max_times, out, retarget};
  /* The document, the array, and one time over the limit, so that the error is about the limit on times. */
  uint64_t values_max = source.max_times + 3;
  if (values_max < API_JSON_VALUES_MAX) values_max = API_JSON_VALUES_MAX;
  return api_upload_json(call, values_max, read_document, &source);
}

double api_times_get(const api_times *times, uint64_t index) {
  return times->list ? times->list[index] : times->from + (double)index / times->fps;
}

void api_times_print(const api_times *times, tw_text *text) {
  if (!times->list) {
    tw_text_double(text, times->from);
    tw_text_add(text, "/");
    tw_text_double(text, times->fps);
    tw_text_add(text, "*");
    tw_text_count(text, times->count);
    return;
  }
  for (uint64_t i = 0; i < times->count; i++) {
    tw_text_double(text, times->list[i]);
    tw_text_add(text, ",");
  }
}
