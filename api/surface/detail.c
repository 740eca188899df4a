/* POST /v1/models/{id}/detail: makes a new model by sculpting a level of a mesh of a stored one. */
#include "tweend/detail.h"

#include "edited_model.h"
#include "handlers.h"
#include "plans.h"
#include "service.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct detail_request {
  api_edited_model *edited;
  api_surface_query query;
  tw_surface_options options;
  uint32_t node;      /* the first node that shows the mesh, or TW_NO_INDEX */
  tw_placement place; /* of `node`, unless it is none or joints move its mesh */
  double at[3];       /* the origin of that place if it is far, else 0 */
  float *positions;   /* [count][3], as sent, relative to `at` */
  uint32_t count;
  bool is_own_space;       /* they are in the mesh's space, as surface.bin has them, not in an OBJ's */
  const uint32_t *indices; /* [count] which points of the mesh they are; NULL: all, in order */
  uint64_t rows;           /* points of the mesh at that level */
} detail_request;

/* ---- the level ------------------------------------------------------------------------------- */

static bool shows(const tw_model *model, uint32_t node, uint32_t mesh) {
  return model->nodes[node].mesh == mesh && !model->nodes[node].is_hidden;
}

/* Counts the points of a mesh at the level, and checks the limits. */
static tw_status count_points(const detail_request *request, uint32_t mesh, uint64_t *out) {
  api_call *call = request->edited->call;
  const tw_mesh *of = &request->edited->model->meshes[mesh];
  const tw_surface_options options = api_surface_options(&request->query, 0, of);
  tw_surface_counts counts = {0};
  tw_status status = tw_surface_count(of, &options, &counts, &call->fault.error);
  *out = counts.vertices;
  return api_plan_check(call, request->query.level, &counts, status);
}

/* Computes the world matrices of the model at rest; NULL without memory. */
static float (*place_nodes(const detail_request *request))[16] {
  const tw_model *model = request->edited->model;
  tw_arena *arena = request->edited->call->arena;
  float(*world)[16] = tw_arena_alloc(arena, model->node_count, sizeof *world);
  tw_trs *locals = tw_arena_alloc(arena, model->node_count, sizeof *locals);
  if (!world || !locals) return NULL;
  for (uint32_t n = 0; n < model->node_count; n++) locals[n] = model->nodes[n].rest;
  tw_pose_locals(NULL, model->nodes, model->node_count, locals, *world);
  tw_pose_world(model->nodes, model->node_order, model->node_count, *world, *world);
  return world;
}

/* Finds `place` and `at`. */
static tw_status find_place(detail_request *request) {
  const tw_model *model = request->edited->model;
  const tw_node *node = request->node == TW_NO_INDEX ? NULL : &model->nodes[request->node];
  if (!node || tw_node_is_skinned(model, node)) return TW_OK;
  if (!tw_node_first_place(model, request->node, &request->place))
    return tw_fail(&request->edited->call->fault.error, TW_NO_MEMORY, "out of memory");
  if (request->place.is_far) memcpy(request->at, request->place.origin, sizeof request->at);
  return TW_OK;
}

/* Reads the query and counts the points, so that limits are checked before the body is read. */
static api_outcome read_query(detail_request *request) {
  api_edited_model *edited = request->edited;
  api_call *call = edited->call;
  const char *mesh = api_query_get(&call->query, "mesh");
  if (!api_query_get(&call->query, "level"))
    return api_fail_with(call, 400, "level is missing: the level whose points the body has");
  if (api_surface_query_read(call, &request->query) != API_DONE) return API_FAILED;
  if (api_surface_query_fix_level(call, &request->query) != API_DONE) return API_FAILED;
  if (api_edited_model_choose(edited, mesh, &call->fault.error) != TW_OK) return api_fail(call);
  request->options = api_surface_options(&request->query, 0, &edited->model->meshes[edited->mesh]);
  request->node = TW_NO_INDEX;
  for (uint32_t n = 0; n < edited->model->node_count && request->node == TW_NO_INDEX; n++)
    if (shows(edited->model, n, edited->mesh)) request->node = n;
  tw_status status = find_place(request);
  return api_outcome_of(call, status == TW_OK ? count_points(request, edited->mesh, &request->rows) : status);
}

/* ---- the points ------------------------------------------------------------------------------ */

static bool is_far(const detail_request *request) {
  return request->at[0] != 0 || request->at[1] != 0 || request->at[2] != 0;
}

