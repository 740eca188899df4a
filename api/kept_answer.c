/* Kept answers are entries of a cache of their own, so that poses, of which there is no end, do not drive out
 * models and plans. Only an extension says what the answer is regardless of Accept, so that only such paths
 * are kept. */
#include "kept_answer.h"

#include "models.h"
#include "routes.h"
#include "service.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { KEY_TEXT = 512, SIZE_MOST = 64 << 10, ASKED = 4096 };

/* A key is kept when it comes again before another one has taken its place here: most poses are asked for
 * once, and keeping those would only cost. */
struct api_kept_answers {
  api_cache *cache;
  atomic_uint asked[ASKED]; /* hashes */
};

typedef struct kept_answer {
  const char *type;
  char *etag; /* after the bytes, in one piece of memory */
  size_t size;
  uint8_t bytes[];
} kept_answer;

api_kept_answers *api_kept_answers_create(uint64_t budget) {
  api_kept_answers *answers = tw_alloc_zero(1, sizeof *answers);
  if (!answers) return NULL;
  answers->cache = api_cache_create(budget);
  if (answers->cache) return answers;
  free(answers);
  return NULL;
}

void api_kept_answers_destroy(api_kept_answers *answers) {
  if (!answers) return;
  api_cache_destroy(answers->cache);
  free(answers);
}

void api_kept_answers_forget(api_kept_answers *answers, const char *id) {
  api_cache_forget(answers->cache, id);
}

uint64_t api_kept_answers_size(api_kept_answers *answers) {
  return api_cache_size(answers->cache);
}

/* False when the call is none whose answer is kept. */
static bool write_key(const api_call *call, char out[KEY_TEXT]) {
  const api_request *request = call->request;
  size_t path = strlen(request->path), query = strlen(request->query);
  bool is_read = call->route->takes == API_TAKES_NOTHING && request->body.size == 0;
  if (!is_read || !call->id[0] || !strchr(request->path, '.')) return false;
  if (path > KEY_TEXT || query > KEY_TEXT || path + 1 + query >= KEY_TEXT) return false;
  memcpy(out, request->path, path);
  out[path] = '?';
  memcpy(out + path + 1, request->query, query + 1);
  return true;
}

static api_outcome reply(api_call *call, const kept_answer *kept) {
  char *etag = tw_arena_text(call->arena, kept->etag, strlen(kept->etag));
  if (!etag) return api_fail_without_memory(call);
  api_outcome outcome = api_validate_tag(call, etag);
  if (outcome != API_LATER) return outcome;
  api_text text = {0};
  api_text_bytes(&text, (const char *)kept->bytes, kept->size);
  api_answer_text(&call->answer, 200, kept->type, &text);
  return API_DONE;
}

api_outcome api_kept_answer(api_call *call) {
  char key[KEY_TEXT];
  if (!write_key(call, key)) return API_LATER;
  api_entry *entry = api_cache_peek(call->service->answers->cache, key);
  if (!entry) return API_LATER;
  /* A model that was deleted while its answer was on the way to being kept is not here; one that is in use
   * should stay here. */
  api_entry *model = api_model_peek(call->service, call->id);
  api_outcome outcome = model ? reply(call, api_entry_value(entry)) : API_LATER;
  api_entry_release(model);
  api_entry_release(entry);
  return outcome;
}

static bool build_kept(void *context, api_built *out, api_fault *fault) {
  kept_answer **made = context;
  (void)fault;
  *out = (api_built){*made, sizeof **made + (*made)->size + strlen((*made)->etag) + 1, free};
  *made = NULL;
  return true;
}

/* A copy of what the answer is; NULL without memory. */
static kept_answer *copy_answer(const api_answer *answer, const char *type, const char *etag) {
  size_t tag = strlen(etag) + 1;
  kept_answer *kept = tw_alloc(1, sizeof *kept + answer->bytes.size + tag);
  if (!kept) return NULL;
  *kept = (kept_answer){.type = type, .size = answer->bytes.size};
  kept->etag = (char *)kept->bytes + kept->size;
  memcpy(kept->bytes, answer->bytes.data, kept->size);
  memcpy(kept->etag, etag, tag);
  return kept;
}

void api_keep_answer(const api_call *call) {
  char key[KEY_TEXT];
  const api_answer *answer = &call->answer;
  const char *etag = api_answer_find(answer, "ETag");
  if (answer->status != 200 || answer->bytes.size > SIZE_MOST || !etag || !write_key(call, key)) return;
  api_kept_answers *answers = call->service->answers;
  unsigned hash = api_cache_hash(key);
  if (atomic_exchange_explicit(&answers->asked[hash % ASKED], hash, memory_order_relaxed) != hash) return;
  kept_answer *made = copy_answer(answer, call->offer->type, etag);
  if (!made) return;
  api_fault fault;
  api_entry_release(api_cache_take(answers->cache, key, build_kept, &made, &fault));
  free(made); /* when another thread kept it */
}
