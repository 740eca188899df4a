/* Subdivision tags of OBJ files: a reader for each kind. */
#include "obj_tags.h"

#include <math.h>

#include "tweend/subdiv.h"

/* The tag that is being read. */
typedef struct obj_tag {
  tw_error *error;
  tw_losses *losses;
  tw_word name;
  uint64_t line;
  uint64_t int_count, float_count, string_count;
  bool *has_more; /* set where a value of the tag is left out */
} obj_tag;

static tw_status bad_tag(const obj_tag *tag, const char *what) {
  return tw_fail_line(tag->error, TW_SYNTAX, tag->line, "%s", what);
}

/* INTS/FLOATS or INTS/FLOATS/STRINGS. */
static bool read_counts(tw_obj_text *text, obj_tag *tag) {
  int64_t counts[3] = {0, 0, 0};
  tw_obj_skip_blanks(text);
  for (int i = 0; i < 3; i++) {
    if (i > 0 && !tw_obj_take_slash(text)) {
      if (i < 2) return false;
      break;
    }
    if (!tw_obj_read_integer(text, &counts[i]) || counts[i] < 0) return false;
  }
  tag->int_count = (uint64_t)counts[0];
  tag->float_count = (uint64_t)counts[1];
  tag->string_count = (uint64_t)counts[2];
  return true;
}

enum { NUMBER_STEPS = 4 }; /* of tw_work */

static tw_status read_tag_int(const obj_tag *tag, tw_obj_text *text, uint32_t *out) {
  int64_t value;
  if (!tw_work(NUMBER_STEPS)) return tw_work_status(tag->error);
  tw_obj_skip_blanks(text);
  if (!tw_obj_read_integer(text, &value)) return bad_tag(tag, "an integer of the tag is missing");
  if (value < 0 || value >= UINT32_MAX) return bad_tag(tag, "an integer of the tag is out of range");
  *out = (uint32_t)value;
  return TW_OK;
}

static tw_status read_tag_float(const obj_tag *tag, tw_obj_text *text, float *out) {
  double value;
  if (!tw_work(NUMBER_STEPS)) return tw_work_status(tag->error);
  if (!tw_obj_read_number(text, &value) || !isfinite((float)value))
    return bad_tag(tag, "a number of the tag is missing or malformed");
  *out = (float)value;
  return TW_OK;
}

/* Notes what of a tag is left out. */
static void lose_of_tag(const obj_tag *tag, const char *one, const char *many, bool is_lost) {
  tw_lose(tag->losses, one, many, is_lost, tag->line);
}

/* Passes over numbers that the tag's kind has no use for. */
static tw_status skip_numbers(const obj_tag *tag, tw_obj_text *text, uint64_t ints, uint64_t floats) {
  uint32_t number;
  float value;
  tw_status status = TW_OK;
  *tag->has_more |= ints + floats > 0;
  for (; ints > 0 && status == TW_OK; ints--) status = read_tag_int(tag, text, &number);
  for (; floats > 0 && status == TW_OK; floats--) status = read_tag_float(tag, text, &value);
  return status;
}

/* Ends a tag of numbers: checks that a string follows if the tag says so. */
static tw_status end_numbers(const obj_tag *tag, tw_obj_text *text, uint64_t floats) {
  tw_status status = skip_numbers(tag, text, 0, floats);
  if (status == TW_OK && tag->string_count > 0 && tw_obj_statement_ends(text))
    status = bad_tag(tag, "a string of the tag is missing");
  return status;
}

/* Reads the ints of a tag as indices below `count` into out[first] and the elements after it. out: NULL only
 * if no int follows, and then nothing is stored. */
static tw_status read_tag_indices(const obj_tag *tag, tw_obj_text *text, uint64_t count, const char *one,
                                  const char *many, uint64_t first, uint32_t *out) {
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->int_count && status == TW_OK; i++) {
    uint32_t index = 0;
    status = read_tag_int(tag, text, &index);
    if (status == TW_OK && index >= count)
      status =
          tw_fail_line(tag->error, TW_INVALID, tag->line, "index %u is out of range: the file has %llu %s",
                       index, (unsigned long long)count, tw_plural(count, one, many));
    if (status == TW_OK) out[first + i] = index;
  }
  return status;
}

