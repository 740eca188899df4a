/* tweend JSON: the document, its meshes, nodes and clips, and references by name. The values of indices and
 * keys are checked by tw_model_finish. */
#include "json_in.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api.h"
#include "json_value.h"
#include "near_names.h"
#include "shape_in.h"
#include "tweend/mix.h"

/* ---- names ----------------------------------------------------------------------------------- */

typedef struct name {
  const char *text; /* NULL for an element without a name */
  uint32_t index;
} name;

/* The names of all elements of one kind, for finding these. An element without a name is called
 * kind_index. */
typedef struct names {
  const char *kind; /* "node" */
  tw_arena *arena;  /* of the arrays below */
  uint32_t count, sorted_count;
  const char **texts; /* [count], NULL where there is none */
  name *sorted;       /* [sorted_count] the names that are there, by text, then index */
} names;

static int compare_names(const void *a, const void *b) {
  const name *left = a, *right = b;
  int order = strcmp(left->text, right->text);
  if (order != 0) return order;
  return left->index < right->index ? -1 : left->index > right->index;
}

/* Any other mistake in the element is reported by the element's own reader. */
static tw_status collect_name(void *context, const api_value *object) {
  names *out = context;
  const char *text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object->item, "name"));
  if (!text || !text[0]) return TW_OK;
  const char *copy = tw_arena_text(out->arena, text, strlen(text));
  if (!copy) return api_json_no_memory(object->json);
  out->texts[object->at.index] = copy;
  out->sorted_count++;
  return TW_OK;
}

static tw_status read_names(const api_value *array, uint32_t count, const char *kind, tw_arena *arena,
                            names *out) {
  *out = (names){.kind = kind, .arena = arena, .count = count};
  out->texts = tw_arena_alloc(arena, count, sizeof *out->texts);
  if (!out->texts) return api_json_no_memory(array->json);
  tw_status status = api_json_each(array, collect_name, out);
  if (status != TW_OK) return status;
  out->sorted = tw_arena_alloc(arena, out->sorted_count, sizeof *out->sorted);
  if (!out->sorted) return api_json_no_memory(array->json);
  uint32_t next = 0;
  for (uint32_t i = 0; i < count; i++)
    if (out->texts[i]) out->sorted[next++] = (name){out->texts[i], i};
  if (next > 0) qsort(out->sorted, next, sizeof *out->sorted, compare_names);
  return TW_OK;
}

/* The element without a name that is called kind_index; TW_NO_INDEX for none. */
static uint32_t find_unnamed(const names *all, const char *text) {
  char made_up[32];
  size_t length = strlen(all->kind);
  if (strncmp(text, all->kind, length) != 0 || text[length] != '_') return TW_NO_INDEX;
  unsigned long index = strtoul(text + length + 1, NULL, 10);
  if (index >= all->count || all->texts[index]) return TW_NO_INDEX;
  snprintf(made_up, sizeof made_up, "%s_%lu", all->kind, index);
  return strcmp(made_up, text) == 0 ? (uint32_t)index : TW_NO_INDEX;
}

static tw_status fail_absent(const api_value *value, const names *all, const char *text) {
  api_near near = {.name = text, .length = strlen(text)};
  for (uint32_t i = 0; i < all->sorted_count; i++) api_near_consider(&near, all->sorted[i].text);
  return api_json_fail(value, TW_INVALID, "no %s is called \"%.60s\"%s", all->kind, text,
                       api_near_print(&near, "; ").text);
}

