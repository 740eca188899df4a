/* Points of shallow surfaces, rows in vectors: by the generic step's arithmetic, in its order. */
#include <stdlib.h>

#include "point.h"
#include "shallow.h"

/* ---- rows ----------------------------------------------------------------------------------- */

/* A level as what its points are made of: the cage and its points or, for level 2, the points of level 1 and
 * the middles of its quads. */
typedef struct level {
  tw_topology cage;
  bool linear;
  uint32_t middles, face_points; /* first vertex of level 1 in the middle of an edge, of a face */
  const float *points, *centres;
} level;

static tw_point point(const level *l, uint32_t vertex) {
  return tw_load_point(l->points + 3 * (size_t)vertex);
}
static tw_point centre(const level *l, uint32_t face) {
  return tw_load_point(l->centres + 3 * (size_t)face);
}

/* A row of some kind. */
typedef tw_point row_of(const level *l, uint32_t index);

static inline __attribute__((always_inline)) void fill_rows(const level *l, row_of *row, uint32_t begin,
                                                            uint32_t end, float *restrict out) {
  const level own = *l; /* which no row that is stored can be taken to change */
  for (uint32_t i = begin; i < end; i++, out += 3) tw_store_point(row(&own, i), out);
}

/* Rows of one kind, as they follow each other in a level. */
typedef struct kind {
  void (*fill)(const level *l, uint32_t begin, uint32_t end, float *restrict out);
  uint32_t count;
} kind;

static void fill_kinds(const level *l, const kind *kinds, uint32_t first, uint32_t count, float *out) {
  uint32_t end = first + count;
  for (uint32_t begin = 0; first < end; begin += kinds++->count) {
    uint32_t stop = end - begin < kinds->count ? end : begin + kinds->count;
    if (first >= stop) continue;
    kinds->fill(l, first - begin, stop - begin, out);
    out += 3 * (size_t)(stop - first);
    first = stop;
  }
}

/* The smooth rule from sums over `count` edges and faces. */
static inline tw_point smooth(tw_point own, tw_point faces, tw_point edges, uint32_t count) {
  float n = (float)count;
  return (faces + edges) * (1 / (n * n)) + own * ((n - 2) / n);
}

static inline tw_point middle(tw_point a, tw_point b) {
  return 0.5f * (a + b);
}
static inline tw_point smooth_middle(tw_point a, tw_point b, tw_point left, tw_point right) {
  return 0.25f * (a + b) + 0.25f * (left + right);
}
/* The crease mask between two neighbours. */
static inline tw_point between(tw_point own, tw_point a, tw_point b) {
  return 0.125f * a + 0.125f * b + 0.75f * own;
}

/* ---- level 1 of smooth cages ---------------------------------------------------------------- */

static inline tw_point face_middle(const level *l, uint32_t face) {
  const tw_topology *t = &l->cage;
  uint32_t begin = tw_face_begin(t, face), end = begin + tw_face_size(t, face);
  tw_point sum = point(l, t->corner_vertex[begin]);
  for (uint32_t c = begin + 1; c < end; c++) sum += point(l, t->corner_vertex[c]);
  return sum / (float)(end - begin);
}

static inline tw_point edge_point(const level *l, uint32_t edge) {
  const tw_topology *t = &l->cage;
  uint32_t corner = t->edge_corner[edge];
  return smooth_middle(point(l, t->edge_vertices[edge][0]), point(l, t->edge_vertices[edge][1]),
                       centre(l, tw_corner_face(t, corner)),
                       centre(l, tw_corner_face(t, t->sibling[corner])));
}

static inline tw_point vertex_point(const level *l, uint32_t vertex) {
  const tw_topology *t = &l->cage;
  uint32_t first = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - first;
  const uint32_t *fan = t->fan_corners + first, *ring = t->ring_edges + t->ring_offsets[vertex];
  tw_point faces = {0}, edges = {0};
  for (uint32_t i = 0; i < count; i++) {
    faces += centre(l, tw_corner_face(t, fan[i]));
    edges += point(l, tw_far_end(t, ring[i], vertex));
  }
  return smooth(point(l, vertex), faces, edges, count);
}

static void fill_face_middles(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, face_middle, begin, end, out);
}
static void fill_edge_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, edge_point, begin, end, out);
}
static void fill_vertex_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, vertex_point, begin, end, out);
}
static void copy_centres(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  memcpy(out, l->centres + 3 * (size_t)begin, 3 * (size_t)(end - begin) * sizeof *out);
}

static void level_1_points(const level *l, uint32_t first, uint32_t count, float *out) {
  const tw_topology *t = &l->cage;
  const kind kinds[] = {{fill_vertex_points, t->vertex_count},
                        {fill_edge_points, t->edge_count},
                        {copy_centres, t->face_count}};
  fill_kinds(l, kinds, first, count, out);
}

/* ---- level 2, whose bilinear points stay where they are ------------------------------------- */

