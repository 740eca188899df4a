/* Wavefront OBJ: the statements of its polygonal part. One pass over the text, no allocation a
 * line; the arrays grow by doubling and are copied into the model at the end.
 * Source: Wavefront Advanced Visualizer file formats, appendix B1. */
#include "obj_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/format.h"

/* ---- growing arrays ------------------------------------------------------------------------- */

/* The new capacity for count + more elements, 0 when that is beyond 32 bits. */
static size_t grown_capacity(size_t capacity, size_t count, size_t more) {
  if (more > UINT32_MAX || count + more > UINT32_MAX) return 0;
  size_t twice = capacity < 512 ? 1024 : capacity * 2;
  return count + more > twice ? count + more : twice;
}

/* The array resized, or NULL with *status set. */
static void *grow(void *values, size_t *capacity, size_t count, size_t more, size_t size, tw_status *status,
                  tw_error *error) {
  size_t wanted = grown_capacity(*capacity, count, more);
  *status = wanted ? TW_OK : tw_fail(error, TW_LIMIT, "the file has more than 4294967295 elements of a kind");
  if (!wanted) return NULL;
  void *grown = realloc(values, wanted * size);
  if (grown)
    *capacity = wanted;
  else
    *status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  return grown;
}

tw_status obj_floats_reserve(obj_floats *floats, size_t more, tw_error *error) {
  if (floats->capacity - floats->count >= more) return TW_OK;
  tw_status status;
  float *grown = grow(floats->values, &floats->capacity, floats->count, more, sizeof(float), &status, error);
  if (grown) floats->values = grown;
  return status;
}

tw_status obj_indices_reserve(obj_indices *indices, size_t more, tw_error *error) {
  if (indices->capacity - indices->count >= more) return TW_OK;
  tw_status status;
  uint32_t *grown =
      grow(indices->values, &indices->capacity, indices->count, more, sizeof(uint32_t), &status, error);
  if (grown) indices->values = grown;
  return status;
}

void obj_parts_deinit(obj_parts *parts) {
  free(parts->positions.values);
  free(parts->colors.values);
  free(parts->uvs.values);
  free(parts->corners.values);
  free(parts->corner_uvs.values);
  free(parts->face_starts.values);
  free(parts->materials.values);
  free(parts->groups.values);
  free(parts->objects);
  obj_names_deinit(&parts->material_names);
  obj_names_deinit(&parts->group_names);
  free(parts->crease_points.values);
  free(parts->crease_sharpness.values);
  free(parts->sharp_points.values);
  free(parts->point_sharpness.values);
  free(parts->holes.values);
}

/* ---- v, vt, vn ------------------------------------------------------------------------------ */

/* Up to `most` numbers of this statement; *count says how many there were. */
static tw_status read_numbers(obj_text *text, float *out, size_t most, size_t *count, tw_error *error) {
  *count = 0;
  while (*count < most && !obj_statement_ends(text)) {
    double value;
    if (!obj_read_number(text, &value))
      return tw_fail_line(error, TW_SYNTAX, text->line, "a number is malformed");
    out[*count] = (float)value;
    if (!isfinite(out[*count]))
      return tw_fail_line(error, TW_INVALID, text->line, "a number is too large for a 32-bit float");
    (*count)++;
  }
  return TW_OK;
}

/* The colour of the newest point. White stands for the points without one. */
static tw_status add_color(obj_parts *parts, const float *rgb, tw_error *error) {
  obj_floats *colors = &parts->colors;
  size_t wanted = parts->positions.count;
  tw_status status = obj_floats_reserve(colors, wanted - colors->count, error);
  if (status != TW_OK) return status;
  while (colors->count + 3 < wanted) colors->values[colors->count++] = 1;
  for (int i = 0; i < 3; i++) colors->values[colors->count++] = rgb[i];
  return TW_OK;
}

