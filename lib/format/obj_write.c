/* OBJ text, made as it is read: for each place of a mesh its name, points with their colours, UVs, normals,
 * faces by material and groups, and the subdivision tags of a level 0 as obj_read.c reads them. Text is made
 * in pieces; what the caller has no room for waits for the next call. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "merge_points.h"
#include "number.h"
#include "placement.h"
#include "soup_mesh.h"

enum {
  FLOATS_SCRATCH = 16 * 1024,
  ROWS_A_PIECE = 512,
  FACES_A_PIECE = 256,
  POINT_WIDTH = 6, /* coordinates, then a colour */
  ROW_TEXT = 4 + POINT_WIDTH * (TW_NUMBER_TEXT + 1),
  COUNT_TEXT = 20, /* digits of any count: rows of all objects may sum to more than 32 bits hold */
  CORNER_TEXT = 3 + 3 * COUNT_TEXT, /* a space, three numbers, two slashes */
  TAGS_A_PIECE = 256,
  TAG_TEXT =
      18 + 2 * COUNT_TEXT + TW_NUMBER_TEXT, /* a crease: "t crease 2/1/0", two numbers, the sharpness */
  NAME_TEXT = 24,                           /* of a node without a name */
  DECIMALS_MAX = 12,                        /* with nine digits before the point a text fits TW_NUMBER_TEXT */
  DOMAINS = 3
};

/* The numbers of a face's corner, in this order. */
static const tw_domain domains[DOMAINS] = {TW_DOMAIN_POINTS, TW_DOMAIN_UVS, TW_DOMAIN_VERTICES};

typedef enum part { PART_NAME, PART_POINTS, PART_UVS, PART_NORMALS, PART_FACES, PART_TAGS, PART_END } part;

struct tw_obj_stream {
  tw_scene scene;
  tw_surface_reader *reader;    /* turned to the surface of `object` */
  tw_placements places;         /* an object each */
  uint32_t *namesakes;          /* [objects] the suffix that makes an object's name the only one; 0: none */
  uint32_t *material_namesakes; /* [materials] */

  /* Position: in `part` of `object`, at row, face or tag `next`. */
  uint32_t object;
  part part;
  uint64_t next;
  uint32_t group;
  int32_t material;       /* the last one written, -1 before the first */
  uint32_t names;         /* the last set of groups written, TW_NO_INDEX before the first */
  uint64_t base[DOMAINS]; /* rows of earlier objects */

  float floats[FLOATS_SCRATCH];
  char printed[ROWS_A_PIECE * POINT_WIDTH * (TW_FLOAT_TEXT + 1)];
  size_t corner_capacity;
  uint32_t *corners[DOMAINS]; /* [corner_capacity] */
  uint32_t sizes[FACES_A_PIECE];

  char *text; /* [text_capacity]; [text_taken, text_size) is not yet read */
  size_t text_capacity, text_size, text_taken;
};

/* ---- text ------------------------------------------------------------------------------------ */

static char *end_of(tw_obj_stream *stream) {
  return stream->text + stream->text_size;
}

static void put_text(tw_obj_stream *stream, const char *text) {
  size_t length = strlen(text);
  memcpy(end_of(stream), text, length);
  stream->text_size += length;
}

/* A line with a name, which gets no control characters and no backslash that would continue the line. */
static void put_name(tw_obj_stream *stream, const char *keyword, const char *name) {
  put_text(stream, keyword);
  char *written = end_of(stream);
  put_text(stream, name);
  char *end = end_of(stream);
  for (char *c = written; c < end; c++)
    if ((unsigned char)*c < ' ' || *c == 0x7F || (*c == '\\' && c + 1 == end)) *c = '_';
  put_text(stream, "\n");
}

/* A line for each row of `width` floats, at most ROWS_A_PIECE. */
static void put_rows(tw_obj_stream *stream, const char *keyword, const float *values, size_t width,
                     size_t count) {
  size_t ends[ROWS_A_PIECE], start = 0;
  tw_print_vectors(stream->printed, &(tw_vectors){values, width, width, count, ends});
  for (size_t i = 0; i < count; start = ends[i++] + 1) { /* "[x,y,z]," becomes "v x y z\n" */
    put_text(stream, keyword);
    char *out = end_of(stream);
    size_t length = ends[i] - start;
    memcpy(out, stream->printed + start, length);
    out[0] = ' ';
    out[length - 1] = '\n';
    for (size_t c = 1; c < length; c++)
      if (out[c] == ',') out[c] = ' ';
    stream->text_size += length;
  }
}

