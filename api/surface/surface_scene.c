/* Poses, animates and deforms what a surface shows. */
#include "surface_scene.h"

#include "baked.h"
#include "mixed_clips.h"
#include "reduced_clips.h"
#include "service.h"

#include <string.h>

/* ---- the clips ------------------------------------------------------------------------------- */

/* Takes the merged clips, to be posed or baked. */
static api_outcome take_moving(api_call *call, const tw_model *model, api_surface_scene *scene) {
  if (model->clip_count == 0 && scene->query->choices.count == 0)
    return api_fail_with(
        call, 404, "the model has no clips%s",
        scene->query->skin == API_SKIN_BAKE ? ": clip=none&skin=bake without times bakes it at rest" : "");
  if (scene->query->choices.count == 0)
    return api_fail_with(call, 400, "clip=none leaves no clip to take times of");
  api_outcome outcome =
      api_clip_take(call, model, scene->is_stored, &scene->query->choices, -1, &scene->moving);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(scene->moving);
  return api_times_complete(&scene->query->times, clip->duration, call->service->limits.max_times,
                            &call->fault.error) == TW_OK
             ? API_DONE
             : api_fail(call);
}

/* Whether a chosen clip has to be compiled: the model's own clips of keys are kept as they are. */
static bool is_compiled(const tw_model *model, const api_clip_choice *choice, const api_clip_terms *terms) {
  return choice->lender[0] || api_clip_is_mixed(model, choice->index) || terms->root.is_on;
}

/* Takes a clip where it is compiled. API_CONTINUE: it is mixed of clips that are not there, and the request
 * does not ask for it by name. */
static api_outcome take_one(api_call *call, const tw_model *model, const api_surface_scene *scene,
                            const api_clip_choice *choice, api_entry **out) {
  const api_clip_choices alone = {1, choice, scene->query->choices.terms};
  if (!is_compiled(model, choice, &alone.terms)) return API_DONE;
  api_outcome outcome = api_clip_take(call, model, scene->is_stored, &alone, -1, out);
  bool may_lack = !scene->query->clip && api_clip_is_mixed(model, choice->index);
  return outcome == API_FAILED && may_lack ? api_mixed_leave_out(call, model, choice->index) : outcome;
}

/* Takes the clips that are compiled. Leaves out those that are not asked for and cannot be had. */
static api_outcome take_compiled(api_call *call, const tw_model *model, api_surface_scene *scene) {
  api_clip_choices *choices = &scene->query->choices;
  api_clip_choice *taken = tw_arena_alloc(call->arena, choices->count, sizeof *taken);
  scene->compiled = tw_arena_alloc(call->arena, choices->count, sizeof *scene->compiled);
  if (!taken || !scene->compiled) return api_fail_without_memory(call);
  uint32_t count = 0;
  for (uint32_t i = 0; i < choices->count; i++) {
    taken[count] = api_clips_get(choices, i);
    api_outcome outcome = take_one(call, model, scene, &taken[count], &scene->compiled[count]);
    if (outcome != API_DONE && outcome != API_CONTINUE) return outcome;
    count += outcome == API_DONE;
  }
  scene->lacks_clips = count < choices->count;
  if (!scene->lacks_clips) return API_DONE;
  choices->count = count;
  choices->list = taken;
  return API_DONE;
}

api_outcome api_scene_take_clips(api_call *call, const tw_model *model, bool is_stored,
                                 api_surface_scene *scene) {
  bool has_times = scene->query->times.is_given;
  api_outcome outcome = api_clips_choose(call, model, scene->query->clip, has_times ? 1 : UINT32_MAX,
                                         &scene->query->terms, &scene->query->choices);
  if (outcome != API_DONE) return outcome;
  scene->is_stored = is_stored;
  if (api_is_baked_at_rest(scene->query) && scene->query->choices.count > 0)
    return api_fail_with(call, 400, "skin=bake goes with one time: a clip is called none");
  return has_times ? take_moving(call, model, scene) : take_compiled(call, model, scene);
}

static void warn_of(api_call *call, api_entry *entry) {
  if (!entry) return;
  const api_clip *clip = api_entry_value(entry);
  api_call_warn(call, clip->warnings, clip->warning_count);
}

