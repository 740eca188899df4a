/* Points of shallow surfaces, rows in vectors: by the generic step's arithmetic, in its order. */
#include "shallow_kernel.h"

#include <stdlib.h>

/* ---- rules ---------------------------------------------------------------------------------- */

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

static inline void face_middle(const level *l, uint32_t face, tw_point *row) {
  const tw_topology *t = &l->cage;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  tw_point sum = point(l, t->corner_vertex[begin]);
  for (uint32_t c = begin + 1; c < begin + size; c++) sum += point(l, t->corner_vertex[c]);
  *row = sum / (float)size;
}

static inline void edge_point(const level *l, uint32_t edge, tw_point *row) {
  const tw_topology *t = &l->cage;
  uint32_t corner = t->edge_corner[edge];
  *row =
      smooth_middle(point(l, t->edge_vertices[edge][0]), point(l, t->edge_vertices[edge][1]),
                    centre(l, tw_corner_face(t, corner)), centre(l, tw_corner_face(t, t->sibling[corner])));
}

static inline void prefetch_edge(const level *l, uint32_t soon, uint32_t later) {
  const tw_topology *t = &l->cage;
  __builtin_prefetch(t->sibling + t->edge_corner[later]);
  __builtin_prefetch(centre_row(l, tw_corner_face(t, t->sibling[t->edge_corner[soon]])));
}

static inline void vertex_point(const level *l, uint32_t vertex, tw_point *row) {
  const tw_topology *t = &l->cage;
  uint32_t first = t->fan_offsets[vertex], count = t->fan_offsets[vertex + 1] - first;
  const uint32_t *fan = t->fan_corners + first, *ring = t->ring_edges + t->ring_offsets[vertex];
  tw_point faces = {0}, edges = {0};
  for (uint32_t i = 0; i < count; i++) {
    const uint32_t *ends = t->edge_vertices[ring[i]];
    faces += centre(l, tw_corner_face(t, fan[i]));
    edges += point(l, ends[0] ^ ends[1] ^ vertex); /* the far end */
  }
  *row = smooth(point(l, vertex), faces, edges, count);
}

static void fill_face_middles(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, face_middle, prefetch_nothing, 1, begin, end, out);
}
static void fill_edge_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, edge_point, prefetch_edge, 1, begin, end, out);
}
static void fill_vertex_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, vertex_point, prefetch_nothing, 1, begin, end, out);
}
static void copy_centres(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  memcpy(out, l->centres + 3 * (size_t)begin, 3 * (size_t)(end - begin) * sizeof *out);
}

static void level_1_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  const tw_topology *t = &l->cage;
  const kind kinds[] = {{fill_vertex_points, t->vertex_count},
                        {fill_edge_points, t->edge_count},
                        {copy_centres, t->face_count}};
  fill_kinds(l, kinds, begin, end, out);
}

/* ---- level 2, whose bilinear points stay where they are ------------------------------------- */

static inline void cage_face(const level *l, uint32_t face, tw_point *row) {
  const tw_topology *t = &l->cage;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  tw_point own = point(l, l->face_points + face), faces = {0}, edges = {0};
  for (uint32_t i = 0; i < size; i++) {
    faces += centre(l, begin + i);
    edges += point(l, l->middles + t->corner_edge[begin + (i ? i : size) - 1]);
  }
  *row = l->rules.linear ? own : smooth(own, faces, edges, size);
}

static bool is_sharp(const tw_topology *t, uint32_t edge) {
  return !t->smooth && t->edge_sharpness[edge] > 0;
}

static inline tw_point smooth_cage_edge(const level *l, uint32_t edge) {
  const tw_topology *t = &l->cage;
  /* A smooth edge has two faces. */
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  tw_point start = point(l, t->edge_vertices[edge][0]), end = point(l, t->edge_vertices[edge][1]);
  tw_point faces =
      ((centre(l, tw_corner_next(t, one)) + centre(l, one)) + centre(l, tw_corner_next(t, other))) +
      centre(l, other);
  tw_point edges = ((end + point(l, l->face_points + tw_corner_face(t, one))) + start) +
                   point(l, l->face_points + tw_corner_face(t, other));
  return smooth(point(l, l->middles + edge), faces, edges, 4);
}

