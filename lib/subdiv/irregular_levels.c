/* Loops over the children of faces, edges and vertices. A step keeps the numbers of existing vertices:
 * their edges and faces at a later level are those of their first level, shifted. */
#include "irregular_levels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "normal.h"

#define INLINE static inline __attribute__((always_inline))

static const double pi = 3.14159265358979323846;

/* ---- corners -------------------------------------------------------------------------------- */

/* size: that of the level's faces, where the compiler knows it. */
INLINE uint32_t corner_face(const tw_level *l, uint32_t size, uint32_t c) {
  return size == 4 ? c / 4 : size == 3 ? c / 3 : l->corner_face[c];
}
INLINE uint32_t face_begin(const tw_level *l, uint32_t size, uint32_t f) {
  return size ? size * f : l->face_offsets[f];
}
INLINE uint32_t face_end(const tw_level *l, uint32_t size, uint32_t f) {
  return size ? size * f + size : l->face_offsets[f + 1];
}
/* Of triangles without a branch, which nothing could predict. */
INLINE uint32_t corner_next(const tw_level *l, uint32_t size, uint32_t c) {
  if (size == 4) return tw_quad_next(c);
  if (size == 3) return c + 1 - 3 * (uint32_t)(c % 3 == 2);
  uint32_t face = l->corner_face[c];
  return c + 1 == l->face_offsets[face + 1] ? l->face_offsets[face] : c + 1;
}
INLINE uint32_t corner_previous(const tw_level *l, uint32_t size, uint32_t c) {
  if (size == 4) return tw_quad_previous(c);
  if (size == 3) return c - 1 + 3 * (uint32_t)(c % 3 == 0);
  uint32_t face = l->corner_face[c];
  return c == l->face_offsets[face] ? l->face_offsets[face + 1] - 1 : c - 1;
}

/* The part of an edge at the vertex of one of its halves, `steps` levels down. */
INLINE uint32_t edge_after(uint32_t half, uint32_t steps) {
  return ((half >> 1) << steps) + (((1u << steps) - 1) & (0 - (half & 1)));
}
/* The face at a corner's vertex after `steps` steps, 1 or more. */
INLINE uint32_t face_after(uint32_t corner, uint32_t steps) {
  return corner << 2 * (steps - 1);
}

/* ---- a pass over vertices ------------------------------------------------------------------- */

/* What is computed from a vertex and its ring: the ring in the next level for POINT, in its own for LIMIT
 * and NORMAL. */
typedef enum operation { POINT, LIMIT, NORMAL } operation;

typedef struct pass {
  const tw_levels *levels;
  operation operation;
  uint32_t step;         /* from this level to the next */
  const tw_point *above; /* points of the level above: of a step */
  tw_point *points;      /* of the level below */
  tw_point *limits;
  const tw_point *positions; /* of rows, relative to `origin` */
  tw_point origin;
  float *rows;      /* of vertex `first` on */
  tw_point *slopes; /* in place of rows, NULL: rows; likewise [][2] */
  uint32_t first, stride;
} pass;

INLINE tw_point all(float x) {
  return (tw_point){x, x, x, x};
}

INLINE tw_point cross(tw_point a, tw_point b) {
  tw_point a_turned = __builtin_shufflevector(a, a, 1, 2, 0, 3),
           b_turned = __builtin_shufflevector(b, b, 1, 2, 0, 3), c = a * b_turned - a_turned * b;
  return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}
INLINE float square(tw_point a) {
  tw_point s = a * a;
  return s[0] + s[1] + s[2];
}

/* quad: a face of the vertex, for where there is no tangent plane. */
static __attribute__((noinline)) void careful_normal(tw_point t1, tw_point t2, const tw_point quad[4],
                                                     float *out) {
  float tangents[2][4], corners[4][4];
  memcpy(tangents[0], &t1, sizeof t1);
  memcpy(tangents[1], &t2, sizeof t2);
  memcpy(corners, quad, sizeof corners);
  const float *const rows[4] = {corners[0], corners[1], corners[2], corners[3]};
  tw_normal_from_tangents(tangents[0], tangents[1], rows, out);
}

/* quad: the vertex, then points round it of which the first and the last are along t1 and t2. */
INLINE void put_row(const pass *p, uint32_t v, tw_point t1, tw_point t2, const tw_point quad[4]) {
  if (p->slopes) {
    tw_point *slopes = p->slopes + 2 * (size_t)(v - p->first);
    slopes[0] = p->levels->linear ? quad[1] - quad[0] : t1;
    slopes[1] = p->levels->linear ? quad[3] - quad[0] : t2;
    return;
  }
  float *row = p->rows + (size_t)(v - p->first) * p->stride;
  tw_point at = p->positions[v] + p->origin, n = cross(t1, t2);
  float length = square(n);
  if (__builtin_expect(
          length > tw_normal_least_square(square(t1) * square(t2)) && length < TW_NORMAL_SQUARE_MAX, 1)) {
    n = n * all(1 / sqrtf(length)) + all(0);
    tw_point head = __builtin_shufflevector(at, n, 0, 1, 2, 4),
             tail = __builtin_shufflevector(n, n, 1, 2, 1, 2);
    memcpy(row, &head, sizeof head);
    memcpy(row + 4, &tail, sizeof tail / 2);
    return;
  }
  memcpy(row, &at, 3 * sizeof *row);
  careful_normal(t1, t2, quad, row + 3);
}

