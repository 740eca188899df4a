/* Surfaces: counts, glTF, OBJ, STL, PLY and 3MF of a model at rest, posed or animated; points of a mesh. */
#include "surfaces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "auto_level.h"
#include "file_name.h"
#include "handlers.h"
#include "models.h"
#include "packs.h"
#include "printability.h"
#include "service.h"
#include "surface_forms.h"

/* ---- packs --------------------------------------------------------------------------------------- */

/* Puts the packs into the scene. */
static void set_packs(api_surface_request *request) {
  const api_packs *packs = api_entry_value(request->packs);
  request->scene.content.packs = (const tw_packs *const *)packs->list;
}

api_outcome api_surface_take_packs(api_call *call, api_surface_request *request, bool is_stored) {
  if (request->query.encoding == TW_ENCODING_FLOAT || request->scene.content.model->mesh_count == 0)
    return API_DONE;
  bool is_compressed = request->query.encoding == TW_ENCODING_MESHOPT,
       is_size = request->form->is_counts || call->is_head;
  api_packs_query query = {(tw_encoding)request->query.encoding, (tw_polygons)request->query.polygons, true};
  bool is_cached = is_stored && request->scene.moves.count == 0; /* moved surfaces are the request's own */
  const char *key = is_cached ? api_surface_key_print(call, &request->query, API_KEY_PACKS, "/packs?") : NULL;
  if (is_cached && !key) return api_fail_without_memory(call);
  if (is_size) request->packs = api_packs_peek(call, &query, key);
  query.is_measured = is_compressed || !is_size;
  if (!request->packs && is_compressed && !request->form->is_counts && call->is_head) return API_DONE;
  const api_plan *plan = api_entry_value(request->plan);
  api_outcome outcome = API_DONE;
  if (!request->packs)
    outcome = api_packs_take(call, request->scene.content.model, plan, &query, key, &request->packs);
  if (outcome == API_DONE) set_packs(request);
  return outcome;
}

/* ---- stages -------------------------------------------------------------------------------------- */

/* Whether rows of a mesh hold fewer influences than its points have because the request asks for fewer. */
static bool is_cut(const api_surface_request *request, const tw_mesh *mesh) {
  return tw_surface_influences(mesh, (uint32_t)request->query.influences) < tw_surface_influences(mesh, 0);
}

static bool cuts_influences(const api_surface_request *request) {
  const tw_model *model = request->scene.content.model;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    if (is_cut(request, &model->meshes[i])) return true;
  return false;
}

/* Whether the answer is a cage in a form that may have no place for all of it. */
static bool may_lose_cage(const api_surface_request *request) {
  const api_surface_query *query = &request->query;
  bool is_gltf = request->form->is_gltf && !request->form->is_counts;
  return is_gltf && query->level == 0 && !query->limit && !query->tagged;
}

/* Whether a light call may answer: no pass over all points or keys, and little JSON to print. */
static bool is_light(const api_call *call, const api_surface_request *request) {
  enum { LIGHT_PARTS = 64, LIGHT_CORNERS = 1 << 18, LIGHT_CHANGES = 1 << 15 };
  const api_plan *plan = api_entry_value(request->plan);
  const tw_model *model = request->scene.content.model;
  bool is_gltf = request->form->is_gltf && !request->form->is_counts;
  bool needs_no_pass = atomic_load(&plan->is_warm) || !is_gltf || call->is_head ||
                       request->query.encoding != TW_ENCODING_FLOAT;
  uint64_t corners = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) corners += model->meshes[i].corner_count;
  bool is_unknown = may_lose_cage(request) && atomic_load(&plan->changes[request->query.polygons]) == 0;
  if (!is_gltf && corners > LIGHT_CORNERS) return false; /* flat forms look at all */
  if (is_unknown && corners > LIGHT_CHANGES) return false;
  if ((api_is_printed(request) || request->query.with_shells) && !api_shells_are_light(plan)) return false;
  return needs_no_pass && request->query.choices.count == 0 && !cuts_influences(request) &&
         model->mesh_count + (uint64_t)model->node_count <= LIGHT_PARTS;
}

