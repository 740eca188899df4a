/* tweend JSON: the document, its meshes and nodes. The values of indices are checked by tw_model_finish. */
#include "json_in.h"

#include <string.h>

#include "clips_in.h"
#include "json_value.h"
#include "shape_in.h"

/* ---- meshes ---------------------------------------------------------------------------------- */

enum {
  MESH_NAME,
  MESH_SHAPE,
  MESH_POSITIONS,
  MESH_FACES,
  MESH_UVS,
  MESH_FACE_UVS,
  MESH_CREASES,
  MESH_CORNERS,
  MESH_HOLES,
  MESH_EDITS,
  MESH_COLOR,
  MESH_MEMBERS
};
static const char *const mesh_members[] = {"name",    "shape",   "positions", "faces", "uvs",   "face_uvs",
                                           "creases", "corners", "holes",     "edits", "color", NULL};

typedef struct mesh_reader {
  tw_model *model;
  const api_making *making;
  uint64_t faces; /* made by shapes so far */
  uint64_t unused_uvs;
} mesh_reader;

static tw_status read_points(const api_value *array, uint32_t width, uint32_t *count, float **out) {
  tw_status status = api_json_count(array, UINT32_MAX, count);
  *out = api_json_allocate(array->json, *count, width * sizeof **out, &status);
  return *out ? api_json_float_rows(array, width, width, *out) : status;
}

/* Reads [[i, j, …], …] into offsets [count + 1] and indices. */
static tw_status read_polygons(const api_value *array, uint32_t *count, uint32_t **offsets,
                               uint32_t **indices) {
  tw_status status = api_json_count(array, UINT32_MAX, count);
  *offsets = api_json_allocate(array->json, (size_t)*count + 1, sizeof **offsets, &status);
  if (status == TW_OK) status = api_json_index_offsets(array, *offsets);
  *indices =
      status == TW_OK ? api_json_allocate(array->json, (*offsets)[*count], sizeof **indices, &status) : NULL;
  return *indices ? api_json_index_rows(array, *indices) : status;
}

/* Reads the corners' UV indices: as many for each face as the face has corners. */
static tw_status read_face_uvs(const api_value *array, const tw_mesh *mesh, uint32_t **corners) {
  uint32_t face_count, *offsets;
  tw_status status = read_polygons(array, &face_count, &offsets, corners);
  if (status != TW_OK) return status;
  if (face_count != mesh->face_count)
    return api_json_fail(array, TW_INVALID, "%u %s UVs, and there %s %u", face_count,
                         tw_plural(face_count, "face has", "faces have"),
                         tw_plural(mesh->face_count, "is", "are"), mesh->face_count);
  for (uint32_t i = 0; i < face_count; i++) {
    if (offsets[i + 1] == mesh->face_offsets[i + 1]) continue;
    const api_value face = {array->json, NULL, {&array->at, NULL, i}};
    return api_json_fail(&face, TW_INVALID, "the face has another number of corners");
  }
  return TW_OK;
}

/* Gives each point its own UV. The corners are copied: welding rewrites the corners of points and of UVs
 * separately. */
static tw_status read_point_uvs(const api_value *array, const tw_mesh *mesh, uint32_t count,
                                uint32_t **corners) {
  tw_status status = TW_OK;
  if (count != mesh->point_count)
    return api_json_fail(array, TW_INVALID,
                         "without face_uvs there must be as many UVs as positions, not %u for %u", count,
                         mesh->point_count);
  *corners = api_json_allocate(array->json, mesh->corner_count, sizeof **corners, &status);
  if (*corners) memcpy(*corners, mesh->corners, mesh->corner_count * sizeof **corners);
  return status;
}

/* Counts the UVs that no corner has. */
static tw_status count_unused_uvs(mesh_reader *reader, const api_value *array, const tw_mesh *mesh) {
  const tw_uv_set *uvs = &mesh->uv_sets[0];
  bool *is_used = tw_alloc_zero(uvs->value_count, sizeof *is_used);
  if (!is_used) return api_json_no_memory(array->json);
  for (uint32_t c = 0; c < mesh->corner_count; c++) /* checked later */
    if (uvs->corners[c] < uvs->value_count) is_used[uvs->corners[c]] = true;
  for (uint32_t i = 0; i < uvs->value_count; i++) reader->unused_uvs += !is_used[i];
  tw_free(is_used);
  return TW_OK;
}

