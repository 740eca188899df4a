/* Loops over the children of faces, edges and vertices. A step keeps the numbers of existing vertices, and
 * the edges and faces at such a vertex have numbers that follow, at any later level, from those at the
 * vertex's first level by a shift. */
#include "shallow_levels.h"

#include <stdlib.h>
#include <string.h>

#include "normal.h"

#define INLINE static inline __attribute__((always_inline))

/* ---- numbers at later levels ----------------------------------------------------------------- */

/* The part of an edge, `steps` levels down, that lies at the vertex of one of its halves. half: 2 x edge, + 1
 * for the half at the edge's second end. */
INLINE uint32_t edge_after(uint32_t half, uint32_t steps) {
  return ((half >> 1) << steps) + (((1u << steps) - 1) & (0 - (half & 1)));
}
/* The face at a corner's vertex, `steps` levels down; steps is 1 or more. */
INLINE uint32_t face_after(uint32_t corner, uint32_t steps) {
  return corner << 2 * (steps - 1);
}

/* ---- a pass over vertices -------------------------------------------------------------------- */

/* What is computed from a vertex and the ring around it. The ring is that of the next level for POINT, of the
 * vertex's own level for LIMIT and NORMAL. */
typedef enum operation { POINT, LIMIT, NORMAL } operation;

typedef struct pass {
  const tw_shallow *levels;
  operation operation;
  uint32_t step;         /* the level that the step leads from */
  const tw_point *above; /* POINT: points of the level that the step leads from */
  tw_point *points;      /* points of the level that the step leads to */
  tw_point *limits;
  const tw_point *positions; /* NORMAL: positions for the rows, relative to `origin` */
  tw_point origin;
  float *rows;      /* NORMAL: rows from vertex `first` on */
  tw_point *slopes; /* NORMAL: NULL, or [][2], written in place of rows */
  uint32_t first, stride;
} pass;

INLINE tw_point splat(float x) {
  return (tw_point){x, x, x, x};
}

/* Writes the row, or the slopes, of a vertex with tangents t1 and t2. quad: the vertex, then points of its
 * ring, the first and the last of which lie along t1 and t2. */
INLINE void put_row(const pass *p, uint32_t v, tw_point t1, tw_point t2, const tw_point quad[4]) {
  if (p->slopes) {
    tw_point *slopes = p->slopes + 2 * (size_t)(v - p->first);
    slopes[0] = p->levels->linear ? quad[1] - quad[0] : t1;
    slopes[1] = p->levels->linear ? quad[3] - quad[0] : t2;
    return;
  }
  float *row = p->rows + (size_t)(v - p->first) * p->stride;
  tw_store_point(p->positions[v] + p->origin, row);
  tw_put_normal(t1, t2, quad, row + 3);
}

/* Computes a vertex of valence 4. Face i lies between edges i and i + 1. */
INLINE void put_valence_four(const pass *p, operation op, uint32_t v, const tw_point edges[4],
                             const tw_point faces[4]) {
  if (op == NORMAL) {
    tw_point x = faces[0] - faces[2], y = faces[3] - faces[1];
    const tw_point quad[4] = {p->points[v], edges[0], faces[0], edges[1]};
    put_row(p, v, splat(4) * (edges[0] - edges[2]) + (x + y), splat(4) * (edges[1] - edges[3]) + (x - y),
            quad);
    return;
  }
  tw_point e = (edges[0] + edges[1]) + (edges[2] + edges[3]),
           f = (faces[0] + faces[1]) + (faces[2] + faces[3]);
  if (op == POINT)
    p->points[v] = splat(0.25f) * (p->above[v] + e) - splat(0.0625f) * f;
  else
    p->limits[v] = splat(4.0f / 9) * p->points[v] + splat(1.0f / 9) * e + splat(1.0f / 36) * f;
}

/* A vertex of any valence: sums of the points around it, or of their tangent weights. */
typedef struct ring {
  uint32_t valence;
  const float *weights; /* NORMAL: the tangent weights of the valence */
  tw_point own, sums[2], quad[4];
} ring;

INLINE ring start_ring(const pass *p, operation op, uint32_t v, uint32_t valence) {
  const tw_shallow *l = p->levels;
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
  r->sums[0] += splat(r->weights[i]) * edge + splat(r->weights[n + i]) * face;
  r->sums[1] += splat(r->weights[before]) * edge + splat(r->weights[n + before]) * face;
}

