/* Posing, animating and deforming what a surface shows. */
#include "surface_scene.h"

#include "baked.h"
#include "service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double DEGREES = 57.295779513082320877; /* in a radian */

/* Whether the request is for the model at one moment. */
static bool is_moment(const api_scene_query *query) {
  return query->times.list && query->times.count == 1;
}

/* ---- parameters --------------------------------------------------------------------------------- */

static tw_status read_tolerance(const api_query *query, api_scene_query *out, tw_error *error) {
  double degrees = 0.1, metres = 0.001;
  tw_status status = api_query_number(query, "tolerance", &degrees, error);
  if (status == TW_OK) status = api_query_number(query, "tolerance_m", &metres, error);
  if (status != TW_OK) return status;
  if (degrees < 0.0001 || degrees > 180)
    return tw_fail(error, TW_SYNTAX, "tolerance must be from 0.0001 to 180 degrees");
  if (metres < 1e-9) return tw_fail(error, TW_SYNTAX, "tolerance_m must be 1e-9 metres or more");
  out->reduction.tolerance = (tw_tolerance){degrees / DEGREES, metres};
  out->reduction.is_wide = api_query_get(query, "tolerance") || api_query_get(query, "tolerance_m");
  return TW_OK;
}

/* Parameters that need or exclude another one. */
static tw_status check_together(const api_scene_query *query, tw_error *error) {
  if (query->is_baked && !is_moment(query))
    return tw_fail(error, TW_SYNTAX, "skin=bake goes with one time: at=T");
  if (query->is_baked && query->is_bare)
    return tw_fail(error, TW_SYNTAX, "meshes=none leaves skin=bake nothing to move");
  if (query->reduction.is_wide && (!query->clip_name || query->times.is_given))
    return tw_fail(error, TW_SYNTAX, "tolerance goes with clip, without times");
  return TW_OK;
}

