/* The chosen clips of a request, compiled for one model: its own, or other models', mapped to its nodes by
 * name or carried over to its skeleton; several merged into one; mixed ones. */
#include "clips.h"

#include "mixed_clips.h"
#include "models.h"
#include "node_names.h"
#include "service.h"

#include <string.h>

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

typedef struct clip_source {
  uint32_t max_keys; /* of a track that is carried over */
  const tw_model *model;
  const api_clip_choices *choices;
  api_entry *const *lenders;   /* [choices->count] models; NULL for the model's own clip */
  const api_bound_clip *bound; /* [choices->count] where one of them is mixed, else NULL */
  int force;
} clip_source;

static const tw_model *lender_of(const clip_source *source, uint32_t i) {
  return source->lenders[i] ? api_entry_value(source->lenders[i]) : source->model;
}

/* Prints the names of all nodes once, as most answers have them. NULL without memory. */
static const char *keep_node_names(const tw_model *model, tw_arena *arena) {
  tw_text text = {0};
  api_node_names_print(model, NULL, model->node_count, &text);
  return api_text_move(&text, arena);
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
  return api_text_move(&text, arena);
}

/* Warns of what a clip animates besides nodes. False without memory. */
static bool note_loose(api_notes *notes, const tw_clip_keys *keys) {
  return !keys->loose || api_note(notes, "the clip also moves what a pose does not show: other than a node's "
                                         "translation, rotation, scale, or all its weights together");
}