/* Where four edges and faces meet, face i between edges i and i + 1. */
INLINE void take_four(const pass *p, operation op, uint32_t v, const tw_point edges[4],
                      const tw_point faces[4]) {
  if (op == NORMAL) {
    tw_point x = faces[0] - faces[2], y = faces[3] - faces[1];
    const tw_point quad[4] = {p->points[v], edges[0], faces[0], edges[1]};
    put_row(p, v, all(4) * (edges[0] - edges[2]) + (x + y), all(4) * (edges[1] - edges[3]) + (x - y), quad);
    return;
  }
  tw_point e = (edges[0] + edges[1]) + (edges[2] + edges[3]),
           f = (faces[0] + faces[1]) + (faces[2] + faces[3]);
  if (op == POINT)
    p->points[v] = all(0.25f) * (p->above[v] + e) - all(0.0625f) * f;
  else
    p->limits[v] = all(4.0f / 9) * p->points[v] + all(1.0f / 9) * e + all(1.0f / 36) * f;
}

/* Where any number does: sums of the points round a vertex, or tangents of them. */
typedef struct ring {
  uint32_t valence;
  const float *weights; /* of normals */
  tw_point own, sums[2], quad[4];
} ring;

INLINE ring start_ring(const pass *p, operation op, uint32_t v, uint32_t valence) {
  const tw_levels *l = p->levels;
  return (ring){valence,
                op == NORMAL ? l->weights + l->weights_of[valence] : NULL,
                op == POINT ? p->above[v] : p->points[v],
                {{0}, {0}},
                {{0}, {0}, {0}, {0}}};
}

INLINE void add_to_ring(ring *r, operation op, uint32_t i, tw_point edge, tw_point face) {
  if (op != NORMAL) {
    r->sums[0] += edge;
    r->sums[1] += face;
    return;
  }
  if (i == 0) r->quad[1] = edge, r->quad[2] = face;
  if (i == 1) r->quad[3] = edge;
  uint32_t n = r->valence, before = (i ? i : n) - 1;
  edge -= r->own;
  face -= r->own;
  r->sums[0] += all(r->weights[i]) * edge + all(r->weights[n + i]) * face;
  r->sums[1] += all(r->weights[before]) * edge + all(r->weights[n + before]) * face;
}

/* With the edge points in place of the far ends of edges, ((n - 2) P + (sum of ends + sum of faces) / n) / n
 * is ((n - 3) P + (4 sum of edge points - sum of faces) / n) / n. */
INLINE void end_ring(const pass *p, operation op, uint32_t v, ring *r) {
  float n = (float)r->valence;
  if (op == POINT) {
    p->points[v] = all((n - 3) / n) * r->own + all(1 / (n * n)) * (all(4) * r->sums[0] - r->sums[1]);
  } else if (op == LIMIT) {
    p->limits[v] = all(n / (n + 5)) * r->own + all(1 / (n * (n + 5))) * (all(4) * r->sums[0] + r->sums[1]);
  } else {
    r->quad[0] = r->own;
    put_row(p, v, r->sums[0], r->sums[1], r->quad);
  }
}

/* ---- vertices that the step finds there ------------------------------------------------------ */

/* Vertices [begin, end) of a class; born: the class's first level. */
typedef void class_loop(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin,
                        uint32_t end);

static const tw_point *edge_points(const pass *p) {
  return p->points + p->levels->at[p->step].vertex_count;
}
static const tw_point *face_points(const pass *p) {
  return edge_points(p) + p->levels->at[p->step].edge_count;
}

enum { AHEAD = 12 }; /* vertices: how far ahead scattered data is prefetched */

INLINE void cage_vertices(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin,
                          uint32_t end) {
  const tw_levels *levels = p->levels;
  const tw_level *cage = &levels->at[0];
  const tw_point *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step;
  (void)born;
  for (uint32_t v = begin; v < end; v++) {
    uint32_t first = levels->fan_offsets[v], n = levels->fan_offsets[v + 1] - first;
    if (v + AHEAD < end)
      for (uint32_t i = levels->fan_offsets[v + AHEAD]; i < levels->fan_offsets[v + AHEAD + 1]; i++) {
        uint32_t c = levels->fan_corners[i];
        __builtin_prefetch(E + edge_after(cage->corner_half[c], steps));
        __builtin_prefetch(F + (steps ? face_after(c, steps) : corner_face(cage, size, c)));
      }
    ring r = start_ring(p, op, v, n);
    for (uint32_t i = 0; i < n; i++) {
      uint32_t c = levels->fan_corners[first + i];
      add_to_ring(&r, op, i, E[edge_after(cage->corner_half[c], steps)],
                  F[steps ? face_after(c, steps) : corner_face(cage, size, c)]);
    }
    end_ring(p, op, v, &r);
  }
}

/* Round the middle of an edge: its half at the end, the spoke into its first face, its half at the start, the
 * spoke into the second face. */
typedef struct middle {
  uint32_t edges[4], faces[4];
} middle;

