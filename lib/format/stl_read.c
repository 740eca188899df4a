/* STL, binary and text: triangles that share no points, for printers and from scanners. Normals follow from
 * the points. Sources: 3D Systems, StereoLithography Interface Specification, 1989; colours in the attribute
 * bytes as VisCAM and Magics write them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "quad_pairing.h"
#include "soup_mesh.h"
#include "tweend/format.h"
#include "word.h"

enum {
  HEADER = 84, /* bytes: 80 of text, then the count of facets */
  FACET = 50   /* bytes: a normal, three points, two more */
};

/* ---- binary ---------------------------------------------------------------------------------- */

/* How a binary file is laid out. */
typedef struct stl_layout {
  uint32_t facets;
  bool has_payload; /* the attribute bytes of a facet count more bytes behind them */
  uint64_t end;     /* of the facets; 0: this is no binary STL */
} stl_layout;

/* The end of facets that carry as many bytes as their attribute says; 0 if that is not the file's end. */
static uint64_t payload_end(const uint8_t *bytes, size_t size, uint32_t facets) {
  uint64_t at = HEADER;
  for (uint32_t f = 0; f < facets; f++) {
    if (at + FACET > size) return 0;
    at += FACET + tw_read_u16(bytes + at + FACET - 2);
  }
  return at == size ? at : 0;
}

/* Whether bytes are facets of finite numbers. */
static bool are_facets(const uint8_t *bytes, uint64_t size) {
  if (size == 0 || size % FACET != 0) return false;
  for (uint64_t at = 0; at < size; at += FACET)
    for (size_t i = 0; i < 12; i++)
      if (!isfinite(tw_read_f32(bytes + at + 4 * i))) return false;
  return true;
}

/* Recognises a file by its size. The same bytes of STL text, read as a count, ask for far more than the file
 * has. Some tools append a little behind the facets, and some count too few of them. */
static stl_layout find_layout(const uint8_t *bytes, size_t size) {
  enum { MORE_MAX = 1024 };
  if (size < HEADER) return (stl_layout){0};
  stl_layout layout = {.facets = tw_read_u32(bytes + HEADER - 4)};
  uint64_t end = HEADER + (uint64_t)layout.facets * FACET;
  if (size < end) return layout;
  uint64_t more = size - end;
  if (more > 0 && payload_end(bytes, size, layout.facets) > 0) {
    layout.has_payload = true;
    end = size;
  } else if ((more > MORE_MAX || (more > 0 && layout.facets == 0)) &&
             !are_facets(bytes + HEADER, size - HEADER)) {
    return layout;
  }
  layout.end = end;
  return layout;
}

static bool is_binary(const uint8_t *bytes, size_t size) {
  return find_layout(bytes, size).end > 0;
}

/* How the attribute bytes of facets tell colours. */
typedef struct stl_colors {
  enum { STL_PLAIN, STL_VISCAM, STL_MAGICS } form;
  float usual[4]; /* linear: of facets without a colour of their own */
} stl_colors;

/* Magics writes COLOR= and four bytes into the header. Else bit 15 of a facet says that it has a colour. */
static stl_colors find_colors(const uint8_t *bytes, const stl_layout *layout) {
  stl_colors colors = {STL_PLAIN, {1, 1, 1, 1}};
  if (layout->has_payload) return colors;
  for (size_t i = 0; i + 10 <= HEADER - 4; i++) {
    if (memcmp(bytes + i, "COLOR=", 6) != 0) continue;
    colors.form = STL_MAGICS;
    for (size_t k = 0; k < 3; k++) colors.usual[k] = tw_linear_from_srgb((float)bytes[i + 6 + k] / 255);
    colors.usual[3] = (float)bytes[i + 9] / 255;
    return colors;
  }
  for (uint32_t f = 0; f < layout->facets && colors.form == STL_PLAIN; f++)
    if (bytes[HEADER + (size_t)(f + 1) * FACET - 1] & 0x80) colors.form = STL_VISCAM;
  return colors;
}

/* Five bits each: blue, green and red from the lowest on in VisCAM's form; red, green and blue in that of
 * Magics, where bit 15 says that the facet has no colour of its own. */
static void facet_color(const stl_colors *colors, uint32_t attribute, float out[4]) {
  bool is_magics = colors->form == STL_MAGICS;
  memcpy(out, colors->usual, sizeof colors->usual);
  if (((attribute & 0x8000) != 0) == is_magics) return;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t value = attribute >> 5 * (is_magics ? k : 2 - k) & 31;
    out[k] = tw_linear_from_srgb((float)value / 31);
  }
}