/* Reads a reference by name to one of `all`; an absent member leaves *out alone. O(log n). */
static tw_status read_reference(const api_value *value, const names *all, uint32_t *out) {
  if (!value->item) return TW_OK;
  const char *text = cJSON_GetStringValue(value->item);
  if (!text) return api_json_fail(value, TW_SYNTAX, "the name of a %s is expected", all->kind);
  uint32_t low = 0, high = all->sorted_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(all->sorted[middle].text, text) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  uint32_t unnamed = find_unnamed(all, text), end = low;
  while (end < all->sorted_count && end < low + 2 && strcmp(all->sorted[end].text, text) == 0) end++;
  uint32_t found = end - low + (unnamed != TW_NO_INDEX);
  if (found == 0) return fail_absent(value, all, text);
  if (found > 1)
    return api_json_fail(value, TW_INVALID, "more than one %s is called \"%.60s\"", all->kind, text);
  *out = unnamed != TW_NO_INDEX ? unnamed : all->sorted[low].index;
  return TW_OK;
}

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
} mesh_reader;

/* [count] elements in the arena. NULL for no elements, or without memory, which sets *status. */
static void *allocate(const api_json *json, size_t count, size_t size, tw_status *status) {
  if (*status != TW_OK || count == 0) return NULL;
  void *memory = tw_arena_alloc_raw(json->arena, count, size);
  if (!memory) *status = api_json_no_memory(json);
  return memory;
}

static tw_status read_points(const api_value *array, uint32_t width, uint32_t *count, float **out) {
  tw_status status = api_json_count(array, UINT32_MAX, count);
  *out = allocate(array->json, *count, width * sizeof **out, &status);
  return *out ? api_json_float_rows(array, width, width, *out) : status;
}

/* Reads [[i, j, …], …] into offsets [count + 1] and indices. */
static tw_status read_polygons(const api_value *array, uint32_t *count, uint32_t **offsets,
                               uint32_t **indices) {
  tw_status status = api_json_count(array, UINT32_MAX, count);
  *offsets = allocate(array->json, (size_t)*count + 1, sizeof **offsets, &status);
  if (status == TW_OK) status = api_json_index_offsets(array, *offsets);
  *indices = status == TW_OK ? allocate(array->json, (*offsets)[*count], sizeof **indices, &status) : NULL;
  return *indices ? api_json_index_rows(array, *indices) : status;
}

/* Reads the corners' UV indices: as many for each face as the face has corners. */
static tw_status read_face_uvs(const api_value *array, const tw_mesh *mesh, uint32_t **corners) {
  uint32_t face_count, *offsets;
  tw_status status = read_polygons(array, &face_count, &offsets, corners);
  if (status != TW_OK) return status;
  if (face_count != mesh->face_count)
    return api_json_fail(array, TW_INVALID, "%u faces have UVs, and there are %u", face_count,
                         mesh->face_count);
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
  *corners = allocate(array->json, mesh->corner_count, sizeof **corners, &status);
  if (*corners) memcpy(*corners, mesh->corners, mesh->corner_count * sizeof **corners);
  return status;
}

/* Reads UVs, turning v from down, as in glTF, to up, as in meshes. */
static tw_status read_uvs(const api_value *members, tw_mesh *mesh) {
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
  return TW_OK;
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
  out->points = allocate(array->json, *count, width * sizeof *out->points, &status);
  out->sharpness = allocate(array->json, *count, sizeof *out->sharpness, &status);
  return out->sharpness ? api_json_each(array, read, out) : status;
}

static tw_status read_holes(const api_value *array, tw_mesh *mesh) {
  tw_status status = api_json_count(array, UINT32_MAX, &mesh->hole_count);
  uint32_t *holes = allocate(array->json, mesh->hole_count, sizeof *holes, &status);
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
  return api_edits_apply(edits, &call, mesh, NULL, NULL);
}