INLINE middle middle_of(const tw_level *l, uint32_t size, uint32_t edge, uint32_t steps) {
  uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1];
  uint32_t spokes = 2 * l->edge_count;
  return (middle){{edge_after(4 * edge + 2, steps), edge_after(2 * (spokes + along), steps),
                   edge_after(4 * edge + 1, steps), edge_after(2 * (spokes + against), steps)},
                  {face_after(4 * corner_next(l, size, along) + 3, steps + 1) / 4,
                   face_after(4 * along + 1, steps + 1) / 4,
                   face_after(4 * corner_next(l, size, against) + 3, steps + 1) / 4,
                   face_after(4 * against + 1, steps + 1) / 4}};
}

INLINE void middles(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin, uint32_t end) {
  const tw_level *l = &p->levels->at[born - 1];
  const tw_point *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step - born;
  for (uint32_t edge = begin; edge < end; edge++) {
    if (edge + AHEAD < end) {
      middle soon = middle_of(l, size, edge + AHEAD, steps);
      for (int i = 0; i < 4; i++) __builtin_prefetch(F + soon.faces[i]);
      __builtin_prefetch(E + soon.edges[1]);
      __builtin_prefetch(E + soon.edges[3]);
    }
    middle m = middle_of(l, size, edge, steps);
    const tw_point edges[4] = {E[m.edges[0]], E[m.edges[1]], E[m.edges[2]], E[m.edges[3]]},
                   faces[4] = {F[m.faces[0]], F[m.faces[1]], F[m.faces[2]], F[m.faces[3]]};
    take_four(p, op, l->vertex_count + edge, edges, faces);
  }
}

/* Round the middle of a face: the spokes from its edges. */
INLINE void centres(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin, uint32_t end) {
  const tw_level *l = &p->levels->at[born - 1];
  const tw_point *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step - born, spokes = 2 * l->edge_count;
  for (uint32_t f = begin; f < end; f++) {
    uint32_t c = face_begin(l, size, f), n = face_end(l, size, f) - c,
             v = l->vertex_count + l->edge_count + f;
    ring r = start_ring(p, op, v, n);
    tw_point edges[4], faces[4];
    for (uint32_t i = 0; i < n; i++) {
      uint32_t before = c + (i ? i : n) - 1;
      tw_point edge = E[edge_after(2 * (spokes + before) + 1, steps)],
               face = F[face_after(4 * (c + i) + 2, steps + 1) / 4];
      if (size == 4)
        edges[i] = edge, faces[i] = face;
      else
        add_to_ring(&r, op, i, edge, face);
    }
    if (size == 4)
      take_four(p, op, v, edges, faces);
    else
      end_ring(p, op, v, &r);
  }
}

/* ---- vertices that the step makes: limits and normals ---------------------------------------- */

INLINE void new_edges(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin,
                      uint32_t end) {
  const tw_level *l = &p->levels->at[born - 1];
  const tw_point *Q = p->points, *E = edge_points(p), *F = face_points(p);
  const uint32_t *half = l->corner_half;
  for (uint32_t edge = begin; edge < end; edge++) {
    if (edge + AHEAD < end)
      for (int i = 0; i < 2; i++) {
        uint32_t c = l->edge_corners[edge + AHEAD][i];
        __builtin_prefetch(F + corner_face(l, size, c));
        __builtin_prefetch(Q + l->corner_vertex[c]);
        __builtin_prefetch(E + half[corner_previous(l, size, c)] / 2);
        __builtin_prefetch(E + half[corner_next(l, size, c)] / 2);
      }
    uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1];
    const tw_point edges[4] = {Q[l->corner_vertex[against]], F[corner_face(l, size, along)],
                               Q[l->corner_vertex[along]], F[corner_face(l, size, against)]},
                   faces[4] = {E[half[corner_next(l, size, along)] / 2],
                               E[half[corner_previous(l, size, along)] / 2],
                               E[half[corner_next(l, size, against)] / 2],
                               E[half[corner_previous(l, size, against)] / 2]};
    take_four(p, op, l->vertex_count + edge, edges, faces);
  }
}

INLINE void new_faces(const pass *p, uint32_t size, operation op, uint32_t born, uint32_t begin,
                      uint32_t end) {
  const tw_level *l = &p->levels->at[born - 1];
  const tw_point *Q = p->points, *E = edge_points(p);
  for (uint32_t f = begin; f < end; f++) {
    uint32_t c = face_begin(l, size, f), n = face_end(l, size, f) - c,
             v = l->vertex_count + l->edge_count + f;
    ring r = start_ring(p, op, v, n);
    tw_point edges[4], faces[4];
    for (uint32_t i = 0; i < n; i++) {
      tw_point edge = E[l->corner_half[c + (i ? i : n) - 1] / 2], face = Q[l->corner_vertex[c + i]];
      if (size == 4)
        edges[i] = edge, faces[i] = face;
      else
        add_to_ring(&r, op, i, edge, face);
    }
    if (size == 4)
      take_four(p, op, v, edges, faces);
    else
      end_ring(p, op, v, &r);
  }
}

/* ---- which loop ----------------------------------------------------------------------------- */