/* Whether the model has only points, as scanners make. Points and lines of a glTF file are answered
 * unchanged. */
static bool lacks_faces(const tw_model *model) {
  uint32_t mesh = 0;
  while (mesh < model->mesh_count && model->meshes[mesh].face_count == 0 && !model->meshes[mesh].loose)
    mesh++;
  return model->mesh_count > 0 && mesh == model->mesh_count && model->clip_count == 0;
}

api_outcome api_surface_prepare(api_call *call, api_surface_request *request, bool is_stored) {
  const tw_model *model = api_entry_value(request->model);
  api_surface_scene *scene = &request->scene;
  if (lacks_faces(model)) return api_fail_with(call, 422, "the model has no faces: it has no surface");
  api_outcome outcome = api_scene_take_clips(call, model, is_stored, scene);
  if (outcome != API_DONE) return outcome;
  bool is_posed = request->query.times.is_given || request->query.skin == API_SKIN_BAKE;
  if (call->effort != API_HEAVY && is_posed) return API_NEEDS_THREAD;
  outcome = api_scene_pose(call, model, scene);
  scene->content.polygons = (tw_polygons)request->query.polygons;
  scene->content.is_without_details = !request->query.details;
  if (outcome == API_DONE && request->query.auto_level.is_on) {
    outcome = api_level_choose(call, scene);
    api_surface_query_keep_cage(request->form, &request->query);
  }
  if (outcome != API_DONE) return outcome;
  bool is_cached = is_stored && scene->meshes.count > 0;
  outcome = api_plan_take(call, &scene->meshes, &scene->moves, is_cached, &request->query, &request->plan);
  if (outcome != API_DONE) return outcome;
  const api_plan *plan = api_entry_value(request->plan);
  scene->content.surfaces = (const tw_surface *const *)plan->surfaces;
  return API_DONE;
}

static api_outcome validate(api_call *call, const api_surface_request *request) {
  const char *text = api_surface_key_print(call, &request->query, API_KEY_ANSWER, NULL);
  char representation[20];
  snprintf(representation, sizeof representation, "surface.%s", call->offer->extension);
  if (!text) return api_fail_without_memory(call);
  return (request->scene.lacks_clips ? api_validate_partial : api_validate)(call, representation, text);
}

static api_outcome warn_of_hard_edges(api_call *call, const api_surface_request *request) {
  const api_plan *plan = api_entry_value(request->plan);
  if (plan->hard.edges == 0 && plan->hard.corners == 0) return API_DONE;
  const char *sentence = api_hard_warning(call, plan->hard);
  if (!sentence) return api_fail_without_memory(call);
  api_call_warn(call, &sentence, 1);
  return API_DONE;
}

/* Warns of n-gons that no fan shows as they are: they are split. A cage says so in its tags, so that they are
 * whole when it is read again. */
static api_outcome warn_of_polygons(api_call *call, const api_surface_request *request) {
  const tw_scene *scene = &request->scene.content;
  uint64_t count = 0;
  if (!request->form->is_gltf || request->query.polygons != TW_POLYGONS_NGON) return API_DONE;
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    const tw_face_cut *cuts = tw_surface_get_cuts(scene->surfaces[i]);
    for (uint32_t k = 0; k < tw_surface_cut_count(scene->surfaces[i]); k++) count += cuts[k].fan_count == 0;
  }
  if (count == 0) return API_DONE;
  tw_text text = {0};
  tw_text_count(&text, count);
  tw_text_add(&text, count > 1 ? " concave polygons are no fans" : " concave polygon is no fan");
  tw_text_add(&text,
              request->query.tagged
                  ? " from any corner: split into triangles, which are joined when the file is uploaded"
                  : " from any corner: split into triangles");
  return api_call_warn_text(call, &text);
}

/* What extras.tweend says of a cage, and nothing else in a glTF. */
enum {
  CREASES,
  CORNERS,
  HOLES,
  DETAILS,
  GROUPS,
  EQUAL_VALUES,
  SHARED_VALUES,
  EQUAL_POINTS,
  SHARED_POINTS,
  RULES,
  CAGE_PARTS
};