/* v x y z, v x y z w, v x y z r g b or v x y z r g b a. A weight belongs to curves; it and alpha
 * are read over. */
static tw_status read_point(obj_parts *parts, obj_text *text, tw_error *error) {
  float values[7];
  size_t count;
  uint64_t line = text->line;
  tw_status status = read_numbers(text, values, 7, &count, error);
  if (status != TW_OK) return status;
  if (count < 3 || count == 5)
    return tw_fail_line(error, TW_SYNTAX, line,
                        "a point needs 3 coordinates, and 3 more numbers for a colour");
  status = obj_floats_reserve(&parts->positions, 3, error);
  if (status != TW_OK) return status;
  memcpy(parts->positions.values + parts->positions.count, values, 3 * sizeof(float));
  parts->positions.count += 3;
  return count >= 6 ? add_color(parts, values + 3, error) : TW_OK;
}

/* vt u, vt u v or vt u v w. */
static tw_status read_uv(obj_parts *parts, obj_text *text, tw_error *error) {
  float values[3] = {0, 0, 0};
  size_t count;
  uint64_t line = text->line;
  tw_status status = read_numbers(text, values, 3, &count, error);
  if (status != TW_OK) return status;
  if (count == 0) return tw_fail_line(error, TW_SYNTAX, line, "a texture coordinate needs a number");
  status = obj_floats_reserve(&parts->uvs, 2, error);
  if (status != TW_OK) return status;
  memcpy(parts->uvs.values + parts->uvs.count, values, 2 * sizeof(float));
  parts->uvs.count += 2;
  return TW_OK;
}

/* Normals come from the surface: theirs are only counted. */
static tw_status count_normal(obj_parts *parts, obj_text *text, tw_error *error) {
  if (parts->normal_count == UINT32_MAX) return tw_fail_line(error, TW_LIMIT, text->line, "too many normals");
  parts->normal_count++;
  return TW_OK;
}

/* ---- f -------------------------------------------------------------------------------------- */

/* An OBJ index, from 1 or counted back from the newest element, as one from 0. */
static tw_status resolve(int64_t index, uint64_t count, obj_highest *highest, uint64_t line, uint32_t *out,
                         tw_error *error) {
  if (index == 0) return tw_fail_line(error, TW_INVALID, line, "index 0: they start from 1");
  if (index < 0 && (uint64_t)-index > count)
    return tw_fail_line(error, TW_INVALID, line, "index %lld is out of range: there are %llu so far",
                        (long long)index, (unsigned long long)count);
  uint64_t from_one = index > 0 ? (uint64_t)index : count + 1 - (uint64_t)-index;
  if (from_one >= UINT32_MAX) return tw_fail_line(error, TW_INVALID, line, "an index is out of range");
  if (from_one > highest->index) *highest = (obj_highest){from_one, line};
  *out = (uint32_t)(from_one - 1);
  return TW_OK;
}

static tw_status read_index(obj_text *text, uint64_t count, obj_highest *highest, uint32_t *out,
                            tw_error *error) {
  int64_t index;
  if (!obj_read_integer(text, &index))
    return tw_fail_line(error, TW_SYNTAX, text->line, "an index is malformed");
  return resolve(index, count, highest, text->line, out, error);
}

static bool take_slash(obj_text *text) {
  if (text->at == text->end || *text->at != '/') return false;
  text->at++;
  return true;
}

static bool ends_corner(const obj_text *text) {
  if (text->at == text->end) return true;
  uint8_t c = *text->at;
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '#' || c == '\\';
}

