/* Two levels down is a step over a mesh of which only the points are there (its middles, below). What is
 * sharp in it are the halves of the sharp edges above, and the sharp vertices above. */
#include "loop_rows.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "loop.h"
#include "normal.h"
#include "refine.h"

/* ---- numbers -------------------------------------------------------------------------------- */

/* Sharpness that is over within a number of levels, or never. */
static bool settles(float sharpness, uint32_t levels) {
  return !tw_is_semi_sharp(sharpness) || sharpness <= (float)levels;
}

static bool settles_in(const tw_topology *cage, const tw_rules *rules, uint32_t levels) {
  if (cage->smooth) return true;
  if (rules->chaikin) levels = 0; /* what decays by Chaikin's rule may last a little longer */
  for (uint32_t e = 0; e < cage->edge_count; e++)
    if (!settles(cage->edge_sharpness[e], levels)) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (!settles(cage->vertex_sharpness[v], levels)) return false;
  return true;
}

uint32_t tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t level) {
  if (level < 2) return level;
  return settles_in(cage, rules, level - 2) ? 2 : 1;
}

bool tw_loop_rows_fit_normals(const tw_topology *cage, const tw_rules *rules, uint32_t level) {
  return settles_in(cage, rules, level < 2 ? 0 : level - 2) && !tw_topology_parts_normals(cage);
}

static tw_topology next_counts(const tw_topology *t) {
  return (tw_topology){.vertex_count = t->vertex_count + t->edge_count,
                       .edge_count = 2 * t->edge_count + t->corner_count,
                       .face_count = 4 * t->face_count,
                       .corner_count = 4 * t->corner_count,
                       .face_size = 3};
}

tw_topology tw_loop_rows_counts(const tw_loop_rows *rows) {
  tw_topology t = next_counts(&rows->above);
  return rows->levels == 1 ? t : next_counts(&t);
}

/* ---- masks of a mesh without edges that decay ------------------------------------------------------ */

static void add_point(double sum[3], const double *point) {
  for (int c = 0; c < 3; c++) sum[c] += point[c];
}

/* The middle of a smooth edge from a to b between triangles that face it with c and d. */
static void middle_of_smooth_edge(const double *a, const double *b, const double *c, const double *d,
                                  double *restrict out) {
  for (int i = 0; i < 3; i++) out[i] = 0.375 * (a[i] + b[i]) + 0.125 * (c[i] + d[i]);
}

static void middle_of_sharp_edge(const double *a, const double *b, double *restrict out) {
  for (int i = 0; i < 3; i++) out[i] = 0.5 * (a[i] + b[i]);
}

/* A vertex of a crease, between its neighbours there. */
static void on_crease(const double *own, const double *a, const double *b, double *restrict out) {
  for (int i = 0; i < 3; i++) out[i] = 0.75 * own[i] + 0.125 * (a[i] + b[i]);
}

/* A smooth vertex, of whose neighbours `ring` is the sum. */
static void on_smooth(const double *own, const double *ring, uint32_t valence, double weight,
                      double *restrict out) {
  double own_weight = 1 - valence * weight;
  for (int i = 0; i < 3; i++) out[i] = own_weight * own[i] + weight * ring[i];
}

/* ---- points --------------------------------------------------------------------------------- */

/* The mesh between, as numbers and points. */
typedef struct between {
  const tw_topology *t;
  const double *points, *middles; /* the middles of edges above */
} between;

static const double *vertex_point(const between *b, uint32_t vertex) {
  return b->points + 3 * (size_t)vertex;
}
static const double *middle_point(const between *b, uint32_t edge) {
  return b->middles + 3 * (size_t)edge;
}
/* Of the edge at a corner. */
static const double *middle_at(const between *b, uint32_t corner) {
  return middle_point(b, b->t->corner_edge[corner]);
}

static bool is_sharp(const tw_topology *t, uint32_t edge) {
  return !t->smooth && t->edge_sharpness[edge] > 0;
}

