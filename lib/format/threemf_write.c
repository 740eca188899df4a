/* The model part of a 3MF package (3D Manufacturing Format, core specification 1.3), made as it is read: base
 * materials, an object for each mesh, an item for each node that shows one. Text is made in pieces of bounded
 * size; what the caller has no room for waits for the next call. */
#include <stdlib.h>
#include <string.h>

#include "flat.h"
#include "gltf/gltf.h"
#include "number.h"
#include "soup_mesh.h"
#include "tweend/json_text.h"

enum {
  ROWS_A_PIECE = 512,
  TRIANGLES_A_PIECE = 512,
  VERTEX_TEXT = 32 + 3 * TW_FLOAT_TEXT,
  TRIANGLE_TEXT = 96, /* four numbers of ten digits */
  ITEM_TEXT = 96 + 12 * (TW_NUMBER_TEXT + 1),
  NAME_TEXT = 24, /* of a mesh, node or material without a name */
  PIECE_TEXT = 64 * 1024,
  BASES_ID = 1 /* of the base materials; objects follow */
};

/* An object: a mesh as it is, its mirror image with its faces turned round, or a mesh moved by the whole
 * transform of its node. A transform that mirrors would turn faces inside out, one that is flat has no
 * inverse. */
typedef enum object_kind { OBJECT_PLAIN, OBJECT_MIRRORED, OBJECT_FLAT } object_kind;

typedef struct object {
  uint32_t mesh;
  object_kind kind;
  tw_flat_part part; /* where its points are: the scale, and what its kind asks for */
} object;

typedef enum stage { STAGE_HEAD, STAGE_OPEN, STAGE_VERTICES, STAGE_TRIANGLES, STAGE_ITEMS, STAGE_END } stage;

struct tw_3mf_stream {
  tw_flat_scene flat;
  tw_3mf_options options;
  uint32_t object_count;
  object *objects;       /* [object_count] */
  uint32_t *item_object; /* [flat.part_count] */
  tw_surface_reader *reader;
  tw_triangulator triangles;

  /* Position: in `stage`, at row, triangle or item `next` of an object; triangles are those of `faces`. */
  stage stage;
  uint32_t object, group;
  uint64_t next;
  tw_surface_group faces;
  uint32_t base;    /* the material that the object has by default */
  size_t name_text; /* bytes of the longest name, once escaped */

  float rows[ROWS_A_PIECE * 3];
  char printed[ROWS_A_PIECE * 3 * (TW_FLOAT_TEXT + 1)];
  uint32_t corners[TRIANGLES_A_PIECE * 3];
  tw_text text; /* what is not yet read begins at text_taken; room for any piece is reserved */
  size_t text_taken;
};

/* ---- text ------------------------------------------------------------------------------------ */

/* Escapes what XML 1.0 has a meaning for; control characters, which it has no place for, become blanks. */
static void put_escaped(tw_text *text, const char *value) {
  for (; *value; value++) {
    unsigned char c = (unsigned char)*value;
    if (c == '&')
      tw_text_add(text, "&amp;");
    else if (c == '<')
      tw_text_add(text, "&lt;");
    else if (c == '"')
      tw_text_add(text, "&quot;");
    else if (c < ' ' || c == 0x7F)
      tw_text_add(text, " ");
    else if (c == 0xEF && (unsigned char)value[1] == 0xBF && (unsigned char)value[2] >= 0xBE)
      tw_text_add(text, " "), value += 2; /* U+FFFE, U+FFFF */
    else
      tw_text_bytes(text, value, 1);
  }
}

static void put_attribute(tw_text *text, const char *name, const char *value) {
  tw_text_add(text, " ");
  tw_text_add(text, name);
  tw_text_add(text, "=\"");
  put_escaped(text, value);
  tw_text_add(text, "\"");
}

static void put_count(tw_text *text, const char *name, uint64_t value) {
  tw_text_add(text, " ");
  tw_text_add(text, name);
  tw_text_add(text, "=\"");
  tw_text_count(text, value);
  tw_text_add(text, "\"");
}

/* ---- materials ------------------------------------------------------------------------------- */

