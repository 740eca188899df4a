/* Clips: the model's own, or another model's, mapped to its nodes by name or carried over to its skeleton;
 * several merged into one. */
#include "clips.h"

#include "models.h"
#include "near_names.h"
#include "service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- choosing ---------------------------------------------------------------------------------- */

enum {
  COMMAS_IN_A_NAME = 8,
  CLIPS_IN_A_LIST = 256,
  COMPARISONS_MOST = 1 << 18 /* comparisons of names in a light call */
};

static api_outcome fail_absent(api_call *call, const tw_model *model, const char *name, size_t length) {
  char buffer[24];
  api_near near = {.name = name, .length = length};
  for (uint32_t i = 0; i < model->clip_count; i++)
    api_near_consider(&near, tw_model_clip_name(model, i, buffer));
  char list[160] = "";
  size_t used = 0;
  for (uint32_t i = 0; i < model->clip_count; i++) {
    int more = snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "",
                        tw_model_clip_name(model, i, buffer));
    if (more < 0 || (size_t)more >= sizeof list - used) break;
    used += (size_t)more;
  }
  list[used] = '\0';
  return api_fail_with(call, 404, "no clip is called \"%.*s\";%s %s%s", length < 60 ? (int)length : 60, name,
                       api_near_print(&near, " ").text,
                       model->clip_count ? "there are: " : "the model has no clips", list);
}

static bool is_borrowed(const char *name, size_t length) {
  return length > API_ID_TEXT && name[API_ID_TEXT - 1] == '/' && api_is_model_id(name, API_ID_TEXT - 1);
}

/* Finds a clip of another stored model, "{model id}/{name}". API_CONTINUE: the lender has no such clip, as
 * the fault says. */
static api_outcome find_borrowed(api_call *call, const char *name, size_t length, api_clip_choice *out) {
  memcpy(out->lender, name, API_ID_TEXT - 1);
  name += API_ID_TEXT;
  length -= API_ID_TEXT;
  api_entry *entry;
  api_outcome outcome = api_model_look(call, out->lender);
  if (outcome == API_CONTINUE) outcome = api_model_take(call, out->lender, NULL, &entry);
  if (outcome != API_DONE) return outcome;
  const tw_model *lender = api_entry_value(entry);
  out->index = tw_model_find_clip(lender, name, length);
  if (out->index == TW_NO_INDEX) {
    fail_absent(call, lender, name, length);
    outcome = API_CONTINUE;
  }
  api_entry_release(entry);
  return outcome;
}

/* Finds the clip of a name, own or borrowed. API_CONTINUE: there is none, as the fault says. */
static api_outcome find_named(api_call *call, const tw_model *model, const char *name, size_t length,
                              api_clip_choice *out) {
  *out = (api_clip_choice){.index = tw_model_find_clip(model, name, length)};
  if (out->index != TW_NO_INDEX) return API_DONE;
  if (is_borrowed(name, length)) return find_borrowed(call, name, length, out);
  fail_absent(call, model, name, length);
  return API_CONTINUE;
}

/* Finds the clip that the list begins with, and the length of its name. A name may itself contain commas: the
 * shortest name that exists counts. */
static api_outcome find_first(api_call *call, const tw_model *model, const char *list, size_t *length,
                              api_clip_choice *out) {
  api_fault first; /* about the name up to the first comma */
  size_t end = strcspn(list, ",");
  for (int commas = 0;; commas++) {
    *length = end;
    api_outcome outcome = find_named(call, model, list, end, out);
    if (outcome != API_CONTINUE) return outcome;
    if (commas == 0) first = call->fault;
    if (list[end] == '\0' || commas == COMMAS_IN_A_NAME) break;
    end += 1 + strcspn(list + end + 1, ",");
  }
  call->fault = first;
  return API_FAILED;
}

static bool is_among(const api_clip_choice *choice, const api_clip_choice *list, uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    if (list[i].index == choice->index && strcmp(list[i].lender, choice->lender) == 0) return true;
  return false;
}

