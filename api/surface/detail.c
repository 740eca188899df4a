/* A new model: a stored one with what somebody has modelled onto a level of one of its meshes. */
#include "tweend/detail.h"

#include "handlers.h"
#include "plans.h"
#include "remade.h"
#include "service.h"

#include <stdlib.h>
#include <string.h>

typedef struct detail_request {
  api_remade remade;
  tw_surface_options options;
  uint32_t rows;     /* points of the mesh at the level */
  uint64_t all_rows; /* of the whole OBJ */
  uint64_t first;    /* the mesh's first of those */
  float world[16];   /* that the OBJ's points have on top */
  float *positions;  /* as they came: [count][3] */
  uint32_t count;
} detail_request;

/* ---- the level ----------------------------------------------------------------------------------------- */

static tw_status read_level(const api_query *query, const api_limits *limits, uint32_t *out,
                            tw_error *error) {
  uint64_t level = 0;
  if (!api_query_get(query, "level"))
    return tw_fail(error, TW_SYNTAX, "level is missing: the level whose points the body has");
  tw_status status = api_query_count(query, "level", &level, error);
  if (status == TW_OK && level > limits->max_level)
    return tw_fail(error, TW_LIMIT, "level=%llu is over the limit of %u", (unsigned long long)level,
                   limits->max_level);
  *out = (uint32_t)level;
  return status;
}

/* Points of a mesh at the level. */
static tw_status count_points(const detail_request *request, const api_surface_query *query, uint32_t mesh,
                              uint64_t most_faces, uint64_t *out, tw_error *error) {
  const tw_mesh *of = &request->remade.model->meshes[mesh];
  const tw_surface_options options = api_surface_options(query, of);
  tw_surface_counts counts;
  tw_status status = tw_surface_count(of, &options, &counts, error);
  if (status == TW_OK && counts.faces > most_faces)
    return tw_fail(error, TW_LIMIT, "the surface would have %llu faces, over the limit of %llu",
                   (unsigned long long)counts.faces, (unsigned long long)most_faces);
  *out = counts.vertices;
  return status;
}

/* Where the mesh's points are in the OBJ of the model: behind those of the nodes before the first that shows
 * it, in that node's place. */
static tw_status place_mesh(detail_request *request, const api_surface_query *query, uint64_t most_faces,
                            tw_error *error) {
  api_remade *remade = &request->remade;
  const tw_model *model = remade->model;
  tw_arena *arena = remade->call->arena;
  uint64_t *points = tw_arena_alloc(arena, model->mesh_count, sizeof *points);
  float(*world)[16] = tw_arena_alloc(arena, model->node_count, sizeof *world);
  tw_trs *locals = tw_arena_alloc(arena, model->node_count, sizeof *locals);
  if (!points || !world || !locals) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = count_points(request, query, remade->mesh, most_faces, &points[remade->mesh], error);
  if (status != TW_OK) return status;
  for (uint32_t m = 0; m < model->mesh_count; m++)
    if (m != remade->mesh && count_points(request, query, m, UINT64_MAX, &points[m], NULL) != TW_OK)
      points[m] = 0;
  for (uint32_t n = 0; n < model->node_count; n++) locals[n] = model->nodes[n].rest;
  tw_pose_locals(NULL, model->nodes, model->node_count, locals, *world);
  tw_pose_world(model->nodes, model->node_order, model->node_count, *world, *world);
  request->rows = (uint32_t)points[remade->mesh];
  bool found = false;
  for (uint32_t n = 0; n < model->node_count; n++) {
    const tw_node *node = &model->nodes[n];
    if (node->mesh == TW_NO_INDEX || node->is_hidden) continue;
    if (node->mesh == remade->mesh && !found) {
      found = true;
      request->first = request->all_rows;
      memcpy(request->world, world[n], sizeof request->world);
    }
    request->all_rows += points[node->mesh];
  }
  if (!found)
    memcpy(request->world, (const float[16]){[0] = 1, [5] = 1, [10] = 1, [15] = 1}, sizeof request->world);
  return TW_OK;
}

