/* Mixed clips: binding their layers, and compiling them. */
#include "mixed_clips.h"

#include "answer.h"
#include "clip_choice.h"
#include "json_in.h"
#include "node_names.h"
#include "tweend/json_print.h"

#include <string.h>

/* ---- binding --------------------------------------------------------------------------------- */

/* How many clips have been bound, of which no more than TW_LAYER_CLIPS_MAX may be. */
typedef struct binding {
  api_call *call;
  uint32_t clip_count;
} binding;

/* Puts a layer's place before a fault's sentence. id: of the clip's model, "" for the request's. */
static void name_layer(api_fault *fault, const tw_model *model, uint32_t clip, const char *id,
                       uint32_t layer) {
  char name[24];
  tw_error_before(&fault->error, "clip \"%.60s\"%s%s, layer %u: ", tw_model_clip_name(model, clip, name),
                  id[0] ? " of model " : "", id, layer);
}

/* The same, and a pointer where the request's model has the layer. */
static api_outcome fail_in_layer(api_call *call, const api_bound_clip *clip, const char *id, uint32_t layer) {
  api_fault *fault = &call->fault;
  if (fault->stall != API_STALL_NONE || fault->status == 503) return API_FAILED;
  name_layer(fault, clip->model, clip->index, id, layer);
  if (!id[0]) {
    tw_error_at(&fault->error, "/clips/%u/layers/%u/clip", clip->index, layer);
    fault->in_document = true;
  }
  return API_FAILED;
}

static api_outcome bind_clip(binding *b, const char *id, uint32_t depth, api_bound_clip *clip);

static api_outcome bind_layer(binding *b, const char *id, uint32_t depth, api_bound_clip *clip,
                              uint32_t index) {
  const tw_clip_layer *layer = &clip->model->clips[clip->index].layers[index];
  api_bound_clip *out = &clip->layers[index];
  *out = (api_bound_clip){.model = clip->model, .index = layer->own};
  if (layer->own != TW_NO_INDEX) return bind_clip(b, id, depth + 1, out);
  api_borrowed borrowed;
  api_outcome outcome = api_clip_find_borrowed(b->call, layer->clip, strlen(layer->clip), &borrowed);
  out->entry = borrowed.entry;
  if (outcome == API_CONTINUE || outcome == API_FAILED) return fail_in_layer(b->call, clip, id, index);
  if (outcome != API_DONE) return outcome;
  out->model = api_entry_value(borrowed.entry);
  out->index = borrowed.index;
  return bind_clip(b, borrowed.lender, depth + 1, out);
}

/* Recurses no deeper than TW_LAYER_DEPTH_MAX. */
static api_outcome bind_clip(binding *b, const char *id, uint32_t depth, api_bound_clip *clip) {
  uint32_t count = clip->model->clips[clip->index].layer_count;
  if (count == 0 && ++b->clip_count > TW_LAYER_CLIPS_MAX)
    return api_fail_with(b->call, 422, "the clip is mixed of more than %d clips", TW_LAYER_CLIPS_MAX);
  if (count == 0) return API_DONE;
  if (depth >= TW_LAYER_DEPTH_MAX)
    return api_fail_with(b->call, 422, "the clip is mixed of clips that lie more than %d deep",
                         TW_LAYER_DEPTH_MAX);
  clip->layers = tw_arena_alloc(b->call->arena, count, sizeof *clip->layers);
  if (!clip->layers) return api_fail_without_memory(b->call);
  clip->layer_count = count;
  api_outcome outcome = API_DONE;
  for (uint32_t i = 0; i < count && outcome == API_DONE; i++) outcome = bind_layer(b, id, depth, clip, i);
  return outcome;
}

api_outcome api_mixed_bind(api_call *call, const tw_model *model, const char *id, uint32_t index,
                           api_bound_clip *out) {
  binding b = {call, 0};
  *out = (api_bound_clip){.model = model, .index = index};
  return bind_clip(&b, id, 0, out);
}

void api_mixed_release(api_bound_clip *bound) {
  for (uint32_t i = 0; i < bound->layer_count; i++) api_mixed_release(&bound->layers[i]);
  api_entry_release(bound->entry);
  bound->entry = NULL;
}