/* Whether a facet's normal points to the side from which its corners run clockwise. */
static bool points_back(const float normal[3], const float p[9]) {
  double a[3], b[3], dot = 0, own = 0, of_points = 0;
  for (int k = 0; k < 3; k++) {
    a[k] = (double)p[3 + k] - (double)p[k];
    b[k] = (double)p[6 + k] - (double)p[k];
  }
  for (int k = 0; k < 3; k++) {
    double cross = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    dot += cross * (double)normal[k];
    own += (double)normal[k] * (double)normal[k];
    of_points += cross * cross;
  }
  return dot < 0 && dot * dot > 0.25 * own * of_points; /* slivers may point anywhere */
}

/* Notes a normal that is not what the corners of its facet say. 0 0 0 means that these count. */
static void check_normal(const float normal[3], const float points[9], uint64_t line, tw_losses *losses) {
  bool is_finite = isfinite(normal[0]) && isfinite(normal[1]) && isfinite(normal[2]);
  if (!is_finite)
    tw_lose(losses, "normal of a facet is no three finite numbers: the order of its corners counts",
            "normals of facets are no three finite numbers: the order of their corners counts", 1, line);
  else if (points_back(normal, points))
    tw_lose(losses, "normal of a facet points against the order of its corners: the order counts",
            "normals of facets point against the order of their corners: the order counts", 1, line);
}

/* Notes what the header, the attribute bytes and the bytes behind the facets hold beyond colours. */
static void lose_bytes(const uint8_t *bytes, size_t size, const stl_layout *layout, const stl_colors *colors,
                       tw_losses *losses) {
  uint64_t more = size - layout->end;
  for (size_t i = 0; i + 10 <= HEADER - 4 && colors->form == STL_MAGICS; i++)
    if (memcmp(bytes + i, "MATERIAL=", 9) == 0)
      tw_lose(losses, "material of the header is left out: its colour is kept",
              "materials of the header are left out: its colour is kept", 1, 0);
  if (are_facets(bytes + layout->end, more))
    tw_lose(losses, "facet is left out: it stands behind those that the file counts",
            "facets are left out: they stand behind those that the file counts", more / FACET, 0);
  else
    tw_lose(losses, "byte behind the facets is left out", "bytes behind the facets are left out", more, 0);
}

/* Reads facet f at `at`; returns where the next one begins. */
static tw_status read_facet(const uint8_t *at, uint32_t f, tw_polygons_read *out, tw_losses *losses,
                            tw_error *error) {
  float normal[3], *points = &out->positions[9 * (size_t)f];
  for (size_t i = 0; i < 3; i++) normal[i] = tw_read_f32(at + 4 * i);
  for (size_t i = 0; i < 9; i++) {
    points[i] = tw_read_f32(at + 12 + 4 * i);
    if (!isfinite(points[i])) return tw_fail(error, TW_INVALID, "facet %u: a coordinate is not finite", f);
  }
  check_normal(normal, points, 0, losses);
  out->face_offsets[f] = 3 * f;
  return TW_OK;
}