/* The integers of a tag, then its sharpness. */
static void put_tag_values(tw_obj_stream *stream, const uint64_t *numbers, int count, float sharpness) {
  char *out = end_of(stream);
  for (int i = 0; i < count; i++) {
    if (i > 0) *out++ = ' ';
    out = tw_print_count(out, numbers[i]);
  }
  *out++ = ' ';
  out += tw_print_float(out, sharpness);
  *out++ = '\n';
  stream->text_size = (size_t)(out - stream->text);
}

/* ---- objects --------------------------------------------------------------------------------- */

static const tw_placement *shown_place(const tw_obj_stream *stream) {
  return &stream->places.items[stream->object];
}

static const tw_surface *shown_surface(const tw_obj_stream *stream) {
  return stream->scene.surfaces[shown_place(stream)->mesh];
}

static bool has_normals(const tw_surface *surface) {
  return tw_surface_get_layout(surface)->normal != UINT32_MAX;
}

/* Rows of a domain that the file lists. */
static uint64_t listed_rows(const tw_surface *surface, tw_domain domain) {
  if (domain == TW_DOMAIN_VERTICES && !has_normals(surface)) return 0;
  return tw_surface_row_count(surface, domain);
}

/* ---- transforms ------------------------------------------------------------------------------ */

/* Transforms a normal by the cofactors of a matrix. It stays as it is if the transform is flat and leaves no
 * direction. */
static void transform_normal(const double cofactor[9], double sign, const float normal[3], float out[3]) {
  double turned[3], square = 0;
  for (int row = 0; row < 3; row++) {
    turned[row] = 0;
    for (int column = 0; column < 3; column++)
      turned[row] += sign * cofactor[3 * column + row] * (double)normal[column];
    square += turned[row] * turned[row];
  }
  double length = sqrt(square);
  for (int row = 0; row < 3; row++) out[row] = length > 0 ? (float)(turned[row] / length) : normal[row];
}

/* ---- pieces ---------------------------------------------------------------------------------- */

/* The name of a node or, where it has none, of its mesh; NULL where neither has one. */
static const char *own_name(const tw_model *model, uint32_t node) {
  const char *name = model->nodes[node].name;
  return name ? name : model->meshes[model->nodes[node].mesh].name;
}

/* A line with a name and, unless it is 0, a suffix that makes it the only one. */
static void put_own_name(tw_obj_stream *stream, const char *keyword, const char *name, uint32_t suffix) {
  put_name(stream, keyword, name);
  if (suffix == 0) return;
  stream->text_size--; /* the end of the line */
  *end_of(stream) = '_';
  stream->text_size = (size_t)(tw_print_count(end_of(stream) + 1, suffix) - stream->text);
  put_text(stream, "\n");
}

static void put_object_name(tw_obj_stream *stream) {
  const tw_model *model = stream->scene.model;
  char buffer[NAME_TEXT];
  uint32_t node = shown_place(stream)->node;
  const char *name = own_name(model, node);
  put_own_name(stream, "o ", name ? name : tw_model_node_name(model, node, buffer),
               stream->namesakes[stream->object]);
}

/* rows: the domain that they are counted in. */
static size_t read_piece(tw_obj_stream *stream, tw_domain rows, tw_domain domain, size_t width) {
  uint64_t left = listed_rows(shown_surface(stream), rows) - stream->next;
  size_t most = FLOATS_SCRATCH / width < ROWS_A_PIECE ? FLOATS_SCRATCH / width : ROWS_A_PIECE;
  size_t count = left < most ? (size_t)left : most;
  tw_surface_read_rows(stream->reader, domain, stream->next, count, stream->floats);
  stream->next += count;
  return count;
}

/* The decimals that tell a float's neighbours apart; 0 to DECIMALS_MAX. least: closer numbers are the same.
 */
static int decimals_of(float offset, double least) {
  int exponent;
  frexp((double)offset, &exponent);
  double apart = fmax(ldexp(1, exponent - FLT_MANT_DIG), least);
  int decimals = (int)ceil(-log10(apart));
  return decimals < 0 ? 0 : decimals > DECIMALS_MAX ? DECIMALS_MAX : decimals;
}

/* Prints `at` + `offset`, with as few decimals as give the offset back to a reader that subtracts `at` and
 * rounds to float. Returns the end. */
