/* Puts what glTF cannot say of a cage into extras.tweend of its meshes (tw_gltf_stream): arrays become
 * accessors of the plan, the rest text. gltf/cage_tags.hpp reads it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cage_vertices.h"
#include "gltf/gltf.h"
#include "sorted.h"

/* ---- reading the surface --------------------------------------------------------------------- */

typedef struct cage_reader {
  const tw_surface *surface;
  tw_surface_reader *reader;
  uint32_t *corners; /* [2][most] of a face, as vertices; then as points */
  size_t most;       /* corners of a face */
  uint32_t *points;  /* [vertices] the point of each */
  uint32_t *firsts;  /* [faces] the vertex that each face's first triangle begins with */
  uint32_t *lasts;   /* [faces] the vertex that each face's last triangle begins with */
  uint32_t *starts;  /* [faces] the corner at which each face's fan of triangles starts; then 0 for SPLIT */
  /* The faces that are no fan: their triangles are polygons of their own. */
  uint32_t split_count, split_corner_count;
  uint32_t *split_triangles; /* [split_count] the number of each one's first triangle */
  uint32_t *split_sizes;     /* [split_count] */
  uint32_t *split_corners;   /* [split_corner_count] vertices, one face after the other */
} cage_reader;

#define SPLIT UINT32_MAX

static size_t read_cage_face(const cage_reader *cage, uint64_t face) {
  return tw_surface_read_faces(cage->reader, TW_DOMAIN_VERTICES, face, 1, NULL, cage->corners);
}

/* Finds the point of each vertex: reads both numberings face by face. */
static void read_points_of_vertices(const cage_reader *cage) {
  const uint32_t *points = cage->corners + cage->most;
  for (uint64_t f = 0; f < tw_surface_get_counts(cage->surface)->faces; f++) {
    size_t size = read_cage_face(cage, f);
    tw_surface_read_faces(cage->reader, TW_DOMAIN_POINTS, f, 1, NULL, cage->corners + cage->most);
    for (size_t c = 0; c < size; c++) cage->points[cage->corners[c]] = points[c];
    cage->firsts[f] = cage->lasts[f] = cage->corners[0];
  }
}

/* The cut of a face at or after *cut, which moves on to it; NULL where it has none. */
static const tw_face_cut *cut_of(const tw_surface *surface, uint64_t face, uint32_t *cut) {
  const tw_face_cut *cuts = tw_surface_get_cuts(surface);
  while (*cut < tw_surface_cut_count(surface) && cuts[*cut].face < face) ++*cut;
  return *cut < tw_surface_cut_count(surface) && cuts[*cut].face == face ? &cuts[*cut] : NULL;
}

/* How a face is written whatever its neighbours are. */
static void start_alone(const cage_reader *cage, uint64_t face, const tw_face_cut *cut) {
  if (!cut) return;
  read_cage_face(cage, face);
  bool is_fan = cut->fan_count > 0;
  uint32_t first = is_fan ? cut->fans[0] : cut->triangles[0][0];
  cage->starts[face] = is_fan ? first : SPLIT;
  cage->firsts[face] = cage->corners[first];
  cage->lasts[face] = cage->corners[is_fan ? first : cut->triangles[cut->size - 3][0]];
}

/* Finds where the fans of the faces start, and which faces are split, as tw_triangulator_read does. */
static void find_starts(const cage_reader *cage) {
  for (uint32_t i = 0; i < tw_surface_group_count(cage->surface);) {
    const tw_surface_group faces = tw_take_material(cage->surface, &i);
    uint32_t at = 0;
    for (uint64_t k = 0; k < faces.face_count; k += 2)
      start_alone(cage, faces.first_face + k, cut_of(cage->surface, faces.first_face + k, &at));
    at = 0;
    for (uint64_t k = 1; k < faces.face_count; k += 2) {
      uint64_t face = faces.first_face + k;
      uint32_t size = (uint32_t)read_cage_face(cage, face), *start = &cage->starts[face];
      const uint32_t *next = k + 1 < faces.face_count ? &cage->firsts[face + 1] : NULL;
      if (!tw_fan_start(cage->corners, size, cut_of(cage->surface, face, &at), &cage->lasts[face - 1], next,
                        start))
        *start = SPLIT;
    }
  }
}

static uint32_t size_of(const tw_surface *surface, uint64_t face) {
  return (uint32_t)(tw_surface_corners_before(surface, face + 1) - tw_surface_corners_before(surface, face));
}

