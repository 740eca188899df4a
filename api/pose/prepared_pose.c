/* Prepared poses stand beside the kept answers, under the same budget. The key is that of an answer without
 * its time: a request that was answered once fails at another time for that time alone. Model and clip are
 * looked up anew for each answer: kept from here, they would outlive their place in the cache's budget. */
#include "prepared_pose.h"

#include "kept_answer.h"
#include "models.h"
#include "pose_print.h"
#include "service.h"

#include <string.h>

enum { NUMBERS_MOST = 4096, SIZE_MOST = 128 << 10 };

/* On the stack: what some two hundred nodes are evaluated in. */
enum { SCRATCH = 16 << 10 };

typedef struct prepared_pose {
  tw_arena *arena;       /* of what follows, and of this */
  api_pose_query query;  /* without model, clip and times */
  api_cache_key held[2]; /* model and clip in the cache */
  size_t held_count;     /* 1 for the rest pose */
  api_stamp stamp;
  api_pose_template template;
} prepared_pose;

/* ---- answering ----------------------------------------------------------------------------------- */

static api_outcome print(api_call *call, const prepared_pose *prepared, const api_pose_query *query) {
  _Alignas(max_align_t) unsigned char memory[SCRATCH];
  tw_arena *scratch = tw_arena_create_in(memory, sizeof memory);
  api_pose_body *body = api_pose_body_create(query, &prepared->template, scratch, call->request->room);
  api_text text = {.failed = true};
  if (body) {
    api_pose_body_print_whole(body, &text);
    api_pose_body_deinit(body);
  }
  tw_arena_destroy(scratch);
  api_outcome outcome = api_reply(call, &text);
  api_keep_answer(call);
  return outcome;
}

/* With model and clip of the query, which are held. */
static api_outcome answer(api_call *call, const prepared_pose *prepared, api_pose_query *query, float at) {
  char time[TW_NUMBER_TEXT], mark[API_TIMES_MARK];
  size_t size = tw_print_float(time, at);
  query->times =
      (api_times){.is_given = true, .count = 1, .list = &at, .printed = time, .printed_size = size};
  api_time_mark(at, mark);
  api_outcome outcome = api_validate_stamp(call, &prepared->stamp, mark);
  return outcome == API_LATER ? print(call, prepared, query) : outcome;
}

api_outcome api_prepared_pose(api_call *call, const api_kept_key *key) {
  api_entry *entry, *held[2];
  api_cache *cache = call->service->cache, *answers = api_kept_answers_cache(call->service->answers);
  if (!key->has_time) return API_LATER;
  if (!api_cache_peek_all(answers, &(api_cache_key){key->text, key->hash}, 1, &entry)) return API_LATER;
  const prepared_pose *prepared = api_entry_value(entry);
  api_outcome outcome = API_LATER;
  if (api_cache_peek_all(cache, prepared->held, prepared->held_count, held)) {
    api_pose_query query = prepared->query;
    query.model = api_entry_value(held[0]);
    query.clip = prepared->held_count > 1 ? api_entry_value(held[1]) : NULL;
    outcome = answer(call, prepared, &query, key->time);
    for (size_t i = 0; i < prepared->held_count; i++) api_entry_release(held[i]);
  }
  api_entry_release(entry);
  return outcome;
}

/* ---- preparing ----------------------------------------------------------------------------------- */

static void destroy(void *value) {
  tw_arena_destroy(((prepared_pose *)value)->arena); /* holds the value itself */
}

typedef struct prepared_from {
  const api_call *call;
  const api_pose_request *request;
  const api_clip_choice *choice;
  const api_pose_body *body;
  size_t size;
} prepared_from;

static bool hold(prepared_pose *prepared, const char *key) {
  size_t length = strlen(key);
  const char *copy = tw_arena_text(prepared->arena, key, length);
  if (!copy) return false;
  prepared->held[prepared->held_count++] = (api_cache_key){copy, api_cache_hash(copy, length)};
  return true;
}

static bool hold_both(const prepared_from *from, prepared_pose *out) {
  char model[API_MODEL_KEY], clip[API_CLIP_KEY];
  api_model_key(from->call->id, TW_QUADS_NGON, model);
  api_clip_key(from->call->id, from->choice, clip);
  return hold(out, model) && (!from->request->query.clip || hold(out, clip));
}

static bool fill(const prepared_from *from, prepared_pose *out) {
  const api_pose_query *query = &from->request->query;
  uint32_t *nodes = tw_arena_alloc(out->arena, query->node_count, sizeof *nodes);
  if (!nodes) return false;
  if (query->node_count > 0) memcpy(nodes, query->nodes, query->node_count * sizeof *nodes);
  out->query = *query;
  out->query.model = NULL;
  out->query.clip = NULL;
  out->query.times = (api_times){0};
  out->query.nodes = nodes;
  return hold_both(from, out) &&
         api_pose_request_stamp(from->call, from->request, from->choice, &out->stamp) &&
         api_pose_template_take(from->body, from->size, out->arena, &out->template);
}

static bool build(void *context, api_built *out, api_fault *fault) {
  (void)fault; /* nobody is told */
  tw_arena *arena = tw_arena_create();
  prepared_pose *prepared = arena ? tw_arena_alloc(arena, 1, sizeof *prepared) : NULL;
  if (prepared) prepared->arena = arena;
  if (!prepared || !fill(context, prepared) || tw_arena_size(arena) > SIZE_MOST) {
    tw_arena_destroy(arena);
    return false;
  }
  *out = (api_built){prepared, tw_arena_size(arena), destroy};
  return true;
}

void api_prepare_pose(const api_call *call, const api_pose_request *request, const api_clip_choice *choice,
                      const api_pose_body *body, size_t size) {
  api_kept_key key;
  api_fault fault;
  api_kept_answers *answers = call->service->answers;
  uint64_t numbers = (uint64_t)request->query.node_count * api_pose_width(request->query.as);
  if (numbers > NUMBERS_MOST || choice->lender[0]) return;
  if (call->asked == 0 || !api_kept_key_read(call, &key) || !key.has_time) return;
  if (!api_kept_asked_again(answers, key.hash) || call->effort == API_HEAVY) return;
  prepared_from from = {call, request, choice, body, size};
  api_entry_release(api_cache_take(api_kept_answers_cache(answers), key.text, build, &from, &fault));
}