static char *print_far(char *out, double at, float offset) {
  double exact = at + (double)offset;
  if (fabs(exact) >= 1e9) return out + tw_print_double(out, exact);
  int decimals = decimals_of(offset, 2 * DBL_EPSILON * fabs(exact));
  char text[TW_NUMBER_TEXT];
  int length = snprintf(text, sizeof text, "%.*f", decimals > 0 ? decimals - 1 : 0, exact);
  if ((float)(strtod(text, NULL) - at) != offset)
    length = snprintf(text, sizeof text, "%.*f", decimals, exact);
  if (memchr(text, '.', (size_t)length)) {
    while (text[length - 1] == '0') length--;
    if (text[length - 1] == '.') length--;
  }
  memcpy(out, text, (size_t)length);
  return out + length;
}

/* Colours of few digits that read as what was read: six decimals. */
static float printed_color(float linear) {
  const float steps = 1e6f;
  return roundf(tw_srgb_from_linear(linear) * steps) / steps;
}

/* Reads points, POINT_WIDTH numbers each with their colours, else 3. Alpha has no place. */
static size_t read_points(tw_obj_stream *stream, size_t *width) {
  enum { READ_WIDTH = 7 };
  uint32_t color = tw_surface_color(shown_surface(stream));
  *width = color == UINT32_MAX ? 3 : POINT_WIDTH;
  if (color == UINT32_MAX) return read_piece(stream, TW_DOMAIN_POINTS, TW_DOMAIN_POINTS, 3);
  tw_surface_reader_turn_to_unsplit(stream->reader, shown_surface(stream),
                                    &(tw_point_columns){.attribute = color});
  size_t count = read_piece(stream, TW_DOMAIN_POINTS, TW_DOMAIN_VERTICES, READ_WIDTH);
  const float *row = stream->floats;
  float *out = stream->floats; /* a row is read before points reach it */
  for (size_t i = 0; i < count; i++, row += READ_WIDTH, out += POINT_WIDTH) {
    memmove(out, row, 3 * sizeof *out);
    for (int c = 3; c < POINT_WIDTH; c++) out[c] = printed_color(row[c]);
  }
  return count;
}

/* Points that lie far from the origin. */
static void put_far_points(tw_obj_stream *stream) {
  float linear[16];
  const double *at = shown_place(stream)->origin;
  memcpy(linear, shown_place(stream)->world, sizeof linear);
  memset(linear + 12, 0, 3 * sizeof *linear);
  size_t width, count = read_points(stream, &width);
  for (size_t i = 0; i < count; i++) {
    float *point = stream->floats + width * i;
    tw_matrix_move(linear, point);
    put_text(stream, "v");
    char *out = end_of(stream);
    for (size_t c = 0; c < width; c++) {
      *out++ = ' ';
      if (c < 3)
        out = print_far(out, at[c], point[c]);
      else
        out += tw_print_float(out, point[c]);
    }
    *out++ = '\n';
    stream->text_size = (size_t)(out - stream->text);
  }
}

static void put_points(tw_obj_stream *stream) {
  if (shown_place(stream)->is_far) {
    put_far_points(stream);
    return;
  }
  const float *world = shown_place(stream)->world;
  size_t width, count = read_points(stream, &width);
  for (size_t i = 0; i < count; i++) tw_matrix_move(world, stream->floats + width * i);
  put_rows(stream, "v", stream->floats, width, count);
}

static void put_uvs(tw_obj_stream *stream) {
  size_t count = read_piece(stream, TW_DOMAIN_UVS, TW_DOMAIN_UVS, 2);
  put_rows(stream, "vt", stream->floats, 2, count);
}

static void put_normals(tw_obj_stream *stream) {
  const tw_surface_layout *layout = tw_surface_get_layout(shown_surface(stream));
  double cofactor[9];
  double sign = tw_matrix_cofactors(shown_place(stream)->world, cofactor) < 0 ? -1 : 1;
  size_t count = read_piece(stream, TW_DOMAIN_VERTICES, TW_DOMAIN_VERTICES, layout->stride);
  /* Normals move to the front of the rows: a row is read before they reach it. */
  for (size_t i = 0; i < count; i++) {
    float normal[3];
    transform_normal(cofactor, sign, stream->floats + i * layout->stride + layout->normal, normal);
    memcpy(stream->floats + 3 * i, normal, sizeof normal);
  }
  put_rows(stream, "vn", stream->floats, 3, count);
}

