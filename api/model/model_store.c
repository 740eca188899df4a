/* Models as a resource: storing, describing and deleting them. */
#include "model_store.h"

#include "handlers.h"
#include "models.h"
#include "response_cache.h"
#include "service.h"
#include "stored.h"

#include <stdio.h>
#include <string.h>

/* ---- storing --------------------------------------------------------------------------------- */

/* Gives the model the name of its first upload; where no summary is stored, the given one. False without
 * memory. */
static bool take_name(api_service *service, const char *id, const char *given, tw_model *model) {
  api_summary stored;
  bool is_named = api_model_set_name(model, api_summary_find(service, id, &stored) ? stored.name : given);
  cJSON_Delete(stored.tree);
  return is_named;
}

/* Prints the summary to be stored, so that listing need not read the model. */
static void print_summary(const tw_model *model, tw_text *out) {
  tw_text_add(out, "{");
  api_model_print_listed(model, out);
  tw_text_add(out, "}");
  tw_text_bytes(out, "", 1); /* the terminator */
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
  return status == API_STORE_OK ? API_DONE : api_store_fail_writing(call, status);
}

static const char description[] = "description.json";

/* Header fields of an answer that describes a stored model. */
typedef struct model_head {
  const char *location, *etag;
} model_head;

/* After the model was described. False without memory. */
static bool make_head(api_call *call, const char *id, model_head *out) {
  char path[64];
  int length = snprintf(path, sizeof path, "/v1/models/%s", id);
  out->location = tw_arena_text(call->arena, path, (size_t)length);
  out->etag = api_etag(call, id, description, call->told_name ? call->told_name : "");
  return out->location && out->etag;
}

static void answer_stored(api_call *call, int status, const model_head *head, tw_text *text) {
  api_answer_text(&call->answer, status, call->offer->type, text);
  api_answer_header(&call->answer, "Location", head->location);
  api_answer_header(&call->answer, "ETag", head->etag);
}

/* What is told of a model that is stored. */
typedef struct told_model {
  const char *id;
  uint64_t size;
  const char *given;            /* its name where no summary is stored; or NULL */
  const api_addition *addition; /* or NULL */
  tw_model *model;
} told_model;

/* Names the model, and prints the answer's text and fields. False: the call's fault says why. */
static bool print_told(api_call *call, const told_model *told, tw_text *text, model_head *head) {
  if (!take_name(call->service, told->id, told->given, told->model))
    return api_fault_without_memory(&call->fault);
  if (!api_describe(told->model, told->id, told->size, text, call)) return false;
  if (told->addition && !text->failed) {
    text->size -= 2; /* the end of the object */
    told->addition->print(told->addition->context, text);
    tw_text_add(text, "}\n");
  }
  return (!text->failed && make_head(call, told->id, head)) || api_fault_without_memory(&call->fault);
}

/* Whether the name that was told is not the stored one: another request has stored the model meanwhile. */
static bool is_named_otherwise(api_call *call, const char *id) {
  api_summary stored;
  bool has_summary = api_summary_find(call->service, id, &stored);
  const char *name = stored.name ? stored.name : "", *told = call->told_name ? call->told_name : "";
  bool differs = has_summary && strcmp(name, told) != 0;
  cJSON_Delete(stored.tree);
  return differs;
}