static void smooth_vertex(const between *b, uint32_t vertex, double *restrict row) {
  const tw_topology *t = b->t;
  uint32_t first = t->ring_offsets[vertex], valence = t->ring_offsets[vertex + 1] - first;
  double ring[3] = {0};
  for (uint32_t i = 0; i < valence; i++) add_point(ring, middle_point(b, t->ring_edges[first + i]));
  on_smooth(vertex_point(b, vertex), ring, valence, tw_loop_weight(valence), row);
}

static void take_vertices(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  const tw_topology *t = b->t;
  for (uint32_t v = begin; v < end; v++, out += 3) {
    uint32_t ends[2] = {0, 0};
    tw_vertex_rule rule = t->smooth ? TW_RULE_SMOOTH : tw_vertex_rule_at(t, v, ends);
    const uint32_t *ring = t->ring_edges + t->ring_offsets[v];
    if (rule <= TW_RULE_DART)
      smooth_vertex(b, v, out);
    else if (rule == TW_RULE_CREASE)
      on_crease(vertex_point(b, v), middle_point(b, ring[ends[0]]), middle_point(b, ring[ends[1]]), out);
    else
      memcpy(out, vertex_point(b, v), 3 * sizeof *out);
  }
}

/* All that shapes the surface near the middle of an edge above that is smooth: its ends, and the middles of
 * the other edges of its two faces, in the faces' order from the edge on. */
typedef struct edge_points {
  const double *ends[2], *middle, *ahead[2], *behind[2];
} edge_points;

static inline edge_points points_at(const between *b, uint32_t edge) {
  const tw_topology *t = b->t;
  uint32_t corners[2] = {t->edge_corner[edge], t->sibling[t->edge_corner[edge]]};
  edge_points p = {.middle = middle_point(b, edge)};
  for (int i = 0; i < 2; i++) {
    p.ends[i] = vertex_point(b, t->edge_vertices[edge][i]);
    p.ahead[i] = middle_at(b, tw_triangle_next(corners[i]));
    p.behind[i] = middle_at(b, tw_triangle_previous(corners[i]));
  }
  return p;
}

static void take_middles(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t e = begin; e < end; e++, out += 3) {
    double ring[3] = {0};
    if (is_sharp(b->t, e)) {
      const uint32_t *ends = b->t->edge_vertices[e];
      on_crease(middle_point(b, e), vertex_point(b, ends[0]), vertex_point(b, ends[1]), out);
    } else {
      edge_points p = points_at(b, e);
      for (int i = 0; i < 2; i++) { /* counter-clockwise */
        add_point(ring, p.ends[1 - i]);
        add_point(ring, p.ahead[i]);
        add_point(ring, p.behind[i]);
      }
      on_smooth(p.middle, ring, 6, 0.0625, out);
    }
  }
}

/* Halves of edges above. */
static void take_halves(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t half = begin; half < end; half++, out += 3) {
    uint32_t edge = half / 2, at = half % 2;
    if (is_sharp(b->t, edge)) {
      middle_of_sharp_edge(vertex_point(b, b->t->edge_vertices[edge][at]), middle_point(b, edge), out);
    } else {
      edge_points p = points_at(b, edge);
      middle_of_smooth_edge(p.ends[at], p.middle, p.behind[at], p.ahead[1 - at], out);
    }
  }
}

/* Edges between the middles of a face's edges. */
static void take_across(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t c = begin; c < end; c++, out += 3) {
    middle_of_smooth_edge(middle_at(b, c), middle_at(b, tw_triangle_previous(c)),
                          vertex_point(b, b->t->corner_vertex[c]), middle_at(b, tw_triangle_next(c)), out);
  }
}

static uint32_t least(uint32_t a, uint32_t b) {
  return a < b ? a : b;
}

