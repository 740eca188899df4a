/* The forms of a surface's answer: how each is opened, how many bytes it has, and how it is read. */
#include "surface_forms.h"

#include <stdlib.h>

#include "handlers.h"
#include "models.h"
#include "obj_answer.h"
#include "packs.h"
#include "printability.h"
#include "service.h"

void api_surface_release(api_surface_request *request) {
  tw_gltf_stream_destroy(request->gltf);
  tw_obj_stream_destroy(request->obj);
  tw_flat_stream_destroy(request->flat);
  api_package_destroy(request->package);
  api_scene_release(&request->scene);
  api_entry_release(request->packs);
  api_entry_release(request->plan);
  api_entry_release(request->model);
}

/* ---- bytes --------------------------------------------------------------------------------------- */

/* Whether the answer's size can be told: that of a compressed answer only by its packs, which HEAD may
 * lack. */
static bool knows_size(const api_surface_request *request) {
  return request->query.encoding != TW_ENCODING_MESHOPT || request->scene.content.packs ||
         request->scene.content.model->mesh_count == 0;
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

static tw_status predict_obj(api_call *call, const api_surface_request *request, uint64_t *size) {
  return api_obj_bound(call, &request->scene.content, size);
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

api_outcome api_surface_predict(api_call *call, const api_surface_request *request, uint64_t *size) {
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
  api_surface_release(context);
}

/* What a streamed answer holds besides its plan: the rows of a few patches, and a block of the host's. */
enum { STREAM_COST = 768 << 10, FLAT_STREAM_COST = 1 << 20 };

static void take_over(api_call *call, api_surface_request *request, uint64_t size,
                      int64_t (*read)(void *context, uint8_t *out, size_t capacity)) {
  call->answer.body = (api_body){size, request, read, destroy_request, false};
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
  take_over(call, request, API_SIZE_UNKNOWN, read_obj);
  return API_DONE;
}

static api_outcome reply_package(api_call *call, api_surface_request *request) {
  uint64_t bound;
  api_outcome outcome = api_surface_predict(call, request, &bound);
  if (outcome == API_DONE) take_over(call, request, API_SIZE_UNKNOWN, read_package);
  return outcome;
}

static api_outcome reply_counts(api_call *call, api_surface_request *request) {
  uint64_t size;
  api_outcome outcome = api_surface_predict(call, request, &size);
  return outcome == API_DONE ? api_surface_reply_counts(call, request, size) : outcome;
}

/* Answers HEAD, for which nothing is computed. */
static api_outcome reply_head(api_call *call, api_surface_request *request) {
  uint64_t size;
  api_outcome outcome = api_surface_predict(call, request, &size);
  if (outcome != API_DONE) return outcome;
  bool is_chunked = request->form->is_chunked;
  if (!is_chunked && call->coding == API_CODING_NONE)
    api_answer_header(&call->answer, "Accept-Ranges", "bytes");
  take_over(call, request, is_chunked ? API_SIZE_UNKNOWN : size, read_gltf);
  return API_DONE;
}

api_outcome api_surface_reply(api_call *call, api_surface_request *request) {
  const api_surface_form *form = request->form;
  if (form->is_counts) return form->reply(call, request);
  call->answer.status = 200;
  api_outcome outcome = call->is_head ? reply_head(call, request) : form->reply(call, request);
  if (outcome == API_DONE) api_answer_header(&call->answer, "Content-Type", call->offer->type);
  return outcome;
}

/* ---- opening ------------------------------------------------------------------------------------- */

static api_outcome warn_of_losses(api_call *call, const api_surface_request *request) {
  bool is_hard = api_plan_of(request)->hard.edges > 0;
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
  if (outcome == API_DONE) outcome = api_flat_warn_of_far(call, tw_flat_stream_far_count(request->flat));
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
  return api_flat_warn_of_losses(call, alone, lacks, api_plan_of(request)->hard.edges > 0);
}

/* The stream's size is checked first: it lists all instances. */
static api_outcome open_obj(api_call *call, api_surface_request *request) {
  uint64_t bound;
  api_outcome outcome = api_surface_predict(call, request, &bound);
  if (outcome != API_DONE) return outcome;
  if (tw_obj_stream_create(&request->scene.content, &request->obj, &call->fault.error) != TW_OK)
    return api_fail(call);
  return api_obj_warn_of_losses(call, &request->scene.content);
}

/* ---- the table ----------------------------------------------------------------------------------- */

/* A form warns of parameters whose values it cannot follow, these and those that only glTF has a use for
 * (surface_query.c). Those that would change what its numbers mean are refused, see
 * api_surface_query_complete. */
static const api_idle of_obj[] = {{.name = "polygons", .own = "ngon"}, {.name = "skin", .own = "bake"}, {0}};
static const api_idle of_counts[] = {{.name = "scale", .own = "1", .unless = "shells", .says = "true"}, {0}};
static const api_idle of_triangles[] = {{.name = "polygons", .own = "triangles"},
                                        {.name = "normals", .own = "auto"},
                                        {.name = "uv", .own = "corners-only"},
                                        {.name = "skin", .own = "bake"},
                                        {0}};
static const api_idle of_ply[] = {{.name = "skin", .own = "bake"}, {0}};
static const api_idle of_points[] = {{.name = "polygons", .own = "triangles"},
                                     {.name = "normals", .own = "none", .unless = "with", .says = "normals"},
                                     {.name = "uv", .own = "corners-only", .unless = "with", .says = "uvs"},
                                     {0}};

static const api_surface_form forms[API_SURFACE_FORMS] = {
    [API_SURFACE_GLB] = {.is_gltf = true,
                         .format = TW_FORMAT_GLB,
                         .predict = predict_gltf,
                         .reply = reply_gltf},
    [API_SURFACE_GLTF] = {.is_gltf = true,
                          .format = TW_FORMAT_GLTF,
                          .predict = predict_gltf,
                          .reply = reply_gltf},
    [API_SURFACE_OBJ] = {.still = "OBJ",
                         .has_tags = true,
                         .is_chunked = true,
                         .open = open_obj,
                         .idle = of_obj,
                         .predict = predict_obj,
                         .reply = reply_obj},
    [API_SURFACE_COUNTS] = {.is_gltf = true,
                            .unit = "m",
                            .format = TW_FORMAT_GLB,
                            .idle = of_counts,
                            .is_counts = true,
                            .predict = predict_gltf,
                            .reply = reply_counts},
    [API_SURFACE_STL] = {.still = "STL",
                         .unit = "mm",
                         .flat = TW_FLAT_STL,
                         .lacks = API_LACKS_SCENE | API_LACKS_NODES | API_LACKS_MATERIALS | API_LACKS_UVS |
                                  API_LACKS_COLORS,
                         .open = open_flat,
                         .idle = of_triangles,
                         .predict = predict_flat,
                         .reply = reply_flat},
    [API_SURFACE_PLY] = {.still = "PLY",
                         .unit = "m",
                         .flat = TW_FLAT_PLY,
                         .lacks = API_LACKS_SCENE | API_LACKS_NODES | API_LACKS_MATERIALS |
                                  API_LACKS_MORE_UVS | API_LACKS_CORNER_COLORS | API_LACKS_CORNER_NORMALS |
                                  API_LACKS_TRANSFORMS,
                         .open = open_flat,
                         .idle = of_ply,
                         .predict = predict_flat,
                         .reply = reply_flat},
    [API_SURFACE_3MF] = {.still = "3MF",
                         .unit = "mm",
                         .lacks = API_LACKS_SCENE | API_LACKS_TEXTURES | API_LACKS_UVS | API_LACKS_COLORS,
                         .is_chunked = true,
                         .open = open_package,
                         .idle = of_triangles,
                         .predict = predict_package,
                         .reply = reply_package},
    [API_SURFACE_POINTS] = {.is_points = true,
                            .open = open_points,
                            .idle = of_points,
                            .predict = predict_flat,
                            .reply = reply_flat},
};

const api_surface_form *api_surface_form_at(size_t offer) {
  return &forms[offer];
}
