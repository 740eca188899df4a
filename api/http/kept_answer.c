/* Kept answers are entries of a cache of their own, so that poses, of which there is no end, do not drive out
 * models and plans. */
#include "kept_answer.h"

#include "models.h"
#include "service.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { SIZE_MOST = 64 << 10, ASKED = 4096 };

/* A key counts as asked again when it comes before another one has taken its place here: most poses are asked
 * for once, and keeping those would only cost. */
struct api_kept_answers {
  api_cache *cache;
  atomic_ushort asked[ASKED]; /* parts of hashes: of larger ones less would stay in the cache */
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

api_cache *api_kept_answers_cache(api_kept_answers *answers) {
  return answers->cache;
}

/* What of a hash its place does not tell; not 0, which every place is at first. */
static unsigned short part_of(uint32_t hash) {
  return (unsigned short)(hash >> 16 | 1);
}

static bool was_asked(api_kept_answers *answers, uint32_t hash) {
  return atomic_load_explicit(&answers->asked[hash % ASKED], memory_order_relaxed) == part_of(hash);
}

bool api_kept_asked_again(api_kept_answers *answers, uint32_t hash) {
  unsigned short part = part_of(hash);
  return atomic_exchange_explicit(&answers->asked[hash % ASKED], part, memory_order_relaxed) == part;
}

/* Takes over the entry in any case: tag and bytes are sent from where they are kept. */
static api_outcome reply(api_call *call, api_entry *entry) {
  const kept_answer *kept = api_entry_value(entry);
  api_outcome outcome = api_validate_tag(call, kept->etag);
  if (outcome == API_FAILED)
    api_entry_release(entry);
  else if (outcome == API_DONE)
    call->answer.lender = entry; /* of the tag */
  else
    api_answer_lent(&call->answer, 200, kept->type, (api_bytes){kept->bytes, kept->size}, entry);
  return outcome == API_FAILED ? API_FAILED : API_DONE;
}

api_outcome api_kept_answer(api_call *call, api_kept_key *key) {
  api_kept_answers *answers = call->service->answers;
  call->asked = api_kept_key_asked(key);
  /* That most were not asked for before shows here, sooner than in the cache. One that was forgotten
   * meanwhile is answered from the beginning once more. */
  if (!was_asked(answers, call->asked)) return API_LATER;
  api_kept_key_whole(key);
  api_entry *entry;
  if (!api_cache_peek_all(answers->cache, &(api_cache_key){key->text, key->hash}, 1, &entry))
    return API_LATER;
  /* A model that was deleted while its answer was on the way to being kept is not here; one that is in use
   * should stay here. */
  api_entry *model = api_model_peek(call->service, call->id);
  if (!model) {
    api_entry_release(entry);
    return API_LATER;
  }
  api_entry_release(model);
  return reply(call, entry);
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
  api_kept_key key;
  const api_answer *answer = &call->answer;
  api_kept_answers *answers = call->service->answers;
  if (call->asked == 0 || answer->status != 200 || answer->bytes.size > SIZE_MOST) return;
  if (!api_kept_asked_again(answers, call->asked) || !api_kept_key_read(call, &key)) return;
  const char *etag = api_answer_find(answer, "ETag");
  if (!etag) return;
  api_kept_key_whole(&key);
  kept_answer *made = copy_answer(answer, call->offer->type, etag);
  if (!made) return;
  api_fault fault;
  api_entry_release(api_cache_take(answers->cache, key.text, build_kept, &made, &fault));
  free(made); /* when another thread kept it */
}
