/* Surfaces: counts, glTF, OBJ, STL, PLY and 3MF of a model at rest, posed or animated; points of a mesh. */
#include "file_name.h"
#include "handlers.h"
#include "models.h"
#include "obj_losses.h"
#include "packs.h"
#include "printability.h"
#include "service.h"
#include "surface_request.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void release(api_surface_request *request) {
  tw_gltf_stream_destroy(request->gltf);
  tw_obj_stream_destroy(request->obj);
  tw_flat_stream_destroy(request->flat);
  api_package_destroy(request->package);
  api_scene_release(&request->scene);
  api_entry_release(request->packs);
  api_entry_release(request->plan);
  api_entry_release(request->model);
}

/* ---- packs --------------------------------------------------------------------------------------- */

/* Puts the packs into the scene. */
static void set_packs(api_surface_request *request) {
  const api_packs *packs = api_entry_value(request->packs);
  request->scene.content.packs = (const tw_packs *const *)packs->list;
}

/* A body needs measured packs, as does the size of a compressed answer; for the size of a quantized one
 * unmeasured packs suffice. HEAD of a compressed answer uses them if they are cached, and is answered without
 * a size else. */
static api_outcome take_packs(api_call *call, api_surface_request *request, bool is_stored) {
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

/* Whether the answer's size can be told: that of a compressed answer only by its packs, which HEAD may
 * lack. */
static bool knows_size(const api_surface_request *request) {
  return request->query.encoding != TW_ENCODING_MESHOPT || request->scene.content.packs ||
         request->scene.content.model->mesh_count == 0;
}

/* ---- bytes --------------------------------------------------------------------------------------- */

static uint64_t line_size(const char *name) {
  enum { KEYWORD = 32 }; /* bytes; includes a made-up name */
  return KEYWORD + (name ? strlen(name) : 0);
}

/* A bound on the names of materials and groups, which repeat with each group of the surface. Stops soon after
 * `limit`. */
static uint64_t obj_names_bound(const tw_model *model, const tw_surface *surface, uint64_t limit) {
  uint64_t size = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface) && size <= limit; g++) {
    const tw_surface_group *group = tw_surface_get_group(surface, g);
    int32_t material = tw_model_material(model, group->material);
    size += line_size(material < 0 ? NULL : model->material_names[material]);
    size += line_size(group->names == TW_NO_INDEX ? NULL : model->group_names[group->names]);
  }
  return size;
}

/* A bound on the tags: each has three numbers of at most 17 characters. */
static uint64_t obj_tags_bound(const tw_surface *surface) {
  enum { TAG = 72 };
  const tw_surface_tags *tags = tw_surface_get_tags(surface);
  return tags ? TAG * ((uint64_t)tags->crease_count + tags->sharp_point_count) : 0;
}

/* A bound on the size of an OBJ, which is known only at its end: 17 characters a number, 25 of a point far
 * from the origin, 9 of a colour, and 11 an index, of which a corner has three. Stops soon after the limit.
 */
static tw_status predict_obj(api_call *call, const api_surface_request *request, uint64_t *size) {
  const api_plan *plan = api_entry_value(request->plan);
  const tw_model *model = request->scene.content.model;
  uint64_t limit = call->service->limits.max_output;
  uint64_t *of_mesh = tw_arena_alloc(call->arena, plan->count, sizeof *of_mesh);
  if (!of_mesh) return tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < plan->count; i++) {
    const tw_surface *surface = plan->surfaces[i];
    uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
    of_mesh[i] = rows * (3 * 25 + 3 * 9 + 5 * 17) + tw_surface_get_counts(surface)->corners * 3 * 11 +
                 obj_names_bound(model, surface, limit) + obj_tags_bound(surface);
  }
  *size = 0;
  for (uint32_t n = 0; n < model->node_count && *size <= limit; n++) {
    const tw_node *node = &model->nodes[n];
    if (node->mesh == TW_NO_INDEX || node->is_hidden) continue;
    const char *name = model->meshes[node->mesh].name;
    *size += line_size(name ? name : node->name) + of_mesh[node->mesh];
  }
  return TW_OK;
}