/* Reads positions in double, relative to `at`. */
static tw_status read_far(detail_request *request, const api_value *positions, bool is_flat) {
  double *exact = tw_alloc(request->count, 3 * sizeof *exact);
  if (!exact) return api_json_no_memory(positions->json);
  tw_status status =
      is_flat ? api_json_double_list(positions, exact) : api_json_double_rows(positions, 3, exact);
  if (status == TW_OK) tw_points_enter_frame(exact, request->count, request->at, request->positions);
  tw_free(exact);
  return status;
}

/* Reads the points that the positions are of. */
static tw_status read_indices(detail_request *request, const api_value *list) {
  uint32_t count = 0;
  tw_status status = api_json_count(list, UINT32_MAX, &count);
  if (status != TW_OK) return status;
  if (count != request->count)
    return api_json_fail(list, TW_INVALID, "%u %s, and %u %s", count, tw_plural(count, "index", "indices"),
                         request->count, tw_plural(request->count, "position", "positions"));
  uint32_t *indices = tw_arena_alloc_raw(list->json->arena, count, sizeof *indices);
  if (!indices) return api_json_no_memory(list->json);
  request->indices = indices;
  status = api_json_index_list(list, indices);
  for (uint32_t i = 0; status == TW_OK && i < count; i++) {
    if (indices[i] < request->rows) continue;
    tw_fail(list->json->error, TW_INVALID, "the mesh has %llu points at this level",
            (unsigned long long)request->rows);
    tw_error_at(list->json->error, "/%u", i);
    status = api_json_fail_within(list, TW_INVALID);
  }
  return status;
}

/* Reads positions: triples, or one flat list of numbers; of all points, or of those of the indices. */
static tw_status read_document(void *context, const api_value *root) {
  enum { POSITIONS, INDICES, SPACE, MEMBERS };
  static const char *const names[] = {"positions", "indices", "space", NULL};
  static const char *const spaces[] = {"world", "mesh", NULL};
  detail_request *request = context;
  api_value members[MEMBERS], *positions = &members[POSITIONS];
  uint32_t count = 0;
  tw_status status = api_json_members(root, names, members);
  if (status == TW_OK && !positions->item)
    status = api_json_fail(root, TW_SYNTAX, "positions are missing: a list");
  if (status == TW_OK) status = api_json_count(positions, UINT32_MAX, &count);
  if (status != TW_OK) return status;
  bool is_flat = api_json_holds_numbers(positions);
  if (is_flat && count % 3 != 0)
    return api_json_fail(positions, TW_INVALID, "%u %s of three each", count,
                         tw_plural(count, "number is no point", "numbers are no points"));
  request->count = is_flat ? count / 3 : count;
  request->positions = tw_arena_alloc(root->json->arena, request->count, 3 * sizeof *request->positions);
  if (!request->positions) return api_json_no_memory(root->json);
  int space = 0;
  if (members[INDICES].item) status = read_indices(request, &members[INDICES]);
  if (status == TW_OK && members[SPACE].item) status = api_json_choice(&members[SPACE], spaces, &space);
  if (status != TW_OK) return status;
  request->is_own_space = space == 1;
  if (is_far(request) && !request->is_own_space) return read_far(request, positions, is_flat);
  return is_flat ? api_json_float_list(positions, request->positions)
                 : api_json_float_rows(positions, 3, 3, request->positions);
}

/* ---- the form of surface.bin ----------------------------------------------------------------- */

enum { BIN_PREFIX = 12, BIN_STRIDE_MIN = 3, BIN_STRIDE_MAX = 64 };
static const char bin_magic[4] = "TWSB";

typedef struct bin_head {
  uint32_t points, stride;
} bin_head;

static bool is_bin(const api_call *call, api_bytes bytes) {
  api_upload_type type = api_upload_type_of(api_call_header(call, "Content-Type"));
  bool may_be = type == API_TYPE_BYTES || type == API_TYPE_MULTIPART;
  return may_be && bytes.size >= BIN_PREFIX && memcmp(bytes.data, bin_magic, sizeof bin_magic) == 0;
}

/* Implements api_json_reader. */
static tw_status read_bin_head(void *context, const api_value *root) {
  enum { POINTS, STRIDE, MESH, LEVEL, LAYOUT, MEMBERS };
  static const char *const names[] = {"points", "stride", "mesh", "level", "layout", NULL};
  bin_head *head = context;
  api_value members[MEMBERS];
  tw_status status = api_json_members(root, names, members);
  if (status == TW_OK && (!members[POINTS].item || !members[STRIDE].item))
    status = api_json_fail(root, TW_SYNTAX, "points and stride are expected");
  if (status == TW_OK) status = api_json_index(&members[POINTS], &head->points);
  if (status == TW_OK) status = api_json_index(&members[STRIDE], &head->stride);
  bool fits = head->stride >= BIN_STRIDE_MIN && head->stride <= BIN_STRIDE_MAX;
  return status == TW_OK && !fits ? api_json_fail(&members[STRIDE], TW_INVALID, "from 3 to 64 is expected")
                                  : status;
}

