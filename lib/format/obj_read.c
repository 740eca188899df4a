/* Makes a model of a Wavefront OBJ file. Points are shared over the whole file, so it is one mesh, unless its
 * objects share no points: then each object is a mesh of its own. */
#include "obj_statements.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "merge_points.h"
#include "soup_mesh.h"
#include "tweend/format.h"

typedef struct obj_bytes {
  const uint8_t *bytes;
  size_t size;
} obj_bytes;

/* ---- which point belongs to which mesh ------------------------------------------------------- */

static uint64_t face_end(const tw_obj_reader *reader, uint64_t face) {
  return face + 1 < reader->all.faces ? reader->face_offsets[face + 1] : reader->all.corners;
}

/* Faces [*first, *stop) of an object. */
static void face_range(const tw_obj_reader *reader, uint32_t mesh, uint32_t mesh_count, uint64_t *first,
                       uint64_t *stop) {
  *first = mesh > 0 ? reader->objects[mesh].first_face : 0;
  *stop = mesh + 1 < mesh_count ? reader->objects[mesh + 1].first_face : reader->all.faces;
}

/* Finds the mesh whose faces use each point, UINT32_MAX for an unused point. False if two meshes use the same
 * point. */
static bool own_points(const tw_obj_reader *reader, uint32_t mesh_count, uint32_t *owners) {
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

/* Turns owners into places: the points of a mesh stand together in the order of the file, unused points come
 * last. ends: [mesh_count], one past the last point of each mesh. */
static void place_points(const tw_obj_reader *reader, uint32_t mesh_count, uint32_t *owners, uint32_t *ends) {
  uint64_t points = reader->all.points;
  uint32_t used = 0;
  memset(ends, 0, mesh_count * sizeof *ends);
  for (uint64_t i = 0; i < points; i++)
    if (owners[i] != UINT32_MAX) ends[owners[i]]++;
  for (uint32_t mesh = 0; mesh < mesh_count; mesh++) {
    uint32_t count = ends[mesh];
    ends[mesh] = used; /* its first place, which advances to its end below */
    used += count;
  }
  for (uint64_t i = 0; i < points; i++) owners[i] = owners[i] != UINT32_MAX ? ends[owners[i]]++ : used++;
}

/* size: of a row, up to that of three doubles. */
static void swap_rows(void *rows, size_t size, size_t a, size_t b) {
  unsigned char kept[3 * sizeof(double)], *first = (unsigned char *)rows + size * a,
                                          *second = (unsigned char *)rows + size * b;
  memcpy(kept, first, size);
  memcpy(first, second, size);
  memcpy(second, kept, size);
}

/* Moves the points to their places, cycle by cycle, and renumbers the corners within their meshes. */
static void move_points(tw_obj_reader *reader, uint32_t mesh_count, uint32_t *places, const uint32_t *ends) {
  for (uint32_t mesh = 0; mesh < mesh_count; mesh++) {
    uint64_t face, stop;
    face_range(reader, mesh, mesh_count, &face, &stop);
    for (uint64_t c = reader->face_offsets[face], end = face_end(reader, stop - 1); c < end; c++)
      reader->corners[c] = places[reader->corners[c]] - (mesh > 0 ? ends[mesh - 1] : 0);
  }
  for (uint32_t i = 0; i < reader->all.points; i++)
    while (places[i] != i) {
      uint32_t place = places[i];
      swap_rows(reader->positions, 3 * sizeof(float), i, place);
      if (reader->exact) swap_rows(reader->exact, 3 * sizeof(double), i, place);
      if (reader->colors) swap_rows(reader->colors, 4 * sizeof(float), i, place);
      places[i] = places[place];
      places[place] = place;
    }
}

/* Reads the positions again, in double, if those of a mesh may be far. Points are still in the order of the
 * file. */
static tw_status read_exact(tw_obj_reader *reader, obj_bytes file, uint32_t mesh_count) {
  bool may_be_far = false;
  for (uint32_t mesh = 0; mesh < mesh_count && !may_be_far && reader->all.faces > 0; mesh++) {
    uint64_t face, stop;
    face_range(reader, mesh, mesh_count, &face, &stop);
    uint32_t begin = reader->face_offsets[face], end = (uint32_t)face_end(reader, stop - 1);
    may_be_far = tw_points_may_be_far(reader->positions, reader->corners + begin, end - begin);
  }
  if (!may_be_far) return TW_OK;
  reader->exact = tw_alloc((size_t)reader->all.points, 3 * sizeof *reader->exact);
  if (!reader->exact) return tw_obj_fail_memory(reader);
  tw_obj_read_exact(file.bytes, file.size, reader->exact);
  return tw_work_status(reader->error);
}

/* Decides between one mesh and one for each object. Tags number the points and faces of the whole file, so a
 * file with tags stays one mesh. Only the last object may have no faces here.
 * *ends: one past the last point of each mesh, from malloc; NULL for a single mesh. */
static tw_status split_points(tw_obj_reader *reader, obj_bytes file, uint32_t *mesh_count, uint32_t **ends) {
  size_t count = reader->object_count;
  *mesh_count = 1;
  *ends = NULL;
  if (count > 0 && reader->objects[count - 1].first_face == reader->all.faces) count--;
  bool has_tags =
      reader->tags.read.crease_points + reader->tags.read.sharp_points + reader->tags.read.holes > 0;
  if (count < 2 || count > TW_OBJ_OBJECTS_MAX || has_tags) return read_exact(reader, file, 1);
  uint32_t *places = tw_alloc((size_t)reader->all.points, sizeof *places);
  uint32_t *found = tw_alloc(count, sizeof *found);
  bool is_ready = places && found, is_split = is_ready && own_points(reader, (uint32_t)count, places);
  tw_status status =
      is_ready ? read_exact(reader, file, is_split ? (uint32_t)count : 1) : tw_obj_fail_memory(reader);
  if (is_split && status == TW_OK) {
    place_points(reader, (uint32_t)count, places, found);
    move_points(reader, (uint32_t)count, places, found);
    *mesh_count = (uint32_t)count;
    *ends = found;
  } else {
    tw_free(found);
  }
  tw_free(places);
  return status;
}

/* ---- into the model -------------------------------------------------------------------------- */

static tw_status copy_name(tw_obj_reader *reader, tw_word word, const char **out) {
  if (word.length == 0) return TW_OK;
  *out = tw_take_name(&reader->losses, reader->arena, word.text, word.length);
  return *out ? TW_OK : tw_obj_fail_memory(reader);
}

/* The words of a name of at most 1024 bytes, one blank between two. */
static tw_status copy_words(tw_obj_reader *reader, tw_word name, const char **out) {
  char words[1024];
  size_t length = 0;
  for (tw_word word = tw_obj_cut_word(&name); word.length > 0; word = tw_obj_cut_word(&name)) {
    if (length > 0) words[length++] = ' ';
    memcpy(words + length, word.text, word.length);
    length += word.length;
  }
  return copy_name(reader, (tw_word){words, length}, out);
}

typedef tw_status copy_text(tw_obj_reader *reader, tw_word text, const char **out);

/* *out: [names->count]. */
static tw_status copy_names(tw_obj_reader *reader, const tw_obj_names *names, copy_text *copy,
                            uint32_t *count, const char ***out) {
  *count = (uint32_t)names->count;
  if (names->count == 0) return TW_OK;
  *out = tw_arena_alloc(reader->arena, names->count, sizeof **out);
  tw_status status = *out ? TW_OK : tw_obj_fail_memory(reader);
  for (size_t i = 0; i < names->count && status == TW_OK; i++)
    status = copy(reader, names->names[i], &(*out)[i]);
  return status;
}

/* One of the meshes that a file becomes. */
typedef struct obj_part {
  tw_obj_reader *reader;
  uint32_t index, count; /* of the meshes */
  uint64_t first_face, face_stop;
  uint32_t first_corner, corner_stop;
  uint32_t first_point, point_stop;
  uint32_t *uv_marks, *uv_numbers; /* [all.uvs] scratch; NULL for a single mesh */
} obj_part;

/* Takes all colours from sRGB to linear. Where they are whole numbers up to 255, some over 1, that is full
 * intensity. */
static tw_status make_linear(tw_obj_reader *reader) {
  enum { POINTS_A_STEP = 4096 };
  uint64_t beyond = 0, colored = 0;
  bool are_bytes = true;
  for (uint64_t i = 0; reader->colors && i < reader->all.points; i++) {
    const float *color = reader->colors + 4 * i;
    if (color[3] < 1) continue;
    colored++;
    beyond += !(tw_is_color(color[0]) && tw_is_color(color[1]) && tw_is_color(color[2]));
    for (int c = 0; c < 3; c++)
      are_bytes = are_bytes && color[c] >= 0 && color[c] <= 255 && color[c] == floorf(color[c]);
  }
  if (colored == 0) return TW_OK;
  are_bytes = are_bytes && beyond > 0;
  for (uint64_t i = 0; i < reader->all.points; i++) {
    for (uint64_t c = 4 * i; c < 4 * i + 3; c++)
      reader->colors[c] = tw_linear_from_srgb(are_bytes ? reader->colors[c] / 255 : reader->colors[c]);
    if (i % POINTS_A_STEP == POINTS_A_STEP - 1 && !tw_work(POINTS_A_STEP))
      return tw_work_status(reader->error);
  }
  tw_lose(&reader->losses, "colour of a point is divided by 255: all are whole numbers, some over 1",
          "colours of points are divided by 255: all are whole numbers, some over 1", are_bytes ? colored : 0,
          0);
  tw_lose(&reader->losses, "colour is brought into 0 to 1", "colours are brought into 0 to 1",
          are_bytes ? 0 : beyond, 0);
  return TW_OK;
}

/* Points without a colour are white in a mesh where others have one. Returns whether one has. colors:
 * [count][4], alpha 0 where a point has none. */
static bool complete_colors(float *colors, uint32_t count, tw_losses *losses) {
  uint32_t bare = 0;
  for (uint32_t i = 0; i < count; i++) bare += colors[4 * (size_t)i + 3] < 1;
  if (bare == count) return false;
  for (size_t i = 0; i < 4 * (size_t)count && bare > 0; i += 4)
    for (size_t c = 0; c < 4 && colors[i + 3] < 1; c++) colors[i + c] = 1;
  tw_lose(losses, "point has no colour: it is white beside those that have one",
          "points have no colour: they are white beside those that have one", bare, 0);
  return true;
}

static tw_status add_points(const obj_part *part, tw_mesh *mesh) {
  tw_obj_reader *reader = part->reader;
  mesh->point_count = part->point_stop - part->first_point;
  mesh->positions = reader->positions + 3 * (size_t)part->first_point;
  if (!reader->colors) return TW_OK;
  float *colors = reader->colors + 4 * (size_t)part->first_point;
  if (!complete_colors(colors, mesh->point_count, &reader->losses)) return TW_OK;
  return tw_mesh_set_colors(mesh, colors, reader->arena) == TW_OK ? TW_OK : tw_obj_fail_memory(reader);
}

/* Makes the mesh's face offsets in place. They count from its first corner, and each mesh has one offset more
 * than faces: offsets move up, so the last mesh must come first. */
static void add_faces(const obj_part *part, tw_mesh *mesh) {
  const tw_obj_reader *reader = part->reader;
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
  const uint32_t mark = part->index + 1, *corners = part->reader->corner_uvs;
  uint32_t count = 0;
  for (uint32_t c = part->first_corner; c < part->corner_stop; c++) {
    if (corners[c] == TW_OBJ_NO_VALUE || part->uv_marks[corners[c]] == mark) continue;
    part->uv_marks[corners[c]] = mark;
    part->uv_numbers[corners[c]] = count++;
  }
  return count;
}

/* Copies the `count` UVs of a part into `values`, and renumbers its corners. Corners without a UV share one
 * more value, 0 0, at the end. */
static void copy_uvs(const obj_part *part, uint32_t count, float *values) {
  const tw_obj_reader *reader = part->reader;
  if (part->count == 1) memcpy(values, reader->uvs, 2 * (size_t)count * sizeof *values);
  for (uint32_t c = part->first_corner; c < part->corner_stop; c++) {
    uint32_t *corner = &reader->corner_uvs[c];
    if (*corner == TW_OBJ_NO_VALUE) {
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
  tw_obj_reader *reader = part->reader;
  if (!reader->corner_uvs) return TW_OK;
  const uint32_t *corners = reader->corner_uvs + part->first_corner;
  uint32_t missing = 0, count = part->count == 1 ? (uint32_t)reader->all.uvs : count_uvs(part);
  for (uint32_t c = 0; c < mesh->corner_count; c++) missing += corners[c] == TW_OBJ_NO_VALUE;
  if (missing == mesh->corner_count) return TW_OK; /* no corner of this mesh has a UV */
  float *values = tw_arena_alloc_raw(reader->arena, (size_t)count + (missing > 0), 2 * sizeof *values);
  if (!values) return tw_obj_fail_memory(reader);
  copy_uvs(part, count, values);
  tw_lose(&reader->losses, "face corner has no texture coordinate and gets 0 0",
          "face corners have no texture coordinate and get 0 0", missing, 0);
  mesh->uv_set_count = 1;
  mesh->uv_sets[0] = (tw_uv_set){count + (missing > 0), values, corners};
  return TW_OK;
}

/* All meshes share the values; corners without a normal use the last value, 0 0 0. */
static void add_normals(const obj_part *part, tw_mesh *mesh) {
  const tw_obj_reader *reader = part->reader;
  if (!reader->corner_normals) return;
  uint32_t *corners = reader->corner_normals + part->first_corner, none = (uint32_t)reader->all.normals;
  bool has_some = false;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    has_some |= corners[c] != TW_OBJ_NO_VALUE;
    if (corners[c] == TW_OBJ_NO_VALUE) corners[c] = none;
  }
  memset(reader->normals + 3 * (size_t)none, 0, 3 * sizeof *reader->normals);
  if (has_some)
    mesh->normals =
        (tw_corner_normals){.value_count = none + 1, .values = reader->normals, .corners = corners};
}

/* Gives a mesh that is far from the origin a frame of its own. */
static void find_frame(const obj_part *part, tw_mesh *mesh) {
  const tw_obj_reader *reader = part->reader;
  const double *exact = reader->exact ? reader->exact + 3 * (size_t)part->first_point : NULL;
  if (exact && tw_points_find_frame(exact, mesh->corners, mesh->corner_count, mesh->origin))
    tw_points_enter_frame(exact, mesh->point_count, mesh->origin,
                          reader->positions + 3 * (size_t)part->first_point);
}

static void add_tags(const tw_obj_tags *tags, tw_mesh *mesh) {
  mesh->tag_boundary = tags->boundary;
  mesh->tag_uv = tags->uv;
  mesh->tag_creasing = tags->creasing;
  mesh->tag_triangles = tags->triangles;
  mesh->crease_count = (uint32_t)(tags->read.crease_points / 2);
  mesh->crease_edges = tags->crease_points;
  mesh->crease_sharpness = tags->crease_sharpness;
  mesh->sharp_point_count = (uint32_t)tags->read.sharp_points;
  mesh->sharp_points = tags->sharp_points;
  mesh->point_sharpness = tags->point_sharpness;
  mesh->hole_count = (uint32_t)tags->read.holes;
  mesh->holes = tags->holes;
}

/* A mesh of its own has its object's name; the only one that of the first object with a name, else that of
 * the first groups. */
static tw_word find_name(const obj_part *part) {
  const tw_obj_reader *reader = part->reader;
  if (part->count > 1) return reader->objects[part->index].name;
  for (size_t i = 0; i < reader->object_count; i++)
    if (reader->objects[i].name.length > 0) return reader->objects[i].name;
  return reader->first_group;
}

static tw_status build_mesh(const obj_part *part, tw_mesh *mesh) {
  tw_obj_reader *reader = part->reader;
  tw_mesh_init(mesh);
  tw_status status = copy_name(reader, find_name(part), &mesh->name);
  if (status == TW_OK) status = add_points(part, mesh);
  if (status != TW_OK) return status;
  add_faces(part, mesh);
  find_frame(part, mesh);
  add_normals(part, mesh);
  add_tags(&reader->tags, mesh);
  return add_uvs(part, mesh);
}

/* ends: one past the last point of each mesh; NULL for a single mesh. */
static tw_status build_meshes(tw_obj_reader *reader, uint32_t count, const uint32_t *ends, tw_model *model) {
  model->meshes = tw_arena_alloc(reader->arena, count, sizeof *model->meshes);
  size_t uvs = count > 1 ? (size_t)reader->all.uvs : 0;
  uint32_t *scratch = tw_alloc_zero(uvs, 2 * sizeof *scratch);
  tw_status status = model->meshes && scratch ? TW_OK : tw_obj_fail_memory(reader);
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
  tw_free(scratch);
  return status;
}

static void warn(const tw_obj_reader *reader, tw_model *model) {
  if (reader->names_library && model->material_count > 0)
    tw_model_warn(model, "of %u %s stand in other files", model->material_count,
                  tw_plural(model->material_count,
                            "material the name alone is kept: its colours and textures",
                            "materials the names alone are kept: their colours and textures"));
  if (reader->names_library && model->material_count == 0)
    tw_model_warn(model, "the libraries of materials that the file names are left out: no face uses one");
  if (reader->unknown_statements > 0)
    tw_model_warn(
        model, "%llu %s in line %llu: \"%s\" is none that is known",
        (unsigned long long)reader->unknown_statements,
        tw_plural(reader->unknown_statements, "statement is left out,", "statements are left out, the first"),
        (unsigned long long)reader->first_unknown, tw_obj_quote_word(reader->unknown_word).text);
  tw_losses_tell(&reader->losses, model);
}

/* Notes the names of objects that do not come out of a mesh of several. */
static void lose_objects(tw_obj_reader *reader, const tw_model *model) {
  uint64_t objects = reader->object_count;
  bool is_last_empty = objects > 0 && reader->objects[objects - 1].first_face == reader->all.faces;
  if (is_last_empty && reader->all.faces > 0) {
    tw_lose(&reader->losses, "object without faces is left out", "objects without faces are left out", 1, 0);
    objects--;
  }
  if (model->mesh_count == 1 && objects > 1)
    tw_lose(&reader->losses, "object is one mesh with the first one: they share points or tags",
            "objects are one mesh with the first one: they share points or tags, or are over 65536",
            objects - 1, 0);
}

/* Merges points that were duplicated along seams. A file with tags is a control mesh, whose points are meant
 * as they are. */
static tw_status close_seams(const tw_obj_reader *reader, tw_model *model) {
  uint32_t dropped = 0;
  tw_welded all = {0};
  tw_losses losses = {0};
  if (reader->tags.any) return TW_OK;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_merged merged;
    tw_welded welded;
    tw_status status = tw_mesh_close_seams(&model->meshes[i], model->arena, &merged, &welded, reader->error);
    if (status != TW_OK) return status;
    dropped += merged.faces;
    tw_lose_doubled_corners(&losses, merged.shortened);
    tw_add_welded(&all, &welded);
  }
  tw_losses_tell(&losses, model);
  tw_model_warn_count(model, dropped, TW_WELD_DROPPED_FACE, TW_WELD_DROPPED_FACES);
  tw_warn_of_welding(model, &all);
  return TW_OK;
}

/* Tells of texture coordinates or normals that no corner has. corners: [all.corners], or NULL. */
static tw_status lose_unused(tw_obj_reader *reader, const uint32_t *corners, uint64_t count, const char *one,
                             const char *many) {
  bool *is_used = tw_alloc_zero((size_t)count, sizeof *is_used);
  uint64_t unused = count;
  if (!is_used) return tw_obj_fail_memory(reader);
  for (uint64_t c = 0; corners && c < reader->all.corners; c++) {
    if (corners[c] == TW_OBJ_NO_VALUE) continue;
    unused -= !is_used[corners[c]];
    is_used[corners[c]] = true;
  }
  tw_free(is_used);
  tw_lose(&reader->losses, one, many, unused, 0);
  return TW_OK;
}

static tw_status lose_values(tw_obj_reader *reader) {
  tw_status status =
      lose_unused(reader, reader->corner_uvs, reader->all.uvs, "texture coordinate of no corner is left out",
                  "texture coordinates of no corner are left out");
  if (status != TW_OK) return status;
  return lose_unused(reader, reader->corner_normals, reader->all.normals, "normal of no corner is left out",
                     "normals of no corner are left out");
}

static tw_status build_model(tw_obj_reader *reader, obj_bytes file, tw_model *model) {
  uint32_t mesh_count, *ends = NULL;
  tw_status status =
      copy_names(reader, &reader->material_names, copy_name, &model->material_count, &model->material_names);
  if (status == TW_OK)
    status = copy_names(reader, &reader->group_names, copy_words, &model->group_count, &model->group_names);
  if (status == TW_OK) status = split_points(reader, file, &mesh_count, &ends);
  if (status == TW_OK) status = make_linear(reader);
  if (status == TW_OK) status = lose_values(reader);
  if (status == TW_OK) status = build_meshes(reader, mesh_count, ends, model);
  tw_free(ends);
  return status;
}

tw_status tw_obj_read(const uint8_t *bytes, size_t size, tw_weld weld, tw_model **out, tw_error *error) {
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->format = TW_FORMAT_OBJ;
  tw_obj_reader reader = {.arena = model->arena, .error = error};
  tw_status status = tw_obj_read_statements(&reader, bytes, size);
  if (status == TW_OK) status = build_model(&reader, (obj_bytes){bytes, size}, model);
  if (status == TW_OK) lose_objects(&reader, model);
  if (status == TW_OK) warn(&reader, model);
  if (status == TW_OK && weld != TW_WELD_NONE) status = close_seams(&reader, model);
  tw_obj_reader_deinit(&reader);
  return tw_model_end(model, status, out, error);
}

tw_status tw_obj_read_points(const uint8_t *bytes, size_t size, const double at[3], tw_arena *arena,
                             float **out, uint32_t *count, tw_error *error) {
  tw_obj_reader reader = {.arena = tw_arena_create(), .error = error};
  tw_status status = reader.arena ? tw_obj_read_statements(&reader, bytes, size) : TW_NO_MEMORY;
  size_t points = (size_t)reader.all.points;
  float *positions = status == TW_OK ? tw_arena_alloc_raw(arena, points, 3 * sizeof *positions) : NULL;
  double *exact = positions ? tw_alloc(points, 3 * sizeof *exact) : NULL;
  if (status == TW_OK && !exact) status = TW_NO_MEMORY;
  if (status == TW_OK) {
    tw_obj_read_exact(bytes, size, exact);
    status = tw_work_status(error);
  }
  if (status == TW_OK) {
    tw_points_enter_frame(exact, points, at, positions);
    *out = positions;
    *count = (uint32_t)points;
  }
  tw_free(exact);
  tw_obj_reader_deinit(&reader);
  tw_arena_destroy(reader.arena);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
