/* A new model: a stored one after edits of a mesh. It is written as GLB that reads back as the same cage, and
 * stored as an upload of these bytes would be. */
#include "edits_in.h"
#include "handlers.h"
#include "models.h"
#include "near_names.h"
#include "service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct edits_request {
  api_call *call;
  const tw_model *model; /* as it is stored */
  api_maker maker;
  uint32_t mesh;
  tw_mesh edited; /* in the arena of the call */
  tw_made *made;  /* [made_count] */
  uint32_t made_count;
} edits_request;

/* ---- the request --------------------------------------------------------------------------------------- */

/* The mesh of a name; one without a name is mesh_0 by its index. */
static tw_status find_mesh(const api_value *value, const tw_model *model, uint32_t *out) {
  const char *name = cJSON_GetStringValue(value->item);
  if (!value->item && model->mesh_count == 1) return TW_OK;
  if (!value->item)
    return api_json_fail(value, TW_INVALID, "the model has %u meshes: which one is edited?",
                         model->mesh_count);
  if (!name) return api_json_fail(value, TW_SYNTAX, "the name of a mesh is expected");
  api_near near = {.name = name, .length = strlen(name)};
  uint32_t found = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    char made_up[24];
    snprintf(made_up, sizeof made_up, "mesh_%u", i);
    const char *own = model->meshes[i].name ? model->meshes[i].name : made_up;
    api_near_consider(&near, own);
    if (strcmp(own, name) != 0) continue;
    found++;
    *out = i;
  }
  if (found > 1) return api_json_fail(value, TW_INVALID, "more than one mesh is called \"%.60s\"", name);
  if (found == 1) return TW_OK;
  return api_json_fail(value, TW_INVALID, "no mesh is called \"%.60s\"%s%s", name, near.count ? ";" : "",
                       api_near_print(&near).text);
}

/* A glTF mesh has something to draw: a face that is no hole. A hole may be named twice. */
static tw_status check_faces(const tw_mesh *mesh, const api_value *edits) {
  uint8_t *is_hole = tw_arena_alloc(edits->json->arena, mesh->face_count, 1);
  uint32_t holes = 0;
  if (!is_hole) return api_json_no_memory(edits->json);
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    holes += !is_hole[mesh->holes[i]];
    is_hole[mesh->holes[i]] = 1;
  }
  if (holes < mesh->face_count) return TW_OK;
  return api_json_fail(edits, TW_INVALID, "they leave no face that is no hole");
}

static tw_status read_document(void *context, const api_value *root) {
  enum { MESH, EDITS, MEMBERS };
  static const char *const names[] = {"mesh", "edits", NULL};
  edits_request *request = context;
  api_value values[MEMBERS];
  tw_status status = api_json_members(root, names, values);
  if (status == TW_OK && !values[EDITS].item)
    status = api_json_fail(root, TW_SYNTAX, "edits are missing: a list");
  if (status == TW_OK) status = find_mesh(&values[MESH], request->model, &request->mesh);
  if (status != TW_OK) return status;
  const api_making making = api_making_of(&request->maker);
  const api_edit_call edit = {&request->model->meshes[request->mesh], request->model, &making, 0};
  status = api_edits_apply(&values[EDITS], &edit, &request->edited, &request->made, &request->made_count);
  return status == TW_OK ? check_faces(&request->edited, &values[EDITS]) : status;
}

/* ---- the new model's bytes ----------------------------------------------------------------------------- */

/* What of the model is written. */
typedef struct cage_scene {
  tw_model model; /* a view of the stored one with the mesh that was edited */
  tw_arena *arena;
  tw_patch_shapes *shapes;
  tw_surface **surfaces; /* [model.mesh_count] */
} cage_scene;

static void end_scene(cage_scene *scene) {
  for (uint32_t i = 0; scene->surfaces && i < scene->model.mesh_count; i++)
    tw_surface_destroy(scene->surfaces[i]);
  free(scene->surfaces);
  tw_patch_shapes_destroy(scene->shapes);
  tw_arena_destroy(scene->arena);
}

static tw_status make_surface(cage_scene *scene, uint32_t i, tw_error *error) {
  tw_mesh mesh;
  const tw_mesh *source = &scene->model.meshes[i];
  if (tw_mesh_open_holes(source, scene->arena, &mesh) != TW_OK)
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  const tw_surface_options options = {
      .normals = source->normals.corners, .own_normals = true, .tagged = true, .shapes = scene->shapes};
  return tw_surface_create(&mesh, &options, &scene->surfaces[i], error);
}

/* A scene is ended by end_scene, also where it is not whole. */
static tw_status begin_scene(const edits_request *request, cage_scene *scene, tw_error *error) {
  *scene =
      (cage_scene){.model = *request->model, .arena = tw_arena_create(), .shapes = tw_patch_shapes_create()};
  uint32_t count = scene->model.mesh_count;
  scene->surfaces = tw_alloc_zero(count, sizeof *scene->surfaces);
  tw_mesh *meshes = scene->arena ? tw_arena_alloc(scene->arena, count, sizeof *meshes) : NULL;
  if (!meshes || !scene->shapes || !scene->surfaces) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  memcpy(meshes, request->model->meshes, count * sizeof *meshes);
  meshes[request->mesh] = request->edited;
  scene->model.meshes = meshes;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) status = make_surface(scene, i, error);
  return status;
}