/* Reads the floats of a tag as the sharpness of `count` elements into out[first] and the elements after it,
 * clamped to the range of meshes: all from 10 on is infinitely sharp. There is one value for all elements or
 * one for each; an element has `width` ints, and like the tools this accepts one value for each int as well,
 * of which the first counts. */
static tw_status read_sharpness(const obj_tag *tag, tw_obj_text *text, uint64_t width, uint64_t count,
                                uint64_t first, float *out) {
  uint64_t stride = tag->float_count == count ? 1 : width;
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->float_count && status == TW_OK; i++) {
    float value = 0;
    status = read_tag_float(tag, text, &value);
    if (status != TW_OK || i / stride >= count) continue;
    float *sharpness = &out[first + i / stride], clamped = fminf(fmaxf(value, 0), TW_SHARPNESS_INFINITE);
    *tag->has_more |= i % stride > 0 && *sharpness != clamped;
    lose_of_tag(tag, "crease or corner has a sharpness below 0: it is 0",
                "creases and corners have a sharpness below 0: it is 0", value < 0);
    if (i % stride == 0) *sharpness = clamped;
  }
  for (uint64_t i = 1; tag->float_count == 1 && i < count; i++) out[first + i] = out[first];
  return status == TW_OK ? end_numbers(tag, text, 0) : status;
}

static tw_status read_crease_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  uint64_t count = tag->int_count / 2, first = tags->read.crease_points;
  if (tag->int_count % 2 != 0) return bad_tag(tag, "a crease needs pairs of points");
  if (tag->float_count != 1 && tag->float_count != count && tag->float_count != tag->int_count)
    return bad_tag(tag, "a crease needs one sharpness, or one a pair");
  uint32_t *points = tags->crease_points;
  tw_status status = read_tag_indices(tag, text, tags->point_count, "point", "points", first, points);
  for (uint64_t i = 0; i < count && status == TW_OK; i++)
    if (points[first + 2 * i] == points[first + 2 * i + 1])
      status = bad_tag(tag, "a crease needs two different points");
  tags->read.crease_points += tag->int_count;
  if (status != TW_OK) return status;
  return read_sharpness(tag, text, 2, count, first / 2, tags->crease_sharpness);
}

static tw_status read_corner_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  uint64_t first = tags->read.sharp_points;
  if (tag->float_count != 1 && tag->float_count != tag->int_count)
    return bad_tag(tag, "a corner needs one sharpness, or one a point");
  tw_status status =
      read_tag_indices(tag, text, tags->point_count, "point", "points", first, tags->sharp_points);
  tags->read.sharp_points += tag->int_count;
  if (status != TW_OK) return status;
  return read_sharpness(tag, text, 1, tag->int_count, first, tags->point_sharpness);
}

static tw_status read_hole_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  tw_status status =
      read_tag_indices(tag, text, tags->face_count, "face", "faces", tags->read.holes, tags->holes);
  tags->read.holes += tag->int_count;
  return status == TW_OK ? end_numbers(tag, text, tag->float_count) : status;
}

/* Sets what a tag says of the whole mesh. A later tag of its kind wins. */
static void set_rule(const obj_tag *tag, int value, int *out) {
  lose_of_tag(tag, "subdivision tag takes the place of another one of its name",
              "subdivision tags take the place of others of their names",
              *out != TW_TAG_UNSET && *out != value);
  lose_of_tag(tag, "subdivision tag says what another one has said",
              "subdivision tags say what others have said", *out == value);
  *out = value;
}

/* Reads the tag's one int and looks it up in a table. */
static tw_status set_from_int(const obj_tag *tag, tw_obj_text *text, const int *table, size_t size,
                              int *out) {
  uint32_t value = UINT32_MAX;
  tw_status status = tag->int_count > 0 ? read_tag_int(tag, text, &value) : TW_OK;
  if (status == TW_OK && (tag->int_count != 1 || value >= size))
    status = bad_tag(tag, "the tag needs one integer, of those that it knows");
  if (status == TW_OK) status = end_numbers(tag, text, tag->float_count);
  if (status == TW_OK) set_rule(tag, table[value], out);
  return status;
}