/* Lists the faces that are split. False without memory. */
static bool list_splits(cage_reader *cage, uint64_t faces, tw_arena *arena) {
  uint32_t corners = 0;
  for (uint64_t f = 0; f < faces; f++) {
    if (cage->starts[f] != SPLIT) continue;
    cage->split_count++;
    cage->split_corner_count += size_of(cage->surface, f);
  }
  if (cage->split_count == 0) return true;
  cage->split_triangles = tw_arena_alloc_raw(arena, cage->split_count, sizeof *cage->split_triangles);
  cage->split_sizes = tw_arena_alloc_raw(arena, cage->split_count, sizeof *cage->split_sizes);
  cage->split_corners = tw_arena_alloc_raw(arena, cage->split_corner_count, sizeof *cage->split_corners);
  if (!cage->split_triangles || !cage->split_sizes || !cage->split_corners) return false;
  for (uint64_t f = 0, i = 0; f < faces; f++) {
    if (cage->starts[f] != SPLIT) continue;
    cage->starts[f] = 0;
    uint32_t size = (uint32_t)read_cage_face(cage, f);
    memcpy(cage->split_corners + corners, cage->corners, size * sizeof *cage->corners);
    corners += size;
    cage->split_triangles[i] = (uint32_t)(tw_surface_corners_before(cage->surface, f) - 2 * f);
    cage->split_sizes[i++] = size;
  }
  return true;
}

/* Reads the surface into arrays in the arena. False without memory. */
static bool read_cage(cage_reader *cage, const tw_surface *surface, tw_arena *arena) {
  size_t faces = (size_t)tw_surface_get_counts(surface)->faces, most = tw_surface_largest_face(surface);
  uint64_t vertices = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  *cage = (cage_reader){.surface = surface,
                        .reader = tw_surface_reader_create(surface),
                        .corners = tw_alloc(most, 2 * sizeof *cage->corners),
                        .most = most,
                        .points = tw_arena_alloc(arena, (size_t)vertices, sizeof *cage->points),
                        .firsts = tw_arena_alloc_raw(arena, faces, sizeof *cage->firsts),
                        .lasts = tw_arena_alloc_raw(arena, faces, sizeof *cage->lasts),
                        .starts = tw_arena_alloc(arena, faces, sizeof *cage->starts)};
  bool has_memory =
      cage->reader && cage->corners && cage->points && cage->firsts && cage->lasts && cage->starts;
  if (has_memory) {
    read_points_of_vertices(cage);
    find_starts(cage);
    has_memory = list_splits(cage, faces, arena);
  }
  return has_memory;
}

static void cage_reader_deinit(cage_reader *cage) {
  tw_surface_reader_destroy(cage->reader);
  tw_free(cage->corners);
}

static bool is_ascending(const uint32_t *values, uint64_t count) {
  for (uint64_t i = 1; i < count; i++)
    if (values[i] < values[i - 1]) return false;
  return true;
}

static bool is_all_zero(const uint32_t *values, uint64_t count) {
  for (uint64_t i = 0; i < count; i++)
    if (values[i] != 0) return false;
  return true;
}

/* ---- text ------------------------------------------------------------------------------------ */

/* Prints the tags of one mesh. */
typedef struct tag_writer {
  tw_gltf_plan *plan;
  const tw_model *model;
  const tw_surface *surface;
  tw_text text;
} tag_writer;

static void put_numbers(tag_writer *w, const char *member, const void *values, uint64_t count, int component,
                        int width) {
  tw_member_count(&w->text, member, tw_gltf_add_numbers(w->plan, values, count, component, width));
}

static void put_indices(tag_writer *w, const char *member, const uint32_t *values, uint64_t count) {
  put_numbers(w, member, values, count, TW_GLTF_UNSIGNED_INT, 1);
}

/* A member with elements of `width` points, called `of`, and their sharpness. */
static void put_sharpness(tag_writer *w, const char *member, const char *of, const uint32_t *points,
                          uint64_t width, const float *sharpness, uint64_t count) {
  if (count == 0) return;
  tw_member_open(&w->text, member, "{");
  put_indices(w, of, points, width * count);
  put_numbers(w, "sharpness", sharpness, count, TW_GLTF_FLOAT, 1);
  tw_text_add(&w->text, "}");
}

/* Lists the sets of groups that faces of the surface are in, ascending, each once. Returns how many. */
static uint32_t list_sets(const tw_surface *surface, uint32_t *sets) {
  uint32_t count = 0, different = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface); g++) {
    sets[count] = tw_surface_get_group(surface, g)->names;
    count += sets[count] != TW_NO_INDEX;
  }
  qsort(sets, count, sizeof *sets, tw_compare_uint32);
  for (uint32_t i = 0; i < count; i++)
    if (i == 0 || sets[i] != sets[different - 1]) sets[different++] = sets[i];
  return different;
}

