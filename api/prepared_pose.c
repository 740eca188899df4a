/* Prepared poses stand beside the kept answers, under the same budget. The key is path and query without the
 * time's value: a request that was answered once fails at another time for that time alone. Model and clip
 * are looked up anew for each answer: kept from here, they would outlive their place in the cache's budget.
 */
#include "prepared_pose.h"

#include "handlers.h"
#include "kept_answer.h"
#include "models.h"
#include "pose_print.h"
#include "routes.h"
#include "service.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS_MOST = 4096, SIZE_MOST = 128 << 10 };

typedef struct prepared_pose {
  tw_arena *arena;         /* of what follows, and of this */
  api_pose_query query;    /* without model, clip and times */
  char clip[API_CLIP_KEY]; /* its key in the cache; "" for the rest pose */
  const char *canonical;   /* all parameters but the times */
  size_t canonical_size;
  char representation[16];
  api_pose_template template;
} prepared_pose;

/* ---- keys ---------------------------------------------------------------------------------------- */

static bool is_number_char(char c) {
  return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == 'e';
}

/* The value of the one parameter "at" of a key; NULL when there is none, or two, or it holds more than a
 * plain number does. */
static char *find_time(char *key, size_t *length) {
  char *found = NULL;
  for (char *place = strchr(key, '?'); place; place = strchr(place + 1, '&')) {
    if (strncmp(place + 1, "at=", 3) != 0) continue;
    if (found) return NULL;
    found = place + 4;
  }
  *length = 0;
  while (found && is_number_char(found[*length])) ++*length;
  bool is_whole = found && *length > 0 && (found[*length] == '&' || found[*length] == '\0');
  return is_whole ? found : NULL;
}

/* Writes the key that a call and all like it at other times have, and reads this one's time. */
static bool write_key(const api_call *call, char out[API_KEPT_KEY], float *at) {
  double value;
  size_t length;
  if (call->route->handle != api_get_pose || !api_kept_key(call, out)) return false;
  char *time = find_time(out, &length);
  if (!time || !api_number_read(time, length, &value) || !isfinite((float)value)) return false;
  *at = (float)value;
  *time = '\n'; /* which no query has */
  memmove(time + 1, time + length, strlen(time + length) + 1);
  return true;
}

/* ---- answering ----------------------------------------------------------------------------------- */

static api_outcome validate(api_call *call, const prepared_pose *prepared, const api_times *times) {
  size_t size = prepared->canonical_size;
  char *canonical = tw_arena_alloc(call->arena, size + TW_NUMBER_TEXT + 2, 1), *end = canonical + size;
  if (!canonical) return api_fail_without_memory(call);
  memcpy(canonical, prepared->canonical, size);
  end += tw_print_float(end, times->list[0]);
  memcpy(end, ",", sizeof ","); /* printing leaves anything behind its end */
  return api_validate(call, prepared->representation, canonical);
}

/* With model and clip of the query, which are held. */
static api_outcome answer(api_call *call, const prepared_pose *prepared, const api_pose_query *query) {
  api_outcome outcome = validate(call, prepared, &query->times);
  if (outcome != API_LATER) return outcome;
  api_pose_body *body = api_pose_body_create(query, &prepared->template, call->arena);
  if (!body) return api_fail_without_memory(call);
  api_text text;
  api_pose_body_print_whole(body, &text);
  api_pose_body_deinit(body);
  outcome = api_reply(call, &text);
  api_keep_answer(call);
  return outcome;
}

api_outcome api_prepared_pose(api_call *call) {
  char key[API_KEPT_KEY];
  float at;
  api_service *service = call->service;
  if (!write_key(call, key, &at)) return API_LATER;
  api_entry *entry = api_cache_peek(api_kept_answers_cache(service->answers), key);
  if (!entry) return API_LATER;
  const prepared_pose *prepared = api_entry_value(entry);
  api_pose_query query = prepared->query;
  query.times = (api_times){.is_given = true, .count = 1, .list = &at};
  bool has_clip = prepared->clip[0] != '\0';
  api_entry *model = api_model_peek(service, call->id);
  api_entry *clip = has_clip ? api_cache_peek(service->cache, prepared->clip) : NULL;
  query.model = model ? api_entry_value(model) : NULL;
  query.clip = clip ? api_entry_value(clip) : NULL;
  bool is_at_hand = model && (clip || !has_clip);
  api_outcome outcome = is_at_hand ? answer(call, prepared, &query) : API_LATER;
  api_entry_release(clip);
  api_entry_release(model);
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
  if (query->clip) api_clip_key(from->call->id, from->choice, out->clip);
  snprintf(out->representation, sizeof out->representation, "pose.%s", from->call->offer->extension);
  api_text text = {0};
  api_pose_request_print(from->request, from->choice, &text);
  api_text_add(&text, "&times=");
  out->canonical = text.failed ? NULL : tw_arena_text(out->arena, text.data, text.size);
  out->canonical_size = text.size;
  api_text_deinit(&text);
  return out->canonical && api_pose_template_take(from->body, from->size, out->arena, &out->template);
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
  char key[API_KEPT_KEY];
  float at;
  api_fault fault;
  api_kept_answers *answers = call->service->answers;
  uint64_t numbers = (uint64_t)request->query.node_count * api_pose_width(request->query.as);
  if (numbers > NUMBERS_MOST || choice->lender[0] || !write_key(call, key, &at)) return;
  if (!api_kept_asked_again(answers, key) || call->effort == API_HEAVY) return;
  prepared_from from = {call, request, choice, body, size};
  api_entry_release(api_cache_take(api_kept_answers_cache(answers), key, build, &from, &fault));
}