/* Marks a clip of the model and those of its layers. Layers lead down, never round (mix_check.c). */
static void mark_clip(const tw_model *model, uint32_t clip, bool *is_asked) {
  if (is_asked[clip]) return;
  is_asked[clip] = true;
  for (uint32_t i = 0; i < model->clips[clip].layer_count; i++)
    if (model->clips[clip].layers[i].own != TW_NO_INDEX)
      mark_clip(model, model->clips[clip].layers[i].own, is_asked);
}

/* Adds the warnings of the model, and of those of its clips that the answer holds or is posed by. */
static void warn_of_model(api_call *call, const tw_model *model, const api_clip_choices *choices) {
  bool *is_asked = tw_arena_alloc(call->arena, model->clip_count, sizeof *is_asked);
  for (uint32_t i = 0; is_asked && i < choices->count; i++) {
    api_clip_choice choice = api_clips_get(choices, i);
    if (!choice.lender[0]) mark_clip(model, choice.index, is_asked);
  }
  for (uint32_t i = 0; i < model->warning_count; i++) {
    uint32_t clip = model->warned_clips[i];
    if (clip == TW_NO_INDEX || !is_asked || is_asked[clip]) api_call_warn(call, &model->warnings[i], 1);
  }
}

void api_scene_warn(api_call *call, const tw_model *model, const api_surface_scene *scene) {
  warn_of_model(call, model, &scene->query->choices);
  warn_of(call, scene->moving);
  for (uint32_t i = 0; scene->compiled && i < scene->query->choices.count; i++)
    warn_of(call, scene->compiled[i]);
}

void api_scene_release(api_surface_scene *scene) {
  for (uint32_t i = 0; scene->compiled && i < scene->query->choices.count; i++)
    api_entry_release(scene->compiled[i]);
  api_entry_release(scene->reduced);
  api_entry_release(scene->moving);
}

/* ---- the answer's clips ---------------------------------------------------------------------- */

/* Limits baked keys, which are held in memory, to the size of an upload. */
static api_outcome admit_baked(api_call *call, const api_clip *clip, uint64_t times) {
  uint32_t track_count = tw_clip_track_count(clip->compiled);
  uint64_t numbers = 0, limit = call->service->limits.max_upload / sizeof(float);
  for (uint32_t i = 0; i < track_count; i++) numbers += tw_clip_width(clip->compiled, i);
  if (times >= UINT32_MAX || (numbers > 0 && times > limit / numbers))
    return api_fail_with(call, 422, "%llu %s of %llu %s %s over the limit of %llu numbers in all",
                         (unsigned long long)times, tw_plural(times, "key", "keys"),
                         (unsigned long long)numbers, tw_plural(numbers, "number", "numbers"),
                         tw_plural(times, "is", "are"), (unsigned long long)limit);
  return API_DONE;
}

static void tell_error(api_call *call, const tw_tolerance *reached) {
  api_answer_headerf(&call->answer, "X-Tweend-Error", "degrees=%.6f, metres=%.9f",
                     reached->angle * TW_DEGREES, reached->distance);
}

/* Bakes the merged clips to keys at exactly the times of the request. */
static api_outcome bake_clips(api_call *call, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->moving);
  const api_times *asked = &scene->query->times;
  if (admit_baked(call, clip, asked->count) != API_DONE) return API_FAILED;
  uint32_t count = (uint32_t)asked->count;
  float *times = tw_arena_alloc(call->arena, count, sizeof *times);
  if (!times) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < count; i++) times[i] = (float)api_times_get(asked, i);
  tw_status status =
      tw_clip_bake(clip->compiled, times, count, call->arena, &scene->baked, &call->fault.error);
  tw_tolerance reached;
  if (status == TW_OK)
    status = tw_clip_bake_error(clip->compiled, &scene->baked, &call->service->parallel, &reached,
                                &call->fault.error);
  if (status != TW_OK) return api_fail(call);
  tell_error(call, &reached);
  scene->baked.name = clip->name;
  scene->content.clips = &scene->baked;
  scene->content.clip_count = 1;
  return API_DONE;
}

/* Fills the keys of the clips, unchanged: [choices.count]. *mixed: [choices.count] clips without keys, else
 * NULL. False without memory. */