/* Reads UVs, turning v from down, as in glTF, to up, as in meshes. */
static tw_status read_uvs(mesh_reader *reader, const api_value *members, tw_mesh *mesh) {
  const api_value *array = &members[MESH_UVS];
  uint32_t value_count, *corners;
  float *values;
  tw_status status = read_points(array, 2, &value_count, &values);
  if (status != TW_OK) return status;
  for (uint32_t i = 0; i < value_count; i++) values[2 * (size_t)i + 1] = 1 - values[2 * (size_t)i + 1];
  status = members[MESH_FACE_UVS].item ? read_face_uvs(&members[MESH_FACE_UVS], mesh, &corners)
                                       : read_point_uvs(array, mesh, value_count, &corners);
  if (status != TW_OK) return status;
  mesh->uv_set_count = 1;
  mesh->uv_sets[0] = (tw_uv_set){value_count, values, corners};
  return members[MESH_FACE_UVS].item ? count_unused_uvs(reader, array, mesh)
                                     : TW_OK; /* points without faces are told */
}

static tw_status fail_without_number(const api_value *value) {
  return api_json_fail(value, TW_SYNTAX, "a number is expected");
}

/* Sharpness over TW_SHARPNESS_INFINITE becomes that. */
static tw_status read_sharpness(const api_value *value, float *out) {
  tw_status status = value->item ? api_json_float(value, out) : fail_without_number(value);
  if (status == TW_OK && *out < 0) return api_json_fail(value, TW_INVALID, "sharpness is 0 or more");
  if (status == TW_OK && *out > TW_SHARPNESS_INFINITE) *out = TW_SHARPNESS_INFINITE;
  return status;
}

/* Creases or corners: their points, `width` each, and sharpness. */
typedef struct tag_list {
  uint32_t *points;
  float *sharpness;
} tag_list;

static tw_status read_crease(void *context, const api_value *object) {
  static const char *const names[] = {"edge", "sharpness", NULL};
  const tag_list *out = context;
  uint32_t ends, index = object->at.index;
  api_value values[2];
  tw_status status = api_json_members(object, names, values);
  if (status == TW_OK) status = api_json_count(&values[0], UINT32_MAX, &ends);
  if (status == TW_OK && ends != 2)
    status = api_json_fail(&values[0], TW_SYNTAX, "the two points of an edge are expected");
  if (status == TW_OK) status = api_json_index_list(&values[0], out->points + 2 * (size_t)index);
  return status == TW_OK ? read_sharpness(&values[1], out->sharpness + index) : status;
}

static tw_status read_corner(void *context, const api_value *object) {
  static const char *const names[] = {"vertex", "sharpness", NULL};
  const tag_list *out = context;
  uint32_t index = object->at.index;
  api_value values[2];
  tw_status status = api_json_members(object, names, values);
  if (status == TW_OK && !values[0].item) status = fail_without_number(&values[0]);
  if (status == TW_OK) status = api_json_index(&values[0], out->points + index);
  return status == TW_OK ? read_sharpness(&values[1], out->sharpness + index) : status;
}

static tw_status read_tags(const api_value *array, uint32_t width, api_json_reader *read, uint32_t *count,
                           tag_list *out) {
  tw_status status = api_json_count(array, UINT32_MAX, count);
  out->points = api_json_allocate(array->json, *count, width * sizeof *out->points, &status);
  out->sharpness = api_json_allocate(array->json, *count, sizeof *out->sharpness, &status);
  return out->sharpness ? api_json_each(array, read, out) : status;
}

