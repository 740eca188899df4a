/* Wavefront OBJ: the statements of its polygonal part, and the subdivision tags of OpenSubdiv's tools. Two
 * passes over the text: the first one counts, so that the second one writes straight into arrays of the
 * model's arena that have room for just that. Points are shared over the whole file, so it is one mesh,
 * unless its objects share none: then each object is a mesh of its own. Source: Wavefront Advanced Visualizer
 * file formats, appendix B1. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "merge_points.h"
#include "number.h"
#include "soup_mesh.h"
#include "tweend/base.h"
#include "tweend/format.h"
#include "weld.h"

/* ---- walking through the text ----------------------------------------------------------------- */

/* Lines end with LF, CRLF or a lone CR; a backslash just before a line end is a blank. */
typedef struct obj_text {
  const uint8_t *at, *end;
  uint64_t line;        /* of `at`, from 1 */
  const uint8_t *first; /* of the file; NULL for names */
} obj_text;

/* A piece of the text. */
typedef struct obj_word {
  const char *text;
  size_t length;
} obj_word;

static bool is_line_end(uint8_t c) {
  return c == '\n' || c == '\r';
}

/* Control characters are blanks too: some exporters end lines or the file with a zero byte or Ctrl-Z. */
static bool is_blank(uint8_t c) {
  return c <= ' ' && !is_line_end(c);
}

/* Bytes of the line end at `at`: 2 for CRLF. */
static size_t line_end_length(const uint8_t *at, const uint8_t *end) {
  return at[0] == '\r' && end - at > 1 && at[1] == '\n' ? 2 : 1;
}

/* Moves over blanks and continuations. */
static void skip_blanks(obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  for (; at < end; at++) {
    if (is_blank(*at)) continue;
    if (*at != '\\' || end - at < 2 || !is_line_end(at[1])) break;
    at += line_end_length(at + 1, end);
    text->line++;
  }
  text->at = at;
}

/* After blanks: nothing more in this statement (a comment counts as nothing). */
static bool statement_ends(obj_text *text) {
  skip_blanks(text);
  return text->at == text->end || *text->at == '#';
}

static bool ends_word(const uint8_t *at, const uint8_t *end) {
  if (*at <= ' ') return true;
  return *at == '\\' && end - at > 1 && is_line_end(at[1]);
}

/* The characters up to the next blank or line end. */
static obj_word read_word(obj_text *text) {
  skip_blanks(text);
  const uint8_t *start = text->at;
  while (text->at < text->end && !ends_word(text->at, text->end)) text->at++;
  return (obj_word){(const char *)start, (size_t)(text->at - start)};
}

/* The beginning of a word for a sentence: printable characters, all others as question marks. */
typedef struct obj_quote {
  char text[44];
} obj_quote;

static obj_quote quote(obj_word word) {
  static const char more[] = "...";
  obj_quote out = {{0}};
  size_t most = sizeof out.text - sizeof more, length = word.length < most ? word.length : most;
  for (size_t i = 0; i < length; i++)
    out.text[i] = (char)(word.text[i] > ' ' && word.text[i] < 0x7F ? word.text[i] : '?');
  if (length < word.length) memcpy(out.text + length, more, sizeof more);
  return out;
}

/* The word round `at` is not what is expected there. */
static tw_status fail_word(const obj_text *text, const char *what, tw_error *error) {
  obj_text from = *text;
  while (from.at > from.first && from.at[-1] > ' ') from.at--;
  uint64_t column = 1;
  for (const uint8_t *c = from.at; c > from.first && !is_line_end(c[-1]); c--)
    column += (c[-1] & 0xC0) != 0x80; /* not of bytes inside a UTF-8 character */
  tw_fail_line(error, TW_SYNTAX, text->line, "\"%s\" is no %s", quote(read_word(&from)).text, what);
  if (error) error->column = column;
  return TW_SYNTAX;
}

/* The rest of the text without blanks at its ends. */
static obj_word read_rest(obj_text *text) {
  skip_blanks(text);
  const uint8_t *start = text->at, *end = text->end;
  while (end > start && is_blank(end[-1])) end--;
  text->at = text->end;
  return (obj_word){(const char *)start, (size_t)(end - start)};
}

static bool word_is(obj_word word, const char *text) {
  return strlen(text) == word.length && memcmp(word.text, text, word.length) == 0;
}

/* A number that ends at a blank or comment. False, without moving, when there is none. */
static bool read_number(obj_text *text, double *out) {
  skip_blanks(text);
  const char *start = (const char *)text->at;
  size_t left = (size_t)(text->end - text->at), used = tw_read_plain(start, left, out);
  if (used == 0) used = tw_read_double(start, left, out);
  const uint8_t *stop = text->at + used;
  if (used == 0 || (stop < text->end && *stop != '#' && !ends_word(stop, text->end))) return false;
  text->at = stop;
  return true;
}

/* A decimal integer, at most 18 digits, that ends where its digits do. False when there is none. */
static bool read_integer(obj_text *text, int64_t *out) {
  const uint8_t *at = text->at, *end = text->end;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+')) at++;
  const uint8_t *start = at;
  int64_t value = 0;
  while (at < end && tw_is_digit((char)*at) && at - start < 18) value = value * 10 + (*at++ - '0');
  if (at == start || (at < end && tw_is_digit((char)*at))) return false;
  *out = negative ? -value : value;
  text->at = at;
  return true;
}

/* Moves behind the line end, or to the end of the text. */
static void next_line(obj_text *text) {
  while (text->at < text->end && !is_line_end(*text->at)) text->at++;
  if (text->at == text->end) return;
  text->at += line_end_length(text->at, text->end);
  text->line++;
}

/* Moves to the end of the statement, its continuation lines included. Comments do not continue: a path may
 * end with a backslash. */
static const uint8_t *statement_end(obj_text *text) {
  for (bool comment = false;;) {
    const uint8_t *start = text->at;
    while (text->at < text->end && !is_line_end(*text->at)) comment |= *text->at++ == '#';
    const uint8_t *end = text->at;
    bool continues = !comment && end > start && end[-1] == '\\';
    if (end == text->end) return end;
    text->at += line_end_length(end, text->end);
    text->line++;
    if (!continues) return end;
  }
}

/* ZBrush writes the colours of points as comments. */
static const char COLORS[] = "#MRGB";

static bool begins_colors(const obj_text *text) {
  size_t length = sizeof COLORS - 1;
  return (size_t)(text->end - text->at) > length && memcmp(text->at, COLORS, length) == 0 &&
         is_blank(text->at[length]);
}

/* The next statement of the file: its first word, and the text behind that up to its end. False at the end of
 * the file, where the statement is empty. */
static bool next_statement(obj_text *file, obj_word *word, obj_text *statement) {
  for (;; next_line(file)) {
    skip_blanks(file);
    if (file->at == file->end) break;
    if (is_line_end(*file->at) || (*file->at == '#' && !begins_colors(file))) continue;
    *word = read_word(file);
    *statement = *file;
    /* What these name goes to the end of its line, whatever that is. */
    if (word_is(*word, "o") || word_is(*word, "usemtl")) {
      skip_blanks(file);
      statement->end = file->at;
      while (statement->end < file->end && !is_line_end(*statement->end)) statement->end++;
      next_line(file);
    } else {
      statement->end = statement_end(file);
    }
    return true;
  }
  *statement = *file;
  return false;
}

/* ---- names -------------------------------------------------------------------------------------- */

/* Names of materials or of sets of groups, numbered in the order of their first use. A zeroed table is empty.
 */
typedef struct obj_names {
  obj_word *names; /* [count], in the text, as first written */
  size_t count, capacity;
  uint32_t *slots; /* [2 x capacity], hash table of numbers + 1 */
} obj_names;

#define OBJ_NO_NAME UINT32_MAX

static obj_text text_of(obj_word word) {
  const uint8_t *start = (const uint8_t *)word.text;
  return (obj_text){start, start + word.length, 0, NULL};
}