static bool gather_clips(api_call *call, const tw_model *model, const api_surface_scene *scene,
                         tw_clip_keys **out, const tw_clip ***mixed) {
  uint32_t count = scene->query->choices.count;
  *out = tw_arena_alloc(call->arena, count, sizeof **out);
  *mixed = tw_arena_alloc(call->arena, count, sizeof **mixed);
  if (!*out || !*mixed) return false;
  for (uint32_t i = 0; i < count; i++) {
    const api_clip *clip = scene->compiled[i] ? api_entry_value(scene->compiled[i]) : NULL;
    const tw_clip_keys *keys = api_clip_keys(clip, model, api_clips_get(&scene->query->choices, i).index);
    if (keys)
      (*out)[i] = *keys;
    else
      (*out)[i].name = clip->name;
    (*mixed)[i] = keys ? NULL : clip->compiled;
  }
  return true;
}

/* Keeps the clips, with reduced tracks in place of those that glTF cannot express, and of others if asked
 * for. */
static api_outcome keep_clips(api_call *call, const tw_model *model, api_surface_scene *scene) {
  tw_clip_keys *clips;
  const tw_clip **mixed;
  if (!gather_clips(call, model, scene, &clips, &mixed)) return api_fail_without_memory(call);
  const api_clips_to_reduce source = {.clips = clips,
                                      .mixed = mixed,
                                      .clip_count = scene->query->choices.count,
                                      .node_count = model->node_count,
                                      .reduction = &scene->query->reduction,
                                      .max_keys = api_clip_keys_max(call)};
  scene->content.clips = clips;
  scene->content.clip_count = source.clip_count;
  if (!api_clips_need_reduction(&source)) return API_DONE;
  const char *key = api_surface_key_print(call, scene->query, API_KEY_REDUCED, "/reduced?");
  if (!key) return api_fail_without_memory(call);
  tw_tolerance reached;
  api_outcome outcome = api_clips_reduce(call, scene->is_stored ? key : NULL, &source, &scene->reduced,
                                         &scene->content.clips, &reached);
  if (outcome == API_DONE) tell_error(call, &reached);
  return outcome;
}

api_outcome api_scene_animate(api_call *call, const tw_model *model, api_surface_scene *scene) {
  if (scene->query->choices.count == 0 || api_is_moment(scene->query)) return API_DONE;
  return scene->query->times.is_given ? bake_clips(call, scene) : keep_clips(call, model, scene);
}

/* ---- the model ------------------------------------------------------------------------------- */

/* Leaves only the node tree. */
static api_outcome strip_meshes(api_call *call, const tw_model *model, api_surface_scene *scene) {
  tw_model *bare = api_copy_nodes(call->arena, model, 0);
  if (!bare) return api_fail_without_memory(call);
  bare->mesh_count = bare->skin_count = bare->material_count = 0;
  bare->assets = tw_gltf_assets_bare(call->arena, model->assets);
  if (model->assets && !bare->assets) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < bare->node_count; i++) {
    tw_node *node = &bare->nodes[i];
    node->mesh = node->skin = TW_NO_INDEX;
    node->weights = NULL;
    node->preserved = NULL; /* it may refer to cameras, lights and the like */
  }
  scene->content.model = bare;
  scene->meshes = api_plan_all(bare);
  return API_DONE;
}

/* Samples the morph weights of nodes that have a track of weights. */
static api_outcome pose_weights(api_call *call, const tw_model *model, float time, api_surface_scene *scene) {
  const tw_clip *clip = ((const api_clip *)api_entry_value(scene->moving))->compiled;
  const float **weights = NULL;
  for (uint32_t i = 0; i < tw_clip_track_count(clip); i++) {
    tw_path path;
    uint32_t node = tw_clip_target(clip, i, &path);
    if (path != TW_WEIGHTS || model->nodes[node].mesh == TW_NO_INDEX) continue;
    if (!weights) weights = tw_arena_alloc(call->arena, model->node_count, sizeof *weights);
    float *sample = tw_arena_alloc(call->arena, tw_clip_width(clip, i), sizeof *sample);
    if (!weights || !sample) return api_fail_without_memory(call);
    tw_clip_sample(clip, i, &time, 1, sample);
    weights[node] = sample;
  }
  scene->content.weights = weights;
  return API_DONE;
}

