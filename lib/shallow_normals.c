/* Normals of shallow surfaces that are smooth everywhere: the tangents of limit.h at every vertex, over the
 * ring of neighbours that the cage's connectivity tells. Ring and faces between are passed round the vertex
 * counter-clockwise. Many tangents are found before they are crossed, four by four, so that roots and
 * quotients overlap. */
#include <math.h>

#include "normal.h"
#include "point.h"
#include "shallow.h"

static const double pi = 3.14159265358979323846;

bool tw_shallow_fits_normals(const tw_topology *cage, const tw_rules *rules) {
  if (!cage->smooth || rules->linear) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (cage->fan_offsets[v + 1] - cage->fan_offsets[v] < 3) return false;
  return true;
}

/* ---- weights -------------------------------------------------------------------------------- */

/* Weights that many vertices have in common. */
enum { VALENCES = 16 };
typedef struct weights {
  bool known[VALENCES];
  float edges[VALENCES][VALENCES], faces[VALENCES][VALENCES];
} weights;

static double edge_weight(uint32_t i, uint32_t n) {
  return 4 * cos(2 * pi * (i % n) / n);
}
static double face_weight(uint32_t i, uint32_t n) {
  double step = 2 * pi / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16;
  return (cos(i * step) + cos((i + 1) * step)) / (4 * lambda - 1);
}

static void learn(weights *w, uint32_t n) {
  if (n >= VALENCES || w->known[n]) return;
  for (uint32_t i = 0; i < n; i++) {
    w->edges[n][i] = (float)edge_weight(i, n);
    w->faces[n][i] = (float)face_weight(i, n);
  }
  w->known[n] = true;
}

/* ---- neighbours ----------------------------------------------------------------------------- */

/* A level: its points, and the first of them that are in the middle of an edge and of a face of the level
 * above. */
typedef struct level {
  tw_topology cage;
  const float *points;
  uint32_t middles, face_points;
} level;

static const float *middle(const level *l, uint32_t edge) {
  return l->points + 3 * ((size_t)l->middles + edge);
}
static const float *face_point(const level *l, uint32_t face) {
  return l->points + 3 * ((size_t)l->face_points + face);
}
static const float *old_point(const level *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}

/* Edges of level 1: the halves of the cage's edges, by the corner and its end that they begin at, and the
 * spokes from a corner's edge to the face point. An edge runs as the lower of its corners does. */
static const float *half_from(const level *l, uint32_t corner) {
  return middle(l, 2 * l->cage.corner_edge[corner] + (l->cage.sibling[corner] < corner));
}
static const float *half_to(const level *l, uint32_t corner) {
  return middle(l, 2 * l->cage.corner_edge[corner] + (l->cage.sibling[corner] > corner));
}
static const float *half_at(const level *l, uint32_t edge, uint32_t vertex) {
  return middle(l, 2 * edge + (l->cage.edge_vertices[edge][0] != vertex));
}
static const float *spoke(const level *l, uint32_t corner) {
  return middle(l, 2 * l->cage.edge_count + corner);
}

/* Vertices of level 1. */
static const float *edge_middle(const level *l, uint32_t corner) {
  return old_point(l, l->cage.vertex_count + l->cage.corner_edge[corner]);
}
static const float *face_middle(const level *l, uint32_t face) {
  return old_point(l, l->cage.vertex_count + l->cage.edge_count + face);
}

/* ---- batches -------------------------------------------------------------------------------- */

typedef int32_t mask __attribute__((vector_size(16)));

typedef struct tangents {
  tw_point along[2];
} tangents;

/* Tangents of some rows, four at a time. */
enum { BATCH = 64, SPARE = 3, ROW = 6 };
typedef struct batch {
  tw_point along[2][BATCH + SPARE]; /* the last four may begin at any row */
} batch;

/* One coordinate of four points each. */
typedef struct lanes {
  tw_point x, y, z;
} lanes;