static tw_status read_holes(const api_value *array, tw_mesh *mesh) {
  tw_status status = api_json_count(array, UINT32_MAX, &mesh->hole_count);
  uint32_t *holes = api_json_allocate(array->json, mesh->hole_count, sizeof *holes, &status);
  mesh->holes = holes;
  return holes ? api_json_index_list(array, holes) : status;
}

/* Reads the positions of a mesh that may be far from the origin again, in double, and gives it a frame of its
 * own if it is. */
static tw_status find_frame(const api_value *array, tw_mesh *mesh, float *positions) {
  for (uint32_t c = 0; c < mesh->corner_count; c++)
    if (mesh->corners[c] >= mesh->point_count) return TW_OK; /* refused later, with its place */
  if (!tw_points_may_be_far(positions, mesh->corners, mesh->corner_count)) return TW_OK;
  double *exact = tw_alloc(mesh->point_count, 3 * sizeof *exact);
  if (!exact) return api_json_no_memory(array->json);
  tw_status status = api_json_double_rows(array, 3, exact);
  if (status == TW_OK && tw_points_find_frame(exact, mesh->corners, mesh->corner_count, mesh->origin))
    tw_points_enter_frame(exact, mesh->point_count, mesh->origin, positions);
  tw_free(exact);
  return status;
}

static tw_status read_topology(const api_value *members, tw_mesh *mesh) {
  static const uint32_t no_offsets[1] = {0};
  float *positions;
  uint32_t *offsets, *corners;
  tw_status status = read_points(&members[MESH_POSITIONS], 3, &mesh->point_count, &positions);
  mesh->positions = positions;
  mesh->face_offsets = no_offsets;
  if (status != TW_OK || !members[MESH_FACES].item) return status;
  status = read_polygons(&members[MESH_FACES], &mesh->face_count, &offsets, &corners);
  if (status != TW_OK) return status;
  mesh->face_offsets = offsets;
  mesh->corners = corners;
  mesh->corner_count = offsets[mesh->face_count];
  return find_frame(&members[MESH_POSITIONS], mesh, positions);
}

/* The word before a count of tw_shape_counts, which is 2^62 for all that is larger. */
static const char *more_than(uint64_t number) {
  return number >> 62 ? "over " : "";
}

/* Checks the limits on the shape's counts before anything is allocated. */
static tw_status read_shape(mesh_reader *reader, const api_value *members, tw_mesh *mesh) {
  const api_value *value = &members[MESH_SHAPE];
  const api_making *making = reader->making;
  static const int others[] = {MESH_POSITIONS, MESH_FACES, MESH_UVS, MESH_FACE_UVS};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++)
    if (members[others[i]].item)
      return api_json_fail(&members[others[i]], TW_SYNTAX, "a mesh with a shape has no %s of its own",
                           mesh_members[others[i]]);
  tw_shape shape;
  tw_shape_counts counts;
  tw_status status = api_shape_in(value, &shape, &counts);
  if (status != TW_OK) return status;
  if (counts.faces > making->faces_max - reader->faces)
    return api_json_fail(
        value, TW_LIMIT,
        "the shape would have %s%llu points and %s%llu faces; shapes may have %llu faces in all",
        more_than(counts.points), (unsigned long long)counts.points, more_than(counts.faces),
        (unsigned long long)counts.faces, (unsigned long long)making->faces_max);
  reader->faces += counts.faces;
  return tw_shape_make(&shape, value->json->arena, mesh, value->json->error);
}

static tw_status edit_mesh(const mesh_reader *reader, const api_value *object, const api_value *edits,
                           tw_mesh *mesh) {
  tw_mesh before = *mesh;
  if (!edits->item) return TW_OK;
  tw_status status = tw_mesh_check(&before, object->json->error, NULL);
  if (status != TW_OK) return api_json_fail_within(object, status);
  const api_edit_call call = {&before, NULL, reader->making};
  return api_edits_apply(edits, &call, mesh, NULL);
}

