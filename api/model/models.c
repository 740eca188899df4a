/* Models: storing, listing, describing, returning and deleting them. */
#include "models.h"

#include "file_name.h"
#include "handlers.h"
#include "response_cache.h"
#include "service.h"
#include "upload.h"

#include <cjson/cJSON.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MODEL_KEY = API_ID_TEXT + 64 }; /* of a cache key, at most */

static void print_id(api_bytes bytes, char out[API_ID_TEXT]) {
  struct sha256_ctx hash;
  uint8_t digest[(API_ID_TEXT - 1) / 2];
  sha256_init(&hash);
  sha256_update(&hash, bytes.size, bytes.data);
  sha256_digest(&hash, sizeof digest, digest);
  api_hex(digest, sizeof digest, out);
  out[API_ID_TEXT - 1] = '\0';
}

bool api_is_model_id(const char *text, size_t length) {
  if (length != API_ID_TEXT - 1) return false;
  unsigned others = 0; /* no early exit, so that the loop vectorises */
  for (size_t i = 0; i < API_ID_TEXT - 1; i++) {
    uint8_t c = (uint8_t)text[i];
    others |= !((c >= '0') & (c <= '9')) & !((c >= 'a') & (c <= 'f'));
  }
  return others == 0;
}

/* ---- parsed models ----------------------------------------------------------------------------- */

static void destroy_model(void *model) {
  tw_model_destroy(model);
}

static api_built built_model(tw_model *model) {
  return (api_built){model, tw_model_size(model), destroy_model, API_CACHED_MODEL};
}

static api_outcome fail_unavailable(api_call *call) {
  call->fault.refusal = API_REFUSAL_STORE;
  call->fault.retry_after_s = 2;
  return api_fail_with(call, 503, "the store cannot be reached");
}

api_outcome api_model_fail_full(api_call *call) {
  return api_fail_with(call, 507,
                       "the store is full: delete models, raise --store-limit, or free disk space, of which "
                       "--min-free stays free");
}

static api_outcome fail_writing(api_call *call, api_store_status status) {
  if (status != API_STORE_FULL) return fail_unavailable(call);
  return api_model_fail_full(call);
}

static api_outcome fail_absent(api_call *call, const char *id) {
  return api_fail_with(call, 404, "no model has the id %s", id);
}

/* Cached values made of the intact bytes are removed: every answer about the model then says that it is
 * damaged. */
static api_outcome fail_damaged(api_call *call, const char *id) {
  api_cache_forget(call->service->cache, id);
  return api_fail_with(call, 500, "the stored bytes are damaged; upload them again");
}

/* Opens the stored bytes. */
static api_outcome open_stored(api_call *call, const char *id, api_blob *out) {
  const api_store *store = &call->service->store;
  switch (store->open(store->context, id, out)) {
  case API_STORE_OK: return API_DONE;
  case API_STORE_ABSENT: return fail_absent(call, id);
  case API_STORE_DAMAGED: return fail_damaged(call, id);
  case API_STORE_UNAVAILABLE:
  case API_STORE_FULL:
  case API_STORE_UNKNOWN: break;
  }
  return fail_unavailable(call);
}

api_outcome api_model_look(api_call *call, const char *id) {
  const api_store *store = &call->service->store;
  switch (store->look(store->context, id, call->effort != API_LIGHT)) {
  case API_STORE_OK:
  case API_STORE_FULL:
  case API_STORE_UNAVAILABLE: return API_CONTINUE;
  case API_STORE_UNKNOWN: return API_NEEDS_LOOK;
  case API_STORE_DAMAGED: return fail_damaged(call, id);
  case API_STORE_ABSENT: break;
  }
  api_cache_forget(call->service->cache, id);
  return fail_absent(call, id);
}

/* Reads all bytes of an open blob, for tw_free; NULL: the fault says why. */
static uint8_t *read_whole(api_call *call, const api_blob *blob) {
  uint8_t *bytes = blob->size < SIZE_MAX ? tw_alloc(1, (size_t)blob->size + 1) : NULL;
  if (!bytes) {
    api_fail_without_memory(call);
  } else if (!blob->read(blob, 0, bytes, (size_t)blob->size)) {
    tw_free(bytes);
    bytes = NULL;
    fail_unavailable(call); /* the bytes were whole when the blob was opened: reading them fails */
  }
  return bytes;
}

typedef struct model_source {
  api_call *call;
  const char *id;
  api_reading reading;
} model_source;

/* ---- names -------------------------------------------------------------------------------------- */