static void points_two_down(const between *b, uint32_t first, uint32_t count, double *out) {
  const tw_topology *t = b->t;
  uint32_t end = first + count, middles = t->vertex_count, halves = middles + t->edge_count,
           across = halves + 2 * t->edge_count;
  assert(first < end);
  while (first < end) {
    uint32_t stop = end;
    if (first < middles)
      take_vertices(b, first, stop = least(end, middles), out);
    else if (first < halves)
      take_middles(b, first - middles, (stop = least(end, halves)) - middles, out);
    else if (first < across)
      take_halves(b, first - halves, (stop = least(end, across)) - halves, out);
    else
      take_across(b, first - across, end - across, out);
    out += 3 * (size_t)(stop - first);
    first = stop;
  }
}

/* Whether all rows are kept: normals look about them, and one level down they are what the generic step
 * makes. */
static bool keeps_all(const tw_loop_rows *rows) {
  return rows->normals || rows->levels == 1;
}

/* Rows two levels down from the points of the level above them. */
static void compute(const tw_loop_rows *rows, const double *points, uint32_t first, uint32_t count,
                    double *out) {
  const tw_topology *t = &rows->above;
  between b = {t, points, points + 3 * (size_t)t->vertex_count};
  points_two_down(&b, first, count, out);
}

static void round_rows(const double *in, uint32_t count, float *out) {
  for (size_t i = 0; i < 3 * (size_t)count; i++) out[i] = (float)in[i];
}

void tw_loop_rows_points(const tw_loop_rows *rows, const double *kept, uint32_t first, uint32_t count,
                         float *out) {
  enum { BLOCK = 256 }; /* stays in cache until it is rounded */
  double block[3 * BLOCK];
  if (keeps_all(rows)) {
    round_rows(kept + 3 * (size_t)first, count, out);
    return;
  }
  for (uint32_t done = 0; done < count; done += BLOCK, out += 3 * (size_t)BLOCK) {
    uint32_t taken = least(count - done, BLOCK);
    compute(rows, kept, first + done, taken, block);
    round_rows(block, taken, out);
  }
}

/* ---- what is kept --------------------------------------------------------------------------- */

size_t tw_loop_rows_kept_count(const tw_loop_rows *rows) {
  const tw_topology *t = &rows->above;
  return keeps_all(rows) ? tw_loop_rows_counts(rows).vertex_count : (size_t)t->vertex_count + t->edge_count;
}

typedef struct keep_job {
  const tw_loop_rows *rows;
  const double *points;
  double *kept;
} keep_job;

static void keep_rows(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const keep_job *j = context;
  (void)part;
  compute(j->rows, j->points, begin, end - begin, j->kept + 3 * (size_t)begin);
}

tw_status tw_loop_rows_keep(const tw_loop_rows *rows, const double *points, const tw_parallel_for *parallel,
                            double *kept) {
  const tw_topology *t = &rows->above;
  bool all = rows->levels == 2 && rows->normals;
  double *next = all ? tw_alloc((size_t)t->vertex_count + t->edge_count, 3 * sizeof *next) : kept;
  if (!next) return TW_NO_MEMORY;
  tw_status status = tw_refine_values(t, &rows->rules, 3, points, parallel, next);
  if (status == TW_OK && all)
    tw_parallel_for_run(parallel, tw_loop_rows_counts(rows).vertex_count, TW_PARALLEL_FOR_LEAST, keep_rows,
                        &(keep_job){rows, next, kept});
  if (all) free(next);
  return status;
}

/* ---- triangles ------------------------------------------------------------------------------ */

/* A triangle's vertices, and the edges after each. */
typedef struct triangle {
  uint32_t vertices[3], edges[3];
} triangle;

static triangle triangle_above(const tw_topology *t, uint32_t face) {
  triangle all;
  memcpy(all.vertices, t->corner_vertex + 3 * (size_t)face, sizeof all.vertices);
  memcpy(all.edges, t->corner_edge + 3 * (size_t)face, sizeof all.edges);
  return all;
}

