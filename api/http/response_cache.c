/* Cached answers: texts in the cache, sent from the entries. */
#include "response_cache.h"

#include "service.h"

#include <stdlib.h>
#include <string.h>

/* ---- building ---------------------------------------------------------------------------------- */

typedef struct response_source {
  api_print print;
  void *context;
} response_source;

static void destroy_text(void *value) {
  tw_text_deinit(value);
  free(value);
}

static bool build_text(void *context, api_built *out, api_fault *fault) {
  const response_source *source = context;
  tw_text *text = tw_alloc_zero(1, sizeof *text);
  if (!text) return api_fault_without_memory(fault);
  bool is_printed = source->print(source->context, text, fault);
  if (is_printed && !text->failed) {
    tw_text_fit(text);
    *out = (api_built){text, sizeof *text + text->capacity, destroy_text, API_CACHED_ANSWER};
    return true;
  }
  destroy_text(text);
  if (is_printed) api_fault_without_memory(fault);
  return false;
}

static api_outcome take(api_call *call, const char *key, api_print print, void *context, api_entry **out) {
  response_source source = {print, context};
  return api_call_take(call, key, build_text, &source, out);
}

/* ---- sending ------------------------------------------------------------------------------------ */

/* The most that the host reads at once. */
enum { HOST_BLOCK = 256 << 10 };

typedef struct response_body {
  api_entry *entry;
  size_t sent;
} response_body;

static int64_t read_response(void *context, uint8_t *out, size_t capacity) {
  response_body *body = context;
  const tw_text *text = api_entry_value(body->entry);
  size_t left = text->size - body->sent, count = left < capacity ? left : capacity;
  memcpy(out, text->data + body->sent, count);
  body->sent += count;
  return (int64_t)count;
}

static void destroy_response(void *context) {
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
  const tw_text *text = api_entry_value(entry);
  call->answer.status = 200;
  api_answer_header(&call->answer, "Content-Type", call->offer->type);
  call->answer.body = (api_body){text->size, body, read_response, destroy_response};
  call->held = call->is_head ? 0 : text->size < HOST_BLOCK ? text->size : HOST_BLOCK;
  return API_DONE;
}

api_outcome api_response_reply(api_call *call, const char *key, const char *representation,
                               const char *canonical, api_print print, void *context) {
  api_entry *entry;
  api_outcome outcome = take(call, key, print, context, &entry);
  if (outcome != API_DONE) return outcome;
  outcome = api_validate(call, representation, canonical);
  if (outcome == API_CONTINUE) return send_entry(call, entry);
  api_entry_release(entry);
  return outcome;
}

/* ---- answers asked for repeatedly ---------------------------------------------------------------- */

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