/* Checks the size of the answer; status TW_LIMIT, with its error filled: the size cannot be counted. */
static api_outcome check_size(api_call *call, const api_surface_request *request, tw_status status,
                              uint64_t size) {
  uint64_t limit = call->service->limits.max_output;
  if (status != TW_OK && status != TW_LIMIT) return api_fail(call);
  if (status == TW_OK && size <= limit) return API_DONE;
  if (status == TW_LIMIT)
    api_fail(call);
  else
    api_fail_with(call, 422, "the answer would have %llu bytes, over the limit of %llu",
                  (unsigned long long)size, (unsigned long long)limit);
  const api_plan *plan = api_entry_value(request->plan);
  call->fault.is_predicted = true;
  call->fault.predicted = plan->total;
  call->fault.predicted_bytes = status == TW_OK ? size : 0;
  return API_FAILED;
}

static tw_status predict_gltf(api_call *call, const api_surface_request *request, uint64_t *size) {
  return tw_gltf_stream_predict(&request->scene.content, request->form->format, size, &call->fault.error);
}

static tw_status predict_flat(api_call *call, const api_surface_request *request, uint64_t *size) {
  (void)call;
  *size = tw_flat_stream_size(request->flat);
  return TW_OK;
}

static tw_status predict_package(api_call *call, const api_surface_request *request, uint64_t *size) {
  (void)call;
  *size = api_package_bound(request->package);
  return TW_OK;
}

/* The size of the answer, or a bound where it is known only at the end; checked. */
static api_outcome predict(api_call *call, const api_surface_request *request, uint64_t *size) {
  *size = API_SIZE_UNKNOWN;
  if (!knows_size(request)) return API_DONE;
  tw_status status = request->form->predict(call, request, size);
  return check_size(call, request, status, *size);
}

/* The number of faces before the position, as if all took equally many bytes. */
static uint64_t faces_before(const api_surface_request *request) {
  const api_plan *plan = api_entry_value(request->plan);
  double share = request->size > 0 ? (double)request->position / (double)request->size : 0;
  return (uint64_t)((double)plan->total.faces * share);
}

/* Adds the faces read since the last call to the service's count. */
static void count_faces(api_surface_request *request) {
  uint64_t before = request->faces;
  request->faces = faces_before(request);
  atomic_fetch_add(&request->service->faces, request->faces - before);
}

/* Without a stream this answers HEAD, for which nothing is computed. */
static int64_t read_gltf(void *context, uint8_t *out, size_t capacity) {
  api_surface_request *request = context;
  if (!request->gltf) return -1;
  if (capacity > request->end - request->position) capacity = (size_t)(request->end - request->position);
  if (capacity == 0) return 0;
  size_t count = tw_gltf_stream_read(request->gltf, out, capacity);
  request->position += count;
  count_faces(request);
  return count > 0 ? (int64_t)count : -1; /* a stream ends early only without memory */
}

static int64_t read_flat(void *context, uint8_t *out, size_t capacity) {
  api_surface_request *request = context;
  if (capacity > request->end - request->position) capacity = (size_t)(request->end - request->position);
  size_t count = tw_flat_stream_read(request->flat, out, capacity);
  request->position += count;
  count_faces(request);
  return (int64_t)count;
}

/* Counts bytes of an answer whose size is known only at the end: all faces are counted then. */
static int64_t take_chunk(api_surface_request *request, int64_t count) {
  if (count > 0) request->position += (uint64_t)count;
  if (count == 0) {
    request->size = request->position;
    count_faces(request);
  }
  return count;
}

static int64_t read_obj(void *context, uint8_t *out, size_t capacity) {
  api_surface_request *request = context;
  return take_chunk(request, (int64_t)tw_obj_stream_read(request->obj, out, capacity));
}