/* The children of a triangle of a mesh with this many vertices. */
static inline void split(const triangle *parent, uint32_t vertices, uint32_t *restrict out) {
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3;
    out[3 * i + i] = parent->vertices[i];
    out[3 * i + next] = vertices + parent->edges[i];
    out[3 * i + previous] = vertices + parent->edges[previous];
    out[9 + i] = vertices + parent->edges[next];
  }
}

/* Those with their edges. */
static inline void split_whole(const tw_topology *t, uint32_t face, triangle children[4]) {
  triangle parent = triangle_above(t, face);
  uint32_t corners[12], across = 2 * t->edge_count + 3 * face;
  split(&parent, t->vertex_count, corners);
  for (uint32_t child = 0; child < 4; child++)
    memcpy(children[child].vertices, corners + 3 * (size_t)child, sizeof children[child].vertices);
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3, edge = parent.edges[i],
             before = parent.edges[previous], vertex = parent.vertices[i];
    children[i].edges[i] = 2 * edge + (t->edge_vertices[edge][0] != vertex);
    children[i].edges[next] = across + i;
    children[i].edges[previous] = 2 * before + (t->edge_vertices[before][0] != vertex);
    children[3].edges[next] = across + i;
  }
}

/* A triangle above after the other: all its rows, or those that are asked for. */
void tw_loop_rows_triangles(const tw_loop_rows *rows, uint32_t first, uint32_t count, uint32_t *out) {
  const tw_topology *t = &rows->above;
  uint32_t each = rows->levels == 1 ? 4 : 16, end = first + count;
  while (first < end) {
    uint32_t face = first / each, skip = first % each, taken = least(each - skip, end - first);
    uint32_t all[48], *corners = taken == each ? out : all;
    if (rows->levels == 1) {
      triangle parent = triangle_above(t, face);
      split(&parent, t->vertex_count, corners);
    } else {
      triangle children[4];
      split_whole(t, face, children);
      for (uint32_t i = 0; i < 4; i++)
        split(&children[i], t->vertex_count + t->edge_count, corners + 12 * (size_t)i);
    }
    if (taken < each) memcpy(out, all + 3 * (size_t)skip, 3 * (size_t)taken * sizeof *out);
    out += 3 * (size_t)taken;
    first += taken;
  }
}

/* ---- normals ------------------------------------------------------------------------------------ */

/* Normals of the rows that loop_rows.h tells of, from the tangents of limit.h over the ring of neighbours
 * that the connectivity above tells. A ring is passed counter-clockwise, as those of a mesh that was built.
 */

/* The level of the rows: all its points, and the first of them that are in the middle of an edge of the mesh
 * before it. */
typedef struct level {
  const tw_topology *t;
  const double *points;
  uint32_t middles;
  tw_limit_entry *mask;
} level;

static const double *point(const level *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}
static const double *middle(const level *l, uint32_t edge) {
  return point(l, l->middles + edge);
}

/* The half of an edge above that ends in a vertex. */
static uint32_t half_at(const tw_topology *t, uint32_t edge, uint32_t vertex) {
  return 2 * edge + (t->edge_vertices[edge][0] != vertex);
}

/* ---- tangents ------------------------------------------------------------------------------- */

/* One of the triangles there, own and two of the ring, serves where there is no tangent plane. */
static void finish(const double tangents[2][3], const double *own, const double *first, const double *second,
                   float *normal) {
  float along[2][3], corners[3][3];
  const float *quad[4] = {corners[0], corners[1], corners[2], corners[2]};
  for (int c = 0; c < 3; c++) {
    along[0][c] = (float)tangents[0][c];
    along[1][c] = (float)tangents[1][c];
    corners[0][c] = (float)own[c];
    corners[1][c] = (float)first[c];
    corners[2][c] = (float)second[c];
  }
  tw_normal_from_tangents(along[0], along[1], quad, normal);
}

