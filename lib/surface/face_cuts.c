/* Finds the faces that are no fan from their first corner, and cuts them by their shape. Most faces are
 * triangles or convex, so cuts are few. Those of level 0 are listed once. Quads of levels below are looked at
 * when they are read, so that no level is too large: only where a face of the cage is not surely convex or is
 * folded against a neighbour, and there only those of the base's faces that are, or near ones that are.
 * Children of other faces are convex but for some in a million of sharply folded sheets: beside creases that
 * part cells of very different size, and near folds of triangles. */

#include <math.h>

#include "array.h"
#include "ear_clipping.h"
#include "surface_reader.h"
#include "vector3.h"

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

static tw_status cut_faces(face_cutter *k, tw_surface_reader *reader, const tw_parallel_for *parallel) {
  tw_surface *s = k->surface;
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, (size_t)tw_surface_row_count(s, TW_DOMAIN_POINTS),
                       k->rows);
  tw_status status = cut_polygons(k, reader, parallel);
  uint64_t first = 0;
  for (uint32_t i = 0; i < s->cut_count; i++) { /* the array has stopped moving */
    s->cuts[i].triangles = (const uint32_t(*)[3])s->cut_triangles + first;
    first += s->cuts[i].size - 2;
  }
  return status;
}

tw_status tw_surface_cut_faces(tw_surface *surface, const tw_parallel_for *parallel) {
  tw_surface *s = surface;
  uint32_t most = (uint32_t)tw_surface_largest_face(s);
  if (most == 3) return TW_OK;
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
                   .corners = tw_arena_alloc_raw(arena, most, sizeof *k.corners)};
  bool has_memory = k.rows && k.at && k.corners && tw_ear_clipper_init(&k.clipper, arena, most);
  tw_status status = has_memory ? cut_faces(&k, reader, parallel) : TW_NO_MEMORY;
  tw_surface_reader_destroy(reader);
  tw_arena_destroy(arena);
  return status;
}

uint32_t tw_surface_cut_count(const tw_surface *surface) {
  return surface->cut_count;
}
const tw_face_cut *tw_surface_get_cuts(const tw_surface *surface) {
  return surface->cuts;
}

/* ---- quads of levels ------------------------------------------------------------------------- */

/* The normal of a face, as long as twice its area. points: [vertices][3]. */
static void normal_of(const uint32_t *corners, uint32_t size, const double *points, double normal[3]) {
  const double *origin = points + 3 * (size_t)corners[0];
  double cross[3], a[3], b[3];
  if (size == 4) { /* the same by its diagonals */
    tw_difference3(points + 3 * (size_t)corners[2], origin, a);
    tw_difference3(points + 3 * (size_t)corners[3], points + 3 * (size_t)corners[1], b);
    tw_cross3(a, b, normal);
    return;
  }
  tw_difference3(points + 3 * (size_t)corners[1], origin, a);
  if (size == 3) {
    tw_difference3(points + 3 * (size_t)corners[2], origin, b);
    tw_cross3(a, b, normal);
    return;
  }
  for (int c = 0; c < 3; c++) normal[c] = 0;
  for (uint32_t i = 2; i < size; i++) {
    tw_difference3(points + 3 * (size_t)corners[i], origin, b);
    tw_cross3(a, b, cross);
    for (int c = 0; c < 3; c++) normal[c] += cross[c];
    memcpy(a, b, sizeof a);
  }
}

/* The least share of twice a face's area that the triangles at its corners have where its children are surely
 * convex: of faces of cages, and of the quads that triangles become, whose children are further from being
 * concave. */
static const double FULL = 0.2, FULL_OF_TRIANGLES = 0.1;

/* Whether the triangle at a corner of a face looks nearly along the face's normal (a cosine of at least 0.9),
 * and its area along it is at least `share` of twice the face's. Of its normal: the part along the face's,
 * and the square. */
static bool is_full(double along, double square, double of_face, double share) {
  return along >= share * of_face && along * along >= 0.81 * of_face * square;
}

/* Whether the face is convex along any axis from which it is seen when it is cut, as one that is nearly flat
 * is, so that its children are too. */
