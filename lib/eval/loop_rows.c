/* Computes normals and triangles of a Loop level from the topology above. Rings are counter-clockwise, as in
 * topologies; tangents are those of limit.h. */
#include "loop_rows.h"

#include "normal.h"

/* Whether sharpness decays to 0 within a number of levels, or is infinite. */
static bool settles(float sharpness, uint32_t levels) {
  return !tw_is_semi_sharp(sharpness) || sharpness <= (float)levels;
}

bool tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t levels) {
  if (tw_topology_parts_normals(cage)) return false;
  if (rules->chaikin) levels = 0; /* under Chaikin's rule sharpness may take a little longer */
  for (uint32_t e = 0; !cage->smooth && e < cage->edge_count; e++)
    if (!settles(cage->edge_sharpness[e], levels)) return false;
  for (uint32_t v = 0; !cage->smooth && v < cage->vertex_count; v++)
    if (!settles(cage->vertex_sharpness[v], levels)) return false;
  return true;
}

tw_topology tw_loop_rows_counts(const tw_topology *above) {
  return (tw_topology){.vertex_count = above->vertex_count + above->edge_count,
                       .edge_count = 2 * above->edge_count + above->corner_count,
                       .face_count = 4 * above->face_count,
                       .corner_count = 4 * above->corner_count,
                       .face_size = 3};
}

/* ---- triangles ------------------------------------------------------------------------------ */

/* A child of a face: 0 to 2 at that corner of the face, whose corners keep their places; 3 in the middle. */
static void child_triangle(const tw_topology *t, uint32_t face, uint32_t child, uint32_t out[3]) {
  const uint32_t *vertices = t->corner_vertex + 3 * (size_t)face, *edges = t->corner_edge + 3 * (size_t)face;
  uint32_t middles[3];
  for (uint32_t i = 0; i < 3; i++) middles[i] = t->vertex_count + edges[i];
  if (child == 3) {
    for (uint32_t i = 0; i < 3; i++) out[i] = middles[(i + 1) % 3];
    return;
  }
  out[child] = vertices[child];
  out[(child + 1) % 3] = middles[child];
  out[(child + 2) % 3] = middles[(child + 2) % 3];
}

void tw_loop_rows_triangles(const tw_topology *above, uint32_t first, uint32_t count, uint32_t *out) {
  for (uint32_t f = first; f < first + count; f++, out += 3) child_triangle(above, f / 4, f % 4, out);
}

/* ---- normals -------------------------------------------------------------------------------- */

/* The level of the rows: its points, and the topology of the level above. A vertex of the level above keeps
 * its number; the middles of its edges come after the vertices. */
typedef struct level {
  const tw_topology *above;
  const double *points;
  tw_limit_entry *mask;
} level;

/* The point that a vertex of the level above becomes. */
static const double *point(const level *l, uint32_t vertex) {
  return l->points + 3 * (size_t)vertex;
}
static const double *middle(const level *l, uint32_t edge) {
  return point(l, l->above->vertex_count + edge);
}
static const double *middle_at(const level *l, uint32_t corner) {
  return middle(l, l->above->corner_edge[corner]);
}

/* Writes the unit normal. Where the tangents are parallel, the triangle of the own point and two points of
 * the ring gives the normal. */
static void put_normal(const double tangents[2][3], const double *own, const double *first,
                       const double *second, float *normal) {
  tw_point along[2] = {{0}, {0}}, quad[4] = {{0}, {0}, {0}, {0}};
  for (int c = 0; c < 3; c++) {
    along[0][c] = (float)tangents[0][c];
    along[1][c] = (float)tangents[1][c];
    quad[0][c] = (float)own[c];
    quad[1][c] = (float)first[c];
    quad[2][c] = quad[3][c] = (float)second[c];
  }
  tw_put_normal(along[0], along[1], quad, normal);
}