/* Gives all faces a material of the colour, named after the mesh. */
static tw_status paint_mesh(const mesh_reader *reader, const api_value *value, tw_mesh *mesh) {
  tw_model *model = reader->model;
  tw_status status = TW_OK;
  if (!value->item) return TW_OK;
  if (!model->material_colors) {
    model->material_names =
        api_json_allocate(value->json, model->mesh_count, sizeof *model->material_names, &status);
    model->material_colors = api_json_allocate(value->json, 3 * (size_t)model->mesh_count,
                                               sizeof *model->material_colors, &status);
  }
  int32_t *materials = api_json_allocate(value->json, mesh->face_count, sizeof *materials, &status);
  if (status != TW_OK) return status;
  float *color = model->material_colors + 3 * (size_t)model->material_count;
  status = api_json_floats(value, 3, color);
  if (status != TW_OK) return status;
  for (int i = 0; i < 3; i++)
    if (!(color[i] >= 0 && color[i] <= 1))
      return api_json_fail(value, TW_SYNTAX, "red, green and blue are numbers from 0 to 1");
  for (uint32_t face = 0; face < mesh->face_count; face++) materials[face] = (int32_t)model->material_count;
  mesh->face_materials = materials;
  model->material_names[model->material_count++] = mesh->name;
  return TW_OK;
}

static tw_status read_mesh(void *context, const api_value *object) {
  mesh_reader *reader = context;
  tw_mesh *mesh = &reader->model->meshes[object->at.index];
  api_value members[MESH_MEMBERS];
  tag_list creases = {0}, corners = {0};
  tw_mesh_init(mesh);
  tw_status status = api_json_members(object, mesh_members, members);
  if (status == TW_OK)
    status = members[MESH_SHAPE].item ? read_shape(reader, members, mesh) : read_topology(members, mesh);
  if (status == TW_OK) status = api_json_name(&members[MESH_NAME], &mesh->name);
  if (status == TW_OK && (members[MESH_UVS].item || members[MESH_FACE_UVS].item))
    status = read_uvs(reader, members, mesh);
  if (status == TW_OK)
    status = read_tags(&members[MESH_CREASES], 2, read_crease, &mesh->crease_count, &creases);
  if (status == TW_OK)
    status = read_tags(&members[MESH_CORNERS], 1, read_corner, &mesh->sharp_point_count, &corners);
  mesh->crease_edges = creases.points;
  mesh->crease_sharpness = creases.sharpness;
  mesh->sharp_points = corners.points;
  mesh->point_sharpness = corners.sharpness;
  if (status == TW_OK) status = read_holes(&members[MESH_HOLES], mesh);
  if (status == TW_OK) status = edit_mesh(reader, object, &members[MESH_EDITS], mesh);
  return status == TW_OK ? paint_mesh(reader, &members[MESH_COLOR], mesh) : status;
}

/* ---- nodes ----------------------------------------------------------------------------------- */

typedef struct node_reader {
  const api_names *meshes, *nodes;
  tw_model *model;
} node_reader;

/* Keeps the exact translation of a node where floats round it. */
static tw_status keep_place(const api_value *translation, tw_node *node) {
  double exact[3] = {0};
  tw_status status = api_json_doubles(translation, 3, exact);
  bool is_rounded = false;
  for (int c = 0; c < 3; c++) is_rounded |= exact[c] != (double)node->rest.translation[c];
  if (status != TW_OK || !is_rounded) return status;
  double *place = tw_arena_alloc(translation->json->arena, 3, sizeof *place);
  if (!place) return api_json_no_memory(translation->json);
  memcpy(place, exact, sizeof exact);
  node->place = place;
  return TW_OK;
}