/* Reads rows whose first three floats are a position in the mesh's space. */
static api_outcome read_bin(detail_request *request, api_bytes bytes) {
  enum { HEAD_VALUES = 1000 };
  api_call *call = request->edited->call;
  bin_head head = {0};
  uint32_t version, length;
  memcpy(&version, bytes.data + 4, sizeof version);
  memcpy(&length, bytes.data + 8, sizeof length);
  if (version != 1) return api_fail_with(call, 400, "version %u of TWSB is not known", version);
  if (length > bytes.size - BIN_PREFIX) return api_fail_with(call, 400, "the body ends within its head");
  const api_bytes text = {bytes.data + BIN_PREFIX, length};
  api_outcome outcome = api_json_read(call, text, HEAD_VALUES, read_bin_head, &head);
  if (outcome != API_DONE) return outcome;
  size_t row = head.stride * sizeof(float), rest = bytes.size - BIN_PREFIX - length;
  if (rest / row != head.points || rest % row != 0)
    return api_fail_with(call, 400, "%u %s of %zu bytes %s told, and %zu %s there", head.points,
                         tw_plural(head.points, "point", "points"), row, tw_plural(head.points, "is", "are"),
                         rest, tw_plural(rest, "byte is", "bytes are"));
  request->positions = tw_arena_alloc_raw(call->arena, head.points, 3 * sizeof *request->positions);
  if (!request->positions) return api_fail_without_memory(call);
  for (size_t p = 0; p < head.points; p++)
    memcpy(request->positions + 3 * p, text.data + length + p * row, 3 * sizeof *request->positions);
  request->count = head.points;
  request->is_own_space = true;
  return API_DONE;
}

/* ---- any form -------------------------------------------------------------------------------- */

static api_outcome read_obj(detail_request *request, api_bytes bytes) {
  api_call *call = request->edited->call;
  tw_status status = tw_obj_read_points(bytes.data, bytes.size, request->at, call->arena, &request->positions,
                                        &request->count, &call->fault.error);
  return api_outcome_of(call, status);
}

static api_outcome read_model(detail_request *request, api_bytes bytes) {
  api_call *call = request->edited->call;
  tw_format format = TW_FORMAT_OBJ;
  api_outcome outcome = api_upload_format(call, bytes, &format);
  if (outcome != API_DONE) return outcome;
  if (format != TW_FORMAT_OBJ && format != TW_FORMAT_JSON)
    return api_fail_with(call, 415, "points come as OBJ, as JSON with positions, or as surface.bin has them");
  if (!api_grant(call, tw_reading_size(format, bytes.size))) return API_FAILED;
  return format == TW_FORMAT_OBJ ? read_obj(request, bytes)
                                 : api_json_read(call, bytes, API_JSON_VALUES_MAX, read_document, request);
}

static api_outcome read_points(detail_request *request) {
  api_call *call = request->edited->call;
  api_upload upload = {0};
  api_outcome outcome = api_upload_read(call, &upload);
  if (outcome != API_DONE) return outcome;
  if (!is_bin(call, upload.bytes))
    outcome = read_model(request, upload.bytes);
  else
    outcome = api_grant(call, upload.bytes.size) ? read_bin(request, upload.bytes) : API_FAILED;
  api_upload_deinit(&upload);
  return outcome;
}

/* Counts the points of the model's OBJ, and those before the mesh's: nodes follow each other, each with the
 * points of its mesh. */
static tw_status count_obj(const detail_request *request, uint64_t *all, uint64_t *first) {
  const tw_model *model = request->edited->model;
  api_call *call = request->edited->call;
  uint64_t *points = tw_arena_alloc(call->arena, model->mesh_count, sizeof *points);
  if (!points) return tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  *all = 0;
  for (uint32_t n = 0; n < model->node_count; n++) {
    uint32_t mesh = model->nodes[n].mesh;
    if (mesh == TW_NO_INDEX || !shows(model, n, mesh)) continue;
    tw_status status = points[mesh] ? TW_OK : count_points(request, mesh, &points[mesh]);
    if (status != TW_OK) return status;
    if (n == request->node) *first = *all;
    *all += points[mesh] * tw_node_times_shown(model, n);
  }
  return TW_OK;
}

