/* The statements of the polygonal part of Wavefront OBJ, and the subdivision tags of OpenSubdiv's tools. Two
 * passes over the text: the first one counts, so that the second one writes straight into arrays of the
 * model's arena that have room for just that. Source: Wavefront Advanced Visualizer file formats, appendix
 * B1. */
#include "obj_statements.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "number.h"
#include "soup_mesh.h"
#include "tweend/format.h"

/* ---- walking through the text ----------------------------------------------------------------- */

/* Lines end with LF, CRLF or a lone CR; a backslash just before a line end is a blank. */
typedef struct obj_text {
  const uint8_t *at, *end;
  uint64_t line;        /* of `at`, from 1 */
  const uint8_t *first; /* of the file; NULL for names */
} obj_text;

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
static tw_obj_word read_word(obj_text *text) {
  skip_blanks(text);
  const uint8_t *start = text->at;
  while (text->at < text->end && !ends_word(text->at, text->end)) text->at++;
  return (tw_obj_word){(const char *)start, (size_t)(text->at - start)};
}

tw_obj_quote tw_obj_quote_word(tw_obj_word word) {
  static const char more[] = "...";
  tw_obj_quote out = {{0}};
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
  tw_fail_line(error, TW_SYNTAX, text->line, "\"%s\" is no %s", tw_obj_quote_word(read_word(&from)).text,
               what);
  if (error) error->column = column;
  return TW_SYNTAX;
}

/* The rest of the text without blanks at its ends. */
static tw_obj_word read_rest(obj_text *text) {
  skip_blanks(text);
  const uint8_t *start = text->at, *end = text->end;
  while (end > start && is_blank(end[-1])) end--;
  text->at = text->end;
  return (tw_obj_word){(const char *)start, (size_t)(end - start)};
}