/* Prints the names of the sets of groups that faces of the mesh are in, and the set of each face by its place
 * among these. False without memory. */
static bool put_groups(tag_writer *w) {
  uint64_t faces = tw_surface_get_counts(w->surface)->faces;
  if (!w->plan->names_groups) return true;
  uint32_t *sets = tw_arena_alloc_raw(w->plan->arena, tw_surface_group_count(w->surface), sizeof *sets);
  if (!sets) return false;
  uint32_t count = list_sets(w->surface, sets);
  if (count == 0) return true;
  uint32_t *groups = tw_arena_alloc_raw(w->plan->arena, (size_t)faces, sizeof *groups), *next = groups;
  if (!groups) return false;
  for (uint32_t g = 0; g < tw_surface_group_count(w->surface); g++) {
    const tw_surface_group *group = tw_surface_get_group(w->surface, g);
    uint32_t set = group->names == TW_NO_INDEX ? TW_NO_INDEX : tw_lower_bound(sets, count, group->names);
    for (uint64_t f = 0; f < group->face_count; f++) *next++ = set;
  }
  tw_member_open(&w->text, "groups", "{");
  tw_member_open(&w->text, "names", "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(&w->text);
    tw_text_string(&w->text, w->model->group_names[sets[i]]);
  }
  tw_text_add(&w->text, "]");
  put_indices(w, "faces", groups, faces);
  tw_text_add(&w->text, "}");
  return true;
}

static void put_holes(tag_writer *w, const tw_gltf_mesh *mesh) {
  if (mesh->hole_count == 0) return;
  tw_member_open(&w->text, "holes", "[");
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    const tw_gltf_primitive *hole = &mesh->primitives[mesh->primitive_count + i];
    int32_t material = tw_model_material(w->model, hole->faces.material - TW_HOLE_MATERIAL - 1);
    tw_text_element(&w->text);
    tw_text_add(&w->text, "{");
    tw_member_count(&w->text, "indices", hole->indices);
    if (material >= 0) tw_member_count(&w->text, "material", (uint64_t)material);
    tw_text_add(&w->text, "}");
  }
  tw_text_add(&w->text, "]");
}

static void put_polygons(tag_writer *w, const cage_reader *cage) {
  if (cage->split_count == 0) return;
  tw_member_open(&w->text, "polygons", "{");
  put_indices(w, "triangles", cage->split_triangles, cage->split_count);
  put_indices(w, "sizes", cage->split_sizes, cage->split_count);
  put_indices(w, "corners", cage->split_corners, cage->split_corner_count);
  tw_text_add(&w->text, "}");
}

static void put_details(tag_writer *w, const tw_mesh *mesh) {
  if (mesh->detail_count == 0) return;
  tw_member_open(&w->text, "details", "[");
  for (uint32_t i = 0; i < mesh->detail_count; i++) {
    const tw_detail *detail = &mesh->details[i];
    tw_text_element(&w->text);
    tw_text_add(&w->text, "{");
    tw_member_count(&w->text, "level", detail->level);
    put_numbers(w, "offsets", detail->offsets, detail->vertex_count, TW_GLTF_FLOAT, 3);
    tw_text_add(&w->text, "}");
  }
  tw_text_add(&w->text, "]");
}

/* Prints a channel's name in glTF. */
static void put_channel_name(tag_writer *w, const tw_mesh *mesh, uint32_t channel) {
  char uvs[24];
  const tw_attribute *attribute = tw_channel_attribute(mesh, channel);
  snprintf(uvs, sizeof uvs, "TEXCOORD_%u", channel);
  tw_text_element(&w->text);
  tw_text_string(&w->text, attribute ? attribute->name : uvs);
  tw_text_add(&w->text, ":");
}

/* Prints which vertices share a value, of each channel of which the values themselves do not tell. False
 * without memory. */
static bool put_values(tag_writer *w, const tw_mesh *mesh) {
  tw_channel channels[TW_CHANNELS_MAX];
  uint32_t count = tw_mesh_channels(mesh, channels);
  if (count == 0) return true;
  tw_cage_vertices vertices;
  bool any = false, has_memory = tw_cage_vertices_init(&vertices, w->surface, mesh) == TW_OK;
  for (uint32_t i = 0; i < count && has_memory; i++) {
    uint32_t *number = tw_arena_alloc_raw(w->plan->arena, vertices.count, sizeof *number);
    tw_cage_changes changes = {0};
    has_memory = number && tw_cage_vertices_number(&vertices, i, number, &changes) == TW_OK;
    if (!changes.joins_values && !changes.parts_values) continue;
    if (!any) tw_member_open(&w->text, "values", "{");
    any = true;
    put_channel_name(w, mesh, i);
    tw_text_count(&w->text, tw_gltf_add_numbers(w->plan, number, vertices.count, TW_GLTF_UNSIGNED_INT, 1));
  }
  if (any) tw_text_add(&w->text, "}");
  tw_cage_vertices_deinit(&vertices);
  return has_memory;
}