/* Gives all faces a material of the colour, named after the mesh. */
static tw_status paint_mesh(const mesh_reader *reader, const api_value *value, tw_mesh *mesh) {
  tw_model *model = reader->model;
  tw_status status = TW_OK;
  if (!value->item) return TW_OK;
  if (!model->material_colors) {
    model->material_names = allocate(value->json, model->mesh_count, sizeof *model->material_names, &status);
    model->material_colors =
        allocate(value->json, 3 * (size_t)model->mesh_count, sizeof *model->material_colors, &status);
  }
  int32_t *materials = allocate(value->json, mesh->face_count, sizeof *materials, &status);
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
    status = read_uvs(members, mesh);
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

/* ---- clips ----------------------------------------------------------------------------------- */

enum {
  TRACK_NODE,
  TRACK_PATH,
  TRACK_INTERPOLATION,
  TRACK_ORDER,
  TRACK_UNIT,
  TRACK_TIMES,
  TRACK_QUATERNIONS,
  TRACK_EULERS,
  TRACK_AXIS_ANGLES,
  TRACK_VALUES,
  TRACK_IN_TANGENTS,
  TRACK_OUT_TANGENTS,
  TRACK_MEMBERS
};
static const char *const track_members[] = {
    "node",   "path",        "interpolation", "order",       "unit",         "times", "quaternions",
    "eulers", "axis_angles", "values",        "in_tangents", "out_tangents", NULL};

/* values here and below: [TRACK_MEMBERS] */
static tw_status read_interpolation(const api_value *values, tw_track_keys *track) {
  /* "slerp" is another word for glTF's LINEAR. */
  enum { SLERP = TW_EULER + 1 };
  static const char *const choices[] = {"step",  "linear", "cubicspline", "nlerp",
                                        "squad", "euler",  "slerp",       NULL};
  int choice = TW_LINEAR;
  tw_status status = api_json_choice(&values[TRACK_INTERPOLATION], choices, &choice);
  if (status != TW_OK) return status;
  bool for_all = choice == TW_STEP || choice == TW_LINEAR || choice == TW_CUBICSPLINE;
  if (track->path != TW_ROTATION && !for_all)
    return api_json_fail(&values[TRACK_INTERPOLATION], TW_INVALID, "this interpolation is for rotations");
  track->interpolation = choice == SLERP ? TW_LINEAR : (tw_interpolation)choice;
  return TW_OK;
}

/* Finds the one member that holds the keys. */
static tw_status find_keys(const api_value *object, const api_value *values, const tw_track_keys *track,
                           int *member) {
  static const int forms[] = {TRACK_QUATERNIONS, TRACK_EULERS, TRACK_AXIS_ANGLES, TRACK_VALUES};
  *member = -1;
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    if (!values[forms[i]].item) continue;
    if (*member >= 0)
      return api_json_fail(&values[forms[i]], TW_SYNTAX, "the keys are given as %s already",
                           track_members[*member]);
    *member = forms[i];
  }
  bool is_rotation = track->path == TW_ROTATION;
  if (*member < 0)
    return api_json_fail(object, TW_SYNTAX, "the track has no %s",
                         is_rotation ? "quaternions, eulers or axis_angles" : "values");
  if (is_rotation == (*member == TRACK_VALUES))
    return api_json_fail(&values[*member], TW_SYNTAX,
                         is_rotation ? "a rotation's keys are quaternions, eulers or axis_angles"
                                     : "only rotations have such keys");
  return TW_OK;
}

static tw_status read_times(const api_value *object, const api_value *array, tw_track_keys *track) {
  if (!array->item) return api_json_fail(object, TW_SYNTAX, "the track has no times");
  tw_status status = api_json_count(array, UINT32_MAX, &track->key_count);
  if (status != TW_OK) return status;
  if (track->key_count == 0) return api_json_fail(array, TW_INVALID, "a track needs a key");
  float *times = allocate(array->json, track->key_count, sizeof *times, &status);
  track->times = times;
  return times ? api_json_float_list(array, times) : status;
}

/* Checks that the array is there, with a row for each key. */
static tw_status check_rows(const api_value *object, const api_value *array, const tw_track_keys *track) {
  uint32_t count;
  if (!array->item) return api_json_fail(object, TW_SYNTAX, "the track has no %s", array->at.name);
  tw_status status = api_json_count(array, UINT32_MAX, &count);
  if (status != TW_OK || count == track->key_count) return status;
  return api_json_fail(array, TW_INVALID, "%u keys for %u times", count, track->key_count);
}

