/* The statements of the polygonal part of Wavefront OBJ. Two passes over the text: the first one counts, so
 * that the second one writes straight into arrays of the model's arena that have the right size. Source:
 * Wavefront Advanced Visualizer file formats, appendix B1. */
#include "obj_statements.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "array.h"
#include "hash.h"
#include "sorted.h"
#include "soup_mesh.h"
#include "tweend/format.h"

/* ---- names ----------------------------------------------------------------------------------- */

/* Over the words of a name, a blank behind each. */
static uint64_t hash_name(tw_word name) {
  uint64_t hash = TW_HASH_BEGIN;
  tw_obj_text text = tw_obj_text_of(name);
  for (tw_word word = tw_obj_read_word(&text); word.length > 0; word = tw_obj_read_word(&text)) {
    for (size_t i = 0; i < word.length; i++) hash = tw_hash_add(hash, (uint8_t)word.text[i]);
    hash = tw_hash_add(hash, ' ');
  }
  return tw_hash_end(hash);
}

/* Whether two names have the same words; what separates the words does not matter. */
static bool same_name(tw_word a, tw_word b) {
  if (a.length == b.length && memcmp(a.text, b.text, a.length) == 0) return true;
  tw_obj_text left = tw_obj_text_of(a), right = tw_obj_text_of(b);
  for (;;) {
    a = tw_obj_read_word(&left);
    b = tw_obj_read_word(&right);
    if (a.length != b.length || memcmp(a.text, b.text, a.length) != 0) return false;
    if (a.length == 0) return true;
  }
}

/* The slot that holds `name`, or the free slot where it belongs. NULL after 256 probes: half of the slots are
 * free, so only names that were made to collide need as many. */