static api_outcome find_listed(api_call *call, const tw_model *model, const char *text,
                               api_clip_choices *out) {
  uint64_t names = 1;
  for (const char *c = text; *c; c++) names += *c == ',';
  if (call->effort != API_HEAVY && names * model->clip_count > COMPARISONS_MOST) return API_NEEDS_THREAD;
  if (names > CLIPS_IN_A_LIST)
    return api_fail_with(call, 400, "clip: more than %d names are in the list", CLIPS_IN_A_LIST);
  api_clip_choice *list = tw_arena_alloc(call->arena, (size_t)names, sizeof *list);
  if (!list) return api_fail_without_memory(call);
  *out = (api_clip_choices){.list = list};
  for (;;) {
    size_t length;
    api_outcome outcome = find_first(call, model, text, &length, &list[out->count]);
    if (outcome != API_DONE) return outcome;
    if (is_among(&list[out->count], list, out->count))
      return api_fail_with(call, 400, "clip: \"%.*s\" is in the list twice", length < 60 ? (int)length : 60,
                           text);
    out->count++;
    if (text[length] == '\0') return API_DONE;
    text += length + 1;
  }
}

/* Finds the one clip that the whole text names, or none, or several. */
static api_outcome find_chosen(api_call *call, const tw_model *model, const char *text,
                               api_clip_choices *out) {
  api_clip_choice *whole = tw_arena_alloc(call->arena, 1, sizeof *whole);
  if (!whole) return api_fail_without_memory(call);
  api_outcome outcome = find_named(call, model, text, strlen(text), whole);
  *out = (api_clip_choices){.count = 1, .list = whole};
  if (outcome != API_CONTINUE) return outcome;
  if (strcmp(text, "none") != 0) return find_listed(call, model, text, out);
  *out = (api_clip_choices){0};
  return API_DONE;
}

/* Turns a list of the model's own first clips, in order, into the form without a list, so that equal choices
 * print equally. */
static void normalise_choices(api_clip_choices *choices) {
  uint32_t i = 0;
  while (i < choices->count && choices->list[i].index == i && !choices->list[i].lender[0]) i++;
  if (i == choices->count) choices->list = NULL;
}

static bool has_borrowed(const api_clip_choices *choices) {
  for (uint32_t i = 0; choices->list && i < choices->count; i++)
    if (choices->list[i].lender[0]) return true;
  return false;
}

api_outcome api_clips_choose(api_call *call, const tw_model *model, const char *text, uint32_t otherwise,
                             const api_retarget *retarget, api_clip_choices *out) {
  if (!text) {
    *out = (api_clip_choices){.count = otherwise < model->clip_count ? otherwise : model->clip_count};
    return API_DONE;
  }
  api_outcome outcome = find_chosen(call, model, text, out);
  if (outcome != API_DONE) return outcome;
  call->fault = (api_fault){0}; /* drops the faults of names that were only tried */
  if (out->list) normalise_choices(out);
  if (has_borrowed(out)) out->retarget = *retarget;
  return API_DONE;
}

api_clip_choice api_clips_get(const api_clip_choices *choices, uint32_t i) {
  return choices->list ? choices->list[i] : (api_clip_choice){.index = i};
}

void api_clips_print(const api_clip_choices *choices, tw_text *text) {
  if (!choices->list) {
    tw_text_count(text, choices->count);
    return;
  }
  for (uint32_t i = 0; i < choices->count; i++) {
    tw_text_add(text, choices->list[i].lender);
    tw_text_add(text, "/");
    tw_text_count(text, choices->list[i].index);
    tw_text_add(text, ",");
  }
  api_retarget_print(&choices->retarget, text);
}

/* ---- compiling --------------------------------------------------------------------------------- */

