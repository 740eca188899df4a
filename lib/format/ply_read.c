/* PLY: vertices and faces of polygons, as text or in either byte order. Reads positions, normals, colours and
 * texture coordinates of vertices, faces and strips of triangles, and colours and texture coordinates of
 * faces; skips other elements and properties. Sources: Greg Turk, The PLY Polygon File Format, 1994; the
 * coordinates of wedges as MeshLab writes them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "soup_mesh.h"
#include "tweend/format.h"
#include "word.h"

/* ---- text ------------------------------------------------------------------------------------ */

/* Whether the character is a blank within a line. */
static bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

/* The next word of a line; length 0 at its end. */
static tw_word next_word(tw_word *line) {
  while (line->length > 0 && is_blank(*line->text)) line->text++, line->length--;
  tw_word word = {line->text, 0};
  while (line->length > 0 && !is_blank(*line->text)) line->text++, line->length--, word.length++;
  return word;
}

/* ---- header ---------------------------------------------------------------------------------- */

typedef enum ply_type { PLY_I8, PLY_U8, PLY_I16, PLY_U16, PLY_I32, PLY_U32, PLY_F32, PLY_F64 } ply_type;
static const size_t type_sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

/* What a property is for. */
typedef enum ply_use {
  PLY_X,
  PLY_Y,
  PLY_Z,
  PLY_RED,
  PLY_GREEN,
  PLY_BLUE,
  PLY_ALPHA,
  PLY_U,
  PLY_V,
  PLY_NX,
  PLY_NY,
  PLY_NZ,
  PLY_CORNERS,
  PLY_WEDGES,
  PLY_USES,
  PLY_UNUSED = PLY_USES
} ply_use;

typedef struct ply_property {
  bool is_list;
  ply_type type, count_type; /* count_type: of lists */
  ply_use use;
  tw_word name;
} ply_property;

enum { PROPERTIES_MAX = 256, ELEMENTS_MAX = 64, ROW_STEPS = 32 };

typedef struct ply_element {
  enum { PLY_VERTICES, PLY_FACES, PLY_STRIPS, PLY_OTHERS } kind;
  tw_word name;
  uint64_t count;
  uint32_t first_property, property_count;
  bool uses[PLY_USES]; /* that a property of the element has */
} ply_element;

/* What the values of a row make, while it is read. */
typedef struct ply_row {
  uint32_t first_corner;
  uint64_t wedge_values;
  float color[4];       /* of a face; infinite where nothing tells: full */
  uint32_t strip[2];    /* the last two corners of a strip */
  uint64_t strip_count; /* corners since its beginning */
} ply_row;

/* Numbers of colours that were read. */
typedef struct ply_colors {
  uint64_t count, beyond; /* beyond: those that are not in 0 to 1 */
  bool are_fractions;     /* some are no whole numbers up to 255 */
} ply_colors;

typedef struct ply_file {
  const uint8_t *at, *end;
  uint64_t line; /* from 1: of the line of the header read last, then, in text, of `at` */
  bool is_text, is_big_endian;
  bool has_returns; /* lines of the header end with CR alone: an LF behind the last one is data */
  uint32_t element_count, property_count;
  ply_element elements[ELEMENTS_MAX];
  ply_property properties[PROPERTIES_MAX];
  ply_row row;
  ply_colors vertex_colors, face_colors;
  tw_losses losses;
  tw_error *error;
} ply_file;

static tw_status fail(const ply_file *file, const char *detail) {
  return tw_fail_line(file->error, TW_SYNTAX, file->line, "%s", detail);
}

/* Reads a line, which ends as the first one does: with LF, CRLF or CR. False at the end of the file. */
static bool next_line(ply_file *file, tw_word *out) {
  if (file->at == file->end) return false;
  const uint8_t *start = file->at, *at = start;
  while (at < file->end && *at != '\n' && *at != '\r') at++;
  *out = (tw_word){(const char *)start, (size_t)(at - start)};
  bool has_feed = at < file->end && at[0] == '\r' && file->end - at > 1 && at[1] == '\n';
  if (file->line == 0) file->has_returns = at < file->end && at[0] == '\r' && !has_feed;
  if (at < file->end) at += has_feed && !file->has_returns ? 2 : 1;
  file->at = at;
  file->line++;
  return true;
}

