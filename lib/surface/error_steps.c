/* Faces that no patch tells of: how far they are from their children, and what is left after the last step
 * (surface_error.c, 2). */
#include "surface_error.h"

void tw_error_gap_take(tw_error_gap *g, const double *to, const double *from, double cosine) {
  double moved[3];
  tw_difference3(to, from, moved);
  tw_offset o = tw_offset_split(moved, g->normal);
  if (o.slide > 0 && o.slide <= g->reach)
    o.whole = tw_lesser(o.whole, o.normal + tw_error_slope(cosine) * o.slide);
  g->size = tw_greater(g->size, o.whole);
}

double tw_error_nearest_on(const double *a, const double *b, const double *to, double out[3]) {
  double side[3], from[3];
  tw_difference3(b, a, side);
  tw_difference3(to, a, from);
  double square = tw_dot3(side, side), share = square > 0 ? tw_dot3(from, side) / square : 0;
  share = tw_greater(0, tw_lesser(1, share));
  for (int c = 0; c < 3; c++) out[c] = a[c] + share * side[c];
  return share;
}

double tw_error_of_quad(double own[4][3], double next[9][3], const double normal[3], double slope) {
  double reach = INFINITY, most = 0, foot[3], edge[3], inside = tw_error_quad_slope(own, normal);
  for (int i = 0; i < 4; i++) {
    tw_difference3(own[(i + 1) % 4], own[i], edge);
    reach = tw_lesser(reach, tw_length3(edge) / 2);
  }
  bool stays = tw_error_is_over(own, next[8], normal);
  for (int i = 0; i < 10; i++) { /* corners, edges, and the middle of both diagonals */
    const double *to = next[i < 8 ? i : 8], *from = own[i / 2 % 4];
    if (i % 2 == 1 || i == 8) {
      const double *end = i < 8 ? own[(i / 2 + 1) % 4] : own[2];
      tw_error_nearest_on(from, end, to, foot);
      if (i == 9) tw_error_nearest_on(own[1], own[3], to, foot);
      from = foot;
    }
    tw_difference3(to, from, edge);
    tw_offset o = tw_offset_split(edge, normal);
    bool slides_inside = i >= 8 && stays; /* over the quad's own triangles */
    if ((slides_inside || o.slide <= reach) && isfinite(slope))
      o.whole = tw_lesser(o.whole, o.normal + (slides_inside ? inside : slope) * o.slide);
    most = tw_greater(most, o.whole);
  }
  return most;
}

/* A polygon of five or more corners is cut into triangles in some way that is not looked at: any of them is
 * within the heights of the corners, where the polygon is convex. Returns how much this adds. */
static double cut_of_polygon(const tw_error_part *p, uint32_t face, const double normal[3], double own,
                             const double centre[3]) {
  const uint32_t *corners = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  double low = 0, high = 0, widest = 0, to[3];
  for (uint32_t i = 0; i < tw_face_size(&p->topology, face); i++) {
    tw_difference3(tw_point_at(p->shown, corners[i]), centre, to);
    double height = tw_dot3(to, normal);
    low = tw_lesser(low, height);
    high = tw_greater(high, height);
    widest = tw_greater(widest, tw_length3(to));
  }
  return own >= TW_LEAST_COSINE ? high - low : 2 * widest;
}

/* The face point, beside the places that it comes from on the triangles of the face: with either diagonal. */
static double take_face_point(tw_error_gap *g, const tw_error_part *p, uint32_t face, const double *point,
                              double own) {
  const uint32_t *corners = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  uint32_t size = tw_face_size(&p->topology, face);
  double from[3] = {0, 0, 0};
  for (uint32_t i = 0; i < 2 && size == 4; i++) {
    tw_error_nearest_on(tw_point_at(p->shown, corners[i]), tw_point_at(p->shown, corners[i + 2]), point,
                        from);
    tw_error_gap_take(g, point, from, own);
  }
  if (size == 4) return 0;
  for (uint32_t i = 0; i < size; i++)
    for (int c = 0; c < 3; c++) from[c] += tw_point_at(p->shown, corners[i])[c] / size;
  tw_error_gap_take(g, point, from, own);
  return size > 4 ? cut_of_polygon(p, face, g->normal, own, from) : 0;
}

/* The cosine for the middle of an edge: its two faces. */
static double edge_cosine(const tw_error_part *p, uint32_t corner, const double normal[3], double own) {
  const tw_topology *t = &p->topology;
  if (tw_error_is_end(p, t->corner_edge[corner])) return -1;
  return tw_lesser(own, tw_error_face_cosine(p, tw_corner_face(t, t->sibling[corner]), normal));
}

void tw_error_find_frame(const tw_error_part *p, uint32_t face, const double normal[3], tw_error_frame *out) {
  uint32_t begin = tw_face_begin(&p->topology, face), size = tw_face_size(&p->topology, face);
  double own = tw_dot3(normal, normal) > 0 ? tw_error_face_cosine(p, face, normal) : 0;
  for (uint32_t i = 0; i < size && size <= 4; i++) {
    out->corners[i] = tw_error_rounded_down(tw_error_ring_cosine(p, begin + i, normal));
    out->edges[i] = tw_error_rounded_down(edge_cosine(p, begin + i, normal, own));
  }
  out->own = tw_error_rounded_down(own);
  out->reach = (float)(tw_error_reach(p, face) * (1 - 1e-6));
}

