/* Normals of the rows that loop_rows.h tells of, from the tangents of limit.h over the ring of neighbours
 * that the connectivity above tells. A ring is passed counter-clockwise, as those of a mesh that was built.
 */
#include "loop_rows.h"
#include "normal.h"

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

static const double *middle_at(const level *l, uint32_t corner) {
  return middle(l, l->t->corner_edge[corner]);
}

static void level_1_middle(const level *l, uint32_t edge, float *normal) {
  const tw_topology *t = l->t;
  sides s = sides_of(t, edge);
  const double *r[6] = {
      point(l, t->edge_vertices[edge][1]),       middle_at(l, tw_triangle_next(s.one)),
      middle_at(l, tw_triangle_previous(s.one)), point(l, t->edge_vertices[edge][0]),
      middle_at(l, tw_triangle_next(s.other)),   middle_at(l, tw_triangle_previous(s.other))};
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