static bool find_type(tw_word word, ply_type *out) {
  static const char *const names[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                         {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                         {"float", "float32"}, {"double", "float64"}};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (tw_word_is(word, names[i][0]) || tw_word_is(word, names[i][1])) {
      *out = (ply_type)i;
      return true;
    }
  return false;
}

static bool fits_use(const ply_element *element, bool is_list, ply_use use) {
  if (use == PLY_CORNERS) return is_list && (element->kind == PLY_FACES || element->kind == PLY_STRIPS);
  if (use == PLY_WEDGES) return is_list && element->kind == PLY_FACES;
  bool is_color = use >= PLY_RED && use <= PLY_ALPHA;
  return !is_list && (element->kind == PLY_VERTICES || (is_color && element->kind == PLY_FACES));
}

static ply_use find_use(const ply_element *element, bool is_list, tw_word name) {
  static const struct {
    const char *name;
    ply_use use;
  } names[] = {{"x", PLY_X},
               {"y", PLY_Y},
               {"z", PLY_Z},
               {"red", PLY_RED},
               {"green", PLY_GREEN},
               {"blue", PLY_BLUE},
               {"alpha", PLY_ALPHA},
               {"diffuse_red", PLY_RED},
               {"diffuse_green", PLY_GREEN},
               {"diffuse_blue", PLY_BLUE},
               {"diffuse_alpha", PLY_ALPHA},
               {"s", PLY_U},
               {"u", PLY_U},
               {"texture_u", PLY_U},
               {"t", PLY_V},
               {"v", PLY_V},
               {"texture_v", PLY_V},
               {"nx", PLY_NX},
               {"ny", PLY_NY},
               {"nz", PLY_NZ},
               {"vertex_indices", PLY_CORNERS},
               {"vertex_index", PLY_CORNERS},
               {"texcoord", PLY_WEDGES}};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    if (!tw_word_is(name, names[i].name)) continue;
    return fits_use(element, is_list, names[i].use) && !element->uses[names[i].use] ? names[i].use
                                                                                    : PLY_UNUSED;
  }
  return PLY_UNUSED;
}

static tw_status add_element(ply_file *file, tw_word *line) {
  tw_word name = next_word(line);
  double count;
  if (file->element_count == ELEMENTS_MAX) return fail(file, "there are more than 64 elements");
  if (!tw_word_number(next_word(line), &count) || !(count >= 0 && count < UINT32_MAX) ||
      count != floor(count))
    return fail(file, "an element needs a name and a count below 2^32");
  ply_element *element = &file->elements[file->element_count++];
  *element = (ply_element){
      .kind = PLY_OTHERS, .name = name, .count = (uint64_t)count, .first_property = file->property_count};
  bool is_first[3] = {true, true, true};
  for (uint32_t i = 0; i + 1 < file->element_count; i++)
    if (file->elements[i].kind != PLY_OTHERS) is_first[file->elements[i].kind] = false;
  if (tw_word_is(name, "vertex") && is_first[PLY_VERTICES]) element->kind = PLY_VERTICES;
  if (tw_word_is(name, "face") && is_first[PLY_FACES]) element->kind = PLY_FACES;
  if (tw_word_is(name, "tristrips") && is_first[PLY_STRIPS]) element->kind = PLY_STRIPS;
  return TW_OK;
}

static tw_status add_property(ply_file *file, tw_word *line) {
  if (file->element_count == 0) return fail(file, "a property stands before the first element");
  if (file->property_count == PROPERTIES_MAX) return fail(file, "there are more than 256 properties");
  ply_element *element = &file->elements[file->element_count - 1];
  ply_property *property = &file->properties[file->property_count++];
  tw_word word = next_word(line);
  *property = (ply_property){.is_list = tw_word_is(word, "list")};
  bool is_known = true;
  if (property->is_list) {
    is_known = find_type(next_word(line), &property->count_type) && property->count_type < PLY_F32;
    word = next_word(line);
  }
  if (!is_known || !find_type(word, &property->type))
    return fail(file, "the type of a property is not known");
  property->name = next_word(line);
  property->use = find_use(element, property->is_list, property->name);
  if (property->use != PLY_UNUSED) element->uses[property->use] = true;
  element->property_count++;
  return TW_OK;
}

static tw_status set_format(ply_file *file, tw_word *line) {
  tw_word name = next_word(line);
  tw_word rest = *line;
  if (tw_word_is(next_word(&rest), "1.0")) *line = rest; /* there has been no other version */
  file->is_text = tw_word_is(name, "ascii");
  file->is_big_endian = tw_word_is(name, "binary_big_endian");
  if (file->is_text || file->is_big_endian || tw_word_is(name, "binary_little_endian")) return TW_OK;
  return fail(file, "the format is not ascii, binary_little_endian or binary_big_endian");
}