/* The base colour of a material, linear, and its alpha, each from 0 to 1. */
static void find_base_color(const tw_model *model, uint32_t material, float out[4]) {
  const float white[4] = {1, 1, 1, 1};
  memcpy(out, white, sizeof white);
  if (model->material_colors) memcpy(out, model->material_colors + 3 * (size_t)material, 3 * sizeof *out);
  const tw_gltf_assets *assets = model->assets;
  if (!assets || material >= assets->materials.count) return;
  const char *pbr = tw_json_member(assets->materials.items[material], "pbrMetallicRoughness"),
             *factor = tw_json_member(pbr, "baseColorFactor");
  tw_json_item item;
  bool more = factor && *factor == '[' && tw_json_first(factor, &item);
  for (int i = 0; more && i < 4 && tw_json_is_number(item.value); i++) {
    double value;
    const char *end = tw_json_number(item.value, &value);
    out[i] = (float)(value < 0 ? 0 : value > 1 ? 1 : value);
    more = tw_json_next(end, &item);
  }
}

static void put_base(tw_3mf_stream *stream, uint32_t material) {
  static const char digits[] = "0123456789ABCDEF";
  const tw_model *model = stream->flat.scene.model;
  char name[NAME_TEXT] = "material_", color[10] = "#", *end = color + 1;
  const char *own = model->material_names ? model->material_names[material] : NULL;
  float rgba[4];
  *tw_print_count(name + strlen(name), material) = '\0';
  find_base_color(model, material, rgba);
  for (int i = 0; i < 4; i++) {
    int byte = (int)(255 * (i < 3 ? tw_srgb_from_linear(rgba[i]) : rgba[i]) + 0.5f);
    *end++ = digits[byte / 16];
    *end++ = digits[byte % 16];
  }
  *end = '\0';
  tw_text_add(&stream->text, "<base");
  put_attribute(&stream->text, "name", own && *own ? own : name);
  put_attribute(&stream->text, "displaycolor", color);
  tw_text_add(&stream->text, "/>");
}

/* Puts the next base materials: the model's, then a white one for faces without a material. The first piece
 * also has the head of the document. */