static inline lanes lanes_of(const tw_point *points) {
  tw_point low = __builtin_shufflevector(points[0], points[1], 0, 4, 1, 5),
           high = __builtin_shufflevector(points[2], points[3], 0, 4, 1, 5),
           z_low = __builtin_shufflevector(points[0], points[1], 2, 6, 2, 6),
           z_high = __builtin_shufflevector(points[2], points[3], 2, 6, 2, 6);
  return (lanes){__builtin_shufflevector(low, high, 0, 1, 4, 5),
                 __builtin_shufflevector(low, high, 2, 3, 6, 7),
                 __builtin_shufflevector(z_low, z_high, 0, 1, 4, 5)};
}

static inline void points_of(const lanes *l, tw_point *points) {
  tw_point low = __builtin_shufflevector(l->x, l->y, 0, 4, 1, 5),
           high = __builtin_shufflevector(l->x, l->y, 2, 6, 3, 7);
  points[0] = __builtin_shufflevector(low, l->z, 0, 1, 4, 4);
  points[1] = __builtin_shufflevector(low, l->z, 2, 3, 5, 5);
  points[2] = __builtin_shufflevector(high, l->z, 0, 1, 6, 6);
  points[3] = __builtin_shufflevector(high, l->z, 2, 3, 7, 7);
}

static inline tw_point dot(const lanes *a, const lanes *b) {
  return a->x * b->x + a->y * b->y + a->z * b->z;
}

static inline tw_point root(tw_point square) {
  tw_point out;
  for (int l = 0; l < 4; l++) out[l] = sqrtf(square[l]);
  return out;
}

/* Four unit normals, by the arithmetic of tw_normal_from_tangents where that is quick. Clears lanes of `sure`
 * that need a closer look. */
static inline lanes cross(const tw_point *along1, const tw_point *along2, mask *sure) {
  lanes a = lanes_of(along1), b = lanes_of(along2);
  lanes n = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  tw_point square = dot(&n, &n), lengths = dot(&a, &a) * dot(&b, &b);
  *sure &= (square > lengths * 1e-6f) & (square > 1e-24f) & (square < TW_NORMAL_SQUARE_MAX);
  tw_point scale = 1 / root(square);
  return (lanes){n.x * scale, n.y * scale, n.z * scale};
}

/* A point and its normal. */
static inline void put_row(tw_point point, tw_point normal, float *row) {
  tw_point rest = __builtin_shufflevector(point, normal, 2, 4, 5, 6);
  memcpy(row, &point, sizeof point);
  memcpy(row + 2, &rest, sizeof rest);
}

/* Rows [from, to) of a batch. points: of its first one. Whether all normals are sure. */
static bool put_rows(batch *b, uint32_t from, uint32_t to, const float *points, float *restrict out) {
  for (uint32_t i = to; i < to + SPARE; i++)
    for (int k = 0; k < 2; k++) b->along[k][i] = b->along[k][to - 1];
  mask sure = {-1, -1, -1, -1};
  for (uint32_t i = from; i < to; i += 4) {
    tw_point normals[4];
    lanes four = cross(b->along[0] + i, b->along[1] + i, &sure);
    points_of(&four, normals);
    for (uint32_t k = i; k < i + 4 && k < to; k++, out += ROW)
      put_row(tw_load_point(points + 3 * (size_t)k), normals[k - i], out);
  }
  return (sure[0] & sure[1] & sure[2] & sure[3]) != 0;
}

/* Four points serve where there is no tangent plane. */
static void look_closer(const batch *b, uint32_t i, const float *const quad[4], float *normal) {
  tw_normal_from_tangents((const float *)&b->along[0][i], (const float *)&b->along[1][i], quad, normal);
}

/* ---- vertices between four faces ------------------------------------------------------------ */

/* Most are: the ends of their edges and, of the face behind each, the corner opposite. */
typedef struct ring {
  const float *own, *edges[4], *faces[4];
} ring;

static inline tangents ring_tangents(const ring *r) {
  tw_point rising = tw_load_point(r->faces[0]) - tw_load_point(r->faces[2]),
           falling = tw_load_point(r->faces[3]) - tw_load_point(r->faces[1]);
  return (tangents){{4 * (tw_load_point(r->edges[0]) - tw_load_point(r->edges[2])) + (rising + falling),
                     4 * (tw_load_point(r->edges[1]) - tw_load_point(r->edges[3])) + (rising - falling)}};
}

