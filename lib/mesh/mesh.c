/* Control meshes: checking one on entry, moving its points by morph targets and joints. */
#include "tweend/mesh.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sorted.h"

void tw_mesh_init(tw_mesh *mesh) {
  memset(mesh, 0, sizeof *mesh);
  mesh->tag_boundary = mesh->tag_uv = mesh->tag_creasing = mesh->tag_triangles = TW_TAG_UNSET;
}

static tw_status set_color(tw_mesh *mesh, const tw_attribute *color, tw_arena *arena) {
  tw_attribute *attribute = tw_arena_alloc(arena, 1, sizeof *attribute);
  if (!attribute) return TW_NO_MEMORY;
  *attribute = *color;
  mesh->attributes = attribute;
  mesh->attribute_count = 1;
  return TW_OK;
}

tw_status tw_mesh_set_colors(tw_mesh *mesh, const float *colors, tw_arena *arena) {
  const tw_attribute color = {.name = "COLOR_0", .width = 4, .is_color = true, .values = colors};
  return set_color(mesh, &color, arena);
}

tw_status tw_mesh_set_corner_colors(tw_mesh *mesh, const float *colors, uint32_t color_count,
                                    const uint32_t *corners, tw_arena *arena) {
  const tw_attribute color = {.name = "COLOR_0",
                              .width = 4,
                              .is_color = true,
                              .values = colors,
                              .value_count = color_count,
                              .corners = corners};
  return set_color(mesh, &color, arena);
}

uint32_t tw_mesh_channels(const tw_mesh *mesh, tw_channel out[TW_CHANNELS_MAX]) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < mesh->uv_set_count; i++) {
    const tw_uv_set *set = &mesh->uv_sets[i];
    out[count++] = (tw_channel){2, set->value_count, set->values, set->corners, false};
  }
  for (uint32_t i = 0; i < mesh->attribute_count; i++) {
    const tw_attribute *a = &mesh->attributes[i];
    if (!a->corners) continue;
    out[count++] =
        (tw_channel){a->width, a->value_count, a->values, a->corners, a->numbers != TW_NUMBERS_REAL};
  }
  return count;
}

const tw_attribute *tw_channel_attribute(const tw_mesh *mesh, uint32_t channel) {
  if (channel < mesh->uv_set_count) return NULL;
  uint32_t before = channel - mesh->uv_set_count, i = 0;
  while (!mesh->attributes[i].corners || before-- > 0) i++;
  return &mesh->attributes[i];
}

void tw_mesh_set_channels(tw_mesh *mesh, const tw_channel *channels, tw_attribute *attributes) {
  for (uint32_t i = 0; i < mesh->uv_set_count; i++, channels++)
    mesh->uv_sets[i] = (tw_uv_set){channels->value_count, channels->values, channels->corners};
  for (uint32_t i = 0; i < mesh->attribute_count; i++) {
    if (!attributes[i].corners) continue;
    attributes[i].value_count = channels->value_count;
    attributes[i].values = channels->values;
    attributes[i].corners = channels->corners;
    channels++;
  }
  mesh->attributes = attributes;
}

/* Copies row parents[i] to row i. NULL where rows is NULL, or without memory. */
static void *take_rows(const void *rows, size_t size, const uint32_t *parents, uint32_t count,
                       tw_arena *arena) {
  char *out = rows ? tw_arena_alloc_raw(arena, count, size) : NULL;
  for (uint32_t i = 0; out && i < count; i++)
    memcpy(out + size * i, (const char *)rows + size * parents[i], size);
  return out;
}

tw_status tw_mesh_take_faces(tw_mesh *to, const tw_mesh *from, const uint32_t *parents, uint32_t count,
                             tw_arena *arena) {
  to->face_materials = take_rows(from->face_materials, sizeof(int32_t), parents, count, arena);
  to->face_groups = take_rows(from->face_groups, sizeof(uint32_t), parents, count, arena);
  to->face_smoothing = take_rows(from->face_smoothing, sizeof(uint32_t), parents, count, arena);
  to->tangent_uvs = take_rows(from->tangent_uvs, 1, parents, count, arena);
  bool has_all = (to->face_materials || !from->face_materials) && (to->face_groups || !from->face_groups) &&
                 (to->face_smoothing || !from->face_smoothing) && (to->tangent_uvs || !from->tangent_uvs);
  return has_all ? TW_OK : TW_NO_MEMORY;
}

/* ---- check ----------------------------------------------------------------------------------- */

static tw_status check_finite(const float *values, uint64_t rows, uint32_t width, const char *what,
                              tw_error *error) {
  for (uint64_t i = 0; i < rows * width; i++)
    if (!(fabsf(values[i]) <= TW_COORDINATE_MAX)) {
      tw_fail(error, TW_INVALID,
              isfinite(values[i]) ? "a coordinate is beyond 1e18" : "a coordinate is not a finite number");
      return tw_error_at(error, "/%s/%llu/%llu", what, (unsigned long long)(i / width),
                         (unsigned long long)(i % width));
    }
  return TW_OK;
}