static inline tw_point cage_face(const level *l, uint32_t face) {
  const tw_topology *t = &l->cage;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  if (l->linear) return point(l, l->face_points + face);
  tw_point faces = {0}, edges = {0};
  for (uint32_t i = 0; i < size; i++) {
    faces += centre(l, begin + i);
    edges += point(l, l->middles + t->corner_edge[begin + (i ? i : size) - 1]);
  }
  return smooth(point(l, l->face_points + face), faces, edges, size);
}

static bool is_sharp(const tw_topology *t, uint32_t edge) {
  return !t->smooth && t->edge_sharpness[edge] > 0;
}

static inline tw_point cage_edge(const level *l, uint32_t edge) {
  const tw_topology *t = &l->cage;
  tw_point own = point(l, l->middles + edge), start = point(l, t->edge_vertices[edge][0]),
           end = point(l, t->edge_vertices[edge][1]);
  if (l->linear) return own;
  if (is_sharp(t, edge)) return between(own, start, end);
  /* A smooth edge has two faces. */
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  tw_point faces =
      ((centre(l, tw_corner_next(t, one)) + centre(l, one)) + centre(l, tw_corner_next(t, other))) +
      centre(l, other);
  tw_point edges = ((end + point(l, l->face_points + tw_corner_face(t, one))) + start) +
                   point(l, l->face_points + tw_corner_face(t, other));
  return smooth(own, faces, edges, 4);
}

static inline tw_point smooth_cage_vertex(const level *l, uint32_t vertex) {
  const tw_topology *t = &l->cage;
  uint32_t first = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - first;
  const uint32_t *fan = t->fan_corners + first, *ring = t->ring_edges + t->ring_offsets[vertex];
  tw_point faces = {0}, edges = {0};
  for (uint32_t i = 0; i < count; i++) {
    faces += centre(l, fan[i]);
    edges += point(l, l->middles + ring[i]);
  }
  return smooth(point(l, vertex), faces, edges, count);
}

static inline tw_point cage_vertex(const level *l, uint32_t vertex) {
  const tw_topology *t = &l->cage;
  uint32_t ends[2] = {0, 0};
  if (l->linear) return point(l, vertex);
  tw_vertex_rule rule = t->smooth ? TW_RULE_SMOOTH : tw_vertex_rule_at(t, vertex, ends);
  if (rule <= TW_RULE_DART) return smooth_cage_vertex(l, vertex);
  if (rule == TW_RULE_CORNER) return point(l, vertex);
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  return between(point(l, vertex), point(l, l->middles + ring[ends[0]]),
                 point(l, l->middles + ring[ends[1]]));
}

/* Both halves of an edge of the cage. */
typedef struct halves {
  tw_point points[2];
} halves;

static inline halves halves_of(const level *l, uint32_t edge) {
  const tw_topology *t = &l->cage;
  tw_point start = point(l, t->edge_vertices[edge][0]), end = point(l, t->edge_vertices[edge][1]),
           own = point(l, l->middles + edge);
  if (l->linear || is_sharp(t, edge)) return (halves){{middle(start, own), middle(end, own)}};
  /* The first face runs along the edge, the second one against it. */
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  return (halves){{smooth_middle(start, own, centre(l, one), centre(l, tw_corner_next(t, other))),
                   smooth_middle(end, own, centre(l, tw_corner_next(t, one)), centre(l, other))}};
}

/* From the middle of a face's edge to its face point. */
static inline tw_point spoke_point(const level *l, uint32_t corner) {
  const tw_topology *t = &l->cage;
  tw_point a = point(l, l->middles + t->corner_edge[corner]),
           b = point(l, l->face_points + tw_corner_face(t, corner));
  if (l->linear) return middle(a, b);
  return smooth_middle(a, b, centre(l, corner), centre(l, tw_corner_next(t, corner)));
}

static void fill_cage_vertices(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_vertex, begin, end, out);
}
static void fill_cage_edges(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_edge, begin, end, out);
}
static void fill_cage_faces(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_face, begin, end, out);
}

/* Two at a time, which look at the same faces. */
static void fill_halves(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  const level own = *l;
  uint32_t at = begin;
  if (at < end && at % 2 == 1) {
    tw_store_point(halves_of(&own, at++ / 2).points[1], out);
    out += 3;
  }
  for (; at + 1 < end; at += 2, out += 6) {
    halves both = halves_of(&own, at / 2);
    tw_store_point(both.points[0], out);
    tw_store_point(both.points[1], out + 3);
  }
  if (at < end) tw_store_point(halves_of(&own, at / 2).points[0], out);
}
static void fill_spokes(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, spoke_point, begin, end, out);
}

static void level_2_points(const level *l, uint32_t first, uint32_t count, float *out) {
  const tw_topology *t = &l->cage;
  const kind kinds[] = {{fill_cage_vertices, t->vertex_count}, {fill_cage_edges, t->edge_count},
                        {fill_cage_faces, t->face_count},      {fill_halves, 2 * t->edge_count},
                        {fill_spokes, t->corner_count},        {copy_centres, t->corner_count}};
  fill_kinds(l, kinds, first, count, out);
}