double tw_error_of_step(const tw_measuring *m, const tw_error_part *p, const double *next, uint32_t face,
                        tw_error_frame *frame) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  tw_error_gap g = {.size = 0};
  tw_error_normal(p, face, g.normal);
  double own = tw_dot3(g.normal, g.normal) > 0 ? tw_error_face_cosine(p, face, g.normal) : 0, cut = 0,
         foot[3];
  g.reach = tw_error_reach(p, face);
  for (uint32_t i = 0; i < size; i++) {
    uint32_t vertex = t->corner_vertex[begin + i], edge = t->corner_edge[begin + i];
    const double *point = tw_point_at(next, t->vertex_count + edge);
    double at_vertex = tw_error_ring_cosine(p, begin + i, g.normal),
           at_edge = edge_cosine(p, begin + i, g.normal, own);
    tw_error_gap_take(&g, tw_point_at(next, vertex), tw_point_at(p->shown, vertex), at_vertex);
    tw_error_nearest_on(tw_point_at(p->shown, t->edge_vertices[edge][0]),
                        tw_point_at(p->shown, t->edge_vertices[edge][1]), point, foot);
    tw_error_gap_take(&g, point, foot, at_edge);
    if (size > 4) continue;
    frame->corners[i] = tw_error_rounded_down(at_vertex);
    frame->edges[i] = tw_error_rounded_down(at_edge);
  }
  frame->own = tw_error_rounded_down(own);
  frame->reach = (float)(g.reach * (1 - 1e-6));
  if (!m->rules.loop)
    cut = take_face_point(&g, p, face, tw_point_at(next, t->vertex_count + t->edge_count + face), own);
  return g.size + cut;
}

/* ---- what is left ---------------------------------------------------------------------------- */

double *tw_error_find_radii(const tw_error_part *p) {
  const tw_topology *t = &p->topology;
  double *radii = tw_arena_alloc(p->arena, t->vertex_count, sizeof *radii), to[3];
  for (uint32_t f = 0; radii && f < t->face_count; f++) {
    uint32_t begin = tw_face_begin(t, f), size = tw_face_size(t, f);
    double low[3], high[3];
    for (uint32_t i = 0; i < size; i++)
      for (int c = 0; c < 3; c++) {
        double x = tw_point_at(p->control, t->corner_vertex[begin + i])[c];
        low[c] = i == 0 ? x : tw_lesser(low[c], x);
        high[c] = i == 0 ? x : tw_greater(high[c], x);
      }
    tw_difference3(high, low, to);
    for (uint32_t i = 0; i < size; i++) {
      double *radius = &radii[t->corner_vertex[begin + i]];
      *radius = tw_greater(*radius, tw_length3(to));
    }
  }
  return radii;
}

/* How thick the points around a face lie, along its normal: the control points of its surface. */
static double thickness(const tw_error_part *p, uint32_t face, const double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face), around[TW_AROUND_MAX];
  double low = 0, high = 0, to[3];
  const double *origin = tw_point_at(p->control, t->corner_vertex[begin]);
  for (uint32_t i = 0; i < size; i++) {
    uint32_t count = tw_error_list_around(t, begin + i, around);
    for (uint32_t k = 0; k < count; k++) {
      uint32_t beside = tw_corner_face(t, around[k]), first = tw_face_begin(t, beside);
      for (uint32_t j = 0; j < tw_face_size(t, beside); j++) {
        tw_difference3(tw_point_at(p->control, t->corner_vertex[first + j]), origin, to);
        double height = tw_dot3(to, normal);
        low = tw_lesser(low, height);
        high = tw_greater(high, height);
      }
    }
  }
  return high - low;
}

/* How far the points of rims still move: each step moves them a quarter as far. */
static double rest_of_rims(const tw_measuring *m, const tw_error_part *p, uint32_t face, tw_share *shares) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double most = 0;
  for (uint32_t i = 0; i < size; i++) {
    uint32_t vertex = t->corner_vertex[begin + i];
    double moved[3] = {0, 0, 0}, to[3];
    if (!p->is_rim[vertex]) continue;
    uint32_t count = tw_refine_mask(t, &m->rules, vertex, shares);
    for (uint32_t k = 0; k < count; k++) {
      if (!(shares[k].weight > 0)) continue;
      if (shares[k].vertex >= t->vertex_count) return INFINITY; /* at a hole the rim is no curve of its own */
      tw_difference3(tw_point_at(p->control, shares[k].vertex), tw_point_at(p->control, vertex), to);
      for (int c = 0; c < 3; c++) moved[c] += (double)shares[k].weight * to[c];
    }
    most = tw_greater(most, tw_length3(moved) * 4 / 3);
  }
  return most;
}

double tw_error_of_rest(const tw_measuring *m, const tw_error_part *p, const double *radii, uint32_t face,
                        tw_share *shares) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double normal[3], widest = 0;
  for (uint32_t i = 0; i < size; i++) widest = tw_greater(widest, 2 * radii[t->corner_vertex[begin + i]]);
  tw_error_normal(p, face, normal);
  double slope = tw_error_slope_around(p, face, normal);
  if (!isfinite(slope)) return widest;
  return tw_lesser(widest, hypot(1, slope) * thickness(p, face, normal) + rest_of_rims(m, p, face, shares));
}