INLINE void by_operation(class_loop *loop, const pass *p, uint32_t size, uint32_t born, uint32_t begin,
                         uint32_t end) {
  if (p->operation == POINT)
    loop(p, size, POINT, born, begin, end);
  else if (p->operation == LIMIT)
    loop(p, size, LIMIT, born, begin, end);
  else
    loop(p, size, NORMAL, born, begin, end);
}

/* table: the level whose tables the loop reads. */
INLINE void by_size(class_loop *loop, const pass *p, uint32_t table, uint32_t born, uint32_t begin,
                    uint32_t end) {
  uint32_t size = p->levels->at[table].face_size;
  if (size == 4)
    by_operation(loop, p, 4, born, begin, end);
  else if (size == 3)
    by_operation(loop, p, 3, born, begin, end);
  else
    by_operation(loop, p, 0, born, begin, end);
}

/* Vertices of a level, in order: the cage's, then edge and face points of each step. */
typedef enum vertex_class { CAGE, MIDDLES, CENTRES, NEW_EDGES, NEW_FACES } vertex_class;

static void run_class(const pass *p, vertex_class class, uint32_t born, uint32_t begin, uint32_t end) {
  switch (class) {
  case CAGE: by_size(cage_vertices, p, 0, born, begin, end); return;
  case MIDDLES: by_size(middles, p, born - 1, born, begin, end); return;
  case CENTRES: by_size(centres, p, born - 1, born, begin, end); return;
  case NEW_EDGES: by_size(new_edges, p, born - 1, born, begin, end); return;
  case NEW_FACES: by_size(new_faces, p, born - 1, born, begin, end); return;
  }
}

/* Runs a class for its vertices in [first, end). */
static void run_part(const pass *p, vertex_class class, uint32_t born, uint32_t count, uint32_t *base,
                     uint32_t first, uint32_t end) {
  uint32_t begin = first > *base ? first - *base : 0, stop = end > *base ? end - *base : 0;
  if (stop > count) stop = count;
  if (begin < stop) run_class(p, class, born, begin, stop);
  *base += count;
}

static void run_vertices(const pass *p, uint32_t first, uint32_t end) {
  const tw_level *at = p->levels->at;
  uint32_t base = 0;
  run_part(p, CAGE, 0, at[0].vertex_count, &base, first, end);
  for (uint32_t born = 1; born <= p->step; born++) {
    run_part(p, MIDDLES, born, at[born - 1].edge_count, &base, first, end);
    run_part(p, CENTRES, born, at[born - 1].face_count, &base, first, end);
  }
  run_part(p, NEW_EDGES, p->step + 1, at[p->step].edge_count, &base, first, end);
  run_part(p, NEW_FACES, p->step + 1, at[p->step].face_count, &base, first, end);
}

/* ---- new points of a step ------------------------------------------------------------------- */

/* Faces, edges or corners [begin, end) of the level whose tables are read. */
typedef void point_loop(const pass *p, const tw_level *l, uint32_t size, uint32_t begin, uint32_t end);

INLINE void make_faces(const pass *p, const tw_level *l, uint32_t size, uint32_t begin, uint32_t end) {
  const tw_point *P = p->above;
  tw_point *F = p->points + l->vertex_count + l->edge_count;
  for (uint32_t f = begin; f < end; f++) {
    uint32_t first = face_begin(l, size, f), n = face_end(l, size, f) - first;
    tw_point sum = P[l->corner_vertex[first]];
    for (uint32_t i = 1; i < n; i++) sum += P[l->corner_vertex[first + i]];
    F[f] = sum / all((float)n);
  }
}

INLINE tw_point edge_point(bool linear, tw_point a, tw_point b, tw_point left, tw_point right) {
  return linear ? all(0.5f) * (a + b) : all(0.25f) * ((a + b) + (left + right));
}

INLINE void make_edges(const pass *p, const tw_level *l, uint32_t size, uint32_t begin, uint32_t end) {
  const tw_point *P = p->above, *F = p->points + l->vertex_count + l->edge_count;
  tw_point *E = p->points + l->vertex_count;
  bool linear = p->levels->linear;
  for (uint32_t edge = begin; edge < end; edge++) {
    uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1],
             far = linear ? corner_next(l, size, along) : against;
    E[edge] = edge_point(linear, P[l->corner_vertex[along]], P[l->corner_vertex[far]],
                         F[corner_face(l, size, along)], F[corner_face(l, size, against)]);
  }
}

INLINE void points_by_size(point_loop *loop, const pass *p, const tw_level *l, uint32_t begin, uint32_t end) {
  if (l->face_size == 4)
    loop(p, l, 4, begin, end);
  else if (l->face_size == 3)
    loop(p, l, 3, begin, end);
  else
    loop(p, l, 0, begin, end);
}

static void run_faces(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const pass *p = context;
  (void)part;
  points_by_size(make_faces, p, &p->levels->at[p->step], begin, end);
}
static void run_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const pass *p = context;
  (void)part;
  points_by_size(make_edges, p, &p->levels->at[p->step], begin, end);
}
static void run_any(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  (void)part;
  run_vertices(context, begin, end);
}

/* ---- a step --------------------------------------------------------------------------------- */

