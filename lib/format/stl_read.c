/* STL, binary and text: triangles that share no points, for printers and from scanners. Normals are ignored:
 * they follow from the points. Source: 3D Systems, StereoLithography Interface Specification, 1989. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "soup_mesh.h"
#include "tweend/format.h"
#include "word.h"

enum {
  HEADER = 84, /* bytes: 80 of text, then the count of facets */
  FACET = 50   /* bytes: a normal, three points, two more */
};

/* ---- binary ------------------------------------------------------------------------------------- */

/* The size that the count of facets asks for. The same bytes of STL text, read as a count, ask for far more
 * than the file has. */
static uint64_t binary_size(const uint8_t *bytes) {
  return HEADER + (uint64_t)tw_read_u32(bytes + HEADER - 4) * FACET;
}

/* Some tools append a little behind the facets. */
static bool is_binary(const uint8_t *bytes, size_t size) {
  enum { MORE_MAX = 1024 };
  if (size < HEADER || size < binary_size(bytes)) return false;
  size_t more = size - (size_t)binary_size(bytes);
  return more == 0 || (more <= MORE_MAX && binary_size(bytes) > HEADER);
}

static tw_status read_binary(const uint8_t *bytes, tw_polygons_read *out, tw_error *error) {
  uint32_t facets = tw_read_u32(bytes + HEADER - 4);
  for (uint32_t f = 0; f < facets; f++) {
    const uint8_t *points = bytes + HEADER + (size_t)f * FACET + 3 * sizeof(float);
    for (size_t i = 0; i < 9; i++) {
      uint32_t bits = tw_read_u32(points + 4 * i);
      float *value = &out->positions[9 * (size_t)f + i];
      memcpy(value, &bits, sizeof bits);
      if (!isfinite(*value)) return tw_fail(error, TW_INVALID, "facet %u: a coordinate is not finite", f);
    }
    out->face_offsets[f] = 3 * f;
  }
  out->face_count = facets;
  out->vertex_count = out->corner_count = 3 * facets;
  return TW_OK;
}

/* ---- text --------------------------------------------------------------------------------------- */

typedef struct stl_text {
  const char *at, *end;
  uint64_t line; /* of `at`, from 1 */
} stl_text;

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

/* Reads the name of a solid, which goes to the end of its line. */
static tw_word read_name(stl_text *text) {
  while (text->at < text->end && (*text->at == ' ' || *text->at == '\t')) text->at++;
  const char *start = text->at;
  while (text->at < text->end && *text->at != '\n' && *text->at != '\r') text->at++;
  const char *end = text->at;
  while (end > start && is_space(end[-1])) end--;
  return (tw_word){start, (size_t)(end - start)};
}

static const char no_stl[] = "this is neither text with a solid nor binary with all of its facets";

/* What STL text holds besides facets. */
typedef struct stl_solids {
  tw_word name;   /* of the first one that has one; length 0: none */
  uint32_t names; /* how many more solids have a name */
} stl_solids;

static tw_status read_text(stl_text text, tw_polygons_read *out, stl_solids *solids, tw_error *error) {
  tw_status status = TW_OK;
  bool in_loop = false, has_end = false;
  out->face_offsets[0] = 0;
  while (status == TW_OK) {
    tw_word word = next_word(&text);
    if (word.length == 0) break;
    if (word_is(word, "vertex") && in_loop) {
      status = read_point(&text, out->positions + 3 * (size_t)out->vertex_count++, error);
    } else if (word_is(word, "endloop") && in_loop) {
      status = end_loop(out, text.line, error);
      in_loop = false;
    } else if (word_is(word, "loop") && !in_loop) {
      in_loop = true;
    } else if (word_is(word, "solid")) {
      tw_word name = read_name(&text);
      if (solids->name.length == 0)
        solids->name = name;
      else
        solids->names += name.length > 0;
    } else if (word_is(word, "endsolid")) {
      read_name(&text);
      has_end = true;
    } else if (word_is(word, "vertex") || word_is(word, "endloop") || word_is(word, "loop")) {
      status = tw_fail_line(error, TW_SYNTAX, text.line, "%.*s is out of place", (int)word.length, word.text);
    } /* facet, its normal, outer and endfacet are ignored */
  }
  if (status == TW_OK && in_loop)
    status = tw_fail_line(error, TW_SYNTAX, text.line, "the file ends within a loop");
  if (status == TW_OK && out->face_count == 0 && !has_end) status = tw_fail(error, TW_SYNTAX, "%s", no_stl);
  out->corner_count = out->vertex_count;
  return status;
}

/* ---- both --------------------------------------------------------------------------------------- */

bool tw_is_stl(const uint8_t *bytes, size_t size) {
  if (is_binary(bytes, size)) return true;
  stl_text text = {(const char *)bytes, (const char *)bytes + size, 1};
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

tw_status tw_stl_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error) {
  if (!tw_is_stl(bytes, size)) return tw_fail(error, TW_SYNTAX, "%s", no_stl);
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_STL;
  tw_polygons_read read = {0};
  stl_solids solids = {0};
  bool binary = is_binary(bytes, size);
  tw_status status = make_room(bytes, size, binary, model->arena, &read)
                         ? TW_OK
                         : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK)
    status = binary ? read_binary(bytes, &read, error)
                    : read_text((stl_text){(const char *)bytes, (const char *)bytes + size, 1}, &read,
                                &solids, error);
  if (status == TW_OK) status = number_corners(&read, model->arena, error);
  if (status == TW_OK) status = tw_model_of_polygons(&read, weld, model, error);
  if (status == TW_OK && solids.name.length > 0) {
    model->meshes[0].name = tw_arena_name(model->arena, solids.name.text, solids.name.length);
    if (!model->meshes[0].name) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  if (solids.names > 0)
    tw_model_warn(model, "all solids are one mesh: the names of %u of them are left out", solids.names);
  tw_free(read.positions);
  return tw_model_end(model, status, out, error);
}