/* Finds what a reader of triangles makes of the cages, once for a plan. out: flags, API_CHANGES_KNOWN and
 * what follows. TW_NO_MEMORY, TW_CANCELLED. */
static tw_status find_changes(const tw_model *model, api_plan *plan, tw_polygons polygons, int *out) {
  tw_status status = TW_OK;
  *out = atomic_load(&plan->changes[polygons]);
  if (*out & API_CHANGES_KNOWN) return TW_OK;
  *out = API_CHANGES_KNOWN;
  for (uint32_t i = 0; i < model->mesh_count && status == TW_OK; i++) {
    tw_cage_changes found;
    status = tw_find_cage_changes(plan->surfaces[i], &model->meshes[i], polygons, &found);
    *out |= (found.joins_values ? API_JOINS_VALUES : 0) | (found.parts_values ? API_PARTS_VALUES : 0) |
            (found.joins_points ? API_JOINS_POINTS : 0) | (found.parts_points ? API_PARTS_POINTS : 0);
  }
  if (status == TW_OK) atomic_store(&plan->changes[polygons], *out);
  return status;
}

/* Finds which parts the cages have. TW_NO_MEMORY. */
static tw_status find_cage_parts(const api_surface_request *request, bool *has) {
  const tw_model *model = request->scene.content.model;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_mesh *mesh = &model->meshes[i];
    has[CREASES] |= mesh->crease_count > 0;
    has[CORNERS] |= mesh->sharp_point_count > 0;
    has[HOLES] |= mesh->hole_count > 0;
    has[DETAILS] |= mesh->detail_count > 0 && request->query.details;
    has[GROUPS] |= mesh->face_groups != NULL;
    has[RULES] |= mesh->tag_boundary != TW_TAG_UNSET || mesh->tag_uv != TW_TAG_UNSET ||
                  mesh->tag_creasing != TW_TAG_UNSET || mesh->tag_triangles != TW_TAG_UNSET;
  }
  int changes;
  tw_polygons polygons = (tw_polygons)request->query.polygons;
  tw_status status = find_changes(model, api_entry_value(request->plan), polygons, &changes);
  has[EQUAL_VALUES] = changes & API_JOINS_VALUES;
  has[SHARED_VALUES] = changes & API_PARTS_VALUES;
  has[EQUAL_POINTS] = changes & API_JOINS_POINTS;
  has[SHARED_POINTS] = changes & API_PARTS_POINTS;
  return status;
}

/* Warns of the parts of a cage that triangles, or a packed encoding, do not hold: an upload of the answer is
 * another cage. Triangles do hold the hard edges that were found by normals: their own normals show them. */
static api_outcome warn_of_lost_cage(api_call *call, const api_surface_request *request) {
  static const char *const names[CAGE_PARTS] = {"creases",
                                                "corners",
                                                "holes",
                                                "details",
                                                "groups",
                                                "seams between equal values",
                                                "values that no edge joins",
                                                "points apart at one place",
                                                "points that no edge joins",
                                                "rules"};
  const api_plan *plan = api_entry_value(request->plan);
  bool is_ngon = request->query.polygons == TW_POLYGONS_NGON;
  bool is_packed = request->query.encoding != TW_ENCODING_FLOAT;
  if (!may_lose_cage(request)) return API_DONE;
  bool has[CAGE_PARTS] = {
      [CREASES] = is_ngon && plan->hard.edges > 0, [CORNERS] = is_ngon && plan->hard.corners > 0};
  if (find_cage_parts(request, has) != TW_OK)
    return tw_work_status(&call->fault.error) == TW_OK ? api_fail_without_memory(call) : api_fail(call);
  tw_text text = {0};
  tw_text_add(&text, is_ngon ? "" : "polygons=ngon");
  tw_text_add(&text, is_ngon || !is_packed ? "" : " with ");
  tw_text_add(&text, is_packed ? "encoding=float" : "");
  tw_text_add(&text, " alone keeps what the cage has besides ");
  tw_text_add(&text, is_ngon ? "polygons" : "triangles");
  size_t begin = text.size;
  for (int part = 0; part < CAGE_PARTS; part++) {
    if (!has[part]) continue;
    tw_text_add(&text, text.size > begin ? ", " : ": ");
    tw_text_add(&text, names[part]);
  }
  if (text.size > begin || text.failed) return api_call_warn_text(call, &text);
  tw_text_deinit(&text);
  return API_DONE;
}