static bool is_surely_convex(const uint32_t *corners, uint32_t size, const double *points,
                             const double normal[3], double share) {
  double triangle[3], a[3], b[3], of_face = tw_dot3(normal, normal);
  if (!(of_face > 0)) return false;
  tw_difference3(points + 3 * (size_t)corners[0], points + 3 * (size_t)corners[size - 1], a);
  for (uint32_t i = 0; i < (size == 4 ? 2 : size); i++) {
    tw_difference3(points + 3 * (size_t)corners[i + 1 < size ? i + 1 : 0], points + 3 * (size_t)corners[i],
                   b);
    tw_cross3(a, b, triangle);
    double along = tw_dot3(triangle, normal), square = tw_dot3(triangle, triangle);
    if (!is_full(along, square, of_face, share)) return false;
    /* The triangle at the opposite corner of a quad is the rest of it. */
    if (size == 4 && !is_full(of_face - along, of_face - 2 * along + square, of_face, share)) return false;
    memcpy(a, b, sizeof a);
  }
  return true;
}

static bool is_face_convex(const tw_topology *t, uint32_t face, const double *points) {
  const uint32_t *corners = t->corner_vertex + tw_face_begin(t, face);
  double normal[3];
  if (tw_face_size(t, face) == 3) return true;
  normal_of(corners, tw_face_size(t, face), points, normal);
  return is_surely_convex(corners, tw_face_size(t, face), points, normal, FULL);
}

/* Whether the face of a corner, whose normal is `own`, and its neighbour across the edge behind it look away
 * from each other. Their common vertices then move across them, and a child may be concave. The cosine is
 * below -0.5; below -0.7 where all faces are triangles, whose children are further from being concave.
 * normals: [faces][3]. */
static bool is_folded(const tw_topology *t, const double *own, uint32_t corner, const double *normals) {
  const double *other = normals + 3 * (size_t)tw_corner_face(t, t->sibling[corner]);
  double along = tw_dot3(own, other), least = t->face_size == 3 ? 0.5 : 0.25;
  return along < 0 && along * along > least * tw_dot3(own, own) * tw_dot3(other, other);
}

/* normals: [faces][3] receives those of all faces where true is returned. */
static bool are_faces_convex(const tw_topology *cage, const double *points, double *normals) {
  for (uint32_t f = 0; f < cage->face_count; f++) {
    const uint32_t *corners = cage->corner_vertex + tw_face_begin(cage, f);
    uint32_t size = tw_face_size(cage, f);
    normal_of(corners, size, points, normals + 3 * (size_t)f);
    if (size > 3 && !is_surely_convex(corners, size, points, normals + 3 * (size_t)f, FULL)) return false;
  }
  return true;
}

static bool is_convex_everywhere(const tw_topology *cage, const double *points, double *normals) {
  bool is_convex = are_faces_convex(cage, points, normals);
  for (uint32_t f = 0; is_convex && f < cage->face_count; f++) {
    const double *normal = normals + 3 * (size_t)f;
    uint32_t end = tw_face_begin(cage, f) + tw_face_size(cage, f);
    for (uint32_t c = tw_face_begin(cage, f); is_convex && c < end; c++)
      is_convex = cage->sibling[c] <= c || !is_folded(cage, normal, c, normals);
  }
  return is_convex;
}

/* Marks the vertices of faces that may be concave, and those around which the surface is folded: a face looks
 * the other way than its neighbour, or than all of them together. Of faces where is_near is false only those
 * beside others are looked at. normals: [faces][3] scratch, sums: [vertices][3] zeroed. */