static inline void cage_edge(const level *l, uint32_t edge, tw_point *row) {
  const tw_topology *t = &l->cage;
  if (l->rules.linear)
    *row = point(l, l->middles + edge);
  else if (is_sharp(t, edge))
    *row = between(point(l, l->middles + edge), point(l, t->edge_vertices[edge][0]),
                   point(l, t->edge_vertices[edge][1]));
  else
    *row = smooth_cage_edge(l, edge);
}

static inline void prefetch_halves(const level *l, uint32_t soon, uint32_t later) {
  const tw_topology *t = &l->cage;
  __builtin_prefetch(t->sibling + t->edge_corner[later]);
  __builtin_prefetch(centre_row(l, t->sibling[t->edge_corner[soon]]));
}
static inline void prefetch_cage_edge(const level *l, uint32_t soon, uint32_t later) {
  const tw_topology *t = &l->cage;
  uint32_t other = t->sibling[t->edge_corner[soon]];
  prefetch_halves(l, soon, later);
  __builtin_prefetch(point_row(l, l->face_points + tw_corner_face(t, other)));
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

static inline void cage_vertex(const level *l, uint32_t vertex, tw_point *row) {
  const tw_topology *t = &l->cage;
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = l->rules.linear ? TW_RULE_CORNER
                        : t->smooth     ? TW_RULE_SMOOTH
                                        : tw_vertex_rule_at(t, vertex, ends);
  if (rule <= TW_RULE_DART) {
    *row = smooth_cage_vertex(l, vertex);
  } else if (rule == TW_RULE_CORNER) {
    *row = point(l, vertex);
  } else {
    const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
    *row =
        between(point(l, vertex), point(l, l->middles + ring[ends[0]]), point(l, l->middles + ring[ends[1]]));
  }
}

/* Of the corners round a vertex as many as most have, or none so near to the end that there may be less. */
enum { CORNERS_AROUND = 6 };
static inline const uint32_t *corners_around(const tw_topology *t, uint32_t vertex) {
  uint32_t first = t->fan_offsets[vertex];
  return t->corner_count - first < CORNERS_AROUND ? NULL : t->fan_corners + first;
}

static inline void prefetch_cage_vertex(const level *l, uint32_t soon, uint32_t later) {
  const uint32_t *fan = corners_around(&l->cage, soon);
  (void)later;
  for (uint32_t i = 0; fan && i < CORNERS_AROUND; i++) __builtin_prefetch(centre_row(l, fan[i]));
}

/* Both halves of an edge of the cage, which look at the same faces. */
static inline void halves(const level *l, uint32_t edge, tw_point *rows) {
  const tw_topology *t = &l->cage;
  tw_point start = point(l, t->edge_vertices[edge][0]), end = point(l, t->edge_vertices[edge][1]),
           own = point(l, l->middles + edge);
  if (l->rules.linear || is_sharp(t, edge)) {
    rows[0] = middle(start, own);
    rows[1] = middle(end, own);
    return;
  }
  /* The first face runs along the edge, the second one against it. */
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  rows[0] = smooth_middle(start, own, centre(l, one), centre(l, tw_corner_next(t, other)));
  rows[1] = smooth_middle(end, own, centre(l, tw_corner_next(t, one)), centre(l, other));
}

/* From the middle of a face's edge to its face point. */
static inline tw_point spoke_between(const level *l, tw_point middle_of_edge, tw_point face_point,
                                     tw_point left, tw_point right) {
  return l->rules.linear ? middle(middle_of_edge, face_point)
                         : smooth_middle(middle_of_edge, face_point, left, right);
}

static inline void spoke(const level *l, uint32_t corner, tw_point *row) {
  const tw_topology *t = &l->cage;
  *row = spoke_between(l, point(l, l->middles + t->corner_edge[corner]),
                       point(l, l->face_points + tw_corner_face(t, corner)), centre(l, corner),
                       centre(l, tw_corner_next(t, corner)));
}

/* Middles of a triangle's edges, on the sides of corners 0, 1, 2. */
static inline void load_middles(const level *l, uint32_t face, tw_point *middles) {
  for (uint32_t i = 0; i < 3; i++) middles[i] = point(l, l->middles + l->cage.corner_edge[3 * face + i]);
}

static inline void spokes_of_triangle(const level *l, uint32_t face, tw_point *rows) {
  tw_point own = point(l, l->face_points + face), middles[3], centres[3];
  load_middles(l, face, middles);
  for (uint32_t i = 0; i < 3; i++) centres[i] = centre(l, 3 * face + i);
  for (uint32_t i = 0; i < 3; i++)
    rows[i] = spoke_between(l, middles[i], own, centres[i], centres[(i + 1) % 3]);
}

static void fill_cage_vertices(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_vertex, prefetch_cage_vertex, 1, begin, end, out);
}
static void fill_cage_edges(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_edge, prefetch_cage_edge, 1, begin, end, out);
}
static void fill_cage_faces(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, cage_face, prefetch_nothing, 1, begin, end, out);
}
static void fill_halves(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_rows(l, halves, prefetch_halves, 2, begin, end, out);
}
static void fill_spokes(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_corners(l, spoke, spokes_of_triangle, prefetch_nothing, begin, end, out);
}