static int64_t read_package(void *context, uint8_t *out, size_t capacity) {
  api_surface_request *request = context;
  return take_chunk(request, api_package_read(request->package, out, capacity));
}

static void destroy_request(void *context) {
  release(context);
}

/* What a streamed answer holds besides its plan: the rows of a few patches, and a block of the host's. */
enum { STREAM_COST = 768 << 10, FLAT_STREAM_COST = 1 << 20 };

static void take_over(api_call *call, api_surface_request *request, uint64_t size,
                      int64_t (*read)(void *context, uint8_t *out, size_t capacity)) {
  call->answer.body = (api_body){size, request, read, destroy_request};
  request->service = call->service;
  call->held = call->is_head ? 0 : request->flat || request->package ? FLAT_STREAM_COST : STREAM_COST;
  if (request->package && !call->is_head) call->held += API_PACKAGE_COST;
  if (request->packs && !call->is_head) call->held += api_packs_reading_size(api_entry_value(request->packs));
}

/* Computes the bounds, with which a glTF begins, in this call rather than in the first read. */
static api_outcome warm(api_call *call, const api_surface_request *request) {
  tw_status status =
      api_plan_warm(api_entry_value(request->plan), &call->service->parallel, &call->fault.error);
  return api_outcome_of(call, status);
}

/* Sets what of an answer's `size` bytes is read. */
static api_outcome choose_range(api_call *call, api_surface_request *request, uint64_t size) {
  api_range range = {0, size};
  bool is_get = call->route->takes == API_TAKES_NOTHING;
  if (is_get && api_range_answer(call, size, &range) != API_CONTINUE) return API_FAILED;
  request->size = size;
  request->position = range.first;
  request->end = range.first + range.count;
  request->faces = faces_before(request);
  return API_DONE;
}

static api_outcome reply_gltf(api_call *call, api_surface_request *request) {
  tw_status status = tw_gltf_stream_create(&request->scene.content, request->form->format, &request->gltf,
                                           &call->fault.error);
  uint64_t size = status == TW_OK ? tw_gltf_stream_size(request->gltf) : 0;
  api_outcome outcome = check_size(call, request, status, size);
  if (outcome == API_DONE && !request->packs) outcome = warm(call, request);
  if (outcome == API_DONE) outcome = choose_range(call, request, size);
  if (outcome != API_DONE) return outcome;
  tw_gltf_stream_seek(request->gltf, request->position);
  take_over(call, request, request->end - request->position, read_gltf);
  return API_DONE;
}

static api_outcome reply_flat(api_call *call, api_surface_request *request) {
  uint64_t size = tw_flat_stream_size(request->flat);
  api_outcome outcome = check_size(call, request, TW_OK, size);
  if (outcome == API_DONE) outcome = choose_range(call, request, size);
  if (outcome != API_DONE) return outcome;
  tw_flat_stream_seek(request->flat, request->position);
  take_over(call, request, request->end - request->position, read_flat);
  return API_DONE;
}

static api_outcome reply_obj(api_call *call, api_surface_request *request) {
  uint64_t bound;
  api_outcome outcome = predict(call, request, &bound);
  if (outcome != API_DONE) return outcome;
  if (tw_obj_stream_create(&request->scene.content, &request->obj, &call->fault.error) != TW_OK)
    return api_fail(call);
  take_over(call, request, API_SIZE_UNKNOWN, read_obj);
  return API_DONE;
}

static api_outcome reply_package(api_call *call, api_surface_request *request) {
  uint64_t bound;
  api_outcome outcome = predict(call, request, &bound);
  if (outcome == API_DONE) take_over(call, request, API_SIZE_UNKNOWN, read_package);
  return outcome;
}

static api_outcome reply_counts(api_call *call, api_surface_request *request) {
  uint64_t size;
  api_outcome outcome = predict(call, request, &size);
  return outcome == API_DONE ? api_surface_reply_counts(call, request, size) : outcome;
}