static tw_status check_index(uint32_t index, uint32_t count, const char *one, const char *many,
                             tw_error *error) {
  if (index < count) return TW_OK;
  return tw_fail(error, TW_INVALID, "index %u is out of range: there %s %u %s", index,
                 tw_plural(count, "is", "are"), count, tw_plural(count, one, many));
}

/* A face may use a point twice, but not at two corners in a row. */
static tw_status check_face(const tw_mesh *mesh, uint32_t face, tw_error *error) {
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  if (end - begin < 3) {
    tw_fail(error, TW_INVALID, "a face needs at least three corners, this one has %u", end - begin);
    tw_error_at(error, "/faces/%u", face);
    return TW_INVALID;
  }
  for (uint32_t c = begin; c < end; c++) {
    uint32_t point = mesh->corners[c];
    bool again =
        (c > begin && point == mesh->corners[c - 1]) || (c + 1 == end && point == mesh->corners[begin]);
    tw_status status = check_index(point, mesh->point_count, "point", "points", error);
    if (status == TW_OK && again)
      status = tw_fail(error, TW_INVALID, "point %u occurs twice in a row", point);
    if (status != TW_OK) {
      tw_error_at(error, "/faces/%u/%u", face, c - begin);
      return TW_INVALID;
    }
  }
  return TW_OK;
}

static tw_status check_faces(const tw_mesh *mesh, tw_error *error, uint32_t *bad_face) {
  if (mesh->face_count == UINT32_MAX) return tw_fail(error, TW_LIMIT, "too many faces");
  tw_status status = TW_OK;
  for (uint32_t face = 0; face < mesh->face_count && status == TW_OK; face++) {
    status = check_face(mesh, face, error);
    if (status != TW_OK) *bad_face = face;
  }
  return status;
}

static tw_status check_uvs(const tw_mesh *mesh, tw_error *error, uint32_t *bad_face) {
  for (uint32_t s = 0; s < mesh->uv_set_count; s++) {
    const tw_uv_set *set = &mesh->uv_sets[s];
    tw_status status = check_finite(set->values, set->value_count, 2, "uvs", error);
    if (status != TW_OK) return status;
    for (uint32_t c = 0; c < mesh->corner_count; c++) {
      status = check_index(set->corners[c], set->value_count, "uv", "uvs", error);
      if (status == TW_OK) continue;
      *bad_face = tw_run_of(mesh->face_offsets, mesh->face_count, c);
      return tw_error_at(error, "/face_uvs/%u/%u", *bad_face, c - mesh->face_offsets[*bad_face]);
    }
  }
  return TW_OK;
}

static tw_status check_normals(const tw_mesh *mesh, tw_error *error) {
  const tw_corner_normals *normals = &mesh->normals;
  for (uint32_t c = 0; normals->corners && c < mesh->corner_count; c++) {
    tw_status status = check_index(normals->corners[c], normals->value_count, "normal", "normals", error);
    if (status != TW_OK) return tw_error_at(error, "/face_normals/%u", c);
    const float *value = normals->values + 3 * (size_t)normals->corners[c];
    if (isfinite(value[0]) && isfinite(value[1]) && isfinite(value[2])) continue;
    tw_fail(error, TW_INVALID, "a normal is not finite");
    return tw_error_at(error, "/normals/%u", normals->corners[c]);
  }
  return TW_OK;
}

static tw_status check_tangent_uvs(const tw_mesh *mesh, tw_error *error) {
  for (uint32_t f = 0; mesh->tangent_uvs && f < mesh->face_count; f++) {
    tw_status status =
        check_index(mesh->tangent_uvs[f], mesh->uv_set_count, "set of UVs", "sets of UVs", error);
    if (status != TW_OK) return tw_error_at(error, "/tangent_uvs/%u", f);
  }
  return TW_OK;
}

static tw_status check_sharpness(float sharpness, const char *what, uint32_t index, tw_error *error) {
  if (isfinite(sharpness) && sharpness >= 0) return TW_OK;
  tw_fail(error, TW_INVALID, "sharpness has to be a number from 0 to 10");
  return tw_error_at(error, "/%s/%u/sharpness", what, index);
}

static tw_status check_tags(const tw_mesh *mesh, tw_error *error) {
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = mesh->crease_edges + 2 * (size_t)i;
    tw_status status = check_index(ends[0], mesh->point_count, "point", "points", error);
    if (status == TW_OK) status = check_index(ends[1], mesh->point_count, "point", "points", error);
    if (status != TW_OK) return tw_error_at(error, "/creases/%u/edge", i);
    status = check_sharpness(mesh->crease_sharpness[i], "creases", i, error);
    if (status != TW_OK) return status;
  }
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) {
    tw_status status = check_index(mesh->sharp_points[i], mesh->point_count, "point", "points", error);
    if (status != TW_OK) return tw_error_at(error, "/corners/%u/vertex", i);
    status = check_sharpness(mesh->point_sharpness[i], "corners", i, error);
    if (status != TW_OK) return status;
  }
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    tw_status status = check_index(mesh->holes[i], mesh->face_count, "face", "faces", error);
    if (status != TW_OK) return tw_error_at(error, "/holes/%u", i);
  }
  return TW_OK;
}