/* Passes over a line that says nothing of elements. Comments are not data, but for the names of pictures. */
static void skip_line(ply_file *file, tw_word word, tw_word *line) {
  if (tw_word_is(word, "ply")) return;
  bool is_comment = tw_word_is(word, "comment") && !tw_word_begins(next_word(line), "texturefile");
  line->length = 0;
  if (word.length == 0 || is_comment) return;
  if (tw_word_is(word, "comment"))
    tw_lose(&file->losses, "line of the header is left out: pictures are other files",
            "lines of the header are left out: pictures are other files", 1, file->line);
  else
    tw_lose(&file->losses, "line of the header is left out", "lines of the header are left out", 1,
            file->line);
}

/* Reads the header up to the line behind end_header. */
static tw_status read_header(ply_file *file) {
  tw_word line;
  bool has_format = false, is_end = false;
  tw_status status = TW_OK;
  while (status == TW_OK && !is_end) {
    if (!next_line(file, &line)) return fail(file, "the file ends within its header");
    tw_word word = next_word(&line);
    is_end = tw_word_is(word, "end_header");
    if (is_end && !has_format) return fail(file, "the header says no format");
    if (tw_word_is(word, "format") && !has_format) {
      status = set_format(file, &line);
      has_format = true;
    } else if (tw_word_is(word, "element")) {
      status = add_element(file, &line);
    } else if (tw_word_is(word, "property")) {
      status = add_property(file, &line);
    } else if (!is_end) {
      skip_line(file, word, &line);
    }
    tw_lose(&file->losses, "line of the header has words that are left out",
            "lines of the header have words that are left out", next_word(&line).length > 0, file->line);
  }
  file->line++; /* of the first row */
  return status;
}

static ply_element *find_element(ply_file *file, int kind) {
  for (uint32_t i = 0; i < file->element_count; i++)
    if ((int)file->elements[i].kind == kind) return &file->elements[i];
  return NULL;
}

static bool has_all(const ply_element *element, ply_use first, ply_use last) {
  for (ply_use use = first; use <= last; use++)
    if (!element || !element->uses[use]) return false;
  return true;
}

/* Takes the uses from `first` to `last` from an element's properties, which are then left out. */
static void take_uses(ply_file *file, ply_element *element, ply_use first, ply_use last) {
  for (uint32_t i = 0; i < element->property_count; i++) {
    ply_property *property = &file->properties[element->first_property + i];
    if (property->use >= first && property->use <= last) property->use = PLY_UNUSED;
  }
  for (ply_use use = first; use <= last; use++) element->uses[use] = false;
}

/* Takes uses that not all of the properties that belong together have. */
static void take_incomplete(ply_file *file, ply_element *element) {
  static const ply_use groups[][3] = {
      {PLY_RED, PLY_BLUE, PLY_ALPHA}, {PLY_U, PLY_V, PLY_V}, {PLY_NX, PLY_NZ, PLY_NZ}};
  for (size_t i = 0; i < sizeof groups / sizeof *groups; i++)
    if (!has_all(element, groups[i][0], groups[i][1])) take_uses(file, element, groups[i][0], groups[i][2]);
}

/* Decides what is read: elements without corners are not; texture coordinates of corners stand in place of
 * those of vertices, and colours of vertices in place of those of faces. */
static void settle_uses(ply_file *file) {
  for (uint32_t i = 0; i < file->element_count; i++) {
    ply_element *element = &file->elements[i];
    bool lacks_corners = element->kind >= PLY_FACES && !element->uses[PLY_CORNERS];
    if (lacks_corners) element->kind = PLY_OTHERS;
    take_incomplete(file, element);
  }
  ply_element *vertices = find_element(file, PLY_VERTICES), *faces = find_element(file, PLY_FACES);
  if (!vertices || !faces) return;
  if (faces->uses[PLY_WEDGES]) take_uses(file, vertices, PLY_U, PLY_V);
  if (vertices->uses[PLY_RED]) take_uses(file, faces, PLY_RED, PLY_ALPHA);
}

/* ---- values ---------------------------------------------------------------------------------- */

static tw_status read_text_value(ply_file *file, double *out) {
  while (file->at < file->end && (is_blank((char)*file->at) || *file->at == '\n' || *file->at == '\r'))
    file->line += *file->at++ == '\n';
  const char *start = (const char *)file->at;
  while (file->at < file->end && !is_blank((char)*file->at) && *file->at != '\n' && *file->at != '\r')
    file->at++;
  if (tw_word_number((tw_word){start, (size_t)((const char *)file->at - start)}, out)) return TW_OK;
  return fail(file, file->at == file->end ? "the file is cut off" : "a number is malformed");
}