/* The points of a mesh that follow more joints than `most`. */
static uint64_t count_richer_points(const tw_mesh *mesh, uint32_t most) {
  uint64_t points = 0;
  uint32_t width = mesh->skin.width;
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    uint32_t joints = 0;
    for (uint32_t k = 0; k < width; k++) joints += mesh->skin.weights[(size_t)width * p + k] > 0;
    points += joints > most;
  }
  return points;
}

/* Tells what influences=4 takes away. */
static api_outcome warn_of_influences(api_call *call, const api_surface_request *request) {
  const tw_model *model = request->scene.content.model;
  uint32_t most = (uint32_t)request->query.influences;
  uint64_t points = 0;
  if (!request->form->is_gltf) return API_DONE;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    if (is_cut(request, &model->meshes[i])) points += count_richer_points(&model->meshes[i], most);
  if (points == 0) return API_DONE;
  tw_text text = {0};
  tw_text_add(&text, "influences=4 keeps the four heaviest joints of a point: ");
  tw_text_count(&text, points);
  tw_text_add(&text, points > 1 ? " points of the file follow more" : " point of the file follows more");
  return api_call_warn_text(call, &text);
}

/* Tells of points and lines that skin=bake leaves where they are, and of what names meshes that it renumbers.
 */
static void warn_of_baking(api_call *call, const api_surface_request *request) {
  static const char *const resting =
      "skin=bake moves faces alone: points and lines rest, without morph targets and joints";
  static const char *const renumbered = "skin=bake gives meshes other numbers and nodes: what VRM says of "
                                        "those of the file (expressions, views in "
                                        "first person) fits no more";
  const tw_model *model = api_entry_value(request->model);
  bool rests = false;
  if (!request->form->is_gltf || request->query.skin != API_SKIN_BAKE) return;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_mesh *mesh = &model->meshes[i];
    rests |= mesh->loose && (mesh->loose_has_joints || mesh->loose_has_targets);
  }
  if (rests) api_call_warn(call, &resting, 1);
  if (model->humanoid && model->mesh_count > 0) api_call_warn(call, &renumbered, 1);
}

/* Tells of tracks that meshes=none leaves out with what they move. */
static void warn_of_lost_tracks(api_call *call, const api_surface_request *request) {
  static const char *const sentence =
      "meshes=none keeps tracks that move nodes: those of morph weights, materials and the like are left out";
  const tw_scene *scene = &request->scene.content;
  bool is_lost = false;
  if (request->query.meshes != API_MESHES_NONE) return;
  for (uint32_t i = 0; i < scene->clip_count; i++) {
    is_lost |= scene->clips[i].loose != NULL;
    for (uint32_t k = 0; k < scene->clips[i].track_count; k++)
      is_lost |= scene->clips[i].tracks[k].path == TW_WEIGHTS;
  }
  if (is_lost) api_call_warn(call, &sentence, 1);
}

/* Tells of an answer in a form of faces alone to which no node gives one. */
static api_outcome warn_of_emptiness(api_call *call, const api_surface_request *request) {
  const tw_scene *scene = &request->scene.content;
  const tw_model *model = scene->model;
  if (!request->form->still) return API_DONE;
  for (uint32_t n = 0; n < model->node_count; n++)
    if (tw_node_times_shown(model, n) > 0 &&
        tw_surface_get_counts(scene->surfaces[model->nodes[n].mesh])->faces > 0)
      return API_DONE;
  tw_text text = {0};
  tw_text_add(&text, "surface.");
  tw_text_add(&text, call->offer->extension);
  tw_text_add(&text,
              model->mesh_count > 0 ? " is empty: no node shows a face" : " is empty: the model has no mesh");
  return api_call_warn_text(call, &text);
}