static tw_status read_binary(const uint8_t *bytes, size_t size, tw_polygons_read *out, tw_losses *losses,
                             tw_error *error) {
  enum { STEPS = 16 };
  const stl_layout layout = find_layout(bytes, size);
  const stl_colors colors = find_colors(bytes, &layout);
  uint64_t at = HEADER;
  if (colors.form != STL_PLAIN) {
    out->corner_colors = tw_alloc((size_t)layout.facets, 12 * sizeof(float));
    if (!out->corner_colors) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  for (uint32_t f = 0; f < layout.facets; f++) {
    tw_status status = tw_work(STEPS) ? read_facet(bytes + at, f, out, losses, error) : tw_work_status(error);
    if (status != TW_OK) return status;
    uint32_t attribute = tw_read_u16(bytes + at + FACET - 2);
    for (size_t k = 0; k < 3 && out->corner_colors; k++)
      facet_color(&colors, attribute, out->corner_colors + 12 * (size_t)f + 4 * k);
    bool is_color = colors.form == STL_MAGICS || (colors.form == STL_VISCAM && (attribute & 0x8000));
    tw_lose(losses, "facet has attributes that are left out", "facets have attributes that are left out",
            attribute != 0 && !is_color, 0);
    at += FACET + (layout.has_payload ? attribute : 0);
  }
  lose_bytes(bytes, size, &layout, &colors, losses);
  out->face_count = layout.facets;
  out->vertex_count = out->corner_count = 3 * layout.facets;
  return TW_OK;
}

/* ---- text ------------------------------------------------------------------------------------ */

typedef struct stl_text {
  const char *at, *end;
  uint64_t line; /* of `at`, from 1 */
} stl_text;

static stl_text text_of(const uint8_t *bytes, size_t size) {
  return (stl_text){(const char *)bytes + tw_byte_order_mark(bytes, size), (const char *)bytes + size, 1};
}

static bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

static void skip_space(stl_text *text) {
  for (; text->at < text->end && is_space(*text->at); text->at++) text->line += *text->at == '\n';
}

/* Reads the next word; length 0 at the end. */
static tw_word next_word(stl_text *text) {
  skip_space(text);
  const char *start = text->at;
  while (text->at < text->end && !is_space(*text->at)) text->at++;
  return (tw_word){start, (size_t)(text->at - start)};
}

/* Compares without regard to case. word: in lower case. */
static bool word_is(tw_word found, const char *word) {
  return found.length == strlen(word) && tw_word_begins(found, word);
}

/* The same, of a word of the format. Some write its ends as two words: "end loop". */
static tw_word next_keyword(stl_text *text) {
  static const char *const ends[][2] = {{"loop", "endloop"}, {"facet", "endfacet"}, {"solid", "endsolid"}};
  tw_word word = next_word(text);
  if (!word_is(word, "end")) return word;
  stl_text rest = *text;
  tw_word what = next_word(&rest);
  for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
    if (!word_is(what, ends[i][0])) continue;
    *text = rest;
    return (tw_word){ends[i][1], strlen(ends[i][1])};
  }
  return word;
}

static tw_status read_point(stl_text *text, float out[3], tw_error *error) {
  for (int i = 0; i < 3; i++) {
    double value;
    if (!tw_word_number(next_word(text), &value))
      return tw_fail_line(error, TW_SYNTAX, text->line, "a vertex needs 3 numbers");
    out[i] = (float)value;
    if (!isfinite(out[i]))
      return tw_fail_line(error, TW_INVALID, text->line, "a number is no finite 32-bit float");
  }
  return TW_OK;
}

static tw_status end_loop(tw_polygons_read *out, uint64_t line, tw_error *error) {
  uint32_t first = out->face_offsets[out->face_count];
  if (out->vertex_count - first < 3) return tw_fail_line(error, TW_SYNTAX, line, "a loop needs 3 vertices");
  out->face_offsets[++out->face_count] = out->vertex_count;
  return TW_OK;
}

/* Reads the normal of a facet, which holds for its loops. A number that is missing is NAN. */
static void read_normal(stl_text *text, float out[3]) {
  stl_text rest = *text;
  double value;
  for (int i = 0; i < 3; i++) out[i] = NAN;
  for (int i = 0; i < 3 && tw_word_number(next_word(&rest), &value); i++) {
    out[i] = (float)value;
    *text = rest;
  }
}

/* Reads the name of a solid, which goes to the end of its line. */
static tw_word read_name(stl_text *text) {
  while (text->at < text->end && (*text->at == ' ' || *text->at == '\t')) text->at++;
  const char *start = text->at;
  while (text->at < text->end && *text->at != '\n' && *text->at != '\r') text->at++;
  const char *end = text->at;
  while (end > start && is_space(end[-1])) end--;
  return (tw_word){start, (size_t)(end - start)};
}

/* Whether a text has the word unit or units. */
static bool says_unit(const char *text) {
  for (; *text; text++) {
    if (!tw_word_begins((tw_word){text, strlen(text)}, "unit")) continue;
    char next = (char)(text[4 + (text[4] == 's' || text[4] == 'S')] | 0x20);
    if (next < 'a' || next > 'z') return true;
  }
  return false;
}

/* Tells of the text of the header, but for the colours that are read, where it says more than who wrote the
 * file: STL has no other place for units. */