static double from_bits(ply_type type, uint64_t bits) {
  uint32_t low = (uint32_t)bits;
  float single;
  double value;
  switch (type) {
  case PLY_I8: return (int8_t)bits;
  case PLY_I16: return (int16_t)bits;
  case PLY_I32: return (int32_t)bits;
  case PLY_U8:
  case PLY_U16:
  case PLY_U32: return (double)bits;
  case PLY_F32: memcpy(&single, &low, sizeof single); return (double)single;
  case PLY_F64: break;
  }
  memcpy(&value, &bits, sizeof value);
  return value;
}

static tw_status read_value(ply_file *file, ply_type type, double *out) {
  if (file->is_text) return read_text_value(file, out);
  size_t size = type_sizes[type];
  if ((size_t)(file->end - file->at) < size) return tw_fail(file->error, TW_SYNTAX, "the file is cut off");
  uint64_t bits = 0;
  for (size_t i = 0; i < size; i++)
    bits |= (uint64_t)file->at[i] << 8 * (file->is_big_endian ? size - 1 - i : i);
  file->at += size;
  *out = from_bits(type, bits);
  return TW_OK;
}

static tw_status read_list_length(ply_file *file, const ply_property *property, uint64_t *out) {
  double length;
  tw_status status = read_value(file, property->count_type, &length);
  if (status != TW_OK) return status;
  if (!(length >= 0 && length < UINT32_MAX) || length != floor(length))
    return fail(file, "the length of a list is not a number below 2^32");
  *out = (uint64_t)length;
  return TW_OK;
}

/* The fewest bytes that a row of an element can have. A number of text has a digit and a blank behind it. */
static uint64_t least_size(const ply_file *file, const ply_element *element) {
  uint64_t size = 0;
  for (uint32_t i = 0; i < element->property_count; i++) {
    const ply_property *property = &file->properties[element->first_property + i];
    size += file->is_text ? 2 : type_sizes[property->is_list ? property->count_type : property->type];
  }
  return size;
}

/* ---- elements -------------------------------------------------------------------------------- */

/* What the rows of all elements become. */
typedef struct ply_counts {
  uint64_t faces, corners;
} ply_counts;

/* Adds a list of `count` corners: those of a face, or of a strip, which has a triangle for each but two. */
static void count_corners(const ply_element *element, uint64_t count, ply_counts *counts) {
  bool is_strip = element->kind == PLY_STRIPS;
  uint64_t triangles = count > 2 ? count - 2 : 0;
  counts->faces += is_strip ? triangles : 1;
  counts->corners += is_strip ? 3 * triangles : count;
}

/* Full intensity is 1 for floats, 65,535 for 16-bit integers, else 255. */
static float intensity(ply_type type, double value) {
  if (type >= PLY_F32) return (float)value;
  return (float)(value / (type == PLY_U16 || type == PLY_I16 ? 65535 : 255));
}

static float share_of(const ply_property *property, double value, ply_colors *all) {
  float share = intensity(property->type, value);
  all->count++;
  all->beyond += !tw_is_color(share);
  all->are_fractions |= !(share >= 0 && share <= 255 && share == floorf(share));
  return share;
}

/* Takes colours from sRGB to linear, once all are read. Where they are whole numbers up to 255, some over 1,
 * that is full intensity. colors: [count][4], or NULL. */
static tw_status make_linear(ply_file *file, const ply_colors *all, bool has_alpha, size_t count,
                             float *colors) {
  enum { COLORS_A_STEP = 4096 };
  bool are_bytes = !all->are_fractions && all->beyond > 0;
  if (!colors) return TW_OK;
  for (size_t i = 0; i < count; i++) {
    float *color = colors + 4 * i, alpha = are_bytes && has_alpha ? color[3] / 255 : color[3];
    for (int c = 0; c < 3; c++) color[c] = tw_linear_from_srgb(are_bytes ? color[c] / 255 : color[c]);
    color[3] = fminf(fmaxf(alpha, 0), 1);
    if (i % COLORS_A_STEP == COLORS_A_STEP - 1 && !tw_work(COLORS_A_STEP)) return tw_work_status(file->error);
  }
  tw_lose(&file->losses, "number of a colour is divided by 255: all are whole, some over 1",
          "numbers of colours are divided by 255: all are whole, some over 1", are_bytes ? all->count : 0, 0);
  tw_lose(&file->losses, "number of a colour is brought into 0 to 1",
          "numbers of colours are brought into 0 to 1", are_bytes ? 0 : all->beyond, 0);
  return TW_OK;
}

