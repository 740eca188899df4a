/* From the parts of an OBJ file to a model's meshes. Points are shared over the whole file, so it is
 * one mesh, unless its objects share none: then each object is a mesh of its own. */
#include "obj_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/base.h"

/* Above this the file stays one mesh: a mesh costs much more memory than a line of text. */
enum { OBJECTS_MAX = 65536 };

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "out of memory");
}

/* A name as UTF-8. Text that is not UTF-8 is taken as Latin-1; control characters become blanks. */
static tw_status copy_name(tw_arena *arena, obj_word word, const char **out, tw_error *error) {
  if (word.length == 0) return TW_OK;
  if (tw_utf8_is_name(word.text, word.length)) {
    *out = tw_arena_text(arena, word.text, word.length);
    return *out ? TW_OK : no_memory(error);
  }
  char *text = word.length < SIZE_MAX / 2 ? tw_arena_alloc(arena, 2 * word.length + 1, 1) : NULL;
  if (!text) return no_memory(error);
  *out = text;
  for (size_t i = 0; i < word.length; i++) {
    uint8_t c = (uint8_t)word.text[i];
    if (c < 0x20 || c == 0x7F) c = ' ';
    if (c >= 0x80) {
      *text++ = (char)(0xC0 | c >> 6);
      c = (uint8_t)(0x80 | (c & 0x3F));
    }
    *text++ = (char)c;
  }
  return TW_OK;
}

/* The words of a name, one blank between two. */
static tw_status copy_words(tw_arena *arena, obj_word name, const char **out, tw_error *error) {
  char *words = tw_alloc(name.length + 1, 1);
  if (!words) return no_memory(error);
  size_t length = 0;
  obj_text text = obj_text_of(name);
  for (obj_word word = obj_read_word(&text); word.length > 0; word = obj_read_word(&text)) {
    if (length > 0) words[length++] = ' ';
    memcpy(words + length, word.text, word.length);
    length += word.length;
  }
  tw_status status = copy_name(arena, (obj_word){words, length}, out, error);
  free(words);
  return status;
}

static void *copy_array(tw_arena *arena, const void *values, size_t count, size_t size) {
  void *copy = tw_arena_alloc(arena, count, size);
  if (copy && count) memcpy(copy, values, count * size);
  return copy;
}

/* ---- colours -------------------------------------------------------------------------------- */

static float clamp_unit(float value) {
  return fminf(fmaxf(value, 0), 1);
}

/* Colours in OBJ files are sRGB (what Blender, MeshLab and three.js write and read), meshes hold linear
 * ones: IEC 61966-2-1. */