static void mark_folds(const tw_topology *t, const double *points, double share, const uint8_t *is_near,
                       double *normals, double *sums, uint8_t *marks) {
  for (uint32_t f = 0; f < t->face_count; f++) {
    const uint32_t *corners = t->corner_vertex + tw_face_begin(t, f);
    uint32_t size = tw_face_size(t, f);
    double *normal = normals + 3 * (size_t)f;
    normal_of(corners, size, points, normal);
    bool marked = size > 3 && is_near[f] && !is_surely_convex(corners, size, points, normal, share);
    for (uint32_t k = 0; k < size; k++) {
      double *sum = sums + 3 * (size_t)corners[k];
      if (marked) marks[corners[k]] = 1;
      for (int c = 0; c < 3; c++) sum[c] += normal[c];
    }
  }
  for (uint32_t f = 0; f < t->face_count; f++) {
    const uint32_t *corners = t->corner_vertex + tw_face_begin(t, f);
    uint32_t begin = tw_face_begin(t, f), size = tw_face_size(t, f);
    for (uint32_t k = 0; is_near[f] && k < size; k++) {
      if (tw_dot3(normals + 3 * (size_t)f, sums + 3 * (size_t)corners[k]) <= 0) marks[corners[k]] = 1;
      if (is_folded(t, normals + 3 * (size_t)f, begin + k, normals))
        marks[corners[k]] = marks[corners[k + 1 < size ? k + 1 : 0]] = 1;
    }
  }
}