/* Stores a number of vertex `row`. */
static tw_status take_number(ply_file *file, const ply_property *property, double value, size_t row,
                             tw_polygons_read *out) {
  float single = (float)value;
  ply_use use = property->use;
  if (!isfinite(single) && use < PLY_U)
    return tw_fail(file->error, TW_INVALID, "vertex %zu: a number is not finite", row);
  if (use <= PLY_Z)
    out->positions[3 * row + use] = single;
  else if (use <= PLY_ALPHA)
    out->colors[4 * row + use - PLY_RED] = share_of(property, value, &file->vertex_colors);
  else if (use <= PLY_V)
    out->uvs[2 * row + use - PLY_U] = single;
  else
    out->normals[3 * row + use - PLY_NX] = single;
  return TW_OK;
}

static tw_status check_corner(const ply_file *file, double vertex, const tw_polygons_read *out) {
  if (vertex >= 0 && vertex < out->vertex_count && vertex == floor(vertex)) return TW_OK;
  return tw_fail(file->error, TW_INVALID, "face %u: an index is not %s %u %s", out->face_count,
                 tw_plural(out->vertex_count, "that of the", "one of the"), out->vertex_count,
                 tw_plural(out->vertex_count, "vertex", "vertices"));
}

static void end_face(tw_polygons_read *out) {
  out->face_offsets[++out->face_count] = out->corner_count;
}

/* Ends a strip, after which another one may begin in the same row. */
static void end_strip(ply_file *file) {
  tw_lose(&file->losses, "strip has fewer than three corners, and so no triangle",
          "strips have fewer than three corners, and so no triangles",
          file->row.strip_count > 0 && file->row.strip_count < 3, 0);
  file->row.strip_count = 0;
}

/* Adds a corner to a strip; -1 begins another one. Triangles without area join strips. */
static tw_status take_strip_corner(ply_file *file, double value, tw_polygons_read *out) {
  ply_row *row = &file->row;
  if (value == -1 || value == UINT32_MAX) {
    end_strip(file);
    return TW_OK;
  }
  tw_status status = check_corner(file, value, out);
  if (status != TW_OK) return status;
  uint32_t a = row->strip[0], b = row->strip[1], c = (uint32_t)value;
  bool is_odd = row->strip_count % 2 == 1;
  if (row->strip_count >= 2 && a != b && b != c && c != a) {
    const uint32_t corners[3] = {a, is_odd ? c : b, is_odd ? b : c};
    memcpy(out->corners + out->corner_count, corners, sizeof corners);
    out->corner_count += 3;
    end_face(out);
  }
  row->strip[0] = b;
  row->strip[1] = c;
  row->strip_count++;
  return TW_OK;
}

/* Stores a number of a face's texture coordinates, two for each corner. Numbers of more corners than the face
 * may have are only counted. */
static void take_wedge(ply_file *file, double value, uint64_t capacity, tw_polygons_read *out) {
  uint64_t place = 2 * (uint64_t)file->row.first_corner + file->row.wedge_values++;
  bool is_usable = fabs(value) <= (double)TW_COORDINATE_MAX;
  if (place < 2 * capacity) out->corner_uvs[place] = is_usable ? (float)value : 0;
  tw_lose(&file->losses, "texture coordinate is 0: it is no number up to 1e18",
          "texture coordinates are 0: they are no numbers up to 1e18", !is_usable, 0);
}

static tw_status take_value(ply_file *file, const ply_element *element, const ply_property *property,
                            double value, size_t row, const ply_counts *counts, tw_polygons_read *out) {
  if (element->kind == PLY_STRIPS) return take_strip_corner(file, value, out);
  if (element->kind == PLY_VERTICES) return take_number(file, property, value, row, out);
  if (property->use == PLY_WEDGES) {
    take_wedge(file, value, counts->corners, out);
  } else if (property->use == PLY_CORNERS) {
    tw_status status = check_corner(file, value, out);
    if (status != TW_OK) return status;
    out->corners[out->corner_count++] = (uint32_t)value;
  } else {
    file->row.color[property->use - PLY_RED] = share_of(property, value, &file->face_colors);
  }
  return TW_OK;
}