api_outcome api_mixed_leave_out(api_call *call, const tw_model *model, uint32_t index) {
  if (call->fault.stall != API_STALL_NONE || call->fault.status != 404) return API_FAILED;
  char name[24];
  tw_text text = {0};
  tw_text_add(&text, "the mixed clip ");
  tw_text_add(&text, tw_model_clip_name(model, index, name));
  tw_text_add(&text, " is left out: ");
  tw_text_add(&text, call->fault.error.detail);
  call->fault = (api_fault){0};
  return api_call_warn_text(call, &text) == API_DONE ? API_CONTINUE : API_FAILED;
}

/* ---- putting nodes on the model's ------------------------------------------------------------ */

/* In place of a node: the model has none of that name, or a layer leaves it alone. */
static const uint32_t NODE_MISSING = TW_NO_INDEX, NODE_LEFT = TW_NO_INDEX - 1;

typedef struct compiling {
  const tw_model *model; /* whose nodes the clips move */
  const bool *is_left;   /* [nodes of the model] that a layer above leaves alone; NULL: none */
  int force;
  uint32_t max_keys;
  api_notes *notes;
  tw_arena *scratch;
  tw_text *layers; /* receives the reports of layers that are carried over; NULL: those of a lender's clip */
  api_fault *fault;
} compiling;

/* A clip while it is compiled. */
typedef struct made_clip {
  tw_clip *clip;
  float duration; /* of the source, whatever of it is left */
} made_clip;

static bool fail_without_memory(const compiling *c) {
  return api_fault_without_memory(c->fault);
}

/* The map of a layer: `map` but for nodes outside of the layer's subtrees. NULL without memory. */
static uint32_t *mask_map(const compiling *c, const tw_model *model, const tw_clip_layer *layer,
                          const uint32_t *map) {
  uint32_t *masked = tw_arena_alloc_raw(c->scratch, model->node_count, sizeof *masked);
  bool *is_moved = tw_arena_alloc(c->scratch, model->node_count, sizeof *is_moved);
  if (!masked || !is_moved) return NULL;
  for (uint32_t i = 0; i < layer->node_count; i++) is_moved[layer->nodes[i]] = true;
  for (uint32_t i = 0; i < model->node_count; i++) {
    uint32_t node = model->node_order[i], parent = model->nodes[node].parent;
    if (parent != TW_NO_INDEX && is_moved[parent]) is_moved[node] = true;
    masked[node] = is_moved[node] ? map[node] : NODE_LEFT;
  }
  return masked;
}

/* Follows a map by another: in place. */
static void chain_map(uint32_t *map, uint32_t count, const uint32_t *next) {
  for (uint32_t i = 0; i < count; i++)
    if (map[i] != NODE_MISSING) map[i] = next[map[i]];
}

/* The nodes of c->model that a masked map does not lead to. NULL without memory. */
static const bool *find_left(const compiling *c, const tw_model *model, const uint32_t *masked) {
  bool *is_left = tw_arena_alloc(c->scratch, c->model->node_count, sizeof *is_left);
  if (!is_left) return NULL;
  memset(is_left, true, c->model->node_count);
  for (uint32_t i = 0; i < model->node_count; i++)
    if (masked[i] != NODE_MISSING && masked[i] != NODE_LEFT) is_left[masked[i]] = false;
  return is_left;
}

/* ---- compiling ------------------------------------------------------------------------------- */

/* Adds the tracks of a face, which go by expressions and not by maps, but for nodes that a layer leaves
 * alone. False without memory. */
static bool add_face(const compiling *c, const tw_clip_keys *face, tw_clip_keys *keys) {
  tw_track_keys *tracks = tw_arena_alloc_raw(c->scratch, face->track_count, sizeof *tracks);
  if (!tracks) return false;
  tw_clip_keys moved = {.tracks = tracks};
  for (uint32_t i = 0; i < face->track_count; i++)
    if (!c->is_left || !c->is_left[face->tracks[i].node]) tracks[moved.track_count++] = face->tracks[i];
  return api_face_add(&moved, c->model->node_count, c->scratch, keys);
}