/* Finds the mesh's points: they are all points sent, or a part of the whole model's OBJ. */
static api_outcome take_points(detail_request *request) {
  api_call *call = request->edited->call;
  uint64_t all = 0, first = 0;
  bool may_be_whole = request->node != TW_NO_INDEX && !request->is_own_space;
  if (request->indices || request->count == request->rows) return API_DONE;
  if (may_be_whole && count_obj(request, &all, &first) != TW_OK) return api_fail(call);
  if (!may_be_whole || request->count != all)
    return api_fail_with(call, 422, "the body has %u %s, and level %u of the mesh has %llu", request->count,
                         tw_plural(request->count, "point", "points"), request->options.level,
                         (unsigned long long)request->rows);
  request->positions += 3 * first;
  request->count = (uint32_t)request->rows;
  return API_DONE;
}

/* The space of an OBJ, whose points are transformed by the node that shows the mesh. */
typedef struct world_space {
  float matrix[16];
  double cofactors[9], determinant; /* of the matrix; the rows of cofactors / determinant are the inverse */
  /* A point that is no farther from where it was has not moved: joints round, as do numbers far from 0. */
  double room, far_room[3];
} world_space;

/* Whether all joints move points alike; their matrix then takes the place of the node's. */
static bool find_joint_matrix(const tw_skin *skin, const float (*joints)[16], float out[16]) {
  for (int i = 0; i < 16; i++) {
    float largest = fmaxf(1, fabsf(joints[0][i]));
    for (uint32_t j = 1; j < skin->joint_count; j++)
      if (!(fabsf(joints[j][i] - joints[0][i]) <= 1e-5f * largest)) return false;
  }
  memcpy(out, joints[0], 16 * sizeof *out);
  return true;
}

static bool has_weights(const tw_model *model, const tw_node *node) {
  const tw_mesh *mesh = &model->meshes[node->mesh];
  const float *weights = node->weights ? node->weights : mesh->morph_weights;
  for (uint32_t i = 0; weights && i < mesh->morph_count; i++)
    if (weights[i] != 0) return true;
  return false;
}

/* Computes the matrix that takes the mesh's points to those of an OBJ of the model at rest. */
static api_outcome find_matrix(const detail_request *request, world_space *space) {
  api_call *call = request->edited->call;
  const tw_model *model = request->edited->model;
  const tw_node *node = &model->nodes[request->node];
  tw_arena *arena = call->arena;
  memcpy(space->matrix, request->place.world, sizeof space->matrix);
  for (int c = 0; c < 3; c++) {
    space->far_room[c] = 4 * DBL_EPSILON * fabs(request->at[c]);
    if (is_far(request)) space->matrix[12 + c] = 0;
  }
  if (has_weights(model, node))
    return api_fail_with(call, 422,
                         "morph targets move the mesh at rest: send its own points, as a GLB has them");
  if (!tw_node_is_skinned(model, node)) return API_DONE;
  float(*world)[16] = place_nodes(request);
  if (!world) return api_fail_without_memory(call);
  const tw_skin *skin = &model->skins[node->skin];
  float(*joints)[16] = tw_arena_alloc(arena, skin->joint_count, sizeof *joints);
  if (!joints) return api_fail_without_memory(call);
  tw_skin_matrices(skin, *world, *joints);
  space->room = 1e-6;
  return find_joint_matrix(skin, (const float(*)[16])joints, space->matrix)
             ? API_DONE
             : api_fail_with(
                   call, 422,
                   "the joints do not rest where the mesh was bound to them: send its own points, as a "
                   "GLB has them");
}

/* now: the point as it is; point: as sent, becomes one of the mesh. */
static void leave_world_at(const world_space *world, const float now[3], float point[3]) {
  float shown[3] = {now[0], now[1], now[2]};
  double from[3];
  tw_matrix_move(world->matrix, shown);
  bool has_moved = false;
  for (size_t c = 0; c < 3; c++) {
    double room = world->room * fmax(1, fabs((double)shown[c])) + world->far_room[c];
    has_moved |= !(fabs((double)shown[c] - (double)point[c]) <= room);
  }
  for (size_t c = 0; c < 3; c++) from[c] = (double)point[c] - (double)world->matrix[12 + c];
  for (size_t c = 0; c < 3; c++) {
    const double *row = &world->cofactors[3 * c];
    point[c] = has_moved
                   ? (float)((row[0] * from[0] + row[1] * from[1] + row[2] * from[2]) / world->determinant)
                   : now[c];
  }
}