/* Stores a model and answers. The answer is printed first: a request that fails stores nothing. */
static api_outcome store_printed(api_call *call, api_bytes bytes, const char *name,
                                 const api_addition *addition, tw_model *model) {
  char id[API_ID_TEXT];
  tw_text text = {0};
  bool existed = false;
  api_model_id_print(bytes, id);
  model_head head = {0};
  const told_model told = {id, bytes.size, name, addition, model};
  uint32_t warning_count = call->warning_count; /* before the description's */
  const char *first_warning = call->first_warning;
  bool is_ready =
      print_told(call, &told, &text, &head) && store_model(call, bytes, id, model, &existed) == API_DONE;
  if (is_ready && existed && is_named_otherwise(call, id)) {
    tw_text_deinit(&text);
    call->warning_count = warning_count;
    call->first_warning = first_warning;
    is_ready = print_told(call, &told, &text, &head);
  }
  if (!is_ready) {
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
    api_model_remember(call->service, call->id, model);
  else
    tw_model_destroy(model);
  return outcome;
}

api_outcome api_post_model(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_upload upload = {0};
  tw_model *model = NULL;
  api_outcome outcome = api_model_read_body(call, NULL, &upload, &model);
  if (outcome != API_DONE) return outcome;
  const char *name = NULL;
  outcome = api_model_find_given_name(call, &upload, &name);
  if (outcome == API_DONE)
    outcome = store_and_answer(call, upload.bytes, name, NULL, model);
  else
    tw_model_destroy(model);
  api_upload_deinit(&upload);
  return outcome;
}

api_outcome api_model_store(api_call *call, api_bytes bytes, const char *name, const api_addition *addition) {
  tw_model *model = NULL;
  if (!api_model_read_granted(call, bytes, bytes.size, TW_FORMAT_GLB, (api_reading){0}, &model))
    return API_FAILED;
  return store_and_answer(call, bytes, name, addition, model);
}

int api_seed(api_service *service, const char *name, const uint8_t *bytes, size_t size) {
  api_bytes given = {bytes, size};
  char id[API_ID_TEXT];
  api_model_id_print(given, id);
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

/* ---- one model ------------------------------------------------------------------------------- */

/* fault: the call's. */
static bool print_description(void *context, tw_text *out, api_fault *fault) {
  (void)fault;
  api_call *call = context;
  api_blob blob;
  if (api_stored_open(call, call->id, &blob) != API_DONE) return false;
  uint64_t size = blob.size;
  blob.close(&blob);
  api_entry *entry;
  if (api_model_take(call, call->id, NULL, &entry) != API_DONE) return false;
  bool is_printed = api_describe(api_entry_value(entry), call->id, size, out, call);
  api_entry_release(entry);
  return is_printed;
}

api_outcome api_get_model(api_call *call) {
  char key[API_ID_TEXT + sizeof "/description"];
  snprintf(key, sizeof key, "%s/description", call->id);
  return api_response_reply(call, key, description, "", print_description, call);
}

api_outcome api_model_reply_stored(api_call *call) {
  model_head head = {0};
  tw_text text = {0};
  bool is_printed = print_description(call, &text, &call->fault);
  if (is_printed && !text.failed && make_head(call, call->id, &head)) {
    answer_stored(call, 200, &head, &text);
    return API_DONE;
  }
  tw_text_deinit(&text);
  return is_printed ? api_fail_without_memory(call) : API_FAILED;
}

/* Sets told_name of the call as a description does: to the name in the summary, or in the model where that is
 * lost. */
static api_outcome find_told_name(api_call *call) {
  api_summary stored;
  api_entry *entry = NULL;
  bool has_summary = api_summary_find(call->service, call->id, &stored);
  api_outcome outcome = has_summary ? API_DONE : api_model_take(call, call->id, NULL, &entry);
  if (outcome == API_DONE)
    outcome = api_tell_name(call, has_summary ? stored.name : api_model_name(api_entry_value(entry)))
                  ? API_DONE
                  : api_fail_without_memory(call);
  api_entry_release(entry);
  cJSON_Delete(stored.tree);
  return outcome;
}

static api_outcome check_deletion(api_call *call) {
  if (!api_call_header(call, "If-Match") && !api_call_header(call, "If-None-Match")) return API_CONTINUE;
  api_outcome outcome = find_told_name(call);
  return outcome == API_DONE ? api_check_conditions(call, description, call->told_name ? call->told_name : "")
                             : outcome;
}

api_outcome api_delete_model(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  const api_store *store = &call->service->store;
  if (check_deletion(call) != API_CONTINUE) {
    bool is_absent = store->look(store->context, call->id, true) == API_STORE_ABSENT;
    return is_absent ? api_model_fail_absent(call, call->id) : API_FAILED;
  }
  api_store_status status = store->remove(store->context, call->id);
  api_cache_forget(call->service->cache, call->id);
  call->answer.status = 204;
  if (status == API_STORE_OK) return API_DONE;
  return status == API_STORE_ABSENT ? api_model_fail_absent(call, call->id)
                                    : api_store_fail_writing(call, status);
}
