/* Faces that no patch tells of: how far they are from their children, and what is left after the last step
 * (surface_error.c, 2). */
#include "surface_error.h"

/* The differences between a face and its children. */
typedef struct face_step {
  const tw_error_part *p;
  const double *next; /* the points shown on the next level, in the numbers of children */
  uint32_t face;
  double normal[3];
  double slide;     /* the longest way that a point slides */
  double seen, all; /* the greatest difference, with slides; if nothing may slide */
  double cut;       /* on top of these: by how the face is cut into triangles */
} face_step;

/* cosine: between the normal and those of the faces that the point may slide to; below 0: it is at a rim. */
static void take(face_step *s, const double *to, const double *from, double cosine) {
  double moved[3];
  tw_difference3(to, from, moved);
  tw_offset o = tw_offset_split(moved, s->normal);
  s->all = fmax(s->all, o.whole);
  if (cosine < 0) {
    s->seen = fmax(s->seen, o.whole);
    return;
  }
  s->slide = fmax(s->slide, o.slide);
  s->seen = fmax(s->seen, o.slide > 0 ? o.normal + tw_error_slope(cosine) * o.slide : o.normal);
}

/* The point of an edge that is nearest to another one. Points of edges and diagonals have partners there: so
 * they may slide along these, as they do around irregular points, at no cost. */
static void nearest_on(const double *a, const double *b, const double *to, double out[3]) {
  double side[3], from[3];
  tw_difference3(b, a, side);
  tw_difference3(to, a, from);
  double square = tw_dot3(side, side), share = square > 0 ? tw_dot3(from, side) / square : 0;
  share = fmax(0, fmin(1, share));
  for (int c = 0; c < 3; c++) out[c] = a[c] + share * side[c];
}

/* A polygon of five or more corners is cut into triangles in some way that is not looked at: any of them is
 * within the heights of the corners, where the polygon is convex. */
static void take_polygon(face_step *s, uint32_t begin, uint32_t size, const double centre[3]) {
  const tw_error_part *p = s->p;
  double low = 0, high = 0, widest = 0, to[3];
  for (uint32_t i = 0; i < size; i++) {
    tw_difference3(tw_point_at(p->shown, p->topology.corner_vertex[begin + i]), centre, to);
    double height = tw_dot3(to, s->normal);
    low = fmin(low, height);
    high = fmax(high, height);
    widest = fmax(widest, tw_length3(to));
  }
  bool is_convex =
      tw_dot3(s->normal, s->normal) > 0 && tw_error_face_cosine(p, s->face, s->normal) >= TW_LEAST_COSINE;
  s->cut = is_convex ? high - low : 2 * widest;
}

/* The face point, beside the places that it comes from on the triangles of the face: with either diagonal. */
static void take_face_point(face_step *s, const double *point, double own) {
  const tw_error_part *p = s->p;
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, s->face), size = tw_face_size(t, s->face);
  double from[3] = {0, 0, 0};
  if (size == 4) {
    for (uint32_t i = 0; i < 2; i++) {
      nearest_on(tw_point_at(p->shown, t->corner_vertex[begin + i]),
                 tw_point_at(p->shown, t->corner_vertex[begin + i + 2]), point, from);
      take(s, point, from, own);
    }
    return;
  }
  for (uint32_t i = 0; i < size; i++)
    for (int c = 0; c < 3; c++) from[c] += tw_point_at(p->shown, t->corner_vertex[begin + i])[c] / size;
  take(s, point, from, own);
  if (size > 4) take_polygon(s, begin, size, from);
}

/* The cosine for the middle of an edge: its two faces. */
static double edge_cosine(const face_step *s, uint32_t corner, double own) {
  const tw_topology *t = &s->p->topology;
  if (tw_error_is_rim(s->p, t->corner_edge[corner])) return -1;
  return fmin(own, tw_error_face_cosine(s->p, tw_corner_face(t, t->sibling[corner]), s->normal));
}

double tw_error_of_step(const tw_measuring *m, const tw_error_part *p, const double *next, uint32_t face) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  face_step s = {.p = p, .next = next, .face = face};
  tw_error_normal(p, face, s.normal);
  double own = tw_dot3(s.normal, s.normal) > 0 ? tw_error_face_cosine(p, face, s.normal) : 0;
  for (uint32_t i = 0; i < size; i++) {
    uint32_t vertex = t->corner_vertex[begin + i], edge = t->corner_edge[begin + i];
    const double *point = tw_point_at(next, t->vertex_count + edge);
    double foot[3];
    take(&s, tw_point_at(next, vertex), tw_point_at(p->shown, vertex),
         p->is_rim[vertex] ? -1 : tw_error_vertex_cosine(p, begin + i, s.normal));
    nearest_on(tw_point_at(p->shown, t->edge_vertices[edge][0]),
               tw_point_at(p->shown, t->edge_vertices[edge][1]), point, foot);
    take(&s, point, foot, edge_cosine(&s, begin + i, own));
  }
  if (!m->rules.loop) take_face_point(&s, tw_point_at(next, t->vertex_count + t->edge_count + face), own);
  bool may_slide = own >= TW_LEAST_COSINE && s.slide <= tw_error_reach(p, face);
  return (may_slide ? fmin(s.all, s.seen) : s.all) + s.cut;
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
        low[c] = i == 0 ? x : fmin(low[c], x);
        high[c] = i == 0 ? x : fmax(high[c], x);
      }
    tw_difference3(high, low, to);
    for (uint32_t i = 0; i < size; i++) {
      double *radius = &radii[t->corner_vertex[begin + i]];
      *radius = fmax(*radius, tw_length3(to));
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
        low = fmin(low, height);
        high = fmax(high, height);
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
    most = fmax(most, tw_length3(moved) * 4 / 3);
  }
  return most;
}

double tw_error_of_rest(const tw_measuring *m, const tw_error_part *p, const double *radii, uint32_t face,
                        tw_share *shares) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double normal[3], widest = 0;
  for (uint32_t i = 0; i < size; i++) widest = fmax(widest, 2 * radii[t->corner_vertex[begin + i]]);
  tw_error_normal(p, face, normal);
  double slope = tw_error_slope_around(p, face, normal);
  if (!isfinite(slope)) return widest;
  return fmin(widest, hypot(1, slope) * thickness(p, face, normal) + rest_of_rims(m, p, face, shares));
}