static void destroy_clip(void *value) {
  api_clip *clip = value;
  tw_clip_destroy(clip->compiled);
  tw_arena_destroy(clip->arena); /* which holds the clip itself */
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

/* Warns once of a node that the model lacks. False without memory. */
static bool note_missing(api_clip *clip, const tw_model *lender, uint32_t node, bool *noted) {
  if (noted[node]) return true;
  noted[node] = true;
  char buffer[24];
  tw_text text = {0};
  tw_text_add(&text, "the clip moves a node that the model does not have: ");
  tw_text_add(&text, tw_model_node_name(lender, node, buffer));
  const char *kept = api_text_keep(&text, clip->arena);
  clip->warnings[clip->warning_count] = kept;
  return clip->warnings[clip->warning_count++] != NULL;
}

/* Makes room for more warnings. */
static bool grow_warnings(api_clip *clip, size_t more) {
  const char **grown = tw_arena_alloc(clip->arena, clip->warning_count + more, sizeof *grown);
  if (grown && clip->warning_count) memcpy(grown, clip->warnings, clip->warning_count * sizeof *grown);
  clip->warnings = grown;
  return grown != NULL;
}

/* Copies an array of a borrowed clip, so that the lender may be released. NULL stays NULL. */
static const void *copy_array(tw_arena *arena, const void *array, size_t count, size_t size) {
  void *copy = array ? tw_arena_alloc(arena, count, size) : NULL;
  if (copy && count) memcpy(copy, array, count * size);
  return copy;
}

static bool copy_track(tw_arena *arena, const tw_track_keys *from, uint32_t node, tw_track_keys *to) {
  *to = *from;
  to->node = node;
  to->kept = NULL; /* it may refer to other parts of the lender's file */
  size_t parts = from->interpolation == TW_CUBICSPLINE ? 3 : 1;
  to->times = copy_array(arena, from->times, from->key_count, sizeof *from->times);
  to->values = copy_array(arena, from->values, from->key_count, parts * from->width * sizeof *from->values);
  to->angles = copy_array(arena, from->angles, from->key_count, from->width * sizeof *from->angles);
  return (!from->times || to->times) && (!from->values || to->values) && (!from->angles || to->angles);
}

/* Maps a clip of `lender` to the nodes of `model` by name. Leaves out tracks of nodes that the model lacks,
 * and morph weights whose number differs. */
static bool carry_over(api_clip *clip, const tw_model *model, const tw_model *lender, uint32_t index,
                       tw_clip_keys *out) {
  const tw_clip_keys *source = &lender->clips[index];
  tw_track_keys *tracks = tw_arena_alloc(clip->arena, source->track_count, sizeof *tracks);
  bool *noted = tw_arena_alloc(clip->arena, lender->node_count, sizeof *noted);
  if (!tracks || !noted || !grow_warnings(clip, lender->node_count)) return false;
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
    if (!copy_track(clip->arena, track, node, &tracks[count++])) return false;
  }
  const char *name = source->name ? tw_arena_text(clip->arena, source->name, strlen(source->name)) : NULL;
  *out = (tw_clip_keys){.name = name, .track_count = count, .tracks = tracks};
  return name || !source->name;
}

typedef struct clip_source {
  uint64_t max_keys; /* of a track that is carried over */
  const tw_model *model;
  const api_clip_choices *choices;
  api_entry *const *lenders; /* [choices->count] models; NULL for the model's own clip */
  int force;
} clip_source;

static const tw_model *lender_of(const clip_source *source, uint32_t i) {
  return source->lenders[i] ? api_entry_value(source->lenders[i]) : source->model;
}

void api_node_names_print(const tw_model *model, const uint32_t *nodes, uint32_t count, tw_text *text) {
  char buffer[24];
  tw_text_add(text, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(text);
    tw_text_string(text, tw_model_node_name(model, nodes ? nodes[i] : i, buffer));
  }
  tw_text_add(text, "]");
}

/* Prints the names of all nodes once, as most answers have them. NULL without memory. */
static const char *keep_node_names(const tw_model *model, tw_arena *arena) {
  tw_text text = {0};
  api_node_names_print(model, NULL, model->node_count, &text);
  return api_text_keep(&text, arena);
}