/* p, p/t, p//n or p/t/n. */
static tw_status read_corner(obj_parts *parts, obj_text *text, uint32_t *point, uint32_t *uv,
                             tw_error *error) {
  *uv = OBJ_NO_UV;
  tw_status status = read_index(text, parts->positions.count / 3, &parts->corner_point, point, error);
  if (status != TW_OK || !take_slash(text)) return status;
  if (text->at < text->end && *text->at != '/' && !ends_corner(text)) {
    status = read_index(text, parts->uvs.count / 2, &parts->corner_uv, uv, error);
    if (status != TW_OK) return status;
  }
  uint32_t normal;
  if (!take_slash(text) || ends_corner(text)) return TW_OK; /* some write p// and p/t/ */
  return read_index(text, parts->normal_count, &parts->corner_normal, &normal, error);
}

/* Keeps corner_uvs in step with corners, from the first corner on that has one. */
static tw_status add_corner_uv(obj_parts *parts, uint32_t uv, tw_error *error) {
  obj_indices *uvs = &parts->corner_uvs;
  if (uv == OBJ_NO_UV) parts->missing_uvs++;
  if (uvs->count == 0 && uv == OBJ_NO_UV) return TW_OK;
  tw_status status = obj_indices_reserve(uvs, parts->corners.count - uvs->count, error);
  if (status != TW_OK) return status;
  while (uvs->count + 1 < parts->corners.count) uvs->values[uvs->count++] = OBJ_NO_UV;
  uvs->values[uvs->count++] = uv;
  return TW_OK;
}

static int compare_indices(const void *a, const void *b) {
  uint32_t left = *(const uint32_t *)a, right = *(const uint32_t *)b;
  return (left > right) - (left < right);
}

/* Whether a face names a point twice. Large faces are sorted, so that none costs more than n log n. */
static tw_status find_repeat(const uint32_t *corners, size_t count, bool *repeats, tw_error *error) {
  enum { SMALL = 16 };
  *repeats = false;
  if (count <= SMALL) {
    for (size_t i = 1; i < count; i++)
      for (size_t j = 0; j < i; j++) *repeats |= corners[i] == corners[j];
    return TW_OK;
  }
  uint32_t *sorted = tw_alloc(count, sizeof *sorted);
  if (!sorted) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  memcpy(sorted, corners, count * sizeof *sorted);
  qsort(sorted, count, sizeof *sorted, compare_indices);
  for (size_t i = 1; i < count; i++) *repeats |= sorted[i] == sorted[i - 1];
  free(sorted);
  return TW_OK;
}

/* The material or groups of the newest face. Nothing is stored before the first face that has some. */
static tw_status label_face(const obj_parts *parts, obj_indices *labels, uint32_t label, tw_error *error) {
  if (labels->count == 0 && label == OBJ_NO_NAME) return TW_OK;
  tw_status status = obj_indices_reserve(labels, parts->face_starts.count - labels->count, error);
  if (status != TW_OK) return status;
  while (labels->count + 1 < parts->face_starts.count) labels->values[labels->count++] = OBJ_NO_NAME;
  labels->values[labels->count++] = label;
  return TW_OK;
}

static tw_status read_face(obj_parts *parts, obj_text *text, tw_error *error) {
  obj_indices *corners = &parts->corners;
  size_t first = corners->count;
  uint64_t line = text->line;
  tw_status status;
  while (!obj_statement_ends(text)) {
    uint32_t point, uv;
    status = read_corner(parts, text, &point, &uv, error);
    if (status != TW_OK) return status;
    if (!ends_corner(text)) return tw_fail_line(error, TW_SYNTAX, text->line, "a corner is malformed");
    status = obj_indices_reserve(corners, 1, error);
    if (status != TW_OK) return status;
    corners->values[corners->count++] = point;
    status = add_corner_uv(parts, uv, error);
    if (status != TW_OK) return status;
  }
  size_t count = corners->count - first;
  if (count < 3) return tw_fail_line(error, TW_INVALID, line, "a face needs at least 3 corners");
  bool repeats;
  status = find_repeat(corners->values + first, count, &repeats, error);
  if (status != TW_OK) return status;
  if (repeats) return tw_fail_line(error, TW_INVALID, line, "a face names the same point twice");
  status = obj_indices_reserve(&parts->face_starts, 1, error);
  if (status != TW_OK) return status;
  parts->face_starts.values[parts->face_starts.count++] = (uint32_t)first;
  status = label_face(parts, &parts->materials, parts->material, error);
  return status == TW_OK ? label_face(parts, &parts->groups, parts->group, error) : status;
}