/* FNV-1a over the words, a blank behind each. */
static uint64_t hash_name(obj_word name) {
  uint64_t value = 14695981039346656037u;
  obj_text text = text_of(name);
  for (obj_word word = read_word(&text); word.length > 0; word = read_word(&text)) {
    for (size_t i = 0; i < word.length; i++) value = (value ^ (uint8_t)word.text[i]) * 1099511628211u;
    value = (value ^ ' ') * 1099511628211u;
  }
  return value ^ value >> 32;
}

/* Names are lists of words: what is between two does not matter. */
static bool same_name(obj_word a, obj_word b) {
  if (a.length == b.length && memcmp(a.text, b.text, a.length) == 0) return true;
  obj_text left = text_of(a), right = text_of(b);
  for (;;) {
    a = read_word(&left);
    b = read_word(&right);
    if (a.length != b.length || memcmp(a.text, b.text, a.length) != 0) return false;
    if (a.length == 0) return true;
  }
}

/* The slot that holds `name` or waits for it; NULL where so many others stand in its way that the names must
 * have been made to collide: by chance, with half of the slots empty, a row of 256 does not occur. */
static uint32_t *find_slot(const obj_names *table, obj_word name) {
  enum { PROBES_MAX = 256 };
  size_t mask = 2 * table->capacity - 1, at = (size_t)hash_name(name);
  for (int i = 0; i < PROBES_MAX; i++) {
    uint32_t *slot = &table->slots[(at + (size_t)i) & mask];
    if (*slot == 0 || same_name(table->names[*slot - 1], name)) return slot;
  }
  return NULL;
}

static tw_status fail_colliding(tw_error *error) {
  return tw_fail(error, TW_LIMIT, "names are made to collide");
}