/* POINT: ((n - 2) P + (sum of ends + sum of face points) / n) / n, with edge points in place of the far ends
 * of edges, is ((n - 3) P + (4 sum of edge points - sum of face points) / n) / n. */
INLINE void end_ring(const pass *p, operation op, uint32_t v, ring *r) {
  float n = (float)r->valence;
  if (op == POINT) {
    p->points[v] = splat((n - 3) / n) * r->own + splat(1 / (n * n)) * (splat(4) * r->sums[0] - r->sums[1]);
  } else if (op == LIMIT) {
    p->limits[v] =
        splat(n / (n + 5)) * r->own + splat(1 / (n * (n + 5))) * (splat(4) * r->sums[0] + r->sums[1]);
  } else {
    r->quad[0] = r->own;
    put_row(p, v, r->sums[0], r->sums[1], r->quad);
  }
}

/* ---- vertices that are older than the step --------------------------------------------------- */

/* Computes the vertices [begin, end) of a class. first_level: the first level with vertices of the class.
 * size: the face_size of the level whose tables the loop reads. */
typedef void class_loop(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                        uint32_t end);

static const tw_point *edge_points(const pass *p) {
  return p->points + p->levels->at[p->step].vertex_count;
}
static const tw_point *face_points(const pass *p) {
  return edge_points(p) + p->levels->at[p->step].edge_count;
}

INLINE void cage_vertices(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                          uint32_t end) {
  const tw_shallow *levels = p->levels;
  const tw_shallow_level *cage = &levels->at[0];
  const tw_point *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step;
  (void)first_level;
  for (uint32_t v = begin; v < end; v++) {
    uint32_t first = levels->fan_offsets[v], n = levels->fan_offsets[v + 1] - first;
    ring r = start_ring(p, op, v, n);
    for (uint32_t i = 0; i < n; i++) {
      uint32_t c = levels->fan_corners[first + i];
      add_to_ring(&r, op, i, E[edge_after(cage->corner_half[c], steps)],
                  F[steps ? face_after(c, steps) : tw_shallow_corner_face(cage, size, c)]);
    }
    end_ring(p, op, v, &r);
  }
}

/* The ring of an edge's middle: edges are its half at the end, the spoke into its first face, its half at the
 * start, the spoke into the second face; faces lie between them. */
typedef struct middle {
  uint32_t edges[4], faces[4];
} middle;

INLINE middle middle_of(const tw_shallow_level *l, uint32_t size, uint32_t edge, uint32_t steps) {
  uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1];
  uint32_t spokes = 2 * l->edge_count;
  return (middle){{edge_after(4 * edge + 2, steps), edge_after(2 * (spokes + along), steps),
                   edge_after(4 * edge + 1, steps), edge_after(2 * (spokes + against), steps)},
                  {face_after(4 * tw_shallow_corner_next(l, size, along) + 3, steps + 1) / 4,
                   face_after(4 * along + 1, steps + 1) / 4,
                   face_after(4 * tw_shallow_corner_next(l, size, against) + 3, steps + 1) / 4,
                   face_after(4 * against + 1, steps + 1) / 4}};
}

INLINE void middles(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                    uint32_t end) {
  const tw_shallow_level *l = &p->levels->at[first_level - 1];
  const tw_point *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step - first_level;
  for (uint32_t edge = begin; edge < end; edge++) {
    middle m = middle_of(l, size, edge, steps);
    const tw_point edges[4] = {E[m.edges[0]], E[m.edges[1]], E[m.edges[2]], E[m.edges[3]]},
                   faces[4] = {F[m.faces[0]], F[m.faces[1]], F[m.faces[2]], F[m.faces[3]]};
    put_valence_four(p, op, l->vertex_count + edge, edges, faces);
  }
}

/* ---- edge points that the step makes: limits and normals ------------------------------------- */

