/* Returns the bytes of a model as they were uploaded. */
#include "file_name.h"
#include "handlers.h"
#include "stored.h"

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
  uint8_t *bytes = api_stored_read(call, blob);
  if (bytes) *out = tw_format_sniff(bytes, (size_t)blob->size);
  tw_free(bytes);
  return bytes ? API_DONE : API_FAILED;
}

/* Sets the type, and suggests the name of the first upload. Names within the model are not considered, as
 * that takes parsing it. */
static api_outcome name_source(api_call *call, const api_blob *blob) {
  static const char *const extensions[TW_FORMATS] = {"obj", "json", "gltf", "glb", "stl", "ply", "bvh"};
  api_summary stored;
  bool has_summary = api_summary_find(call->service, call->id, &stored);
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
  call->answer.body = (api_body){range.count, body, read_source, destroy_source, false};
  return API_DONE;
}

api_outcome api_get_source(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  source_body *body = tw_arena_alloc(call->arena, 1, sizeof *body);
  if (!body) return api_fail_without_memory(call);
  api_outcome outcome = api_stored_open(call, call->id, &body->blob);
  if (outcome != API_DONE) return outcome;
  outcome = reply_source(call, body);
  if (!call->answer.body.read) destroy_source(body);
  return outcome;
}