/* The name of a material; where it has none, one made of its number. */
static const char *material_name(const tw_model *model, uint32_t material, char buffer[NAME_TEXT]) {
  if (model->material_names[material]) return model->material_names[material];
  snprintf(buffer, NAME_TEXT, "material_%u", material);
  return buffer;
}

static void put_material(tw_obj_stream *stream, int32_t face_material) {
  const tw_model *model = stream->scene.model;
  int32_t material = tw_model_material(model, face_material);
  char buffer[NAME_TEXT];
  if (material == stream->material) return;
  stream->material = material;
  if (material < 0)
    put_name(stream, "usemtl ", "none");
  else
    put_own_name(stream, "usemtl ", material_name(model, (uint32_t)material, buffer),
                 stream->material_namesakes[material]);
}

static void put_groups(tw_obj_stream *stream, uint32_t names) {
  if (names == stream->names) return;
  stream->names = names;
  put_name(stream, "g ", names == TW_NO_INDEX ? "default" : stream->scene.model->group_names[names]);
}

/* "v/vt/vn", "v/vt", "v//vn" or "v". */
static char *write_corner(const tw_obj_stream *stream, const tw_surface *surface, size_t corner, char *out) {
  bool uvs = listed_rows(surface, TW_DOMAIN_UVS) > 0, normals = has_normals(surface);
  *out++ = ' ';
  out = tw_print_count(out, stream->base[0] + stream->corners[0][corner] + 1);
  if (uvs || normals) *out++ = '/';
  if (uvs) out = tw_print_count(out, stream->base[1] + stream->corners[1][corner] + 1);
  if (normals) *out++ = '/';
  if (normals) out = tw_print_count(out, stream->base[2] + stream->corners[2][corner] + 1);
  return out;
}

/* Reads faces of a group from `next` on, as many as fit; returns how many. */
static size_t read_face_piece(tw_obj_stream *stream, const tw_surface_group *group) {
  const tw_surface *surface = shown_surface(stream);
  uint64_t left = group->first_face + group->face_count - stream->next;
  size_t count = left < FACES_A_PIECE ? (size_t)left : FACES_A_PIECE;
  uint64_t before = tw_surface_corners_before(surface, stream->next);
  while (tw_surface_corners_before(surface, stream->next + count) - before > stream->corner_capacity)
    count = (count + 1) / 2; /* one always fits */
  for (int i = 0; i < DOMAINS; i++)
    if (listed_rows(surface, domains[i]))
      tw_surface_read_faces(stream->reader, domains[i], stream->next, count, stream->sizes,
                            stream->corners[i]);
  return count;
}

static void put_faces(tw_obj_stream *stream) {
  const tw_surface *surface = shown_surface(stream);
  const tw_surface_group *group = tw_surface_get_group(surface, stream->group);
  while (stream->next == group->first_face + group->face_count)
    group = tw_surface_get_group(surface, ++stream->group);
  put_material(stream, group->material);
  put_groups(stream, group->names);
  double ignored[9];
  bool mirrored = tw_matrix_cofactors(shown_place(stream)->world, ignored) < 0;
  size_t count = read_face_piece(stream, group), first = 0;
  for (size_t face = 0; face < count; face++) {
    put_text(stream, "f");
    char *out = end_of(stream);
    uint32_t size = stream->sizes[face];
    for (uint32_t i = 0; i < size; i++)
      out = write_corner(stream, surface, first + (mirrored && i > 0 ? size - i : i), out);
    *out++ = '\n';
    stream->text_size = (size_t)(out - stream->text);
    first += size;
  }
  stream->next += count;
}

/* ---- tags ------------------------------------------------------------------------------------ */

static const tw_surface_tags *shown_tags(const tw_obj_stream *stream) {
  static const tw_surface_tags none;
  const tw_surface_tags *tags = tw_surface_get_tags(shown_surface(stream));
  return tags ? tags : &none;
}

static uint64_t tag_count(const tw_surface_tags *tags) {
  return (uint64_t)tags->crease_count + tags->sharp_point_count;
}

/* tag: a crease or, behind all creases, a sharp point. Tags in OBJ number the points of the whole file, from
 * 0. */