INLINE void new_edges(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                      uint32_t end) {
  const tw_shallow_level *l = &p->levels->at[first_level - 1];
  const tw_point *Q = p->points, *E = edge_points(p), *F = face_points(p);
  const uint32_t *half = l->corner_half;
  for (uint32_t edge = begin; edge < end; edge++) {
    uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1];
    const tw_point edges[4] = {Q[l->corner_vertex[against]], F[tw_shallow_corner_face(l, size, along)],
                               Q[l->corner_vertex[along]], F[tw_shallow_corner_face(l, size, against)]},
                   faces[4] = {E[half[tw_shallow_corner_next(l, size, along)] / 2],
                               E[half[tw_shallow_corner_previous(l, size, along)] / 2],
                               E[half[tw_shallow_corner_next(l, size, against)] / 2],
                               E[half[tw_shallow_corner_previous(l, size, against)] / 2]};
    put_valence_four(p, op, l->vertex_count + edge, edges, faces);
  }
}

/* ---- face points, older or made by the step -------------------------------------------------- */

INLINE void round_faces(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                        uint32_t end, bool is_new) {
  const tw_shallow_level *l = &p->levels->at[first_level - 1];
  const tw_point *Q = p->points, *E = edge_points(p), *F = face_points(p);
  uint32_t steps = p->step - first_level, spokes = 2 * l->edge_count;
  for (uint32_t f = begin; f < end; f++) {
    uint32_t first = tw_shallow_face_begin(l, size, f), n = tw_shallow_face_end(l, size, f) - first,
             v = l->vertex_count + l->edge_count + f;
    ring r = start_ring(p, op, v, n);
    tw_point edges[4], faces[4];
    for (uint32_t i = 0; i < n; i++) {
      uint32_t c = first + i, before = first + (i ? i : n) - 1;
      tw_point edge = E[is_new ? l->corner_half[before] / 2 : edge_after(2 * (spokes + before) + 1, steps)],
               face = is_new ? Q[l->corner_vertex[c]] : F[face_after(4 * c + 2, steps + 1) / 4];
      if (size == 4)
        edges[i] = edge, faces[i] = face;
      else
        add_to_ring(&r, op, i, edge, face);
    }
    if (size == 4)
      put_valence_four(p, op, v, edges, faces);
    else
      end_ring(p, op, v, &r);
  }
}

/* Face points of earlier steps: their ring consists of the spokes of the face. */
INLINE void centres(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                    uint32_t end) {
  round_faces(p, size, op, first_level, begin, end, false);
}
/* Face points that this step makes: their ring consists of the edges and corners of the face itself. */
INLINE void new_faces(const pass *p, uint32_t size, operation op, uint32_t first_level, uint32_t begin,
                      uint32_t end) {
  round_faces(p, size, op, first_level, begin, end, true);
}

/* ---- choice of the loop ---------------------------------------------------------------------- */

INLINE void by_operation(class_loop *loop, const pass *p, uint32_t size, uint32_t first_level, uint32_t begin,
                         uint32_t end) {
  if (p->operation == POINT)
    loop(p, size, POINT, first_level, begin, end);
  else if (p->operation == LIMIT)
    loop(p, size, LIMIT, first_level, begin, end);
  else
    loop(p, size, NORMAL, first_level, begin, end);
}

INLINE void by_size(class_loop *loop, const pass *p, uint32_t table, uint32_t first_level, uint32_t begin,
                    uint32_t end) {
  uint32_t size = p->levels->at[table].face_size;
  if (size == 4)
    by_operation(loop, p, 4, first_level, begin, end);
  else if (size == 3)
    by_operation(loop, p, 3, first_level, begin, end);
  else
    by_operation(loop, p, 0, first_level, begin, end);
}

/* Classes of a level's vertices. In the order of numbers: the cage's, then edge and face points of each step;
 * NEW are those that the pass's own step makes. */
typedef enum vertex_class { CAGE, MIDDLES, CENTRES, NEW_EDGES, NEW_FACES } vertex_class;

static void run_class(const pass *p, vertex_class class, uint32_t first_level, uint32_t begin, uint32_t end) {
  switch (class) {
  case CAGE: by_size(cage_vertices, p, 0, first_level, begin, end); return;
  case MIDDLES: by_size(middles, p, first_level - 1, first_level, begin, end); return;
  case CENTRES: by_size(centres, p, first_level - 1, first_level, begin, end); return;
  case NEW_EDGES: by_size(new_edges, p, first_level - 1, first_level, begin, end); return;
  case NEW_FACES: by_size(new_faces, p, first_level - 1, first_level, begin, end); return;
  }
}

