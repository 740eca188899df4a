/* Subdivision tags in OBJ files, as the tools of OpenSubdiv write them:
 * t NAME INTS/FLOATS/STRINGS values..., with indices from 0. */
#include "obj_parts.h"

#include <math.h>
#include <stdlib.h>

#include "tweend/subdiv.h"

/* The values of one tag, read into memory that is sized by what the text really holds. */
typedef struct tag_values {
  uint64_t line;
  size_t int_count, float_count, string_count;
  obj_indices ints;
  obj_floats floats;
  obj_word string; /* the first one */
} tag_values;

static tw_status bad_tag(const tag_values *values, tw_error *error, const char *what) {
  return tw_fail_line(error, TW_SYNTAX, values->line, "%s", what);
}

/* INTS/FLOATS or INTS/FLOATS/STRINGS. */
static bool read_counts(obj_text *text, tag_values *values) {
  int64_t counts[3] = {0, 0, 0};
  obj_skip_blanks(text);
  for (int i = 0; i < 3; i++) {
    if (i > 0) {
      if (text->at == text->end || *text->at != '/') {
        if (i < 2) return false;
        break;
      }
      text->at++;
    }
    if (!obj_read_integer(text, &counts[i]) || counts[i] < 0) return false;
  }
  values->int_count = (size_t)counts[0];
  values->float_count = (size_t)counts[1];
  values->string_count = (size_t)counts[2];
  return true;
}

static tw_status read_ints(obj_text *text, tag_values *values, tw_error *error) {
  for (size_t i = 0; i < values->int_count; i++) {
    int64_t value;
    obj_skip_blanks(text);
    if (!obj_read_integer(text, &value)) return bad_tag(values, error, "an integer of the tag is missing");
    if (value < 0 || value >= UINT32_MAX)
      return bad_tag(values, error, "an integer of the tag is out of range");
    tw_status status = obj_indices_reserve(&values->ints, 1, error);
    if (status != TW_OK) return status;
    values->ints.values[values->ints.count++] = (uint32_t)value;
  }
  return TW_OK;
}

static tw_status read_floats(obj_text *text, tag_values *values, tw_error *error) {
  for (size_t i = 0; i < values->float_count; i++) {
    double value;
    if (!obj_read_number(text, &value) || !isfinite((float)value))
      return bad_tag(values, error, "a number of the tag is missing or malformed");
    tw_status status = obj_floats_reserve(&values->floats, 1, error);
    if (status != TW_OK) return status;
    values->floats.values[values->floats.count++] = (float)value;
  }
  return TW_OK;
}

static tw_status read_values(obj_text *text, tag_values *values, tw_error *error) {
  if (!read_counts(text, values))
    return bad_tag(values, error, "the tag's counts are not INTS/FLOATS/STRINGS");
  tw_status status = read_ints(text, values, error);
  if (status == TW_OK) status = read_floats(text, values, error);
  if (status != TW_OK || values->string_count == 0) return status;
  if (obj_statement_ends(text)) return bad_tag(values, error, "a string of the tag is missing");
  values->string = obj_read_word(text);
  return TW_OK;
}

/* Sharpness of the tag's element `index`, in the range that meshes have. One value serves for all;
 * `stride` ints make an element, and the tools accept a value for each int as well. */
static float sharpness_of(const tag_values *values, size_t index, size_t stride) {
  size_t at = 0;
  if (values->float_count > 1) at = values->float_count == values->int_count ? index * stride : index;
  return fminf(fmaxf(values->floats.values[at], 0), TW_SHARPNESS_INFINITE);
}

static void note_highest(obj_highest *highest, uint32_t index, uint64_t line) {
  if ((uint64_t)index + 1 <= highest->index) return;
  *highest = (obj_highest){(uint64_t)index + 1, line};
}

static tw_status add_creases(obj_parts *parts, const tag_values *values, tw_error *error) {
  size_t count = values->int_count / 2;
  if (values->int_count % 2 != 0) return bad_tag(values, error, "a crease needs pairs of points");
  if (values->float_count != 1 && values->float_count != count && values->float_count != values->int_count)
    return bad_tag(values, error, "a crease needs one sharpness, or one a pair");
  tw_status status = obj_indices_reserve(&parts->crease_points, values->int_count, error);
  if (status == TW_OK) status = obj_floats_reserve(&parts->crease_sharpness, count, error);
  if (status != TW_OK) return status;
  for (size_t i = 0; i < count; i++) {
    const uint32_t *ends = values->ints.values + 2 * i;
    if (ends[0] == ends[1]) return bad_tag(values, error, "a crease needs two different points");
    for (int end = 0; end < 2; end++) {
      note_highest(&parts->tagged_point, ends[end], values->line);
      parts->crease_points.values[parts->crease_points.count++] = ends[end];
    }
    parts->crease_sharpness.values[parts->crease_sharpness.count++] = sharpness_of(values, i, 2);
  }
  return TW_OK;
}

