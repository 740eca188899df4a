/* tweend JSON: one mesh. Indices are checked for range by tw_mesh_check, when the model is finished. */
#include "json_in.h"

enum { NAME, POSITIONS, FACES, UVS, FACE_UVS, CREASES, CORNERS, HOLES, MEMBERS };
static const char *const members[] = {"name",    "positions", "faces", "uvs", "face_uvs",
                                      "creases", "corners",   "holes", NULL};

/* The members of the mesh under way. */
typedef struct mesh_source {
  const api_json *json;
  const cJSON *values[MEMBERS];
  api_place places[MEMBERS];
} mesh_source;

/* Reads [[i, j, …], …] into offsets [count + 1] and indices. */
static tw_status read_polygons(const mesh_source *source, int member, uint32_t *count, uint32_t **offsets,
                               uint32_t **indices) {
  const api_json *json = source->json;
  const api_place *at = &source->places[member];
  const cJSON *array = source->values[member];
  tw_status status = api_json_array(json, at, array, count);
  if (status != TW_OK) return status;
  *offsets = tw_arena_alloc(json->arena, (size_t)*count + 1, sizeof **offsets);
  if (!*offsets) return api_json_no_memory(json);
  uint32_t face = 0;
  for (const cJSON *item = array ? array->child : NULL; item; item = item->next, face++) {
    api_place place = {at, NULL, face};
    uint32_t size;
    status = api_json_array(json, &place, item, &size);
    if (status != TW_OK) return status;
    (*offsets)[face + 1] = (*offsets)[face] + size;
  }
  *indices = tw_arena_alloc(json->arena, (*offsets)[*count], sizeof **indices);
  if (!*indices) return api_json_no_memory(json);
  uint32_t corner = 0;
  face = 0;
  for (const cJSON *item = array ? array->child : NULL; item; item = item->next, face++) {
    api_place face_place = {at, NULL, face};
    api_place place = {&face_place, NULL, 0};
    for (const cJSON *index = item->child; index; index = index->next, place.index++) {
      status = api_json_index(json, &place, index, &(*indices)[corner++]);
      if (status != TW_OK) return status;
    }
  }
  return TW_OK;
}

/* UVs, v down as in glTF, become the mesh's, v up. Without face_uvs each point has its own. */
static tw_status read_uvs(const mesh_source *source, tw_mesh *mesh) {
  const api_json *json = source->json;
  uint32_t value_count, face_count;
  uint32_t *offsets, *corners = (uint32_t *)mesh->corners;
  float *values;
  tw_status status = api_json_rows(json, &source->places[UVS], source->values[UVS], 2, &value_count, &values);
  if (status != TW_OK) return status;
  for (uint32_t i = 0; i < value_count; i++) values[2 * (size_t)i + 1] = 1 - values[2 * (size_t)i + 1];
  if (source->values[FACE_UVS]) {
    status = read_polygons(source, FACE_UVS, &face_count, &offsets, &corners);
    if (status != TW_OK) return status;
    if (face_count != mesh->face_count)
      return api_json_fail(json, &source->places[FACE_UVS], TW_INVALID, "%u faces have UVs, and there are %u",
                           face_count, mesh->face_count);
    for (uint32_t i = 0; i < face_count; i++) {
      if (offsets[i + 1] == mesh->face_offsets[i + 1]) continue;
      api_place place = {&source->places[FACE_UVS], NULL, i};
      return api_json_fail(json, &place, TW_INVALID, "the face has another number of corners");
    }
  } else if (value_count != mesh->point_count) {
    return api_json_fail(json, &source->places[UVS], TW_INVALID,
                         "without face_uvs there must be as many UVs as positions, not %u for %u",
                         value_count, mesh->point_count);
  }
  mesh->uv_set_count = 1;
  mesh->uv_sets[0] = (tw_uv_set){value_count, values, corners};
  return TW_OK;
}

/* Sharpness beyond infinite is infinite. */
static tw_status read_sharpness(const api_json *json, const api_place *at, const cJSON *item, float *out) {
  api_place place = {at, "sharpness", 0};
  tw_status status = api_json_float(json, &place, item, out);
  if (status == TW_OK && *out < 0) return api_json_fail(json, &place, TW_INVALID, "sharpness is 0 or more");
  if (status == TW_OK && *out > TW_SHARPNESS_INFINITE) *out = TW_SHARPNESS_INFINITE;
  return status;
}

static tw_status read_crease(const api_json *json, const api_place *at, const cJSON *item, uint32_t edge[2],
                             float *sharpness) {
  static const char *const names[] = {"edge", "sharpness", NULL};
  const cJSON *values[2];
  tw_status status = api_json_members(json, at, item, names, values);
  if (status != TW_OK) return status;
  api_place edge_place = {at, "edge", 0};
  uint32_t ends;
  status = api_json_array(json, &edge_place, values[0], &ends);
  if (status == TW_OK && ends != 2)
    status = api_json_fail(json, &edge_place, TW_SYNTAX, "the two points of an edge are expected");
  const cJSON *end = status == TW_OK ? values[0]->child : NULL;
  for (uint32_t i = 0; end && status == TW_OK; end = end->next, i++) {
    api_place place = {&edge_place, NULL, i};
    status = api_json_index(json, &place, end, &edge[i]);
  }
  return status == TW_OK ? read_sharpness(json, at, values[1], sharpness) : status;
}

