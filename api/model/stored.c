/* Looks into the store, on behalf of handlers. */
#include "stored.h"

#include "service.h"

#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>

void api_model_id_print(api_bytes bytes, char out[API_ID_TEXT]) {
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

/* ---- faults ---------------------------------------------------------------------------------- */

api_outcome api_store_fail_unavailable(api_call *call) {
  call->fault.refusal = API_REFUSAL_STORE;
  call->fault.retry_after_s = 2;
  return api_fail_with(call, 503, "the store cannot be reached");
}

api_outcome api_model_fail_full(api_call *call) {
  return api_fail_with(call, 507,
                       "the store is full: delete models, raise --store-limit, or free disk space, of which "
                       "--min-free stays free");
}

api_outcome api_store_fail_writing(api_call *call, api_store_status status) {
  if (status != API_STORE_FULL) return api_store_fail_unavailable(call);
  return api_model_fail_full(call);
}

api_outcome api_model_fail_absent(api_call *call, const char *id) {
  return api_fail_with(call, 404, "no model has the id %s", id);
}

/* Cached values made of the intact bytes are removed: every answer about the model then says that it is
 * damaged. */
static api_outcome fail_damaged(api_call *call, const char *id) {
  api_cache_forget(call->service->cache, id);
  return api_fail_with(call, 500, "the stored bytes are damaged; upload them again");
}

/* ---- bytes ----------------------------------------------------------------------------------- */

api_outcome api_stored_open(api_call *call, const char *id, api_blob *out) {
  const api_store *store = &call->service->store;
  switch (store->open(store->context, id, out)) {
  case API_STORE_OK: return API_DONE;
  case API_STORE_ABSENT: return api_model_fail_absent(call, id);
  case API_STORE_DAMAGED: return fail_damaged(call, id);
  case API_STORE_UNAVAILABLE:
  case API_STORE_FULL:
  case API_STORE_UNKNOWN: break;
  }
  return api_store_fail_unavailable(call);
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
  return api_model_fail_absent(call, id);
}

uint8_t *api_stored_read(api_call *call, const api_blob *blob) {
  uint8_t *bytes = blob->size < SIZE_MAX ? tw_alloc(1, (size_t)blob->size + 1) : NULL;
  if (!bytes) {
    api_fail_without_memory(call);
  } else if (!blob->read(blob, 0, bytes, (size_t)blob->size)) {
    tw_free(bytes);
    bytes = NULL;
    api_store_fail_unavailable(call); /* the bytes were whole when the blob was opened: reading them fails */
  }
  return bytes;
}

/* ---- summaries ------------------------------------------------------------------------------- */

bool api_summary_read(const char *text, api_summary *out) {
  cJSON *tree = text ? cJSON_Parse(text) : NULL;
  const cJSON *name = cJSON_GetObjectItemCaseSensitive(tree, "name");
  const char *format = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(tree, "format"));
  *out = (api_summary){.tree = tree, .name = cJSON_GetStringValue(name)};
  if (!format || (!out->name && !cJSON_IsNull(name))) return false;
  for (int i = 0; i < TW_FORMATS; i++) {
    out->format = (tw_format)i;
    if (strcmp(format, tw_format_names[i]) == 0) return true;
  }
  return false;
}

bool api_summary_find(api_service *service, const char *id, api_summary *out) {
  char *text = service->store.summary(service->store.context, id);
  bool is_read = api_summary_read(text, out);
  free(text);
  return is_read;
}