static void apply_masks(const tw_level_masks *masks, uint32_t vertex_count, const tw_point *above,
                        tw_point *points) {
  for (uint32_t i = 0; i < masks->count; i++) {
    tw_point sum = {0};
    for (uint32_t s = masks->first[i]; s < masks->first[i + 1]; s++) {
      uint32_t v = masks->shares[s].vertex;
      sum += all(masks->shares[s].weight) * (v < vertex_count ? above : points)[v];
    }
    points[masks->vertices[i]] = sum;
  }
}

static void refine_step(const tw_levels *levels, uint32_t step, const tw_point *above,
                        const tw_parallel_for *parallel, tw_point *points) {
  pass p = {.levels = levels, .operation = POINT, .step = step, .above = above, .points = points};
  const tw_level *l = &levels->at[step];
  tw_parallel_for_run(parallel, l->face_count, TW_PARALLEL_FOR_LEAST, run_faces, &p);
  tw_parallel_for_run(parallel, l->edge_count, TW_PARALLEL_FOR_LEAST, run_edges, &p);
  if (levels->linear)
    memcpy(points, above, l->vertex_count * sizeof *points);
  else
    tw_parallel_for_run(parallel, l->vertex_count, TW_PARALLEL_FOR_LEAST, run_any, &p);
  apply_masks(&levels->masks[step], l->vertex_count, above, points);
}

tw_status tw_levels_refine(const tw_levels *levels, const tw_point *cage, const tw_parallel_for *parallel,
                           tw_point *out) {
  const tw_point *above = cage;
  tw_point *kept = NULL;
  tw_status status = TW_OK;
  for (uint32_t step = 0; step < levels->level && status == TW_OK; step++) {
    bool last = step + 1 == levels->level;
    tw_point *points = last ? out : tw_alloc(levels->at[step + 1].vertex_count, sizeof *points);
    if (points) refine_step(levels, step, above, parallel, points);
    free(kept);
    if (!points) return TW_NO_MEMORY;
    above = points;
    kept = last ? NULL : points;
    status = tw_parallel_for_status(parallel);
  }
  free(kept);
  return status;
}

void tw_levels_limit(const tw_levels *levels, const tw_point *points, const tw_parallel_for *parallel,
                     tw_point *out) {
  uint32_t count = tw_levels_points(levels);
  if (levels->linear) {
    memcpy(out, points, count * sizeof *out);
    return;
  }
  pass p = {.levels = levels,
            .operation = LIMIT,
            .step = levels->level - 1,
            .points = (tw_point *)points, /* never written through */
            .limits = out};
  tw_parallel_for_run(parallel, count, TW_PARALLEL_FOR_LEAST, run_any, &p);
  const tw_level_limits *limits = &levels->limits;
  for (uint32_t i = 0; i < limits->count; i++) {
    tw_point sum = {0};
    for (uint32_t e = limits->first[i]; e < limits->first[i + 1]; e++)
      sum += all(limits->entries[e].position) * points[limits->entries[e].vertex];
    out[limits->vertices[i]] = sum;
  }
}

/* ---- reading -------------------------------------------------------------------------------- */

void tw_levels_normals(const tw_levels *levels, const tw_level_points *points, uint32_t first, uint32_t count,
                       uint32_t stride, float *out) {
  const pass p = {.levels = levels,
                  .operation = NORMAL,
                  .step = levels->level - 1,
                  .points = (tw_point *)points->refined, /* never written through */
                  .positions = points->positions,
                  .origin = points->origin,
                  .rows = out,
                  .first = first,
                  .stride = stride};
  run_vertices(&p, first, first + count);
}

void tw_levels_slopes(const tw_levels *levels, const tw_point *points, uint32_t first, uint32_t count,
                      tw_point *out) {
  const pass p = {.levels = levels,
                  .operation = NORMAL,
                  .step = levels->level - 1,
                  .points = (tw_point *)points, /* never written through */
                  .slopes = out,
                  .first = first};
  run_vertices(&p, first, first + count);
}

static void sum_slopes(const tw_level_rows *rows, uint32_t first, uint32_t end, uint32_t vertex,
                       const tw_point *points, tw_point out[2]) {
  out[0] = out[1] = (tw_point){0};
  for (uint32_t e = first; e < end; e++) {
    tw_point offset = points[rows->entries[e].vertex] - points[vertex];
    out[0] += all(rows->entries[e].tangent1) * offset;
    out[1] += all(rows->entries[e].tangent2) * offset;
  }
}

void tw_levels_row_slopes(const tw_level_rows *rows, uint32_t n, const tw_point *points, const tw_point *uvs,
                          tw_point points_out[2], tw_point uvs_out[2]) {
  const uint32_t *slopes = rows->slopes[n];
  sum_slopes(rows, slopes[0], slopes[1], rows->points[n], points, points_out);
  sum_slopes(rows, slopes[1], slopes[2], rows->uvs[rows->frames[n] / 2][n], uvs, uvs_out);
}

void tw_levels_row_normal(const tw_level_rows *rows, uint32_t n, const tw_point *points, float normal[3]) {
  tw_point tangents[2], quad[4];
  sum_slopes(rows, rows->first_entry[n], rows->end_entry[n], rows->points[n], points, tangents);
  for (int k = 0; k < 4; k++) quad[k] = points[rows->quad[n][k]];
  careful_normal(tangents[0], tangents[1], quad, normal);
}