/* Doubles names and slots, so that at most half the slots are taken. */
static tw_status grow_names(obj_names *table, tw_error *error) {
  size_t capacity = table->capacity ? table->capacity * 2 : 32;
  obj_word *grown = realloc(table->names, capacity * sizeof *grown);
  if (grown) table->names = grown;
  uint32_t *slots = tw_alloc_zero(capacity * 2, sizeof *slots);
  if (!grown || !slots) {
    free(slots);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  free(table->slots);
  table->slots = slots;
  table->capacity = capacity;
  for (size_t i = 0; i < table->count; i++) {
    uint32_t *slot = find_slot(table, grown[i]);
    if (!slot) return fail_colliding(error);
    *slot = (uint32_t)i + 1;
  }
  return TW_OK;
}

/* The number of a name, a new one where it is new; OBJ_NO_NAME for a new one beyond `most`. */
static tw_status number_name(obj_names *table, obj_word name, uint32_t most, uint32_t *out, tw_error *error) {
  if (table->count == table->capacity) {
    tw_status status = grow_names(table, error);
    if (status != TW_OK) return status;
  }
  uint32_t *slot = find_slot(table, name);
  if (!slot) return fail_colliding(error);
  *out = *slot - 1;
  if (*slot != 0 || table->count == most) return TW_OK; /* 0 - 1 is OBJ_NO_NAME */
  table->names[table->count++] = name;
  *slot = (uint32_t)table->count;
  *out = *slot - 1;
  return TW_OK;
}

static void names_deinit(obj_names *table) {
  free(table->names);
  free(table->slots);
}

/* ---- what a file says --------------------------------------------------------------------------- */

/* Above this the file stays one mesh: a mesh costs much more memory than a line of text. */
enum { OBJECTS_MAX = TW_MESHES_MAX, GROUPS_MAX = 262144 };

#define OBJ_NO_VALUE UINT32_MAX /* of a corner without vt or vn */

/* How many there are; of the values of tags, how many there are at most. */
typedef struct obj_counts {
  uint64_t points, uvs, normals, faces, corners, objects, crease_points, sharp_points, holes;
} obj_counts;

/* Faces from first_face up to the next object's. */
typedef struct obj_object {
  obj_word name; /* length 0: none */
  uint32_t first_face;
} obj_object;

typedef struct obj_reader {
  tw_arena *arena;
  tw_error *error;
  obj_counts all;  /* of the file */
  obj_counts read; /* so far */

  /* In the arena, [all.X] of the rows that `read` counts; NULL where there are none. */
  float *positions, *colors; /* [3], [4] linear; colors NULL until a point has one */
  float *normals;            /* [3], with room for one more */
  uint32_t *corners;
  uint32_t *corner_uvs, *corner_normals; /* NULL until a corner has one; OBJ_NO_VALUE without */
  uint32_t *face_offsets;                /* with room for one more, and one more an object */
  uint32_t *materials, *groups;          /* of each face; NULL until a face has one; OBJ_NO_NAME */
  uint32_t *smoothing;                   /* of each face; NULL until a face has a group */
  uint32_t *crease_points, *sharp_points, *holes;
  float *crease_sharpness, *point_sharpness;

  float *uvs;        /* [2], from malloc */
  uint32_t *dropped; /* [dropped_count], ascending: faces of the file; from malloc */
  size_t dropped_count;
  obj_object *objects; /* from malloc, [OBJECTS_MAX + 1 or fewer], by ascending first_face */
  size_t object_count;
  obj_word first_group; /* names of the first `g` */
  obj_word group_words; /* of the faces to come, numbered when one comes; length 0: none */
  uint32_t material, group;
  uint32_t smoothing_group; /* OBJ_NO_VALUE until an `s` */
  obj_names material_names, group_names;

  bool is_tagged; /* has a `t` */
  int tag_boundary, tag_uv, tag_creasing, tag_triangles;
  uint64_t painted_points;                    /* by ZBrush's comments */
  uint64_t ignored_elements;                  /* lines, points, free-form */
  uint64_t first_ignored;                     /* its line */
  uint64_t unknown_statements, first_unknown; /* the line of the first one */
  obj_word unknown_word;                      /* its first word */
  uint64_t ignored_tags, missing_uvs, long_groups, late_groups, bad_normals;
} obj_reader;

static void reader_deinit(obj_reader *reader) {
  free(reader->uvs);
  free(reader->dropped);
  free(reader->objects);
  names_deinit(&reader->material_names);
  names_deinit(&reader->group_names);
}

static tw_status no_memory(const obj_reader *reader) {
  return tw_fail(reader->error, TW_NO_MEMORY, "out of memory");
}

/* ---- v, vt, vn ---------------------------------------------------------------------------------- */

/* Up to `most` numbers of this statement; *count says how many there were. */
static tw_status read_numbers(obj_text *text, float *out, size_t most, size_t *count, tw_error *error) {
  *count = 0;
  while (*count < most && !statement_ends(text)) {
    double value;
    if (!read_number(text, &value)) return fail_word(text, "number", error);
    out[*count] = (float)value;
    if (!isfinite(out[*count]))
      return tw_fail_line(error, TW_INVALID, text->line, "a number is too large for a 32-bit float");
    (*count)++;
  }
  return TW_OK;
}

/* The colour of a point. Points without one are white. */
static tw_status set_color(obj_reader *reader, uint64_t point, const float *rgb) {
  if (!reader->colors) {
    size_t count = (size_t)reader->all.points * 4;
    reader->colors = tw_arena_alloc_raw(reader->arena, count, sizeof(float));
    if (!reader->colors) return no_memory(reader);
    for (size_t i = 0; i < count; i++) reader->colors[i] = 1;
  }
  for (size_t c = 0; c < 3; c++) reader->colors[4 * point + c] = tw_linear_from_srgb(rgb[c]);
  return TW_OK;
}

/* v x y z, v x y z w, v x y z r g b or v x y z r g b a. A weight belongs to curves; it and alpha
 * are read over. */
static tw_status read_point(obj_reader *reader, obj_text *text) {
  float values[7];
  size_t count;
  uint64_t line = text->line, point = reader->read.points++;
  tw_status status = read_numbers(text, values, 7, &count, reader->error);
  if (status != TW_OK) return status;
  if (count < 3 || count == 5)
    return tw_fail_line(reader->error, TW_SYNTAX, line,
                        "a point needs 3 coordinates, and 3 more numbers for a colour");
  memcpy(reader->positions + 3 * point, values, 3 * sizeof(float));
  return count >= 6 ? set_color(reader, point, values + 3) : TW_OK;
}

static bool read_hex(const char *digits, uint32_t *out) {
  *out = 0;
  for (int i = 0; i < 2; i++) {
    char c = digits[i], letter = (char)(c | 0x20);
    bool is_letter = letter >= 'a' && letter <= 'f';
    if (!is_letter && !tw_is_digit(c)) return false;
    *out = *out << 4 | (uint32_t)(is_letter ? letter - 'a' + 10 : c - '0');
  }
  return true;
}

/* #MRGB MMRRGGBBMMRRGGBB...: mask and colour of the next points, in hexadecimal. A comment cannot be
 * malformed: what is no colour ends it. */
static tw_status read_colors(obj_reader *reader, obj_text *text) {
  obj_word word = read_word(text);
  tw_status status = TW_OK;
  for (size_t i = 0; i + 8 <= word.length && reader->painted_points < reader->all.points; i += 8) {
    float rgb[3];
    for (size_t c = 0; c < 3; c++) {
      uint32_t value;
      if (!read_hex(word.text + i + 2 + 2 * c, &value)) return TW_OK;
      rgb[c] = (float)value / 255;
    }
    status = set_color(reader, reader->painted_points++, rgb);
    if (status != TW_OK) break;
  }
  return status;
}

/* vt u, vt u v or vt u v w. */
static tw_status read_uv(obj_reader *reader, obj_text *text) {
  float values[3] = {0, 0, 0};
  size_t count;
  uint64_t line = text->line, uv = reader->read.uvs++;
  tw_status status = read_numbers(text, values, 3, &count, reader->error);
  if (status != TW_OK) return status;
  if (count == 0) return tw_fail_line(reader->error, TW_SYNTAX, line, "a texture coordinate needs a number");
  memcpy(reader->uvs + 2 * uv, values, 2 * sizeof(float));
  return TW_OK;
}

/* vn x y z. Normals do not shape the surface: one that is malformed or not finite is none. */
static void read_normal(obj_reader *reader, obj_text *text) {
  float *out = reader->normals + 3 * reader->read.normals++;
  for (int i = 0; i < 3; i++) {
    double value;
    bool is_read = read_number(text, &value);
    out[i] = is_read ? (float)value : NAN;
    if (isfinite(out[i])) continue;
    memset(out, 0, 3 * sizeof *out);
    reader->bad_normals++;
    return;
  }
}

/* ---- f -------------------------------------------------------------------------------------------- */

/* Reads an OBJ index, from 1 or counted back from the newest element, as one from 0. `so_far` and `all`:
 * elements before this statement, and in the whole file: some are named before they are defined. */
static tw_status read_index(obj_text *text, uint64_t so_far, uint64_t all, const char *what, uint32_t *out,
                            tw_error *error) {
  int64_t index;
  if (!read_integer(text, &index)) return fail_word(text, "corner of a face", error);
  if (index == 0) return tw_fail_line(error, TW_INVALID, text->line, "index 0: they start from 1");
  if (index < 0 && (uint64_t)-index > so_far)
    return tw_fail_line(error, TW_INVALID, text->line, "index %lld is out of range: there are %llu so far",
                        (long long)index, (unsigned long long)so_far);
  if (index > 0 && (uint64_t)index > all)
    return tw_fail_line(error, TW_INVALID, text->line, "index %lld is out of range: the file has %llu %s",
                        (long long)index, (unsigned long long)all, what);
  *out = (uint32_t)(index > 0 ? (uint64_t)index - 1 : so_far - (uint64_t)-index);
  return TW_OK;
}

static bool take_slash(obj_text *text) {
  if (text->at == text->end || *text->at != '/') return false;
  text->at++;
  return true;
}

static bool ends_corner(const obj_text *text) {
  if (text->at == text->end) return true;
  uint8_t c = *text->at;
  return c <= ' ' || c == '#' || c == '\\';
}

typedef struct obj_corner {
  uint32_t point, uv, normal;
} obj_corner;

/* p, p/t, p//n or p/t/n. */
static tw_status read_corner(const obj_reader *reader, obj_text *text, obj_corner *out) {
  const obj_counts *read = &reader->read, *all = &reader->all;
  tw_error *error = reader->error;
  out->uv = out->normal = OBJ_NO_VALUE;
  tw_status status = read_index(text, read->points, all->points, "points", &out->point, error);
  if (status == TW_OK && take_slash(text)) {
    if (text->at < text->end && *text->at != '/' && !ends_corner(text))
      status = read_index(text, read->uvs, all->uvs, "texture coordinates", &out->uv, error);
    if (status == TW_OK && take_slash(text) && !ends_corner(text)) /* some write p// and p/t/ */
      status = read_index(text, read->normals, all->normals, "normals", &out->normal, error);
  }
  if (status != TW_OK || ends_corner(text)) return status;
  return fail_word(text, "corner of a face", error);
}

/* [count] elements in the arena that all say "none". */
static uint32_t *allocate_none(const obj_reader *reader, uint64_t count) {
  uint32_t *out = tw_arena_alloc_raw(reader->arena, (size_t)count, sizeof *out);
  if (out) memset(out, 0xFF, (size_t)count * sizeof *out);
  return out;
}

/* Notes the value of the newest corner. Nothing is stored before the first corner that has one. */
static tw_status set_value(const obj_reader *reader, uint32_t **values, uint64_t corner, uint32_t value) {
  if (!*values && value == OBJ_NO_VALUE) return TW_OK;
  if (!*values) *values = allocate_none(reader, reader->all.corners);
  if (!*values) return no_memory(reader);
  (*values)[corner] = value;
  return TW_OK;
}

static tw_status add_corner(obj_reader *reader, const obj_corner *added) {
  uint64_t corner = reader->read.corners++;
  reader->corners[corner] = added->point;
  reader->missing_uvs += added->uv == OBJ_NO_VALUE;
  tw_status status = set_value(reader, &reader->corner_uvs, corner, added->uv);
  return status == TW_OK ? set_value(reader, &reader->corner_normals, corner, added->normal) : status;
}

/* Labels the newest face with its material, groups or smoothing group. Nothing is stored before the first
 * face that has some. */
static tw_status label_face(const obj_reader *reader, uint32_t **labels, uint32_t label) {
  if (!*labels && label == OBJ_NO_NAME) return TW_OK;
  if (!*labels) *labels = allocate_none(reader, reader->all.faces);
  if (!*labels) return no_memory(reader);
  (*labels)[reader->read.faces] = label;
  return TW_OK;
}

/* The set of groups of the newest face; where there are too many the face is in none. */
static tw_status number_groups(obj_reader *reader) {
  if (reader->group_words.length == 0) return TW_OK;
  tw_status status =
      number_name(&reader->group_names, reader->group_words, GROUPS_MAX, &reader->group, reader->error);
  reader->late_groups += status == TW_OK && reader->group == OBJ_NO_NAME;
  reader->group_words.length = 0;
  return status;
}

/* Leaves out the corners at the point of the one before them. Returns how many stay. */
static uint64_t drop_doubled_corners(obj_reader *reader, uint64_t first) {
  uint32_t *corners = reader->corners, *uvs = reader->corner_uvs, *normals = reader->corner_normals;
  uint32_t before = corners[reader->read.corners - 1];
  uint64_t kept = first;
  for (uint64_t c = first; c < reader->read.corners; c++) {
    uint32_t point = corners[c];
    if (point != before && uvs) uvs[kept] = uvs[c];
    if (point != before && normals) normals[kept] = normals[c];
    if (point != before) corners[kept++] = point;
    before = point;
  }
  reader->read.corners = kept;
  return kept - first;
}

/* Of a face without doubled corners. */
static bool has_three_points(const uint32_t *corners, uint64_t count) {
  for (uint64_t i = 2; i < count; i++)
    if (corners[i] != corners[0] && corners[i] != corners[1]) return true;
  return false;
}

/* Forgets the newest face, and notes its number in the file, which tags may name. */
static tw_status drop_face(obj_reader *reader, uint64_t first_corner) {
  uint64_t count = reader->dropped_count;
  if ((count & (count - 1)) == 0) { /* full: its room is a power of two */
    uint32_t *grown = realloc(reader->dropped, (size_t)(count ? 2 * count : 1) * sizeof *grown);
    if (!grown) return no_memory(reader);
    reader->dropped = grown;
  }
  reader->dropped[reader->dropped_count++] = (uint32_t)(reader->read.faces + count);
  reader->read.corners = first_corner;
  return TW_OK;
}

/* What is left when all is read: holes are numbered among the faces of the file. */
static void settle_faces(obj_reader *reader) {
  reader->all.faces = reader->read.faces;
  reader->all.corners = reader->read.corners;
  if (reader->all.faces == 0) reader->face_offsets[0] = 0;
  uint64_t kept = 0;
  for (uint64_t i = 0; i < reader->read.holes && reader->dropped_count > 0; i++) {
    size_t low = 0, high = reader->dropped_count; /* how many were dropped before it */
    while (low < high) {
      size_t middle = (low + high) / 2;
      if (reader->dropped[middle] < reader->holes[i])
        low = middle + 1;
      else
        high = middle;
    }
    bool is_dropped = low < reader->dropped_count && reader->dropped[low] == reader->holes[i];
    if (!is_dropped) reader->holes[kept++] = reader->holes[i] - (uint32_t)low;
  }
  if (reader->dropped_count > 0) reader->read.holes = kept;
}

static tw_status read_face(obj_reader *reader, obj_text *text) {
  uint64_t first = reader->read.corners, line = text->line;
  tw_status status = TW_OK;
  while (status == TW_OK && !statement_ends(text)) {
    obj_corner corner;
    status = read_corner(reader, text, &corner);
    if (status == TW_OK) status = add_corner(reader, &corner);
  }
  if (status != TW_OK) return status;
  uint64_t count = reader->read.corners - first;
  if (count < 3) return tw_fail_line(reader->error, TW_INVALID, line, "a face needs at least 3 corners");
  count = drop_doubled_corners(reader, first);
  if (!has_three_points(reader->corners + first, count)) return drop_face(reader, first);
  status = number_groups(reader);
  if (status == TW_OK) status = label_face(reader, &reader->materials, reader->material);
  if (status == TW_OK) status = label_face(reader, &reader->groups, reader->group);
  if (status == TW_OK) status = label_face(reader, &reader->smoothing, reader->smoothing_group);
  reader->face_offsets[reader->read.faces++] = (uint32_t)first;
  return status;
}

/* ---- o, g, usemtl and the rest ----------------------------------------------------------------------- */

/* An object that no face follows is forgotten when the next one begins. */
static void begin_object(obj_reader *reader, obj_text *text) {
  obj_object object = {read_rest(text), (uint32_t)reader->read.faces};
  obj_object *last = reader->object_count ? &reader->objects[reader->object_count - 1] : NULL;
  if (last && last->first_face == object.first_face)
    *last = object;
  else if (reader->object_count <= OBJECTS_MAX)
    reader->objects[reader->object_count++] = object;
}

/* The set of groups that the faces to come are in. `default` is the group of faces that are in none. */
static void begin_groups(obj_reader *reader, obj_text *text) {
  enum { TEXT_MAX = 1024 }; /* each part of an answer may name its groups again */
  obj_word names = read_word(text), word = names;
  for (; word.length > 0; word = read_word(text))
    names.length = (size_t)(word.text + word.length - names.text);
  if (reader->first_group.length == 0) reader->first_group = names;
  reader->group = OBJ_NO_NAME;
  reader->long_groups += names.length > TEXT_MAX;
  if (names.length > TEXT_MAX || word_is(names, "default")) names.length = 0;
  reader->group_words = names;
}

static tw_status use_material(obj_reader *reader, obj_text *text) {
  obj_word name = read_rest(text);
  reader->material = OBJ_NO_NAME;
  if (name.length == 0) return TW_OK;
  tw_status status =
      number_name(&reader->material_names, name, TW_MATERIALS_MAX, &reader->material, reader->error);
  if (status != TW_OK || reader->material != OBJ_NO_NAME) return status;
  return tw_fail_line(reader->error, TW_LIMIT, text->line, "there are more than %d materials",
                      TW_MATERIALS_MAX);
}

/* s NUMBER, or s off, which is 0. What is neither is as good as none. */
static void begin_smoothing(obj_reader *reader, obj_text *text) {
  int64_t group;
  obj_text rest = *text;
  reader->smoothing_group = 0;
  if (word_is(read_word(text), "off")) return;
  skip_blanks(&rest);
  bool is_group = read_integer(&rest, &group) && group >= 0 && group < UINT32_MAX;
  reader->smoothing_group = is_group ? (uint32_t)group : OBJ_NO_VALUE;
}

/* Statements of the format that have nothing to do with a surface of polygons. */
static bool is_known(obj_word word) {
  static const char *const words[] = {
      "bevel",      "bmat",   "bsp",    "bzp",  "c_interp", "call",      "cdc",  "cdp",    "con",
      "csh",        "cstype", "ctech",  "curv", "curv2",    "d_interp",  "deg",  "end",    "hole",
      "l",          "lod",    "maplib", "mg",   "mtllib",   "p",         "parm", "res",    "scrv",
      "shadow_obj", "sp",     "stech",  "step", "surf",     "trace_obj", "trim", "usemap", "vp"};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++)
    if (word_is(word, words[i])) return true;
  return false;
}

