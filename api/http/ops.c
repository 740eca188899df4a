/* Operations: health, readiness, version and metrics. */
#include "handlers.h"
#include "service.h"

static api_outcome reply_uncached(api_call *call, tw_text *text) {
  api_answer_header(&call->answer, "Cache-Control", "no-store");
  return api_reply(call, text);
}

api_outcome api_get_health(api_call *call) {
  tw_text text = {0};
  tw_text_add(&text, "{\"status\":\"ok\"}\n");
  return reply_uncached(call, &text);
}

api_outcome api_get_ready(api_call *call) {
  if (atomic_load(&call->service->is_draining)) {
    call->fault.retry_after_s = 1;
    return api_fail_with(call, 503, "draining: this process is about to stop");
  }
  const api_store *store = &call->service->store;
  if (store->probe(store->context) != API_STORE_OK) {
    call->fault.retry_after_s = 1;
    return api_fail_with(call, 503, "the store cannot be reached");
  }
  tw_text text = {0};
  tw_text_add(&text, "{\"status\":\"ready\"}\n");
  return reply_uncached(call, &text);
}

api_outcome api_get_version(api_call *call) {
  tw_text text = {0};
  tw_text_add(&text, "{\"name\":\"tweend\",\"version\":");
  tw_text_string(&text, tw_version());
  tw_text_add(&text, ",\"api\":\"v1\"}\n");
  return reply_uncached(call, &text);
}

api_outcome api_get_metrics(api_call *call) {
  const api_metrics *metrics = &call->service->metrics;
  size_t size = 0;
  char *text = metrics->print(metrics->owner, &size);
  if (!text) return api_fail_without_memory(call);
  tw_text printed = {.data = text, .size = size, .capacity = size};
  api_answer_header(&call->answer, "Cache-Control", "no-store");
  api_answer_text(&call->answer, 200, "text/plain; version=0.0.4; charset=utf-8", &printed);
  return API_DONE;
}