/* The points that are given, and those that the level gets. */
typedef struct placed_points {
  const detail_request *request;
  const world_space *world; /* NULL: they are in the mesh's space */
  float *positions;         /* [rows][3]; those of the request where it has all points */
} placed_points;

/* Implements tw_points_back: unmoved points become what they were, bit for bit. */
static void place_points(void *context, const float *now, uint32_t rows) {
  const placed_points *placed = context;
  const detail_request *request = placed->request;
  if (request->indices) memcpy(placed->positions, now, 3 * (size_t)rows * sizeof *now);
  for (size_t i = 0; i < request->count; i++) {
    size_t row = request->indices ? request->indices[i] : i;
    float *point = placed->positions + 3 * row;
    if (request->indices) memcpy(point, request->positions + 3 * i, 3 * sizeof *point);
    if (placed->world) leave_world_at(placed->world, now + 3 * row, point);
  }
}

/* *is_mesh_space: the points need no transform. */
static api_outcome find_space(const detail_request *request, world_space *out, bool *is_mesh_space) {
  static const float identity[16] = {[0] = 1, [5] = 1, [10] = 1, [15] = 1};
  api_call *call = request->edited->call;
  *is_mesh_space = request->node == TW_NO_INDEX || request->is_own_space;
  if (*is_mesh_space) return API_DONE;
  out->room = 0;
  api_outcome outcome = find_matrix(request, out);
  if (outcome != API_DONE) return outcome;
  *is_mesh_space = memcmp(out->matrix, identity, sizeof identity) == 0 && !is_far(request);
  out->determinant = tw_matrix_cofactors(out->matrix, out->cofactors);
  if (!isfinite(out->determinant) || out->determinant == 0)
    return api_fail_with(call, 422,
                         "the node that shows the mesh has no size, so that no point can be taken back");
  return API_DONE;
}

/* ---- the answer ------------------------------------------------------------------------------ */

/* Where the points have indices, the place of an error is that of the point in the list. */
static void find_in_list(const detail_request *request, tw_error *error) {
  unsigned long row;
  char *rest;
  uint32_t i = request->count;
  row = strtoul(error->pointer + strlen("/positions/"), &rest, 10);
  while (i > 0 && request->indices[i - 1] != row) i--;
  if (i == 0) return;
  char coordinate[8];
  snprintf(coordinate, sizeof coordinate, "%.7s", rest);
  tw_error_at(error, "/positions/%u%s", i - 1, coordinate);
}

static api_outcome fail_at_point(const detail_request *request) {
  api_call *call = request->edited->call;
  tw_error *error = &call->fault.error;
  if (strncmp(error->pointer, "/positions/", strlen("/positions/")) != 0) return api_fail(call);
  if (request->indices) find_in_list(request, error);
  return api_fail_in_document(call);
}

static api_outcome sculpt(detail_request *request) {
  api_edited_model *edited = request->edited;
  api_call *call = edited->call;
  const tw_mesh *mesh = &edited->source;
  world_space world;
  bool is_mesh_space;
  api_outcome outcome = find_space(request, &world, &is_mesh_space);
  if (outcome != API_DONE) return outcome;
  placed_points placed = {request, is_mesh_space ? NULL : &world, request->positions};
  if (request->indices)
    placed.positions = tw_arena_alloc_raw(call->arena, request->rows, 3 * sizeof *placed.positions);
  if (!placed.positions) return api_fail_without_memory(call);
  const tw_points_back back = {place_points, &placed};
  if (tw_mesh_sculpt(mesh, &request->options, placed.positions, &back, &call->service->parallel, call->arena,
                     &edited->cage, &call->fault.error) != TW_OK)
    return fail_at_point(request);
  bool has_changed = edited->cage.positions != mesh->positions || edited->cage.details != mesh->details;
  return has_changed ? api_edited_model_store(edited, NULL) : api_model_reply_stored(call);
}

static api_outcome answer_detail(api_edited_model *edited) {
  detail_request request = {.edited = edited};
  api_outcome outcome = read_query(&request);
  if (outcome == API_DONE) outcome = read_points(&request);
  if (outcome == API_DONE) outcome = take_points(&request);
  return outcome == API_DONE ? sculpt(&request) : outcome;
}

api_outcome api_post_detail(api_call *call) {
  return api_edited_model_answer(call, answer_detail);
}