/* Leaves of the faces where is_near is true those that have a marked vertex. TW_NO_MEMORY. */
static tw_status find_near(const tw_topology *t, const double *points, double share, uint8_t *is_near) {
  double *normals = tw_alloc(t->face_count, 3 * sizeof *normals);
  double *sums = tw_alloc_zero(t->vertex_count, 3 * sizeof *sums);
  uint8_t *marks = tw_alloc_zero(t->vertex_count, 1);
  bool has_memory = normals && sums && marks;
  if (has_memory) mark_folds(t, points, share, is_near, normals, sums, marks);
  for (uint32_t f = 0; has_memory && f < t->face_count; f++) {
    uint8_t has_mark = 0;
    for (uint32_t k = 0; k < tw_face_size(t, f); k++)
      has_mark |= marks[t->corner_vertex[tw_face_begin(t, f) + k]];
    is_near[f] &= has_mark;
  }
  tw_free(normals);
  tw_free(sums);
  tw_free(marks);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

/* Sets is_near of the triangles that touch a folded edge. Returns whether there are any. normals: [faces][3]
 * scratch, marks: [vertices] zeroed. */
static bool find_folded(const tw_topology *t, const double *points, double *normals, uint8_t *marks,
                        uint8_t *is_near) {
  bool has_any = false;
  for (uint32_t f = 0; f < t->face_count; f++)
    normal_of(t->corner_vertex + 3 * (size_t)f, 3, points, normals + 3 * (size_t)f);
  for (uint32_t f = 0; f < t->face_count; f++)
    for (uint32_t k = 0; k < 3; k++) {
      uint32_t c = 3 * f + k;
      if (t->sibling[c] <= c || !is_folded(t, normals + 3 * (size_t)f, c, normals)) continue;
      marks[t->corner_vertex[c]] = marks[t->corner_vertex[3 * f + (k + 1) % 3]] = 1;
      has_any = true;
    }
  for (uint32_t f = 0; has_any && f < t->face_count; f++) {
    const uint32_t *corners = t->corner_vertex + 3 * (size_t)f;
    is_near[f] = marks[corners[0]] | marks[corners[1]] | marks[corners[2]];
  }
  return has_any;
}

tw_status tw_cage_find_concave(const tw_topology *cage, const double *points, uint8_t **is_near) {
  bool has_triangles = cage->face_size == 3, is_convex = false;
  double *normals = tw_alloc(cage->face_count, 3 * sizeof *normals);
  uint8_t *near = tw_alloc(cage->face_count, 1), *marks = tw_alloc_zero(cage->vertex_count, 1);
  bool has_memory = normals && near && marks;
  if (has_memory && has_triangles)
    is_convex = !find_folded(cage, points, normals, marks, near);
  else if (has_memory)
    is_convex = is_convex_everywhere(cage, points, normals);
  if (has_memory && !has_triangles) memset(near, 1, cage->face_count);
  tw_free(normals);
  tw_free(marks);
  if (!has_memory || is_convex) {
    tw_free(near);
    near = NULL;
  }
  *is_near = near;
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_surface_find_concave(tw_surface *surface, const uint8_t *is_near, const double *points) {
  tw_surface *s = surface;
  const tw_topology *cage = &s->steps[0].topology, *base = &s->steps[s->step_count].topology;
  bool is_answer = s->side == 1 && !s->levels && !s->options.limit; /* the base is */
  double share = cage->face_size == 3 ? FULL_OF_TRIANGLES : FULL;
  s->near_concave = tw_alloc(base->face_count, 1);
  if (!s->near_concave) return TW_NO_MEMORY;
  /* A quad for each corner, then four for each quad, but where an open border leaves some out. */
  uint32_t shift = s->step_count > 0 ? 2 * (s->step_count - 1) : 0;
  uint64_t from = s->step_count > 0 ? cage->corner_count : cage->face_count;
  bool has_all = base->face_count == from << shift;
  for (uint32_t f = 0; f < base->face_count; f++) {
    uint32_t of = s->step_count > 0 && has_all ? tw_corner_face(cage, f >> shift) : f;
    s->near_concave[f] = !has_all || is_near[of];
  }
  if (base->face_size == 3) return TW_OK; /* the cage's own */
  if (!is_answer) return find_near(base, points, share, s->near_concave);
  for (uint32_t f = 0; f < base->face_count; f++) s->near_concave[f] &= !is_face_convex(base, f, points);
  return TW_OK;
}

/* How many faces from `first` on, up to `most`, are near concave ones, or are all not. */
static uint64_t run_of(const tw_surface *s, uint64_t first, uint64_t most, bool *is_near) {
  uint64_t count = 0;
  while (count < most) {
    const tw_face_place at = tw_surface_face_place(s, first + count);
    uint64_t run = at.run;
    bool is_own = at.part == s, near = !is_own; /* all of a rim */
    if (is_own) near = s->near_concave[tw_surface_base_face(s, at.place, &run)];
    if (count == 0) *is_near = near;
    if (near != *is_near) break;
    count += run < at.run ? run : at.run;
  }
  return count < most ? count : most;
}

/* Sorts by the upper 32 bits. keys, spare: [count], of which the sorted one is returned. */
static const uint64_t *sort_keys(uint64_t *keys, uint64_t *spare, size_t count) {
  uint64_t varying = 0;
  for (size_t i = 0; i < count; i++) varying |= keys[i] ^ keys[0];
  for (uint32_t shift = 32; shift < 64; shift += 8) {
    size_t begin[257] = {0};
    if (!(varying >> shift & 255)) continue;
    for (size_t i = 0; i < count; i++) begin[1 + (keys[i] >> shift & 255)]++;
    for (uint32_t d = 0; d < 256; d++) begin[d + 1] += begin[d];
    for (size_t i = 0; i < count; i++) spare[begin[keys[i] >> shift & 255]++] = keys[i];
    uint64_t *sorted = spare;
    spare = keys;
    keys = sorted;
  }
  return keys;
}

/* A corner of the quad before, or of the one a line before, that has the row of the corner `at`, or else
 * `at`: patches have their quads line by line, all from the same corner. line: corners of a line. */
static size_t find_same(const uint32_t *corners, size_t at, size_t line) {
  uint32_t k = at % 4;
  size_t beside = k == 0 ? at - 3 : at - 5, below = k == 0 ? at + 3 - line : at + 1 - line;
  if ((k == 0 || k == 3) && at >= 4 && corners[beside] == corners[at]) return beside;
  return k < 2 && at >= line && corners[below] == corners[at] ? below : at;
}

/* Reads the points of rows in ascending order, as runs, which is cheap. Lets q->at point to each corner's. */
static void read_corners(tw_surface_reader *reader, tw_quad_scratch *q, size_t count) {
  size_t line = 4 * (size_t)reader->surface->side, points = 0, unlike = 0;
  for (size_t i = 0; i < count; i++) {
    q->same[i] = (uint32_t)find_same(q->corners, i, line);
    if (q->same[i] == i) q->keys[unlike++] = (uint64_t)q->corners[i] << 32 | i;
  }
  const uint64_t *keys = sort_keys(q->keys, q->spare, unlike);
  for (size_t i = 0, end; i < unlike; i = end) {
    uint32_t first = (uint32_t)(keys[i] >> 32), rows = 0;
    for (end = i; end < unlike && keys[end] >> 32 <= (uint64_t)first + rows; end++) {
      rows = (uint32_t)(keys[end] >> 32) - first + 1;
      q->at[(uint32_t)keys[end]] = q->points[points + rows - 1];
    }
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, first, rows, q->points[points]);
    points += rows;
  }
  for (size_t i = 0; i < count; i++) q->at[i] = q->at[q->same[i]];
}

/* Lets q->at point to each corner's point: those of a level that is kept are at hand. */
static void find_corners(tw_surface_reader *reader, tw_quad_scratch *q, size_t count) {
  const tw_surface *s = reader->surface;
  if (!s->levels || s->rim || s->inner_faces) {
    read_corners(reader, q, count);
    return;
  }
  for (size_t i = 0; i < count; i++) q->at[i] = (const float *)&s->positions.points[q->corners[i]];
}

/* tw_ear_clipper_is_fan of a quad, from its first corner. */
static bool is_fan(const float *const at[4]) {
  double a[3], b[3], c[3], first[3], second[3], sum[3];
  tw_side3(at[0], at[1], a);
  tw_side3(at[0], at[2], b);
  tw_side3(at[0], at[3], c);
  tw_cross3(a, b, first);
  tw_cross3(b, c, second);
  for (int i = 0; i < 3; i++) sum[i] = first[i] + second[i];
  int axis = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(sum[i]) > fabs(sum[axis])) axis = i;
  double sign = sum[axis] < 0 ? -1 : 1, least = -1e-6 * fabs(sum[axis]);
  return sign * first[axis] >= least && sign * second[axis] >= least;
}

