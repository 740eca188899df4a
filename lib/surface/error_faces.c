/* What is around a face of a level, as the bounds of surface_error.c need it. */
#include "surface_error.h"

#include <string.h>

void tw_corners_normal(const double *points, const uint32_t *corners, uint32_t size, double normal[3]) {
  const double *first = tw_point_at(points, corners[0]);
  memset(normal, 0, 3 * sizeof *normal);
  for (uint32_t i = 1; i + 1 < size; i++) {
    double a[3], b[3], area[3];
    tw_difference3(tw_point_at(points, corners[i]), first, a);
    tw_difference3(tw_point_at(points, corners[i + 1]), first, b);
    tw_cross3(a, b, area);
    for (int c = 0; c < 3; c++) normal[c] += area[c];
  }
  tw_unit3(normal);
}

void tw_error_normal(const tw_error_part *p, uint32_t face, double normal[3]) {
  const tw_topology *t = &p->topology;
  tw_corners_normal(p->shown, t->corner_vertex + tw_face_begin(t, face), tw_face_size(t, face), normal);
}

/* Normals of the triangles that corners and their two neighbours span. */
static void find_corner_normals(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  tw_error_part *p = context;
  const tw_topology *t = &p->topology;
  (void)part;
  for (uint32_t f = begin; f < end; f++) {
    uint32_t first = tw_face_begin(t, f), size = tw_face_size(t, f);
    for (uint32_t i = 0; i < size; i++) {
      const double *own = tw_point_at(p->shown, t->corner_vertex[first + i]);
      double a[3], b[3], *normal = p->normals + 3 * (size_t)(first + i);
      tw_difference3(tw_point_at(p->shown, t->corner_vertex[first + (i + 1) % size]), own, a);
      tw_difference3(tw_point_at(p->shown, t->corner_vertex[first + (i + size - 1) % size]), own, b);
      tw_cross3(a, b, normal);
      if (!(tw_unit3(normal) > 0)) normal[0] = NAN;
    }
  }
}

tw_status tw_error_find_normals(const tw_parallel_for *parallel, tw_error_part *p) {
  p->normals = tw_arena_alloc_raw(p->arena, p->topology.corner_count, 3 * sizeof *p->normals);
  if (!p->normals) return TW_NO_MEMORY;
  tw_parallel_for_run(parallel, p->topology.face_count, TW_PARALLEL_FOR_LEAST, find_corner_normals, p);
  return TW_OK;
}

double tw_error_face_cosine(const tw_error_part *p, uint32_t face, const double normal[3]) {
  const tw_topology *t = &p->topology;
  const double *own = p->normals + 3 * (size_t)tw_face_begin(t, face),
               *end = own + 3 * (size_t)tw_face_size(t, face);
  double least = 1;
  for (; own < end; own += 3) {
    double cosine = tw_dot3(own, normal);
    if (cosine < least) least = cosine; /* false for NAN */
  }
  return least;
}

bool tw_error_is_plain(const tw_topology *t, uint32_t vertex) {
  if (t->vertex_sharpness[vertex] > 0) return false;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++)
    if (t->edge_sharpness[t->ring_edges[i]] > 0) return false;
  return t->vertex_flags[vertex] == 0;
}

uint32_t tw_error_turn_left(const tw_topology *t, uint32_t corner) {
  uint32_t previous = tw_corner_previous(t, corner);
  return tw_is_infinite(t->edge_sharpness[t->corner_edge[previous]]) ? UINT32_MAX : t->sibling[previous];
}

uint32_t tw_error_turn_right(const tw_topology *t, uint32_t corner) {
  if (tw_is_infinite(t->edge_sharpness[t->corner_edge[corner]])) return UINT32_MAX;
  return tw_corner_next(t, t->sibling[corner]);
}

uint32_t tw_error_list_around(const tw_topology *t, uint32_t corner, uint32_t out[TW_AROUND_MAX]) {
  uint32_t count = 0, turned = corner;
  do {
    if (count == TW_AROUND_MAX) return 0;
    out[count++] = turned;
    turned = tw_error_turn_left(t, turned);
  } while (turned != UINT32_MAX && turned != corner);
  if (turned == corner) return count;
  for (turned = tw_error_turn_right(t, corner); turned != UINT32_MAX;
       turned = tw_error_turn_right(t, turned)) {
    if (count == TW_AROUND_MAX) return 0;
    out[count++] = turned;
  }
  return count;
}

double tw_error_slope(double cosine) {
  return cosine < TW_LEAST_COSINE ? INFINITY : sqrt(tw_greater(0, 1 - cosine * cosine)) / cosine;
}

bool tw_error_is_over(double quad[4][3], const double *point, const double normal[3]) {
  double edge[3], to[3], across[3];
  for (int i = 0; i < 4; i++) {
    tw_difference3(quad[(i + 1) % 4], quad[i], edge);
    tw_difference3(point, quad[i], to);
    tw_cross3(edge, to, across);
    if (!(tw_dot3(across, normal) >= 0)) return false;
  }
  return true;
}

