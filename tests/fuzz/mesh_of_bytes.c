#include "mesh_of_bytes.h"

#include <string.h>

uint32_t take(source *s, uint32_t below) {
  return s->at < s->end ? *s->at++ % below : 0;
}

float take_number(source *s) {
  static const float extremes[8] = {0, 1e-30f, -1e-30f, 1e-7f, 1e18f, -1e18f, 1e9f, 0.1f};
  uint32_t byte = take(s, 256);
  return byte < 8 ? extremes[byte] : ((float)byte - 128) / 16;
}

void take_numbers(source *s, float *out, size_t count) {
  for (size_t i = 0; i < count; i++) out[i] = take_number(s);
}

static void take_indices(source *s, uint32_t *out, size_t count, uint32_t below) {
  for (size_t i = 0; i < count; i++) out[i] = take(s, below);
}

float take_sharpness(source *s) {
  static const float values[8] = {0, 0.25f, 1, 1.5f, 2, 3.75f, 9.99f, TW_SHARPNESS_INFINITE};
  return values[take(s, 8)];
}

static void add_face(storage *own, tw_mesh *mesh, const uint32_t *points, uint32_t size) {
  memcpy(own->corners + mesh->corner_count, points, size * sizeof *points);
  mesh->corner_count += size;
  own->offsets[++mesh->face_count] = mesh->corner_count;
}

/* Adds part of a grid of quads or triangles, so that some of the mesh is regular. */
static void add_grid(source *s, storage *own, tw_mesh *mesh, bool triangles) {
  enum { SIDE = 5 };
  uint32_t width = 1 + take(s, SIDE - 1), height = 1 + take(s, triangles ? 3 : SIDE - 1);
  for (uint32_t i = 0; i < width * height; i++) {
    uint32_t first = i / width * SIDE + i % width;
    const uint32_t p[6] = {first, first + 1, first + SIDE + 1, first, first + SIDE + 1, first + SIDE};
    const uint32_t quad[4] = {p[0], p[1], p[2], p[5]};
    if (triangles) add_face(own, mesh, p, 3);
    add_face(own, mesh, triangles ? p + 3 : quad, triangles ? 3 : 4);
  }
  if (mesh->point_count < SIDE * SIDE) mesh->point_count = SIDE * SIDE;
  for (uint32_t changes = take(s, 6); changes > 0; changes--)
    own->corners[take(s, mesh->corner_count)] = take(s, mesh->point_count);
}

/* Changes corners until no two neighbours in a face are the same point, as such meshes are refused. */
static void part_corners(storage *own, const tw_mesh *mesh) {
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    uint32_t begin = own->offsets[f], last = own->offsets[f + 1] - 1;
    for (uint32_t c = begin; c <= last; c++) {
      uint32_t *point = &own->corners[c], before = own->corners[c > begin ? c - 1 : last];
      while (*point == before || (c == last && *point == own->corners[begin]))
        *point = (*point + 1) % mesh->point_count;
    }
  }
}

static void take_faces(source *s, storage *own, tw_mesh *mesh) {
  uint32_t kind = take(s, 4);
  if (kind >= 2) add_grid(s, own, mesh, kind == 3);
  uint32_t more = take(s, 9);
  for (uint32_t f = 0; f < more && mesh->face_count < FACES; f++) {
    uint32_t points[FACE_SIZE], size = kind % 2 ? 3 : 4;
    if (kind == 0 && take(s, 2)) size = 3 + take(s, FACE_SIZE - 2);
    take_indices(s, points, size, mesh->point_count);
    add_face(own, mesh, points, size);
  }
  part_corners(own, mesh);
  mesh->face_offsets = own->offsets;
  mesh->corners = own->corners;
}

static void take_tags(source *s, storage *own, tw_mesh *mesh) {
  mesh->crease_count = mesh->corner_count > 0 ? take(s, TAGS + 1) : 0;
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    uint32_t corner = take(s, mesh->corner_count - 1); /* neighbouring corners are mostly an edge */
    own->creases[i][0] = own->corners[corner];
    own->creases[i][1] = own->corners[corner + 1];
    own->crease_sharpness[i] = take_sharpness(s);
  }
  mesh->sharp_point_count = take(s, TAGS + 1);
  take_indices(s, own->sharp_points, mesh->sharp_point_count, mesh->point_count);
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) own->point_sharpness[i] = take_sharpness(s);
  mesh->hole_count = mesh->face_count > 0 ? take(s, TAGS + 1) : 0;
  take_indices(s, own->holes, mesh->hole_count, mesh->face_count);
  mesh->crease_edges = own->creases[0];
  mesh->crease_sharpness = own->crease_sharpness;
  mesh->sharp_points = own->sharp_points;
  mesh->point_sharpness = own->point_sharpness;
  mesh->holes = own->holes;
}