static void warn_of_header(const uint8_t *bytes, tw_model *model) {
  static const struct {
    const char *word;
    size_t size; /* with the bytes behind it */
  } colors[] = {{"COLOR=", 10}, {"MATERIAL=", 21}};
  enum { TEXT = HEADER - 4 };
  char text[TEXT + 1];
  size_t length = 0;
  for (size_t i = 0; i < TEXT; i++) {
    for (size_t k = 0; k < sizeof colors / sizeof *colors; k++)
      if (i + colors[k].size <= TEXT && memcmp(bytes + i, colors[k].word, strlen(colors[k].word)) == 0)
        i += colors[k].size;
    char c = ' ';
    if (i < TEXT && bytes[i] > ' ' && bytes[i] < 0x7F) c = (char)bytes[i];
    bool is_blank = c == ' ' || (c == ',' && (length == 0 || text[length - 1] == ' '));
    if (!is_blank) text[length++] = c;
    if (is_blank && length > 0 && text[length - 1] != ' ') text[length++] = ' ';
  }
  while (length > 0 && (text[length - 1] == ' ' || text[length - 1] == ',')) length--;
  text[length] = '\0';
  if (says_unit(text)) tw_model_warn(model, "the text of the header is left out: \"%s\"", text);
}

static const char no_stl[] = "this is neither text with a solid nor binary with all of its facets";

/* What STL text holds besides facets. */
typedef struct stl_solids {
  tw_word name;   /* of the first one that has one; length 0: none */
  tw_word own;    /* of the newest one */
  uint64_t count; /* how many begin */
} stl_solids;

/* Passes over a word that shapes nothing. */
static void skip_word(tw_word word, uint64_t line, tw_losses *losses) {
  static const char *const frames[] = {"facet", "outer", "endfacet"};
  for (size_t i = 0; i < sizeof frames / sizeof *frames; i++)
    if (word_is(word, frames[i])) return;
  tw_lose(losses, "word is left out: STL has none such", "words are left out: STL has none such", 1, line);
}

static void begin_solid(stl_text *text, stl_solids *solids) {
  solids->own = read_name(text);
  if (solids->name.length == 0) solids->name = solids->own;
  solids->count++;
}

/* The end of a solid may repeat its name. */
static void end_solid(stl_text *text, const stl_solids *solids, tw_losses *losses) {
  tw_word name = read_name(text), own = solids->own;
  bool is_same = name.length == own.length && memcmp(name.text, own.text, name.length) == 0;
  tw_lose(losses, "name behind endsolid is left out: its solid has another",
          "names behind endsolid are left out: their solids have others", name.length > 0 && !is_same,
          text->line);
}

enum { WORD_STEPS = 4 }; /* of tw_work */

static tw_status read_text(stl_text text, tw_polygons_read *out, stl_solids *solids, tw_losses *losses,
                           tw_error *error) {
  tw_status status = TW_OK;
  bool in_loop = false, has_end = false;
  float normal[3] = {0, 0, 0};
  out->face_offsets[0] = 0;
  while (status == TW_OK) {
    tw_word word = next_keyword(&text);
    if (word.length == 0) break;
    if (!tw_work(WORD_STEPS)) return tw_work_status(error);
    if (word_is(word, "vertex") && in_loop) {
      status = read_point(&text, out->positions + 3 * (size_t)out->vertex_count++, error);
    } else if (word_is(word, "endloop") && in_loop) {
      const float *points = out->positions + 3 * (size_t)out->face_offsets[out->face_count];
      status = end_loop(out, text.line, error);
      if (status == TW_OK) check_normal(normal, points, text.line, losses);
      in_loop = false;
    } else if (word_is(word, "loop") && !in_loop) {
      in_loop = true;
    } else if (word_is(word, "normal") && !in_loop) {
      read_normal(&text, normal);
    } else if (word_is(word, "solid")) {
      begin_solid(&text, solids);
    } else if (word_is(word, "endsolid")) {
      end_solid(&text, solids, losses);
      has_end = true;
    } else if (word_is(word, "vertex") || word_is(word, "endloop") || word_is(word, "loop")) {
      status = tw_fail_line(error, TW_SYNTAX, text.line, "%.*s is out of place", (int)word.length, word.text);
    } else {
      skip_word(word, text.line, losses);
    }
  }
  if (status == TW_OK && in_loop)
    status = tw_fail_line(error, TW_SYNTAX, text.line, "the file ends within a loop");
  if (status == TW_OK && out->face_count == 0 && !has_end) status = tw_fail(error, TW_SYNTAX, "%s", no_stl);
  out->corner_count = out->vertex_count;
  return status;
}