void tw_loop_regular_normal(const double *own, const double *const ring[6], float *normal) {
  const double *const *r = ring;
  double along[2][3];
  for (int c = 0; c < 3; c++) {
    along[0][c] = r[0][c] - r[3][c] + 0.5 * (r[1][c] - r[2][c] + (r[5][c] - r[4][c]));
    along[1][c] = r[1][c] - r[4][c] + 0.5 * (r[2][c] - r[3][c] + (r[0][c] - r[5][c]));
  }
  put_normal((const double(*)[3])along, own, r[0], r[1], normal);
}

/* On a border at three triangles; r: its ring, from border to border. One tangent lies along the border, the
 * other across, as on a regular mesh that is reflected at the border. */
static void put_border_normal(const double *own, const double *const r[4], float *normal) {
  double along[2][3];
  for (int c = 0; c < 3; c++) {
    along[0][c] = 0.5 * (r[0][c] - r[3][c]);
    along[1][c] = r[1][c] - own[c] + (r[2][c] - own[c]) - 0.5 * (r[0][c] - own[c] + (r[3][c] - own[c]));
  }
  put_normal((const double(*)[3])along, own, r[0], r[1], normal);
}

/* ---- at vertices, and in the middle of edges ------------------------------------------------ */

/* At a vertex of the level above. Its tangent mask has the same weights on every level, as they are an
 * eigenvector of the step. So the mask of the level above is applied to this level's ring: the middles of the
 * edges, which are in the order of the mask's entries. */
static void put_mask_normal(const level *l, uint32_t vertex, float *normal) {
  const tw_topology *t = l->above;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  uint32_t count = tw_limit_mask(t, false, t->fan_corners[t->fan_offsets[vertex]], l->mask);
  const double *own = point(l, vertex);
  double along[2][3] = {{0}, {0}};
  for (uint32_t i = 1; i < count; i++) {
    const double *to = middle(l, ring[i - 1]);
    for (int c = 0; c < 3; c++) {
      along[0][c] += (double)l->mask[i].tangent1 * (to[c] - own[c]);
      along[1][c] += (double)l->mask[i].tangent2 * (to[c] - own[c]);
    }
  }
  put_normal((const double(*)[3])along, own, middle(l, ring[0]), middle(l, ring[1]), normal);
}

static bool is_regular(const tw_topology *t, uint32_t vertex) {
  if (t->ring_offsets[vertex + 1] - t->ring_offsets[vertex] != 6 || t->vertex_flags[vertex]) return false;
  return t->smooth || tw_vertex_rule_at(t, vertex, NULL) == TW_RULE_SMOOTH;
}

static void vertex_normal(const level *l, uint32_t vertex, float *normal) {
  const tw_topology *t = l->above;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  const double *neighbours[6];
  if (!is_regular(t, vertex)) {
    put_mask_normal(l, vertex, normal);
    return;
  }
  for (int i = 0; i < 6; i++) neighbours[i] = middle(l, ring[i]);
  tw_loop_regular_normal(point(l, vertex), neighbours, normal);
}

static void middle_normal(const level *l, uint32_t edge, float *normal) {
  const tw_topology *t = l->above;
  uint32_t one = t->edge_corner[edge], other = t->sibling[one];
  const double *ring[6] = {
      point(l, t->edge_vertices[edge][1]),     middle_at(l, tw_triangle_next(one)),
      middle_at(l, tw_triangle_previous(one)), point(l, t->edge_vertices[edge][0]),
      middle_at(l, tw_triangle_next(other)),   middle_at(l, tw_triangle_previous(other))};
  if (t->edge_flags[edge] & TW_EDGE_BORDER)
    put_border_normal(middle(l, edge), ring, normal);
  else
    tw_loop_regular_normal(middle(l, edge), ring, normal);
}

void tw_loop_rows_normals(const tw_topology *above, const double *points, uint32_t first, uint32_t count,
                          tw_limit_entry *mask, float *out, uint32_t stride) {
  const level l = {above, points, mask};
  for (uint32_t row = first; row < first + count; row++, out += stride) {
    if (row < above->vertex_count)
      vertex_normal(&l, row, out);
    else
      middle_normal(&l, row - above->vertex_count, out);
  }
}