static uint32_t *find_slot(const tw_obj_names *table, tw_word name) {
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

/* Doubles names and slots; at most half of the slots are taken. */
static tw_status grow_names(tw_obj_names *table, tw_error *error) {
  size_t capacity = table->capacity ? table->capacity * 2 : 32;
  tw_word *grown = tw_resize(table->names, capacity * sizeof *grown);
  if (grown) table->names = grown;
  uint32_t *slots = tw_alloc_zero(capacity * 2, sizeof *slots);
  if (!grown || !slots) {
    tw_free(slots);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  tw_free(table->slots);
  table->slots = slots;
  table->capacity = capacity;
  for (size_t i = 0; i < table->count; i++) {
    uint32_t *slot = find_slot(table, grown[i]);
    if (!slot) return fail_colliding(error);
    *slot = (uint32_t)i + 1;
  }
  return TW_OK;
}

/* Finds the number of a name; a new name gets the next number, or TW_OBJ_NO_NAME if there are `most`
 * already. */
static tw_status number_name(tw_obj_names *table, tw_word name, uint32_t most, uint32_t *out,
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
  tw_free(table->names);
  tw_free(table->slots);
}

/* ---- the reader ------------------------------------------------------------------------------ */

void tw_obj_reader_deinit(tw_obj_reader *reader) {
  tw_free(reader->exact);
  tw_free(reader->uvs);
  tw_free(reader->dropped);
  tw_free(reader->objects);
  names_deinit(&reader->material_names);
  names_deinit(&reader->group_names);
  names_deinit(&reader->idle_groups);
}

tw_status tw_obj_fail_memory(const tw_obj_reader *reader) {
  return tw_fail(reader->error, TW_NO_MEMORY, "out of memory");
}

/* ---- v, vt, vn ------------------------------------------------------------------------------- */

/* Reads up to `most` numbers of this statement; *count: how many. A number too large for a float becomes
 * infinity. */
static tw_status read_numbers(tw_obj_text *text, float *out, size_t most, size_t *count, tw_error *error) {
  *count = 0;
  while (*count < most && !tw_obj_statement_ends(text)) {
    double value;
    if (!tw_obj_read_number(text, &value)) return tw_obj_fail_word(text, "number", error);
    out[(*count)++] = (float)value;
  }
  return TW_OK;
}

/* Stores the colour of a point as it is written, in sRGB. Points without a colour have alpha 0 until their
 * mesh is made. */
static tw_status set_color(tw_obj_reader *reader, uint64_t point, const float *rgb) {
  if (!reader->colors) {
    size_t count = (size_t)reader->all.points * 4;
    reader->colors = tw_arena_alloc(reader->arena, count, sizeof(float));
    if (!reader->colors) return tw_obj_fail_memory(reader);
  }
  reader->colors[4 * point + 3] = 1;
  memcpy(reader->colors + 4 * point, rgb, 3 * sizeof *rgb);
  return TW_OK;
}

/* Passes over what is left of a statement. one, many: as of tw_lose, if something is. */
static void leave_rest(tw_obj_reader *reader, tw_obj_text *text, const char *one, const char *many) {
  if (!tw_obj_statement_ends(text)) tw_lose(&reader->losses, one, many, 1, text->line);
}

/* v x y z, v x y z w, v x y z r g b or v x y z r g b a. The weight w, which belongs to curves, and alpha are
 * left out. */
static tw_status read_point(tw_obj_reader *reader, tw_obj_text *text) {
  float values[7];
  size_t count;
  uint64_t line = text->line, point = reader->read.points++;
  tw_status status = read_numbers(text, values, 7, &count, reader->error);
  if (status != TW_OK) return status;
  if (count < 3 || count == 5)
    return tw_fail_line(reader->error, TW_SYNTAX, line,
                        "a point needs 3 coordinates, and 3 more numbers for a colour");
  for (size_t i = 0; i < count; i++)
    if (!isfinite(values[i]))
      return tw_fail_line(reader->error, TW_INVALID, line, "a number is no finite 32-bit float");
  memcpy(reader->positions + 3 * point, values, 3 * sizeof(float));
  bool has_weight = count == 4 && values[3] != 1, has_alpha = count == 7 && values[6] != 1;
  tw_lose(&reader->losses, "weight of a point is left out: it belongs to a curve",
          "weights of points are left out: they belong to curves", has_weight, line);
  tw_lose(&reader->losses, "alpha of a colour is left out", "alphas of colours are left out", has_alpha,
          line);
  if (count == 7)
    leave_rest(reader, text, "point has numbers behind its colour, which are left out",
               "points have numbers behind their colour, which are left out");
  return count >= 6 ? set_color(reader, point, values + 3) : TW_OK;
}

static tw_status lose_colors(tw_obj_reader *reader, const tw_obj_text *text) {
  tw_lose(&reader->losses,
          "line of colours (#MRGB) is not read to its end: no colour or no point is left there",
          "lines of colours (#MRGB) are not read to their ends: no colours or no points are left there", 1,
          text->line);
  return TW_OK;
}

static bool read_hex(const char *digits, uint32_t *out) {
  int high = tw_hex_digit(digits[0]), low = tw_hex_digit(digits[1]);
  *out = (uint32_t)(16 * high + low);
  return high >= 0 && low >= 0;
}

/* #MRGB MMRRGGBBMMRRGGBB...: mask and colour of the next points, in hexadecimal. A comment cannot be
 * malformed: reading stops where a colour should stand and does not. The mask, which holds back ZBrush's
 * brushes, is left out. */
static tw_status read_colors(tw_obj_reader *reader, tw_obj_text *text) {
  tw_word word = tw_obj_read_word(text);
  tw_status status;
  size_t i = 0;
  for (; i + 8 <= word.length && reader->painted_points < reader->all.points; i += 8) {
    float rgb[3];
    uint32_t mask;
    for (size_t c = 0; c < 3; c++) {
      uint32_t value;
      if (!read_hex(word.text + i + 2 + 2 * c, &value)) return lose_colors(reader, text);
      rgb[c] = (float)value / 255;
    }
    tw_lose(&reader->losses, "mask of a point is left out", "masks of points are left out",
            read_hex(word.text + i, &mask) && mask != 255, text->line);
    status = set_color(reader, reader->painted_points++, rgb);
    if (status != TW_OK) return status;
  }
  return i < word.length ? lose_colors(reader, text) : TW_OK;
}

/* vt u, vt u v or vt u v w. Coordinates that are not finite, as photogrammetry tools write them, or over
 * TW_COORDINATE_MAX become 0 0. */
static tw_status read_uv(tw_obj_reader *reader, tw_obj_text *text) {
  float values[3] = {0, 0, 0};
  size_t count;
  uint64_t line = text->line, uv = reader->read.uvs++;
  tw_status status = read_numbers(text, values, 3, &count, reader->error);
  if (status != TW_OK) return status;
  if (count == 0) return tw_fail_line(reader->error, TW_SYNTAX, line, "a texture coordinate needs a number");
  bool is_usable = fabsf(values[0]) <= TW_COORDINATE_MAX && fabsf(values[1]) <= TW_COORDINATE_MAX;
  tw_lose(&reader->losses, "texture coordinate is 0 0: it has no numbers up to 1e18",
          "texture coordinates are 0 0: they are no numbers up to 1e18", !is_usable, line);
  tw_lose(&reader->losses, "third texture coordinate is left out: pictures have two",
          "third texture coordinates are left out: pictures have two", values[2] != 0, line);
  if (count == 3)
    leave_rest(reader, text, "texture coordinate has numbers that are left out",
               "texture coordinates have numbers that are left out");
  memcpy(reader->uvs + 2 * uv, is_usable ? values : (const float[2]){0, 0}, 2 * sizeof(float));
  return TW_OK;
}

/* vn x y z. Normals do not shape the surface: one that is malformed or not finite becomes 0 0 0, which means
 * none, as it does where it is written. */
static void read_normal(tw_obj_reader *reader, tw_obj_text *text) {
  float *out = reader->normals + 3 * reader->read.normals++;
  uint64_t line = text->line;
  for (int i = 0; i < 3; i++) {
    double value;
    bool is_read = tw_obj_read_number(text, &value);
    out[i] = is_read ? (float)value : NAN;
    if (isfinite(out[i])) continue;
    memset(out, 0, 3 * sizeof *out);
    tw_lose(&reader->losses, "normal is left out: it is not three finite numbers",
            "normals are left out: they are not three finite numbers", 1, line);
    return;
  }
  tw_lose(&reader->losses, TW_ZERO_NORMAL, TW_ZERO_NORMALS, out[0] == 0 && out[1] == 0 && out[2] == 0, line);
  leave_rest(reader, text, "normal has numbers that are left out", "normals have numbers that are left out");
}

/* ---- f --------------------------------------------------------------------------------------- */

/* Reads an OBJ index, which counts from 1, or back from the newest element if negative, as an index from 0.
 * so_far: elements before this statement. all: elements of the file; some are named before they are
 * defined. */
static tw_status read_index(tw_obj_text *text, uint64_t so_far, uint64_t all, const char *one,
                            const char *many, uint32_t *out, tw_error *error) {
  int64_t index;
  if (!tw_obj_read_integer(text, &index)) return tw_obj_fail_word(text, "corner of a face", error);
  if (index == 0) return tw_fail_line(error, TW_INVALID, text->line, "index 0: they start from 1");
  if (index < 0 && (uint64_t)-index > so_far)
    return tw_fail_line(error, TW_INVALID, text->line, "index %lld is out of range: there %s %llu so far",
                        (long long)index, tw_plural(so_far, "is", "are"), (unsigned long long)so_far);
  if (index > 0 && (uint64_t)index > all)
    return tw_fail_line(error, TW_INVALID, text->line, "index %lld is out of range: the file has %llu %s",
                        (long long)index, (unsigned long long)all, tw_plural(all, one, many));
  *out = (uint32_t)(index > 0 ? (uint64_t)index - 1 : so_far - (uint64_t)-index);
  return TW_OK;
}

/* The same of a texture coordinate or normal. Of a file that has none at all the index means nothing: it is
 * read, counted and left out. */
static tw_status read_value_index(tw_obj_reader *reader, tw_obj_text *text, uint64_t so_far, uint64_t all,
                                  const char *one, const char *many, const char *loss, const char *losses,
                                  uint32_t *out) {
  int64_t ignored;
  if (all > 0) return read_index(text, so_far, all, one, many, out, reader->error);
  if (!tw_obj_read_integer(text, &ignored)) return tw_obj_fail_word(text, "corner of a face", reader->error);
  tw_lose(&reader->losses, loss, losses, 1, 0);
  return TW_OK;
}

static bool ends_corner(const tw_obj_text *text) {
  if (text->at == text->end) return true;
  uint8_t c = *text->at;
  return c <= ' ' || c == '#' || c == '\\';
}

typedef struct obj_corner {
  uint32_t point, uv, normal;
} obj_corner;

/* p, p/t, p//n or p/t/n. */
static tw_status read_corner(tw_obj_reader *reader, tw_obj_text *text, obj_corner *out) {
  const tw_obj_counts *read = &reader->read, *all = &reader->all;
  tw_error *error = reader->error;
  out->uv = out->normal = TW_OBJ_NO_VALUE;
  tw_status status = read_index(text, read->points, all->points, "point", "points", &out->point, error);
  if (status == TW_OK && tw_obj_take_slash(text)) {
    if (text->at < text->end && *text->at != '/' && !ends_corner(text))
      status = read_value_index(
          reader, text, read->uvs, all->uvs, "texture coordinate", "texture coordinates",
          "face corner names a texture coordinate, but the file has no vt: left out",
          "face corners name a texture coordinate, but the file has no vt: left out", &out->uv);
    if (status == TW_OK && tw_obj_take_slash(text) && !ends_corner(text)) /* some write p// and p/t/ */
      status = read_value_index(reader, text, read->normals, all->normals, "normal", "normals",
                                "face corner names a normal, but the file has no vn: left out",
                                "face corners name a normal, but the file has no vn: left out", &out->normal);
  }
  if (status != TW_OK || ends_corner(text)) return status;
  return tw_obj_fail_word(text, "corner of a face", error);
}

/* [count] elements in the arena that all say "none". */
static uint32_t *allocate_none(const tw_obj_reader *reader, uint64_t count) {
  uint32_t *out = tw_arena_alloc_raw(reader->arena, (size_t)count, sizeof *out);
  if (out) memset(out, 0xFF, (size_t)count * sizeof *out);
  return out;
}

/* Stores the UV or normal of a corner. The array is allocated at the first corner that has one. */
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
  tw_status status = set_value(reader, &reader->corner_uvs, corner, added->uv);
  return status == TW_OK ? set_value(reader, &reader->corner_normals, corner, added->normal) : status;
}

/* Labels the newest face with its material, groups or smoothing group. The array is allocated at the first
 * face that has a label. */
static tw_status label_face(const tw_obj_reader *reader, uint32_t **labels, uint32_t label) {
  if (!*labels && label == TW_OBJ_NO_NAME) return TW_OK;
  if (!*labels) *labels = allocate_none(reader, reader->all.faces);
  if (!*labels) return tw_obj_fail_memory(reader);
  (*labels)[reader->read.faces] = label;
  return TW_OK;
}

/* Numbers the set of groups of the newest face. Beyond TW_OBJ_GROUPS_MAX sets the face is in none. */
static tw_status number_groups(tw_obj_reader *reader) {
  if (reader->group_words.length == 0) return TW_OK;
  tw_status status = number_name(&reader->group_names, reader->group_words, TW_OBJ_GROUPS_MAX, &reader->group,
                                 reader->error);
  tw_lose(&reader->losses, "set of groups is left out: 262144 are kept",
          "sets of groups are left out: 262144 are kept", status == TW_OK && reader->group == TW_OBJ_NO_NAME,
          0);
  reader->group_words.length = 0;
  return status;
}

/* Drops the newest face's corners that are at the same point as the corner before them. Returns how many
 * stay. */
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

/* Whether a face has three different points. Its neighbouring corners are different already. */
static bool has_three_points(const uint32_t *corners, uint64_t count) {
  for (uint64_t i = 2; i < count; i++)
    if (corners[i] != corners[0] && corners[i] != corners[1]) return true;
  return false;
}

/* Drops the newest face and keeps its number in the file, because `hole` tags count dropped faces too. */
static tw_status drop_face(tw_obj_reader *reader, uint64_t first_corner) {
  uint64_t count = reader->dropped_count;
  uint32_t *dropped = tw_array_grow(reader->dropped, count, sizeof *dropped, &reader->dropped_room);
  if (!dropped) return tw_obj_fail_memory(reader);
  reader->dropped = dropped;
  reader->dropped[reader->dropped_count++] = (uint32_t)(reader->read.faces + count);
  reader->read.corners = first_corner;
  tw_lose(&reader->losses, TW_COLLAPSED_FACE, TW_COLLAPSED_FACES, 1, 0);
  return TW_OK;
}

/* Sets the final counts of faces and corners, and renumbers holes from faces of the file to faces that are
 * kept. */
static void settle_faces(tw_obj_reader *reader) {
  tw_obj_tags *tags = &reader->tags;
  reader->all.faces = reader->read.faces;
  reader->all.corners = reader->read.corners;
  if (reader->all.faces == 0) reader->face_offsets[0] = 0;
  uint64_t kept = 0;
  for (uint64_t i = 0; i < tags->read.holes && reader->dropped_count > 0; i++) {
    uint32_t count = (uint32_t)reader->dropped_count,
             before =
                 tw_lower_bound(reader->dropped, count, tags->holes[i]); /* faces dropped before this hole */
    bool is_dropped = before < count && reader->dropped[before] == tags->holes[i];
    if (!is_dropped) tags->holes[kept++] = tags->holes[i] - before;
  }
  if (reader->dropped_count > 0) tags->read.holes = kept;
}

static tw_status read_face(tw_obj_reader *reader, tw_obj_text *text) {
  uint64_t first = reader->read.corners;
  tw_status status = TW_OK;
  while (status == TW_OK && !tw_obj_statement_ends(text)) {
    obj_corner corner;
    status = read_corner(reader, text, &corner);
    if (status == TW_OK) status = add_corner(reader, &corner);
  }
  if (status != TW_OK) return status;
  uint64_t named = reader->read.corners - first, count = named > 0 ? drop_doubled_corners(reader, first) : 0;
  if (count < 3 || !has_three_points(reader->corners + first, count)) return drop_face(reader, first);
  if (count < named) tw_lose_doubled_corners(&reader->losses, 1);
  status = number_groups(reader);
  if (status == TW_OK) status = label_face(reader, &reader->materials, reader->material);
  if (status == TW_OK) status = label_face(reader, &reader->groups, reader->group);
  if (status == TW_OK) status = label_face(reader, &reader->smoothing, reader->smoothing_group);
  reader->face_offsets[reader->read.faces++] = (uint32_t)first;
  return status;
}

/* ---- o, g, usemtl and the rest --------------------------------------------------------------- */

/* An object without faces is replaced by the next one. Faces before the first object are one without a name.
 */
static void begin_object(tw_obj_reader *reader, tw_obj_text *text) {
  uint64_t line = text->line;
  if (reader->object_count == 0 && reader->read.faces > 0)
    reader->objects[reader->object_count++] = (tw_obj_object){0};
  tw_obj_object object = {tw_obj_read_line(text), (uint32_t)reader->read.faces};
  tw_obj_object *last = reader->object_count ? &reader->objects[reader->object_count - 1] : NULL;
  if (last && last->first_face == object.first_face) {
    tw_lose(&reader->losses, "object without faces is left out", "objects without faces are left out", 1,
            line);
    *last = object;
  } else if (reader->object_count <= TW_OBJ_OBJECTS_MAX) {
    reader->objects[reader->object_count++] = object;
  }
}

/* Notes that no face has followed the groups of the newest `g`. */
static tw_status end_groups(tw_obj_reader *reader) {
  uint32_t number;
  if (reader->group_words.length == 0) return TW_OK;
  return number_name(&reader->idle_groups, reader->group_words, TW_OBJ_GROUPS_MAX, &number, reader->error);
}

/* Tells of sets of groups that no face has anywhere in the file. The first may name the mesh. */
static tw_status lose_groups(tw_obj_reader *reader) {
  tw_status status = end_groups(reader);
  const tw_obj_names *idle = &reader->idle_groups, *used = &reader->group_names;
  for (size_t i = 0; i < idle->count && status == TW_OK; i++) {
    const uint32_t *slot = used->count > 0 ? find_slot(used, idle->names[i]) : NULL;
    bool is_used = slot && *slot != 0,
         is_name = reader->object_count == 0 && same_name(idle->names[i], reader->first_group);
    tw_lose(&reader->losses, "set of groups without faces is left out",
            "sets of groups without faces are left out", !is_used && !is_name, 0);
  }
  return status;
}

/* Sets the groups of the faces that follow; `default` stands for none. */
static tw_status begin_groups(tw_obj_reader *reader, tw_obj_text *text) {
  enum { TEXT_MAX = 1024 }; /* an answer may repeat them for each part */
  tw_word names = tw_obj_read_word(text), word = names;
  for (; word.length > 0; word = tw_obj_read_word(text))
    names.length = (size_t)(word.text + word.length - names.text);
  tw_status status = end_groups(reader);
  if (reader->first_group.length == 0) reader->first_group = names;
  reader->group = TW_OBJ_NO_NAME;
  tw_lose(&reader->losses, "set of groups is left out: its names have over 1024 bytes",
          "sets of groups are left out: their names have over 1024 bytes", names.length > TEXT_MAX,
          text->line);
  if (names.length > TEXT_MAX || tw_word_is(names, "default")) names.length = 0;
  reader->group_words = names;
  return status;
}

static tw_status use_material(tw_obj_reader *reader, tw_obj_text *text) {
  tw_word name = tw_obj_read_line(text);
  reader->material = TW_OBJ_NO_NAME;
  if (name.length == 0) return TW_OK;
  tw_status status =
      number_name(&reader->material_names, name, TW_MATERIALS_MAX, &reader->material, reader->error);
  if (status != TW_OK || reader->material != TW_OBJ_NO_NAME) return status;
  return tw_fail_line(reader->error, TW_LIMIT, text->line, "there are more than %d materials",
                      TW_MATERIALS_MAX);
}

/* s NUMBER, or s off, which is 0. Anything else has the effect of no `s`, and is told. */
static void begin_smoothing(tw_obj_reader *reader, tw_obj_text *text) {
  int64_t group = 0;
  tw_word word = tw_obj_read_word(text);
  tw_obj_text number = tw_obj_text_of(word);
  bool is_group = tw_word_is(word, "off") || (tw_obj_read_integer(&number, &group) &&
                                              number.at == number.end && group >= 0 && group < UINT32_MAX);
  tw_lose(&reader->losses, "smoothing group is left out: it is no number",
          "smoothing groups are left out: they are no numbers", !is_group, text->line);
  leave_rest(reader, text, "further smoothing group of a statement is left out: a face is in one",
             "further smoothing groups of statements are left out: a face is in one");
  reader->smoothing_group = is_group ? (uint32_t)group : TW_OBJ_NO_VALUE;
}

/* Statements of the format that have nothing to do with a surface of polygons: what is lost with them. */
static tw_loss find_loss(tw_word word) {
  static const struct {
    const char *words;
    tw_loss loss;
  } kinds[] = {{" l p curv curv2 surf ",
                {.one = "line, point or curve is left out: only faces have a surface",
                 .many = "lines, points or curves are left out: only faces have a surface"}},
               {" vp bmat bsp bzp cdc cdp con cstype deg end hole mg parm res scrv sp step trim ctech stech ",
                {.one = "statement of free-form curves and surfaces is left out",
                 .many = "statements of free-form curves and surfaces are left out"}},
               {" bevel c_interp d_interp lod shadow_obj trace_obj usemap maplib call csh ",
                {.one = "statement about display and files is left out",
                 .many = "statements about display and files are left out"}}};
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
    for (const char *at = kinds[i].words; at[1]; at += strcspn(at + 1, " ") + 1)
      if (strcspn(at + 1, " ") == word.length && memcmp(at + 1, word.text, word.length) == 0)
        return kinds[i].loss;
  return (tw_loss){0};
}

/* Passes over a statement that shapes no surface, and notes it. A first word with other characters than those
 * of a statement shows that this is no OBJ file: TW_SYNTAX. */
static tw_status skip_statement(tw_obj_reader *reader, const tw_obj_text *text, tw_word word) {
  tw_loss loss = find_loss(word);
  if (loss.many) tw_lose(&reader->losses, loss.one, loss.many, 1, text->line);
  bool is_library = tw_word_is(word, "mtllib");
  reader->names_library |= is_library;
  for (size_t i = 0; i < word.length; i++) {
    char c = word.text[i];
    bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || tw_is_digit(c) || c == '_';
    if (!letter)
      return tw_fail_line(reader->error, TW_SYNTAX, text->line, "\"%s\" begins no statement of an OBJ file",
                          tw_obj_quote_word(word).text);
  }
  if (loss.many || is_library) return TW_OK;
  if (reader->unknown_statements++ > 0) return TW_OK;
  reader->first_unknown = text->line;
  reader->unknown_word = word;
  return TW_OK;
}

/* ---- two passes ------------------------------------------------------------------------------ */

/* Older files write fo. */
static bool is_face(tw_word word) {
  return tw_word_is(word, "f") || tw_word_is(word, "fo");
}

static void count_statement(tw_obj_reader *reader, tw_word word, tw_obj_text *file) {
  tw_obj_counts *all = &reader->all;
  if (is_face(word)) {
    all->faces++;
    all->corners += tw_obj_count_words(file);
  }
  all->points += tw_word_is(word, "v");
  all->uvs += tw_word_is(word, "vt");
  all->normals += tw_word_is(word, "vn");
  all->objects += tw_word_is(word, "o");
  if (tw_word_is(word, "o") || tw_word_is(word, "usemtl")) tw_obj_read_line(file);
  if (!tw_word_is(word, "t")) return;
  tw_obj_text text = tw_obj_statement(file);
  tw_obj_count_tag(&reader->tags.all, &text);
}

/* Reads a statement whose text needs an end of its own (words may follow a `#`), or a rare one. */
static tw_status read_bounded(tw_obj_reader *reader, tw_word word, tw_obj_text text) {
  if (tw_word_is(word, "t")) return tw_obj_read_tag(&reader->tags, &text, &reader->losses, reader->error);
  if (tw_word_is(word, TW_OBJ_COLORS)) return read_colors(reader, &text);
  if (tw_word_is(word, "g")) return begin_groups(reader, &text);
  if (tw_word_is(word, "s"))
    begin_smoothing(reader, &text);
  else
    return skip_statement(reader, &text, word);
  return TW_OK;
}

static tw_status read_statement(tw_obj_reader *reader, tw_word word, tw_obj_text *file) {
  if (tw_word_is(word, "v")) return read_point(reader, file);
  if (is_face(word)) return read_face(reader, file);
  if (tw_word_is(word, "vt")) return read_uv(reader, file);
  if (tw_word_is(word, "usemtl")) return use_material(reader, file);
  if (tw_word_is(word, "vn"))
    read_normal(reader, file);
  else if (tw_word_is(word, "o"))
    begin_object(reader, file);
  else
    return read_bounded(reader, word, tw_obj_statement(file));
  return TW_OK;
}

/* NULL if `count` is 0, if *status is a failure already, and without memory, which sets *status. */
static void *make_room(const tw_obj_reader *reader, uint64_t count, size_t size, tw_status *status) {
  if (count == 0 || *status != TW_OK) return NULL;
  void *room = tw_arena_alloc_raw(reader->arena, (size_t)count, size);
  if (!room) *status = tw_obj_fail_memory(reader);
  return room;
}

static tw_status make_all_room(tw_obj_reader *reader) {
  const tw_obj_counts *all = &reader->all;
  tw_obj_tags *tags = &reader->tags;
  const uint64_t counts[] = {all->points, all->uvs, all->normals, all->faces, all->corners};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i] >= UINT32_MAX)
      return tw_fail(reader->error, TW_LIMIT, "the file has more than 4294967294 elements of a kind");
  uint64_t objects = all->objects + 1; /* the first faces may be in none */
  if (objects > TW_OBJ_OBJECTS_MAX + 1) objects = TW_OBJ_OBJECTS_MAX + 1;
  tw_status status = TW_OK;
  reader->positions = make_room(reader, all->points, 3 * sizeof(float), &status);
  reader->normals = make_room(reader, all->normals > 0 ? all->normals + 1 : 0, 3 * sizeof(float), &status);
  reader->corners = make_room(reader, all->corners, sizeof(uint32_t), &status);
  reader->face_offsets = make_room(reader, all->faces + objects + 1, sizeof(uint32_t), &status);
  tags->point_count = all->points;
  tags->face_count = all->faces;
  tags->crease_points = make_room(reader, tags->all.crease_points, sizeof(uint32_t), &status);
  tags->crease_sharpness = make_room(reader, tags->all.crease_points / 2, sizeof(float), &status);
  tags->sharp_points = make_room(reader, tags->all.sharp_points, sizeof(uint32_t), &status);
  tags->point_sharpness = make_room(reader, tags->all.sharp_points, sizeof(float), &status);
  tags->holes = make_room(reader, tags->all.holes, sizeof(uint32_t), &status);
  reader->uvs = tw_alloc((size_t)all->uvs, 2 * sizeof(float));
  reader->objects = tw_alloc((size_t)objects, sizeof *reader->objects);
  return reader->uvs && reader->objects ? status : tw_obj_fail_memory(reader);
}