/* Reads values, or quaternions; with tangents interleaved as in glTF: in-tangent, value, out-tangent. */
static tw_status read_values(const api_value *object, const api_value *values, int member,
                             tw_track_keys *track) {
  const api_value *const parts[] = {&values[TRACK_IN_TANGENTS], &values[member], &values[TRACK_OUT_TANGENTS]};
  bool is_spline = track->interpolation == TW_CUBICSPLINE;
  for (int i = 0; i < 3; i += 2)
    if (!is_spline && parts[i]->item)
      return api_json_fail(parts[i], TW_SYNTAX, "tangents are for cubicspline");
  size_t first = is_spline ? 0 : 1, count = is_spline ? 3 : 1, stride = count * track->width;
  tw_status status = TW_OK;
  for (size_t i = 0; i < count && status == TW_OK; i++) status = check_rows(object, parts[first + i], track);
  float *out = allocate(object->json, track->key_count, stride * sizeof *out, &status);
  for (size_t i = 0; i < count && status == TW_OK; i++)
    status = api_json_float_rows(parts[first + i], track->width, stride, out + i * track->width);
  track->values = out;
  return status;
}

/* Reads Euler triples or axis-angle keys, into radians. */
static tw_status read_angles(const api_value *object, const api_value *values, int member,
                             tw_track_keys *track) {
  static const char *const units[] = {"radians", "degrees", NULL};
  int order = TW_XYZ, unit = 0;
  tw_status status = api_json_choice(&values[TRACK_ORDER], tw_euler_order_names, &order);
  if (status == TW_OK) status = api_json_choice(&values[TRACK_UNIT], units, &unit);
  if (status == TW_OK) status = check_rows(object, &values[member], track);
  double *angles = allocate(object->json, track->key_count, track->width * sizeof *angles, &status);
  if (status == TW_OK) status = api_json_double_rows(&values[member], track->width, angles);
  if (status != TW_OK) return status;
  size_t first_angle = member == TRACK_EULERS ? 0 : 3;
  for (size_t i = 0; unit == 1 && i < (size_t)track->key_count * track->width; i++)
    if (i % track->width >= first_angle) angles[i] /= TW_DEGREES;
  track->order = (tw_euler_order)order;
  track->angles = angles;
  return TW_OK;
}

static tw_status read_keys(const api_value *object, const api_value *values, tw_track_keys *track) {
  int member;
  tw_status status = find_keys(object, values, track, &member);
  if (status != TW_OK) return status;
  bool is_angles = member == TRACK_EULERS || member == TRACK_AXIS_ANGLES;
  if (values[TRACK_ORDER].item && member != TRACK_EULERS)
    return api_json_fail(&values[TRACK_ORDER], TW_SYNTAX, "order is for eulers");
  if (values[TRACK_UNIT].item && !is_angles)
    return api_json_fail(&values[TRACK_UNIT], TW_SYNTAX, "unit is for eulers and axis_angles");
  track->width = member == TRACK_EULERS || member == TRACK_VALUES ? 3 : 4;
  track->form = member == TRACK_EULERS        ? TW_KEY_EULER
                : member == TRACK_AXIS_ANGLES ? TW_KEY_AXIS_ANGLE
                : member == TRACK_QUATERNIONS ? TW_KEY_QUATERNION
                                              : TW_KEY_VALUES;
  status = read_times(object, &values[TRACK_TIMES], track);
  if (status != TW_OK) return status;
  return is_angles ? read_angles(object, values, member, track) : read_values(object, values, member, track);
}

/* What reading the tracks of a clip needs. */
typedef struct track_reader {
  const names *nodes;
  tw_track_keys *tracks;
} track_reader;