static void take_uvs(source *s, storage *own, tw_mesh *mesh) {
  mesh->uv_set_count = take(s, 3);
  for (uint32_t u = 0; u < mesh->uv_set_count; u++) {
    uint32_t count = 1 + take(s, VALUES);
    take_numbers(s, own->uvs[u][0], 2 * (size_t)count);
    for (uint32_t c = 0; c < mesh->corner_count; c++) /* two of three corners without a seam */
      own->uv_corners[u][c] = (take(s, 3) ? own->corners[c] : take(s, count)) % count;
    mesh->uv_sets[u] = (tw_uv_set){count, own->uvs[u][0], own->uv_corners[u]};
  }
}

static void take_normals(source *s, storage *own, tw_mesh *mesh) {
  if (!take(s, 3)) return;
  uint32_t count = 1 + take(s, VALUES);
  take_numbers(s, own->normals[0], 3 * (size_t)count);
  take_numbers(s, own->tangents[0], 4 * (size_t)count);
  take_numbers(s, own->normal_moves[0][0], 6 * (size_t)VALUES);
  take_indices(s, own->normal_corners, mesh->corner_count, count);
  mesh->normals =
      (tw_corner_normals){count, own->normals[0], take(s, 2) ? own->tangents[0] : NULL, own->normal_corners};
  mesh->has_tangents = take(s, 2);
}

/* Adds attributes, a skin, morph targets, groups, smoothing and tangent UVs. */
static void take_values(source *s, storage *own, tw_mesh *mesh) {
  uint32_t kinds = take(s, 256);
  if (kinds & 1) {
    take_numbers(s, own->colors[0], 4 * (size_t)mesh->point_count);
    take_numbers(s, own->own[0], mesh->point_count);
    own->attributes[0] =
        (tw_attribute){.name = "COLOR_0", .width = 4, .is_color = true, .values = own->colors[0]};
    own->attributes[1] = (tw_attribute){.name = "_OWN", .width = 1, .values = own->own[0]};
    mesh->attributes = own->attributes;
    mesh->attribute_count = 1 + take(s, 2);
  }
  if (kinds & 2) {
    uint32_t width = kinds & 8 ? 8 : 4;
    uint16_t *joint = own->joints[0];
    float *weight = own->weights[0];
    for (uint32_t i = 0; i < width * mesh->point_count; i++) {
      *joint++ = (uint16_t)take(s, 6);
      *weight++ = i % width == 0 ? 0.5f : 0.5f / (float)(width - 1);
    }
    mesh->skin = (tw_skin_weights){width, own->joints[0], own->weights[0]};
  }
  if (kinds & 4) {
    mesh->morph_count = 1 + take(s, 2);
    take_numbers(s, own->moves[0][0], 6 * (size_t)POINTS);
    for (uint32_t m = 0; m < 2; m++) {
      own->morphs[m] = own->moves[m][0];
      own->morph_normals[m] = own->normal_moves[m][0];
    }
    mesh->morphs = own->morphs;
    if (mesh->normals.corners && (kinds & 8)) mesh->morph_normals = own->morph_normals;
  }
  if (kinds & 16) {
    take_indices(s, own->groups, mesh->face_count, 3);
    mesh->face_groups = own->groups;
  }
  if (kinds & 32) {
    take_indices(s, own->smoothing, mesh->face_count, 3);
    mesh->face_smoothing = own->smoothing;
  }
  if ((kinds & 64) && mesh->uv_set_count > 0) {
    for (uint32_t f = 0; f < mesh->face_count; f++)
      own->tangent_uvs[f] = (uint8_t)take(s, mesh->uv_set_count);
    mesh->tangent_uvs = own->tangent_uvs;
  }
}

void take_corner_values(source *s, storage *own, tw_mesh *mesh) {
  uint32_t kinds = take(s, 8), count = 1 + take(s, VALUES);
  take_numbers(s, own->corner_values[0], 4 * (size_t)VALUES);
  for (uint32_t p = 0; p < POINTS; p++) own->whole[p][0] = (float)take(s, 256);
  for (uint32_t i = 0; i < 3; i++) {
    if (!(kinds & 1u << i)) continue;
    static const char *const names[] = {"_CORNERS", "_LABELS", "_WHOLE"};
    static const tw_numbers numbers[] = {TW_NUMBERS_REAL, TW_NUMBERS_INT16, TW_NUMBERS_WHOLE};
    tw_attribute made = {.name = names[i],
                         .width = i == 0 ? 4 : 1,
                         .values = i == 0 ? own->corner_values[0] : own->whole[0],
                         .numbers = numbers[i]};
    for (uint32_t c = 0; i < 2 && c < mesh->corner_count; c++) {
      own->value_corners[i][c] = (take(s, 3) ? own->corners[c] : take(s, count)) % count;
      made.value_count = count;
      made.corners = own->value_corners[i];
    }
    own->attributes[mesh->attribute_count++] = made;
    mesh->attributes = own->attributes;
  }
}

void take_mesh(source *s, storage *own, tw_mesh *mesh) {
  tw_mesh_init(mesh);
  mesh->point_count = 3 + take(s, POINTS - 2);
  take_faces(s, own, mesh);
  take_numbers(s, own->positions[0], 3 * (size_t)mesh->point_count);
  mesh->positions = own->positions[0];
  take_tags(s, own, mesh);
  take_uvs(s, own, mesh);
  take_normals(s, own, mesh);
  take_values(s, own, mesh);
}