/* Answers HEAD, for which nothing is computed. */
static api_outcome reply_head(api_call *call, api_surface_request *request) {
  uint64_t size;
  api_outcome outcome = predict(call, request, &size);
  if (outcome != API_DONE) return outcome;
  bool is_chunked = request->form->is_chunked;
  if (!is_chunked && call->coding == API_CODING_NONE)
    api_answer_header(&call->answer, "Accept-Ranges", "bytes");
  take_over(call, request, is_chunked ? API_SIZE_UNKNOWN : size, read_gltf);
  return API_DONE;
}

/* Fills the answer. Its body takes over the request; an answer without a body leaves it to the caller. */
static api_outcome reply_surface(api_call *call, api_surface_request *request) {
  const api_surface_form *form = request->form;
  if (form->is_counts) return form->reply(call, request);
  call->answer.status = 200;
  api_outcome outcome = call->is_head ? reply_head(call, request) : form->reply(call, request);
  if (outcome == API_DONE) api_answer_header(&call->answer, "Content-Type", call->offer->type);
  return outcome;
}

/* ---- stages -------------------------------------------------------------------------------------- */

/* Whether rows of a mesh hold fewer influences than its points have because the request asks for fewer. */
static bool is_cut(const api_surface_request *request, const tw_mesh *mesh) {
  return tw_mesh_influences(mesh, (uint32_t)request->query.influences) < tw_mesh_influences(mesh, 0);
}

static bool cuts_influences(const api_surface_request *request) {
  const tw_model *model = request->scene.content.model;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    if (is_cut(request, &model->meshes[i])) return true;
  return false;
}

/* Whether a light call may answer: no pass over all points or keys, and little JSON to print. */
static bool is_light(const api_call *call, const api_surface_request *request) {
  enum { LIGHT_PARTS = 64, LIGHT_CORNERS = 1 << 18 };
  const api_plan *plan = api_entry_value(request->plan);
  const tw_model *model = request->scene.content.model;
  bool is_gltf = request->form->is_gltf && !request->form->is_counts;
  bool needs_no_pass = atomic_load(&plan->is_warm) || !is_gltf || call->is_head ||
                       request->query.encoding != TW_ENCODING_FLOAT;
  uint64_t corners = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) corners += model->meshes[i].corner_count;
  if (!is_gltf && corners > LIGHT_CORNERS) return false; /* flat forms look at all corners */
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

/* Fills in the scene and takes the plan of its surfaces. */
static api_outcome prepare(api_call *call, api_surface_request *request, bool is_stored) {
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
  return text ? api_validate(call, representation, text) : api_fail_without_memory(call);
}