/* Poses the nodes at one time. */
static api_outcome pose_model(api_call *call, const tw_model *model, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->moving);
  tw_trs *locals = tw_arena_alloc(call->arena, model->node_count, sizeof *locals);
  if (!locals) return api_fail_without_memory(call);
  float time = (float)api_times_get(&scene->query->times, 0);
  tw_clip_pose(clip->compiled, model->nodes, model->node_count, time, locals);
  scene->content.pose = locals;
  scene->content.posed_by = clip->compiled;
  return pose_weights(call, model, time, scene);
}

/* ---- a node for the root motion -------------------------------------------------------------- */

/* Finds the node above which the clips' root motion needs one more; TW_NO_INDEX where it needs none. */
static api_outcome find_raised(api_call *call, const api_surface_scene *scene, uint32_t *out) {
  *out = TW_NO_INDEX;
  for (uint32_t i = 0; i <= scene->query->choices.count; i++) {
    api_entry *entry = i == scene->query->choices.count ? scene->moving
                       : scene->compiled                ? scene->compiled[i]
                                                        : NULL;
    const api_clip *clip = entry ? api_entry_value(entry) : NULL;
    if (!clip || !clip->root_is_above) continue;
    if (*out != TW_NO_INDEX && *out != clip->root_node)
      return api_fail_with(call, 422, "the clips travel by different nodes: name one as root_motion");
    *out = clip->root_node;
  }
  return API_DONE;
}

/* The model with a node above one of its roots, which carries the root motion. NULL without memory. */
static const tw_model *raise_root(tw_arena *arena, const tw_model *model, uint32_t root) {
  static const char *const names[] = {"root", "root_motion"};
  tw_model *raised = api_copy_nodes(arena, model, 1);
  if (!raised) return NULL;
  bool is_taken = tw_model_find_node(model, names[0], strlen(names[0])) != TW_NO_INDEX;
  uint32_t added = raised->node_count++;
  raised->nodes[added] = (tw_node){.name = names[is_taken],
                                   .parent = TW_NO_INDEX,
                                   .mesh = TW_NO_INDEX,
                                   .skin = TW_NO_INDEX,
                                   .rest = TW_TRS_IDENTITY,
                                   .is_hidden = model->nodes[root].is_hidden};
  raised->nodes[root].parent = added;
  memmove(raised->node_order + 1, raised->node_order, model->node_count * sizeof *raised->node_order);
  raised->node_order[0] = added;
  return raised;
}

/* ---- the answer's model ---------------------------------------------------------------------- */

static api_outcome bake_model(api_call *call, const tw_model *model, api_surface_scene *scene) {
  bool rests = api_is_baked_at_rest(scene->query);
  const tw_clip *clip = rests ? NULL : ((const api_clip *)api_entry_value(scene->moving))->compiled;
  float time = rests ? 0 : (float)api_times_get(&scene->query->times, 0);
  api_baked baked;
  api_outcome outcome = api_bake(call, model, clip, time, scene->query, &baked);
  if (outcome != API_DONE) return outcome;
  scene->content.model = baked.model;
  scene->content.pose = baked.pose;
  scene->content.posed_by = clip;
  scene->meshes = baked.meshes;
  scene->moves = baked.moves;
  return API_DONE;
}

api_outcome api_scene_pose(api_call *call, const tw_model *model, api_surface_scene *scene) {
  uint32_t raised;
  api_outcome found = find_raised(call, scene, &raised);
  if (found != API_DONE) return found;
  if (raised != TW_NO_INDEX) model = raise_root(call->arena, model, raised);
  if (!model) return api_fail_without_memory(call);
  scene->content.model = model;
  scene->meshes = api_plan_all(model);
  if (scene->query->skin == API_SKIN_BAKE) return bake_model(call, model, scene);
  api_outcome outcome = api_is_moment(scene->query) ? pose_model(call, model, scene) : API_DONE;
  return outcome == API_DONE && scene->query->meshes == API_MESHES_NONE ? strip_meshes(call, model, scene)
                                                                        : outcome;
}