static void put_tag(tw_obj_stream *stream, uint64_t tag) {
  const tw_surface_tags *tags = shown_tags(stream);
  uint64_t point = stream->base[0];
  if (tag < tags->crease_count) {
    const uint32_t *edge = tags->crease_edges + 2 * tag;
    put_text(stream, "t crease 2/1/0 ");
    put_tag_values(stream, (uint64_t[]){point + edge[0], point + edge[1]}, 2, tags->crease_sharpness[tag]);
  } else {
    tag -= tags->crease_count;
    put_text(stream, "t corner 1/1/0 ");
    put_tag_values(stream, (uint64_t[]){point + tags->sharp_points[tag]}, 1, tags->point_sharpness[tag]);
  }
}

static void put_tags(tw_obj_stream *stream) {
  uint64_t left = tag_count(shown_tags(stream)) - stream->next;
  for (uint64_t stop = stream->next + (left < TAGS_A_PIECE ? left : TAGS_A_PIECE); stream->next < stop;
       stream->next++)
    put_tag(stream, stream->next);
}

/* Whether a surface with a border has normals that its mesh has not. */
static bool computes_normals_at_borders(const tw_scene *scene) {
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    const tw_surface_counts *counts = tw_surface_get_counts(scene->surfaces[i]);
    if (counts->corners != 2 * counts->edges && !scene->model->meshes[i].normals.corners &&
        tw_surface_get_layout(scene->surfaces[i])->normal != UINT32_MAX)
      return true;
  }
  return false;
}

/* Whether texture coordinates have seams between equal values. False without memory. */
static bool find_equal_seams(const tw_scene *scene, bool *out) {
  *out = false;
  for (uint32_t i = 0; i < scene->model->mesh_count && !*out; i++) {
    const tw_mesh *mesh = &scene->model->meshes[i];
    tw_channel channels[TW_CHANNELS_MAX]; /* the UV sets first */
    tw_mesh_channels(mesh, channels);
    if (mesh->uv_set_count > 0 && tw_mesh_has_equal_seams(mesh, &channels[0], out) != TW_OK) return false;
  }
  return true;
}

/* The rules of the surface, where they differ from those of a file without tags. A tag also keeps normals
 * that are computed from telling that borders have corners (tw_mesh_tells_hard_edges), and equal texture
 * coordinates apart, which are joined in a file without tags. OBJ has no tag for open borders. Rules hold for
 * the whole file: its surfaces all have the same. */
static void put_rules(tw_obj_stream *stream, const tw_surface_options *options, bool has_equal_seams) {
  static const char *const tag = "t interpolateboundary 1/0/0 1\n";
  const char *usual = has_equal_seams || computes_normals_at_borders(&stream->scene) ? tag : "";
  const char *const boundaries[] = {usual, "t interpolateboundary 1/0/0 2\n",
                                    "t interpolateboundary 1/0/0 0\n", has_equal_seams ? tag : ""};
  static const char *const uvs[] = {"",
                                    "t facevaryinginterpolateboundary 1/0/0 0\n",
                                    "t facevaryinginterpolateboundary 1/0/0 2\n",
                                    "t facevaryinginterpolateboundary 1/0/0 3\n",
                                    "t facevaryinginterpolateboundary 1/0/0 4\n",
                                    "t facevaryinginterpolateboundary 1/0/0 5\n"};
  put_text(stream, boundaries[options->boundary]);
  put_text(stream, uvs[options->uv]);
  if (options->creasing == TW_CREASE_CHAIKIN) put_text(stream, "t creasemethod 0/0/1 chaikin\n");
  if (options->triangles == TW_TRIANGLES_SMOOTH) put_text(stream, "t smoothtriangles 0/0/1 smooth\n");
}

/* ---- order ----------------------------------------------------------------------------------- */

static uint64_t part_count(const tw_obj_stream *stream) {
  const tw_surface *surface = shown_surface(stream);
  switch (stream->part) {
  case PART_POINTS: return listed_rows(surface, TW_DOMAIN_POINTS);
  case PART_UVS: return listed_rows(surface, TW_DOMAIN_UVS);
  case PART_NORMALS: return listed_rows(surface, TW_DOMAIN_VERTICES);
  case PART_FACES: return tw_surface_get_counts(surface)->faces;
  case PART_TAGS: return tag_count(shown_tags(stream));
  case PART_NAME:
  case PART_END: break;
  }
  return 0;
}