static tw_status read_node(void *context, const api_value *object) {
  enum { NAME, PARENT, MESH, TRANSLATION, ROTATION, SCALE, MEMBERS };
  static const char *const members[] = {"name", "parent", "mesh", "translation", "rotation", "scale", NULL};
  const node_reader *reader = context;
  tw_node *node = &reader->model->nodes[object->at.index];
  api_value values[MEMBERS];
  *node = (tw_node){.parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_name(&values[NAME], &node->name);
  if (status == TW_OK) status = api_name_find(&values[PARENT], reader->nodes, &node->parent);
  if (status == TW_OK) status = api_name_find(&values[MESH], reader->meshes, &node->mesh);
  if (status == TW_OK) status = api_json_floats(&values[TRANSLATION], 3, node->rest.translation);
  if (status == TW_OK) status = keep_place(&values[TRANSLATION], node);
  if (status == TW_OK) status = api_json_floats(&values[ROTATION], 4, node->rest.rotation);
  if (status == TW_OK) status = api_json_floats(&values[SCALE], 3, node->rest.scale);
  return status;
}

/* ---- document -------------------------------------------------------------------------------- */

enum { MESHES, NODES, CLIPS, PARTS };

/* Counts the meshes, nodes and clips, and allocates them. */
static tw_status open_document(const api_value *root, api_value *parts, tw_model *model) {
  static const char *const members[] = {"meshes", "nodes", "clips", NULL};
  static const uint32_t most[PARTS] = {TW_MESHES_MAX, TW_NODES_MAX, TW_CLIPS_MAX};
  uint32_t *const counts[PARTS] = {&model->mesh_count, &model->node_count, &model->clip_count};
  tw_status status = api_json_members(root, members, parts);
  for (int i = 0; i < PARTS && status == TW_OK; i++) status = api_json_count(&parts[i], most[i], counts[i]);
  if (status != TW_OK) return status;
  tw_arena *arena = root->json->arena;
  model->meshes = tw_arena_alloc(arena, model->mesh_count, sizeof *model->meshes);
  model->nodes = tw_arena_alloc(arena, model->node_count, sizeof *model->nodes);
  model->clips = tw_arena_alloc(arena, model->clip_count, sizeof *model->clips);
  return model->meshes && model->nodes && model->clips ? TW_OK : api_json_no_memory(root->json);
}

/* scratch: holds the api_names while the parts are read. */
static tw_status read_parts(const api_value *parts, const api_making *making, tw_arena *scratch,
                            tw_model *model) {
  api_names meshes, nodes, clips;
  tw_status status = api_names_read(&parts[MESHES], model->mesh_count, "mesh", scratch, &meshes);
  if (status != TW_OK) return status;
  /* Without nodes tw_model_finish makes one for each mesh, with the mesh's name. */
  bool has_nodes = model->node_count > 0;
  status = api_names_read(&parts[has_nodes ? NODES : MESHES],
                          has_nodes ? model->node_count : model->mesh_count, "node", scratch, &nodes);
  if (status == TW_OK) status = api_names_read(&parts[CLIPS], model->clip_count, "clip", scratch, &clips);
  clips.has_places = true;
  mesh_reader reader = {.model = model, .making = making};
  if (status == TW_OK) status = api_json_each(&parts[MESHES], read_mesh, &reader);
  if (status == TW_OK)
    status = api_json_each(&parts[NODES], read_node, &(node_reader){&meshes, &nodes, model});
  if (status == TW_OK)
    status = api_json_each(&parts[CLIPS], api_clip_in, &(api_clips_reader){&nodes, &clips, model, 0});
  tw_model_warn_count(model, reader.unused_uvs, "texture coordinate of no corner is left out",
                      "texture coordinates of no corner are left out");
  return status;
}

static tw_status read_document(const char *text, size_t size, const api_making *making, tw_model *model,
                               tw_error *error) {
  api_json json = {model->arena, error, NULL};
  api_value root, parts[PARTS];
  tw_status status = api_json_open(&json, text, size, API_JSON_VALUES_MAX, &root);
  if (status != TW_OK) return status;
  tw_arena *scratch = tw_arena_create();
  status = scratch ? open_document(&root, parts, model) : api_json_no_memory(&json);
  if (status == TW_OK) status = read_parts(parts, making, scratch, model);
  tw_arena_destroy(scratch);
  api_json_close(&root);
  return status;
}

tw_status api_model_from_json(const char *text, size_t size, const api_making *making, tw_model **out,
                              tw_error *error) {
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_JSON;
  tw_status status = read_document(text, size, making, model, error);
  return tw_model_end(model, status, out, error);
}
