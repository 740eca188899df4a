/* Posing, animating and deforming what a surface shows. */
#include "shown.h"

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
  out->tolerance = (tw_tolerance){degrees / DEGREES, metres};
  out->reduces = api_query_get(query, "tolerance") || api_query_get(query, "tolerance_m");
  return TW_OK;
}

/* Parameters that need or exclude another one. */
static tw_status check_together(const api_shown_query *query, tw_error *error) {
  if (query->is_baked && !is_moment(query))
    return tw_fail(error, TW_SYNTAX, "skin=bake goes with one time: at=T");
  if (query->is_baked && query->is_bare)
    return tw_fail(error, TW_SYNTAX, "meshes=none leaves skin=bake nothing to move");
  if (query->reduces && (!query->clip_name || query->times.is_given))
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
  if (!query->reduces) return;
  api_text_add(text, "&tolerance=");
  api_text_double(text, query->tolerance.angle);
  api_text_add(text, "/");
  api_text_double(text, query->tolerance.distance);
}

/* ---- the clip ------------------------------------------------------------------------------------ */

api_outcome api_shown_take_clip(api_call *call, const tw_model *model, bool is_stored, api_shown *shown) {
  api_outcome outcome = api_clip_find(call, model, shown->query.clip_name, -1, &shown->choice);
  if (outcome != API_DONE) return outcome;
  if (shown->choice.index == TW_NO_INDEX) return api_fail_with(call, 404, "the model has no clips");
  outcome = api_clip_take(call, model, is_stored, &shown->choice, &shown->clip);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(shown->clip);
  if (clip->missing_count > 0) api_clip_warning(call, clip);
  return api_times_complete(&shown->query.times, tw_clip_duration(clip->compiled),
                            call->service->limits.max_times, &call->fault.error) == TW_OK
             ? API_DONE
             : api_fail(call);
}