/* Compiles keys of a model. map: for each of its nodes that of c->model. face: of c->model. */
static bool compile_keys(const compiling *c, const tw_model *model, const tw_clip_keys *source,
                         const uint32_t *map, const tw_clip_keys *face, made_clip *out) {
  tw_track_keys *tracks = tw_arena_alloc_raw(c->scratch, source->track_count, sizeof *tracks);
  uint8_t *moved = tw_arena_alloc(c->scratch, c->model->node_count, 1); /* as of api_track_take */
  if (!tracks || !moved) return fail_without_memory(c);
  tw_clip_keys keys = {.tracks = tracks};
  for (uint32_t i = 0; i < source->track_count; i++) {
    const tw_track_keys *track = &source->tracks[i];
    uint32_t node = map[track->node];
    char buffer[24];
    const char *name = tw_model_node_name(model, track->node, buffer);
    if (node == NODE_MISSING && !api_note_missing(c->notes, name)) return fail_without_memory(c);
    if (node == NODE_MISSING || node == NODE_LEFT) continue;
    bool fits, is_free = true;
    if (!api_track_check(c->notes, c->model, track, node, &fits) ||
        (fits && !api_track_take(c->notes, moved, track, node, name, &is_free)))
      return fail_without_memory(c);
    if (!fits || !is_free) continue;
    tracks[keys.track_count] = *track;
    tracks[keys.track_count++].node = node;
  }
  if (!add_face(c, face, &keys)) return fail_without_memory(c);
  return tw_clip_create(&keys, c->model->node_count, c->force, &out->clip, &c->fault->error) == TW_OK ||
         api_fault_complete(c->fault);
}

static bool compile_mixed(const compiling *c, const api_bound_clip *bound, const uint32_t *map,
                          made_clip *out);

/* The keys of a clip on its own model: for a mixed one, those that follow it. They live in the scratch. */
static bool find_keys(const compiling *c, const api_bound_clip *bound, tw_clip_keys *out) {
  static const tw_tolerance tolerance = {0.02 / TW_DEGREES, 1e-5};
  *out = bound->model->clips[bound->index];
  if (bound->layer_count == 0) return true;
  compiling own = *c;
  own.model = bound->model;
  own.is_left = NULL;
  own.layers = NULL;
  own.force = -1;
  made_clip made = {0};
  uint32_t *map = api_nodes_by_name(bound->model, bound->model, c->scratch);
  if (!map) return fail_without_memory(c);
  if (!compile_mixed(&own, bound, map, &made)) return false;
  const char *name = out->name;
  uint64_t steps = TW_REDUCTION_STEPS;
  tw_tolerance reached;
  tw_status status = tw_clip_reduce(made.clip, NULL, tolerance, c->max_keys, &steps, c->scratch, out,
                                    &reached, &c->fault->error);
  tw_clip_destroy(made.clip);
  out->name = name;
  return status == TW_OK || api_fault_complete(c->fault);
}

/* Copies notes out of the scratch. False without memory. */
static bool keep_notes(const compiling *c, const api_notes *notes) {
  for (uint32_t i = 0; i < notes->count; i++) {
    const char *kept = tw_arena_text(c->notes->arena, notes->list[i], strlen(notes->list[i]));
    if (!kept || !api_note(c->notes, kept)) return false;
  }
  return true;
}

/* Compiles a clip that is carried over to the skeleton of `onto`, then put on c->model's nodes by `map`. */
static bool compile_carried(const compiling *c, const api_bound_clip *bound, const tw_model *onto,
                            const tw_retarget_wish *retarget, const uint32_t *map, const char **report,
                            made_clip *out) {
  tw_clip_keys own, carried;
  api_face_split split;
  api_notes notes = {.arena = c->scratch};
  if (!find_keys(c, bound, &own) ||
      !api_face_split_off(bound->model, &own, c->model, c->max_keys, &notes, &split, c->fault) ||
      !api_clip_carry(bound->model, &split.others, onto, retarget, c->max_keys, &notes, report, &carried,
                      c->fault))
    return false;
  if (!keep_notes(c, &notes)) return fail_without_memory(c);
  out->duration = tw_keys_duration(&own);
  return compile_keys(c, onto, &carried, map, &split.face, out);
}

/* map: for each node of the clip's model, that of c->model. */
static bool compile_any(const compiling *c, const api_bound_clip *bound, const uint32_t *map,
                        made_clip *out) {
  const tw_clip_keys *keys = &bound->model->clips[bound->index];
  if (bound->layer_count > 0) return compile_mixed(c, bound, map, out);
  api_face_split split;
  api_notes notes = {.arena = c->scratch};
  if (!api_face_split_off(bound->model, keys, c->model, c->max_keys, &notes, &split, c->fault)) return false;
  if (!keep_notes(c, &notes)) return fail_without_memory(c);
  out->duration = tw_keys_duration(keys);
  return compile_keys(c, bound->model, &split.others, map, &split.face, out);
}

