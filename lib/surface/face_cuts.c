/* Finds the faces that are no fan from their first corner, and cuts them by their shape. Most faces are
 * triangles or convex, so cuts are few. Below level 0 only cages with concave faces are looked at, whose
 * quads may be concave too. */

#include "array.h"
#include "ear_clipping.h"
#include "surface_reader.h"
#include "vector3.h"

/* At a time. */
enum { FACES_READ = 1024 };

typedef struct face_cutter {
  tw_surface *surface;
  tw_ear_clipper clipper;
  float *rows;       /* [points][3] */
  const float **at;  /* [largest face] */
  uint32_t *corners; /* [largest face] rows of the face's corners */
  size_t cut_room;
  uint64_t triangle_room;
} face_cutter;

/* Finds up to three corners from which a fan is right. A fan is given up at its first wrong triangle, which a
 * hostile face could have late: after 256 looks at each corner none is sought any more. */
static uint32_t find_fans(const tw_ear_clipper *clipper, uint32_t size, uint32_t fans[3]) {
  enum { LOOKS = 256 };
  uint32_t count = 0;
  uint64_t looks = LOOKS * (uint64_t)size;
  for (uint32_t i = 0; i < size && count < 3 && looks > 0; i++) {
    uint64_t before = looks;
    if (tw_ear_clipper_is_fan(clipper, i, &looks)) fans[count++] = i;
    if (!tw_work(1 + before - looks)) break;
  }
  return count;
}

static bool has_room(face_cutter *k, uint32_t triangles) {
  tw_surface *s = k->surface;
  tw_face_cut *cuts = tw_array_grow(s->cuts, s->cut_count, sizeof *cuts, &k->cut_room);
  if (!cuts) return false;
  s->cuts = cuts;
  if (s->cut_triangle_count + triangles > k->triangle_room) {
    uint64_t room = 2 * k->triangle_room + triangles;
    void *grown = tw_resize(s->cut_triangles, (size_t)room * sizeof *s->cut_triangles);
    if (!grown) return false;
    s->cut_triangles = grown;
    k->triangle_room = room;
  }
  return true;
}

static void put_fan(uint32_t start, uint32_t size, uint32_t (*out)[3]) {
  for (uint32_t i = 0; i + 2 < size; i++) {
    out[i][0] = start;
    out[i][1] = (start + i + 1) % size;
    out[i][2] = (start + i + 2) % size;
  }
}

/* Lets consecutive triangles begin with different corners: FB_ngon_encoding would join them. */
static void turn_apart(const uint32_t *corners, uint32_t (*triangles)[3], uint32_t count) {
  for (uint32_t i = 1; i < count; i++) {
    uint32_t *t = triangles[i], first = t[0];
    if (corners[first] != corners[triangles[i - 1][0]]) continue;
    t[0] = t[1];
    t[1] = t[2];
    t[2] = first;
  }
}

/* corners: [size] rows. */
static tw_status cut_face(face_cutter *k, uint64_t face, const uint32_t *corners, uint32_t size,
                          const tw_parallel_for *parallel) {
  tw_surface *s = k->surface;
  for (uint32_t i = 0; i < size; i++) k->at[i] = k->rows + 3 * (size_t)corners[i];
  tw_ear_clipper_take(&k->clipper, k->at, size);
  uint64_t looks = size;
  if (tw_ear_clipper_is_fan(&k->clipper, 0, &looks)) return TW_OK;
  if (!has_room(k, size - 2)) return TW_NO_MEMORY;
  tw_face_cut cut = {.face = face, .size = size};
  uint32_t(*triangles)[3] = s->cut_triangles + s->cut_triangle_count, count = size - 2;
  cut.fan_count = find_fans(&k->clipper, size, cut.fans);
  if (cut.fan_count > 0) {
    put_fan(cut.fans[0], size, triangles);
  } else if (s->options.level > 0) { /* its sides cross: no triangles are it */
    return TW_OK;
  } else {
    tw_status status = tw_ear_clipper_cut(&k->clipper, corners, parallel, triangles, &count);
    if (status != TW_OK || count == 0) return status;
    turn_apart(corners, triangles, count);
  }
  s->cuts[s->cut_count++] = cut;
  s->cut_triangle_count += count;
  return tw_work_status(NULL);
}

/* Cuts the polygons of level 0. */
static tw_status cut_polygons(face_cutter *k, tw_surface_reader *reader, const tw_parallel_for *parallel) {
  enum { FACES_AT_ONCE = 4096 };
  const tw_surface *s = k->surface;
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < s->face_count && status == TW_OK; f++) {
    uint32_t size;
    if (f % FACES_AT_ONCE == 0) status = tw_parallel_for_status(parallel);
    if (status != TW_OK || s->corners_before[f + 1] - s->corners_before[f] == 3) continue;
    tw_surface_read_faces(reader, TW_DOMAIN_POINTS, f, 1, &size, k->corners);
    status = cut_face(k, f, k->corners, size, parallel);
  }
  return status;
}