/* Runs a class for those of its `count` vertices, numbered from *base on, that lie in [first, end). Advances
 * *base. */
static void run_part(const pass *p, vertex_class class, uint32_t first_level, uint32_t count, uint32_t *base,
                     uint32_t first, uint32_t end) {
  uint32_t begin = first > *base ? first - *base : 0, stop = end > *base ? end - *base : 0;
  if (stop > count) stop = count;
  if (begin < stop) run_class(p, class, first_level, begin, stop);
  *base += count;
}

static void run_vertices(const pass *p, uint32_t first, uint32_t end) {
  const tw_shallow_level *at = p->levels->at;
  uint32_t base = 0;
  run_part(p, CAGE, 0, at[0].vertex_count, &base, first, end);
  for (uint32_t first_level = 1; first_level <= p->step; first_level++) {
    run_part(p, MIDDLES, first_level, at[first_level - 1].edge_count, &base, first, end);
    run_part(p, CENTRES, first_level, at[first_level - 1].face_count, &base, first, end);
  }
  run_part(p, NEW_EDGES, p->step + 1, at[p->step].edge_count, &base, first, end);
  run_part(p, NEW_FACES, p->step + 1, at[p->step].face_count, &base, first, end);
}

/* ---- new points of a step -------------------------------------------------------------------- */

/* Computes points of the faces or edges [begin, end) of level `l`, whose tables are read. */
typedef void point_loop(const pass *p, const tw_shallow_level *l, uint32_t size, uint32_t begin,
                        uint32_t end);

INLINE void make_faces(const pass *p, const tw_shallow_level *l, uint32_t size, uint32_t begin,
                       uint32_t end) {
  const tw_point *P = p->above;
  tw_point *F = p->points + l->vertex_count + l->edge_count;
  for (uint32_t f = begin; f < end; f++) {
    uint32_t first = tw_shallow_face_begin(l, size, f), n = tw_shallow_face_end(l, size, f) - first;
    tw_point sum = P[l->corner_vertex[first]];
    for (uint32_t i = 1; i < n; i++) sum += P[l->corner_vertex[first + i]];
    F[f] = sum / splat((float)n);
  }
}

INLINE tw_point edge_point(bool linear, tw_point a, tw_point b, tw_point left, tw_point right) {
  return linear ? splat(0.5f) * (a + b) : splat(0.25f) * ((a + b) + (left + right));
}

INLINE void make_edges(const pass *p, const tw_shallow_level *l, uint32_t size, uint32_t begin,
                       uint32_t end) {
  const tw_point *P = p->above, *F = p->points + l->vertex_count + l->edge_count;
  tw_point *E = p->points + l->vertex_count;
  bool linear = p->levels->linear;
  for (uint32_t edge = begin; edge < end; edge++) {
    uint32_t along = l->edge_corners[edge][0], against = l->edge_corners[edge][1],
             far = linear ? tw_shallow_corner_next(l, size, along) : against;
    E[edge] =
        edge_point(linear, P[l->corner_vertex[along]], P[l->corner_vertex[far]],
                   F[tw_shallow_corner_face(l, size, along)], F[tw_shallow_corner_face(l, size, against)]);
  }
}