/* The UV set's edge at the points' `edge` of `level`. Edges inside faces follow those on cage edges. */
static uint32_t uv_edge(const tw_levels *points, const tw_levels *set, uint32_t level, uint32_t edge) {
  uint32_t outer = points->at[0].edge_count << level;
  if (edge >= outer) return edge - outer + (set->at[0].edge_count << level);
  uint32_t of = set->edge_of[edge >> level], last = (1u << level) - 1, place = edge & last;
  return ((of >> 1) << level) + (of & 1 ? last - place : place);
}

static uint32_t uv_vertex(const tw_levels *points, const tw_levels *set, uint32_t vertex) {
  uint32_t level = points->level;
  while (level > 0 && vertex < points->at[level - 1].vertex_count) level--;
  if (level == 0) return set->vertex_of[vertex];
  const tw_level *from = &points->at[level - 1], *to = &set->at[level - 1];
  vertex -= from->vertex_count;
  if (vertex >= from->edge_count) return to->vertex_count + to->edge_count + (vertex - from->edge_count);
  return to->vertex_count + uv_edge(points, set, level - 1, vertex);
}

void tw_levels_uv_vertices(const tw_levels *points, const tw_levels *set, uint32_t first, uint32_t count,
                           uint32_t *out) {
  for (uint32_t i = 0; i < count; i++)
    out[i] = set->vertex_of ? uv_vertex(points, set, first + i) : first + i;
}

/* The cage's face that a corner of `level` is of. */
static uint32_t corner_cage_face(const tw_levels *levels, uint32_t level, uint32_t corner) {
  return corner_face(&levels->at[0], levels->at[0].face_size, corner >> 2 * level);
}

/* A cage face that has the edge. */
static uint32_t edge_cage_face(const tw_levels *levels, uint32_t level, uint32_t edge) {
  for (; level > 0; level--, edge /= 2) {
    uint32_t outer = 2 * levels->at[level - 1].edge_count;
    if (edge >= outer) return corner_cage_face(levels, level - 1, edge - outer);
  }
  return corner_cage_face(levels, 0, levels->at[0].edge_corners[edge][0]);
}

static uint32_t vertex_cage_face(const tw_levels *levels, uint32_t vertex) {
  uint32_t level = levels->level;
  while (level > 0 && vertex < levels->at[level - 1].vertex_count) level--;
  if (level == 0) return corner_cage_face(levels, 0, levels->fan_corners[levels->fan_offsets[vertex]]);
  const tw_level *l = &levels->at[--level];
  vertex -= l->vertex_count;
  if (vertex < l->edge_count) return edge_cage_face(levels, level, vertex);
  vertex -= l->edge_count;
  return level == 0 ? vertex : corner_cage_face(levels, level - 1, vertex);
}

void tw_levels_cage_faces(const tw_levels *levels, uint32_t first, uint32_t count, uint32_t *out) {
  for (uint32_t i = 0; i < count; i++) out[i] = vertex_cage_face(levels, first + i);
}

INLINE void faces_by_size(const tw_level *l, uint32_t size, uint32_t first, uint32_t end, uint32_t *out) {
  for (uint32_t c = first; c < end; c++, out += 4) {
    out[0] = l->corner_vertex[c];
    out[1] = l->vertex_count + l->corner_half[c] / 2;
    out[2] = l->vertex_count + l->edge_count + corner_face(l, size, c);
    out[3] = l->vertex_count + l->corner_half[corner_previous(l, size, c)] / 2;
  }
}

void tw_levels_faces(const tw_levels *levels, uint32_t first, uint32_t count, uint32_t *out) {
  const tw_level *l = &levels->at[levels->level - 1];
  if (l->face_size == 4)
    faces_by_size(l, 4, first, first + count, out);
  else if (l->face_size == 3)
    faces_by_size(l, 3, first, first + count, out);
  else
    faces_by_size(l, 0, first, first + count, out);
}

/* ---- the plan ------------------------------------------------------------------------------- */

enum { VALENCE_MAX = 4096 };

bool tw_levels_fit(const tw_topology *cage) {
  const tw_topology *t = cage;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (t->fan_offsets[v + 1] - t->fan_offsets[v] > VALENCE_MAX) return false;
  for (uint32_t f = 0; t->face_offsets && f < t->face_count; f++)
    if (tw_face_size(t, f) > VALENCE_MAX) return false;
  return true;
}

static void *copy(tw_arena *arena, const void *from, size_t count, size_t size) {
  void *to = tw_arena_alloc_raw(arena, count, size);
  if (to && count > 0) memcpy(to, from, count * size);
  return to;
}

typedef struct table_job {
  const tw_topology *cage; /* or */
  const tw_level *above;   /* the level above */
  uint32_t *corner_vertex, *corner_half, (*edge_corners)[2];
} table_job;

static void fill_cage_corners(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_topology *t = j->cage;
  (void)part;
  for (uint32_t c = begin; c < end; c++) {
    uint32_t edge = t->corner_edge[c];
    j->corner_half[c] = 2 * edge + (t->edge_vertices[edge][0] != t->corner_vertex[c]);
  }
}