/* Gives the corners of a row of faces or strips their texture coordinates and colour. */
static void end_corners(ply_file *file, const ply_element *element, tw_polygons_read *out) {
  const ply_row *row = &file->row;
  size_t first = row->first_corner, count = out->corner_count - first;
  if (out->corner_uvs && (element->kind == PLY_STRIPS || row->wedge_values != 2 * count)) {
    memset(out->corner_uvs + 2 * first, 0, 2 * count * sizeof(float));
    tw_lose(&file->losses, "face has texture coordinates 0 0: it has not two numbers a corner",
            "faces have texture coordinates 0 0: they have not two numbers a corner", 1, 0);
  }
  for (size_t c = first; out->corner_colors && c < out->corner_count; c++)
    memcpy(out->corner_colors + 4 * c, row->color, sizeof row->color);
}

/* Completes a vertex, face or strip whose numbers are all read. */
static void end_row(ply_file *file, const ply_element *element, size_t row, tw_polygons_read *out) {
  if (element->kind != PLY_VERTICES) {
    if (element->kind == PLY_FACES)
      end_face(out);
    else
      end_strip(file);
    end_corners(file, element, out);
    return;
  }
  if (out->colors && !element->uses[PLY_ALPHA]) out->colors[4 * row + 3] = 1;
  float *uv = out->uvs ? out->uvs + 2 * row : NULL, *normal = out->normals ? out->normals + 3 * row : NULL;
  if (uv && !(fabsf(uv[0]) <= TW_COORDINATE_MAX && fabsf(uv[1]) <= TW_COORDINATE_MAX)) {
    uv[0] = uv[1] = 0;
    tw_lose(&file->losses, "texture coordinate is 0 0: it has no numbers up to 1e18",
            "texture coordinates are 0 0: they are no numbers up to 1e18", 1, 0);
  }
  if (!normal) return;
  tw_lose(&file->losses, TW_ZERO_NORMAL, TW_ZERO_NORMALS, normal[0] == 0 && normal[1] == 0 && normal[2] == 0,
          0);
  if (isfinite(normal[0]) && isfinite(normal[1]) && isfinite(normal[2])) return;
  normal[0] = normal[1] = normal[2] = 0; /* none */
  tw_lose(&file->losses, "normal is left out: it is not three finite numbers",
          "normals are left out: they are not three finite numbers", 1, 0);
}

/* Reads a row. out: NULL to skip it, or to count what it becomes only. */
static tw_status read_row(ply_file *file, const ply_element *element, size_t row, tw_polygons_read *out,
                          ply_counts *counts) {
  tw_status status = TW_OK;
  file->row = (ply_row){.first_corner = out ? out->corner_count : 0,
                        .color = {INFINITY, INFINITY, INFINITY, INFINITY}};
  for (uint32_t i = 0; i < element->property_count && status == TW_OK; i++) {
    const ply_property *property = &file->properties[element->first_property + i];
    uint64_t count = 1;
    if (property->is_list) status = read_list_length(file, property, &count);
    if (!out && status == TW_OK && property->use == PLY_CORNERS) count_corners(element, count, counts);
    for (double value; status == TW_OK && count > 0; count--) {
      status = tw_work(1) ? read_value(file, property->type, &value) : tw_work_status(file->error);
      if (status != TW_OK || !out || property->use == PLY_UNUSED) continue;
      status = take_value(file, element, property, value, row, counts, out);
    }
  }
  if (status == TW_OK && out) end_row(file, element, row, out);
  return status;
}

/* Refuses more rows than the bytes can hold. */
static tw_status check_rows(const ply_file *file, const ply_element *element) {
  uint64_t size = least_size(file, element), left = (uint64_t)(file->end - file->at) + 1;
  if (size == 0 || element->count <= left / size) return TW_OK;
  return tw_fail(file->error, TW_SYNTAX, "the file is cut off: it is too short for the %llu %s of an element",
                 (unsigned long long)element->count, tw_plural(element->count, "row", "rows"));
}

/* Notes a row of text that ends within a line: the numbers behind it are those of the next row. */
static void lose_line(ply_file *file) {
  const uint8_t *at = file->at;
  while (at < file->end && is_blank((char)*at)) at++;
  tw_lose(&file->losses, "line has more numbers than its row: they are read as those of the next row",
          "lines have more numbers than their rows: they are read as those of the next rows",
          file->is_text && at < file->end && *at != '\n' && *at != '\r', file->line);
}