/* Rings of one item: as many rows as the kind says. */
typedef void rings_of(const level *l, uint32_t item, ring *rings);

/* Rows [begin, end) of a kind of which each item has `step`, 1 or 2. points: of the kind's first one. */
static inline __attribute__((always_inline)) void fill_rings(const level *l, rings_of *find, uint32_t step,
                                                             const float *points, uint32_t begin,
                                                             uint32_t end, float *restrict out) {
  const level own = *l; /* which no row that is stored can be taken to change */
  batch b;
  ring rings[2];
  for (uint32_t first = begin - begin % step; first < end; first += BATCH) {
    uint32_t from = first < begin ? begin - first : 0, to = end - first < BATCH ? end - first : BATCH;
    for (uint32_t i = 0; i < to; i += step) {
      find(&own, (first + i) / step, rings);
      for (uint32_t k = 0; k < step; k++) {
        tangents t = ring_tangents(&rings[k]);
        b.along[0][i + k] = t.along[0];
        b.along[1][i + k] = t.along[1];
      }
    }
    bool sure = put_rows(&b, from, to, points + 3 * (size_t)first, out);
    for (uint32_t i = from; i < to; i++, out += ROW) {
      if (sure) continue;
      find(&own, (first + i) / step, rings);
      const ring *r = &rings[(first + i) % step];
      const float *quad[4] = {r->own, r->edges[0], r->faces[0], r->edges[1]};
      look_closer(&b, i, quad, out + 3);
    }
  }
}

static inline void level_1_middle(const level *l, uint32_t edge, ring *r) {
  const tw_topology *t = &l->cage;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  *r = (ring){middle(l, edge),
              {old_point(l, t->edge_vertices[edge][1]), face_point(l, tw_corner_face(t, one)),
               old_point(l, t->edge_vertices[edge][0]), face_point(l, tw_corner_face(t, other))},
              {middle(l, t->corner_edge[tw_corner_next(t, one)]),
               middle(l, t->corner_edge[tw_corner_previous(t, one)]),
               middle(l, t->corner_edge[tw_corner_next(t, other)]),
               middle(l, t->corner_edge[tw_corner_previous(t, other)])}};
}

static inline void level_2_middle(const level *l, uint32_t edge, ring *r) {
  const tw_topology *t = &l->cage;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  *r = (ring){old_point(l, t->vertex_count + edge),
              {middle(l, 2 * edge + 1), spoke(l, one), middle(l, 2 * edge), spoke(l, other)},
              {face_point(l, tw_corner_next(t, one)), face_point(l, one),
               face_point(l, tw_corner_next(t, other)), face_point(l, other)}};
}

/* Both halves of an edge, each along the quads of its two faces. The first face runs along the edge, the
 * second one against it. */
static inline void level_2_halves(const level *l, uint32_t edge, ring *r) {
  const tw_topology *t = &l->cage;
  uint32_t one = t->edge_corner[edge], after_one = tw_corner_next(t, one), other = t->sibling[one],
           after_other = tw_corner_next(t, other), before_one = tw_corner_previous(t, one),
           before_other = tw_corner_previous(t, other), start = t->edge_vertices[edge][0],
           end = t->edge_vertices[edge][1];
  const float *own = old_point(l, t->vertex_count + edge), *left = spoke(l, one), *right = spoke(l, other);
  r[0] = (ring){middle(l, 2 * edge),
                {own, face_point(l, one), old_point(l, start), face_point(l, after_other)},
                {left, half_at(l, t->corner_edge[before_one], start),
                 half_at(l, t->corner_edge[after_other], start), right}};
  r[1] = (ring){middle(l, 2 * edge + 1),
                {old_point(l, end), face_point(l, after_one), own, face_point(l, other)},
                {half_at(l, t->corner_edge[after_one], end), left, right,
                 half_at(l, t->corner_edge[before_other], end)}};
}