static tw_status read_track(void *context, const api_value *object) {
  static const char *const paths[] = {"translation", "rotation", "scale", NULL};
  const track_reader *reader = context;
  tw_track_keys *track = &reader->tracks[object->at.index];
  api_value values[TRACK_MEMBERS];
  tw_status status = api_json_members(object, track_members, values);
  if (status != TW_OK) return status;
  if (!values[TRACK_NODE].item || !values[TRACK_PATH].item)
    return api_json_fail(object, TW_SYNTAX, "a track needs node and path");
  status = read_reference(&values[TRACK_NODE], reader->nodes, &track->node);
  int path = TW_TRANSLATION;
  if (status == TW_OK) status = api_json_choice(&values[TRACK_PATH], paths, &path);
  track->path = (tw_path)path;
  if (status == TW_OK) status = read_interpolation(values, track);
  return status == TW_OK ? read_keys(object, values, track) : status;
}

/* ---- layers of mixed clips ------------------------------------------------------------------- */

enum {
  LAYER_CLIP,
  LAYER_MODE,
  LAYER_WEIGHT,
  LAYER_SPEED,
  LAYER_OFFSET,
  LAYER_LOOP,
  LAYER_SYNC,
  LAYER_NODES,
  LAYER_REFERENCE,
  LAYER_RETARGET,
  LAYER_MEMBERS
};
static const char *const layer_members[] = {"clip", "mode",  "weight",    "speed",    "offset", "loop",
                                            "sync", "nodes", "reference", "retarget", NULL};

/* What reading the layers of a clip needs. */
typedef struct layer_reader {
  const names *nodes, *clips;
  tw_clip_layer *layers;
} layer_reader;

bool api_clip_is_borrowed(const char *name, size_t length) {
  enum { ID = API_ID_TEXT - 1 };
  return length > ID + 1 && strspn(name, "0123456789abcdef") == ID && name[ID] == '/';
}

/* Reads the name of a clip: one of the document, or "{model id}/{name}". */
static tw_status read_layer_clip(const layer_reader *reader, const api_value *object, const api_value *value,
                                 tw_clip_layer *layer) {
  if (!value->item) return api_json_fail(object, TW_SYNTAX, "a layer needs a clip");
  tw_status status = api_json_text(value, &layer->clip);
  if (status != TW_OK) return status;
  layer->own = TW_NO_INDEX;
  size_t length = strlen(layer->clip);
  if (length > TW_NAME_MAX + API_ID_TEXT)
    return api_json_fail(value, TW_LIMIT, "a name has at most %d bytes", TW_NAME_MAX);
  status = read_reference(value, reader->clips, &layer->own);
  if (status == TW_OK || !api_clip_is_borrowed(layer->clip, length)) return status;
  layer->own = TW_NO_INDEX;
  return TW_OK;
}

static tw_status read_weight_keys(void *context, const api_value *object) {
  static const char *const members[] = {"times", "values", NULL};
  tw_layer *layer = context;
  api_value values[2];
  uint32_t count = 0;
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_count(&values[0], TW_LAYER_KEYS_MAX, &layer->weight_count);
  if (status == TW_OK) status = api_json_count(&values[1], TW_LAYER_KEYS_MAX, &count);
  if (status != TW_OK) return status;
  if (layer->weight_count == 0) return api_json_fail(object, TW_SYNTAX, "a keyed weight needs times");
  if (count != layer->weight_count)
    return api_json_fail(&values[1], TW_INVALID, "%u values for %u times", count, layer->weight_count);
  float *times = allocate(object->json, count, sizeof *times, &status);
  float *weights = allocate(object->json, count, sizeof *weights, &status);
  if (status == TW_OK) status = api_json_float_list(&values[0], times);
  if (status == TW_OK) status = api_json_float_list(&values[1], weights);
  layer->weight_times = times;
  layer->weights = weights;
  return status;
}

/* Reads a number, or times and values. */
static tw_status read_weight(const api_value *value, tw_layer *layer) {
  static const float usual = 1;
  tw_status status = TW_OK;
  layer->weight_count = 1;
  layer->weights = &usual;
  if (!value->item) return TW_OK;
  if (cJSON_IsObject(value->item)) return api_json_object(value, read_weight_keys, layer);
  if (!cJSON_IsNumber(value->item))
    return api_json_fail(value, TW_SYNTAX, "a weight is a number, or {\"times\": [], \"values\": []}");
  float *weight = allocate(value->json, 1, sizeof *weight, &status);
  layer->weights = weight;
  return weight ? api_json_float(value, weight) : status;
}