static void level_2_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  const tw_topology *t = &l->cage;
  const kind kinds[] = {{fill_cage_vertices, t->vertex_count}, {fill_cage_edges, t->edge_count},
                        {fill_cage_faces, t->face_count},      {fill_halves, 2 * t->edge_count},
                        {fill_spokes, t->corner_count},        {copy_centres, t->corner_count}};
  fill_kinds(l, kinds, begin, end, out);
}

/* ---- what is kept --------------------------------------------------------------------------- */

/* Of level 1 points and centres are the cage's, of level 2 those of level 1. */
static level level_of(const tw_shallow *shallow, const float *points, const float *centres) {
  const tw_topology *t = &shallow->cage;
  return (level){*t, shallow->rules, t->vertex_count, t->vertex_count + t->edge_count, points, centres};
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

/* Of a corner's quad of level 1. */
static inline tw_point average(tw_point own, tw_point after, tw_point middle, tw_point before) {
  return (((own + after) + middle) + before) * 0.25f;
}

static inline void quad_average(const level *l, uint32_t corner, tw_point *row) {
  const tw_topology *t = &l->cage;
  *row = average(point(l, t->corner_vertex[corner]), point(l, l->middles + t->corner_edge[corner]),
                 point(l, l->face_points + tw_corner_face(t, corner)),
                 point(l, l->middles + t->corner_edge[tw_corner_previous(t, corner)]));
}

static inline void averages_of_triangle(const level *l, uint32_t face, tw_point *rows) {
  tw_point own = point(l, l->face_points + face), middles[3];
  load_middles(l, face, middles);
  for (uint32_t i = 0; i < 3; i++)
    rows[i] = average(point(l, l->cage.corner_vertex[3 * face + i]), middles[i], own, middles[(i + 2) % 3]);
}

static inline void prefetch_averages(const level *l, uint32_t soon, uint32_t later) {
  (void)later;
  for (uint32_t c = 3 * soon; c < 3 * soon + 3; c++) {
    __builtin_prefetch(point_row(l, l->cage.corner_vertex[c]));
    __builtin_prefetch(point_row(l, l->middles + l->cage.corner_edge[c]));
  }
}

static void fill_averages(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  fill_corners(l, quad_average, averages_of_triangle, prefetch_averages, begin, end, out);
}

/* Rows of a level that has special cases. */
static void other_points(const level *l, uint32_t begin, uint32_t end, float *restrict out) {
  tw_refine_points(&l->cage, &l->rules, l->points, l->centres, begin, end - begin, out);
}

static fill_of *fill_of_level(const tw_shallow *shallow) {
  if (shallow->level == 2) return level_2_points;
  return is_smooth(shallow) ? level_1_points : other_points;
}

typedef struct fill_job {
  const level *level;
  fill_of *fill;
  float *out;
} fill_job;

static void fill_part(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const fill_job *j = context;
  (void)part;
  j->fill(j->level, begin, end, j->out + 3 * (size_t)begin);
}

/* Rows [0, count). */
static void fill_by(const tw_parallel_for *parallel, const level *l, fill_of *fill, uint32_t count,
                    float *out) {
  fill_job job = {l, fill, out};
  tw_parallel_for_run(parallel, count, TW_PARALLEL_FOR_LEAST, fill_part, &job);
}

/* Level 1 from the cage's points. */
static void refine_cage(const tw_shallow *shallow, const float *cage, const tw_parallel_for *parallel,
                        float *points) {
  const tw_topology *t = &shallow->cage;
  if (!is_smooth(shallow)) {
    tw_refine_values(t, &shallow->rules, 3, cage, parallel, points);
    return;
  }
  float *face_points = points + 3 * ((size_t)t->vertex_count + t->edge_count);
  level l = level_of(shallow, cage, face_points);
  fill_by(parallel, &l, fill_face_middles, t->face_count, face_points);
  fill_by(parallel, &l, level_1_points, t->vertex_count + t->edge_count, points);
}

/* Points and centres; behind either there is a float more, which is read with the last row. */
static void keep_parts(const tw_shallow *shallow, const float *positions, const uint32_t *point_of,
                       const tw_parallel_for *parallel, float *points, float *centres) {
  const tw_topology *t = &shallow->cage;
  /* For level 2 the cage lies where the centres will: it has no more vertices than corners. */
  float *cage = shallow->level == 1 ? points : centres;
  level l = level_of(shallow, points, centres);
  points[3 * point_count(shallow)] = centres[3 * (size_t)centre_count(shallow)] = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    memcpy(cage + 3 * (size_t)v, positions + 3 * (size_t)(point_of ? point_of[v] : v), 3 * sizeof *cage);
  if (shallow->level == 1) {
    fill_by(parallel, &l, fill_face_middles, t->face_count, centres);
  } else {
    refine_cage(shallow, cage, parallel, points);
    fill_by(parallel, &l, fill_averages, t->corner_count, centres);
  }
}

static bool is_made_when_read(const tw_shallow *shallow) {
  return !shallow->normals || tw_shallow_is_remade(shallow);
}

tw_status tw_shallow_keep(const tw_shallow *shallow, const float *positions, const uint32_t *point_of,
                          const tw_parallel_for *parallel, float *kept) {
  size_t points = 3 * point_count(shallow) + 1;
  if (is_made_when_read(shallow)) {
    float *centres = kept + points;
    keep_parts(shallow, positions, point_of, parallel, kept, centres);
    level l = level_of(shallow, kept, centres);
    if (shallow->normals)
      fill_by(parallel, &l, level_2_points, shallow->cage.vertex_count,
              centres + 3 * (size_t)centre_count(shallow) + 1);
    return TW_OK;
  }
  /* The centres are the last of the level's own points. */
  uint32_t others = (uint32_t)tw_shallow_kept_count(shallow) - centre_count(shallow);
  float *above = tw_alloc(points, sizeof *above), *centres = kept + 3 * (size_t)others;
  if (!above) return TW_NO_MEMORY;
  keep_parts(shallow, positions, point_of, parallel, above, centres);
  level l = level_of(shallow, above, centres);
  fill_by(parallel, &l, fill_of_level(shallow), others, kept);
  free(above);
  return TW_OK;
}

void tw_shallow_points(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                       float *out) {
  if (is_made_when_read(shallow)) {
    level l = level_of(shallow, kept, kept + 3 * point_count(shallow) + 1);
    fill_of_level(shallow)(&l, first, first + count, out);
  } else {
    memcpy(out, kept + 3 * (size_t)first, 3 * (size_t)count * sizeof *out);
  }
}