/* Counts statements that shape no surface; what is no word is no OBJ file either. */
static tw_status read_other(obj_reader *reader, const obj_text *text, obj_word word) {
  if (word_is(word, "l") || word_is(word, "p") || word_is(word, "curv") || word_is(word, "curv2") ||
      word_is(word, "surf")) {
    if (reader->ignored_elements++ == 0) reader->first_ignored = text->line;
  }
  for (size_t i = 0; i < word.length; i++) {
    char c = word.text[i];
    bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || tw_is_digit(c) || c == '_';
    if (!letter)
      return tw_fail_line(reader->error, TW_SYNTAX, text->line, "\"%s\" begins no statement of an OBJ file",
                          quote(word).text);
  }
  if (is_known(word)) return TW_OK;
  if (reader->unknown_statements++ > 0) return TW_OK;
  reader->first_unknown = text->line;
  reader->unknown_word = word;
  return TW_OK;
}

/* ---- subdivision tags -------------------------------------------------------------------------------- */

/* t NAME INTS/FLOATS/STRINGS values..., with indices from 0. */
typedef struct obj_tag {
  obj_word name;
  uint64_t line;
  uint64_t int_count, float_count, string_count;
} obj_tag;

static tw_status bad_tag(const obj_reader *reader, const obj_tag *tag, const char *what) {
  return tw_fail_line(reader->error, TW_SYNTAX, tag->line, "%s", what);
}

/* INTS/FLOATS or INTS/FLOATS/STRINGS. */
static bool read_counts(obj_text *text, obj_tag *tag) {
  int64_t counts[3] = {0, 0, 0};
  skip_blanks(text);
  for (int i = 0; i < 3; i++) {
    if (i > 0 && !take_slash(text)) {
      if (i < 2) return false;
      break;
    }
    if (!read_integer(text, &counts[i]) || counts[i] < 0) return false;
  }
  tag->int_count = (uint64_t)counts[0];
  tag->float_count = (uint64_t)counts[1];
  tag->string_count = (uint64_t)counts[2];
  return true;
}

