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

/* As long as twice the area of its face; its square stands beside it. */
typedef struct face_normal {
  double axis[3], square;
} face_normal;

/* The normal of a face that is no quad. points: [vertices][3]. */
static face_normal normal_of(const uint32_t *corners, uint32_t size, const double *points) {
  const double *origin = points + 3 * (size_t)corners[0];
  double a[3], b[3], cross[3];
  face_normal n = {{0}, 0};
  tw_difference3(points + 3 * (size_t)corners[1], origin, a);
  for (uint32_t i = 2; i < size; i++) {
    tw_difference3(points + 3 * (size_t)corners[i], origin, b);
    tw_cross3(a, b, cross);
    for (int c = 0; c < 3; c++) n.axis[c] += cross[c];
    memcpy(a, b, sizeof a);
  }
  n.square = tw_dot3(n.axis, n.axis);
  return n;
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

/* Whether the triangle between two edges that follow each other is full, and of a quad also the one at the
 * opposite corner, which is the rest of it. */
static bool is_full_at(const double a[3], const double b[3], bool of_quad, const face_normal *normal,
                       double share) {
  double triangle[3], of_face = normal->square;
  tw_cross3(a, b, triangle);
  double along = tw_dot3(triangle, normal->axis), square = tw_dot3(triangle, triangle);
  if (!is_full(along, square, of_face, share)) return false;
  return !of_quad || is_full(of_face - along, of_face - 2 * along + square, of_face, share);
}

static bool is_polygon_convex(const uint32_t *corners, uint32_t size, const double *points,
                              const face_normal *normal, double share) {
  double a[3], b[3];
  tw_difference3(points + 3 * (size_t)corners[0], points + 3 * (size_t)corners[size - 1], a);
  for (uint32_t i = 0; i < size; i++) {
    tw_difference3(points + 3 * (size_t)corners[i + 1 < size ? i + 1 : 0], points + 3 * (size_t)corners[i],
                   b);
    if (!is_full_at(a, b, false, normal, share)) return false;
    memcpy(a, b, sizeof a);
  }
  return true;
}

/* The normals of the triangles at a quad's corners are half of its own and, added or taken away, the cross
 * product of a diagonal and the vector between the middles of the diagonals. Where that is at most 0.4 of the
 * half, their share is at least 0.3 and their cosine 0.916, so that most quads need no closer look. */
static inline bool is_quad_convex(const uint32_t *corners, const double *points, double share,
                                  face_normal *normal) {
  const double *at[4];
  double p[3], q[3], twice[3];
  for (int i = 0; i < 4; i++) at[i] = points + 3 * (size_t)corners[i];
  for (int i = 0; i < 3; i++) {
    p[i] = at[2][i] - at[0][i];
    q[i] = at[3][i] - at[1][i];
    twice[i] = at[0][i] + at[2][i] - at[1][i] - at[3][i];
  }
  tw_cross3(p, q, normal->axis);
  normal->square = tw_dot3(normal->axis, normal->axis);
  double square_p = tw_dot3(p, p), square_q = tw_dot3(q, q),
         longest = square_p > square_q ? square_p : square_q;
  if (!(normal->square > 0)) return false;
  if (tw_dot3(twice, twice) * longest <= 0.16 * normal->square) return true;
  double sides[3][3];
  for (int i = 0; i < 3; i++) tw_difference3(at[i], at[(i + 3) % 4], sides[i]);
  return is_full_at(sides[0], sides[1], true, normal, share) &&
         is_full_at(sides[1], sides[2], true, normal, share);
}

/* Whether the face is convex along any axis from which it is seen when it is cut, as one that is nearly flat
 * is, so that its children are too. *normal receives that of the face. */
static inline bool is_surely_convex(const uint32_t *corners, uint32_t size, const double *points,
                                    double share, face_normal *normal) {
  if (size == 4) return is_quad_convex(corners, points, share, normal);
  *normal = normal_of(corners, size, points);
  return size == 3 || (normal->square > 0 && is_polygon_convex(corners, size, points, normal, share));
}

/* Finds the normals of all faces, and marks the vertices of those that may be concave. Returns whether there
 * are any. Of those where is_near is false only the normals are wanted. normals: [faces], marks: [vertices].
 */
static bool mark_concave(const tw_topology *topology, const double *points, double share,
                         const uint8_t *is_near, face_normal *normals, uint8_t *marks) {
  const tw_topology t = *topology; /* of its own, so that writing marks does not seem to change it */
  bool has_any = false;
  for (uint32_t f = 0; f < t.face_count; f++) {
    const uint32_t *corners = t.corner_vertex + tw_face_begin(&t, f), size = tw_face_size(&t, f);
    if (is_surely_convex(corners, size, points, share, &normals[f]) || !is_near[f]) continue;
    for (uint32_t k = 0; k < size; k++) marks[corners[k]] = 1;
    has_any = true;
  }
  return has_any;
}

/* Marks the ends of edges at which the surface is folded: two faces there look away from each other. Their
 * common vertices then move across them, and a child may be concave. The cosine is below -0.5; below -0.7
 * where all faces are triangles, whose children are further from being concave. Looks at edges of faces where
 * is_near is true, or of all (NULL). Returns whether there are any. normals: [faces]. */
static bool mark_folds(const tw_topology *topology, const uint8_t *is_near, const face_normal *normals,
                       uint8_t *marks) {
  const tw_topology t = *topology;
  bool has_any = false;
  double least = t.face_size == 3 ? 0.5 : 0.25;
  for (uint32_t e = 0; e < t.edge_count; e++) {
    uint32_t first = t.edge_corner[e], corner = first;
    do {
      uint32_t face = tw_corner_face(&t, corner), beside = tw_corner_face(&t, corner = t.sibling[corner]);
      const face_normal *a = &normals[face], *b = &normals[beside];
      double along = tw_dot3(a->axis, b->axis);
      if (along >= 0 || along * along <= least * a->square * b->square) continue;
      if (is_near && !is_near[face] && !is_near[beside]) continue;
      marks[t.edge_vertices[e][0]] = marks[t.edge_vertices[e][1]] = 1;
      has_any = true;
    } while (corner != first && t.edge_flags[e] & TW_EDGE_NONMANIFOLD); /* else there are two, or one */
  }
  return has_any;
}

/* Marks the vertices at which a face that is near looks the other way than all faces there together. */
static void mark_turned(const tw_topology *topology, const uint8_t *is_near, const face_normal *normals,
                        uint8_t *marks) {
  const tw_topology t = *topology;
  for (uint32_t v = 0; v < t.vertex_count; v++) {
    double sum[3] = {0};
    uint32_t begin = t.fan_offsets[v], end = t.fan_offsets[v + 1];
    for (uint32_t i = begin; i < end; i++) {
      const face_normal *normal = &normals[tw_corner_face(&t, t.fan_corners[i])];
      for (int c = 0; c < 3; c++) sum[c] += normal->axis[c];
    }
    for (uint32_t i = begin; i < end; i++) {
      uint32_t face = tw_corner_face(&t, t.fan_corners[i]);
      if (tw_dot3(normals[face].axis, sum) <= 0 && is_near[face]) marks[v] = 1;
    }
  }
}

/* Leaves of the faces where is_near is true those that have a marked vertex. */
static void keep_marked(const tw_topology *topology, const uint8_t *marks, uint8_t *is_near) {
  const tw_topology t = *topology;
  for (uint32_t f = 0; f < t.face_count; f++) {
    const uint32_t *corners = t.corner_vertex + tw_face_begin(&t, f), size = tw_face_size(&t, f);
    uint8_t has_mark = 0;
    for (uint32_t k = 0; k < size; k++) has_mark |= marks[corners[k]];
    is_near[f] &= has_mark;
  }
}

/* Leaves of the faces where is_near is true those that may be concave or are near such ones, or near folds.
 * Where none is and there is no fold, `surely` lets none be left. TW_NO_MEMORY. */
static tw_status find_near(const tw_topology *t, const double *points, double share, bool surely,
                           uint8_t *is_near) {
  face_normal *normals = tw_alloc(t->face_count, sizeof *normals);
  uint8_t *marks = tw_alloc_zero(t->vertex_count, 1);
  bool has_memory = normals && marks;
  if (has_memory) {
    bool has_concave = mark_concave(t, points, share, is_near, normals, marks);
    bool has_folds = mark_folds(t, is_near, normals, marks);
    if (has_concave || has_folds || !surely) mark_turned(t, is_near, normals, marks);
    keep_marked(t, marks, is_near);
  }
  tw_free(normals);
  tw_free(marks);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

/* Whether all faces are surely convex and none is folded against another. Of triangles, sets is_near of those
 * that touch a folded edge. normals: [faces] scratch, marks: [vertices] zeroed. */
static bool is_convex_everywhere(const tw_topology *t, const double *points, face_normal *normals,
                                 uint8_t *marks, uint8_t *is_near) {
  for (uint32_t f = 0; f < t->face_count; f++) {
    const uint32_t *corners = t->corner_vertex + tw_face_begin(t, f);
    if (!is_surely_convex(corners, tw_face_size(t, f), points, FULL, &normals[f])) return false;
  }
  if (!mark_folds(t, NULL, normals, marks)) return true;
  if (t->face_size == 3) keep_marked(t, marks, is_near);
  return false;
}

tw_status tw_cage_find_concave(const tw_topology *cage, const double *points, uint8_t **is_near) {
  face_normal *normals = tw_alloc(cage->face_count, sizeof *normals);
  uint8_t *near = tw_alloc(cage->face_count, 1), *marks = tw_alloc_zero(cage->vertex_count, 1);
  bool has_memory = normals && near && marks;
  if (has_memory) memset(near, 1, cage->face_count);
  if (!has_memory || is_convex_everywhere(cage, points, normals, marks, near)) {
    tw_free(near);
    near = NULL;
  }
  tw_free(normals);
  tw_free(marks);
  *is_near = near;
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_surface_find_concave(tw_surface *surface, const uint8_t *is_near, const double *points) {
  tw_surface *s = surface;
  const tw_topology *cage = &s->steps[0].topology, *base = &s->steps[s->step_count].topology;
  bool is_answer = s->side == 1 && !s->levels && !s->options.limit; /* the base is */
  double share = cage->face_size == 3 ? FULL_OF_TRIANGLES : FULL;
  uint8_t *near = s->near_concave = tw_alloc(base->face_count, 1);
  if (!near) return TW_NO_MEMORY;
  /* A quad for each corner, then four for each quad, but where an open border leaves some out. */
  uint32_t shift = s->step_count > 0 ? 2 * (s->step_count - 1) : 0;
  uint64_t from = s->step_count > 0 ? cage->corner_count : cage->face_count;
  bool has_all = is_near && base->face_count == from << shift;
  for (uint32_t f = 0; f < base->face_count; f++) {
    uint32_t of = s->step_count > 0 && has_all ? tw_corner_face(cage, f >> shift) : f;
    near[f] = !has_all || is_near[of];
  }
  if (base->face_size == 3) return TW_OK; /* the cage's own */
  if (!is_answer) {
    tw_status status = find_near(base, points, share, !is_near, near);
    if (status != TW_OK || is_near || memchr(near, 1, base->face_count)) return status;
    tw_free(near);
    s->near_concave = NULL; /* as if the cage had been looked at by itself */
    return TW_OK;
  }
  face_normal normal;
  for (uint32_t f = 0; f < base->face_count; f++)
    near[f] &= !is_surely_convex(base->corner_vertex + tw_face_begin(base, f), tw_face_size(base, f), points,
                                 FULL, &normal);
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