api_outcome api_scene_read(api_call *call, api_scene_query *out) {
  static const char *const skins[] = {"keep", "bake", NULL};
  static const char *const meshes[] = {"all", "none", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int skin = 0, mesh = 0;
  *out = (api_scene_query){.clip_name = api_query_get(query, "clip")};
  tw_status status = api_query_choice(query, "skin", skins, &skin, error);
  if (status == TW_OK) status = api_query_choice(query, "meshes", meshes, &mesh, error);
  if (status == TW_OK)
    status = api_times_read(query, call->service->limits.max_times, call->arena, &out->times, error);
  if (status == TW_OK) status = read_tolerance(query, out, error);
  out->is_baked = skin == 1;
  out->is_bare = mesh == 1;
  out->has_clip = out->clip_name || out->times.is_given;
  if (status == TW_OK) status = check_together(out, error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

void api_scene_print(const api_surface_scene *scene, tw_text *text) {
  const api_scene_query *query = &scene->query;
  tw_text_add(text, query->is_bare ? "&meshes=none" : "&meshes=all");
  tw_text_add(text, query->is_baked ? "&skin=bake" : "&skin=keep");
  if (!query->has_clip) return;
  char clip[80];
  snprintf(clip, sizeof clip, "&clip=%s/%u&times=", scene->choice.lender, scene->choice.index);
  tw_text_add(text, clip);
  api_times_print(&query->times, text);
  if (!query->reduction.is_wide) return;
  tw_text_add(text, "&tolerance=");
  tw_text_double(text, query->reduction.tolerance.angle);
  tw_text_add(text, "/");
  tw_text_double(text, query->reduction.tolerance.distance);
}

/* ---- the clip ------------------------------------------------------------------------------------ */

api_outcome api_scene_take_clip(api_call *call, const tw_model *model, bool is_stored,
                                api_surface_scene *scene) {
  api_outcome outcome = api_clip_find(call, model, scene->query.clip_name, -1, &scene->choice);
  if (outcome != API_DONE) return outcome;
  if (scene->choice.index == TW_NO_INDEX) return api_fail_with(call, 404, "the model has no clips");
  scene->is_stored = is_stored;
  outcome = api_clip_take(call, model, is_stored, &scene->choice, &scene->clip);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(scene->clip);
  if (clip->missing_count > 0) api_clip_warning(call, clip);
  return api_times_complete(&scene->query.times, tw_clip_duration(clip->compiled),
                            call->service->limits.max_times, &call->fault.error) == TW_OK
             ? API_DONE
             : api_fail(call);
}

/* ---- fewer keys ---------------------------------------------------------------------------------- */

/* The tracks of a clip that a reduction changes; immutable. */
typedef struct reduced_clip {
  tw_arena *arena; /* of what follows */
  uint32_t track_count;
  const uint32_t *places; /* [track_count] in the clip, ascending */
  const tw_track_keys *tracks;
  tw_tolerance reached; /* the largest error that is left */
} reduced_clip;

typedef struct reduced_source {
  const tw_model *model;
  const tw_clip_keys *keys;
  const api_reduction *reduction;
  uint32_t max_keys; /* of a track */
} reduced_source;

/* Whether glTF interpolates between the keys just as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP || track->interpolation == TW_CUBICSPLINE;
}

static bool is_reduced(const tw_track_keys *track, const api_reduction *reduction) {
  return !is_native(track) || (reduction->is_wide && track->interpolation == TW_LINEAR);
}

static void destroy_reduced(void *value) {
  tw_arena_destroy(((reduced_clip *)value)->arena); /* holds the struct itself */
}

/* The tracks to reduce as a clip of their own. */
static bool choose_tracks(const reduced_source *source, reduced_clip *reduced, tw_track_keys *chosen) {
  uint32_t *places = tw_arena_alloc(reduced->arena, source->keys->track_count, sizeof *places);
  if (!places) return false;
  for (uint32_t i = 0; i < source->keys->track_count; i++) {
    if (!is_reduced(&source->keys->tracks[i], source->reduction)) continue;
    chosen[reduced->track_count] = source->keys->tracks[i];
    places[reduced->track_count++] = i;
  }
  reduced->places = places;
  return true;
}

static tw_status reduce_tracks(const reduced_source *source, reduced_clip *reduced, tw_error *error) {
  tw_track_keys *chosen = tw_alloc(source->keys->track_count, sizeof *chosen);
  if (!chosen || !choose_tracks(source, reduced, chosen)) {
    free(chosen);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  tw_clip_keys keys = {.track_count = reduced->track_count, .tracks = chosen}, out = {0};
  tw_clip *clip = NULL;
  tw_status status = tw_clip_create(&keys, source->model->node_count, -1, &clip, error);
  if (status == TW_OK) /* none of the tracks is a spline, which would stay where it is */
    status = tw_clip_reduce(clip, &keys, source->reduction->tolerance, source->max_keys, reduced->arena, &out,
                            &reduced->reached, error);
  reduced->tracks = out.tracks;
  tw_clip_destroy(clip);
  free(chosen);
  return status;
}

static bool build_reduced(void *context, api_built *out, api_fault *fault) {
  tw_arena *arena = tw_arena_create();
  reduced_clip *reduced = arena ? tw_arena_alloc(arena, 1, sizeof *reduced) : NULL;
  if (!reduced) {
    tw_arena_destroy(arena);
    api_fault_without_memory(fault);
    return false;
  }
  reduced->arena = arena;
  if (reduce_tracks(context, reduced, &fault->error) != TW_OK) {
    destroy_reduced(reduced);
    api_fault_complete(fault);
    return false;
  }
  *out = (api_built){reduced, tw_arena_size(arena), destroy_reduced};
  return true;
}

/* The reduced tracks of a taken clip, whose keys are given: *out holds a reduced_clip. Reducing takes far
 * longer than sending, so what comes of it is worth a place in the cache. */
static api_outcome take_reduced(api_call *call, const tw_model *model, bool is_stored,
                                const api_clip_choice *choice, const tw_clip_keys *keys,
                                const api_reduction *reduction, api_entry **out) {
  uint64_t limit = call->service->limits.max_times;
  reduced_source source = {model, keys, reduction, limit < UINT32_MAX ? (uint32_t)limit : UINT32_MAX};
  char key[192];
  snprintf(key, sizeof key, "%s/reduced?from=%s&index=%u&wide=%d&tolerance=%a/%a", call->id, choice->lender,
           choice->index, reduction->is_wide, reduction->tolerance.angle, reduction->tolerance.distance);
  return api_call_take(call, is_stored ? key : NULL, build_reduced, &source, out);
}

/* ---- keys of the answer -------------------------------------------------------------------------- */

/* Baked keys are held in memory: no more of them than of an upload. */
static api_outcome check_baked(api_call *call, const api_clip *clip, uint32_t track_count, uint64_t times) {
  uint64_t numbers = 0, limit = call->service->limits.max_upload / sizeof(float);
  for (uint32_t i = 0; i < track_count; i++) numbers += tw_clip_width(clip->compiled, i);
  if (times < UINT32_MAX && (numbers == 0 || times <= limit / numbers)) return API_DONE;
  return api_fail_with(call, 422, "%llu keys of %llu numbers are over the limit of %llu numbers in all",
                       (unsigned long long)times, (unsigned long long)numbers, (unsigned long long)limit);
}

/* The clip as keys at exactly the times asked for. */
static api_outcome bake_clip(api_call *call, const tw_model *model, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->clip);
  const api_times *asked = &scene->query.times;
  uint32_t track_count = api_clip_keys(clip, model, &scene->choice)->track_count;
  if (check_baked(call, clip, track_count, asked->count) != API_DONE) return API_FAILED;
  uint32_t count = (uint32_t)asked->count;
  float *times = tw_arena_alloc(call->arena, count, sizeof *times);
  if (!times) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < count; i++) times[i] = api_times_get(asked, i);
  tw_status status =
      tw_clip_bake(clip->compiled, times, count, call->arena, &scene->animation, &call->fault.error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

/* The clip as it is, but for tracks that glTF does not have or that are to have fewer keys. */
static api_outcome keep_clip(api_call *call, const tw_model *model, api_surface_scene *scene) {
  const tw_clip_keys *keys = api_clip_keys(api_entry_value(scene->clip), model, &scene->choice);
  tw_track_keys *tracks = tw_arena_alloc(call->arena, keys->track_count, sizeof *tracks);
  if (!tracks) return api_fail_without_memory(call);
  api_outcome outcome = take_reduced(call, model, scene->is_stored, &scene->choice, keys,
                                     &scene->query.reduction, &scene->reduced);
  if (outcome != API_DONE) return outcome;
  const reduced_clip *reduced = api_entry_value(scene->reduced);
  if (keys->track_count) memcpy(tracks, keys->tracks, keys->track_count * sizeof *tracks);
  for (uint32_t i = 0; i < reduced->track_count; i++) tracks[reduced->places[i]] = reduced->tracks[i];
  scene->animation = (tw_clip_keys){.track_count = keys->track_count, .tracks = tracks};
  api_answer_headerf(&call->answer, "X-Tweend-Error", "degrees=%.6f, metres=%.9f",
                     reduced->reached.angle * DEGREES, reduced->reached.distance);
  return API_DONE;
}

void api_scene_release(api_surface_scene *scene) {
  api_entry_release(scene->reduced);
  api_entry_release(scene->clip);
}

api_outcome api_scene_animate(api_call *call, const tw_model *model, api_surface_scene *scene) {
  if (!scene->query.has_clip || is_moment(&scene->query)) return API_DONE;
  api_outcome outcome =
      scene->query.times.is_given ? bake_clip(call, model, scene) : keep_clip(call, model, scene);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(scene->clip);
  scene->animation.name = clip->name;
  scene->content.clips = &scene->animation;
  scene->content.clip_count = 1;
  return API_DONE;
}

/* ---- the model ----------------------------------------------------------------------------------- */

/* The node tree alone. */
static api_outcome strip_meshes(api_call *call, const tw_model *model, api_surface_scene *scene) {
  tw_model *bare = api_copy_nodes(call->arena, model, 0);
  if (!bare) return api_fail_without_memory(call);
  bare->mesh_count = bare->skin_count = bare->material_count = 0;
  bare->assets = NULL;
  for (uint32_t i = 0; i < bare->node_count; i++) {
    tw_node *node = &bare->nodes[i];
    node->mesh = node->skin = TW_NO_INDEX;
    node->weights = NULL;
    node->kept = NULL; /* it may name cameras, lights and the like */
  }
  scene->content.model = bare;
  scene->meshes = api_plan_all(bare);
  return API_DONE;
}

/* Morph weights of the nodes that the clip has such tracks of. */
static api_outcome pose_weights(api_call *call, const tw_model *model, float time, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->clip);
  const tw_clip_keys *keys = api_clip_keys(clip, model, &scene->choice);
  const float **weights = NULL;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    uint32_t mesh = model->nodes[track->node].mesh;
    if (track->path != TW_WEIGHTS || mesh == TW_NO_INDEX) continue;
    if (!weights) weights = tw_arena_alloc(call->arena, model->node_count, sizeof *weights);
    float *sample = tw_arena_alloc(call->arena, track->width, sizeof *sample);
    if (!weights || !sample) return api_fail_without_memory(call);
    tw_clip_sample(clip->compiled, i, &time, 1, sample);
    weights[track->node] = sample;
  }
  scene->content.weights = weights;
  return API_DONE;
}

/* The nodes at one time. */
static api_outcome pose_model(api_call *call, const tw_model *model, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->clip);
  tw_trs *locals = tw_arena_alloc(call->arena, model->node_count, sizeof *locals);
  if (!locals) return api_fail_without_memory(call);
  float time = api_times_get(&scene->query.times, 0);
  tw_clip_pose(clip->compiled, model->nodes, model->node_count, time, locals);
  scene->content.pose = locals;
  scene->content.posed_by = clip->compiled;
  return pose_weights(call, model, time, scene);
}

static api_outcome bake_model(api_call *call, const tw_model *model, api_surface_scene *scene) {
  const api_clip *clip = api_entry_value(scene->clip);
  api_baked baked;
  api_outcome outcome = api_bake(call, model, clip->compiled, api_times_get(&scene->query.times, 0), &baked);
  if (outcome != API_DONE) return outcome;
  scene->content.model = baked.model;
  scene->content.pose = baked.pose;
  scene->content.posed_by = clip->compiled;
  scene->meshes = baked.meshes;
  scene->moves = baked.moves;
  return API_DONE;
}

api_outcome api_scene_pose(api_call *call, const tw_model *model, api_surface_scene *scene) {
  scene->content.model = model;
  scene->meshes = api_plan_all(model);
  if (scene->query.is_baked) return bake_model(call, model, scene);
  api_outcome outcome = is_moment(&scene->query) ? pose_model(call, model, scene) : API_DONE;
  return outcome == API_DONE && scene->query.is_bare ? strip_meshes(call, model, scene) : outcome;
}