/* ---- what is kept --------------------------------------------------------------------------- */

/* Of level 1 points and centres are the cage's, of level 2 those of level 1. */
static level level_of(const tw_shallow *shallow, const float *points, const float *centres) {
  const tw_topology *t = &shallow->cage;
  return (level){*t,     shallow->rules.linear, t->vertex_count, t->vertex_count + t->edge_count, points,
                 centres};
}

static size_t point_count(const tw_shallow *shallow) {
  const tw_topology *t = &shallow->cage;
  return shallow->level == 1 ? t->vertex_count : (size_t)t->vertex_count + t->edge_count + t->face_count;
}
static uint32_t centre_count(const tw_shallow *shallow) {
  return shallow->level == 1 ? shallow->cage.face_count : shallow->cage.corner_count;
}

/* Whether level 1 needs none of the step's special cases. */
static bool is_smooth(const tw_shallow *shallow) {
  return shallow->cage.smooth && !shallow->rules.linear && !shallow->rules.smooth_triangles;
}

static void average_quads(const level *l, float *restrict out) {
  const tw_topology *t = &l->cage;
  for (uint32_t f = 0; f < t->face_count; f++) {
    uint32_t begin = tw_face_begin(t, f), end = begin + tw_face_size(t, f);
    tw_point middle = point(l, l->face_points + f), before = point(l, l->middles + t->corner_edge[end - 1]);
    for (uint32_t c = begin; c < end; c++, out += 3) {
      tw_point own = point(l, t->corner_vertex[c]), after = point(l, l->middles + t->corner_edge[c]);
      tw_store_point((((own + after) + middle) + before) * 0.25f, out);
      before = after;
    }
  }
}

/* Level 1 from the cage's points. */
static void refine_cage(const tw_shallow *shallow, const float *cage, float *points) {
  const tw_topology *t = &shallow->cage;
  if (!is_smooth(shallow)) {
    tw_refine_values(t, &shallow->rules, 3, cage, NULL, points);
    return;
  }
  float *face_points = points + 3 * ((size_t)t->vertex_count + t->edge_count);
  level l = level_of(shallow, cage, face_points);
  fill_face_middles(&l, 0, t->face_count, face_points);
  level_1_points(&l, 0, t->vertex_count + t->edge_count, points);
}

/* Points and centres; behind either there is a float more, which is read with the last row. */
static void keep_parts(const tw_shallow *shallow, const float *positions, const uint32_t *point_of,
                       float *points, float *centres) {
  const tw_topology *t = &shallow->cage;
  /* For level 2 the cage lies where the centres will: it has no more vertices than corners. */
  float *cage = shallow->level == 1 ? points : centres;
  level l = level_of(shallow, points, centres);
  points[3 * point_count(shallow)] = centres[3 * (size_t)centre_count(shallow)] = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    memcpy(cage + 3 * (size_t)v, positions + 3 * (size_t)(point_of ? point_of[v] : v), 3 * sizeof *cage);
  if (shallow->level == 1) {
    fill_face_middles(&l, 0, t->face_count, centres);
  } else {
    refine_cage(shallow, cage, points);
    average_quads(&l, centres);
  }
}

static void rows_of_level(const tw_shallow *shallow, const level *l, uint32_t first, uint32_t count,
                          float *out) {
  if (shallow->level == 2)
    level_2_points(l, first, count, out);
  else if (is_smooth(shallow))
    level_1_points(l, first, count, out);
  else
    tw_refine_points(&shallow->cage, &shallow->rules, l->points, l->centres, first, count, out);
}

tw_status tw_shallow_keep(const tw_shallow *shallow, const float *positions, const uint32_t *point_of,
                          float *kept) {
  size_t points = 3 * point_count(shallow);
  if (!shallow->normals) {
    keep_parts(shallow, positions, point_of, kept, kept + points);
    return TW_OK;
  }
  /* The centres are the last of the level's own points. */
  uint32_t others = (uint32_t)tw_shallow_kept_count(shallow) - centre_count(shallow);
  float *above = tw_alloc(points + 1, sizeof *above), *centres = kept + 3 * (size_t)others;
  if (!above) return TW_NO_MEMORY;
  keep_parts(shallow, positions, point_of, above, centres);
  level l = level_of(shallow, above, centres);
  rows_of_level(shallow, &l, 0, others, kept);
  free(above);
  return TW_OK;
}

void tw_shallow_points(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                       float *out) {
  if (shallow->normals) {
    memcpy(out, kept + 3 * (size_t)first, 3 * (size_t)count * sizeof *out);
  } else {
    level l = level_of(shallow, kept, kept + 3 * point_count(shallow));
    rows_of_level(shallow, &l, first, count, out);
  }
}