/* Reads the tag's string, which follows its numbers: names[i] means values[i]. */
static tw_status set_from_string(const obj_tag *tag, tw_obj_text *text, const char *const *names,
                                 const int *values, const char *fault, int *out) {
  tw_status status = skip_numbers(tag, text, tag->int_count, tag->float_count);
  if (status != TW_OK) return status;
  tw_word word = {"", 0};
  if (tag->string_count > 0) word = tw_obj_read_word(text);
  for (size_t i = 0; names[i]; i++) {
    if (!tw_word_is(word, names[i])) continue;
    set_rule(tag, values[i], out);
    return TW_OK;
  }
  return bad_tag(tag, fault);
}

static tw_status read_creasing_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  static const char *const names[] = {"normal", "uniform", "chaikin", NULL};
  static const int values[] = {TW_CREASE_UNIFORM, TW_CREASE_UNIFORM, TW_CREASE_CHAIKIN};
  return set_from_string(tag, text, names, values, "creasemethod is one of normal, chaikin", &tags->creasing);
}

/* Names the rule, or has the number that older tools wrote. */
static tw_status read_triangles_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  static const int numbers[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH, TW_TRIANGLES_SMOOTH};
  static const char *const names[] = {"catmark", "normal", "smooth", NULL};
  static const int values[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH};
  if (tag->string_count == 0) return set_from_int(tag, text, numbers, 3, &tags->triangles);
  return set_from_string(tag, text, names, values, "smoothtriangles is one of catmark, smooth",
                         &tags->triangles);
}

static tw_status read_boundary_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  static const int rules[] = {TW_BOUNDARY_NONE, TW_BOUNDARY_EDGE_AND_CORNER, TW_BOUNDARY_EDGE_ONLY};
  return set_from_int(tag, text, rules, 3, &tags->boundary);
}

static tw_status read_uv_tag(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text) {
  static const int rules[] = {TW_UV_NONE,          TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS1,
                              TW_UV_CORNERS_PLUS2, TW_UV_BOUNDARIES,   TW_UV_ALL};
  return set_from_int(tag, text, rules, 6, &tags->uv);
}

tw_status tw_obj_read_tag(tw_obj_tags *tags, tw_obj_text *text, tw_losses *losses, tw_error *error) {
  static const struct {
    const char *name;
    tw_status (*read)(tw_obj_tags *tags, const obj_tag *tag, tw_obj_text *text);
  } kinds[] = {{"crease", read_crease_tag},
               {"corner", read_corner_tag},
               {"hole", read_hole_tag},
               {"interpolateboundary", read_boundary_tag},
               {"facevaryinginterpolateboundary", read_uv_tag},
               {"creasemethod", read_creasing_tag},
               {"smoothtriangles", read_triangles_tag}};
  bool has_more = false;
  obj_tag tag = {.error = error,
                 .losses = losses,
                 .line = text->line,
                 .name = tw_obj_read_word(text),
                 .has_more = &has_more};
  tags->any = true;
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
    if (!tw_word_is(tag.name, kinds[i].name)) continue;
    if (!read_counts(text, &tag)) return bad_tag(&tag, "the tag's counts are not INTS/FLOATS/STRINGS");
    tw_status status = kinds[i].read(tags, &tag, text);
    lose_of_tag(&tag, "subdivision tag has values that are left out",
                "subdivision tags have values that are left out", has_more || !tw_obj_statement_ends(text));
    return status;
  }
  lose_of_tag(&tag, "subdivision tag is left out: its name is not known",
              "subdivision tags are left out: their names are not known", true);
  return TW_OK;
}

/* Each integer but the first takes at least two bytes: a separator or sign, and a digit. */
void tw_obj_count_tag(tw_obj_tag_counts *all, tw_obj_text *text) {
  obj_tag tag = {.name = tw_obj_read_word(text)};
  uint64_t *count = tw_word_is(tag.name, "crease")   ? &all->crease_points
                    : tw_word_is(tag.name, "corner") ? &all->sharp_points
                    : tw_word_is(tag.name, "hole")   ? &all->holes
                                                     : NULL;
  if (!count || !read_counts(text, &tag)) return;
  uint64_t most = ((uint64_t)(text->end - text->at) + 1) / 2;
  *count += tag.int_count < most ? tag.int_count : most;
}