/* Whether a layer above leaves nodes of the model alone. */
static bool is_masked(const tw_model *model, const uint32_t *map) {
  uint32_t i = 0;
  while (i < model->node_count && map[i] != NODE_LEFT) i++;
  return i < model->node_count;
}

/* Tells of a layer that cannot do what it seems to ask for. map: of the mixed clip's nodes; made: the layer's
 * clip. */
static bool note_layer(const compiling *c, const api_bound_clip *bound, uint32_t index, const uint32_t *map,
                       const made_clip *made) {
  const tw_clip_layer *source = &bound->model->clips[bound->index].layers[index];
  const tw_layer *layer = &source->layer;
  bool ends = !layer->is_synced && layer->loop == TW_CLAMP && made->duration > 0;
  const char *what = NULL;
  if (source->node_count > 0 && tw_clip_track_count(made->clip) == 0 && !is_masked(bound->model, map))
    what = "moves nothing: its clip moves none of its nodes";
  else if (ends && layer->speed > 0 && layer->offset >= (double)made->duration)
    what = "stands still: from its offset on its clip is at its end";
  else if (ends && layer->speed < 0 && layer->offset <= 0)
    what = "stands still: backwards from its offset its clip is at its start";
  else if (layer->mode == TW_LAYER_ADDITIVE && layer->reference > (double)made->duration)
    what = "has its reference behind the end of its clip: it is the last pose";
  if (!what) return true;
  char name[24];
  tw_text text = {0};
  tw_text_add(&text, "clip \"");
  tw_text_add(&text, tw_model_clip_name(bound->model, bound->index, name));
  tw_text_add(&text, "\", layer ");
  tw_text_count(&text, index);
  tw_text_add(&text, " ");
  tw_text_add(&text, what);
  const char *kept = api_text_move(&text, c->notes->arena);
  return (kept && api_note(c->notes, kept)) || fail_without_memory(c);
}

/* Tells how a layer's clip was carried over. */
static void tell_layer(const compiling *c, const api_bound_clip *bound, uint32_t index, const char *report) {
  char name[24];
  if (!c->layers) return;
  if (c->layers->size == 0) tw_text_add(c->layers, "[");
  tw_text_element(c->layers);
  tw_text_add(c->layers, "{");
  tw_member_string(c->layers, "clip", tw_model_clip_name(bound->model, bound->index, name));
  tw_member_count(c->layers, "layer", index);
  tw_member_string(c->layers, "plays", bound->model->clips[bound->index].layers[index].clip);
  tw_text_member(c->layers, "retarget");
  tw_text_add(c->layers, report);
  tw_text_add(c->layers, "}");
}

/* Compiles the clip of a layer. map: for each node of the mixed clip's model, that of c->model. */
static bool compile_layer(const compiling *c, const api_bound_clip *bound, uint32_t index,
                          const uint32_t *map, made_clip *out) {
  const tw_clip_layer *layer = &bound->model->clips[bound->index].layers[index];
  const api_bound_clip *below = &bound->layers[index];
  compiling masked = *c;
  if (layer->node_count > 0) {
    map = mask_map(c, bound->model, layer, map);
    masked.is_left = map ? find_left(c, bound->model, map) : NULL;
    if (!masked.is_left) return fail_without_memory(c);
    c = &masked;
  }
  if (below->entry && layer->retarget.is_auto) {
    const char *report;
    if (compile_carried(c, below, bound->model, &layer->retarget, map, &report, out)) {
      tell_layer(c, bound, index, report);
      return true;
    }
    if (c->fault->error.status != TW_NO_MEMORY) name_layer(c->fault, bound->model, bound->index, "", index);
    return false;
  }
  if (!below->entry) return compile_any(c, below, map, out);
  uint32_t *names = api_nodes_by_name(below->model, bound->model, c->scratch);
  if (!names) return fail_without_memory(c);
  chain_map(names, below->model->node_count, map);
  return compile_any(c, below, names, out);
}

