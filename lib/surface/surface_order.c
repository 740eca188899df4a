/* The order of an answer's faces: by material, then by set of named groups, then as in the cage. */

#include "surface.h"

/* A face with the keys that it is ordered by. Faces are those of the cage or, where `sources` are given, of
 * the base. */
typedef struct ordered_face {
  int32_t material;
  uint32_t names, face;
} ordered_face;

/* A face with the material and the set of names of the cage's face `source`. */
static ordered_face ordered_as(const tw_mesh *mesh, uint32_t source, uint32_t face) {
  return (ordered_face){mesh->face_materials ? mesh->face_materials[source] : -1,
                        mesh->face_groups ? mesh->face_groups[source] : UINT32_MAX, face};
}

static int compare_groups(const ordered_face *a, const ordered_face *b) {
  if (a->material != b->material) return a->material < b->material ? -1 : 1;
  return a->names < b->names ? -1 : a->names > b->names;
}

static int compare_ordered(const void *left, const void *right) {
  const ordered_face *a = left, *b = right;
  int groups = compare_groups(a, b);
  if (groups != 0) return groups;
  return a->face < b->face ? -1 : a->face > b->face;
}

uint32_t tw_ordered_groups(const tw_mesh *mesh, const uint8_t *visible) {
  uint32_t count = mesh->face_count > 0;
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    if (!visible[f]) return 0;
    if (f == 0 || (!mesh->face_materials && !mesh->face_groups)) continue;
    ordered_face before = ordered_as(mesh, f - 1, f - 1), own = ordered_as(mesh, f, f);
    int order = compare_groups(&before, &own);
    if (order > 0) return 0;
    count += order < 0;
  }
  return count;
}

/* ---- groups ---------------------------------------------------------------------------------- */

/* How many faces and corners of the answer one ordered face makes. */
typedef struct face_yield {
  uint64_t faces, corners;
} face_yield;

static face_yield yield_of(const tw_surface *s, const tw_face_order *from, uint32_t face) {
  uint64_t faces = (uint64_t)s->side * s->side, corners = s->fields[0].base.face_size;
  if (s->options.level > 0 && from->sources) return (face_yield){faces, corners * faces};
  uint64_t size = from->mesh->face_offsets[face + 1] - from->mesh->face_offsets[face];
  if (s->options.level == 0) return (face_yield){1, size};
  if (from->levels > 0)
    faces *= s->options.scheme == TW_LOOP ? (uint64_t)1 << 2 * from->levels : size << 2 * (from->levels - 1);
  return (face_yield){faces, corners * faces};
}

static tw_status make_groups(tw_surface *s, const tw_face_order *from, const ordered_face *order,
                             uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    s->group_count += i == 0 || compare_groups(&order[i], &order[i - 1]) != 0;
  s->groups = tw_arena_alloc(s->arena, s->group_count, sizeof *s->groups);
  if (!s->groups) return TW_NO_MEMORY;
  uint32_t group = 0;
  uint64_t faces = 0, corners = 0;
  for (uint32_t i = 0; i < count; i++) {
    if (i > 0 && compare_groups(&order[i], &order[i - 1]) != 0) group++;
    tw_surface_group *g = &s->groups[group];
    if (g->face_count == 0) *g = (tw_surface_group){order[i].material, order[i].names, faces, 0, corners, 0};
    face_yield yield = yield_of(s, from, order[i].face);
    g->face_count += yield.faces;
    g->corner_count += yield.corners;
    faces += yield.faces;
    corners += yield.corners;
  }
  return TW_OK;
}

static tw_status make_one_group(tw_surface *s, const tw_mesh *mesh) {
  uint64_t faces = (uint64_t)s->fields[0].base.face_count * s->side * s->side;
  ordered_face all = ordered_as(mesh, 0, 0);
  s->group_count = 1;
  s->groups = tw_arena_alloc(s->arena, 1, sizeof *s->groups);
  if (!s->groups) return TW_NO_MEMORY;
  *s->groups = (tw_surface_group){all.material, all.names, 0, faces, 0, s->fields[0].base.face_size * faces};
  return TW_OK;
}

/* ---- faces ----------------------------------------------------------------------------------- */

/* Lists the visible faces of the cage in their order. */
static tw_status list_faces(tw_surface *s, const tw_face_order *from, const ordered_face *order,
                            uint32_t count) {
  s->face_count = count;
  s->face_first = tw_arena_alloc(s->arena, count, sizeof *s->face_first);
  s->corners_before = tw_arena_alloc(s->arena, (size_t)count + 1, sizeof *s->corners_before);
  if (!s->face_first || !s->corners_before) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < count; i++) {
    s->face_first[i] = from->mesh->face_offsets[order[i].face];
    uint32_t face = order[i].face;
    s->corners_before[i + 1] =
        s->corners_before[i] + from->mesh->face_offsets[face + 1] - from->mesh->face_offsets[face];
  }
  return TW_OK;
}

static tw_status list_quads(tw_surface *s, const ordered_face *order, uint32_t count) {
  s->quad_count = count;
  s->quads = tw_arena_alloc(s->arena, count, sizeof *s->quads);
  if (!s->quads) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < count; i++) s->quads[i] = order[i].face;
  return TW_OK;
}

/* Collects the visible faces and orders them. sources: the cage's face of each; NULL: the faces are the
 * cage's own. */
static tw_status order_faces(const tw_face_order *from, const uint32_t *sources, uint32_t face_count,
                             ordered_face *order, uint32_t *count) {
  *count = 0;
  for (uint32_t f = 0; f < face_count; f++) {
    uint32_t source = sources ? sources[f] : f;
    if (from->visible[source] && (!sources || !from->part || from->part[f]))
      order[(*count)++] = ordered_as(from->mesh, source, f);
  }
  return tw_sort(order, *count, sizeof *order, compare_ordered);
}

tw_status tw_surface_order(tw_surface *surface, const tw_face_order *from) {
  tw_surface *s = surface;
  bool cage_level = s->options.level == 0, as_it_is = !cage_level && !from->sources;
  if (as_it_is) s->quad_count = s->fields[0].base.face_count;
  if (as_it_is && tw_ordered_groups(from->mesh, from->visible) == 1) return make_one_group(s, from->mesh);
  const uint32_t *sources = cage_level ? NULL : from->sources;
  uint32_t all = sources ? s->fields[0].base.face_count : from->mesh->face_count;
  ordered_face *order = tw_alloc(all, sizeof *order);
  if (!order) return TW_NO_MEMORY;
  uint32_t count;
  tw_status status = order_faces(from, sources, all, order, &count);
  if (status == TW_OK) status = make_groups(s, from, order, count);
  if (status == TW_OK && !sources) status = list_faces(s, from, order, count);
  if (status == TW_OK && sources) status = list_quads(s, order, count);
  tw_free(order);
  return status;
}