/* The summary stored with a model's bytes. */
typedef struct summary {
  cJSON *tree;      /* holds the name; freed by the caller, even where there is no summary */
  const char *name; /* or NULL */
  tw_format format;
} summary;

/* Reads a summary; false where it is lost. text: or NULL. */
static bool read_summary(const char *text, summary *out) {
  cJSON *tree = text ? cJSON_Parse(text) : NULL;
  const cJSON *name = cJSON_GetObjectItemCaseSensitive(tree, "name");
  const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(tree, "format"));
  *out = (summary){.tree = tree, .name = cJSON_GetStringValue(name)};
  if (!format || (!out->name && !cJSON_IsNull(name))) return false;
  for (int i = 0; i < TW_FORMATS; i++) {
    out->format = (tw_format)i;
    if (strcmp(format, tw_format_names[i]) == 0) return true;
  }
  return false;
}

/* The same for a stored model. */
static bool find_summary(api_service *service, const char *id, summary *out) {
  char *text = service->store.summary(service->store.context, id);
  bool is_read = read_summary(text, out);
  free(text);
  return is_read;
}

/* False without memory. name: or NULL. */
static bool set_name(tw_model *model, const char *name) {
  if (name) model->name = tw_arena_text(model->arena, name, strlen(name));
  return !name || model->name;
}

/* Gives the model the name of its first upload; where no summary is stored, the given one. False without
 * memory. */