tw_status tw_obj_read_statements(tw_obj_reader *reader, const uint8_t *bytes, size_t size) {
  tw_obj_text file = tw_obj_text_of_file(bytes, size), start = file;
  tw_word word;
  reader->material = reader->group = TW_OBJ_NO_NAME;
  reader->smoothing_group = TW_OBJ_NO_VALUE;
  reader->tags.boundary = reader->tags.uv = reader->tags.creasing = reader->tags.triangles = TW_TAG_UNSET;
  for (; tw_obj_next_statement(&file, &word); tw_obj_end_statement(&file))
    count_statement(reader, word, &file);
  tw_status status = tw_work_status(reader->error); /* else nothing is counted whole */
  if (status == TW_OK) status = make_all_room(reader);
  file = start;
  for (; status == TW_OK && tw_obj_next_statement(&file, &word); tw_obj_end_statement(&file))
    status = read_statement(reader, word, &file);
  if (status == TW_OK) status = tw_work_status(reader->error);
  if (status != TW_OK) return status;
  if (reader->all.points == 0)
    return tw_fail_line(reader->error, TW_SYNTAX, file.line,
                        "there is no point and no face: this is not an OBJ file");
  settle_faces(reader);
  return lose_groups(reader);
}

void tw_obj_read_exact(const uint8_t *bytes, size_t size, double *out) {
  tw_obj_text file = tw_obj_text_of_file(bytes, size);
  tw_word word;
  for (; tw_obj_next_statement(&file, &word); tw_obj_end_statement(&file))
    for (int i = 0; tw_word_is(word, "v") && i < 3; i++) tw_obj_read_number(&file, out++);
}