static void regular(const double *own, const double *const r[6], float *normal) {
  double along[2][3];
  for (int c = 0; c < 3; c++) {
    along[0][c] = r[0][c] - r[3][c] + 0.5 * (r[1][c] - r[2][c] + (r[5][c] - r[4][c]));
    along[1][c] = r[1][c] - r[4][c] + 0.5 * (r[2][c] - r[3][c] + (r[0][c] - r[5][c]));
  }
  finish((const double(*)[3])along, own, r[0], r[1], normal);
}

/* On a border between three triangles: along it, and across as on a regular mesh with its reflection. */
static void on_border(const double *own, const double *const r[4], float *normal) {
  double along[2][3];
  for (int c = 0; c < 3; c++) {
    along[0][c] = 0.5 * (r[0][c] - r[3][c]);
    along[1][c] = r[1][c] - own[c] + (r[2][c] - own[c]) - 0.5 * (r[0][c] - own[c] + (r[3][c] - own[c]));
  }
  finish((const double(*)[3])along, own, r[0], r[1], normal);
}

/* ---- vertices above ------------------------------------------------------------------------- */

/* The neighbour along an edge of its ring. */
static const double *neighbour(const level *l, uint32_t levels, uint32_t vertex, uint32_t edge) {
  return middle(l, levels == 1 ? edge : half_at(l->t, edge, vertex));
}

static void by_mask(const level *l, uint32_t levels, uint32_t vertex, float *normal) {
  const tw_topology *t = l->t;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  uint32_t count = tw_limit_mask(t, false, t->fan_corners[t->fan_offsets[vertex]], l->mask);
  const double *own = point(l, vertex);
  double along[2][3] = {{0}, {0}};
  for (uint32_t i = 1; i < count; i++) {
    const double *to = neighbour(l, levels, vertex, ring[i - 1]);
    for (int c = 0; c < 3; c++) {
      along[0][c] += (double)l->mask[i].tangent1 * (to[c] - own[c]);
      along[1][c] += (double)l->mask[i].tangent2 * (to[c] - own[c]);
    }
  }
  finish((const double(*)[3])along, own, neighbour(l, levels, vertex, ring[0]),
         neighbour(l, levels, vertex, ring[1]), normal);
}

static void vertex_normal(const level *l, uint32_t levels, uint32_t vertex, float *normal) {
  const tw_topology *t = l->t;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  const double *neighbours[6];
  if (!t->smooth || t->ring_offsets[vertex + 1] - t->ring_offsets[vertex] != 6) {
    by_mask(l, levels, vertex, normal);
    return;
  }
  for (int i = 0; i < 6; i++) neighbours[i] = neighbour(l, levels, vertex, ring[i]);
  regular(point(l, vertex), neighbours, normal);
}

/* ---- one level down ------------------------------------------------------------------------- */

/* An edge above with the corners on both sides of it. */
typedef struct sides {
  uint32_t edge, one, other;
  bool border;
} sides;

static sides sides_of(const tw_topology *t, uint32_t edge) {
  uint32_t one = t->edge_corner[edge];
  return (sides){edge, one, t->sibling[one], (t->edge_flags[edge] & TW_EDGE_BORDER) != 0};
}

static void on_edge(const double *own, const double *const r[6], bool border, float *normal) {
  if (border)
    on_border(own, r, normal);
  else
    regular(own, r, normal);
}

static const double *middle_of_corner(const level *l, uint32_t corner) {
  return middle(l, l->t->corner_edge[corner]);
}

static void level_1_middle(const level *l, uint32_t edge, float *normal) {
  const tw_topology *t = l->t;
  sides s = sides_of(t, edge);
  const double *r[6] = {point(l, t->edge_vertices[edge][1]),
                        middle_of_corner(l, tw_triangle_next(s.one)),
                        middle_of_corner(l, tw_triangle_previous(s.one)),
                        point(l, t->edge_vertices[edge][0]),
                        middle_of_corner(l, tw_triangle_next(s.other)),
                        middle_of_corner(l, tw_triangle_previous(s.other))};
  on_edge(middle(l, edge), r, s.border, normal);
}