static void put_part(tw_obj_stream *stream) {
  switch (stream->part) {
  case PART_NAME: put_object_name(stream); return;
  case PART_POINTS: put_points(stream); return;
  case PART_UVS: put_uvs(stream); return;
  case PART_NORMALS: put_normals(stream); return;
  case PART_FACES: put_faces(stream); return;
  case PART_TAGS: put_tags(stream); return;
  case PART_END: return;
  }
}

static void leave_object(tw_obj_stream *stream) {
  for (int i = 0; i < DOMAINS; i++) stream->base[i] += listed_rows(shown_surface(stream), domains[i]);
  stream->object++;
  stream->part = PART_NAME;
  stream->group = 0;
}

/* Makes the next piece of text, which may be empty; false at the end. */
static bool put_piece(tw_obj_stream *stream) {
  stream->text_size = stream->text_taken = 0;
  if (stream->object == stream->places.count) return false;
  tw_surface_reader_turn(stream->reader, shown_surface(stream), 0, 0);
  if (stream->next < part_count(stream) || stream->part == PART_NAME) put_part(stream);
  if (stream->next < part_count(stream)) return true;
  stream->next = 0;
  stream->part++;
  if (stream->part == PART_END) leave_object(stream);
  return true;
}

size_t tw_obj_stream_read(tw_obj_stream *stream, uint8_t *out, size_t capacity) {
  size_t done = 0;
  while (done < capacity) {
    if (stream->text_taken == stream->text_size && !put_piece(stream)) break;
    size_t waiting = stream->text_size - stream->text_taken;
    size_t size = waiting < capacity - done ? waiting : capacity - done;
    memcpy(out + done, stream->text + stream->text_taken, size);
    stream->text_taken += size;
    done += size;
  }
  return done;
}

/* ---- create and destroy ---------------------------------------------------------------------- */

static size_t longer(size_t length, const char *name) {
  size_t other = name ? strlen(name) : 0;
  return other > length ? other : length;
}

/* Bytes of the largest piece of text. */
static size_t largest_piece(const tw_model *model, size_t corner_capacity) {
  size_t name = 24;
  for (uint32_t i = 0; i < model->node_count; i++) name = longer(name, model->nodes[i].name);
  for (uint32_t i = 0; i < model->mesh_count; i++) name = longer(name, model->meshes[i].name);
  for (uint32_t i = 0; i < model->material_count; i++) name = longer(name, model->material_names[i]);
  for (uint32_t i = 0; i < model->group_count; i++) name = longer(name, model->group_names[i]);
  size_t rows = (size_t)ROWS_A_PIECE * ROW_TEXT;
  size_t faces = 2 * (name + 16) + corner_capacity * CORNER_TEXT + (size_t)FACES_A_PIECE * 2;
  size_t largest = rows > faces ? rows : faces, tags = (size_t)TAGS_A_PIECE * TAG_TEXT;
  return largest > tags ? largest : tags;
}

/* What is written with a name: an object or a material. name: "" for none. */
typedef struct named {
  const char *name;
  uint32_t index;
} named;

static int compare_named(const void *left, const void *right) {
  const named *a = left, *b = right;
  int order = strcmp(a->name, b->name);
  return order ? order : a->index < b->index ? -1 : a->index > b->index;
}

static int compare_names(const void *name, const void *item) {
  return strcmp(name, ((const named *)item)->name);
}

/* Whether another name is this one with a suffix. whole: room for that name. */
static bool is_taken(const named *all, uint32_t count, const char *name, uint32_t suffix, char *whole,
                     size_t size) {
  snprintf(whole, size, "%s_%u", name, suffix);
  return bsearch(whole, all, count, sizeof *all, compare_names);
}

/* Finds the suffixes of what has the name of an earlier one: readers know objects and materials by their
 * names. all: [count], which is sorted. size: room for a name and its suffix. */
static bool suffix_namesakes(named *all, uint32_t count, size_t size, uint32_t *suffixes) {
  char *whole = tw_alloc(size, 1);
  uint32_t suffix = 1;
  bool has_memory = whole && tw_sort(all, count, sizeof *all, compare_named) == TW_OK;
  for (uint32_t i = 1; has_memory && i < count; i++) {
    bool is_namesake = *all[i].name && strcmp(all[i].name, all[i - 1].name) == 0;
    suffix = is_namesake ? suffix + 1 : 1;
    if (!is_namesake) continue;
    while (is_taken(all, count, all[i].name, suffix, whole, size)) suffix++;
    suffixes[all[i].index] = suffix;
  }
  tw_free(whole);
  return has_memory;
}