static api_outcome warn_of_hard_edges(api_call *call, const api_surface_request *request) {
  const api_plan *plan = api_entry_value(request->plan);
  if (plan->hard_edges == 0) return API_DONE;
  const char *sentence = api_hard_warning(call, plan->hard_edges);
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

/* ---- forms --------------------------------------------------------------------------------------- */

static api_outcome warn_of_losses(api_call *call, const api_surface_request *request) {
  bool is_hard = api_plan_of(request)->hard_edges > 0;
  return api_flat_warn_of_losses(call, &request->scene.content, request->form->lacks, is_hard);
}

static api_outcome open_flat(api_call *call, api_surface_request *request) {
  const tw_flat_options options = api_surface_flat_options(request, request->form->flat);
  double origin[3];
  tw_status status =
      tw_flat_stream_create(&request->scene.content, &options, &request->flat, &call->fault.error);
  if (status != TW_OK) return check_size(call, request, status, 0);
  api_outcome outcome =
      tw_flat_stream_origin(request->flat, origin) ? api_flat_warn_of_move(call, origin) : API_DONE;
  if (outcome == API_DONE) outcome = api_warn_of_shells(call, request);
  if (outcome == API_DONE) outcome = warn_of_losses(call, request);
  return outcome == API_DONE ? api_flat_warn_of_unit(call, &request->query.flat) : outcome;
}

static api_outcome open_package(api_call *call, api_surface_request *request) {
  const api_flat_query *query = &request->query.flat;
  uint32_t meshes = api_plan_of(request)->count;
  bool *is_open = tw_arena_alloc(call->arena, meshes, sizeof *is_open);
  if (!is_open) return api_fail_without_memory(call);
  api_outcome outcome = api_warn_of_shells(call, request);
  if (outcome != API_DONE) return outcome;
  for (uint32_t i = 0; request->solids && i < meshes; i++)
    is_open[i] = request->solids[i].closed < request->solids[i].shells;
  const tw_3mf_options options = {api_flat_scale(query), query->unit->of_3mf, is_open};
  double origin[3];
  tw_status status =
      api_package_create(&request->scene.content, &options, &request->package, &call->fault.error);
  if (status != TW_OK) return check_size(call, request, status, 0);
  if (api_package_origin(request->package, origin)) outcome = api_flat_warn_of_move(call, origin);
  return outcome == API_DONE ? warn_of_losses(call, request) : outcome;
}

/* Warns where points have one of several normals or texture coordinates. */
static api_outcome open_points(api_call *call, api_surface_request *request) {
  uint32_t mesh, lacks = 0;
  const tw_model *model = request->scene.content.model;
  tw_error *error = &call->fault.error;
  if (api_mesh_find(model, request->query.mesh, &mesh, error) != TW_OK) return api_fail(call);
  const tw_flat_options options = {.form = TW_FLAT_POINTS,
                                   .scale = 1,
                                   .has_normals = request->query.with & API_WITH_NORMALS,
                                   .has_uvs = request->query.with & API_WITH_UVS};
  if (options.has_normals) lacks |= API_LACKS_CORNER_NORMALS;
  if (options.has_uvs) lacks |= API_LACKS_CORNER_UVS;
  if (options.has_uvs && model->meshes[mesh].uv_set_count == 0)
    return api_fail_with(call, 422, "with=uvs: the mesh has no texture coordinates");
  const tw_scene *alone = api_scene_of_mesh(request, mesh, call->arena);
  if (!alone) return api_fail_without_memory(call);
  tw_status status = tw_flat_stream_create(alone, &options, &request->flat, error);
  if (status != TW_OK) return check_size(call, request, status, 0);
  return api_flat_warn_of_losses(call, alone, lacks, api_plan_of(request)->hard_edges > 0);
}

static api_outcome open_obj(api_call *call, api_surface_request *request) {
  return api_obj_losses_warn(call, api_entry_value(request->model));
}

/* In the order of the route's offers. */
enum { COUNTS_FORM = 3 };
static const api_surface_form forms[] = {
    {.is_gltf = true, .format = TW_FORMAT_GLB, .predict = predict_gltf, .reply = reply_gltf},
    {.is_gltf = true, .format = TW_FORMAT_GLTF, .predict = predict_gltf, .reply = reply_gltf},
    {.still = "OBJ",
     .has_tags = true,
     .is_chunked = true,
     .open = open_obj,
     .predict = predict_obj,
     .reply = reply_obj},
    [COUNTS_FORM] = {.is_gltf = true,
                     .unit = "m",
                     .format = TW_FORMAT_GLB,
                     .is_counts = true,
                     .predict = predict_gltf,
                     .reply = reply_counts},
    {.still = "STL",
     .unit = "mm",
     .flat = TW_FLAT_STL,
     .lacks = API_LACKS_SCENE | API_LACKS_NODES | API_LACKS_MATERIALS | API_LACKS_UVS | API_LACKS_COLORS,
     .open = open_flat,
     .predict = predict_flat,
     .reply = reply_flat},
    {.still = "PLY",
     .unit = "m",
     .flat = TW_FLAT_PLY,
     .lacks = API_LACKS_SCENE | API_LACKS_NODES | API_LACKS_MATERIALS | API_LACKS_MORE_UVS |
              API_LACKS_CORNER_COLORS | API_LACKS_CORNER_NORMALS,
     .open = open_flat,
     .predict = predict_flat,
     .reply = reply_flat},
    {.still = "3MF",
     .unit = "mm",
     .lacks = API_LACKS_SCENE | API_LACKS_TEXTURES | API_LACKS_UVS | API_LACKS_COLORS,
     .is_chunked = true,
     .open = open_package,
     .predict = predict_package,
     .reply = reply_package},
    {.is_points = true, .open = open_points, .predict = predict_flat, .reply = reply_flat},
};

/* ---- requests ------------------------------------------------------------------------------------ */

/* From the model to the answer. The caller releases the request unless the answer's body took it over. */
static api_outcome answer_surface(api_call *call, api_surface_request *request, bool is_stored) {
  /* Both ways to ask for the same have one key. */
  request->query.reading.quads =
      tw_quads_of(request->query.reading.quads, ((const tw_model *)api_entry_value(request->model))->format);
  api_outcome outcome = prepare(call, request, is_stored);
  if (outcome == API_DONE && is_stored) {
    outcome = validate(call, request);
    if (outcome != API_CONTINUE) return outcome;
    outcome = API_DONE;
  }
  if (outcome != API_DONE) return outcome;
  if (call->effort != API_HEAVY && !is_light(call, request)) return API_NEEDS_THREAD;
  outcome = take_packs(call, request, is_stored);
  if (outcome != API_DONE) return outcome;
  const tw_model *model = api_entry_value(request->model);
  const api_surface_form *form = request->form;
  if (form->is_gltf) outcome = api_scene_animate(call, model, &request->scene);
  if (outcome == API_DONE) outcome = warn_of_hard_edges(call, request);
  if (outcome == API_DONE) outcome = warn_of_polygons(call, request);
  if (outcome == API_DONE) outcome = warn_of_influences(call, request);
  if (outcome == API_DONE && form->open) outcome = form->open(call, request);
  /* The description lists the model's: the header, which shows one, shows the answer's own. */
  api_call_warn(call, model->warnings, model->warning_count);
  api_scene_warn(call, &request->scene);
  if (outcome == API_DONE)
    outcome = api_file_name_suggest(call, api_model_name(model), call->offer->extension);
  return outcome == API_DONE ? reply_surface(call, request) : outcome;
}

static api_outcome answer_and_release(api_call *call, api_surface_request *request, bool is_stored) {
  api_outcome outcome = answer_surface(call, request, is_stored);
  bool is_taken_over = outcome == API_DONE && call->answer.body.read;
  if (!is_taken_over) release(request);
  return outcome;
}

/* Lives in the call's arena. NULL without memory. */
static api_surface_request *create_request(api_call *call, const api_surface_form *form) {
  api_surface_request *request = tw_arena_alloc(call->arena, 1, sizeof *request);
  if (!request) return NULL;
  request->form = form;
  request->scene.query = &request->query;
  return request;
}

/* Reads the parameters, without the model. NULL: the fault says why. */
static api_surface_request *read_request(api_call *call) {
  api_surface_request *request = create_request(call, &forms[call->offer - call->route->offers]);
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

/* ---- levels -------------------------------------------------------------------------------------- */

/* Makes the plan of a level, and finds the size of its GLB. first: the request of the first level, whose
 * clips the others have. */
static api_outcome measure_level(api_call *call, const api_surface_request *first,
                                 api_surface_request *request, uint64_t *size) {
  tw_scene *scene = &request->scene.content;
  api_outcome outcome = api_surface_query_complete(call, request->form, &request->query);
  if (outcome == API_DONE) outcome = prepare(call, request, true);
  if (outcome == API_DONE && request->query.encoding == TW_ENCODING_QUANTIZED)
    outcome = take_packs(call, request, true);
  if (outcome == API_DONE && request == first)
    outcome = api_scene_animate(call, api_entry_value(request->model), &request->scene);
  scene->clips = first->scene.content.clips;
  scene->clip_count = first->scene.content.clip_count;
  return outcome == API_DONE ? predict(call, request, size) : outcome;
}

/* Prints a level; one that is over a limit with the reason, and *is_last. The call's fault is then taken
 * back. */
static api_outcome print_level(api_call *call, const api_surface_request *first, api_surface_request *request,
                               tw_text *text, bool *is_last) {
  uint64_t size = 0, bytes;
  api_outcome outcome = measure_level(call, first, request, &size);
  const api_fault *fault = &call->fault;
  bool is_over = outcome == API_FAILED && fault->stall == API_STALL_NONE && fault->is_predicted;
  if (outcome != API_DONE && !is_over) return outcome;
  const tw_surface_counts *counts = is_over ? &fault->predicted : &api_plan_of(request)->total;
  bytes = !is_over ? size : fault->predicted_bytes > 0 ? fault->predicted_bytes : API_SIZE_UNKNOWN;
  tw_text_element(text);
  tw_text_add(text, "{");
  api_surface_print_counts(text, request->query.level, counts, bytes);
  if (is_over) tw_member_string(text, "refused", fault->error.detail);
  tw_text_add(text, "}");
  if (is_over) call->fault = (api_fault){0};
  *is_last = is_over;
  return API_DONE;
}

/* The limits decide which levels there are. */
static api_outcome validate_levels(api_call *call, const api_surface_query *query) {
  const api_limits *limits = &call->service->limits;
  const char *parameters = api_surface_key_print(call, query, API_KEY_ANSWER, NULL);
  if (!parameters) return api_fail_without_memory(call);
  tw_text text = {0};
  tw_text_add(&text, parameters);
  const uint64_t values[] = {limits->max_level, limits->max_faces, limits->max_output};
  for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
    tw_text_add(&text, "/");
    tw_text_count(&text, values[i]);
  }
  const char *key = api_text_move(&text, call->arena);
  return key ? api_validate(call, "levels.json", key) : api_fail_without_memory(call);
}

/* The model is the caller's. */
static void release_level(api_surface_request *request) {
  request->model = NULL;
  release(request);
}

static api_outcome print_levels(api_call *call, const api_surface_query *query, api_entry *model,
                                tw_text *text) {
  api_surface_request *first = NULL;
  api_outcome outcome = API_DONE;
  bool is_last = false;
  for (uint32_t level = 0; level <= call->service->limits.max_level && !is_last; level++) {
    api_surface_request *request = create_request(call, &forms[COUNTS_FORM]);
    if (!request) outcome = api_fail_without_memory(call);
    if (!request) break;
    if (!first) first = request;
    request->query = *query;
    request->query.level = level;
    request->model = model;
    outcome = print_level(call, first, request, text, &is_last);
    is_last |= outcome != API_DONE;
    if (request != first) release_level(request);
  }
  if (first) release_level(first);
  return outcome;
}

api_outcome api_get_levels(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_surface_query query;
  api_entry *model = NULL;
  if (api_surface_query_read(call, &query) != API_DONE) return API_FAILED;
  api_outcome outcome = api_model_take(call, call->id, &query.reading, &model);
  if (outcome != API_DONE) return outcome;
  query.reading.quads = tw_quads_of(query.reading.quads, ((const tw_model *)api_entry_value(model))->format);
  outcome = validate_levels(call, &query);
  tw_text text = {0};
  tw_text_add(&text, "{\"levels\":[");
  if (outcome == API_CONTINUE) outcome = print_levels(call, &query, model, &text);
  if (outcome == API_DONE)
    outcome = api_file_name_suggest(call, api_model_name(api_entry_value(model)), "json");
  api_entry_release(model);
  tw_text_add(&text, "]}\n");
  if (outcome == API_DONE && call->answer.status == 0) return api_reply(call, &text);
  tw_text_deinit(&text);
  return outcome;
}