/* ---- o, g and the rest ---------------------------------------------------------------------- */

/* An object that no face follows is forgotten when the next one begins. */
static tw_status begin_object(obj_parts *parts, obj_text *text, tw_error *error) {
  obj_object object = {obj_read_rest(text), (uint32_t)parts->face_starts.count};
  obj_object *last = parts->object_count ? &parts->objects[parts->object_count - 1] : NULL;
  if (last && last->first_face == object.first_face) {
    *last = object;
    return TW_OK;
  }
  if (!parts->objects || parts->object_count == parts->object_capacity) {
    size_t capacity = parts->object_capacity ? parts->object_capacity * 2 : 16;
    obj_object *grown = realloc(parts->objects, capacity * sizeof *grown);
    if (!grown) return tw_fail(error, TW_NO_MEMORY, "out of memory");
    parts->objects = grown;
    parts->object_capacity = capacity;
  }
  parts->objects[parts->object_count++] = object;
  return TW_OK;
}

/* The set of groups that the faces to come are in. `default` is the group of faces that are in none. */
static tw_status begin_groups(obj_parts *parts, obj_text *text, tw_error *error) {
  enum { TEXT_MAX = 1024 }; /* each part of an answer may name its groups again */
  obj_word names = obj_read_words(text);
  if (parts->first_group.length == 0) parts->first_group = names;
  parts->group = OBJ_NO_NAME;
  if (names.length > TEXT_MAX) {
    parts->long_groups++;
    return TW_OK;
  }
  if (names.length == 0 || obj_word_is(names, "default")) return TW_OK;
  return obj_number_name(&parts->group_names, names, &parts->group, error);
}

static tw_status use_material(obj_parts *parts, obj_text *text, tw_error *error) {
  obj_word name = obj_read_rest(text);
  parts->material = OBJ_NO_NAME;
  return name.length > 0 ? obj_number_name(&parts->material_names, name, &parts->material, error) : TW_OK;
}

/* Statements of this kind that tweend has no use for, by their whole word. */
static tw_status read_other(obj_parts *parts, obj_text *text, obj_word word, tw_error *error) {
  if (obj_word_is(word, "usemtl")) return use_material(parts, text, error);
  if (obj_word_is(word, "l") || obj_word_is(word, "p") || obj_word_is(word, "curv") ||
      obj_word_is(word, "curv2") || obj_word_is(word, "surf"))
    parts->ignored_elements++;
  for (size_t i = 0; i < word.length; i++) {
    char c = word.text[i];
    bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (!letter) return tw_fail_line(error, TW_SYNTAX, text->line, "this is not a statement of an OBJ file");
  }
  return TW_OK;
}

static tw_status read_statement(obj_parts *parts, obj_text *text, tw_error *error) {
  obj_word word = obj_read_word(text);
  if (word.length == 1) {
    switch (word.text[0]) {
    case 'v': return read_point(parts, text, error);
    case 'f': return read_face(parts, text, error);
    case 't': return obj_read_tag(parts, text, error);
    case 'o': return begin_object(parts, text, error);
    case 'g': return begin_groups(parts, text, error);
    default: break;
    }
  }
  if (obj_word_is(word, "vt")) return read_uv(parts, text, error);
  if (obj_word_is(word, "vn")) return count_normal(parts, text, error);
  return read_other(parts, text, word, error);
}