static void put_head(tw_3mf_stream *stream) {
  enum { BASES_A_PIECE = 64 };
  const tw_model *model = stream->flat.scene.model;
  tw_text *text = &stream->text;
  uint64_t last = tw_least(stream->next + BASES_A_PIECE, model->material_count);
  if (stream->next == 0) {
    tw_text_add(text, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model");
    put_attribute(text, "unit", stream->options.unit);
    tw_text_add(text,
                " xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">"
                "<metadata name=\"Application\">tweend ");
    tw_text_add(text, tw_version());
    tw_text_add(text, "</metadata><resources>");
  }
  if (stream->next == 0 && model->material_count > 0) tw_text_add(text, "<basematerials id=\"1\">");
  for (; stream->next < last; stream->next++) put_base(stream, (uint32_t)stream->next);
  if (stream->next < model->material_count) return;
  if (model->material_count > 0)
    tw_text_add(text, "<base name=\"none\" displaycolor=\"#FFFFFF\"/></basematerials>");
  stream->stage = stream->object_count > 0 ? STAGE_OPEN : STAGE_ITEMS;
  if (stream->object_count == 0) tw_text_add(text, "</resources><build>");
  stream->next = 0;
}

/* ---- objects --------------------------------------------------------------------------------- */

/* The base of a group's faces: a material, or that of faces without one. */
static uint32_t base_of(const tw_model *model, const tw_surface_group *faces) {
  int32_t material = tw_model_material(model, faces->material);
  return material < 0 ? model->material_count : (uint32_t)material;
}

static const object *current(const tw_3mf_stream *stream) {
  return &stream->objects[stream->object];
}

static void put_open(tw_3mf_stream *stream) {
  const object *o = current(stream);
  const tw_model *model = stream->flat.scene.model;
  tw_text *text = &stream->text;
  char name[NAME_TEXT] = "mesh_";
  *tw_print_count(name + strlen(name), o->mesh) = '\0';
  const char *own = model->meshes[o->mesh].name;
  tw_text_add(text, "<object");
  put_count(text, "id", BASES_ID + 1 + stream->object);
  bool is_open = stream->options.is_open && stream->options.is_open[o->mesh];
  put_attribute(text, "type", is_open ? "surface" : "model");
  put_attribute(text, "name", own && *own ? own : name);
  if (model->material_count > 0) {
    stream->base = base_of(model, tw_surface_get_group(o->part.surface, 0));
    put_count(text, "pid", BASES_ID);
    put_count(text, "pindex", stream->base);
  }
  tw_text_add(text, "><mesh><vertices>");
  stream->stage = STAGE_VERTICES;
  stream->next = 0;
}

static void put_vertices(tw_3mf_stream *stream) {
  static const char *const names[3] = {"<vertex x=\"", "\" y=\"", "\" z=\""};
  const object *o = current(stream);
  uint64_t rows = tw_surface_row_count(o->part.surface, TW_DOMAIN_POINTS);
  size_t count = (size_t)tw_least(rows - stream->next, ROWS_A_PIECE), ends[ROWS_A_PIECE], start = 0;
  tw_surface_reader_turn(stream->reader, o->part.surface, 0, 0);
  tw_surface_read_rows(stream->reader, TW_DOMAIN_POINTS, stream->next, count, stream->rows);
  for (size_t i = 0; i < count; i++) tw_flat_move(&o->part, stream->rows + 3 * i, stream->rows + 3 * i);
  tw_print_vectors(stream->printed, &(tw_vectors){stream->rows, 3, 3, count, ends});
  for (size_t i = 0; i < count; start = ends[i++] + 1) { /* "[x,y,z]," */
    const char *number = stream->printed + start + 1, *end = stream->printed + ends[i] - 1;
    for (int c = 0; c < 3; c++) {
      const char *stop = memchr(number, ',', (size_t)(end - number));
      if (!stop) stop = end;
      tw_text_add(&stream->text, names[c]);
      tw_text_bytes(&stream->text, number, (size_t)(stop - number));
      number = stop + 1;
    }
    tw_text_add(&stream->text, "\"/>");
  }
  stream->next += count;
  if (stream->next < rows) return;
  tw_text_add(&stream->text, "</vertices><triangles>");
  stream->stage = STAGE_TRIANGLES;
  stream->group = 0;
  stream->faces = tw_take_material(o->part.surface, &stream->group);
  stream->next = 0;
}

/* Ends an object, and begins the next one or the items. */
static void put_close(tw_3mf_stream *stream) {
  tw_text_add(&stream->text, "</triangles></mesh></object>");
  stream->next = 0;
  stream->object++;
  stream->stage = stream->object < stream->object_count ? STAGE_OPEN : STAGE_ITEMS;
  if (stream->stage == STAGE_ITEMS) tw_text_add(&stream->text, "</resources><build>");
}

/* A triangle has three different corners, as the specification demands. */
static void put_triangles(tw_3mf_stream *stream) {
  static const char *const names[3] = {"<triangle v1=\"", "\" v2=\"", "\" v3=\""};
  const object *o = current(stream);
  const tw_model *model = stream->flat.scene.model;
  uint64_t all = tw_count_triangles(&stream->faces);
  size_t count = (size_t)tw_least(all - stream->next, TRIANGLES_A_PIECE);
  uint32_t base = base_of(model, &stream->faces), second = o->part.is_mirrored ? 2 : 1;
  char text[TRIANGLE_TEXT];
  tw_triangulator_read(&stream->triangles, o->part.surface, &stream->faces, stream->next, count,
                       stream->corners);
  for (size_t i = 0; i < count; i++) {
    const uint32_t *t = stream->corners + 3 * i, corners[3] = {t[0], t[second], t[3 - second]};
    char *end = text;
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (int k = 0; k < 3; k++) {
      size_t length = strlen(names[k]);
      memcpy(end, names[k], length);
      end = tw_print_count(end + length, corners[k]);
    }
    tw_text_bytes(&stream->text, text, (size_t)(end - text));
    tw_text_add(&stream->text, "\"");
    if (model->material_count > 0 && base != stream->base) {
      put_count(&stream->text, "pid", BASES_ID);
      put_count(&stream->text, "p1", base);
    }
    tw_text_add(&stream->text, "/>");
  }
  stream->next += count;
  if (stream->next < all) return;
  stream->next = 0;
  if (stream->group < tw_surface_group_count(o->part.surface))
    stream->faces = tw_take_material(o->part.surface, &stream->group);
  else
    put_close(stream);
}

/* ---- items ----------------------------------------------------------------------------------- */

/* The transform of an item: three rows of the linear part as it acts on row vectors, then the translation. */
static void put_transform(tw_3mf_stream *stream, const tw_flat_part *part, object_kind kind) {
  tw_text *text = &stream->text;
  tw_text_add(text, " transform=\"");
  for (int column = 0; column < 4; column++)
    for (int row = 0; row < 3; row++) {
      double value = part->matrix[4 * row + column];
      if (column < 3) value /= stream->options.scale;
      if (column < 3 && kind == OBJECT_FLAT) value = row == column;
      if (column == 0 && kind == OBJECT_MIRRORED) value = -value;
      tw_text_double(text, value);
      tw_text_add(text, row + column < 5 ? " " : "\"");
    }
}

static void put_items(tw_3mf_stream *stream) {
  enum { ITEMS_A_PIECE = 16 };
  const tw_model *model = stream->flat.scene.model;
  uint64_t last = tw_least(stream->next + ITEMS_A_PIECE, stream->flat.part_count);
  for (; stream->next < last; stream->next++) {
    const tw_flat_part *part = &stream->flat.parts[stream->next];
    uint32_t object = stream->item_object[stream->next];
    const char *name = model->nodes[part->node].name;
    tw_text_add(&stream->text, "<item");
    put_count(&stream->text, "objectid", BASES_ID + 1 + object);
    put_transform(stream, part, stream->objects[object].kind);
    if (name && *name) put_attribute(&stream->text, "partnumber", name);
    tw_text_add(&stream->text, "/>");
  }
  if (stream->next < stream->flat.part_count) return;
  tw_text_add(&stream->text, "</build></model>\n");
  stream->stage = STAGE_END;
}

/* ---- create and destroy ---------------------------------------------------------------------- */

static object_kind kind_of(const tw_flat_part *part) {
  const double *m = part->matrix, *c = part->cofactor;
  double determinant = c[0] * m[0] + c[1] * m[4] + c[2] * m[8];
  if (determinant == 0) return OBJECT_FLAT;
  return part->is_mirrored ? OBJECT_MIRRORED : OBJECT_PLAIN;
}

static object object_for(const tw_3mf_stream *stream, const tw_flat_part *part, object_kind kind) {
  object o = {.mesh = part->mesh, .kind = kind, .part = *part};
  double *m = o.part.matrix;
  o.part.is_mirrored = kind == OBJECT_MIRRORED;
  m[3] = m[7] = m[11] = 0;
  if (kind == OBJECT_FLAT) return o;
  for (int i = 0; i < 12; i++) m[i] = i % 5 == 0 ? stream->options.scale : 0;
  if (kind == OBJECT_MIRRORED) m[0] = -m[0];
  return o;
}

/* Lists the objects that items need: each mesh as it is and mirrored at most once. */
static tw_status list_objects(tw_3mf_stream *stream) {
  const tw_flat_scene *flat = &stream->flat;
  uint32_t meshes = flat->scene.model->mesh_count;
  uint32_t *known = tw_alloc(2 * (size_t)meshes, sizeof *known); /* [meshes][2] plain and mirrored */
  stream->objects = tw_alloc(flat->part_count, sizeof *stream->objects);
  stream->item_object = tw_alloc(flat->part_count, sizeof *stream->item_object);
  bool has_memory = known && stream->objects && stream->item_object;
  for (size_t i = 0; has_memory && i < 2 * (size_t)meshes; i++) known[i] = UINT32_MAX;
  for (uint32_t p = 0; has_memory && p < flat->part_count; p++) {
    const tw_flat_part *part = &flat->parts[p];
    object_kind kind = kind_of(part);
    uint32_t *place = kind == OBJECT_FLAT ? NULL : &known[2 * (size_t)part->mesh + (kind == OBJECT_MIRRORED)];
    if (place && *place != UINT32_MAX) {
      stream->item_object[p] = *place;
      continue;
    }
    if (place) *place = stream->object_count;
    stream->item_object[p] = stream->object_count;
    stream->objects[stream->object_count++] = object_for(stream, part, kind);
  }
  tw_free(known);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

static size_t longer(size_t length, const char *name) {
  size_t own = name ? strlen(name) : 0;
  return own > length ? own : length;
}

static size_t longest_name(const tw_model *model) {
  size_t length = 0;
  for (uint32_t i = 0; i < model->node_count; i++) length = longer(length, model->nodes[i].name);
  for (uint32_t i = 0; i < model->mesh_count; i++) length = longer(length, model->meshes[i].name);
  for (uint32_t i = 0; model->material_names && i < model->material_count; i++)
    length = longer(length, model->material_names[i]);
  return length;
}

static tw_status allocate(tw_3mf_stream *stream) {
  enum { ESCAPED = 6, NAMES_A_PIECE = 64 };
  const tw_scene *scene = &stream->flat.scene;
  uint32_t meshes = scene->model->mesh_count;
  stream->reader = tw_surface_reader_create_shared(scene->surfaces, meshes, 0);
  bool is_complete = stream->reader && tw_triangulator_init(&stream->triangles, scene->surfaces, meshes,
                                                            TW_POLYGONS_TRIANGLES, stream->reader);
  stream->triangles.domain = TW_DOMAIN_POINTS;
  stream->name_text = ESCAPED * longest_name(scene->model);
  tw_text_reserve(&stream->text, PIECE_TEXT + NAMES_A_PIECE * stream->name_text);
  return is_complete && !stream->text.failed ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_3mf_stream_create(const tw_scene *scene, const tw_3mf_options *options, tw_3mf_stream **out,
                               tw_error *error) {
  tw_3mf_stream *stream = tw_alloc_zero(1, sizeof *stream);
  tw_status status = stream && tw_flat_place(scene, options->scale, &stream->flat) ? TW_OK : TW_NO_MEMORY;
  if (stream) stream->options = *options;
  if (status == TW_OK) status = tw_flat_check(&stream->flat, error);
  if (status == TW_OK) status = list_objects(stream);
  if (status == TW_OK) status = allocate(stream);
  if (status == TW_OK) {
    *out = stream;
    return TW_OK;
  }
  tw_3mf_stream_destroy(stream);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "no memory for a 3MF stream") : status;
}

bool tw_3mf_stream_origin(const tw_3mf_stream *stream, double origin[3]) {
  memcpy(origin, stream->flat.origin, sizeof stream->flat.origin);
  return stream->flat.is_moved;
}

uint64_t tw_3mf_stream_bound(const tw_3mf_stream *stream) {
  const tw_model *model = stream->flat.scene.model;
  uint64_t each = stream->name_text + ITEM_TEXT, size = PIECE_TEXT + each * (model->material_count + 1ull);
  for (uint32_t i = 0; i < stream->object_count; i++) {
    const tw_surface *surface = stream->objects[i].part.surface;
    const tw_surface_group faces = tw_flat_faces(surface);
    size += each + tw_surface_row_count(surface, TW_DOMAIN_POINTS) * VERTEX_TEXT +
            tw_count_triangles(&faces) * TRIANGLE_TEXT;
  }
  return size + each * stream->flat.part_count;
}

void tw_3mf_stream_destroy(tw_3mf_stream *stream) {
  if (!stream) return;
  tw_triangulator_deinit(&stream->triangles);
  tw_surface_reader_destroy(stream->reader);
  tw_text_deinit(&stream->text);
  tw_free(stream->objects);
  tw_free(stream->item_object);
  tw_flat_deinit(&stream->flat);
  tw_free(stream);
}

/* ---- reading --------------------------------------------------------------------------------- */

static void make_piece(tw_3mf_stream *stream) {
  tw_text_clear(&stream->text);
  stream->text_taken = 0;
  switch (stream->stage) {
  case STAGE_HEAD: put_head(stream); return;
  case STAGE_OPEN: put_open(stream); return;
  case STAGE_VERTICES: put_vertices(stream); return;
  case STAGE_TRIANGLES: put_triangles(stream); return;
  case STAGE_ITEMS: put_items(stream); return;
  case STAGE_END: return;
  }
}

int64_t tw_3mf_stream_read(tw_3mf_stream *stream, uint8_t *out, size_t capacity) {
  size_t done = 0;
  while (done < capacity) {
    if (stream->text.failed) return -1;
    if (stream->text_taken == stream->text.size) {
      if (stream->stage == STAGE_END) break;
      make_piece(stream);
      continue;
    }
    size_t taken = (size_t)tw_least(stream->text.size - stream->text_taken, capacity - done);
    memcpy(out + done, stream->text.data + stream->text_taken, taken);
    stream->text_taken += taken;
    done += taken;
  }
  return (int64_t)done;
}