/* The clip as keys at exactly the times asked for. */
static api_outcome bake_clip(api_call *call, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  const api_times *asked = &shown->query.times;
  if (asked->count >= UINT32_MAX) return api_fail_with(call, 422, "too many times");
  uint32_t count = (uint32_t)asked->count;
  float *times = tw_arena_alloc(call->arena, count, sizeof *times);
  if (!times) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < count; i++) times[i] = api_times_get(asked, i);
  tw_status status =
      tw_clip_bake(clip->compiled, times, count, call->arena, &shown->animation, &call->fault.error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

/* Whether glTF interpolates between the keys just as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP || track->interpolation == TW_CUBICSPLINE;
}

/* Reduces the chosen tracks, whose places in `tracks` are given, in place. */
static api_outcome reduce_tracks(api_call *call, const api_shown *shown, const tw_model *model,
                                 const uint32_t *places, tw_clip_keys *chosen, tw_track_keys *tracks,
                                 tw_tolerance *reached) {
  tw_error *error = &call->fault.error;
  uint64_t limit = call->service->limits.max_times;
  tw_clip *clip;
  tw_clip_keys reduced;
  tw_status status = tw_clip_create(chosen, model->node_count, -1, &clip, error);
  if (status != TW_OK) return api_fail(call);
  status =
      tw_clip_reduce(clip, chosen, shown->query.tolerance, limit < UINT32_MAX ? (uint32_t)limit : UINT32_MAX,
                     call->arena, &reduced, reached, error);
  tw_clip_destroy(clip);
  if (status != TW_OK) return api_fail(call);
  for (uint32_t i = 0; i < reduced.track_count; i++) tracks[places[i]] = reduced.tracks[i];
  return API_DONE;
}

/* The clip as it is, but for tracks that glTF does not have or that are to have fewer keys. */
static api_outcome keep_clip(api_call *call, const tw_model *model, api_shown *shown) {
  const tw_clip_keys *keys = api_clip_keys(api_entry_value(shown->clip), model, &shown->choice);
  tw_track_keys *tracks = tw_arena_alloc(call->arena, keys->track_count, sizeof *tracks);
  tw_track_keys *chosen = tw_arena_alloc(call->arena, keys->track_count, sizeof *chosen);
  uint32_t *places = tw_arena_alloc(call->arena, keys->track_count, sizeof *places), count = 0;
  if (!tracks || !chosen || !places) return api_fail_without_memory(call);
  for (uint32_t i = 0; i < keys->track_count; i++) {
    tracks[i] = keys->tracks[i];
    if (is_native(&tracks[i]) && !shown->query.reduces) continue;
    chosen[count] = tracks[i];
    places[count++] = i;
  }
  tw_tolerance reached = {0, 0};
  tw_clip_keys subset = {.track_count = count, .tracks = chosen};
  api_outcome outcome =
      count ? reduce_tracks(call, shown, model, places, &subset, tracks, &reached) : API_DONE;
  if (outcome != API_DONE) return outcome;
  shown->animation = (tw_clip_keys){.track_count = keys->track_count, .tracks = tracks};
  api_answer_headerf(&call->answer, "X-Tweend-Error", "degrees=%.6f, metres=%.9f", reached.angle * DEGREES,
                     reached.distance);
  return API_DONE;
}

api_outcome api_shown_animate(api_call *call, const tw_model *model, api_shown *shown) {
  if (!shown->query.has_clip || is_moment(&shown->query)) return API_DONE;
  api_outcome outcome = shown->query.times.is_given ? bake_clip(call, shown) : keep_clip(call, model, shown);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(shown->clip);
  shown->animation.name = clip->name;
  shown->scene.clip = &shown->animation;
  return API_DONE;
}

/* ---- the model ----------------------------------------------------------------------------------- */

/* A copy with room for more nodes and meshes, whose arrays of both are its own. NULL without memory. */
static tw_model *copy_model(tw_arena *arena, const tw_model *model, uint32_t more) {
  tw_model *copy = tw_arena_alloc(arena, 1, sizeof *copy);
  size_t nodes = (size_t)model->node_count + more, meshes = (size_t)model->mesh_count + more;
  tw_node *node = tw_arena_alloc(arena, nodes, sizeof *node);
  tw_mesh *mesh = tw_arena_alloc(arena, meshes, sizeof *mesh);
  uint32_t *order = tw_arena_alloc(arena, nodes, sizeof *order);
  if (!copy || !node || !mesh || !order) return NULL;
  if (model->node_count) memcpy(node, model->nodes, model->node_count * sizeof *node);
  if (model->node_count) memcpy(order, model->node_order, model->node_count * sizeof *order);
  if (model->mesh_count) memcpy(mesh, model->meshes, model->mesh_count * sizeof *mesh);
  *copy = *model;
  copy->nodes = node;
  copy->meshes = mesh;
  copy->node_order = order;
  return copy;
}

/* The node tree alone. */
static api_outcome strip_meshes(api_call *call, const tw_model *model, api_shown *shown) {
  tw_model *bare = copy_model(call->arena, model, 0);
  if (!bare) return api_fail_without_memory(call);
  bare->mesh_count = bare->skin_count = bare->material_count = 0;
  bare->assets = NULL;
  for (uint32_t i = 0; i < bare->node_count; i++) bare->nodes[i].mesh = bare->nodes[i].skin = TW_NO_INDEX;
  shown->scene.model = bare;
  shown->is_own = true;
  return API_DONE;
}

/* What deforming needs beside the model. */
typedef struct deformer {
  const tw_clip *clip;
  float time;
  tw_trs *locals;  /* [nodes, and as many more as there are moved meshes] */
  float *matrices; /* [nodes][16], to the world */
  float *weights;  /* [TW_MORPH_TARGETS_MAX] */
  float *joints;   /* [joints of the largest skin][16] */
} deformer;

static bool is_skinned(const tw_model *model, const tw_node *node) {
  return node->skin != TW_NO_INDEX && model->meshes[node->mesh].skin.joints;
}

static bool is_moved(const tw_model *model, const tw_node *node) {
  return node->mesh != TW_NO_INDEX && (is_skinned(model, node) || model->meshes[node->mesh].morph_count);
}

/* How many meshes are moved; what they would take is judged before it is allocated. */
static api_outcome count_moved(api_call *call, const tw_model *model, uint32_t *out) {
  uint64_t points = 0, limit = call->service->limits.max_output / (3 * sizeof(float));
  uint32_t count = 0;
  for (uint32_t i = 0; i < model->node_count; i++) {
    if (!is_moved(model, &model->nodes[i])) continue;
    points += model->meshes[model->nodes[i].mesh].point_count;
    count++;
  }
  if (points > limit || count > UINT32_MAX - model->node_count - 1 ||
      count > UINT32_MAX - model->mesh_count - 1)
    return api_fail_with(call, 422, "skin=bake would move %llu points, over the limit of %llu",
                         (unsigned long long)points, (unsigned long long)limit);
  *out = count;
  return API_DONE;
}

static bool create_deformer(tw_arena *arena, const tw_model *model, uint32_t moved, deformer *d) {
  uint32_t joints = 0;
  for (uint32_t i = 0; i < model->skin_count; i++)
    if (model->skins[i].joint_count > joints) joints = model->skins[i].joint_count;
  d->locals = tw_arena_alloc(arena, (size_t)model->node_count + moved, sizeof *d->locals);
  d->matrices = tw_arena_alloc(arena, model->node_count, 16 * sizeof *d->matrices);
  d->weights = tw_arena_alloc(arena, TW_MORPH_TARGETS_MAX, sizeof *d->weights);
  d->joints = tw_arena_alloc(arena, joints, 16 * sizeof *d->joints);
  return d->locals && d->matrices && d->weights && d->joints;
}

static void pose_nodes(const tw_model *model, deformer *d) {
  tw_clip_pose(d->clip, model->nodes, model->node_count, d->time, d->locals);
  tw_pose_locals(d->clip, model->nodes, model->node_count, d->locals, d->matrices);
  tw_pose_world(model->nodes, model->node_order, model->node_count, d->matrices, d->matrices);
}

/* The node's mesh where weights and joints put it, as a mesh without either. */
static tw_status deform_mesh(tw_arena *arena, const tw_model *model, const deformer *d, uint32_t index,
                             tw_mesh *out, tw_error *error) {
  const tw_node *node = &model->nodes[index];
  const tw_mesh *mesh = &model->meshes[node->mesh];
  uint32_t track = tw_clip_find(d->clip, index, TW_WEIGHTS), joint_count = 0;
  bool has_weights = track != TW_NO_INDEX && tw_clip_width(d->clip, track) == mesh->morph_count;
  float *positions = tw_arena_alloc(arena, mesh->point_count, 3 * sizeof *positions);
  if (!positions) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (has_weights) tw_clip_sample(d->clip, track, &d->time, 1, d->weights);
  if (is_skinned(model, node)) {
    tw_skin_matrices(&model->skins[node->skin], d->matrices, d->joints);
    joint_count = model->skins[node->skin].joint_count;
  }
  *out = *mesh;
  out->positions = positions;
  out->skin = (tw_skin_weights){0};
  out->morph_count = 0;
  out->morphs = NULL;
  out->morph_weights = NULL;
  return tw_mesh_deform(mesh, has_weights ? d->weights : NULL, joint_count ? d->joints : NULL, joint_count,
                        positions, error);
}

/* Gives a moved mesh to its node, or, as joints lead to the world, to a new root in the node's place. */
static void hang_mesh(tw_model *baked, uint32_t index, bool is_world, tw_trs *locals) {
  tw_node *node = &baked->nodes[index];
  node->skin = TW_NO_INDEX;
  node->mesh = baked->mesh_count++;
  if (!is_world) return;
  uint32_t added = baked->node_count++;
  baked->nodes[added] = (tw_node){.name = node->name,
                                  .parent = TW_NO_INDEX,
                                  .mesh = node->mesh,
                                  .skin = TW_NO_INDEX,
                                  .rest = TW_TRS_IDENTITY};
  baked->node_order[added] = added;
  locals[added] = TW_TRS_IDENTITY;
  node->mesh = TW_NO_INDEX;
}

/* Leaves out the meshes that only moved nodes have shown. False without memory. */
static bool drop_moved_meshes(tw_arena *arena, const tw_model *model, tw_model *baked) {
  bool *drops = tw_arena_alloc(arena, baked->mesh_count, sizeof *drops);
  uint32_t *numbers = tw_arena_alloc(arena, baked->mesh_count, sizeof *numbers), count = 0;
  if (!drops || !numbers) return false;
  for (uint32_t i = 0; i < model->node_count; i++)
    if (is_moved(model, &model->nodes[i])) drops[model->nodes[i].mesh] = true;
  for (uint32_t i = 0; i < baked->node_count; i++)
    if (baked->nodes[i].mesh != TW_NO_INDEX) drops[baked->nodes[i].mesh] = false;
  for (uint32_t i = 0; i < baked->mesh_count; i++) {
    if (drops[i]) continue;
    numbers[i] = count;
    baked->meshes[count++] = baked->meshes[i];
  }
  for (uint32_t i = 0; i < baked->node_count; i++)
    if (baked->nodes[i].mesh != TW_NO_INDEX) baked->nodes[i].mesh = numbers[baked->nodes[i].mesh];
  baked->mesh_count = count;
  return true;
}

/* Moves every skinned or morphed mesh to the pose, one copy for each node that shows it. */
static api_outcome bake_skins(api_call *call, const tw_model *model, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  deformer d = {.clip = clip->compiled, .time = api_times_get(&shown->query.times, 0)};
  uint32_t moved = 0;
  api_outcome outcome = count_moved(call, model, &moved);
  if (outcome != API_DONE) return outcome;
  tw_model *baked = copy_model(call->arena, model, moved);
  if (!baked || !create_deformer(call->arena, model, moved, &d)) return api_fail_without_memory(call);
  pose_nodes(model, &d);
  for (uint32_t i = 0; i < model->node_count; i++) {
    if (!is_moved(model, &model->nodes[i])) continue;
    if (deform_mesh(call->arena, model, &d, i, &baked->meshes[baked->mesh_count], &call->fault.error) !=
        TW_OK)
      return api_fail(call);
    hang_mesh(baked, i, is_skinned(model, &model->nodes[i]), d.locals);
  }
  if (!drop_moved_meshes(call->arena, model, baked)) return api_fail_without_memory(call);
  baked->skin_count = 0;
  shown->scene.model = baked;
  shown->scene.pose = d.locals;
  shown->scene.posed_by = d.clip;
  shown->is_own = moved > 0;
  return API_DONE;
}

/* The nodes at one time. */
static api_outcome pose_model(api_call *call, const tw_model *model, api_shown *shown) {
  const api_clip *clip = api_entry_value(shown->clip);
  tw_trs *locals = tw_arena_alloc(call->arena, model->node_count, sizeof *locals);
  if (!locals) return api_fail_without_memory(call);
  tw_clip_pose(clip->compiled, model->nodes, model->node_count, api_times_get(&shown->query.times, 0),
               locals);
  shown->scene.pose = locals;
  shown->scene.posed_by = clip->compiled;
  return API_DONE;
}

api_outcome api_shown_pose(api_call *call, const tw_model *model, api_shown *shown) {
  shown->scene.model = model;
  if (shown->query.is_baked) return bake_skins(call, model, shown);
  api_outcome outcome = is_moment(&shown->query) ? pose_model(call, model, shown) : API_DONE;
  if (outcome == API_DONE && shown->query.is_bare) outcome = strip_meshes(call, model, shown);
  return outcome;
}