/* Joins the names of all clips by commas. NULL without memory. */
static const char *join_names(const clip_source *source, tw_arena *arena) {
  tw_text text = {0};
  for (uint32_t i = 0; i < source->choices->count; i++) {
    char buffer[24];
    if (i > 0) tw_text_add(&text, ",");
    tw_text_add(&text,
                tw_model_clip_name(lender_of(source, i), api_clips_get(source->choices, i).index, buffer));
  }
  return api_text_keep(&text, arena);
}

/* Warns of what a clip animates besides nodes. False without memory. */
static bool note_loose(api_clip *clip, const tw_clip_keys *keys) {
  if (!keys->loose) return true;
  if (!grow_warnings(clip, 1)) return false;
  clip->warnings[clip->warning_count++] =
      "the clip also moves what is no transform and no weights of a node: a pose does not show it";
  return true;
}

/* Adds the morph weights, which go by the names of nodes, to the tracks of a clip that is carried over. */
static bool add_weights(api_clip *clip, const tw_model *model, const tw_model *lender, uint32_t index,
                        tw_clip_keys *keys) {
  const tw_clip_keys *source = &lender->clips[index];
  size_t count = (size_t)keys->track_count + source->track_count;
  tw_track_keys *tracks = tw_arena_alloc(clip->arena, count, sizeof *tracks);
  if (!tracks) return false;
  if (keys->track_count) memcpy(tracks, keys->tracks, keys->track_count * sizeof *tracks);
  keys->tracks = tracks;
  for (uint32_t i = 0; i < source->track_count; i++) {
    const tw_track_keys *track = &source->tracks[i];
    char buffer[24];
    if (track->path != TW_WEIGHTS) continue;
    const char *name = tw_model_node_name(lender, track->node, buffer);
    uint32_t node = tw_model_find_node(model, name, strlen(name));
    uint32_t mesh = node == TW_NO_INDEX ? TW_NO_INDEX : model->nodes[node].mesh;
    if (mesh == TW_NO_INDEX || model->meshes[mesh].morph_count != track->width) continue;
    if (!copy_track(clip->arena, track, node, &tracks[keys->track_count++])) return false;
  }
  return true;
}

/* Carries a clip of the lender over to the model's skeleton. */
static bool retarget(const clip_source *source, const tw_model *lender, uint32_t index, api_clip *clip,
                     tw_clip_keys *out, api_fault *fault) {
  api_carried carried;
  if (!api_clip_retarget(lender, index, source->model, &source->choices->retarget, source->max_keys,
                         clip->arena, &carried, fault))
    return false;
  const char *name = lender->clips[index].name;
  *out = carried.keys;
  out->name = name ? tw_arena_text(clip->arena, name, strlen(name)) : NULL;
  bool is_whole = (out->name || !name) && add_weights(clip, source->model, lender, index, out) &&
                  grow_warnings(clip, carried.warning_count);
  for (uint32_t i = 0; is_whole && i < carried.warning_count; i++)
    clip->warnings[clip->warning_count++] = carried.warnings[i];
  clip->retarget = carried.report;
  return is_whole || api_fault_without_memory(fault);
}

/* The keys of each chosen clip, mapped to the model. NULL: the fault says why, or memory is missing. */
static tw_clip_keys *gather_keys(const clip_source *source, api_clip *clip, api_fault *fault) {
  tw_clip_keys *keys = tw_arena_alloc(clip->arena, source->choices->count, sizeof *keys);
  for (uint32_t i = 0; keys && i < source->choices->count; i++) {
    uint32_t index = api_clips_get(source->choices, i).index;
    if (!note_loose(clip, &lender_of(source, i)->clips[index])) return NULL;
    if (!source->lenders[i]) {
      keys[i] = source->model->clips[index];
      continue;
    }
    if (source->choices->retarget.is_auto) {
      if (!retarget(source, lender_of(source, i), index, clip, &keys[i], fault)) return NULL;
    } else if (!carry_over(clip, source->model, lender_of(source, i), index, &keys[i])) {
      return NULL;
    }
  }
  return keys;
}