static void fill_cage_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_topology *t = j->cage;
  (void)part;
  for (uint32_t e = begin; e < end; e++) {
    j->edge_corners[e][0] = t->edge_corner[e];
    j->edge_corners[e][1] = t->sibling[t->edge_corner[e]];
  }
}

static tw_status make_cage_tables(const tw_topology *t, const tw_parallel_for *parallel, tw_arena *arena,
                                  tw_levels *out) {
  tw_level *l = &out->at[0];
  *l = (tw_level){.vertex_count = t->vertex_count,
                  .edge_count = t->edge_count,
                  .face_count = t->face_count,
                  .corner_count = t->corner_count,
                  .face_size = t->face_size};
  table_job job = {.cage = t,
                   .corner_half = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t)),
                   .edge_corners = tw_arena_alloc_raw(arena, t->edge_count, sizeof(uint32_t[2]))};
  l->corner_vertex = copy(arena, t->corner_vertex, t->corner_count, sizeof(uint32_t));
  out->fan_offsets = copy(arena, t->fan_offsets, (size_t)t->vertex_count + 1, sizeof(uint32_t));
  out->fan_corners = copy(arena, t->fan_corners, t->corner_count, sizeof(uint32_t));
  bool complete =
      job.corner_half && job.edge_corners && l->corner_vertex && out->fan_offsets && out->fan_corners;
  if (t->face_offsets) {
    l->face_offsets = copy(arena, t->face_offsets, (size_t)t->face_count + 1, sizeof(uint32_t));
    l->corner_face = copy(arena, t->corner_face, t->corner_count, sizeof(uint32_t));
    complete = complete && l->face_offsets && l->corner_face;
  }
  if (!complete) return TW_NO_MEMORY;
  tw_parallel_for_run(parallel, t->corner_count, TW_PARALLEL_FOR_LEAST, fill_cage_corners, &job);
  tw_parallel_for_run(parallel, t->edge_count, TW_PARALLEL_FOR_LEAST, fill_cage_edges, &job);
  l->corner_half = job.corner_half;
  l->edge_corners = (const uint32_t(*)[2])job.edge_corners;
  return TW_OK;
}

static tw_level next_counts(const tw_level *l) {
  return (tw_level){.vertex_count = l->vertex_count + l->edge_count + l->face_count,
                    .edge_count = 2 * l->edge_count + l->corner_count,
                    .face_count = l->corner_count,
                    .corner_count = 4 * l->corner_count,
                    .face_size = 4};
}

/* Quads and spokes of corners. */
INLINE void split_corners(const table_job *j, uint32_t size, uint32_t begin, uint32_t end) {
  const tw_level *l = j->above;
  uint32_t V = l->vertex_count, E = l->edge_count;
  for (uint32_t c = begin; c < end; c++) {
    uint32_t before = corner_previous(l, size, c), half = l->corner_half[c], other = l->corner_half[before];
    uint32_t *vertices = j->corner_vertex + 4 * (size_t)c, *ends = j->corner_half + 4 * (size_t)c;
    vertices[0] = l->corner_vertex[c];
    vertices[1] = V + half / 2;
    vertices[2] = V + E + corner_face(l, size, c);
    vertices[3] = V + other / 2;
    ends[0] = 2 * half + half % 2;
    ends[1] = 2 * (2 * E + c);
    ends[2] = 2 * (2 * E + before) + 1;
    ends[3] = 2 * (other ^ 1) + other % 2;
    j->edge_corners[2 * E + c][0] = 4 * c + 1;
    j->edge_corners[2 * E + c][1] = 4 * corner_next(l, size, c) + 2;
  }
}

static void split_all_corners(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  (void)part;
  if (j->above->face_size == 4)
    split_corners(j, 4, begin, end);
  else if (j->above->face_size == 3)
    split_corners(j, 3, begin, end);
  else
    split_corners(j, 0, begin, end);
}

static void split_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_level *l = j->above;
  (void)part;
  for (uint32_t e = begin; e < end; e++)
    for (uint32_t k = 0; k < 2; k++) {
      uint32_t along = l->edge_corners[e][k], against = l->edge_corners[e][1 - k];
      /* Of the half at the start of `along`; of the second half that is the one against it. */
      j->edge_corners[2 * e + k][k] = 4 * along;
      j->edge_corners[2 * e + k][1 - k] = 4 * corner_next(l, l->face_size, against) + 3;
    }
}

static tw_status make_child_tables(const tw_level *above, const tw_parallel_for *parallel, tw_arena *arena,
                                   tw_level *l) {
  table_job job = {.above = above,
                   .corner_vertex = tw_arena_alloc_raw(arena, l->corner_count, sizeof(uint32_t)),
                   .corner_half = tw_arena_alloc_raw(arena, l->corner_count, sizeof(uint32_t)),
                   .edge_corners = tw_arena_alloc_raw(arena, l->edge_count, sizeof(uint32_t[2]))};
  if (!job.corner_vertex || !job.corner_half || !job.edge_corners) return TW_NO_MEMORY;
  tw_parallel_for_run(parallel, above->corner_count, TW_PARALLEL_FOR_LEAST, split_all_corners, &job);
  tw_parallel_for_run(parallel, above->edge_count, TW_PARALLEL_FOR_LEAST, split_edges, &job);
  l->corner_vertex = job.corner_vertex;
  l->corner_half = job.corner_half;
  l->edge_corners = (const uint32_t(*)[2])job.edge_corners;
  return TW_OK;
}

