/* Clips: the model's own by name, or another model's, carried over by the names of nodes. */
#include "clips.h"

#include "models.h"
#include "service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- finding ----------------------------------------------------------------------------------- */

static api_outcome fail_absent(api_call *call, const tw_model *model, const char *name) {
  char list[160] = "";
  size_t length = 0;
  for (uint32_t i = 0; i < model->clip_count; i++) {
    char buffer[24];
    int more = snprintf(list + length, sizeof list - length, "%s%s", i ? ", " : "",
                        tw_model_clip_name(model, i, buffer));
    if (more < 0 || (size_t)more >= sizeof list - length) break;
    length += (size_t)more;
  }
  list[length] = '\0';
  return api_fail_with(call, 404, "no clip is called \"%.60s\"; %s%s", name,
                       model->clip_count ? "there are: " : "the model has no clips", list);
}

/* A clip of another stored model, called "{model id}/{name}". */
static api_outcome find_borrowed(api_call *call, const char *name, api_clip_choice *out) {
  memcpy(out->lender, name, API_ID_TEXT - 1);
  name += API_ID_TEXT;
  api_entry *entry;
  api_outcome outcome = api_model_take(call, out->lender, TW_QUADS_NGON, &entry);
  if (outcome != API_DONE) return outcome;
  const tw_model *lender = api_entry_value(entry);
  out->index = tw_model_find_clip(lender, name, strlen(name));
  if (out->index == TW_NO_INDEX) outcome = fail_absent(call, lender, name);
  api_entry_release(entry);
  return outcome;
}

api_outcome api_clip_find(api_call *call, const tw_model *model, const char *name, int force,
                          api_clip_choice *out) {
  *out = (api_clip_choice){.index = TW_NO_INDEX, .force = force};
  if (!name) {
    if (model->clip_count > 0) out->index = 0;
    return API_DONE;
  }
  out->index = tw_model_find_clip(model, name, strlen(name));
  if (out->index != TW_NO_INDEX) return API_DONE;
  bool is_borrowed =
      strlen(name) > API_ID_TEXT && name[API_ID_TEXT - 1] == '/' && api_is_model_id(name, API_ID_TEXT - 1);
  return is_borrowed ? find_borrowed(call, name, out) : fail_absent(call, model, name);
}

/* ---- compiling --------------------------------------------------------------------------------- */

static void destroy_clip(void *value) {
  api_clip *clip = value;
  tw_clip_destroy(clip->compiled);
  tw_arena_destroy(clip->arena); /* holds the clip itself */
}

static api_clip *create_clip(void) {
  tw_arena *arena = tw_arena_create();
  api_clip *clip = arena ? tw_arena_alloc(arena, 1, sizeof *clip) : NULL;
  if (clip)
    clip->arena = arena;
  else
    tw_arena_destroy(arena);
  return clip;
}

/* Notes the name of a node that the model does not have, once. */
static bool note_missing(api_clip *clip, const tw_model *lender, uint32_t node, bool *noted) {
  if (noted[node]) return true;
  noted[node] = true;
  char buffer[24];
  const char *name = tw_model_node_name(lender, node, buffer);
  clip->missing[clip->missing_count] = tw_arena_text(clip->arena, name, strlen(name));
  return clip->missing[clip->missing_count++] != NULL;
}

/* The keys of a borrowed clip are copied, so that the lender may go. NULL stays NULL. */
static const void *copy_array(tw_arena *arena, const void *array, size_t count, size_t size) {
  void *copy = array ? tw_arena_alloc(arena, count, size) : NULL;
  if (copy && count) memcpy(copy, array, count * size);
  return copy;
}

static bool copy_track(api_clip *clip, const tw_track_keys *from, uint32_t node, tw_track_keys *to) {
  *to = *from;
  to->node = node;
  size_t parts = from->interpolation == TW_CUBICSPLINE ? 3 : 1;
  to->times = copy_array(clip->arena, from->times, from->key_count, sizeof *from->times);
  to->values =
      copy_array(clip->arena, from->values, from->key_count, parts * from->width * sizeof *from->values);
  to->angles = copy_array(clip->arena, from->angles, from->key_count, from->width * sizeof *from->angles);
  return (!from->times || to->times) && (!from->values || to->values) && (!from->angles || to->angles);
}

/* Carries a clip of `lender` over to `model`, node by name; tracks of nodes that are not there, and
 * weights that do not fit, are left out. */
static bool carry_over(api_clip *clip, const tw_model *model, const tw_model *lender,
                       const tw_clip_keys *source) {
  tw_clip_keys *keys = tw_arena_alloc(clip->arena, 1, sizeof *keys);
  tw_track_keys *tracks = tw_arena_alloc(clip->arena, source->track_count, sizeof *tracks);
  bool *noted = tw_arena_alloc(clip->arena, lender->node_count, sizeof *noted);
  clip->missing = tw_arena_alloc(clip->arena, lender->node_count, sizeof *clip->missing);
  if (!keys || !tracks || !noted || !clip->missing) return false;
  uint32_t count = 0;
  for (uint32_t i = 0; i < source->track_count; i++) {
    const tw_track_keys *track = &source->tracks[i];
    char buffer[24];
    const char *name = tw_model_node_name(lender, track->node, buffer);
    uint32_t node = tw_model_find_node(model, name, strlen(name));
    uint32_t mesh = node == TW_NO_INDEX ? TW_NO_INDEX : model->nodes[node].mesh;
    bool fits =
        track->path != TW_WEIGHTS || (mesh != TW_NO_INDEX && model->meshes[mesh].morph_count == track->width);
    if (node == TW_NO_INDEX && !note_missing(clip, lender, track->node, noted)) return false;
    if (node == TW_NO_INDEX || !fits) continue;
    if (!copy_track(clip, track, node, &tracks[count++])) return false;
  }
  *keys = (tw_clip_keys){.name = clip->name, .track_count = count, .tracks = tracks};
  clip->keys = keys;
  return true;
}