static tw_status compile(const clip_source *source, const tw_clip_keys *keys, tw_clip **out,
                         tw_error *error) {
  uint32_t node_count = source->model->node_count;
  if (source->choices->count == 1) return tw_clip_create(keys, node_count, source->force, out, error);
  tw_arena *arena = tw_arena_create();
  tw_clip_keys merged;
  tw_status status = arena ? tw_clip_merge(keys, source->choices->count, node_count, arena, &merged, error)
                           : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) status = tw_clip_create(&merged, node_count, source->force, out, error);
  tw_arena_destroy(arena);
  return status;
}

/* The longest of the compiled clip and of the borrowed ones, which are as long as in their models; as the
 * decimal number that answers print. */
static double find_duration(const clip_source *source, const tw_clip *compiled) {
  float longest = tw_clip_duration(compiled);
  for (uint32_t i = 0; i < source->choices->count; i++) {
    if (!source->lenders[i]) continue;
    uint32_t index = api_clips_get(source->choices, i).index;
    float own = tw_keys_duration(&lender_of(source, i)->clips[index]);
    if (own > longest) longest = own;
  }
  char text[TW_NUMBER_TEXT];
  double duration = 0;
  tw_read_double(text, tw_print_float(text, longest), &duration);
  return duration;
}

static bool fill_clip(const clip_source *source, api_clip *clip, api_fault *fault) {
  clip->name = join_names(source, clip->arena);
  clip->node_names = keep_node_names(source->model, clip->arena);
  const tw_clip_keys *keys = gather_keys(source, clip, fault);
  if (!keys && fault->status != 0) return false;
  if (!clip->name || !clip->node_names || !keys) return api_fault_without_memory(fault);
  /* The model's own keys are not referred to: the cache may drop the model before the clip. */
  if (source->choices->count == 1 && source->lenders[0]) clip->carried = keys;
  /* No pointer into a document: the stored document is not the one just sent. */
  if (compile(source, keys, &clip->compiled, &fault->error) != TW_OK) return api_fault_complete(fault);
  clip->duration = find_duration(source, clip->compiled);
  return true;
}

static bool build_clip(void *context, api_built *out, api_fault *fault) {
  api_clip *clip = create_clip();
  if (!clip) return api_fault_without_memory(fault);
  if (!fill_clip(context, clip, fault)) {
    destroy_clip(clip);
    return false;
  }
  *out = (api_built){clip, tw_arena_size(clip->arena) + tw_clip_size(clip->compiled), destroy_clip,
                     API_CACHED_CLIP};
  return true;
}

/* The clip's cache key; NULL without memory. */
static const char *make_key(api_call *call, const api_clip_choices *choices, int force) {
  tw_text text = {0};
  tw_text_add(&text, call->id);
  tw_text_add(&text, "/clip?force=");
  tw_text_count(&text, (uint64_t)force + 1);
  tw_text_add(&text, "&clips=");
  api_clips_print(choices, &text);
  return api_text_keep(&text, call->arena);
}

/* Takes the models of borrowed clips again by id. The indices found before still hold, as an id means the
 * same bytes. */
static api_outcome take_lenders(api_call *call, const api_clip_choices *choices, api_entry **lenders) {
  api_outcome outcome = API_DONE;
  for (uint32_t i = 0; outcome == API_DONE && choices->list && i < choices->count; i++)
    if (choices->list[i].lender[0])
      outcome = api_model_take(call, choices->list[i].lender, NULL, &lenders[i]);
  return outcome;
}

api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choices *choices, int force, api_entry **out) {
  const char *key = make_key(call, choices, force);
  api_entry **lenders = tw_arena_alloc(call->arena, choices->count, sizeof *lenders);
  if (!key || !lenders) return api_fail_without_memory(call);
  clip_source source = {.model = model,
                        .choices = choices,
                        .lenders = lenders,
                        .force = force,
                        .max_keys = call->service->limits.max_times};
  api_outcome outcome = take_lenders(call, choices, lenders);
  if (outcome == API_DONE) outcome = api_call_take(call, is_stored ? key : NULL, build_clip, &source, out);
  for (uint32_t i = 0; i < choices->count; i++) api_entry_release(lenders[i]);
  return outcome;
}