static tw_status read_tag_int(const obj_reader *reader, const obj_tag *tag, obj_text *text, uint32_t *out) {
  int64_t value;
  skip_blanks(text);
  if (!read_integer(text, &value)) return bad_tag(reader, tag, "an integer of the tag is missing");
  if (value < 0 || value >= UINT32_MAX) return bad_tag(reader, tag, "an integer of the tag is out of range");
  *out = (uint32_t)value;
  return TW_OK;
}

static tw_status read_tag_float(const obj_reader *reader, const obj_tag *tag, obj_text *text, float *out) {
  double value;
  if (!read_number(text, &value) || !isfinite((float)value))
    return bad_tag(reader, tag, "a number of the tag is missing or malformed");
  *out = (float)value;
  return TW_OK;
}

/* Reads over floats, and demands the string that the counts speak of. */
static tw_status skip_tag_rest(const obj_reader *reader, const obj_tag *tag, obj_text *text,
                               uint64_t floats) {
  tw_status status = TW_OK;
  for (float value; floats > 0 && status == TW_OK; floats--)
    status = read_tag_float(reader, tag, text, &value);
  if (status == TW_OK && tag->string_count > 0 && statement_ends(text))
    status = bad_tag(reader, tag, "a string of the tag is missing");
  return status;
}

/* Reads the ints of a tag as indices below `count` into out[first] and what follows it. out: NULL for a tag
 * that has no room, as it has fewer ints than it says. */
static tw_status read_tag_indices(const obj_reader *reader, const obj_tag *tag, obj_text *text,
                                  uint64_t count, const char *what, uint64_t first, uint32_t *out) {
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->int_count && status == TW_OK; i++) {
    uint32_t index = 0;
    status = read_tag_int(reader, tag, text, &index);
    if (status == TW_OK && index >= count)
      status =
          tw_fail_line(reader->error, TW_INVALID, tag->line, "index %u is out of range: the file has %llu %s",
                       index, (unsigned long long)count, what);
    if (status == TW_OK) out[first + i] = index;
  }
  return status;
}

/* Reads the floats of a tag as sharpness, in the range that meshes have. One value serves all elements;
 * `width` ints make an element, and the tools accept a value for each int as well. The `count` elements go to
 * out[first] and what follows it. */
static tw_status read_sharpness(const obj_reader *reader, const obj_tag *tag, obj_text *text, uint64_t width,
                                uint64_t count, uint64_t first, float *out) {
  uint64_t stride = tag->float_count == count ? 1 : width;
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->float_count && status == TW_OK; i++) {
    float value = 0;
    status = read_tag_float(reader, tag, text, &value);
    if (i % stride == 0 && i / stride < count)
      out[first + i / stride] = fminf(fmaxf(value, 0), TW_SHARPNESS_INFINITE);
  }
  for (uint64_t i = 1; tag->float_count == 1 && i < count; i++) out[first + i] = out[first];
  return status == TW_OK ? skip_tag_rest(reader, tag, text, 0) : status;
}

static tw_status read_crease_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  uint64_t count = tag->int_count / 2, first = reader->read.crease_points;
  if (tag->int_count % 2 != 0) return bad_tag(reader, tag, "a crease needs pairs of points");
  if (tag->float_count != 1 && tag->float_count != count && tag->float_count != tag->int_count)
    return bad_tag(reader, tag, "a crease needs one sharpness, or one a pair");
  uint32_t *points = reader->crease_points;
  tw_status status = read_tag_indices(reader, tag, text, reader->all.points, "points", first, points);
  for (uint64_t i = 0; i < count && status == TW_OK; i++)
    if (points[first + 2 * i] == points[first + 2 * i + 1])
      status = bad_tag(reader, tag, "a crease needs two different points");
  reader->read.crease_points += tag->int_count;
  if (status != TW_OK) return status;
  return read_sharpness(reader, tag, text, 2, count, first / 2, reader->crease_sharpness);
}

static tw_status read_corner_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  uint64_t first = reader->read.sharp_points;
  if (tag->float_count != 1 && tag->float_count != tag->int_count)
    return bad_tag(reader, tag, "a corner needs one sharpness, or one a point");
  tw_status status =
      read_tag_indices(reader, tag, text, reader->all.points, "points", first, reader->sharp_points);
  reader->read.sharp_points += tag->int_count;
  if (status != TW_OK) return status;
  return read_sharpness(reader, tag, text, 1, tag->int_count, first, reader->point_sharpness);
}

static tw_status read_hole_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  tw_status status =
      read_tag_indices(reader, tag, text, reader->all.faces, "faces", reader->read.holes, reader->holes);
  reader->read.holes += tag->int_count;
  return status == TW_OK ? skip_tag_rest(reader, tag, text, tag->float_count) : status;
}

/* The tag's one int looked up in a table. */
static tw_status set_from_int(const obj_reader *reader, const obj_tag *tag, obj_text *text, const int *table,
                              size_t size, int *out) {
  uint32_t value = UINT32_MAX;
  tw_status status = tag->int_count > 0 ? read_tag_int(reader, tag, text, &value) : TW_OK;
  if (status == TW_OK && (tag->int_count != 1 || value >= size))
    status = bad_tag(reader, tag, "the tag needs one integer, of those that it knows");
  if (status == TW_OK) status = skip_tag_rest(reader, tag, text, tag->float_count);
  if (status == TW_OK) *out = table[value];
  return status;
}

/* The tag's string, behind its numbers, looked up: names[i] means values[i]. */
static tw_status set_from_string(const obj_reader *reader, const obj_tag *tag, obj_text *text,
                                 const char *const *names, const int *values, const char *fault, int *out) {
  uint32_t number;
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->int_count && status == TW_OK; i++)
    status = read_tag_int(reader, tag, text, &number);
  if (status == TW_OK) status = skip_tag_rest(reader, tag, text, tag->float_count);
  if (status != TW_OK) return status;
  obj_word word = {"", 0};
  if (tag->string_count > 0) word = read_word(text);
  for (size_t i = 0; names[i]; i++) {
    if (!word_is(word, names[i])) continue;
    *out = values[i];
    return TW_OK;
  }
  return bad_tag(reader, tag, fault);
}

static tw_status read_creasing_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const char *const names[] = {"normal", "uniform", "chaikin", NULL};
  static const int values[] = {TW_CREASE_UNIFORM, TW_CREASE_UNIFORM, TW_CREASE_CHAIKIN};
  return set_from_string(reader, tag, text, names, values, "creasemethod is one of normal, chaikin",
                         &reader->tag_creasing);
}

/* By name, or by the number that older tools wrote. */
static tw_status read_triangles_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int numbers[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH, TW_TRIANGLES_SMOOTH};
  static const char *const names[] = {"catmark", "normal", "smooth", NULL};
  static const int values[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH};
  if (tag->string_count == 0) return set_from_int(reader, tag, text, numbers, 3, &reader->tag_triangles);
  return set_from_string(reader, tag, text, names, values, "smoothtriangles is one of catmark, smooth",
                         &reader->tag_triangles);
}

static tw_status read_boundary_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int rules[] = {TW_BOUNDARY_NONE, TW_BOUNDARY_EDGE_AND_CORNER, TW_BOUNDARY_EDGE_ONLY};
  return set_from_int(reader, tag, text, rules, 3, &reader->tag_boundary);
}

static tw_status read_uv_tag(obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int rules[] = {TW_UV_NONE,          TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS1,
                              TW_UV_CORNERS_PLUS2, TW_UV_BOUNDARIES,   TW_UV_ALL};
  return set_from_int(reader, tag, text, rules, 6, &reader->tag_uv);
}

