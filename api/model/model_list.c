/* Lists the models of the store, a page at a time. */
#include "handlers.h"
#include "models.h"
#include "service.h"
#include "stored.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LIST_DEFAULT = 100, LIST_MOST = 1000 };

/* Prints name and format from a summary; false when they are missing. */
static bool print_from_summary(const char *text, tw_text *out) {
  api_summary summary;
  bool is_whole = api_summary_read(text, &summary);
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
  api_model_print_listed(api_entry_value(entry), text);
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
    return api_store_fail_unavailable(call);
  api_outcome outcome = reply_list(call, listed, count, more, limit);
  for (size_t i = 0; i < count; i++) free(listed[i].summary);
  return outcome;
}