/* Reads when the layer plays. */
static tw_status read_layer_times(const api_value *values, tw_layer *layer) {
  static const char *const loops[] = {"clamp", "repeat", "pingpong", NULL};
  int loop = TW_CLAMP;
  layer->speed = 1;
  tw_status status = api_json_double(&values[LAYER_SPEED], &layer->speed);
  if (status == TW_OK) status = api_json_double(&values[LAYER_OFFSET], &layer->offset);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_LOOP], loops, &loop);
  if (status == TW_OK && values[LAYER_SYNC].item)
    status = api_json_flag(&values[LAYER_SYNC], &layer->is_synced);
  layer->loop = (tw_loop)loop;
  if (status == TW_OK && layer->is_synced && values[LAYER_LOOP].item)
    return api_json_fail(&values[LAYER_LOOP], TW_SYNTAX, "a layer with sync repeats: loop has no place");
  return status;
}

typedef struct mask_reader {
  const names *nodes;
  uint32_t *out;
} mask_reader;

static tw_status read_mask_node(void *context, const api_value *text) {
  const mask_reader *reader = context;
  return read_reference(text, reader->nodes, &reader->out[text->at.index]);
}

static tw_status read_mask(const api_value *array, const names *nodes, tw_clip_layer *layer) {
  if (!array->item) return TW_OK;
  tw_status status = api_json_count(array, TW_LAYER_NODES_MAX, &layer->node_count);
  if (status == TW_OK && layer->node_count == 0)
    return api_json_fail(array, TW_INVALID, "a layer without nodes moves nothing");
  uint32_t *out = allocate(array->json, layer->node_count, sizeof *out, &status);
  layer->nodes = out;
  return out ? api_json_each_text(array, read_mask_node, &(mask_reader){nodes, out}) : status;
}

static tw_status read_layer(void *context, const api_value *object) {
  static const char *const modes[] = {"replace", "additive", NULL};
  static const char *const retargets[] = {"none", "auto", NULL};
  const layer_reader *reader = context;
  tw_clip_layer *layer = &reader->layers[object->at.index];
  api_value values[LAYER_MEMBERS];
  int mode = TW_LAYER_REPLACE, retarget = 0;
  tw_status status = api_json_members(object, layer_members, values);
  if (status == TW_OK) status = read_layer_clip(reader, object, &values[LAYER_CLIP], layer);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_MODE], modes, &mode);
  if (status == TW_OK) status = read_weight(&values[LAYER_WEIGHT], &layer->layer);
  if (status == TW_OK) status = read_layer_times(values, &layer->layer);
  if (status == TW_OK) status = read_mask(&values[LAYER_NODES], reader->nodes, layer);
  if (status == TW_OK) status = api_json_double(&values[LAYER_REFERENCE], &layer->layer.reference);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_RETARGET], retargets, &retarget);
  layer->layer.mode = (tw_layer_mode)mode;
  layer->is_retargeted = retarget == 1;
  if (status == TW_OK && layer->is_retargeted && layer->own != TW_NO_INDEX)
    return api_json_fail(&values[LAYER_RETARGET], TW_SYNTAX, "retarget goes with clips of other models");
  if (status == TW_OK && values[LAYER_REFERENCE].item && mode != TW_LAYER_ADDITIVE)
    return api_json_fail(&values[LAYER_REFERENCE], TW_SYNTAX, "reference is for mode additive");
  return status;
}

typedef struct clip_reader {
  const names *nodes, *clips;
  tw_model *model;
  uint32_t track_count; /* of all clips so far */
} clip_reader;