static bool take_name(api_service *service, const char *id, const char *given, tw_model *model) {
  summary stored;
  bool is_named = set_name(model, find_summary(service, id, &stored) ? stored.name : given);
  cJSON_Delete(stored.tree);
  return is_named;
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

/* Parses a model after memory for that is granted, in addition to `held`. */
static bool read_granted(api_call *call, api_bytes bytes, uint64_t held, tw_format format,
                         api_reading reading, tw_model **out) {
  const api_making making = api_making_within(call->service);
  return api_grant(call, held + tw_reading_size(format, bytes.size)) &&
         api_model_read(bytes, format, reading, &making, out, &call->fault);
}

/* fault: the call's. */
static bool build_model(void *context, api_built *out, api_fault *fault) {
  const model_source *source = context;
  api_call *call = source->call;
  api_blob blob;
  if (open_stored(call, source->id, &blob) != API_DONE) return false;
  summary stored;
  bool has_summary = find_summary(call->service, source->id, &stored);
  tw_format likely = has_summary ? stored.format : TW_FORMAT_GLTF; /* the format that takes most */
  bool is_granted = api_grant(call, tw_reading_size(likely, blob.size));
  uint8_t *data = is_granted ? read_whole(call, &blob) : NULL;
  api_bytes bytes = {data, (size_t)blob.size};
  blob.close(&blob);
  tw_model *model = NULL;
  bool is_read =
      data && read_granted(call, bytes, 0, tw_format_sniff(data, bytes.size), source->reading, &model);
  tw_free(data);
  bool is_named = is_read && set_name(model, has_summary ? stored.name : NULL);
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

/* Reads the body and parses the model in it. The caller owns both after API_DONE. */
static api_outcome read_body(api_call *call, const api_reading *reading, api_upload *upload, tw_model **out) {
  tw_format format;
  api_outcome outcome = api_upload_read(call, upload);
  if (outcome != API_DONE) return outcome;
  bool is_read = api_upload_format(call, upload->bytes, &format) == API_DONE &&
                 read_granted(call, upload->bytes, 0, format, reading ? *reading : (api_reading){0}, out);
  if (is_read) return API_DONE;
  api_upload_deinit(upload);
  return API_FAILED;
}

api_outcome api_model_of_body(api_call *call, const api_reading *reading, api_entry **out) {
  api_upload upload = {0};
  tw_model *model = NULL;
  api_outcome outcome = read_body(call, reading, &upload, &model);
  if (outcome != API_DONE) return outcome;
  api_upload_deinit(&upload);
  api_built built = built_model(model);
  *out = api_cache_own(call->service->cache, &built);
  return *out ? API_DONE : api_fail_without_memory(call);
}

/* ---- storing ------------------------------------------------------------------------------------ */

/* Prints the name and format that a listing shows. */
static void print_name_and_format(const tw_model *model, tw_text *out) {
  tw_member_string(out, "name", api_model_name(model));
  tw_member_string(out, "format", tw_format_names[model->format]);
}

/* Prints the summary to be stored, so that listing need not read the model. */
static void print_summary(const tw_model *model, tw_text *out) {
  tw_text_add(out, "{");
  print_name_and_format(model, out);
  tw_text_add(out, "}");
  tw_text_bytes(out, "", 1); /* the terminator */
}

/* Caches a model that has just been stored, so that its first reader need not parse it. Takes the model
 * over. */
static void remember(api_service *service, const char *id, tw_model *model) {
  char key[MODEL_KEY];
  print_key(id, NULL, key);
  const api_built built = built_model(model);
  api_cache_put(service->cache, key, &built);
}

/* Stores a model's bytes and summary. */
static api_outcome store_model(api_call *call, api_bytes bytes, const char *id, const tw_model *model,
                               bool *existed) {
  const api_store *store = &call->service->store;
  tw_text summary = {0};
  print_summary(model, &summary);
  bool is_printed = !summary.failed;
  api_store_status status =
      is_printed ? store->put(store->context, id, bytes, summary.data, existed) : API_STORE_UNKNOWN;
  tw_text_deinit(&summary);
  if (!is_printed) return api_fail_without_memory(call);
  return status == API_STORE_OK ? API_DONE : fail_writing(call, status);
}

static const char description[] = "description.json";

/* The headers of an answer about a stored model. */
typedef struct model_head {
  const char *location, *etag;
} model_head;

/* False without memory. */
static bool make_head(api_call *call, const char *id, model_head *out) {
  char path[64];
  int length = snprintf(path, sizeof path, "/v1/models/%s", id);
  out->location = tw_arena_text(call->arena, path, (size_t)length);
  out->etag = api_etag(call, id, description, "");
  return out->location && out->etag;
}

static void answer_stored(api_call *call, int status, const model_head *head, tw_text *text) {
  api_answer_text(&call->answer, status, call->offer->type, text);
  api_answer_header(&call->answer, "Location", head->location);
  api_answer_header(&call->answer, "ETag", head->etag);
}

/* Stores a model and answers. The answer is printed first: a request that fails stores nothing. */
static api_outcome store_printed(api_call *call, api_bytes bytes, const char *name,
                                 const api_addition *addition, tw_model *model) {
  char id[API_ID_TEXT];
  tw_text text = {0};
  bool existed = false;
  print_id(bytes, id);
  model_head head;
  if (!make_head(call, id, &head) || !take_name(call->service, id, name, model))
    return api_fail_without_memory(call);
  bool is_ready = api_describe(model, id, bytes.size, &text, call);
  if (is_ready && addition && !text.failed) {
    text.size -= 2; /* the end of the object */
    addition->print(addition->context, &text);
    tw_text_add(&text, "}\n");
  }
  if (is_ready && text.failed) is_ready = api_fault_without_memory(&call->fault);
  if (!is_ready || store_model(call, bytes, id, model, &existed) != API_DONE) {
    tw_text_deinit(&text);
    return API_FAILED;
  }
  answer_stored(call, existed ? 200 : 201, &head, &text);
  memcpy(call->id, id, sizeof id);
  return API_DONE;
}

/* The same; takes the model over. addition: or NULL. */
static api_outcome store_and_answer(api_call *call, api_bytes bytes, const char *name,
                                    const api_addition *addition, tw_model *model) {
  api_outcome outcome = store_printed(call, bytes, name, addition, model);
  if (outcome == API_DONE)
    remember(call->service, call->id, model);
  else
    tw_model_destroy(model);
  return outcome;
}

/* The name of an upload: of the query, of the request's Content-Disposition, or of the file in a form; NULL
 * for none. */
static api_outcome find_name(api_call *call, const api_upload *upload, const char **out) {
  const char *name = api_query_get(&call->query, "name"),
             *disposition = api_call_header(call, "Content-Disposition");
  if (!name && disposition && !api_file_name_read(api_span_of(disposition), call->arena, &name))
    return api_fail_without_memory(call);
  if (!name) name = upload->name;
  *out = name ? api_file_name_title(name, call->arena) : NULL;
  return API_DONE;
}

api_outcome api_post_model(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_upload upload = {0};
  tw_model *model = NULL;
  api_outcome outcome = read_body(call, NULL, &upload, &model);
  if (outcome != API_DONE) return outcome;
  const char *name = NULL;
  outcome = find_name(call, &upload, &name);
  if (outcome == API_DONE)
    outcome = store_and_answer(call, upload.bytes, name, NULL, model);
  else
    tw_model_destroy(model);
  api_upload_deinit(&upload);
  return outcome;
}

api_outcome api_model_store(api_call *call, api_bytes bytes, const char *name, const api_addition *addition) {
  tw_model *model = NULL;
  if (!read_granted(call, bytes, bytes.size, TW_FORMAT_GLB, (api_reading){0}, &model)) return API_FAILED;
  return store_and_answer(call, bytes, name, addition, model);
}

int api_seed(api_service *service, const char *name, const uint8_t *bytes, size_t size) {
  api_bytes given = {bytes, size};
  char id[API_ID_TEXT];
  print_id(given, id);
  tw_model *model = NULL;
  bool existed = false;
  api_call call = {.service = service};
  const api_making making = api_making_within(service);
  bool is_stored =
      api_model_read(given, tw_format_sniff(bytes, size), (api_reading){0}, &making, &model, &call.fault) &&
      (take_name(service, id, name, model) || api_fault_without_memory(&call.fault)) &&
      store_model(&call, given, id, model, &existed) == API_DONE;
  tw_model_destroy(model);
  return !is_stored ? call.fault.status : existed ? 200 : 201;
}

/* ---- listing ------------------------------------------------------------------------------------ */

enum { LIST_DEFAULT = 100, LIST_MOST = 1000 };

/* Prints name and format from a summary; false when they are missing. */
static bool print_from_summary(const char *text, tw_text *out) {
  summary summary;
  bool is_whole = read_summary(text, &summary);
  if (is_whole) {
    tw_member_string(out, "name", summary.name);
    tw_member_string(out, "format", tw_format_names[summary.format]);
  }
  cJSON_Delete(summary.tree);
  return is_whole;
}

/* Prints name and format from the model itself, when its summary is lost. */
static bool print_from_model(api_call *call, const char *id, tw_text *text) {
  api_entry *entry;
  if (api_model_take(call, id, NULL, &entry) != API_DONE) return false;
  print_name_and_format(api_entry_value(entry), text);
  api_entry_release(entry);
  return true;
}

/* Prints one listed model. A model that was deleted meanwhile, or cannot be read, is left out; false when the
 * store or memory fails. */
static bool print_listed(api_call *call, const api_listed *listed, tw_text *text) {
  tw_text item = {0};
  tw_text_add(&item, "{");
  tw_member_string(&item, "id", listed->id);
  bool is_printed = print_from_summary(listed->summary, &item) || print_from_model(call, listed->id, &item);
  tw_member_count(&item, "bytes", listed->size);
  tw_text_add(&item, "}");
  if (is_printed) {
    tw_text_element(text);
    tw_text_bytes(text, item.data, item.size);
  }
  text->failed |= item.failed;
  tw_text_deinit(&item);
  bool is_stalled = call->fault.stall != API_STALL_NONE;
  return is_printed || (call->fault.status != 503 && !is_stalled);
}

static api_outcome reply_list(api_call *call, const api_listed *listed, size_t count, bool more,
                              uint64_t limit) {
  tw_text text = {0};
  tw_text_add(&text, "{\"models\":[");
  for (size_t i = 0; i < count; i++) {
    if (print_listed(call, &listed[i], &text)) continue;
    tw_text_deinit(&text);
    return API_FAILED;
  }
  tw_text_add(&text, "]");
  tw_text_member(&text, "next");
  char next[96];
  snprintf(next, sizeof next, "/v1/models?limit=%llu&after=%s", (unsigned long long)limit,
           count ? listed[count - 1].id : "");
  bool has_next = more && count > 0;
  tw_text_string(&text, has_next ? next : NULL);
  tw_text_add(&text, "}\n");
  api_answer_header(&call->answer, "Cache-Control", "no-cache");
  if (has_next) api_answer_headerf(&call->answer, "Link", "<%s>; rel=\"next\"", next);
  return api_reply(call, &text);
}

api_outcome api_list_models(api_call *call) {
  uint64_t limit = LIST_DEFAULT;
  const char *after = api_query_get(&call->query, "after");
  if (api_query_count(&call->query, "limit", &limit, &call->fault.error) != TW_OK) return api_fail(call);
  if (limit < 1 || limit > LIST_MOST) return api_fail_with(call, 400, "limit must be 1 to %d", LIST_MOST);
  if (after && !api_is_model_id(after, strlen(after)))
    return api_fail_with(call, 400, "after must be the id of a model");
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_listed *listed = tw_arena_alloc(call->arena, (size_t)limit, sizeof *listed);
  if (!listed) return api_fail_without_memory(call);
  size_t count = 0;
  bool more = false;
  const api_store *store = &call->service->store;
  if (store->list(store->context, after ? after : "", (size_t)limit, listed, &count, &more) != API_STORE_OK)
    return fail_unavailable(call);
  api_outcome outcome = reply_list(call, listed, count, more, limit);
  for (size_t i = 0; i < count; i++) free(listed[i].summary);
  return outcome;
}

/* ---- one model ---------------------------------------------------------------------------------- */

/* fault: the call's. */
static bool print_description(void *context, tw_text *out, api_fault *fault) {
  (void)fault;
  api_call *call = context;
  api_blob blob;
  if (open_stored(call, call->id, &blob) != API_DONE) return false;
  uint64_t size = blob.size;
  blob.close(&blob);
  api_entry *entry;
  if (api_model_take(call, call->id, NULL, &entry) != API_DONE) return false;
  bool is_printed = api_describe(api_entry_value(entry), call->id, size, out, call);
  api_entry_release(entry);
  return is_printed;
}

api_outcome api_get_model(api_call *call) {
  char key[MODEL_KEY];
  snprintf(key, sizeof key, "%s/description", call->id);
  return api_response_reply(call, key, description, "", print_description, call);
}

api_outcome api_model_reply_stored(api_call *call) {
  model_head head;
  tw_text text = {0};
  if (!make_head(call, call->id, &head)) return api_fail_without_memory(call);
  bool is_printed = print_description(call, &text, &call->fault);
  if (is_printed && !text.failed) {
    answer_stored(call, 200, &head, &text);
    return API_DONE;
  }
  tw_text_deinit(&text);
  return is_printed ? api_fail_without_memory(call) : API_FAILED;
}

api_outcome api_delete_model(api_call *call) {
  if (api_check_if_match(call, description) != API_CONTINUE) return API_FAILED;
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  const api_store *store = &call->service->store;
  api_store_status status = store->remove(store->context, call->id);
  api_cache_forget(call->service->cache, call->id);
  call->answer.status = 204;
  if (status == API_STORE_OK) return API_DONE;
  return status == API_STORE_ABSENT ? fail_absent(call, call->id) : fail_writing(call, status);
}

/* ---- source ------------------------------------------------------------------------------------- */

typedef struct source_body {
  api_blob blob;
  uint64_t at, end;
} source_body;

static int64_t read_source(void *context, uint8_t *out, size_t capacity) {
  source_body *body = context;
  uint64_t left = body->end - body->at;
  size_t count = left < capacity ? (size_t)left : capacity;
  if (!body->blob.read(&body->blob, body->at, out, count)) return -1;
  body->at += count;
  return (int64_t)count;
}

static void destroy_source(void *context) {
  source_body *body = context;
  body->blob.close(&body->blob);
}

/* The format of stored bytes, read from all of them: binary STL shows by their number, glTF by a member that
 * may stand at the end. */
static api_outcome sniff_stored(api_call *call, const api_blob *blob, tw_format *out) {
  uint8_t *bytes = read_whole(call, blob);
  if (bytes) *out = tw_format_sniff(bytes, (size_t)blob->size);
  tw_free(bytes);
  return bytes ? API_DONE : API_FAILED;
}

/* Sets the type, and suggests the name of the first upload. Names within the model are not considered, as
 * that takes parsing it. */
static api_outcome name_source(api_call *call, const api_blob *blob) {
  static const char *const extensions[TW_FORMATS] = {"obj", "json", "gltf", "glb", "stl", "ply", "bvh"};
  summary stored;
  bool has_summary = find_summary(call->service, call->id, &stored);
  api_outcome outcome = has_summary ? API_DONE : sniff_stored(call, blob, &stored.format);
  if (outcome == API_DONE) {
    api_answer_header(&call->answer, "Content-Type", tw_format_media_types[stored.format]);
    outcome = api_file_name_suggest(call, has_summary ? stored.name : NULL, extensions[stored.format]);
  }
  cJSON_Delete(stored.tree);
  return outcome;
}

static api_outcome reply_source(api_call *call, source_body *body) {
  uint64_t size = body->blob.size;
  api_range range = {0, size};
  api_outcome outcome = api_validate(call, "source", "");
  if (outcome == API_CONTINUE) outcome = api_range_answer(call, size, &range);
  if (outcome != API_CONTINUE) return outcome;
  outcome = name_source(call, &body->blob);
  if (outcome != API_DONE) return outcome;
  body->at = range.first;
  body->end = range.first + range.count;
  call->answer.body = (api_body){range.count, body, read_source, destroy_source};
  return API_DONE;
}

api_outcome api_get_source(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  source_body *body = tw_arena_alloc(call->arena, 1, sizeof *body);
  if (!body) return api_fail_without_memory(call);
  api_outcome outcome = open_stored(call, call->id, &body->blob);
  if (outcome != API_DONE) return outcome;
  outcome = reply_source(call, body);
  if (!call->answer.body.read) destroy_source(body);
  return outcome;
}