/* Cuts the quads of a level below. */
static tw_status cut_quads(face_cutter *k, tw_surface_reader *reader, const tw_parallel_for *parallel) {
  const uint64_t all = k->surface->counts.faces;
  tw_status status = TW_OK;
  for (uint64_t first = 0; first < all && status == TW_OK; first += FACES_READ) {
    size_t count = all - first < FACES_READ ? (size_t)(all - first) : FACES_READ;
    status = tw_parallel_for_status(parallel);
    if (status == TW_OK) tw_surface_read_faces(reader, TW_DOMAIN_POINTS, first, count, NULL, k->corners);
    for (size_t i = 0; i < count && status == TW_OK; i++)
      status = cut_face(k, first + i, k->corners + 4 * i, 4, parallel);
  }
  return status;
}

static tw_status cut_faces(face_cutter *k, tw_surface_reader *reader, const tw_parallel_for *parallel) {
  tw_surface *s = k->surface;
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, (size_t)tw_surface_row_count(s, TW_DOMAIN_POINTS),
                       k->rows);
  tw_status status =
      s->options.level > 0 ? cut_quads(k, reader, parallel) : cut_polygons(k, reader, parallel);
  uint64_t first = 0;
  for (uint32_t i = 0; i < s->cut_count; i++) { /* the array has stopped moving */
    s->cuts[i].triangles = (const uint32_t(*)[3])s->cut_triangles + first;
    first += s->cuts[i].size - 2;
  }
  return status;
}

/* Whether the face turns back at a corner, seen along its normal. points: [vertices][3]. */
static bool is_concave(const uint32_t *corners, uint32_t size, const double *points) {
  const double *origin = points + 3 * (size_t)corners[0];
  double normal[3] = {0, 0, 0}, cross[3], a[3], b[3];
  for (uint32_t i = 1; i + 1 < size; i++) {
    tw_difference3(points + 3 * (size_t)corners[i], origin, a);
    tw_difference3(points + 3 * (size_t)corners[i + 1], origin, b);
    tw_cross3(a, b, cross);
    for (int c = 0; c < 3; c++) normal[c] += cross[c];
  }
  double least = -1e-6 * tw_dot3(normal, normal);
  for (uint32_t i = 0; i < size; i++) {
    const double *at = points + 3 * (size_t)corners[i],
                 *before = points + 3 * (size_t)corners[i > 0 ? i - 1 : size - 1],
                 *after = points + 3 * (size_t)corners[i + 1 < size ? i + 1 : 0];
    tw_difference3(at, before, a);
    tw_difference3(after, at, b);
    tw_cross3(a, b, cross);
    if (tw_dot3(cross, normal) < least) return true;
  }
  return false;
}

bool tw_cage_is_concave(const tw_topology *cage, const double *points) {
  if (cage->face_size == 3) return false;
  for (uint32_t f = 0; f < cage->face_count; f++) {
    uint32_t size = tw_face_size(cage, f);
    if (size > 3 && is_concave(cage->corner_vertex + tw_face_begin(cage, f), size, points)) return true;
  }
  return false;
}

tw_status tw_surface_cut_faces(tw_surface *surface, const tw_parallel_for *parallel) {
  enum { FACES_MOST = 1 << 18 };
  tw_surface *s = surface;
  uint32_t most = (uint32_t)tw_surface_largest_face(s);
  bool is_level = s->options.level > 0;
  s->has_uncut = most > 3 && is_level && s->counts.faces > FACES_MOST;
  if (most == 3 || s->has_uncut) return TW_OK;
  tw_arena *arena = tw_arena_create();
  tw_surface_reader *reader = tw_surface_reader_create(s);
  if (!arena || !reader) {
    tw_arena_destroy(arena);
    tw_surface_reader_destroy(reader);
    return TW_NO_MEMORY;
  }
  size_t rows = (size_t)tw_surface_row_count(s, TW_DOMAIN_POINTS);
  face_cutter k = {.surface = s,
                   .rows = tw_arena_alloc_raw(arena, rows, 3 * sizeof(float)),
                   .at = tw_arena_alloc_raw(arena, most, sizeof *k.at),
                   .corners = tw_arena_alloc_raw(arena, is_level ? 4 * FACES_READ : most, sizeof *k.corners)};
  bool has_memory = k.rows && k.at && k.corners && tw_ear_clipper_init(&k.clipper, arena, most);
  tw_status status = has_memory ? cut_faces(&k, reader, parallel) : TW_NO_MEMORY;
  tw_surface_reader_destroy(reader);
  tw_arena_destroy(arena);
  return status;
}

bool tw_surface_has_uncut(const tw_surface *surface) {
  return surface->has_uncut || (surface->rim && surface->rim->has_uncut);
}
uint32_t tw_surface_cut_count(const tw_surface *surface) {
  return surface->cut_count;
}
const tw_face_cut *tw_surface_get_cuts(const tw_surface *surface) {
  return surface->cuts;
}