/* Objects without a name have numbers, which differ; instances of one node get suffixes. */
static bool tell_objects_apart(tw_obj_stream *stream) {
  const tw_placements *places = &stream->places;
  named *all = tw_alloc(places->count, sizeof *all);
  stream->namesakes = tw_alloc_zero(places->count, sizeof *stream->namesakes);
  uint32_t suffix = 1;
  bool has_memory = all && stream->namesakes;
  for (uint32_t i = 0; has_memory && i < places->count; i++) {
    const char *name = own_name(stream->scene.model, places->items[i].node);
    bool is_instance = i > 0 && places->items[i].node == places->items[i - 1].node;
    all[i] = (named){name ? name : "", i};
    suffix = is_instance ? suffix + 1 : 1;
    if (!name && is_instance) stream->namesakes[i] = suffix;
  }
  has_memory = has_memory && suffix_namesakes(all, places->count, stream->text_capacity, stream->namesakes);
  tw_free(all);
  return has_memory;
}

static bool tell_materials_apart(tw_obj_stream *stream) {
  const tw_model *model = stream->scene.model;
  uint32_t count = model->material_count;
  named *all = tw_alloc(count, sizeof *all);
  char(*made)[NAME_TEXT] = tw_alloc(count, sizeof *made);
  stream->material_namesakes = tw_alloc_zero(count, sizeof *stream->material_namesakes);
  bool has_memory = all && made && stream->material_namesakes;
  for (uint32_t i = 0; has_memory && i < count; i++) all[i] = (named){material_name(model, i, made[i]), i};
  has_memory = has_memory && suffix_namesakes(all, count, stream->text_capacity, stream->material_namesakes);
  tw_free(made);
  tw_free(all);
  return has_memory;
}

static bool allocate(tw_obj_stream *stream) {
  const tw_model *model = stream->scene.model;
  stream->corner_capacity = (size_t)4 * FACES_A_PIECE;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    size_t largest = tw_surface_largest_face(stream->scene.surfaces[i]);
    if (largest > stream->corner_capacity) stream->corner_capacity = largest;
  }
  for (int i = 0; i < DOMAINS; i++) {
    stream->corners[i] = tw_alloc(stream->corner_capacity, sizeof(uint32_t));
    if (!stream->corners[i]) return false;
  }
  stream->text_capacity = largest_piece(model, stream->corner_capacity);
  stream->text = tw_alloc(stream->text_capacity, 1);
  stream->reader = tw_surface_reader_create_shared(stream->scene.surfaces, model->mesh_count, 0);
  return stream->text && stream->reader && tw_placements_find(&stream->scene, &stream->places) &&
         tell_objects_apart(stream) && tell_materials_apart(stream);
}

tw_status tw_obj_stream_create(const tw_scene *scene, tw_obj_stream **out, tw_error *error) {
  tw_obj_stream *stream = tw_alloc_zero(1, sizeof *stream);
  bool is_beyond = false;
  if (stream) {
    stream->scene = *scene;
    stream->material = -1;
    stream->names = TW_NO_INDEX;
    const tw_surface_options *options =
        scene->model->mesh_count > 0 ? tw_surface_get_options(scene->surfaces[0]) : NULL;
    bool is_tagged = options && options->tagged, has_equal_seams = false;
    bool has_memory = allocate(stream) && (!is_tagged || find_equal_seams(scene, &has_equal_seams));
    is_beyond = has_memory && tw_placements_are_beyond(scene, &stream->places, 1);
    if (has_memory && !is_beyond) {
      put_name(stream, "# tweend ", tw_version());
      if (is_tagged) put_rules(stream, options, has_equal_seams);
      *out = stream;
      return TW_OK;
    }
  }
  tw_obj_stream_destroy(stream);
  return is_beyond ? tw_fail(error, TW_LIMIT, "nodes take coordinates beyond 3.4e38")
                   : tw_fail(error, TW_NO_MEMORY, "no memory for an OBJ stream");
}

void tw_obj_stream_destroy(tw_obj_stream *stream) {
  if (!stream) return;
  tw_surface_reader_destroy(stream->reader);
  for (int i = 0; i < DOMAINS; i++) tw_free(stream->corners[i]);
  tw_placements_deinit(&stream->places);
  tw_free(stream->namesakes);
  tw_free(stream->material_namesakes);
  tw_free(stream->text);
  tw_free(stream);
}