/* Cuts up to TW_QUADS_AT_ONCE quads. Returns how many cuts there are. */
static size_t cut_quads(tw_surface_reader *reader, uint64_t first, size_t count, tw_face_cut *out) {
  static const uint32_t fans[4][2][3] = {
      {{0, 1, 2}, {0, 2, 3}}, {{1, 2, 3}, {1, 3, 0}}, {{2, 3, 0}, {2, 0, 1}}, {{3, 0, 1}, {3, 1, 2}}};
  tw_quad_scratch *q = reader->quads;
  tw_ear_corner corners[4];
  tw_ear_clipper clipper = {.corners = corners};
  size_t cuts = 0;
  tw_surface_read_faces(reader, TW_DOMAIN_POINTS, first, count, NULL, q->corners);
  find_corners(reader, q, 4 * count);
  for (size_t i = 0; i < count; i++) {
    if (is_fan(q->at + 4 * i)) continue;
    tw_ear_clipper_take(&clipper, q->at + 4 * i, 4);
    tw_face_cut cut = {.face = first + i, .size = 4};
    cut.fan_count = find_fans(&clipper, 4, cut.fans);
    if (cut.fan_count == 0) continue; /* its sides cross: no triangles are it */
    cut.triangles = fans[cut.fans[0]];
    out[cuts++] = cut;
  }
  return cuts;
}

/* The index of the first cut of a face at or after this one. */
static uint32_t first_cut(const tw_surface *s, uint64_t face) {
  uint32_t begin = 0, end = s->cut_count;
  while (begin < end) {
    uint32_t middle = begin + (end - begin) / 2;
    if (s->cuts[middle].face < face)
      begin = middle + 1;
    else
      end = middle;
  }
  return begin;
}

size_t tw_surface_read_cuts(tw_surface_reader *reader, uint64_t first, size_t count, tw_face_cut *out) {
  const tw_surface *s = reader->surface;
  uint64_t end = first + count;
  size_t cuts = 0;
  if (s->options.level == 0)
    for (uint32_t i = first_cut(s, first); i < s->cut_count && s->cuts[i].face < end; i++)
      out[cuts++] = s->cuts[i];
  while (s->near_concave && first < end) {
    bool is_near = false;
    uint64_t left = end - first,
             run = run_of(s, first, left < TW_QUADS_AT_ONCE ? left : TW_QUADS_AT_ONCE, &is_near);
    if (is_near) cuts += cut_quads(reader, first, (size_t)run, out + cuts);
    first += run;
  }
  return cuts;
}