static tw_status add_corners(obj_parts *parts, const tag_values *values, tw_error *error) {
  if (values->float_count != 1 && values->float_count != values->int_count)
    return bad_tag(values, error, "a corner needs one sharpness, or one a point");
  tw_status status = obj_indices_reserve(&parts->sharp_points, values->int_count, error);
  if (status == TW_OK) status = obj_floats_reserve(&parts->point_sharpness, values->int_count, error);
  if (status != TW_OK) return status;
  for (size_t i = 0; i < values->ints.count; i++) {
    note_highest(&parts->tagged_point, values->ints.values[i], values->line);
    parts->sharp_points.values[parts->sharp_points.count++] = values->ints.values[i];
    parts->point_sharpness.values[parts->point_sharpness.count++] = sharpness_of(values, i, 1);
  }
  return TW_OK;
}

static tw_status add_holes(obj_parts *parts, const tag_values *values, tw_error *error) {
  tw_status status = obj_indices_reserve(&parts->holes, values->int_count, error);
  if (status != TW_OK) return status;
  for (size_t i = 0; i < values->ints.count; i++) {
    note_highest(&parts->tagged_face, values->ints.values[i], values->line);
    parts->holes.values[parts->holes.count++] = values->ints.values[i];
  }
  return TW_OK;
}

/* The tag's one int looked up in a table. */
static tw_status set_from_int(const tag_values *values, const int *table, size_t size, int *out,
                              tw_error *error) {
  if (values->int_count != 1 || !values->ints.values || values->ints.values[0] >= size)
    return bad_tag(values, error, "the tag needs one integer, of those that it knows");
  *out = table[values->ints.values[0]];
  return TW_OK;
}

static tw_status set_creasing(obj_parts *parts, const tag_values *values, tw_error *error) {
  if (obj_word_is(values->string, "normal") || obj_word_is(values->string, "uniform"))
    parts->tag_creasing = TW_CREASE_UNIFORM;
  else if (obj_word_is(values->string, "chaikin"))
    parts->tag_creasing = TW_CREASE_CHAIKIN;
  else
    return bad_tag(values, error, "creasemethod is one of normal, chaikin");
  return TW_OK;
}

/* By name, or by the number that older tools wrote. */
static tw_status set_triangles(obj_parts *parts, const tag_values *values, tw_error *error) {
  static const int numbers[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH, TW_TRIANGLES_SMOOTH};
  if (values->string_count == 0) return set_from_int(values, numbers, 3, &parts->tag_triangles, error);
  if (obj_word_is(values->string, "catmark") || obj_word_is(values->string, "normal"))
    parts->tag_triangles = TW_TRIANGLES_CATMULL_CLARK;
  else if (obj_word_is(values->string, "smooth"))
    parts->tag_triangles = TW_TRIANGLES_SMOOTH;
  else
    return bad_tag(values, error, "smoothtriangles is one of catmark, smooth");
  return TW_OK;
}

static tw_status apply(obj_parts *parts, obj_word name, const tag_values *values, tw_error *error) {
  static const int boundaries[] = {TW_BOUNDARY_NONE, TW_BOUNDARY_EDGE_AND_CORNER, TW_BOUNDARY_EDGE_ONLY};
  static const int uv_rules[] = {TW_UV_NONE,          TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS1,
                                 TW_UV_CORNERS_PLUS2, TW_UV_BOUNDARIES,   TW_UV_ALL};
  if (obj_word_is(name, "crease")) return add_creases(parts, values, error);
  if (obj_word_is(name, "corner")) return add_corners(parts, values, error);
  if (obj_word_is(name, "hole")) return add_holes(parts, values, error);
  if (obj_word_is(name, "interpolateboundary"))
    return set_from_int(values, boundaries, 3, &parts->tag_boundary, error);
  if (obj_word_is(name, "facevaryinginterpolateboundary"))
    return set_from_int(values, uv_rules, 6, &parts->tag_uv, error);
  if (obj_word_is(name, "creasemethod")) return set_creasing(parts, values, error);
  return set_triangles(parts, values, error);
}

static bool is_known(obj_word name) {
  static const char *const names[] = {
      "crease",       "corner",         "hole", "interpolateboundary", "facevaryinginterpolateboundary",
      "creasemethod", "smoothtriangles"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (obj_word_is(name, names[i])) return true;
  return false;
}

tw_status obj_read_tag(obj_parts *parts, obj_text *text, tw_error *error) {
  obj_word name = obj_read_word(text);
  if (!is_known(name)) {
    parts->ignored_tags++;
    return TW_OK;
  }
  tag_values values = {.line = text->line};
  tw_status status = read_values(text, &values, error);
  if (status == TW_OK) status = apply(parts, name, &values, error);
  free(values.ints.values);
  free(values.floats.values);
  return status;
}
