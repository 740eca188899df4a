/* Posing, animating and deforming what a surface shows. */
#include "shown.h"

#include "baked.h"
#include "service.h"

#include <stdio.h>
#include <string.h>

static const double DEGREES = 57.295779513082320877; /* in a radian */

/* Whether the request is for the model at one moment. */
static bool is_moment(const api_shown_query *query) {
  return query->times.list && query->times.count == 1;
}

/* ---- parameters --------------------------------------------------------------------------------- */

static tw_status read_tolerance(const api_query *query, api_shown_query *out, tw_error *error) {
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
static tw_status check_together(const api_shown_query *query, tw_error *error) {
  if (query->is_baked && !is_moment(query))
    return tw_fail(error, TW_SYNTAX, "skin=bake goes with one time: at=T");
  if (query->is_baked && query->is_bare)
    return tw_fail(error, TW_SYNTAX, "meshes=none leaves skin=bake nothing to move");
  if (query->reduction.is_wide && (!query->clip_name || query->times.is_given))
    return tw_fail(error, TW_SYNTAX, "tolerance goes with clip, without times");
  return TW_OK;
}

api_outcome api_shown_read(api_call *call, api_shown_query *out) {
  static const char *const skins[] = {"keep", "bake", NULL};
  static const char *const meshes[] = {"all", "none", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  int skin = 0, mesh = 0;
  *out = (api_shown_query){.clip_name = api_query_get(query, "clip")};
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

void api_shown_print(const api_shown *shown, api_text *text) {
  const api_shown_query *query = &shown->query;
  api_text_add(text, query->is_bare ? "&meshes=none" : "&meshes=all");
  api_text_add(text, query->is_baked ? "&skin=bake" : "&skin=keep");
  if (!query->has_clip) return;
  char clip[80];
  snprintf(clip, sizeof clip, "&clip=%s/%u&times=", shown->choice.lender, shown->choice.index);
  api_text_add(text, clip);
  api_times_print(&query->times, text);
  if (!query->reduction.is_wide) return;
  api_text_add(text, "&tolerance=");
  api_text_double(text, query->reduction.tolerance.angle);
  api_text_add(text, "/");
  api_text_double(text, query->reduction.tolerance.distance);
}

/* ---- the clip ------------------------------------------------------------------------------------ */

api_outcome api_shown_take_clip(api_call *call, const tw_model *model, bool is_stored, api_shown *shown) {
  api_outcome outcome = api_clip_find(call, model, shown->query.clip_name, -1, &shown->choice);
  if (outcome != API_DONE) return outcome;
  if (shown->choice.index == TW_NO_INDEX) return api_fail_with(call, 404, "the model has no clips");
  shown->is_stored = is_stored;
  outcome = api_clip_take(call, model, is_stored, &shown->choice, &shown->clip);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(shown->clip);
  if (clip->missing_count > 0) api_clip_warning(call, clip);
  return api_times_complete(&shown->query.times, tw_clip_duration(clip->compiled),
                            call->service->limits.max_times, &call->fault.error) == TW_OK
             ? API_DONE
             : api_fail(call);
}

/* Baked keys are held in memory: no more of them than of an upload. */
static api_outcome check_baked(api_call *call, const api_clip *clip, uint32_t track_count, uint64_t times) {
  uint64_t numbers = 0, limit = call->service->limits.max_upload / sizeof(float);
  for (uint32_t i = 0; i < track_count; i++) numbers += tw_clip_width(clip->compiled, i);
  if (times < UINT32_MAX && (numbers == 0 || times <= limit / numbers)) return API_DONE;
  return api_fail_with(call, 422, "%llu keys of %llu numbers are over the limit of %llu numbers in all",
                       (unsigned long long)times, (unsigned long long)numbers, (unsigned long long)limit);
}

/* The clip as keys at exactly the times asked for. */
static api_outcome bake_clip(api_call *call, const tw_model *model, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  const api_times *asked = &shown->query.times;
  uint32_t track_count = api_clip_keys(clip, model, &shown->choice)->track_count;
  if (check_baked(call, clip, track_count, asked->count) != API_DONE) return API_FAILED;
  uint32_t count = (uint32_t)asked->count;
  float *times = tw_arena_alloc(call->arena, count, sizeof *times);
  if (!times) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < count; i++) times[i] = api_times_get(asked, i);
  tw_status status =
      tw_clip_bake(clip->compiled, times, count, call->arena, &shown->animation, &call->fault.error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

/* The clip as it is, but for tracks that glTF does not have or that are to have fewer keys. */
static api_outcome keep_clip(api_call *call, const tw_model *model, api_shown *shown) {
  const tw_clip_keys *keys = api_clip_keys(api_entry_value(shown->clip), model, &shown->choice);
  tw_track_keys *tracks = tw_arena_alloc(call->arena, keys->track_count, sizeof *tracks);
  if (!tracks) return api_fail_without_memory(call);
  api_outcome outcome = api_reduced_take(call, model, shown->is_stored, &shown->choice, keys,
                                         &shown->query.reduction, &shown->reduced);
  if (outcome != API_DONE) return outcome;
  const api_reduced *reduced = api_entry_value(shown->reduced);
  if (keys->track_count) memcpy(tracks, keys->tracks, keys->track_count * sizeof *tracks);
  for (uint32_t i = 0; i < reduced->track_count; i++) tracks[reduced->places[i]] = reduced->tracks[i];
  shown->animation = (tw_clip_keys){.track_count = keys->track_count, .tracks = tracks};
  api_answer_headerf(&call->answer, "X-Tweend-Error", "degrees=%.6f, metres=%.9f",
                     reduced->reached.angle * DEGREES, reduced->reached.distance);
  return API_DONE;
}

void api_shown_release(api_shown *shown) {
  api_entry_release(shown->reduced);
  api_entry_release(shown->clip);
}

api_outcome api_shown_animate(api_call *call, const tw_model *model, api_shown *shown) {
  if (!shown->query.has_clip || is_moment(&shown->query)) return API_DONE;
  api_outcome outcome =
      shown->query.times.is_given ? bake_clip(call, model, shown) : keep_clip(call, model, shown);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(shown->clip);
  shown->animation.name = clip->name;
  shown->scene.clip = &shown->animation;
  return API_DONE;
}

/* ---- the model ----------------------------------------------------------------------------------- */

/* The node tree alone. */
static api_outcome strip_meshes(api_call *call, const tw_model *model, api_shown *shown) {
  tw_model *bare = api_copy_nodes(call->arena, model, 0);
  if (!bare) return api_fail_without_memory(call);
  bare->mesh_count = bare->skin_count = bare->material_count = 0;
  bare->assets = NULL;
  for (uint32_t i = 0; i < bare->node_count; i++) bare->nodes[i].mesh = bare->nodes[i].skin = TW_NO_INDEX;
  shown->scene.model = bare;
  shown->meshes = api_plan_all(bare);
  return API_DONE;
}

/* Morph weights of the nodes that the clip has such tracks of. */
static api_outcome pose_weights(api_call *call, const tw_model *model, float time, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  const tw_clip_keys *keys = api_clip_keys(clip, model, &shown->choice);
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
  shown->scene.weights = weights;
  return API_DONE;
}

/* The nodes at one time. */
static api_outcome pose_model(api_call *call, const tw_model *model, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  tw_trs *locals = tw_arena_alloc(call->arena, model->node_count, sizeof *locals);
  if (!locals) return api_fail_without_memory(call);
  float time = api_times_get(&shown->query.times, 0);
  tw_clip_pose(clip->compiled, model->nodes, model->node_count, time, locals);
  shown->scene.pose = locals;
  shown->scene.posed_by = clip->compiled;
  return pose_weights(call, model, time, shown);
}

static api_outcome bake_model(api_call *call, const tw_model *model, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  api_baked baked;
  api_outcome outcome = api_bake(call, model, clip->compiled, api_times_get(&shown->query.times, 0), &baked);
  if (outcome != API_DONE) return outcome;
  shown->scene.model = baked.model;
  shown->scene.pose = baked.pose;
  shown->scene.posed_by = clip->compiled;
  shown->meshes = baked.meshes;
  shown->moves = baked.moves;
  return API_DONE;
}

api_outcome api_shown_pose(api_call *call, const tw_model *model, api_shown *shown) {
  shown->scene.model = model;
  shown->meshes = api_plan_all(model);
  if (shown->query.is_baked) return bake_model(call, model, shown);
  api_outcome outcome = is_moment(&shown->query) ? pose_model(call, model, shown) : API_DONE;
  return outcome == API_DONE && shown->query.is_bare ? strip_meshes(call, model, shown) : outcome;
}