static tw_status read_creases(const mesh_source *source, tw_mesh *mesh) {
  const api_json *json = source->json;
  tw_status status =
      api_json_array(json, &source->places[CREASES], source->values[CREASES], &mesh->crease_count);
  if (status != TW_OK) return status;
  uint32_t *edges = tw_arena_alloc(json->arena, mesh->crease_count, 2 * sizeof *edges);
  float *sharpness = tw_arena_alloc(json->arena, mesh->crease_count, sizeof *sharpness);
  if (!edges || !sharpness) return api_json_no_memory(json);
  const cJSON *item = mesh->crease_count ? source->values[CREASES]->child : NULL;
  for (uint32_t i = 0; item && status == TW_OK; item = item->next, i++) {
    api_place place = {&source->places[CREASES], NULL, i};
    status = read_crease(json, &place, item, edges + 2 * (size_t)i, &sharpness[i]);
  }
  mesh->crease_edges = edges;
  mesh->crease_sharpness = sharpness;
  return status;
}

static tw_status read_corner(const api_json *json, const api_place *at, const cJSON *item, uint32_t *point,
                             float *sharpness) {
  static const char *const names[] = {"vertex", "sharpness", NULL};
  const cJSON *values[2];
  tw_status status = api_json_members(json, at, item, names, values);
  api_place place = {at, "vertex", 0};
  if (status == TW_OK) status = api_json_index(json, &place, values[0], point);
  return status == TW_OK ? read_sharpness(json, at, values[1], sharpness) : status;
}

static tw_status read_corners(const mesh_source *source, tw_mesh *mesh) {
  const api_json *json = source->json;
  tw_status status =
      api_json_array(json, &source->places[CORNERS], source->values[CORNERS], &mesh->sharp_point_count);
  if (status != TW_OK) return status;
  uint32_t *points = tw_arena_alloc(json->arena, mesh->sharp_point_count, sizeof *points);
  float *sharpness = tw_arena_alloc(json->arena, mesh->sharp_point_count, sizeof *sharpness);
  if (!points || !sharpness) return api_json_no_memory(json);
  const cJSON *item = mesh->sharp_point_count ? source->values[CORNERS]->child : NULL;
  for (uint32_t i = 0; item && status == TW_OK; item = item->next, i++) {
    api_place place = {&source->places[CORNERS], NULL, i};
    status = read_corner(json, &place, item, &points[i], &sharpness[i]);
  }
  mesh->sharp_points = points;
  mesh->point_sharpness = sharpness;
  return status;
}

static tw_status read_holes(const mesh_source *source, tw_mesh *mesh) {
  const api_json *json = source->json;
  tw_status status = api_json_array(json, &source->places[HOLES], source->values[HOLES], &mesh->hole_count);
  if (status != TW_OK) return status;
  uint32_t *holes = tw_arena_alloc(json->arena, mesh->hole_count, sizeof *holes);
  if (!holes) return api_json_no_memory(json);
  const cJSON *item = mesh->hole_count ? source->values[HOLES]->child : NULL;
  for (uint32_t i = 0; item && status == TW_OK; item = item->next, i++) {
    api_place place = {&source->places[HOLES], NULL, i};
    status = api_json_index(json, &place, item, &holes[i]);
  }
  mesh->holes = holes;
  return status;
}

static tw_status read_topology(const mesh_source *source, tw_mesh *mesh) {
  float *positions = NULL;
  uint32_t *offsets = NULL, *corners = NULL;
  tw_status status = api_json_rows(source->json, &source->places[POSITIONS], source->values[POSITIONS], 3,
                                   &mesh->point_count, &positions);
  if (status == TW_OK) status = read_polygons(source, FACES, &mesh->face_count, &offsets, &corners);
  if (status != TW_OK) return status;
  mesh->positions = positions;
  mesh->face_offsets = offsets;
  mesh->corners = corners;
  mesh->corner_count = offsets[mesh->face_count];
  return TW_OK;
}

tw_status api_mesh_from_json(const api_json *json, const api_place *at, const cJSON *item, tw_mesh *out) {
  mesh_source source = {.json = json};
  tw_mesh_init(out);
  tw_status status = api_json_members(json, at, item, members, source.values);
  for (int i = 0; i < MEMBERS; i++) source.places[i] = (api_place){at, members[i], 0};
  if (status == TW_OK) status = api_json_text(json, &source.places[NAME], source.values[NAME], &out->name);
  if (status == TW_OK) status = read_topology(&source, out);
  bool has_uvs = source.values[UVS] || source.values[FACE_UVS];
  if (status == TW_OK && has_uvs) status = read_uvs(&source, out);
  if (status == TW_OK) status = read_creases(&source, out);
  if (status == TW_OK) status = read_corners(&source, out);
  if (status == TW_OK) status = read_holes(&source, out);
  return status;
}
