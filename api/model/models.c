/* Reads models from the store, from bodies and from the cache. */
#include "models.h"

#include "file_name.h"
#include "service.h"
#include "stored.h"

#include <stdlib.h>
#include <string.h>

enum { MODEL_KEY = API_ID_TEXT + 64 }; /* of a cache key, at most */

static void destroy_model(void *model) {
  tw_model_destroy(model);
}

static api_built built_model(tw_model *model) {
  return (api_built){model, tw_model_size(model), destroy_model, API_CACHED_MODEL};
}

/* Making a face takes at most MADE_FACE bytes. */
api_making api_making_within(const api_service *service) {
  enum { MADE_FACE = 256 };
  const api_limits *limits = &service->limits;
  uint64_t most = limits->max_memory / MADE_FACE;
  return (api_making){.faces_max = most < limits->max_faces ? most : limits->max_faces,
                      .bytes_max = limits->max_memory,
                      .parallel = &service->parallel};
}

bool api_model_read_granted(api_call *call, api_bytes bytes, uint64_t held, tw_format format,
                            api_reading reading, tw_model **out) {
  const api_making making = api_making_within(call->service);
  return api_grant(call, held + tw_reading_size(format, bytes.size)) &&
         api_model_read(bytes, format, reading, &making, out, &call->fault);
}

/* ---- from the store -------------------------------------------------------------------------- */

typedef struct model_source {
  api_call *call;
  const char *id;
  api_reading reading;
} model_source;

bool api_model_set_name(tw_model *model, const char *name) {
  if (name) model->name = tw_arena_text(model->arena, name, strlen(name));
  return !name || model->name;
}

/* fault: the call's. */
static bool build_model(void *context, api_built *out, api_fault *fault) {
  const model_source *source = context;
  api_call *call = source->call;
  api_blob blob;
  if (api_stored_open(call, source->id, &blob) != API_DONE) return false;
  api_summary stored;
  bool has_summary = api_summary_find(call->service, source->id, &stored);
  tw_format likely = has_summary ? stored.format : TW_FORMAT_GLTF; /* the format that takes most */
  bool is_granted = api_grant(call, tw_reading_size(likely, blob.size));
  uint8_t *data = is_granted ? api_stored_read(call, &blob) : NULL;
  api_bytes bytes = {data, (size_t)blob.size};
  blob.close(&blob);
  tw_model *model = NULL;
  bool is_read = data && api_model_read_granted(call, bytes, 0, tw_format_sniff(data, bytes.size),
                                                source->reading, &model);
  tw_free(data);
  bool is_named = is_read && api_model_set_name(model, has_summary ? stored.name : NULL);
  cJSON_Delete(stored.tree);
  if (!is_read) return false;
  *out = built_model(model);
  if (is_named) return true;
  tw_model_destroy(model);
  return api_fault_without_memory(fault);
}

/* reading: NULL for the defaults. */
static void print_key(const char *id, const api_reading *reading, char out[MODEL_KEY]) {
  const api_reading usual = {0}, *how = reading ? reading : &usual;
  char *end = stpcpy(stpcpy(out, id), "/model?");
  *end++ = (char)('0' + how->quads);
  *end++ = (char)('0' + how->weld);
  end[tw_print_double(end, how->distance)] = '\0';
}

api_outcome api_model_take(api_call *call, const char *id, const api_reading *reading, api_entry **out) {
  char key[MODEL_KEY];
  print_key(id, reading, key);
  model_source source = {call, id, reading ? *reading : (api_reading){0}};
  return api_call_take(call, key, build_model, &source, out);
}

void api_model_remember(api_service *service, const char *id, tw_model *model) {
  char key[MODEL_KEY];
  print_key(id, NULL, key);
  const api_built built = built_model(model);
  api_cache_put(service->cache, key, &built);
}

/* ---- from a body ----------------------------------------------------------------------------- */

api_outcome api_model_read_body(api_call *call, const api_reading *reading, api_upload *upload,
                                tw_model **out) {
  tw_format format;
  api_outcome outcome = api_upload_read(call, upload);
  if (outcome != API_DONE) return outcome;
  bool is_read =
      api_upload_format(call, upload->bytes, &format) == API_DONE &&
      api_model_read_granted(call, upload->bytes, 0, format, reading ? *reading : (api_reading){0}, out);
  if (is_read) return API_DONE;
  api_upload_deinit(upload);
  return API_FAILED;
}

api_outcome api_model_find_given_name(api_call *call, const api_upload *upload, const char **out) {
  const char *name = api_query_get(&call->query, "name"),
             *disposition = api_call_header(call, "Content-Disposition");
  if (!name && disposition && !api_file_name_read(api_span_of(disposition), call->arena, &name))
    return api_fail_without_memory(call);
  if (!name) name = upload->name;
  *out = name ? api_file_name_title(name, call->arena) : NULL;
  return API_DONE;
}

api_outcome api_model_of_body(api_call *call, const api_reading *reading, api_entry **out) {
  api_upload upload = {0};
  tw_model *model = NULL;
  const char *name = NULL;
  api_outcome outcome = api_model_read_body(call, reading, &upload, &model);
  if (outcome != API_DONE) return outcome;
  outcome = api_model_find_given_name(call, &upload, &name);
  api_upload_deinit(&upload);
  if (outcome == API_DONE && !api_model_set_name(model, name)) outcome = api_fail_without_memory(call);
  if (outcome != API_DONE) {
    tw_model_destroy(model);
    return outcome;
  }
  api_built built = built_model(model);
  *out = api_cache_own(call->service->cache, &built);
  return *out ? API_DONE : api_fail_without_memory(call);
}