static tw_status make_tables(const tw_levels_wish *wish, uint32_t field, tw_arena *arena, tw_levels *out) {
  const tw_topology *cage = wish->fields[field], *points = wish->fields[0];
  tw_levels *levels = &out[field];
  if (field > 0 && cage->vertex_count == points->vertex_count && cage->edge_count == points->edge_count) {
    memcpy(levels->at, out[0].at, sizeof levels->at); /* without a seam all numbers are those of the points */
    levels->fan_offsets = out[0].fan_offsets;
    levels->fan_corners = out[0].fan_corners;
    return TW_OK;
  }
  tw_status status = make_cage_tables(cage, wish->parallel, arena, levels);
  for (uint32_t p = 1; p <= wish->level; p++) {
    levels->at[p] = next_counts(&levels->at[p - 1]);
    if (status == TW_OK) status = tw_parallel_for_status(wish->parallel);
    if (status == TW_OK && p < wish->level)
      status = make_child_tables(&levels->at[p - 1], wish->parallel, arena, &levels->at[p]);
  }
  return status;
}

/* Exactly 0 at a quarter turn: cos() leaves a residue there, which coincident points would not cancel and
 * which would pass for a tangent. */
static void fill_weights(uint32_t n, float *out) {
  double step = 2 * pi / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16, face = 1 / (4 * lambda - 1);
  for (uint32_t i = 0; i < n; i++) {
    bool quarter = 4 * i == n || 4 * i == 3 * n;
    out[i] = quarter ? 0 : (float)(4 * cos(i * step));
    out[n + i] = (float)(face * (cos(i * step) + cos((i + 1) * step)));
  }
}

static tw_status make_weights(const tw_topology *t, tw_arena *arena, tw_levels *out) {
  uint32_t greatest = 4, size = 0;
  bool used[VALENCE_MAX + 1] = {false};
  used[3] = used[4] = true;
  for (uint32_t v = 0; v < t->vertex_count; v++) used[t->fan_offsets[v + 1] - t->fan_offsets[v]] = true;
  for (uint32_t f = 0; t->face_offsets && f < t->face_count; f++) used[tw_face_size(t, f)] = true;
  for (uint32_t n = 1; n <= VALENCE_MAX; n++) {
    if (!used[n]) continue;
    greatest = n;
    size += 2 * n;
  }
  uint32_t *weights_of = tw_arena_alloc(arena, (size_t)greatest + 1, sizeof *weights_of), at = 0;
  float *weights = tw_arena_alloc(arena, size, sizeof *weights);
  if (!weights_of || !weights) return TW_NO_MEMORY;
  for (uint32_t n = 1; n <= greatest; n++) {
    if (!used[n]) continue;
    weights_of[n] = at;
    fill_weights(n, weights + at);
    at += 2 * n;
  }
  out->weights_of = weights_of;
  out->weights = weights;
  return TW_OK;
}

/* Where vertices and edges of the points are in a UV set. */
static tw_status map_uvs(const tw_topology *points, const tw_topology *set, tw_arena *arena, tw_levels *out) {
  if (set->vertex_count == points->vertex_count && set->edge_count == points->edge_count) return TW_OK;
  uint32_t *vertex_of = tw_arena_alloc_raw(arena, points->vertex_count, sizeof *vertex_of),
           *edge_of = tw_arena_alloc_raw(arena, points->edge_count, sizeof *edge_of);
  if (!vertex_of || !edge_of) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < points->vertex_count; v++)
    vertex_of[v] = set->corner_vertex[points->fan_corners[points->fan_offsets[v]]];
  for (uint32_t e = 0; e < points->edge_count; e++) {
    uint32_t corner = points->edge_corner[e], edge = set->corner_edge[corner];
    edge_of[e] = 2 * edge + (set->edge_vertices[edge][0] != set->corner_vertex[corner]);
  }
  out->vertex_of = vertex_of;
  out->edge_of = edge_of;
  return TW_OK;
}

tw_status tw_levels_plan(const tw_levels_wish *wish, tw_arena *arena, tw_levels *out, tw_level_rows *rows) {
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < wish->field_count && status == TW_OK; f++) {
    out[f] = (tw_levels){.level = wish->level, .linear = wish->linear[f]};
    status = make_tables(wish, f, arena, out);
    if (status == TW_OK && f > 0) status = map_uvs(wish->fields[0], wish->fields[f], arena, &out[f]);
  }
  if (status == TW_OK && wish->normals) status = make_weights(wish->fields[0], arena, &out[0]);
  for (uint32_t f = 1; f < wish->field_count; f++) {
    out[f].weights_of = out[0].weights_of;
    out[f].weights = out[0].weights;
  }
  return status == TW_OK ? tw_levels_list_exceptions(wish, arena, out, rows) : status;
}