/* Writes a name as a token of a JSON pointer. A name that is cut here makes the pointer too long, which
 * tw_error_at cuts before the name. */
static void print_token(const char *name, size_t room, char *out) {
  size_t used = 0;
  for (; *name != '\0' && used + 2 < room; name++) {
    char letter = *name;
    if (letter == '/' || letter == '~') {
      out[used++] = '~';
      letter = '0';
      if (*name == '/') letter = '1';
    }
    out[used++] = letter;
  }
  out[used] = '\0';
}

static tw_status check_point_data(const tw_mesh *mesh, tw_error *error) {
  tw_status status = check_finite(mesh->positions, mesh->point_count, 3, "positions", error);
  for (uint32_t i = 0; i < mesh->attribute_count && status == TW_OK; i++) {
    const tw_attribute *attribute = &mesh->attributes[i];
    char name[sizeof error->pointer];
    print_token(attribute->name, sizeof name, name);
    uint32_t count = attribute->corners ? attribute->value_count : mesh->point_count;
    status = check_finite(attribute->values, count, attribute->width, name, error);
    for (uint32_t c = 0; attribute->corners && c < mesh->corner_count && status == TW_OK; c++)
      status = check_index(attribute->corners[c], attribute->value_count, name, name, error);
  }
  if (status == TW_OK && mesh->skin.joints)
    status = check_finite(mesh->skin.weights, mesh->point_count, mesh->skin.width, "weights", error);
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++)
    status = check_finite(mesh->morphs[m], mesh->point_count, 3, "morphs", error);
  for (uint32_t m = 0; mesh->morph_normals && m < mesh->morph_count && status == TW_OK; m++)
    status = check_finite(mesh->morph_normals[m], mesh->normals.value_count, 3, "morph_normals", error);
  return status;
}

tw_status tw_mesh_check(const tw_mesh *mesh, tw_error *error, uint32_t *face) {
  uint32_t ignored;
  if (!face) face = &ignored;
  *face = UINT32_MAX;
  tw_status status = check_point_data(mesh, error);
  if (status == TW_OK) status = check_faces(mesh, error, face);
  if (status == TW_OK) status = check_uvs(mesh, error, face);
  if (status == TW_OK) status = check_normals(mesh, error);
  if (status == TW_OK) status = check_tangent_uvs(mesh, error);
  if (status == TW_OK) status = check_tags(mesh, error);
  return status;
}

/* ---- deforming: morph targets first, then joints, as glTF 2.0 orders them -------------------- */

static void morph_point(const tw_mesh *mesh, const float *weights, uint32_t point, double out[3]) {
  for (size_t c = 0; c < 3; c++) {
    out[c] = (double)mesh->positions[3 * (size_t)point + c];
    for (uint32_t m = 0; weights && m < mesh->morph_count; m++)
      out[c] += (double)weights[m] * (double)mesh->morphs[m][3 * (size_t)point + c];
  }
}

/* out += share * matrix * point */
static void add_moved(const float matrix[16], const double point[3], double share, double out[3]) {
  for (int c = 0; c < 3; c++)
    out[c] += share * ((double)matrix[c] * point[0] + (double)matrix[4 + c] * point[1] +
                       (double)matrix[8 + c] * point[2] + (double)matrix[12 + c]);
}

static void skin_point(const tw_skin_weights *skin, uint32_t point, const float *matrices,
                       uint32_t joint_count, const double at[3], double out[3]) {
  uint32_t count = skin->width;
  const uint16_t *joints = skin->joints + count * (size_t)point;
  const float *weights = skin->weights + count * (size_t)point;
  double total = 0;
  for (uint32_t k = 0; k < count; k++)
    if (weights[k] > 0) total += (double)weights[k];
  out[0] = out[1] = out[2] = 0;
  for (uint32_t k = 0; k < count; k++) {
    assert(joints[k] < joint_count);
    if (weights[k] > 0) add_moved(matrices + 16 * (size_t)joints[k], at, (double)weights[k] / total, out);
  }
  if (!(total > 0) && joint_count > 0) add_moved(matrices, at, 1, out);
}

tw_status tw_mesh_deform(const tw_mesh *mesh, const float *morph_weights, const float *joint_matrices,
                         uint32_t joint_count, float *out, tw_error *error) {
  const float *morphs = morph_weights ? morph_weights : mesh->morph_weights;
  bool skinned = joint_matrices && mesh->skin.joints;
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    double at[3], moved[3];
    morph_point(mesh, morphs, p, at);
    if (skinned) skin_point(&mesh->skin, p, joint_matrices, joint_count, at, moved);
    for (size_t c = 0; c < 3; c++) {
      float value = (float)(skinned ? moved[c] : at[c]);
      if (!(fabsf(value) <= TW_COORDINATE_MAX)) {
        tw_fail(error, TW_INVALID, "the pose moves a point beyond 1e18");
        return tw_error_at(error, "/positions/%u/%zu", p, c);
      }
      out[3 * (size_t)p + c] = value;
    }
  }
  return TW_OK;
}