static void put_rules(tag_writer *w, const tw_mesh *mesh) {
  const struct {
    const char *name;
    int value;
  } rules[] = {{"boundary", mesh->tag_boundary},
               {"uv", mesh->tag_uv},
               {"creasing", mesh->tag_creasing},
               {"triangles", mesh->tag_triangles}};
  bool any = false;
  for (size_t i = 0; i < sizeof rules / sizeof *rules; i++) {
    if (rules[i].value == TW_TAG_UNSET) continue;
    if (!any) tw_member_open(&w->text, "rules", "{");
    any = true;
    tw_member_count(&w->text, rules[i].name, (uint64_t)rules[i].value);
  }
  if (any) tw_text_add(&w->text, "}");
}

/* Prints the tags of vertices, and the order of faces and of their corners. False without memory. */
static bool put_vertices(tag_writer *w, const tw_mesh *mesh) {
  const uint32_t *order = tw_surface_get_tags(w->surface)->faces;
  uint64_t faces = tw_surface_get_counts(w->surface)->faces;
  cage_reader cage;
  bool has_memory = read_cage(&cage, w->surface, w->plan->arena);
  if (has_memory) {
    put_indices(w, "points", cage.points, tw_surface_row_count(w->surface, TW_DOMAIN_VERTICES));
    if (!is_ascending(order, faces)) put_indices(w, "faces", order, faces);
    if (!is_all_zero(cage.starts, faces)) put_indices(w, "starts", cage.starts, faces);
    put_polygons(w, &cage);
    has_memory = put_values(w, mesh);
  }
  cage_reader_deinit(&cage);
  return has_memory;
}

/* False without memory. */
static bool put_tags(tag_writer *w, const tw_scene *scene, uint32_t index) {
  const tw_mesh *mesh = &scene->model->meshes[index];
  const tw_surface_tags *tags = tw_surface_get_tags(w->surface);
  tw_text_add(&w->text, "{");
  if (!put_vertices(w, mesh)) return false;
  put_sharpness(w, "creases", "edges", tags->crease_edges, 2, tags->crease_sharpness, tags->crease_count);
  put_sharpness(w, "corners", "vertices", tags->sharp_points, 1, tags->point_sharpness,
                tags->sharp_point_count);
  if (!put_groups(w)) return false;
  put_holes(w, &w->plan->meshes[index]);
  if (!scene->is_without_details) put_details(w, mesh);
  put_rules(w, mesh);
  if (!mesh->normals.corners && tw_surface_get_layout(w->surface)->normal != UINT32_MAX)
    tw_member_count(&w->text, "computed_normals", 1);
  if (mesh->has_tangents_alone && tw_surface_get_layout(w->surface)->tangent == UINT32_MAX)
    tw_member_count(&w->text, "tangents", 1);
  tw_text_add(&w->text, "}");
  return !w->text.failed;
}

bool tw_gltf_add_cage_tags(tw_gltf_plan *plan, const tw_scene *scene, uint32_t index) {
  tag_writer w = {.plan = plan, .model = scene->model, .surface = scene->surfaces[index]};
  if (scene->polygons != TW_POLYGONS_NGON || !tw_surface_get_tags(w.surface)) return true;
  const char *text = put_tags(&w, scene, index) ? tw_arena_text(plan->arena, w.text.data, w.text.size) : NULL;
  plan->meshes[index].tags = text;
  tw_text_deinit(&w.text);
  return text;
}

/* ---- holes ----------------------------------------------------------------------------------- */

tw_status tw_mesh_open_holes(const tw_mesh *mesh, tw_arena *arena, tw_mesh *out) {
  *out = *mesh;
  if (mesh->hole_count == 0) return TW_OK;
  int32_t *materials = tw_arena_alloc_raw(arena, mesh->face_count, sizeof *materials);
  if (!materials) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    materials[f] = mesh->face_materials ? mesh->face_materials[f] : -1;
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    int32_t *material = &materials[mesh->holes[i]];
    if (*material < TW_HOLE_MATERIAL) *material += TW_HOLE_MATERIAL + 1; /* a hole may be named twice */
  }
  out->face_materials = materials;
  out->holes = NULL;
  out->hole_count = 0;
  return TW_OK;
}