INLINE void points_by_size(point_loop *loop, const pass *p, const tw_shallow_level *l, uint32_t begin,
                           uint32_t end) {
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

/* ---- a step ---------------------------------------------------------------------------------- */

static void apply_masks(const tw_shallow_masks *masks, uint32_t vertex_count, const tw_point *above,
                        tw_point *points) {
  for (uint32_t i = 0; i < masks->count; i++) {
    tw_point sum = {0};
    for (uint32_t s = masks->first[i]; s < masks->first[i + 1]; s++) {
      uint32_t v = masks->shares[s].vertex;
      sum += splat(masks->shares[s].weight) * (v < vertex_count ? above : points)[v];
    }
    points[masks->vertices[i]] = sum;
  }
}

static void refine_step(const tw_shallow *levels, uint32_t step, const tw_point *above,
                        const tw_parallel_for *parallel, tw_point *points) {
  pass p = {.levels = levels, .operation = POINT, .step = step, .above = above, .points = points};
  const tw_shallow_level *l = &levels->at[step];
  tw_parallel_for_run(parallel, l->face_count, TW_PARALLEL_FOR_LEAST, run_faces, &p);
  tw_parallel_for_run(parallel, l->edge_count, TW_PARALLEL_FOR_LEAST, run_edges, &p);
  if (levels->linear)
    memcpy(points, above, l->vertex_count * sizeof *points);
  else
    tw_parallel_for_run(parallel, l->vertex_count, TW_PARALLEL_FOR_LEAST, run_any, &p);
  apply_masks(&levels->masks[step], l->vertex_count, above, points);
}

tw_status tw_shallow_refine(const tw_shallow *levels, const tw_point *cage, const tw_parallel_for *parallel,
                            tw_point *out) {
  const tw_point *above = cage;
  tw_point *kept = NULL;
  tw_status status = TW_OK;
  for (uint32_t step = 0; step < levels->level && status == TW_OK; step++) {
    bool last = step + 1 == levels->level;
    tw_point *points = last ? out : tw_alloc(levels->at[step + 1].vertex_count, sizeof *points);
    if (points) refine_step(levels, step, above, parallel, points);
    tw_free(kept);
    if (!points) return TW_NO_MEMORY;
    above = points;
    kept = last ? NULL : points;
    status = tw_parallel_for_status(parallel);
  }
  tw_free(kept);
  return status;
}

void tw_shallow_limit(const tw_shallow *levels, const tw_point *points, const tw_parallel_for *parallel,
                      tw_point *out) {
  uint32_t count = tw_shallow_points(levels);
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
  const tw_shallow_limits *limits = &levels->limits;
  for (uint32_t i = 0; i < limits->count; i++) {
    tw_point sum = {0};
    for (uint32_t e = limits->first[i]; e < limits->first[i + 1]; e++)
      sum += splat(limits->entries[e].position) * points[limits->entries[e].vertex];
    out[limits->vertices[i]] = sum;
  }
}

/* ---- reading --------------------------------------------------------------------------------- */

void tw_shallow_normals(const tw_shallow *levels, const tw_shallow_positions *points, uint32_t first,
                        uint32_t count, uint32_t stride, float *out) {
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

void tw_shallow_slopes(const tw_shallow *levels, const tw_point *points, uint32_t first, uint32_t count,
                       tw_point *out) {
  const pass p = {.levels = levels,
                  .operation = NORMAL,
                  .step = levels->level - 1,
                  .points = (tw_point *)points, /* never written through */
                  .slopes = out,
                  .first = first};
  run_vertices(&p, first, first + count);
}

static void sum_slopes(const tw_limit_entry *entries, const tw_shallow_slope_mask *slopes, uint32_t vertex,
                       const tw_point *points, tw_point out[2]) {
  const float(*frame)[2] = slopes->frame;
  out[0] = out[1] = (tw_point){0};
  for (const tw_limit_entry *e = entries + slopes->first; e < entries + slopes->end; e++) {
    tw_point offset = points[e->vertex] - points[vertex];
    out[0] += splat(frame[0][0] * e->tangent1 + frame[0][1] * e->tangent2) * offset;
    out[1] += splat(frame[1][0] * e->tangent1 + frame[1][1] * e->tangent2) * offset;
  }
}

void tw_shallow_row_slopes(const tw_shallow_rows *rows, uint32_t n, const tw_point *points,
                           const tw_point *uvs, tw_point points_out[2], tw_point uvs_out[2]) {
  const tw_shallow_slope_mask *slopes = rows->slopes[n];
  sum_slopes(rows->entries, &slopes[0], rows->points[n], points, points_out);
  sum_slopes(rows->entries, &slopes[1], rows->channels[rows->frames[n] / 2][n], uvs, uvs_out);
}

void tw_shallow_row_normal(const tw_shallow_rows *rows, uint32_t n, const tw_point *points, float normal[3]) {
  tw_point tangents[2], quad[4];
  const tw_shallow_slope_mask whole = {rows->first_entry[n], rows->end_entry[n], {{1, 0}, {0, 1}}};
  sum_slopes(rows->entries, &whole, rows->points[n], points, tangents);
  for (int k = 0; k < 4; k++) quad[k] = points[rows->quad[n][k]];
  tw_put_normal(tangents[0], tangents[1], quad, normal);
}