/* Reads all rows of all elements. out: NULL to count what they become, else *counts says it. */
static tw_status read_rows(ply_file *file, tw_polygons_read *out, ply_counts *counts) {
  for (uint32_t i = 0; i < file->element_count; i++) {
    const ply_element *element = &file->elements[i];
    tw_status status = check_rows(file, element);
    for (size_t row = 0; row < element->count && element->property_count > 0 && status == TW_OK; row++) {
      status = tw_work(ROW_STEPS)
                   ? read_row(file, element, row, element->kind == PLY_OTHERS ? NULL : out, counts)
                   : tw_work_status(file->error);
      if (out) lose_line(file);
    }
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* ---- the file -------------------------------------------------------------------------------- */

/* Allocates *out, [count][width], if the element has all properties from `first` to `last`. False without
 * memory. */
static bool make_column(const ply_element *element, ply_use first, ply_use last, uint64_t count, size_t width,
                        float **out) {
  if (!has_all(element, first, last)) return true;
  *out = tw_alloc((size_t)count, width * sizeof **out);
  return *out;
}

/* Walks through all rows to count faces and corners, then allocates the arrays. */
static tw_status make_room(ply_file *file, uint64_t budget, tw_arena *arena, ply_counts *counts,
                           tw_polygons_read *out) {
  const ply_element *vertices = find_element(file, PLY_VERTICES), *faces = find_element(file, PLY_FACES);
  if (!has_all(vertices, PLY_X, PLY_Z))
    return tw_fail(file->error, TW_INVALID, "there is no element vertex with x, y and z");
  tw_status status = read_rows(file, NULL, counts);
  if (status != TW_OK) return status;
  uint32_t values =
      (has_all(faces, PLY_WEDGES, PLY_WEDGES) ? 2u : 0u) + (has_all(faces, PLY_RED, PLY_BLUE) ? 4u : 0u);
  if (counts->corners >= UINT32_MAX ||
      tw_polygons_size(vertices->count, counts->corners, counts->faces, values) > budget)
    return tw_fail(file->error, TW_LIMIT, "so few bytes may not make so large a mesh");
  out->vertex_count = (uint32_t)vertices->count;
  out->face_offsets = tw_arena_alloc_raw(arena, (size_t)counts->faces + 1, sizeof(uint32_t));
  out->corners = tw_arena_alloc_raw(arena, (size_t)counts->corners, sizeof(uint32_t));
  bool is_made = out->face_offsets && out->corners &&
                 make_column(vertices, PLY_X, PLY_Z, vertices->count, 3, &out->positions) &&
                 make_column(vertices, PLY_RED, PLY_BLUE, vertices->count, 4, &out->colors) &&
                 make_column(vertices, PLY_U, PLY_V, vertices->count, 2, &out->uvs) &&
                 make_column(vertices, PLY_NX, PLY_NZ, vertices->count, 3, &out->normals) &&
                 make_column(faces, PLY_WEDGES, PLY_WEDGES, counts->corners, 2, &out->corner_uvs) &&
                 make_column(faces, PLY_RED, PLY_BLUE, counts->corners, 4, &out->corner_colors);
  if (!is_made) return tw_fail(file->error, TW_NO_MEMORY, "out of memory");
  out->face_offsets[0] = 0;
  return TW_OK;
}

/* Names of what is not read: `size` bytes of text, and how many more there are. */
typedef struct ply_unread {
  char text[160];
  size_t size;
  uint32_t more;
} ply_unread;

/* Adds ELEMENT or ELEMENT.PROPERTY, as long as there is room. */
static void add_unread(ply_unread *unread, tw_word element, tw_word property) {
  size_t needed = 2 + element.length + 1 + property.length;
  if (needed >= sizeof unread->text - unread->size) {
    unread->more++;
    return;
  }
  char *out = unread->text + unread->size;
  int size = snprintf(out, sizeof unread->text - unread->size, "%s%.*s%s%.*s", unread->size > 0 ? ", " : "",
                      (int)element.length, element.text, property.length > 0 ? "." : "", (int)property.length,
                      property.length > 0 ? property.text : "");
  unread->size += (size_t)size;
}

static void warn_of_unread(const ply_file *file, tw_model *model) {
  ply_unread unread = {0};
  char more[32] = "";
  for (uint32_t i = 0; i < file->element_count; i++) {
    const ply_element *element = &file->elements[i];
    if (element->count == 0) continue;
    if (element->kind == PLY_OTHERS) add_unread(&unread, element->name, (tw_word){0});
    for (uint32_t k = 0; k < element->property_count && element->kind != PLY_OTHERS; k++) {
      const ply_property *property = &file->properties[element->first_property + k];
      if (property->use == PLY_UNUSED) add_unread(&unread, element->name, property->name);
    }
  }
  if (unread.size == 0 && unread.more == 0) return;
  if (unread.more > 0) snprintf(more, sizeof more, "%s%u more", unread.size > 0 ? " and " : "", unread.more);
  const char *names = unread.size > 0 ? tw_arena_name(model->arena, unread.text, unread.size) : "";
  if (names) tw_model_warn(model, "elements and properties that are left out: %s%s", names, more);
}

/* Notes what follows the last row. */
static void lose_rest(ply_file *file) {
  const uint8_t *at = file->at;
  while (file->is_text && at < file->end && (is_blank((char)*at) || *at == '\n' || *at == '\r')) at++;
  tw_lose(&file->losses, "byte behind the last element is left out",
          "bytes behind the last element are left out", (uint64_t)(file->end - at), 0);
}

bool tw_is_ply(const uint8_t *bytes, size_t size) {
  size_t first = tw_byte_order_mark(bytes, size);
  const uint8_t *word = bytes + first;
  return size - first >= 4 && memcmp(word, "ply", 3) == 0 &&
         (is_blank((char)word[3]) || word[3] == '\n' || word[3] == '\r');
}

/* Reads the coordinates of a vertex; its other numbers are passed over. */
static void read_exact_row(ply_file *file, const ply_element *element, double *out) {
  for (uint32_t i = 0; i < element->property_count; i++) {
    const ply_property *property = &file->properties[element->first_property + i];
    uint64_t count = 1;
    if (property->is_list && read_list_length(file, property, &count) != TW_OK) return;
    for (double value; count > 0 && read_value(file, property->type, &value) == TW_OK; count--)
      if (property->use <= PLY_Z) out[property->use] = value;
  }
}

/* Implements tw_read_exact. context: the ply_file, at its first row, whose rows were read without an error.
 */
static void read_exact(void *context, double *out) {
  ply_file *file = context;
  ply_counts ignored = {0};
  for (uint32_t i = 0; i < file->element_count; i++) {
    const ply_element *element = &file->elements[i];
    for (size_t row = 0; row < element->count && element->property_count > 0; row++)
      if (element->kind == PLY_VERTICES)
        read_exact_row(file, element, out + 3 * row);
      else
        read_row(file, element, row, NULL, &ignored);
    if (element->kind == PLY_VERTICES) return;
  }
}

static tw_status read_file(ply_file *file, tw_weld weld, uint64_t budget, tw_model *model) {
  tw_polygons_read read = {0};
  ply_counts counts = {0};
  tw_status status = read_header(file);
  const uint8_t *rows = file->at;
  uint64_t line = file->line;
  if (status == TW_OK) {
    settle_uses(file);
    status = make_room(file, budget, model->arena, &counts, &read);
    file->at = rows;
    file->line = line;
  }
  if (status == TW_OK) status = read_rows(file, &read, &counts);
  if (status == TW_OK)
    status = make_linear(file, &file->vertex_colors,
                         has_all(find_element(file, PLY_VERTICES), PLY_ALPHA, PLY_ALPHA), read.vertex_count,
                         read.colors);
  if (status == TW_OK)
    status =
        make_linear(file, &file->face_colors, has_all(find_element(file, PLY_FACES), PLY_ALPHA, PLY_ALPHA),
                    read.corner_count, read.corner_colors);
  if (status == TW_OK) lose_rest(file);
  file->at = rows;
  file->line = line;
  if (status == TW_OK) status = tw_polygons_enter_frame(&read, read_exact, file, file->error);
  if (status == TW_OK) status = tw_model_of_polygons(&read, weld, model, &file->losses, file->error);
  if (status == TW_OK) {
    warn_of_unread(file, model);
    tw_losses_tell(&file->losses, model);
  }
  tw_free(read.positions);
  tw_free(read.colors);
  tw_free(read.uvs);
  tw_free(read.normals);
  tw_free(read.corner_uvs);
  tw_free(read.corner_colors);
  return status;
}

tw_status tw_ply_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error) {
  tw_model *model = tw_model_create();
  ply_file *file = tw_alloc_zero(1, sizeof *file);
  tw_status status = model && file ? TW_OK : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) {
    model->format = TW_FORMAT_PLY;
    file->at = bytes + tw_byte_order_mark(bytes, size);
    file->end = bytes + size;
    file->error = error;
    status = read_file(file, weld, tw_reading_size(TW_FORMAT_PLY, size) - size, model);
  }
  tw_free(file);
  return tw_model_end(model, status, out, error);
}