typedef struct clip_source {
  const tw_model *model;
  const tw_model *lender; /* the model itself when nothing is borrowed */
  const api_clip_choice *choice;
} clip_source;

void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text) {
  char buffer[24];
  tw_text_add(text, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(text);
    tw_text_string(text, tw_model_node_name(model, nodes ? nodes[i] : i, buffer));
  }
  tw_text_add(text, "]");
}

/* Most answers bear all names: they are printed once. NULL without memory. */
static const char *keep_node_names(const tw_model *model, tw_arena *arena) {
  tw_text text = {0};
  api_node_names_print(model, NULL, model->node_count, &text);
  const char *kept = text.failed ? NULL : tw_arena_text(arena, text.data, text.size);
  tw_text_deinit(&text);
  return kept;
}

/* NULL without memory. */
static const tw_trs *keep_rest(const tw_model *model, tw_arena *arena) {
  tw_trs *rest = tw_arena_alloc_raw(arena, model->node_count, sizeof *rest);
  for (uint32_t i = 0; rest && i < model->node_count; i++) rest[i] = model->nodes[i].rest;
  return rest;
}

static bool fill_clip(const clip_source *source, api_clip *clip, api_fault *fault) {
  const tw_clip_keys *keys = &source->lender->clips[source->choice->index];
  char buffer[24];
  const char *name = tw_model_clip_name(source->lender, source->choice->index, buffer);
  clip->name = tw_arena_text(clip->arena, name, strlen(name));
  clip->node_names = keep_node_names(source->model, clip->arena);
  clip->rest = keep_rest(source->model, clip->arena);
  /* A model's own keys are not kept: the cache may drop the model before the clip. */
  bool is_carried = source->lender == source->model || carry_over(clip, source->model, source->lender, keys);
  if (clip->keys) keys = clip->keys;
  if (!clip->name || !clip->node_names || !clip->rest || !is_carried) {
    api_fault_without_memory(fault);
    return false;
  }
  if (tw_clip_create(keys, source->model->node_count, source->choice->force, &clip->compiled,
                     &fault->error) == TW_OK)
    return true;
  /* The pointer is into a stored document, which is not what was sent now. */
  api_fault_complete(fault);
  return false;
}

static bool build_clip(void *context, api_built *out, api_fault *fault) {
  api_clip *clip = create_clip();
  if (!clip) {
    api_fault_without_memory(fault);
    return false;
  }
  if (!fill_clip(context, clip, fault)) {
    destroy_clip(clip);
    return false;
  }
  *out = (api_built){clip, tw_arena_size(clip->arena) + tw_clip_size(clip->compiled), destroy_clip};
  return true;
}

const tw_clip_keys *api_clip_keys(const api_clip *clip, const tw_model *model,
                                  const api_clip_choice *choice) {
  return clip->keys ? clip->keys : &model->clips[choice->index];
}

api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choice *choice, api_entry **out) {
  clip_source source = {model, model, choice};
  api_entry *lender = NULL;
  if (choice->lender[0]) {
    api_outcome outcome = api_model_take(call, choice->lender, TW_QUADS_NGON, &lender);
    if (outcome != API_DONE) return outcome;
    source.lender = api_entry_value(lender);
    /* Deleted and stored again between two looks, a model is the same bytes: the index still holds. */
  }
  char key[128];
  snprintf(key, sizeof key, "%s/clip?from=%s&index=%u&force=%d", call->id, choice->lender, choice->index,
           choice->force);
  api_outcome outcome = api_call_take(call, is_stored ? key : NULL, build_clip, &source, out);
  api_entry_release(lender);
  return outcome;
}

void api_clip_warning(api_call *call, const api_clip *clip) {
  char value[400];
  size_t length = (size_t)snprintf(value, sizeof value,
                                   "%u nodes of the clip are not in the model:", clip->missing_count);
  for (uint32_t i = 0; i < clip->missing_count && length + 16 < sizeof value; i++) {
    value[length++] = i ? ',' : ' ';
    for (const char *c = clip->missing[i]; *c && length + 8 < sizeof value; c++) {
      bool is_plain = *c > ' ' && *c < 0x7F && *c != '%' && *c != ',';
      length += (size_t)snprintf(value + length, 4, is_plain ? "%c" : "%%%02X", (unsigned char)*c);
    }
  }
  value[length] = '\0';
  api_answer_headerf(&call->answer, "X-Tweend-Warning", "%s", value);
}