static tw_status read_layers(const clip_reader *reader, const api_value *array, tw_clip_keys *clip) {
  tw_status status = api_json_count(array, TW_LAYERS_MAX, &clip->layer_count);
  if (status == TW_OK && clip->layer_count == 0)
    return api_json_fail(array, TW_INVALID, "a mixed clip needs a layer");
  tw_clip_layer *layers =
      status == TW_OK ? tw_arena_alloc(array->json->arena, clip->layer_count, sizeof *layers) : NULL;
  if (status == TW_OK && !layers) return api_json_no_memory(array->json);
  clip->layers = layers;
  return status == TW_OK
             ? api_json_each(array, read_layer, &(layer_reader){reader->nodes, reader->clips, layers})
             : status;
}

static tw_status read_clip(void *context, const api_value *object) {
  enum { NAME, TRACKS, LAYERS, MEMBERS };
  static const char *const members[] = {"name", "tracks", "layers", NULL};
  clip_reader *reader = context;
  tw_clip_keys *clip = &reader->model->clips[object->at.index];
  api_value values[MEMBERS];
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_name(&values[NAME], &clip->name);
  if (status == TW_OK && values[TRACKS].item && values[LAYERS].item)
    return api_json_fail(&values[LAYERS], TW_SYNTAX, "a clip has tracks or layers, not both");
  if (status == TW_OK)
    status = api_json_count(&values[TRACKS], TW_TRACKS_MAX - reader->track_count, &clip->track_count);
  if (status != TW_OK) return status;
  if (values[LAYERS].item) return read_layers(reader, &values[LAYERS], clip);
  reader->track_count += clip->track_count;
  tw_track_keys *tracks = tw_arena_alloc(object->json->arena, clip->track_count, sizeof *tracks);
  if (!tracks) return api_json_no_memory(object->json);
  clip->tracks = tracks;
  return api_json_each(&values[TRACKS], read_track, &(track_reader){reader->nodes, tracks});
}

/* ---- nodes ----------------------------------------------------------------------------------- */

typedef struct node_reader {
  const names *meshes, *nodes;
  tw_model *model;
} node_reader;

static tw_status read_node(void *context, const api_value *object) {
  enum { NAME, PARENT, MESH, TRANSLATION, ROTATION, SCALE, MEMBERS };
  static const char *const members[] = {"name", "parent", "mesh", "translation", "rotation", "scale", NULL};
  const node_reader *reader = context;
  tw_node *node = &reader->model->nodes[object->at.index];
  api_value values[MEMBERS];
  *node = (tw_node){.parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_name(&values[NAME], &node->name);
  if (status == TW_OK) status = read_reference(&values[PARENT], reader->nodes, &node->parent);
  if (status == TW_OK) status = read_reference(&values[MESH], reader->meshes, &node->mesh);
  if (status == TW_OK) status = api_json_floats(&values[TRANSLATION], 3, node->rest.translation);
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

/* scratch: holds the names while the parts are read. */
static tw_status read_parts(const api_value *parts, const api_making *making, tw_arena *scratch,
                            tw_model *model) {
  names meshes, nodes, clips;
  tw_status status = read_names(&parts[MESHES], model->mesh_count, "mesh", scratch, &meshes);
  if (status != TW_OK) return status;
  /* Without nodes tw_model_finish makes one for each mesh, with the mesh's name. */
  bool has_nodes = model->node_count > 0;
  status = read_names(&parts[has_nodes ? NODES : MESHES], has_nodes ? model->node_count : model->mesh_count,
                      "node", scratch, &nodes);
  if (status == TW_OK) status = read_names(&parts[CLIPS], model->clip_count, "clip", scratch, &clips);
  if (status == TW_OK) status = api_json_each(&parts[MESHES], read_mesh, &(mesh_reader){model, making, 0});
  if (status == TW_OK)
    status = api_json_each(&parts[NODES], read_node, &(node_reader){&meshes, &nodes, model});
  if (status == TW_OK)
    status = api_json_each(&parts[CLIPS], read_clip, &(clip_reader){&nodes, &clips, model, 0});
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