static tw_status read_query(detail_request *request, uint64_t *cost, tw_error *error) {
  api_call *call = request->remade.call;
  const api_limits *limits = &call->service->limits;
  api_surface_query query;
  tw_status status = api_surface_query_begin(&call->query, &query, error);
  if (status == TW_OK) status = read_level(&call->query, limits, &query.level, error);
  if (status == TW_OK)
    status = api_remade_choose(&request->remade, api_query_get(&call->query, "mesh"), error);
  if (status != TW_OK) return status;
  const tw_mesh *mesh = &request->remade.model->meshes[request->remade.mesh];
  query.normals = true;
  request->options = api_surface_options(&query, mesh);
  status = place_mesh(request, &query, limits->max_faces, error);
  if (status != TW_OK) return status;
  uint64_t most = request->rows;
  for (uint32_t i = 0; i < mesh->detail_count; i++)
    if (mesh->details[i].vertex_count > most) most = mesh->details[i].vertex_count;
  *cost = API_DETAIL_COST * (most + mesh->corner_count);
  return TW_OK;
}

/* ---- the points ---------------------------------------------------------------------------------------- */

/* Triples, or one list of numbers. */
static tw_status read_document(void *context, const api_value *root) {
  static const char *const names[] = {"positions", NULL};
  detail_request *request = context;
  api_value positions;
  uint32_t count = 0;
  tw_status status = api_json_members(root, names, &positions);
  if (status == TW_OK && !positions.item)
    status = api_json_fail(root, TW_SYNTAX, "positions are missing: a list");
  if (status == TW_OK) status = api_json_count(&positions, UINT32_MAX, &count);
  if (status != TW_OK) return status;
  bool is_flat = api_json_holds_numbers(&positions);
  if (is_flat && count % 3 != 0)
    return api_json_fail(&positions, TW_INVALID, "%u numbers are no points of three each", count);
  request->count = is_flat ? count / 3 : count;
  request->positions = tw_arena_alloc(root->json->arena, request->count, 3 * sizeof *request->positions);
  if (!request->positions) return api_json_no_memory(root->json);
  return is_flat ? api_json_float_list(&positions, request->positions)
                 : api_json_float_rows(&positions, 3, 3, request->positions);
}

static api_outcome read_json(detail_request *request, api_bytes bytes) {
  api_call *call = request->remade.call;
  api_json json = {call->arena, &call->fault.error, NULL};
  api_value root;
  tw_status status = api_json_open(&json, (const char *)bytes.data, bytes.size, API_JSON_VALUES_MAX, &root);
  if (status == TW_OK) status = read_document(request, &root);
  api_json_close(&root);
  return status == TW_OK ? API_DONE : api_fail_in_document(call);
}

static api_outcome read_obj(detail_request *request, api_bytes bytes) {
  api_call *call = request->remade.call;
  tw_status status = tw_obj_read_points(bytes.data, bytes.size, call->arena, &request->positions,
                                        &request->count, &call->fault.error);
  return status == TW_OK ? API_DONE : api_fail(call);
}

static api_outcome read_points(detail_request *request) {
  api_call *call = request->remade.call;
  api_upload upload = {0};
  tw_format format = TW_FORMAT_OBJ;
  api_outcome outcome = api_upload_read(call, &upload);
  if (outcome != API_DONE) return outcome;
  outcome = api_upload_format(call, upload.bytes, &format);
  bool fits = format == TW_FORMAT_OBJ || format == TW_FORMAT_JSON;
  if (outcome == API_DONE && !fits)
    outcome = api_fail_with(call, 415, "points come as OBJ, or as JSON with positions");
  if (outcome == API_DONE)
    outcome = format == TW_FORMAT_OBJ ? read_obj(request, upload.bytes) : read_json(request, upload.bytes);
  api_upload_deinit(&upload);
  return outcome;
}

/* Takes the mesh's own points out of the OBJ of a model. */
static api_outcome take_own(detail_request *request) {
  if (request->count == request->rows) return API_DONE;
  if (request->count == request->all_rows) {
    request->positions += 3 * request->first;
    return API_DONE;
  }
  return api_fail_with(request->remade.call, 422, "the body has %u points, and level %u of the mesh has %u",
                       request->count, request->options.level, request->rows);
}