/* Mixes the made clips of layers, which the result owns; destroys them on failure. made: [count]. */
static bool mix(const compiling *c, const tw_layer *layers, const made_clip *made, uint32_t count,
                bool is_made, made_clip *out) {
  tw_clip *clips[TW_LAYERS_MAX];
  float durations[TW_LAYERS_MAX];
  for (uint32_t i = 0; i < count; i++) {
    clips[i] = made[i].clip;
    durations[i] = made[i].duration;
  }
  const float **weights = is_made ? api_rest_weights(c->model, c->scratch) : NULL;
  const tw_mix_job job = {count, layers, clips, durations, c->model->nodes, c->model->node_count, weights};
  if (is_made && !weights) is_made = fail_without_memory(c);
  if (is_made)
    is_made = tw_clip_mix(&job, &out->clip, &c->fault->error) == TW_OK || api_fault_complete(c->fault);
  if (is_made)
    out->duration = tw_clip_duration(out->clip);
  else
    for (uint32_t i = 0; i < count; i++) tw_clip_destroy(clips[i]);
  return is_made;
}

static bool compile_mixed(const compiling *c, const api_bound_clip *bound, const uint32_t *map,
                          made_clip *out) {
  const tw_clip_layer *sources = bound->model->clips[bound->index].layers;
  tw_layer layers[TW_LAYERS_MAX] = {0};
  made_clip made[TW_LAYERS_MAX] = {0};
  uint32_t count = 0;
  bool is_made = true;
  for (; count < bound->layer_count && is_made; count++) {
    layers[count] = sources[count].layer;
    is_made =
        compile_layer(c, bound, count, map, &made[count]) && note_layer(c, bound, count, map, &made[count]);
  }
  return mix(c, layers, made, count, is_made, out);
}

/* ---- the clips of a request ------------------------------------------------------------------ */

/* Compiles a clip that the request names. */
static bool compile_chosen(const compiling *c, api_mixing *mixing, const api_bound_clip *bound,
                           made_clip *out) {
  bool is_carried = bound->model != c->model && mixing->retarget->is_auto;
  uint32_t *map = api_nodes_by_name(is_carried ? c->model : bound->model, c->model, c->scratch);
  if (!map) return fail_without_memory(c);
  if (!is_carried) return compile_any(c, bound, map, out);
  const char *report;
  if (!compile_carried(c, bound, c->model, mixing->retarget, map, &report, out)) return false;
  mixing->report = tw_arena_text(c->notes->arena, report, strlen(report));
  if (mixing->report) return true;
  tw_clip_destroy(out->clip);
  out->clip = NULL;
  return fail_without_memory(c);
}

static bool compile_list(const compiling *c, api_mixing *mixing, const api_bound_clip *bound, uint32_t count,
                         made_clip *out) {
  static const float whole = 1;
  tw_layer layers[TW_LAYERS_MAX] = {0};
  made_clip made[TW_LAYERS_MAX] = {0};
  uint32_t done = 0;
  bool is_made = true;
  for (; done < count && is_made; done++) {
    layers[done] = (tw_layer){.mode = TW_LAYER_OVERRIDE, .speed = 1, .weight_count = 1, .weights = &whole};
    is_made = compile_chosen(c, mixing, &bound[done], &made[done]);
  }
  return mix(c, layers, made, done, is_made, out);
}

bool api_mixed_compile(api_mixing *mixing, const api_bound_clip *bound, uint32_t count, tw_clip **out,
                       api_fault *fault) {
  tw_text layers = {0};
  compiling c = {.model = mixing->model,
                 .force = mixing->force,
                 .max_keys = mixing->max_keys,
                 .notes = mixing->notes,
                 .scratch = tw_arena_create(),
                 .layers = &layers,
                 .fault = fault};
  made_clip made = {0};
  bool is_made = c.scratch ? count == 1 ? compile_chosen(&c, mixing, bound, &made)
                                        : compile_list(&c, mixing, bound, count, &made)
                           : fail_without_memory(&c);
  tw_arena_destroy(c.scratch);
  bool has_layers = layers.size > 0 || layers.failed;
  if (has_layers) tw_text_add(&layers, "]");
  mixing->layers = api_text_move(&layers, mixing->notes->arena);
  if (!has_layers) mixing->layers = NULL;
  if (is_made && has_layers && !mixing->layers) {
    tw_clip_destroy(made.clip);
    made.clip = NULL;
    is_made = fail_without_memory(&c);
  }
  *out = made.clip;
  return is_made;
}