static float linear_from_srgb(float value) {
  float c = clamp_unit(value);
  return c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

/* [point_count][4], or NULL without memory. Points without a colour are white. */
static float *build_colors(const obj_parts *parts) {
  size_t points = parts->positions.count / 3, given = parts->colors.count / 3;
  float *out = tw_alloc(points, 4 * sizeof *out);
  for (size_t i = 0; out && i < points; i++) {
    for (size_t c = 0; c < 3; c++)
      out[4 * i + c] = i < given ? linear_from_srgb(parts->colors.values[3 * i + c]) : 1;
    out[4 * i + 3] = 1;
  }
  return out;
}

/* ---- which point belongs to which mesh ------------------------------------------------------- */

/* How the file's elements are dealt out over meshes. With one mesh everything stays in its place. */
typedef struct dealing {
  uint32_t mesh_count;
  const obj_object *objects; /* [mesh_count] when there are several */
  uint32_t *point_mesh;      /* [points]: mesh, or UINT32_MAX for a point that no face uses */
  uint32_t *point_index;     /* [points]: index in its mesh */
  uint32_t *mesh_points;     /* [mesh_count]: points of each */
  uint32_t *uv_mesh;         /* [uvs]: mesh + 1 that numbered it last */
  uint32_t *uv_index;        /* [uvs]: index there */
  float *colors;             /* of all points, or NULL */
} dealing;

static void dealing_deinit(dealing *deal) {
  free(deal->point_mesh);
  free(deal->point_index);
  free(deal->mesh_points);
  free(deal->uv_mesh);
  free(deal->uv_index);
  free(deal->colors);
}

static size_t face_end(const obj_parts *parts, size_t face) {
  return face + 1 < parts->face_starts.count ? parts->face_starts.values[face + 1] : parts->corners.count;
}

/* Faces [*first_face, *face_stop) of the mesh at `index`. */
static void face_range(const obj_parts *parts, const dealing *deal, uint32_t index, size_t *first_face,
                       size_t *face_stop) {
  bool several = deal->mesh_count > 1;
  *first_face = several && index > 0 ? deal->objects[index].first_face : 0;
  *face_stop = several && index + 1 < deal->mesh_count ? deal->objects[index + 1].first_face
                                                       : parts->face_starts.count;
}

/* Notes for each point whose faces use it; false when two objects use the same. */
static bool own_points(const obj_parts *parts, dealing *deal) {
  for (uint32_t mesh = 0; mesh < deal->mesh_count; mesh++) {
    size_t face, stop;
    face_range(parts, deal, mesh, &face, &stop);
    size_t end = stop > face ? face_end(parts, stop - 1) : 0;
    for (size_t corner = parts->face_starts.values[face]; corner < end; corner++) {
      uint32_t *owner = &deal->point_mesh[parts->corners.values[corner]];
      if (*owner != UINT32_MAX && *owner != mesh) return false;
      *owner = mesh;
    }
  }
  return true;
}

static void number_points(const obj_parts *parts, dealing *deal) {
  size_t points = parts->positions.count / 3;
  for (size_t i = 0; i < points; i++)
    if (deal->point_mesh[i] != UINT32_MAX) deal->point_index[i] = deal->mesh_points[deal->point_mesh[i]]++;
}

/* Decides between one mesh and several. Tags number the points and faces of the whole file: a file
 * that has some stays whole, as does one with faces before its first object. Objects that no face
 * follows are gone by now, but for the last. */
static tw_status deal_objects(const obj_parts *parts, dealing *deal, tw_error *error) {
  size_t count = parts->object_count;
  if (count > 0 && parts->objects[count - 1].first_face == parts->face_starts.count) count--;
  if (count < 2 || count > OBJECTS_MAX || parts->objects[0].first_face != 0) return TW_OK;
  if (parts->tagged_point.index > 0 || parts->tagged_face.index > 0) return TW_OK;
  size_t points = parts->positions.count / 3, uvs = parts->uvs.count / 2;
  deal->objects = parts->objects;
  deal->mesh_count = (uint32_t)count;
  deal->point_mesh = tw_alloc(points, sizeof(uint32_t));
  if (!deal->point_mesh) return no_memory(error);
  memset(deal->point_mesh, 0xFF, points * sizeof(uint32_t));
  if (!own_points(parts, deal)) {
    deal->mesh_count = 1;
    return TW_OK;
  }
  deal->point_index = tw_alloc(points, sizeof(uint32_t));
  deal->mesh_points = tw_alloc_zero(count, sizeof(uint32_t));
  deal->uv_mesh = tw_alloc_zero(uvs, sizeof(uint32_t));
  deal->uv_index = tw_alloc(uvs, sizeof(uint32_t));
  if (!deal->point_index || !deal->mesh_points || !deal->uv_mesh || !deal->uv_index) return no_memory(error);
  number_points(parts, deal);
  return TW_OK;
}

/* ---- one mesh ------------------------------------------------------------------------------- */

typedef struct building {
  const obj_parts *parts;
  dealing *deal;
  tw_arena *arena;
  tw_error *error;
  uint32_t index;
  size_t first_face, face_stop, first_corner, corner_stop;
} building;

static uint32_t point_of(const building *b, uint32_t point) {
  return b->deal->mesh_count == 1 ? point : b->deal->point_index[point];
}

/* Copies rows of `width` floats, one a point of the mesh, in the file's order. */
static float *copy_rows(const building *b, const float *rows, size_t width, uint32_t count) {
  float *out = tw_arena_alloc(b->arena, count, width * sizeof(float));
  if (!out) return NULL;
  if (b->deal->mesh_count == 1) return memcpy(out, rows, count * width * sizeof(float));
  for (size_t i = b->first_corner; i < b->corner_stop; i++) {
    uint32_t point = b->parts->corners.values[i];
    memcpy(out + point_of(b, point) * width, rows + point * width, width * sizeof(float));
  }
  return out;
}

static tw_status build_points(const building *b, tw_mesh *mesh) {
  const uint32_t *several = b->deal->mesh_points;
  mesh->point_count = several ? several[b->index] : (uint32_t)(b->parts->positions.count / 3);
  mesh->positions = copy_rows(b, b->parts->positions.values, 3, mesh->point_count);
  if (!mesh->positions) return no_memory(b->error);
  if (!b->deal->colors) return TW_OK;
  mesh->colors = copy_rows(b, b->deal->colors, 4, mesh->point_count);
  return mesh->colors ? TW_OK : no_memory(b->error);
}

static tw_status build_faces(const building *b, tw_mesh *mesh) {
  const obj_parts *parts = b->parts;
  mesh->face_count = (uint32_t)(b->face_stop - b->first_face);
  mesh->corner_count = (uint32_t)(b->corner_stop - b->first_corner);
  uint32_t *offsets = tw_arena_alloc(b->arena, (size_t)mesh->face_count + 1, sizeof *offsets);
  uint32_t *corners = tw_arena_alloc(b->arena, mesh->corner_count, sizeof *corners);
  if (!offsets || !corners) return no_memory(b->error);
  for (size_t i = 0; i < mesh->face_count; i++)
    offsets[i] = (uint32_t)(parts->face_starts.values[b->first_face + i] - b->first_corner);
  offsets[mesh->face_count] = mesh->corner_count;
  for (size_t i = 0; i < mesh->corner_count; i++)
    corners[i] = point_of(b, parts->corners.values[b->first_corner + i]);
  mesh->face_offsets = offsets;
  mesh->corners = corners;
  return TW_OK;
}

static tw_status build_materials(const building *b, tw_mesh *mesh) {
  const obj_indices *labels = &b->parts->materials;
  if (labels->count == 0) return TW_OK;
  int32_t *materials = tw_arena_alloc(b->arena, mesh->face_count, sizeof *materials);
  if (!materials) return no_memory(b->error);
  for (size_t i = 0; i < mesh->face_count; i++) {
    uint32_t material = labels->values[b->first_face + i];
    materials[i] = material == OBJ_NO_NAME ? -1 : (int32_t)material;
  }
  mesh->face_materials = materials;
  return TW_OK;
}

static tw_status build_groups(const building *b, tw_mesh *mesh) {
  const obj_indices *labels = &b->parts->groups;
  if (labels->count == 0) return TW_OK;
  mesh->face_groups =
      copy_array(b->arena, labels->values + b->first_face, mesh->face_count, sizeof *labels->values);
  return mesh->face_groups ? TW_OK : no_memory(b->error);
}

/* Numbers the UVs that the mesh's corners use, in the order of their first use. Corners without one
 * share a value of their own, 0 0, which comes last. Returns the number of values. */
static uint32_t number_uvs(const building *b, uint32_t *out, uint32_t *missing) {
  dealing *deal = b->deal;
  uint32_t count = 0;
  *missing = 0;
  for (size_t i = b->first_corner; i < b->corner_stop; i++) {
    uint32_t uv = b->parts->corner_uvs.values[i], *at = out + (i - b->first_corner);
    if (uv == OBJ_NO_UV) {
      (*missing)++;
      *at = OBJ_NO_UV;
      continue;
    }
    if (deal->uv_mesh[uv] != b->index + 1) {
      deal->uv_mesh[uv] = b->index + 1;
      deal->uv_index[uv] = count++;
    }
    *at = deal->uv_index[uv];
  }
  return count;
}

static tw_status build_uvs(const building *b, tw_mesh *mesh) {
  const obj_parts *parts = b->parts;
  if (parts->corner_uvs.count == 0) return TW_OK;
  bool whole = b->deal->mesh_count == 1;
  uint32_t *corners = tw_arena_alloc(b->arena, mesh->corner_count, sizeof *corners);
  if (!corners) return no_memory(b->error);
  uint32_t count = (uint32_t)(parts->uvs.count / 2), missing = (uint32_t)parts->missing_uvs;
  if (whole)
    memcpy(corners, parts->corner_uvs.values, mesh->corner_count * sizeof *corners);
  else
    count = number_uvs(b, corners, &missing);
  if (missing == mesh->corner_count) return TW_OK; /* this object has none at all */
  float *values = tw_arena_alloc(b->arena, (size_t)count + 1, 2 * sizeof *values);
  if (!values) return no_memory(b->error);
  if (whole) memcpy(values, parts->uvs.values, (size_t)count * 2 * sizeof *values);
  for (size_t i = 0; i < mesh->corner_count; i++) {
    uint32_t uv = parts->corner_uvs.values[b->first_corner + i];
    if (uv == OBJ_NO_UV)
      corners[i] = count;
    else if (!whole)
      memcpy(values + 2 * (size_t)corners[i], parts->uvs.values + 2 * (size_t)uv, 2 * sizeof *values);
  }
  mesh->uv_set_count = 1;
  mesh->uv_sets[0] = (tw_uv_set){count + (missing > 0), values, corners};
  return TW_OK;
}

static tw_status build_tags(const building *b, tw_mesh *mesh) {
  const obj_parts *parts = b->parts;
  size_t creases = parts->crease_sharpness.count, points = parts->sharp_points.count;
  mesh->tag_boundary = parts->tag_boundary;
  mesh->tag_uv = parts->tag_uv;
  mesh->tag_creasing = parts->tag_creasing;
  mesh->tag_triangles = parts->tag_triangles;
  if (creases > 0) {
    mesh->crease_count = (uint32_t)creases;
    mesh->crease_edges = copy_array(b->arena, parts->crease_points.values, creases, 2 * sizeof(uint32_t));
    mesh->crease_sharpness = copy_array(b->arena, parts->crease_sharpness.values, creases, sizeof(float));
    if (!mesh->crease_edges || !mesh->crease_sharpness) return no_memory(b->error);
  }
  if (points > 0) {
    mesh->sharp_point_count = (uint32_t)points;
    mesh->sharp_points = copy_array(b->arena, parts->sharp_points.values, points, sizeof(uint32_t));
    mesh->point_sharpness = copy_array(b->arena, parts->point_sharpness.values, points, sizeof(float));
    if (!mesh->sharp_points || !mesh->point_sharpness) return no_memory(b->error);
  }
  if (parts->holes.count > 0) {
    mesh->hole_count = (uint32_t)parts->holes.count;
    mesh->holes = copy_array(b->arena, parts->holes.values, parts->holes.count, sizeof(uint32_t));
    if (!mesh->holes) return no_memory(b->error);
  }
  return TW_OK;
}

static tw_status build_mesh(building *b, tw_mesh *mesh) {
  const obj_parts *parts = b->parts;
  tw_mesh_init(mesh);
  face_range(parts, b->deal, b->index, &b->first_face, &b->face_stop);
  b->first_corner = parts->face_starts.values[b->first_face];
  b->corner_stop = face_end(parts, b->face_stop - 1);
  obj_word name = b->index < parts->object_count ? parts->objects[b->index].name : parts->first_group;
  tw_status status = copy_name(b->arena, name, &mesh->name, b->error);
  if (status == TW_OK) status = build_points(b, mesh);
  if (status == TW_OK) status = build_faces(b, mesh);
  if (status == TW_OK) status = build_materials(b, mesh);
  if (status == TW_OK) status = build_groups(b, mesh);
  if (status == TW_OK) status = build_uvs(b, mesh);
  if (status == TW_OK) status = build_tags(b, mesh);
  return status;
}

/* ---- the whole ------------------------------------------------------------------------------ */

typedef tw_status copy_text(tw_arena *arena, obj_word text, const char **out, tw_error *error);

/* *out: [names->count]. */
static tw_status copy_names(const obj_names *names, copy_text *copy, tw_arena *arena, const char ***out,
                            tw_error *error) {
  if (names->count == 0) return TW_OK;
  *out = tw_arena_alloc(arena, names->count, sizeof **out);
  if (!*out) return no_memory(error);
  tw_status status = TW_OK;
  for (size_t i = 0; i < names->count && status == TW_OK; i++)
    status = copy(arena, names->names[i], &(*out)[i], error);
  return status;
}

static tw_status build_meshes(const obj_parts *parts, dealing *deal, tw_model *model, tw_error *error) {
  tw_status status = deal_objects(parts, deal, error);
  if (status != TW_OK) return status;
  if (parts->colors.count > 0) {
    deal->colors = build_colors(parts);
    if (!deal->colors) return no_memory(error);
  }
  model->meshes = tw_arena_alloc(model->arena, deal->mesh_count, sizeof *model->meshes);
  if (!model->meshes) return no_memory(error);
  model->mesh_count = deal->mesh_count;
  for (uint32_t i = 0; i < deal->mesh_count && status == TW_OK; i++) {
    building b = {.parts = parts, .deal = deal, .arena = model->arena, .error = error, .index = i};
    status = build_mesh(&b, &model->meshes[i]);
  }
  return status;
}

tw_status obj_build_model(const obj_parts *parts, tw_model *model, tw_error *error) {
  model->material_count = (uint32_t)parts->material_names.count;
  model->group_count = (uint32_t)parts->group_names.count;
  tw_status status =
      copy_names(&parts->material_names, copy_name, model->arena, &model->material_names, error);
  if (status == TW_OK)
    status = copy_names(&parts->group_names, copy_words, model->arena, &model->group_names, error);
  if (status != TW_OK) return status;
  dealing deal = {.mesh_count = 1};
  status = build_meshes(parts, &deal, model, error);
  dealing_deinit(&deal);
  return status;
}