/* What meshes and their surfaces of level 0 hold, for each point and corner. */
enum { MESH_BYTES = 128, SURFACE_BYTES = 256 };

static uint64_t count_elements(const tw_mesh *mesh) {
  return (uint64_t)mesh->point_count + mesh->corner_count;
}

static uint64_t surfaces_cost(const edits_request *request) {
  uint64_t elements = 0;
  for (uint32_t i = 0; i < request->model->mesh_count; i++)
    elements += count_elements(i == request->mesh ? &request->edited : &request->model->meshes[i]);
  return SURFACE_BYTES * elements;
}

/* malloc'ed [*size]; NULL: the fault says why. */
static uint8_t *write_glb(edits_request *request, const cage_scene *scene, size_t *size) {
  api_call *call = request->call;
  const tw_scene content = {.model = &scene->model,
                            .surfaces = (const tw_surface *const *)scene->surfaces,
                            .clips = scene->model.clips,
                            .clip_count = scene->model.clip_count,
                            .polygons = TW_POLYGONS_NGON};
  tw_gltf_stream *stream;
  if (tw_gltf_stream_create(&content, TW_FORMAT_GLB, &stream, &call->fault.error) != TW_OK) {
    api_fail(call);
    return NULL;
  }
  uint8_t *bytes = NULL;
  uint64_t whole = tw_gltf_stream_size(stream), most = call->service->limits.max_upload;
  if (whole > most) {
    api_fail_with(call, 422, "the model would have %llu bytes, over the limit of %llu",
                  (unsigned long long)whole, (unsigned long long)most);
  } else if (api_maker_grant(&request->maker, surfaces_cost(request) + whole)) {
    bytes = malloc((size_t)whole);
    *size = (size_t)whole;
    if (!bytes || tw_gltf_stream_read(stream, bytes, *size) < *size) {
      free(bytes);
      bytes = NULL;
      api_fail_without_memory(call);
    }
  }
  tw_gltf_stream_destroy(stream);
  return bytes;
}

static uint8_t *make_glb(edits_request *request, size_t *size) {
  cage_scene scene;
  request->maker.granted = MESH_BYTES * count_elements(&request->edited);
  if (!api_maker_grant(&request->maker, surfaces_cost(request))) return NULL;
  uint8_t *bytes = NULL;
  if (begin_scene(request, &scene, &request->call->fault.error) == TW_OK)
    bytes = write_glb(request, &scene, size);
  else
    api_fail(request->call);
  end_scene(&scene);
  return bytes;
}

/* ---- the answer ---------------------------------------------------------------------------------------- */

static void print_list(tw_text *out, const char *name, const uint32_t *list, uint32_t count,
                       const uint32_t *numbers) {
  tw_member_open(out, name, "[");
  for (uint32_t i = 0; i < count; i++) {
    if (numbers && numbers[list[i]] == UINT32_MAX) continue;
    tw_text_element(out);
    tw_text_count(out, numbers ? numbers[list[i]] : list[i]);
  }
  tw_text_add(out, "]");
}

/* The numbers that points have in the model, which has none that no face uses. NULL without memory. */
static const uint32_t *number_points(const tw_mesh *mesh, tw_arena *arena) {
  uint32_t *numbers = tw_arena_alloc(arena, mesh->point_count, sizeof *numbers), used = 0;
  if (!numbers) return NULL;
  for (uint32_t c = 0; c < mesh->corner_count; c++) numbers[mesh->corners[c]] = 1;
  for (uint32_t p = 0; p < mesh->point_count; p++) numbers[p] = numbers[p] ? used++ : UINT32_MAX;
  return numbers;
}

/* The last of equal names wins. */
static void print_made(void *context, tw_text *out) {
  const edits_request *request = context;
  const uint32_t *numbers = number_points(&request->edited, request->call->arena);
  out->failed |= !numbers;
  tw_member_open(out, "made", "{");
  for (uint32_t i = 0; numbers && i < request->made_count; i++) {
    const tw_made *made = &request->made[i];
    bool is_last = true;
    for (uint32_t k = i + 1; k < request->made_count && is_last; k++)
      is_last = strcmp(made->name, request->made[k].name) != 0;
    if (!is_last) continue;
    tw_text_element(out);
    tw_text_string(out, made->name);
    tw_text_add(out, ":{");
    print_list(out, "faces", made->faces, made->face_count, NULL);
    print_list(out, "vertices", made->vertices, made->vertex_count, numbers);
    tw_text_add(out, "}");
  }
  tw_text_add(out, "}");
}

static api_outcome store_edited(edits_request *request) {
  size_t size;
  uint8_t *bytes = make_glb(request, &size);
  if (!bytes) return API_FAILED;
  const api_addition made = {print_made, request};
  api_outcome outcome = api_model_store(request->call, (api_bytes){bytes, size},
                                        request->maker.granted + size, request->model->name, &made);
  free(bytes);
  return outcome;
}

api_outcome api_post_edits(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_entry *entry;
  api_outcome outcome = api_model_take(call, call->id, NULL, &entry);
  if (outcome != API_DONE) return outcome;
  edits_request request = {.call = call, .model = api_entry_value(entry), .maker = {call, &call->fault, 0}};
  request.maker.granted = tw_reading_size(TW_FORMAT_JSON, call->request->body.size);
  outcome = api_upload_json(call, API_JSON_VALUES_MAX, read_document, &request);
  if (outcome == API_DONE) outcome = store_edited(&request);
  api_entry_release(entry);
  return outcome;
}