/* Implements tw_read_exact. file: the stl_text, which read_text has read without an error. */
static void read_exact(void *file, double *out) {
  stl_text text = *(stl_text *)file;
  for (tw_word word = next_keyword(&text); word.length > 0 && tw_work(WORD_STEPS);
       word = next_keyword(&text)) {
    if (word_is(word, "solid") || word_is(word, "endsolid")) read_name(&text);
    for (int i = 0; word_is(word, "vertex") && i < 3; i++) tw_word_number(next_word(&text), out++);
  }
}

/* ---- both ------------------------------------------------------------------------------------ */

bool tw_is_stl(const uint8_t *bytes, size_t size) {
  if (is_binary(bytes, size)) return true;
  stl_text text = text_of(bytes, size);
  return word_is(next_word(&text), "solid");
}

/* Allocates for the most that `size` bytes can hold. In text a vertex takes 12 bytes ("vertex 0 0 0") or
 * more, a facet 40: three vertices and two words. */
static bool make_room(const uint8_t *bytes, size_t size, bool binary, tw_arena *arena,
                      tw_polygons_read *out) {
  size_t facets = binary ? tw_read_u32(bytes + HEADER - 4) : size / 40;
  size_t vertices = binary ? 3 * facets : size / 12;
  if (vertices >= UINT32_MAX) return false;
  out->positions = tw_alloc(vertices + 1, 3 * sizeof(float));
  out->face_offsets = tw_arena_alloc_raw(arena, facets + 2, sizeof(uint32_t));
  return out->positions && out->face_offsets;
}

static tw_status number_corners(tw_polygons_read *read, tw_arena *arena, tw_error *error) {
  read->corners = tw_arena_alloc_raw(arena, read->corner_count, sizeof *read->corners);
  if (!read->corners) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t c = 0; c < read->corner_count; c++) read->corners[c] = c;
  read->face_offsets[read->face_count] = read->corner_count;
  return TW_OK;
}

static tw_status read_facets(const uint8_t *bytes, size_t size, tw_polygons_read *out, stl_solids *solids,
                             tw_losses *losses, tw_error *error) {
  return is_binary(bytes, size) ? read_binary(bytes, size, out, losses, error)
                                : read_text(text_of(bytes, size), out, solids, losses, error);
}

/* Nothing in an STL but the angles of its facets tells which edges are hard. */
static tw_status finish_mesh(tw_quads quads, tw_model *model, tw_error *error) {
  tw_mesh *mesh = model->meshes;
  mesh->angles_tell = true;
  if (tw_quads_of(quads, TW_FORMAT_STL) != TW_QUADS_AUTO) return TW_OK;
  tw_status status = tw_pair_triangles(mesh, model->arena, error);
  if (status == TW_OK) tw_warn_of_quads(model);
  return status;
}

tw_status tw_stl_read(const uint8_t *bytes, size_t size, tw_quads quads, tw_weld weld, tw_model **out,
                      tw_error *error) {
  if (!tw_is_stl(bytes, size)) return tw_fail(error, TW_SYNTAX, "%s", no_stl);
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_STL;
  tw_polygons_read read = {0};
  tw_losses losses = {0};
  stl_solids solids = {0};
  tw_status status = make_room(bytes, size, is_binary(bytes, size), model->arena, &read)
                         ? TW_OK
                         : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) status = read_facets(bytes, size, &read, &solids, &losses, error);
  if (status == TW_OK) status = number_corners(&read, model->arena, error);
  stl_text text = text_of(bytes, size);
  if (status == TW_OK)
    status = tw_polygons_enter_frame(&read, is_binary(bytes, size) ? NULL : read_exact, &text, error);
  if (status == TW_OK) status = tw_model_of_polygons(&read, weld, model, &losses, error);
  if (status == TW_OK) status = finish_mesh(quads, model, error);
  if (status == TW_OK && solids.name.length > 0) {
    model->meshes[0].name = tw_take_name(&losses, model->arena, solids.name.text, solids.name.length);
    if (!model->meshes[0].name) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  tw_lose(&losses, "solid is one mesh with the first one, and its name is left out",
          "solids are one mesh with the first one, and their names are left out",
          solids.count > 1 ? solids.count - 1 : 0, 0);
  if (status == TW_OK) tw_losses_tell(&losses, model);
  if (status == TW_OK && is_binary(bytes, size)) warn_of_header(bytes, model);
  tw_free(read.positions);
  tw_free(read.corner_colors);
  return tw_model_end(model, status, out, error);
}