/* ---- two levels down ------------------------------------------------------------------------ */

/* In the middle of the half of a corner's edge that ends in a vertex, and of the edge across the corner. */
static const double *half_point(const level *l, uint32_t corner, uint32_t vertex) {
  return middle(l, half_at(l->t, l->t->corner_edge[corner], vertex));
}
static const double *across_point(const level *l, uint32_t corner) {
  return middle(l, 2 * l->t->edge_count + corner);
}
static const double *old_middle(const level *l, uint32_t edge) {
  return point(l, l->t->vertex_count + edge);
}

static void level_2_middle(const level *l, uint32_t edge, float *normal) {
  sides s = sides_of(l->t, edge);
  const double *r[6] = {
      middle(l, 2 * edge + 1), across_point(l, tw_triangle_next(s.one)),   across_point(l, s.one),
      middle(l, 2 * edge),     across_point(l, tw_triangle_next(s.other)), across_point(l, s.other)};
  on_edge(old_middle(l, edge), r, s.border, normal);
}

/* Halves run as their edge does: the first to its middle, the second from there. */
static void level_2_half(const level *l, uint32_t half, float *normal) {
  const tw_topology *t = l->t;
  uint32_t edge = half / 2, vertex = t->edge_vertices[edge][half % 2];
  sides s = sides_of(t, edge);
  uint32_t after = tw_triangle_next(half % 2 ? s.one : s.other),
           before = tw_triangle_previous(half % 2 ? s.other : s.one);
  const double *end = point(l, vertex), *mid = old_middle(l, edge);
  if (half % 2 == 0) {
    const double *r[6] = {mid, across_point(l, s.one),       half_point(l, before, vertex),
                          end, half_point(l, after, vertex), across_point(l, after)};
    on_edge(middle(l, half), r, s.border, normal);
  } else {
    const double *r[6] = {end, half_point(l, after, vertex), across_point(l, after),
                          mid, across_point(l, s.other),     half_point(l, before, vertex)};
    on_edge(middle(l, half), r, s.border, normal);
  }
}

static void level_2_across(const level *l, uint32_t corner, float *normal) {
  const tw_topology *t = l->t;
  uint32_t next = tw_triangle_next(corner), previous = tw_triangle_previous(corner),
           vertex = t->corner_vertex[corner];
  const double *r[6] = {
      old_middle(l, t->corner_edge[previous]), half_point(l, previous, vertex), half_point(l, corner, vertex),
      old_middle(l, t->corner_edge[corner]),   across_point(l, next),           across_point(l, previous)};
  regular(across_point(l, corner), r, normal);
}

static void edge_normal(const level *l, uint32_t levels, uint32_t row, float *normal) {
  const tw_topology *t = l->t;
  uint32_t halves = t->vertex_count + t->edge_count, across = halves + 2 * t->edge_count;
  if (levels == 1)
    level_1_middle(l, row - t->vertex_count, normal);
  else if (row < halves)
    level_2_middle(l, row - t->vertex_count, normal);
  else if (row < across)
    level_2_half(l, row - halves, normal);
  else
    level_2_across(l, row - across, normal);
}

void tw_loop_rows_normals(const tw_loop_rows *rows, const double *kept, uint32_t first, uint32_t count,
                          tw_limit_entry *mask, float *out, uint32_t stride) {
  const tw_topology *t = &rows->above;
  level l = {t, kept, t->vertex_count + (rows->levels == 1 ? 0 : t->edge_count), mask};
  for (uint32_t row = first; row < first + count; row++, out += stride) {
    if (row < t->vertex_count)
      vertex_normal(&l, rows->levels, row, out);
    else
      edge_normal(&l, rows->levels, row, out);
  }
}