static bool word_is(tw_obj_word word, const char *text) {
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
static bool next_statement(obj_text *file, tw_obj_word *word, obj_text *statement) {
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

static obj_text text_of(tw_obj_word word) {
  const uint8_t *start = (const uint8_t *)word.text;
  return (obj_text){start, start + word.length, 0, NULL};
}

tw_obj_word tw_obj_cut_word(tw_obj_word *name) {
  obj_text text = text_of(*name);
  tw_obj_word word = read_word(&text);
  *name = (tw_obj_word){(const char *)text.at, (size_t)(text.end - text.at)};
  return word;
}

/* FNV-1a over the words, a blank behind each. */
static uint64_t hash_name(tw_obj_word name) {
  uint64_t value = 14695981039346656037u;
  obj_text text = text_of(name);
  for (tw_obj_word word = read_word(&text); word.length > 0; word = read_word(&text)) {
    for (size_t i = 0; i < word.length; i++) value = (value ^ (uint8_t)word.text[i]) * 1099511628211u;
    value = (value ^ ' ') * 1099511628211u;
  }
  return value ^ value >> 32;
}

/* Names are lists of words: what is between two does not matter. */
static bool same_name(tw_obj_word a, tw_obj_word b) {
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
static uint32_t *find_slot(const tw_obj_names *table, tw_obj_word name) {
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
static tw_status grow_names(tw_obj_names *table, tw_error *error) {
  size_t capacity = table->capacity ? table->capacity * 2 : 32;
  tw_obj_word *grown = realloc(table->names, capacity * sizeof *grown);
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

/* The number of a name, a new one where it is new; TW_OBJ_NO_NAME for a new one beyond `most`. */
static tw_status number_name(tw_obj_names *table, tw_obj_word name, uint32_t most, uint32_t *out,
                             tw_error *error) {
  if (table->count == table->capacity) {
    tw_status status = grow_names(table, error);
    if (status != TW_OK) return status;
  }
  uint32_t *slot = find_slot(table, name);
  if (!slot) return fail_colliding(error);
  *out = *slot - 1;
  if (*slot != 0 || table->count == most) return TW_OK; /* 0 - 1 is TW_OBJ_NO_NAME */
  table->names[table->count++] = name;
  *slot = (uint32_t)table->count;
  *out = *slot - 1;
  return TW_OK;
}

static void names_deinit(tw_obj_names *table) {
  free(table->names);
  free(table->slots);
}

/* ---- the reader ------------------------------------------------------------------------------------- */

void tw_obj_reader_deinit(tw_obj_reader *reader) {
  free(reader->uvs);
  free(reader->dropped);
  free(reader->objects);
  names_deinit(&reader->material_names);
  names_deinit(&reader->group_names);
}

tw_status tw_obj_fail_memory(const tw_obj_reader *reader) {
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
static tw_status set_color(tw_obj_reader *reader, uint64_t point, const float *rgb) {
  if (!reader->colors) {
    size_t count = (size_t)reader->all.points * 4;
    reader->colors = tw_arena_alloc_raw(reader->arena, count, sizeof(float));
    if (!reader->colors) return tw_obj_fail_memory(reader);
    for (size_t i = 0; i < count; i++) reader->colors[i] = 1;
  }
  for (size_t c = 0; c < 3; c++) reader->colors[4 * point + c] = tw_linear_from_srgb(rgb[c]);
  return TW_OK;
}

/* v x y z, v x y z w, v x y z r g b or v x y z r g b a. A weight belongs to curves; it and alpha
 * are read over. */
static tw_status read_point(tw_obj_reader *reader, obj_text *text) {
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
static tw_status read_colors(tw_obj_reader *reader, obj_text *text) {
  tw_obj_word word = read_word(text);
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
static tw_status read_uv(tw_obj_reader *reader, obj_text *text) {
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
static void read_normal(tw_obj_reader *reader, obj_text *text) {
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
static tw_status read_corner(const tw_obj_reader *reader, obj_text *text, obj_corner *out) {
  const tw_obj_counts *read = &reader->read, *all = &reader->all;
  tw_error *error = reader->error;
  out->uv = out->normal = TW_OBJ_NO_VALUE;
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
static uint32_t *allocate_none(const tw_obj_reader *reader, uint64_t count) {
  uint32_t *out = tw_arena_alloc_raw(reader->arena, (size_t)count, sizeof *out);
  if (out) memset(out, 0xFF, (size_t)count * sizeof *out);
  return out;
}

/* Notes the value of the newest corner. Nothing is stored before the first corner that has one. */
static tw_status set_value(const tw_obj_reader *reader, uint32_t **values, uint64_t corner, uint32_t value) {
  if (!*values && value == TW_OBJ_NO_VALUE) return TW_OK;
  if (!*values) *values = allocate_none(reader, reader->all.corners);
  if (!*values) return tw_obj_fail_memory(reader);
  (*values)[corner] = value;
  return TW_OK;
}

static tw_status add_corner(tw_obj_reader *reader, const obj_corner *added) {
  uint64_t corner = reader->read.corners++;
  reader->corners[corner] = added->point;
  reader->missing_uvs += added->uv == TW_OBJ_NO_VALUE;
  tw_status status = set_value(reader, &reader->corner_uvs, corner, added->uv);
  return status == TW_OK ? set_value(reader, &reader->corner_normals, corner, added->normal) : status;
}

/* Labels the newest face with its material, groups or smoothing group. Nothing is stored before the first
 * face that has some. */
static tw_status label_face(const tw_obj_reader *reader, uint32_t **labels, uint32_t label) {
  if (!*labels && label == TW_OBJ_NO_NAME) return TW_OK;
  if (!*labels) *labels = allocate_none(reader, reader->all.faces);
  if (!*labels) return tw_obj_fail_memory(reader);
  (*labels)[reader->read.faces] = label;
  return TW_OK;
}

/* The set of groups of the newest face; where there are too many the face is in none. */
static tw_status number_groups(tw_obj_reader *reader) {
  if (reader->group_words.length == 0) return TW_OK;
  tw_status status = number_name(&reader->group_names, reader->group_words, TW_OBJ_GROUPS_MAX, &reader->group,
                                 reader->error);
  reader->late_groups += status == TW_OK && reader->group == TW_OBJ_NO_NAME;
  reader->group_words.length = 0;
  return status;
}

/* Leaves out the corners at the point of the one before them. Returns how many stay. */
static uint64_t drop_doubled_corners(tw_obj_reader *reader, uint64_t first) {
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
static tw_status drop_face(tw_obj_reader *reader, uint64_t first_corner) {
  uint64_t count = reader->dropped_count;
  if ((count & (count - 1)) == 0) { /* full: its room is a power of two */
    uint32_t *grown = realloc(reader->dropped, (size_t)(count ? 2 * count : 1) * sizeof *grown);
    if (!grown) return tw_obj_fail_memory(reader);
    reader->dropped = grown;
  }
  reader->dropped[reader->dropped_count++] = (uint32_t)(reader->read.faces + count);
  reader->read.corners = first_corner;
  return TW_OK;
}

/* What is left when all is read: holes are numbered among the faces of the file. */
static void settle_faces(tw_obj_reader *reader) {
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

static tw_status read_face(tw_obj_reader *reader, obj_text *text) {
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
static void begin_object(tw_obj_reader *reader, obj_text *text) {
  tw_obj_object object = {read_rest(text), (uint32_t)reader->read.faces};
  tw_obj_object *last = reader->object_count ? &reader->objects[reader->object_count - 1] : NULL;
  if (last && last->first_face == object.first_face)
    *last = object;
  else if (reader->object_count <= TW_OBJ_OBJECTS_MAX)
    reader->objects[reader->object_count++] = object;
}

/* The set of groups that the faces to come are in. `default` is the group of faces that are in none. */
static void begin_groups(tw_obj_reader *reader, obj_text *text) {
  enum { TEXT_MAX = 1024 }; /* each part of an answer may name its groups again */
  tw_obj_word names = read_word(text), word = names;
  for (; word.length > 0; word = read_word(text))
    names.length = (size_t)(word.text + word.length - names.text);
  if (reader->first_group.length == 0) reader->first_group = names;
  reader->group = TW_OBJ_NO_NAME;
  reader->long_groups += names.length > TEXT_MAX;
  if (names.length > TEXT_MAX || word_is(names, "default")) names.length = 0;
  reader->group_words = names;
}

static tw_status use_material(tw_obj_reader *reader, obj_text *text) {
  tw_obj_word name = read_rest(text);
  reader->material = TW_OBJ_NO_NAME;
  if (name.length == 0) return TW_OK;
  tw_status status =
      number_name(&reader->material_names, name, TW_MATERIALS_MAX, &reader->material, reader->error);
  if (status != TW_OK || reader->material != TW_OBJ_NO_NAME) return status;
  return tw_fail_line(reader->error, TW_LIMIT, text->line, "there are more than %d materials",
                      TW_MATERIALS_MAX);
}

/* s NUMBER, or s off, which is 0. What is neither is as good as none. */
static void begin_smoothing(tw_obj_reader *reader, obj_text *text) {
  int64_t group;
  obj_text rest = *text;
  reader->smoothing_group = 0;
  if (word_is(read_word(text), "off")) return;
  skip_blanks(&rest);
  bool is_group = read_integer(&rest, &group) && group >= 0 && group < UINT32_MAX;
  reader->smoothing_group = is_group ? (uint32_t)group : TW_OBJ_NO_VALUE;
}

/* Statements of the format that have nothing to do with a surface of polygons. */
static bool is_known(tw_obj_word word) {
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
static tw_status read_other(tw_obj_reader *reader, const obj_text *text, tw_obj_word word) {
  if (word_is(word, "l") || word_is(word, "p") || word_is(word, "curv") || word_is(word, "curv2") ||
      word_is(word, "surf")) {
    if (reader->ignored_elements++ == 0) reader->first_ignored = text->line;
  }
  for (size_t i = 0; i < word.length; i++) {
    char c = word.text[i];
    bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || tw_is_digit(c) || c == '_';
    if (!letter)
      return tw_fail_line(reader->error, TW_SYNTAX, text->line, "\"%s\" begins no statement of an OBJ file",
                          tw_obj_quote_word(word).text);
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
  tw_obj_word name;
  uint64_t line;
  uint64_t int_count, float_count, string_count;
} obj_tag;

static tw_status bad_tag(const tw_obj_reader *reader, const obj_tag *tag, const char *what) {
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

static tw_status read_tag_int(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
                              uint32_t *out) {
  int64_t value;
  skip_blanks(text);
  if (!read_integer(text, &value)) return bad_tag(reader, tag, "an integer of the tag is missing");
  if (value < 0 || value >= UINT32_MAX) return bad_tag(reader, tag, "an integer of the tag is out of range");
  *out = (uint32_t)value;
  return TW_OK;
}

static tw_status read_tag_float(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text, float *out) {
  double value;
  if (!read_number(text, &value) || !isfinite((float)value))
    return bad_tag(reader, tag, "a number of the tag is missing or malformed");
  *out = (float)value;
  return TW_OK;
}

/* Reads over floats, and demands the string that the counts speak of. */
static tw_status skip_tag_rest(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
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
static tw_status read_tag_indices(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
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
static tw_status read_sharpness(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
                                uint64_t width, uint64_t count, uint64_t first, float *out) {
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

static tw_status read_crease_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
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

static tw_status read_corner_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  uint64_t first = reader->read.sharp_points;
  if (tag->float_count != 1 && tag->float_count != tag->int_count)
    return bad_tag(reader, tag, "a corner needs one sharpness, or one a point");
  tw_status status =
      read_tag_indices(reader, tag, text, reader->all.points, "points", first, reader->sharp_points);
  reader->read.sharp_points += tag->int_count;
  if (status != TW_OK) return status;
  return read_sharpness(reader, tag, text, 1, tag->int_count, first, reader->point_sharpness);
}

static tw_status read_hole_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  tw_status status =
      read_tag_indices(reader, tag, text, reader->all.faces, "faces", reader->read.holes, reader->holes);
  reader->read.holes += tag->int_count;
  return status == TW_OK ? skip_tag_rest(reader, tag, text, tag->float_count) : status;
}

/* The tag's one int looked up in a table. */
static tw_status set_from_int(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
                              const int *table, size_t size, int *out) {
  uint32_t value = UINT32_MAX;
  tw_status status = tag->int_count > 0 ? read_tag_int(reader, tag, text, &value) : TW_OK;
  if (status == TW_OK && (tag->int_count != 1 || value >= size))
    status = bad_tag(reader, tag, "the tag needs one integer, of those that it knows");
  if (status == TW_OK) status = skip_tag_rest(reader, tag, text, tag->float_count);
  if (status == TW_OK) *out = table[value];
  return status;
}

/* The tag's string, behind its numbers, looked up: names[i] means values[i]. */
static tw_status set_from_string(const tw_obj_reader *reader, const obj_tag *tag, obj_text *text,
                                 const char *const *names, const int *values, const char *fault, int *out) {
  uint32_t number;
  tw_status status = TW_OK;
  for (uint64_t i = 0; i < tag->int_count && status == TW_OK; i++)
    status = read_tag_int(reader, tag, text, &number);
  if (status == TW_OK) status = skip_tag_rest(reader, tag, text, tag->float_count);
  if (status != TW_OK) return status;
  tw_obj_word word = {"", 0};
  if (tag->string_count > 0) word = read_word(text);
  for (size_t i = 0; names[i]; i++) {
    if (!word_is(word, names[i])) continue;
    *out = values[i];
    return TW_OK;
  }
  return bad_tag(reader, tag, fault);
}

static tw_status read_creasing_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const char *const names[] = {"normal", "uniform", "chaikin", NULL};
  static const int values[] = {TW_CREASE_UNIFORM, TW_CREASE_UNIFORM, TW_CREASE_CHAIKIN};
  return set_from_string(reader, tag, text, names, values, "creasemethod is one of normal, chaikin",
                         &reader->tag_creasing);
}

/* By name, or by the number that older tools wrote. */
static tw_status read_triangles_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int numbers[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH, TW_TRIANGLES_SMOOTH};
  static const char *const names[] = {"catmark", "normal", "smooth", NULL};
  static const int values[] = {TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH};
  if (tag->string_count == 0) return set_from_int(reader, tag, text, numbers, 3, &reader->tag_triangles);
  return set_from_string(reader, tag, text, names, values, "smoothtriangles is one of catmark, smooth",
                         &reader->tag_triangles);
}

static tw_status read_boundary_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int rules[] = {TW_BOUNDARY_NONE, TW_BOUNDARY_EDGE_AND_CORNER, TW_BOUNDARY_EDGE_ONLY};
  return set_from_int(reader, tag, text, rules, 3, &reader->tag_boundary);
}

static tw_status read_uv_tag(tw_obj_reader *reader, const obj_tag *tag, obj_text *text) {
  static const int rules[] = {TW_UV_NONE,          TW_UV_CORNERS_ONLY, TW_UV_CORNERS_PLUS1,
                              TW_UV_CORNERS_PLUS2, TW_UV_BOUNDARIES,   TW_UV_ALL};
  return set_from_int(reader, tag, text, rules, 6, &reader->tag_uv);
}

static tw_status read_tag(tw_obj_reader *reader, obj_text *text) {
  static const struct {
    const char *name;
    tw_status (*read)(tw_obj_reader *reader, const obj_tag *tag, obj_text *text);
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
static void count_tag(tw_obj_counts *all, obj_text *text) {
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
static bool is_face(tw_obj_word word) {
  return word_is(word, "f") || word_is(word, "fo");
}

static void count_statement(tw_obj_counts *all, tw_obj_word word, obj_text *text) {
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

static tw_status read_statement(tw_obj_reader *reader, tw_obj_word word, obj_text *text) {
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
static void *make_room(const tw_obj_reader *reader, uint64_t count, size_t size, tw_status *status) {
  if (count == 0 || *status != TW_OK) return NULL;
  void *room = tw_arena_alloc_raw(reader->arena, (size_t)count, size);
  if (!room) *status = tw_obj_fail_memory(reader);
  return room;
}

static tw_status make_all_room(tw_obj_reader *reader) {
  const tw_obj_counts *all = &reader->all;
  const uint64_t counts[] = {all->points, all->uvs, all->normals, all->faces, all->corners};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i] >= UINT32_MAX)
      return tw_fail(reader->error, TW_LIMIT, "the file has more than 4294967294 elements of a kind");
  uint64_t objects = all->objects < TW_OBJ_OBJECTS_MAX + 1 ? all->objects : TW_OBJ_OBJECTS_MAX + 1;
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
  return reader->uvs && reader->objects ? status : tw_obj_fail_memory(reader);
}

tw_status tw_obj_read_statements(tw_obj_reader *reader, const uint8_t *bytes, size_t size) {
  bool has_mark = size >= 3 && memcmp(bytes, "\xEF\xBB\xBF", 3) == 0;
  const uint8_t *first = bytes + (has_mark ? 3 : 0);
  obj_text text, file = {first, bytes + size, 1, first}, start = file;
  tw_obj_word word;
  reader->material = reader->group = TW_OBJ_NO_NAME;
  reader->smoothing_group = TW_OBJ_NO_VALUE;
  reader->tag_boundary = reader->tag_uv = reader->tag_creasing = reader->tag_triangles = TW_TAG_UNSET;
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