/* The keys of each chosen clip, on the model's nodes. NULL: the fault says why. */
static tw_clip_keys *gather_keys(const clip_source *source, api_clip *clip, api_notes *notes,
                                 api_fault *fault) {
  tw_clip_keys *keys = tw_arena_alloc(clip->arena, source->choices->count, sizeof *keys);
  bool is_done = keys || api_fault_without_memory(fault);
  for (uint32_t i = 0; is_done && i < source->choices->count; i++) {
    const tw_model *lender = lender_of(source, i);
    const tw_clip_keys *own = &lender->clips[api_clips_get(source->choices, i).index];
    keys[i] = *own;
    is_done = note_loose(notes, own) || api_fault_without_memory(fault);
    if (is_done && source->lenders[i])
      is_done = api_clip_bring(lender, own, source->model, &source->choices->terms.retarget, source->max_keys,
                               notes, &clip->retarget, &keys[i], fault);
  }
  return is_done ? keys : NULL;
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

/* Compiles clips of which one is mixed. */
static bool fill_mixed(const clip_source *source, api_clip *clip, api_notes *notes, api_fault *fault) {
  api_mixing mixing = {.model = source->model,
                       .force = source->force,
                       .max_keys = source->max_keys,
                       .retarget = &source->choices->terms.retarget,
                       .notes = notes};
  if (!api_mixed_compile(&mixing, source->bound, source->choices->count, &clip->compiled, fault))
    return false;
  clip->is_made = true;
  clip->retarget = mixing.report;
  clip->layers = mixing.layers;
  return true;
}

static bool fill_plain(const clip_source *source, api_clip *clip, api_notes *notes, api_fault *fault) {
  const tw_clip_keys *keys = gather_keys(source, clip, notes, fault);
  if (!keys) return false;
  /* The model's own keys are not referred to: the cache may drop the model before the clip. */
  if (source->choices->count == 1 && source->lenders[0]) clip->carried = keys;
  /* No pointer into a document: the stored document is not the one just sent. */
  return compile(source, keys, &clip->compiled, &fault->error) == TW_OK || api_fault_complete(fault);
}

/* The topmost node above a node, or itself. */
static uint32_t topmost(const tw_model *model, uint32_t node) {
  while (model->nodes[node].parent != TW_NO_INDEX) node = model->nodes[node].parent;
  return node;
}

/* Takes the root motion out of the compiled clip. */
static bool take_root(const clip_source *source, api_clip *clip, api_notes *notes, api_fault *fault) {
  const tw_model *model = source->model;
  const api_root *root = &source->choices->terms.root;
  clip->root_node = root->node;
  if (root->node == TW_NO_INDEX)
    clip->root_node = tw_clip_find_root(clip->compiled, model->nodes, model->node_order, model->node_count);
  if (clip->root_node == TW_NO_INDEX)
    return api_note(notes, "the clip moves no node: there is no root motion") ||
           api_fault_without_memory(fault);
  tw_root_job job = {model->nodes, model->node_count, clip->root_node, root->axes, TW_NO_INDEX};
  if (root->is_carried) {
    uint32_t top = topmost(model, job.node);
    clip->root_is_above = top == job.node;
    job.carrier = clip->root_is_above ? model->node_count : top;
  }
  if (tw_clip_take_root(clip->compiled, &job, &clip->compiled, &fault->error) != TW_OK)
    return api_fault_complete(fault);
  clip->is_made = clip->has_root = true;
  clip->carried = NULL;
  return true;
}

static bool fill_clip(const clip_source *source, api_clip *clip, api_fault *fault) {
  api_notes notes = {.arena = clip->arena};
  clip->name = join_names(source, clip->arena);
  clip->node_names = keep_node_names(source->model, clip->arena);
  if (!clip->name || !clip->node_names) return api_fault_without_memory(fault);
  if (!(source->bound ? fill_mixed : fill_plain)(source, clip, &notes, fault)) return false;
  clip->duration = find_duration(source, clip->compiled);
  if (source->choices->terms.root.is_on && !take_root(source, clip, &notes, fault)) return false;
  clip->warnings = notes.list;
  clip->warning_count = notes.count;
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
  return api_text_move(&text, call->arena);
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

const tw_clip_keys *api_clip_keys(const api_clip *clip, const tw_model *model, uint32_t index) {
  if (clip && clip->is_made) return NULL;
  return clip && clip->carried ? clip->carried : &model->clips[index];
}

uint32_t api_clip_keys_max(const api_call *call) {
  uint64_t most = call->service->limits.max_times;
  return most < UINT32_MAX ? (uint32_t)most : UINT32_MAX;
}

tw_status api_clip_find_keys(const tw_clip *made, uint32_t max_keys, tw_arena *arena, tw_clip_keys *out,
                             tw_tolerance *reached, tw_error *error) {
  static const tw_tolerance tolerance = {0.05 / TW_DEGREES, 1e-4};
  uint64_t steps = TW_REDUCTION_STEPS;
  return tw_clip_reduce(made, NULL, tolerance, max_keys, &steps, arena, out, reached, error);
}

bool api_clip_is_mixed(const tw_model *model, uint32_t index) {
  return model->clips[index].layer_count > 0;
}

/* Binds all clips where one of them is mixed. *out: NULL where none is. */
static api_outcome bind_mixed(api_call *call, const tw_model *model, const api_clip_choices *choices,
                              api_entry *const *lenders, api_bound_clip **out) {
  bool is_any = false;
  *out = NULL;
  for (uint32_t i = 0; i < choices->count; i++)
    is_any |=
        api_clip_is_mixed(lenders[i] ? api_entry_value(lenders[i]) : model, api_clips_get(choices, i).index);
  if (!is_any) return API_DONE;
  if (choices->count > TW_LAYERS_MAX)
    return api_fail_with(call, 400, "clip: more than %d clips, of which one is mixed", TW_LAYERS_MAX);
  *out = tw_arena_alloc(call->arena, choices->count, sizeof **out);
  if (!*out) return api_fail_without_memory(call);
  api_outcome outcome = API_DONE;
  for (uint32_t i = 0; i < choices->count && outcome == API_DONE; i++) {
    api_clip_choice choice = api_clips_get(choices, i);
    const tw_model *holder = lenders[i] ? api_entry_value(lenders[i]) : model;
    outcome = api_mixed_bind(call, holder, choice.lender, choice.index, &(*out)[i]);
  }
  return outcome;
}

api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choices *choices, int force, api_entry **out) {
  const char *key = make_key(call, choices, force);
  api_entry **lenders = tw_arena_alloc(call->arena, choices->count, sizeof *lenders);
  if (!key || !lenders) return api_fail_without_memory(call);
  api_bound_clip *bound = NULL;
  api_outcome outcome = take_lenders(call, choices, lenders);
  if (outcome == API_DONE) outcome = bind_mixed(call, model, choices, lenders, &bound);
  clip_source source = {.model = model,
                        .choices = choices,
                        .lenders = lenders,
                        .bound = bound,
                        .force = force,
                        .max_keys = api_clip_keys_max(call)};
  if (outcome == API_DONE) outcome = api_call_take(call, is_stored ? key : NULL, build_clip, &source, out);
  for (uint32_t i = 0; bound && i < choices->count; i++) api_mixed_release(&bound[i]);
  for (uint32_t i = 0; i < choices->count; i++) api_entry_release(lenders[i]);
  return outcome;
}