static inline void level_2_spoke(const level *l, uint32_t corner, ring *r) {
  const tw_topology *t = &l->cage;
  uint32_t next = tw_corner_next(t, corner);
  *r = (ring){
      spoke(l, corner),
      {face_middle(l, tw_corner_face(t, corner)), face_point(l, corner), edge_middle(l, corner),
       face_point(l, next)},
      {spoke(l, tw_corner_previous(t, corner)), half_from(l, corner), half_to(l, corner), spoke(l, next)}};
}

static inline void level_2_centre(const level *l, uint32_t corner, ring *r) {
  const tw_topology *t = &l->cage;
  uint32_t previous = tw_corner_previous(t, corner);
  *r = (ring){face_point(l, corner),
              {half_from(l, corner), spoke(l, corner), spoke(l, previous), half_to(l, previous)},
              {edge_middle(l, corner), face_middle(l, tw_corner_face(t, corner)), edge_middle(l, previous),
               old_point(l, t->corner_vertex[corner])}};
}

/* ---- vertices between any number of faces --------------------------------------------------- */

/* A vertex or face of the cage, and where its neighbours begin: in fan_corners and ring_edges alike, as
 * nothing has a border, or among the corners. */
typedef struct wheel {
  const float *own;
  uint32_t index, begin, count;
} wheel;

/* The end of an edge and, of the face behind it, the corner opposite. */
typedef struct neighbour {
  const float *edge, *face;
} neighbour;

typedef wheel wheel_of(const level *l, uint32_t index);
typedef neighbour neighbour_of(const level *l, const wheel *w, uint32_t i);

static inline tangents wheel_tangents(const level *l, weights *known, const wheel *w, neighbour_of *find) {
  uint32_t n = w->count;
  learn(known, n);
  tw_point own = tw_load_point(w->own);
  tangents t = {{{0}, {0}}};
  float edge2 = n < VALENCES ? known->edges[n][n - 1] : (float)edge_weight(n - 1, n),
        face2 = n < VALENCES ? known->faces[n][n - 1] : (float)face_weight(n - 1, n);
  for (uint32_t i = 0; i < n; i++) {
    float edge1 = n < VALENCES ? known->edges[n][i] : (float)edge_weight(i, n),
          face1 = n < VALENCES ? known->faces[n][i] : (float)face_weight(i, n);
    neighbour at = find(l, w, i);
    tw_point to_edge = tw_load_point(at.edge) - own, to_face = tw_load_point(at.face) - own;
    t.along[0] += edge1 * to_edge + face1 * to_face;
    t.along[1] += edge2 * to_edge + face2 * to_face;
    edge2 = edge1;
    face2 = face1;
  }
  return t;
}

/* Rows [begin, end) of a kind. */
static inline __attribute__((always_inline)) void fill_wheels(const level *l, weights *known,
                                                              wheel_of *wheel_at, neighbour_of *find,
                                                              const float *points, uint32_t begin,
                                                              uint32_t end, float *restrict out) {
  const level own = *l;
  batch b;
  for (uint32_t first = begin; first < end; first += BATCH) {
    uint32_t count = end - first < BATCH ? end - first : BATCH;
    for (uint32_t i = 0; i < count; i++) {
      wheel w = wheel_at(&own, first + i);
      tangents t = wheel_tangents(&own, known, &w, find);
      b.along[0][i] = t.along[0];
      b.along[1][i] = t.along[1];
    }
    bool sure = put_rows(&b, 0, count, points + 3 * (size_t)first, out);
    for (uint32_t i = 0; i < count; i++, out += ROW) {
      if (sure) continue;
      wheel w = wheel_at(&own, first + i);
      neighbour one = find(&own, &w, 0), two = find(&own, &w, 1);
      const float *quad[4] = {w.own, one.edge, one.face, two.edge};
      look_closer(&b, i, quad, out + 3);
    }
  }
}

static inline wheel cage_vertex(const level *l, uint32_t vertex) {
  uint32_t begin = l->cage.fan_offsets[vertex];
  return (wheel){old_point(l, vertex), vertex, begin, l->cage.fan_offsets[vertex + 1] - begin};
}
static inline wheel cage_face(const level *l, uint32_t face) {
  return (wheel){face_middle(l, face), face, tw_face_begin(&l->cage, face), tw_face_size(&l->cage, face)};
}