static tw_status read_tag(obj_reader *reader, obj_text *text) {
  static const struct {
    const char *name;
    tw_status (*read)(obj_reader *reader, const obj_tag *tag, obj_text *text);
  } kinds[] = {{"crease", read_crease_tag},
               {"corner", read_corner_tag},
               {"hole", read_hole_tag},
               {"interpolateboundary", read_boundary_tag},
               {"facevaryinginterpolateboundary", read_uv_tag},
               {"creasemethod", read_creasing_tag},
               {"smoothtriangles", read_triangles_tag}};
  obj_tag tag = {.line = text->line, .name = read_word(text)};
  reader->is_tagged = true;
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
    if (!word_is(tag.name, kinds[i].name)) continue;
    if (!read_counts(text, &tag))
      return bad_tag(reader, &tag, "the tag's counts are not INTS/FLOATS/STRINGS");
    return kinds[i].read(reader, &tag, text);
  }
  reader->ignored_tags++;
  return TW_OK;
}

/* ---- two passes ---------------------------------------------------------------------------------------- */

static uint64_t count_words(obj_text *text) {
  uint64_t count = 0;
  for (; !statement_ends(text); count++)
    while (text->at < text->end && *text->at != '#' && !ends_word(text->at, text->end)) text->at++;
  return count;
}

/* Two integers have a byte between them or a sign before the second one. */
static void count_tag(obj_counts *all, obj_text *text) {
  obj_tag tag = {.name = read_word(text)};
  uint64_t *count = word_is(tag.name, "crease")   ? &all->crease_points
                    : word_is(tag.name, "corner") ? &all->sharp_points
                    : word_is(tag.name, "hole")   ? &all->holes
                                                  : NULL;
  if (!count || !read_counts(text, &tag)) return;
  uint64_t most = ((uint64_t)(text->end - text->at) + 1) / 2;
  *count += tag.int_count < most ? tag.int_count : most;
}

/* Older files write fo. */
static bool is_face(obj_word word) {
  return word_is(word, "f") || word_is(word, "fo");
}

static void count_statement(obj_counts *all, obj_word word, obj_text *text) {
  if (is_face(word)) {
    all->faces++;
    all->corners += count_words(text);
  }
  all->points += word_is(word, "v");
  all->uvs += word_is(word, "vt");
  all->normals += word_is(word, "vn");
  all->objects += word_is(word, "o");
  if (word_is(word, "t")) count_tag(all, text);
}

static tw_status read_statement(obj_reader *reader, obj_word word, obj_text *text) {
  if (word.length == 1) {
    switch (word.text[0]) {
    case 'v': return read_point(reader, text);
    case 't': return read_tag(reader, text);
    case 'o': begin_object(reader, text); return TW_OK;
    case 'g': begin_groups(reader, text); return TW_OK;
    case 's': begin_smoothing(reader, text); return TW_OK;
    default: break;
    }
  }
  if (is_face(word)) return read_face(reader, text);
  if (word_is(word, "vt")) return read_uv(reader, text);
  if (word_is(word, "usemtl")) return use_material(reader, text);
  if (word_is(word, COLORS)) return read_colors(reader, text);
  if (!word_is(word, "vn")) return read_other(reader, text, word);
  read_normal(reader, text);
  return TW_OK;
}

/* NULL for none, and without memory, which *status tells apart. */
static void *make_room(const obj_reader *reader, uint64_t count, size_t size, tw_status *status) {
  if (count == 0 || *status != TW_OK) return NULL;
  void *room = tw_arena_alloc_raw(reader->arena, (size_t)count, size);
  if (!room) *status = no_memory(reader);
  return room;
}

static tw_status make_all_room(obj_reader *reader) {
  const obj_counts *all = &reader->all;
  const uint64_t counts[] = {all->points, all->uvs, all->normals, all->faces, all->corners};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i] >= UINT32_MAX)
      return tw_fail(reader->error, TW_LIMIT, "the file has more than 4294967294 elements of a kind");
  uint64_t objects = all->objects < OBJECTS_MAX + 1 ? all->objects : OBJECTS_MAX + 1;
  tw_status status = TW_OK;
  reader->positions = make_room(reader, all->points, 3 * sizeof(float), &status);
  reader->normals = make_room(reader, all->normals > 0 ? all->normals + 1 : 0, 3 * sizeof(float), &status);
  reader->corners = make_room(reader, all->corners, sizeof(uint32_t), &status);
  reader->face_offsets = make_room(reader, all->faces + objects + 1, sizeof(uint32_t), &status);
  reader->crease_points = make_room(reader, all->crease_points, sizeof(uint32_t), &status);
  reader->crease_sharpness = make_room(reader, all->crease_points / 2, sizeof(float), &status);
  reader->sharp_points = make_room(reader, all->sharp_points, sizeof(uint32_t), &status);
  reader->point_sharpness = make_room(reader, all->sharp_points, sizeof(float), &status);
  reader->holes = make_room(reader, all->holes, sizeof(uint32_t), &status);
  reader->uvs = tw_alloc((size_t)all->uvs, 2 * sizeof(float));
  reader->objects = tw_alloc((size_t)objects, sizeof *reader->objects);
  return reader->uvs && reader->objects ? status : no_memory(reader);
}

static tw_status read_statements(obj_reader *reader, obj_text file) {
  obj_word word;
  obj_text text, start = file;
  while (next_statement(&file, &word, &text)) count_statement(&reader->all, word, &text);
  tw_status status = make_all_room(reader);
  file = start;
  while (status == TW_OK && next_statement(&file, &word, &text)) status = read_statement(reader, word, &text);
  if (status != TW_OK) return status;
  if (reader->all.points == 0)
    return tw_fail_line(reader->error, TW_SYNTAX, file.line,
                        "there is no point and no face: this is not an OBJ file");
  settle_faces(reader);
  return TW_OK;
}

/* ---- which point belongs to which mesh ------------------------------------------------------------------
 */

static uint64_t face_end(const obj_reader *reader, uint64_t face) {
  return face + 1 < reader->all.faces ? reader->face_offsets[face + 1] : reader->all.corners;
}

/* Faces [*first, *stop) of an object. */
static void face_range(const obj_reader *reader, uint32_t mesh, uint32_t mesh_count, uint64_t *first,
                       uint64_t *stop) {
  *first = mesh > 0 ? reader->objects[mesh].first_face : 0;
  *stop = mesh + 1 < mesh_count ? reader->objects[mesh + 1].first_face : reader->all.faces;
}

/* Notes for each point whose faces use it, UINT32_MAX for nobody's; false when two objects use the same. */
static bool own_points(const obj_reader *reader, uint32_t mesh_count, uint32_t *owners) {
  memset(owners, 0xFF, (size_t)reader->all.points * sizeof *owners);
  for (uint32_t mesh = 0; mesh < mesh_count; mesh++) {
    uint64_t face, stop;
    face_range(reader, mesh, mesh_count, &face, &stop);
    for (uint64_t c = reader->face_offsets[face], end = face_end(reader, stop - 1); c < end; c++) {
      uint32_t *owner = &owners[reader->corners[c]];
      if (*owner != UINT32_MAX && *owner != mesh) return false;
      *owner = mesh;
    }
  }
  return true;
}

/* Turns owners into places, so that the points of a mesh stand together in the file's order, and those of
 * nobody behind all. ends: [mesh_count], behind the last point of each. */
static void place_points(const obj_reader *reader, uint32_t mesh_count, uint32_t *owners, uint32_t *ends) {
  uint64_t points = reader->all.points;
  uint32_t used = 0;
  memset(ends, 0, mesh_count * sizeof *ends);
  for (uint64_t i = 0; i < points; i++)
    if (owners[i] != UINT32_MAX) ends[owners[i]]++;
  for (uint32_t mesh = 0; mesh < mesh_count; mesh++) {
    uint32_t count = ends[mesh];
    ends[mesh] = used; /* its beginning, which moves on to its end */
    used += count;
  }
  for (uint64_t i = 0; i < points; i++) owners[i] = owners[i] != UINT32_MAX ? ends[owners[i]]++ : used++;
}