/* Tells of parameters that this form of the answer has no use for. */
static api_outcome warn_of_idle(api_call *call, const api_surface_request *request) {
  if (!request->query.idle) return API_DONE;
  tw_text text = {0};
  tw_text_add(&text, "surface.");
  tw_text_add(&text, call->offer->extension);
  tw_text_add(&text, " is the same without ");
  tw_text_add(&text, request->query.idle);
  return api_call_warn_text(call, &text);
}

/* ---- requests ------------------------------------------------------------------------------------ */

/* From the model to the answer. The caller releases the request unless the answer's body took it over. */
static api_outcome answer_surface(api_call *call, api_surface_request *request, bool is_stored) {
  api_surface_settle(&request->query, api_entry_value(request->model));
  api_outcome outcome = api_surface_prepare(call, request, is_stored);
  if (outcome == API_DONE && is_stored) {
    outcome = validate(call, request);
    if (outcome != API_CONTINUE) return outcome;
    outcome = API_DONE;
  }
  if (outcome != API_DONE) return outcome;
  if (call->effort != API_HEAVY && !is_light(call, request)) return API_NEEDS_THREAD;
  outcome = api_surface_take_packs(call, request, is_stored);
  if (outcome != API_DONE) return outcome;
  const tw_model *model = api_entry_value(request->model);
  const api_surface_form *form = request->form;
  if (form->is_gltf) outcome = api_scene_animate(call, model, &request->scene);
  if (outcome == API_DONE) outcome = warn_of_hard_edges(call, request);
  if (outcome == API_DONE) outcome = warn_of_polygons(call, request);
  if (outcome == API_DONE) outcome = warn_of_lost_cage(call, request);
  if (outcome == API_DONE) outcome = warn_of_influences(call, request);
  if (outcome == API_DONE) warn_of_baking(call, request);
  if (outcome == API_DONE) warn_of_lost_tracks(call, request);
  if (outcome == API_DONE) outcome = warn_of_emptiness(call, request);
  if (outcome == API_DONE && form->open) outcome = form->open(call, request);
  if (outcome == API_DONE) outcome = warn_of_idle(call, request);
  /* The description lists the model's: the header, which shows one, shows the answer's own. */
  api_scene_warn(call, model, &request->scene);
  if (outcome == API_DONE)
    outcome = api_file_name_suggest(call, api_model_name(model), call->offer->extension);
  return outcome == API_DONE ? api_surface_reply(call, request) : outcome;
}

static api_outcome answer_and_release(api_call *call, api_surface_request *request, bool is_stored) {
  api_outcome outcome = answer_surface(call, request, is_stored);
  bool is_taken_over = outcome == API_DONE && call->answer.body.read;
  if (!is_taken_over) api_surface_release(request);
  return outcome;
}

api_surface_request *api_surface_begin(api_call *call, const api_surface_form *form) {
  api_surface_request *request = tw_arena_alloc(call->arena, 1, sizeof *request);
  if (!request) return NULL;
  request->form = form;
  request->scene.query = &request->query;
  return request;
}

/* Reads the parameters, without the model. NULL: the fault says why. */
static api_surface_request *read_request(api_call *call) {
  api_surface_request *request =
      api_surface_begin(call, api_surface_form_at((size_t)(call->offer - call->route->offers)));
  if (!request) api_fail_without_memory(call);
  if (!request || api_surface_query_read(call, &request->query) != API_DONE) return NULL;
  api_outcome outcome = api_surface_query_complete(call, request->form, &request->query);
  return outcome == API_DONE ? request : NULL;
}

api_outcome api_get_surface(api_call *call) {
  api_surface_request *request = read_request(call);
  if (!request) return API_FAILED;
  api_outcome outcome = api_model_take(call, call->id, &request->query.reading, &request->model);
  return outcome == API_DONE ? answer_and_release(call, request, true) : outcome;
}

api_outcome api_post_surface(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_surface_request *request = read_request(call);
  if (!request) return API_FAILED;
  api_outcome outcome = api_model_of_body(call, &request->query.reading, &request->model);
  return outcome == API_DONE ? answer_and_release(call, request, false) : outcome;
}
