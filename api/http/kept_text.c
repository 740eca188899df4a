/* Texts in the cache. */
#include "kept_text.h"

#include "service.h"

#include <stdlib.h>

typedef struct text_source {
  api_print print;
  void *context;
} text_source;

static void destroy_text(void *value) {
  api_text_deinit(value);
  free(value);
}

static bool build_text(void *context, api_built *out, api_fault *fault) {
  const text_source *source = context;
  api_text *text = tw_alloc_zero(1, sizeof *text);
  if (!text) {
    api_fault_without_memory(fault);
    return false;
  }
  bool is_printed = source->print(source->context, text, fault);
  if (is_printed && !text->failed) {
    *out = (api_built){text, text->capacity, destroy_text};
    return true;
  }
  destroy_text(text);
  if (is_printed) api_fault_without_memory(fault);
  return false;
}

api_outcome api_reply_kept(api_call *call, const char *key, const char *representation, const char *canonical,
                           api_print print, void *context) {
  text_source source = {print, context};
  api_entry *entry;
  api_outcome outcome = api_call_take(call, key, build_text, &source, &entry);
  if (outcome != API_DONE) return outcome;
  outcome = api_validate(call, representation, canonical);
  if (outcome == API_CONTINUE) {
    const api_text *known = api_entry_value(entry);
    api_text text = {0};
    api_text_bytes(&text, known->data, known->size);
    outcome = api_reply(call, &text);
  }
  api_entry_release(entry);
  return outcome;
}