static void swap_rows(float *rows, size_t width, size_t a, size_t b) {
  for (size_t i = 0; i < width; i++) {
    float kept = rows[width * a + i];
    rows[width * a + i] = rows[width * b + i];
    rows[width * b + i] = kept;
  }
}

/* Moves the points to their places, cycle by cycle, and renumbers the corners within their meshes. */
static void move_points(obj_reader *reader, uint32_t mesh_count, uint32_t *places, const uint32_t *ends) {
  for (uint32_t mesh = 0; mesh < mesh_count; mesh++) {
    uint64_t face, stop;
    face_range(reader, mesh, mesh_count, &face, &stop);
    for (uint64_t c = reader->face_offsets[face], end = face_end(reader, stop - 1); c < end; c++)
      reader->corners[c] = places[reader->corners[c]] - (mesh > 0 ? ends[mesh - 1] : 0);
  }
  for (uint32_t i = 0; i < reader->all.points; i++)
    while (places[i] != i) {
      uint32_t place = places[i];
      swap_rows(reader->positions, 3, i, place);
      if (reader->colors) swap_rows(reader->colors, 4, i, place);
      places[i] = places[place];
      places[place] = place;
    }
}

/* Decides between one mesh and several. Tags number the points and faces of the whole file: a file
 * that has some stays whole, as does one with faces before its first object. Objects that no face
 * follows are gone by now, but for the last.
 * *ends: behind the last point of each mesh, from malloc; NULL when there is one mesh. */
static tw_status deal_points(obj_reader *reader, uint32_t *mesh_count, uint32_t **ends) {
  size_t count = reader->object_count;
  *mesh_count = 1;
  *ends = NULL;
  if (count > 0 && reader->objects[count - 1].first_face == reader->all.faces) count--;
  if (count < 2 || count > OBJECTS_MAX || reader->objects[0].first_face != 0) return TW_OK;
  if (reader->read.crease_points + reader->read.sharp_points + reader->read.holes > 0) return TW_OK;
  uint32_t *places = tw_alloc((size_t)reader->all.points, sizeof *places);
  uint32_t *found = tw_alloc(count, sizeof *found);
  bool is_ready = places && found, is_split = is_ready && own_points(reader, (uint32_t)count, places);
  if (is_split) {
    place_points(reader, (uint32_t)count, places, found);
    move_points(reader, (uint32_t)count, places, found);
    *mesh_count = (uint32_t)count;
    *ends = found;
  } else {
    free(found);
  }
  free(places);
  return is_ready ? TW_OK : no_memory(reader);
}

/* ---- into the model -------------------------------------------------------------------------------------
 */

static tw_status copy_name(const obj_reader *reader, obj_word word, const char **out) {
  if (word.length == 0) return TW_OK;
  *out = tw_arena_name(reader->arena, word.text, word.length);
  return *out ? TW_OK : no_memory(reader);
}

/* The words of a name of at most 1024 bytes, one blank between two. */
static tw_status copy_words(const obj_reader *reader, obj_word name, const char **out) {
  char words[1024];
  size_t length = 0;
  obj_text text = text_of(name);
  for (obj_word word = read_word(&text); word.length > 0; word = read_word(&text)) {
    if (length > 0) words[length++] = ' ';
    memcpy(words + length, word.text, word.length);
    length += word.length;
  }
  return copy_name(reader, (obj_word){words, length}, out);
}

typedef tw_status copy_text(const obj_reader *reader, obj_word text, const char **out);

/* *out: [names->count]. */
static tw_status copy_names(const obj_reader *reader, const obj_names *names, copy_text *copy,
                            uint32_t *count, const char ***out) {
  *count = (uint32_t)names->count;
  if (names->count == 0) return TW_OK;
  *out = tw_arena_alloc(reader->arena, names->count, sizeof **out);
  tw_status status = *out ? TW_OK : no_memory(reader);
  for (size_t i = 0; i < names->count && status == TW_OK; i++)
    status = copy(reader, names->names[i], &(*out)[i]);
  return status;
}

/* One of the meshes that a file becomes. */
typedef struct obj_part {
  obj_reader *reader;
  uint32_t index, count; /* of the meshes */
  uint64_t first_face, face_stop;
  uint32_t first_corner, corner_stop;
  uint32_t first_point, point_stop;
  uint32_t *uv_marks, *uv_numbers; /* [all.uvs] scratch; NULL for a single mesh */
} obj_part;

static tw_status add_points(const obj_part *part, tw_mesh *mesh) {
  const obj_reader *reader = part->reader;
  mesh->point_count = part->point_stop - part->first_point;
  mesh->positions = reader->positions + 3 * (size_t)part->first_point;
  if (!reader->colors) return TW_OK;
  const float *colors = reader->colors + 4 * (size_t)part->first_point;
  return tw_mesh_set_colors(mesh, colors, reader->arena) == TW_OK ? TW_OK : no_memory(reader);
}

/* The offsets of each mesh have a number more than it has faces, and count from its first corner: they move
 * up, the last mesh first. */
static void add_faces(const obj_part *part, tw_mesh *mesh) {
  const obj_reader *reader = part->reader;
  uint32_t *to = reader->face_offsets + part->index;
  mesh->face_count = (uint32_t)(part->face_stop - part->first_face);
  mesh->corner_count = part->corner_stop - part->first_corner;
  if (reader->corners) mesh->corners = reader->corners + part->first_corner;
  to[part->face_stop] = mesh->corner_count;
  for (uint64_t face = part->face_stop; face-- > part->first_face;)
    to[face] = reader->face_offsets[face] - part->first_corner;
  mesh->face_offsets = to + part->first_face;
  if (reader->materials) mesh->face_materials = (const int32_t *)reader->materials + part->first_face;
  if (reader->groups) mesh->face_groups = reader->groups + part->first_face;
  if (reader->smoothing) mesh->face_smoothing = reader->smoothing + part->first_face;
}

/* Numbers the UVs that the part's corners use, in the order of their first use. Returns how many they are. */
static uint32_t count_uvs(const obj_part *part) {
  const uint32_t mark = 2 * part->index + 1, *corners = part->reader->corner_uvs;
  uint32_t count = 0;
  for (uint32_t c = part->first_corner; c < part->corner_stop; c++) {
    if (corners[c] == OBJ_NO_VALUE || part->uv_marks[corners[c]] == mark) continue;
    part->uv_marks[corners[c]] = mark;
    part->uv_numbers[corners[c]] = count++;
  }
  return count;
}

/* Copies the UVs of a part into values, and makes its corners name those; `count` of them are the part's.
 * Corners without one share a value of their own, 0 0, which comes last. */
static void deal_uvs(const obj_part *part, uint32_t count, float *values) {
  const obj_reader *reader = part->reader;
  if (part->count == 1) memcpy(values, reader->uvs, 2 * (size_t)count * sizeof *values);
  for (uint32_t c = part->first_corner; c < part->corner_stop; c++) {
    uint32_t *corner = &reader->corner_uvs[c];
    if (*corner == OBJ_NO_VALUE) {
      *corner = count;
      values[2 * (size_t)count] = values[2 * (size_t)count + 1] = 0;
    } else if (part->count > 1) {
      const float *uv = reader->uvs + 2 * (size_t)*corner;
      *corner = part->uv_numbers[*corner];
      memcpy(values + 2 * (size_t)*corner, uv, 2 * sizeof *values);
    }
  }
}

static tw_status add_uvs(const obj_part *part, tw_mesh *mesh) {
  const obj_reader *reader = part->reader;
  if (!reader->corner_uvs) return TW_OK;
  const uint32_t *corners = reader->corner_uvs + part->first_corner;
  uint32_t missing = 0, count = part->count == 1 ? (uint32_t)reader->all.uvs : count_uvs(part);
  for (uint32_t c = 0; c < mesh->corner_count; c++) missing += corners[c] == OBJ_NO_VALUE;
  if (missing == mesh->corner_count) return TW_OK; /* this object has none at all */
  float *values = tw_arena_alloc_raw(reader->arena, (size_t)count + (missing > 0), 2 * sizeof *values);
  if (!values) return no_memory(reader);
  deal_uvs(part, count, values);
  mesh->uv_set_count = 1;
  mesh->uv_sets[0] = (tw_uv_set){count + (missing > 0), values, corners};
  return TW_OK;
}