/* The corner before the ith of a face. */
static inline uint32_t corner_before(const wheel *w, uint32_t i) {
  return w->begin + (i ? i : w->count) - 1;
}

static inline neighbour level_1_at_vertex(const level *l, const wheel *w, uint32_t i) {
  const tw_topology *t = &l->cage;
  return (neighbour){middle(l, t->ring_edges[w->begin + i]),
                     face_point(l, tw_corner_face(t, t->fan_corners[w->begin + i]))};
}
static inline neighbour level_1_at_face(const level *l, const wheel *w, uint32_t i) {
  const tw_topology *t = &l->cage;
  return (neighbour){middle(l, t->corner_edge[corner_before(w, i)]),
                     old_point(l, t->corner_vertex[w->begin + i])};
}
static inline neighbour level_2_at_vertex(const level *l, const wheel *w, uint32_t i) {
  const tw_topology *t = &l->cage;
  return (neighbour){half_at(l, t->ring_edges[w->begin + i], w->index),
                     face_point(l, t->fan_corners[w->begin + i])};
}
static inline neighbour level_2_at_face(const level *l, const wheel *w, uint32_t i) {
  return (neighbour){spoke(l, corner_before(w, i)), face_point(l, w->begin + i)};
}

/* ---- levels --------------------------------------------------------------------------------- */

static void level_1_vertices(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                             float *out) {
  fill_wheels(l, w, cage_vertex, level_1_at_vertex, points, begin, end, out);
}
static void level_1_middles(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                            float *out) {
  (void)w;
  fill_rings(l, level_1_middle, 1, points, begin, end, out);
}
static void level_1_faces(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                          float *out) {
  fill_wheels(l, w, cage_face, level_1_at_face, points, begin, end, out);
}
static void level_2_vertices(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                             float *out) {
  fill_wheels(l, w, cage_vertex, level_2_at_vertex, points, begin, end, out);
}
static void level_2_middles(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                            float *out) {
  (void)w;
  fill_rings(l, level_2_middle, 1, points, begin, end, out);
}
static void level_2_faces(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                          float *out) {
  fill_wheels(l, w, cage_face, level_2_at_face, points, begin, end, out);
}
static void fill_halves(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                        float *out) {
  (void)w;
  fill_rings(l, level_2_halves, 2, points, begin, end, out);
}
static void fill_spokes(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                        float *out) {
  (void)w;
  fill_rings(l, level_2_spoke, 1, points, begin, end, out);
}
static void fill_centres(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end,
                         float *out) {
  (void)w;
  fill_rings(l, level_2_centre, 1, points, begin, end, out);
}

/* Rows of one kind, as they follow each other in a level. */
typedef struct kind {
  void (*fill)(const level *l, weights *w, const float *points, uint32_t begin, uint32_t end, float *out);
  uint32_t count;
} kind;

void tw_shallow_normals(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                        float *out) {
  const tw_topology *t = &shallow->cage;
  uint32_t V = t->vertex_count, E = t->edge_count, F = t->face_count, C = t->corner_count;
  const kind kinds[2][6] = {{{level_1_vertices, V}, {level_1_middles, E}, {level_1_faces, F}},
                            {{level_2_vertices, V},
                             {level_2_middles, E},
                             {level_2_faces, F},
                             {fill_halves, 2 * E},
                             {fill_spokes, C},
                             {fill_centres, C}}};
  const kind *k = kinds[shallow->level - 1];
  weights w = {.known = {false}};
  level l = {*t, kept, V, V + E};
  if (shallow->level == 2) {
    l.middles += E + F;
    l.face_points = l.middles + 2 * E + C;
  }
  uint32_t end = first + count;
  for (uint32_t begin = 0; first < end; begin += k++->count) {
    uint32_t stop = end - begin < k->count ? end : begin + k->count;
    if (first >= stop) continue;
    k->fill(&l, &w, kept + 3 * (size_t)begin, first - begin, stop - begin, out);
    out += ROW * (size_t)(stop - first);
    first = stop;
  }
}