double tw_error_quad_slope(double corners[4][3], const double normal[3]) {
  double sides[4][3], across[3], least = 1;
  for (int i = 0; i < 4; i++) tw_difference3(corners[(i + 1) % 4], corners[i], sides[i]);
  for (int i = 0; i < 4; i++) {
    tw_cross3(sides[(i + 3) % 4], sides[i], across);
    if (tw_unit3(across) > 0) least = tw_lesser(least, tw_dot3(across, normal));
  }
  return tw_error_slope(least);
}

/* The least cosine of the faces at a corner's vertex that are on the corner's side of sharp edges. */
static double vertex_cosine(const tw_error_part *p, uint32_t corner, const double normal[3]) {
  uint32_t around[TW_AROUND_MAX], count = tw_error_list_around(&p->topology, corner, around);
  double least = count > 0 ? 1 : 0;
  for (uint32_t k = 0; k < count && least >= TW_LEAST_COSINE; k++)
    least = tw_lesser(least, tw_error_face_cosine(p, tw_corner_face(&p->topology, around[k]), normal));
  return least;
}

double tw_error_ring_cosine(const tw_error_part *p, uint32_t corner, const double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t turned = corner, count = 0;
  double least = 1;
  if (t->vertex_flags[t->corner_vertex[corner]] != 0) return -1;
  do {
    uint32_t face = tw_corner_face(t, turned);
    if (p->states[face] == TW_FACE_HIDDEN || ++count > TW_AROUND_MAX) return -1;
    if (least >= TW_LEAST_COSINE) least = tw_lesser(least, tw_error_face_cosine(p, face, normal));
    turned = t->sibling[tw_corner_previous(t, turned)];
  } while (turned != corner);
  return least;
}

double tw_error_slope_around(const tw_error_part *p, uint32_t face, const double normal[3]) {
  uint32_t begin = tw_face_begin(&p->topology, face), size = tw_face_size(&p->topology, face);
  double least = tw_dot3(normal, normal) > 0 ? 1 : 0;
  for (uint32_t i = 0; i < size && least >= TW_LEAST_COSINE; i++)
    least = tw_lesser(least, vertex_cosine(p, begin + i, normal));
  return tw_error_slope(least);
}

/* Whether faces on both sides meet in an edge that is sharp. */
static bool is_crease(const tw_error_part *p, uint32_t edge) {
  return tw_error_is_rim(p, edge) && !tw_error_is_end(p, edge);
}

double tw_error_slope_beyond(const tw_error_part *p, uint32_t face, const double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double least = tw_dot3(normal, normal) > 0 ? 1 : 0;
  for (uint32_t i = 0; i < size && least >= TW_LEAST_COSINE; i++) {
    double cosine = tw_error_ring_cosine(p, begin + i, normal);
    bool is_sharp = is_crease(p, t->corner_edge[begin + i]) ||
                    is_crease(p, t->corner_edge[begin + (i + size - 1) % size]);
    if (cosine >= 0 || is_sharp) least = tw_lesser(least, cosine);
  }
  return tw_error_slope(least);
}

double tw_error_reach(const tw_error_part *p, uint32_t face) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double sum = 0;
  for (uint32_t i = 0; i < size; i++) {
    double edge[3];
    uint32_t next = tw_corner_next(t, begin + i);
    tw_difference3(tw_point_at(p->shown, t->corner_vertex[next]),
                   tw_point_at(p->shown, t->corner_vertex[begin + i]), edge);
    sum += tw_length3(edge);
  }
  return sum / (2 * size);
}

bool tw_error_is_end(const tw_error_part *p, uint32_t edge) {
  const tw_topology *t = &p->topology;
  if (t->edge_flags[edge] != 0) return true;
  uint32_t corner = t->edge_corner[edge], other = t->sibling[corner];
  return (p->states[tw_corner_face(t, corner)] == TW_FACE_HIDDEN) !=
         (p->states[tw_corner_face(t, other)] == TW_FACE_HIDDEN);
}

bool tw_error_is_rim(const tw_error_part *p, uint32_t edge) {
  return tw_is_infinite(p->topology.edge_sharpness[edge]) || tw_error_is_end(p, edge);
}

tw_status tw_error_find_rims(tw_error_part *p) {
  const tw_topology *t = &p->topology;
  p->is_rim = tw_arena_alloc(p->arena, t->vertex_count, 1);
  if (!p->is_rim) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    p->is_rim[v] = tw_is_infinite(t->vertex_sharpness[v]) || (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD);
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (tw_error_is_rim(p, e)) p->is_rim[t->edge_vertices[e][0]] = p->is_rim[t->edge_vertices[e][1]] = 1;
  return TW_OK;
}