/* All parts share the values: corners without one name the last, which is 0 0 0. */
static void add_normals(const obj_part *part, tw_mesh *mesh) {
  const obj_reader *reader = part->reader;
  if (!reader->corner_normals) return;
  uint32_t *corners = reader->corner_normals + part->first_corner, none = (uint32_t)reader->all.normals;
  bool has_some = false;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    has_some |= corners[c] != OBJ_NO_VALUE;
    if (corners[c] == OBJ_NO_VALUE) corners[c] = none;
  }
  memset(reader->normals + 3 * (size_t)none, 0, 3 * sizeof *reader->normals);
  if (has_some)
    mesh->normals =
        (tw_corner_normals){.value_count = none + 1, .values = reader->normals, .corners = corners};
}

static void add_tags(const obj_reader *reader, tw_mesh *mesh) {
  mesh->tag_boundary = reader->tag_boundary;
  mesh->tag_uv = reader->tag_uv;
  mesh->tag_creasing = reader->tag_creasing;
  mesh->tag_triangles = reader->tag_triangles;
  mesh->crease_count = (uint32_t)(reader->read.crease_points / 2);
  mesh->crease_edges = reader->crease_points;
  mesh->crease_sharpness = reader->crease_sharpness;
  mesh->sharp_point_count = (uint32_t)reader->read.sharp_points;
  mesh->sharp_points = reader->sharp_points;
  mesh->point_sharpness = reader->point_sharpness;
  mesh->hole_count = (uint32_t)reader->read.holes;
  mesh->holes = reader->holes;
}

static tw_status build_mesh(const obj_part *part, tw_mesh *mesh) {
  const obj_reader *reader = part->reader;
  tw_mesh_init(mesh);
  bool is_object = part->index < reader->object_count;
  tw_status status =
      copy_name(reader, is_object ? reader->objects[part->index].name : reader->first_group, &mesh->name);
  if (status == TW_OK) status = add_points(part, mesh);
  if (status != TW_OK) return status;
  add_faces(part, mesh);
  add_normals(part, mesh);
  add_tags(reader, mesh);
  return add_uvs(part, mesh);
}

/* ends: behind the last point of each mesh; NULL for a single one. */
static tw_status build_meshes(obj_reader *reader, uint32_t count, const uint32_t *ends, tw_model *model) {
  model->meshes = tw_arena_alloc(reader->arena, count, sizeof *model->meshes);
  size_t uvs = count > 1 ? (size_t)reader->all.uvs : 0;
  uint32_t *scratch = tw_alloc_zero(uvs, 2 * sizeof *scratch);
  tw_status status = model->meshes && scratch ? TW_OK : no_memory(reader);
  model->mesh_count = count;
  for (uint32_t i = count; i-- > 0 && status == TW_OK;) {
    obj_part part = {.reader = reader, .index = i, .count = count};
    face_range(reader, i, count, &part.first_face, &part.face_stop);
    part.first_corner = reader->face_offsets[part.first_face];
    part.corner_stop = (uint32_t)face_end(reader, part.face_stop - 1);
    part.first_point = i > 0 ? ends[i - 1] : 0;
    part.point_stop = ends ? ends[i] : (uint32_t)reader->all.points;
    part.uv_marks = scratch;
    part.uv_numbers = scratch + uvs;
    status = build_mesh(&part, &model->meshes[i]);
  }
  free(scratch);
  return status;
}

static void warn(const obj_reader *reader, tw_model *model) {
  if (reader->ignored_elements > 0)
    tw_model_warn(
        model, "%llu lines, points or curves are left out, the first in line %llu: only faces have a surface",
        (unsigned long long)reader->ignored_elements, (unsigned long long)reader->first_ignored);
  if (reader->unknown_statements > 0)
    tw_model_warn(model, "%llu statements are left out, the first in line %llu: \"%s\" is none that is known",
                  (unsigned long long)reader->unknown_statements, (unsigned long long)reader->first_unknown,
                  quote(reader->unknown_word).text);
  if (reader->ignored_tags > 0)
    tw_model_warn(model, "%llu subdivision tags are left out: their names are not known",
                  (unsigned long long)reader->ignored_tags);
  if (reader->dropped_count > 0)
    tw_model_warn(model, "%llu faces with fewer than three different points are left out",
                  (unsigned long long)reader->dropped_count);
  if (reader->missing_uvs > 0 && reader->corner_uvs)
    tw_model_warn(model, "%llu face corners have no texture coordinate and get 0 0",
                  (unsigned long long)reader->missing_uvs);
  if (reader->bad_normals > 0)
    tw_model_warn(model, "%llu normals are left out: they are not three finite numbers",
                  (unsigned long long)reader->bad_normals);
  if (reader->long_groups > 0)
    tw_model_warn(model, "%llu sets of groups are left out: their names have over 1024 bytes",
                  (unsigned long long)reader->long_groups);
  if (reader->late_groups > 0)
    tw_model_warn(model, "%llu sets of groups are left out: %d are kept",
                  (unsigned long long)reader->late_groups, GROUPS_MAX);
}

/* Points that were written twice along seams become one. A file with tags is a control mesh, whose points are
 * as they are meant. */
static tw_status close_seams(const obj_reader *reader, tw_model *model) {
  uint32_t dropped = 0, reversed = 0;
  if (reader->is_tagged) return TW_OK;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_merged merged;
    uint32_t more;
    tw_status status = tw_mesh_close_seams(&model->meshes[i], &merged, &more, reader->error);
    if (status != TW_OK) return status;
    dropped += merged.faces;
    reversed += more;
  }
  if (dropped > 0) tw_model_warn(model, TW_WELD_DROPPED_WARNING, (unsigned long long)dropped);
  if (reversed > 0) tw_model_warn(model, TW_REVERSED_WARNING, reversed);
  return TW_OK;
}

static tw_status build_model(obj_reader *reader, tw_model *model) {
  uint32_t mesh_count, *ends = NULL;
  tw_status status =
      copy_names(reader, &reader->material_names, copy_name, &model->material_count, &model->material_names);
  if (status == TW_OK)
    status = copy_names(reader, &reader->group_names, copy_words, &model->group_count, &model->group_names);
  if (status == TW_OK) status = deal_points(reader, &mesh_count, &ends);
  if (status == TW_OK) status = build_meshes(reader, mesh_count, ends, model);
  free(ends);
  return status;
}

tw_status tw_obj_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error) {
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_OBJ;
  obj_reader reader = {.arena = model->arena,
                       .error = error,
                       .material = OBJ_NO_NAME,
                       .group = OBJ_NO_NAME,
                       .smoothing_group = OBJ_NO_VALUE,
                       .tag_boundary = TW_TAG_UNSET,
                       .tag_uv = TW_TAG_UNSET,
                       .tag_creasing = TW_TAG_UNSET,
                       .tag_triangles = TW_TAG_UNSET};
  bool has_mark = size >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0;
  const uint8_t *start = bytes + (has_mark ? 3 : 0);
  tw_status status = read_statements(&reader, (obj_text){start, bytes + size, 1, start});
  if (status == TW_OK) status = build_model(&reader, model);
  if (status == TW_OK) warn(&reader, model);
  if (status == TW_OK && weld != TW_WELD_NONE) status = close_seams(&reader, model);
  reader_deinit(&reader);
  if (status == TW_OK) status = tw_model_finish(model, error);
  if (status != TW_OK) {
    tw_model_destroy(model);
    return status;
  }
  *out = model;
  return TW_OK;
}
