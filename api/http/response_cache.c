/* Cached answers: texts in the cache with their warnings, sent from the entries. */
#include "response_cache.h"

#include "service.h"

#include <stdlib.h>
#include <string.h>

/* ---- building -------------------------------------------------------------------------------- */

/* A cached answer. */
typedef struct response {
  tw_text text;
  uint32_t warning_count;
  char *first_warning; /* percent-encoded, or NULL */
  char *told_name;     /* as in the call, or NULL */
} response;

typedef struct response_source {
  api_call *call;
  api_print print;
  void *context;
} response_source;

static void destroy_response(void *value) {
  response *made = value;
  tw_text_deinit(&made->text);
  free(made->first_warning);
  free(made->told_name);
  free(made);
}

/* NULL stays NULL. False without memory. */
static bool copy_text(const char *text, char **out) {
  *out = text ? strdup(text) : NULL;
  return !text || *out;
}

/* Keeps what the call has of warnings and names once its answer is printed. False without memory. */
static bool keep_told(const api_call *call, response *out) {
  out->warning_count = call->warning_count;
  return copy_text(call->first_warning, &out->first_warning) && copy_text(call->told_name, &out->told_name);
}

static bool build_response(void *context, api_built *out, api_fault *fault) {
  const response_source *source = context;
  response *made = tw_alloc_zero(1, sizeof *made);
  if (!made) return api_fault_without_memory(fault);
  bool is_printed = source->print(source->context, &made->text, fault);
  if (is_printed && !made->text.failed && keep_told(source->call, made)) {
    tw_text_fit(&made->text);
    *out = (api_built){made, sizeof *made + made->text.capacity, destroy_response, API_CACHED_ANSWER};
    return true;
  }
  destroy_response(made);
  if (is_printed) api_fault_without_memory(fault);
  return false;
}

static api_outcome take(api_call *call, const char *key, api_print print, void *context, api_entry **out) {
  response_source source = {call, print, context};
  return api_call_take(call, key, build_response, &source, out);
}

/* ---- sending --------------------------------------------------------------------------------- */

/* The most that the host reads at once. */
enum { HOST_BLOCK = 256 << 10 };

typedef struct response_body {
  api_entry *entry;
  size_t sent;
} response_body;

static int64_t read_response(void *context, uint8_t *out, size_t capacity) {
  response_body *body = context;
  const tw_text *text = &((const response *)api_entry_value(body->entry))->text;
  size_t left = text->size - body->sent, count = left < capacity ? left : capacity;
  memcpy(out, text->data + body->sent, count);
  body->sent += count;
  return (int64_t)count;
}

static void release_response(void *context) {
  api_entry_release(((response_body *)context)->entry);
}

/* Takes over the entry. */
static api_outcome send_entry(api_call *call, api_entry *entry) {
  response_body *body = tw_arena_alloc(call->arena, 1, sizeof *body);
  if (!body) {
    api_entry_release(entry);
    return api_fail_without_memory(call);
  }
  body->entry = entry;
  const response *kept = api_entry_value(entry);
  size_t size = kept->text.size;
  call->warning_count = kept->warning_count;
  call->first_warning = kept->first_warning;
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  call->answer.body = (api_body){size, body, read_response, release_response, false};
  call->held = call->is_head ? 0 : size < HOST_BLOCK ? size : HOST_BLOCK;
  return API_DONE;
}

api_outcome api_response_reply(api_call *call, const char *key, const char *representation,
                               const char *canonical, api_print print, void *context) {
  api_entry *entry;
  api_outcome outcome = take(call, key, print, context, &entry);
  if (outcome != API_DONE) return outcome;
  const response *kept = api_entry_value(entry);
  outcome = api_validate(call, representation, kept->told_name ? kept->told_name : canonical);
  if (outcome == API_CONTINUE) return send_entry(call, entry);
  api_entry_release(entry);
  return outcome;
}

/* ---- answers asked for repeatedly ------------------------------------------------------------ */

/* Whether the last request in this hash's slot had the same hash. Keeps one-off requests out of the cache. */
static bool was_asked_before(api_service *service, uint32_t hash) {
  atomic_uint *place = &service->asked[hash % API_ASKED];
  hash |= 1; /* slots begin as 0 */
  return atomic_exchange_explicit(place, hash, memory_order_relaxed) == hash;
}

api_outcome api_response_reply_repeated(api_call *call, const char *key, api_print print, void *context) {
  api_entry *entry = api_cache_peek(call->service->cache, key);
  if (entry) return send_entry(call, entry);
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  if (!was_asked_before(call->service, api_cache_hash(key))) return API_CONTINUE;
  api_outcome outcome = take(call, key, print, context, &entry);
  return outcome == API_DONE ? send_entry(call, entry) : outcome;
}