/* Turns a matrix of a node round; false: there is no way back. */
static bool invert(const float m[16], double inverse[9]) {
  double determinant = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      inverse[3 * i + j] =
          (double)m[4 * a + c] * (double)m[4 * b + d] - (double)m[4 * a + d] * (double)m[4 * b + c];
    }
  for (int j = 0; j < 3; j++) determinant += (double)m[j] * inverse[j];
  for (int i = 0; i < 9; i++) inverse[i] /= determinant;
  return determinant * determinant > 0;
}

/* Back from the world, where OBJ has its points, to the mesh. now: its points, which those that have not
 * moved become again, to the last bit. */
static void leave_world(const detail_request *request, const double inverse[9], const float *now) {
  const float *m = request->world;
  for (uint32_t p = 0; p < request->rows; p++) {
    float *point = request->positions + 3 * (size_t)p, shown[3];
    double from[3];
    memcpy(shown, now + 3 * (size_t)p, sizeof shown);
    tw_matrix_move(m, shown);
    bool has_moved = shown[0] != point[0] || shown[1] != point[1] || shown[2] != point[2];
    for (int c = 0; c < 3; c++) from[c] = (double)point[c] - (double)m[12 + c];
    for (int c = 0; c < 3; c++)
      point[c] = has_moved ? (float)(inverse[3 * c] * from[0] + inverse[3 * c + 1] * from[1] +
                                     inverse[3 * c + 2] * from[2])
                           : now[3 * (size_t)p + (size_t)c];
  }
}

/* The points as the mesh has them. */
static api_outcome find_local(detail_request *request) {
  static const float identity[16] = {[0] = 1, [5] = 1, [10] = 1, [15] = 1};
  api_call *call = request->remade.call;
  double inverse[9];
  if (memcmp(request->world, identity, sizeof identity) == 0) return API_DONE;
  if (!invert(request->world, inverse))
    return api_fail_with(call, 422,
                         "the node that shows the mesh has no size, so that no point can be taken back");
  tw_surface *surface;
  if (tw_surface_create_by(&request->remade.model->meshes[request->remade.mesh], &request->options,
                           call->service->parallel, &surface, &call->fault.error) != TW_OK)
    return api_fail(call);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  float *now = tw_alloc(request->rows, 3 * sizeof *now);
  bool has_memory = reader && now;
  if (has_memory) {
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, request->rows, now);
    leave_world(request, inverse, now);
  }
  free(now);
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
  return has_memory ? API_DONE : api_fail_without_memory(call);
}

/* ---- the answer ---------------------------------------------------------------------------------------- */

static api_outcome sculpt(detail_request *request) {
  api_remade *remade = &request->remade;
  api_call *call = remade->call;
  uint64_t cost;
  if (read_query(request, &cost, &call->fault.error) != TW_OK) return api_fail(call);
  if (!api_maker_grant(&remade->maker, cost)) return API_FAILED;
  api_outcome outcome = read_points(request);
  if (outcome == API_DONE) outcome = take_own(request);
  if (outcome == API_DONE) outcome = find_local(request);
  if (outcome != API_DONE) return outcome;
  const tw_mesh *mesh = &remade->model->meshes[remade->mesh];
  if (tw_mesh_sculpt(mesh, &request->options, request->positions, call->service->parallel, call->arena,
                     &remade->cage, &call->fault.error) != TW_OK) {
    bool is_point = strncmp(call->fault.error.pointer, "/positions/", strlen("/positions/")) == 0;
    return is_point ? api_fail_in_document(call) : api_fail(call);
  }
  return api_remade_store(remade, NULL);
}

api_outcome api_post_detail(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_entry *entry;
  api_outcome outcome = api_model_take(call, call->id, NULL, &entry);
  if (outcome != API_DONE) return outcome;
  detail_request request = {.remade = api_remade_of(call, entry)};
  request.remade.maker.granted = tw_reading_size(TW_FORMAT_JSON, call->request->body.size);
  outcome = sculpt(&request);
  api_entry_release(entry);
  return outcome;
}