static tw_status read_statements(obj_parts *parts, obj_text *text, tw_error *error) {
  if (text->end - text->at >= 3 && memcmp(text->at, "\xEF\xBB\xBF", 3) == 0) text->at += 3;
  while (text->at < text->end) {
    if (obj_statement_ends(text)) {
      obj_next_line(text);
      continue;
    }
    tw_status status = read_statement(parts, text, error);
    if (status != TW_OK) return status;
    obj_next_statement(text);
  }
  return TW_OK;
}

/* ---- the whole ------------------------------------------------------------------------------ */

static tw_status check_highest(const obj_highest *highest, uint64_t count, const char *what, uint64_t first,
                               tw_error *error) {
  if (highest->index <= count) return TW_OK;
  uint64_t index = highest->index - 1 + first;
  return tw_fail_line(error, TW_INVALID, highest->line, "index %llu is out of range: the file has %llu %s",
                      (unsigned long long)index, (unsigned long long)count, what);
}

static tw_status check_ranges(const obj_parts *parts, tw_error *error) {
  uint64_t points = parts->positions.count / 3;
  tw_status status = check_highest(&parts->corner_point, points, "points", 1, error);
  if (status == TW_OK)
    status = check_highest(&parts->corner_uv, parts->uvs.count / 2, "texture coordinates", 1, error);
  if (status == TW_OK)
    status = check_highest(&parts->corner_normal, parts->normal_count, "normals", 1, error);
  if (status == TW_OK) status = check_highest(&parts->tagged_point, points, "points", 0, error);
  if (status == TW_OK)
    status = check_highest(&parts->tagged_face, parts->face_starts.count, "faces", 0, error);
  return status;
}

static tw_status check_content(const obj_parts *parts, const obj_text *text, tw_error *error) {
  if (parts->face_starts.count > 0) return check_ranges(parts, error);
  if (parts->positions.count == 0)
    return tw_fail_line(error, TW_SYNTAX, text->line,
                        "there is no point and no face: this is not an OBJ file");
  return tw_fail_line(error, TW_INVALID, text->line, "the file has points and no face");
}

static void warn(const obj_parts *parts, tw_model *model) {
  if (parts->ignored_elements > 0)
    tw_model_warn(model, "%llu lines, points or curves are left out: only faces have a surface",
                  (unsigned long long)parts->ignored_elements);
  if (parts->ignored_tags > 0)
    tw_model_warn(model, "%llu subdivision tags are left out: their names are not known",
                  (unsigned long long)parts->ignored_tags);
  if (parts->missing_uvs > 0 && parts->corner_uvs.count > 0)
    tw_model_warn(model, "%llu face corners have no texture coordinate and get 0 0",
                  (unsigned long long)parts->missing_uvs);
  if (parts->long_groups > 0)
    tw_model_warn(model, "%llu sets of groups are left out: their names have over 1024 bytes",
                  (unsigned long long)parts->long_groups);
}

static tw_status read_model(obj_parts *parts, obj_text *text, tw_model *model, tw_error *error) {
  tw_status status = read_statements(parts, text, error);
  if (status == TW_OK) status = check_content(parts, text, error);
  if (status == TW_OK) status = obj_build_model(parts, model, error);
  if (status != TW_OK) return status;
  warn(parts, model);
  return tw_model_finish(model, error);
}

tw_status tw_obj_read(const uint8_t *bytes, size_t size, tw_model **out, tw_error *error) {
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_OBJ;
  obj_parts parts = {.material = OBJ_NO_NAME,
                     .group = OBJ_NO_NAME,
                     .tag_boundary = TW_TAG_UNSET,
                     .tag_uv = TW_TAG_UNSET,
                     .tag_creasing = TW_TAG_UNSET,
                     .tag_triangles = TW_TAG_UNSET};
  obj_text text = {bytes, bytes + size, 1};
  tw_status status = read_model(&parts, &text, model, error);
  obj_parts_deinit(&parts);
  if (status != TW_OK) {
    tw_model_destroy(model);
    return status;
  }
  *out = model;
  return TW_OK;
}
