/* A face, and points of a finer surface over it: how far each is from the face. What is compared with it are
 * triangles that each lie over one triangle of the face, or its limit points.
 *
 * Planes. Let a point be d above a corner, along the face's normal, and s beside it. Along s, the height of
 * the faces around the corner changes by g s for each face that is crossed, where g is the gradient of its
 * height: by a mean of these, weighted by the share of the way. So the point is at most max |d - g s| above
 * or below the surface, which is the greatest distance along the normal from the planes of the faces, put
 * through the corner. It is at most |d| + tau |s|, and much less where d is what a slide along a slope makes
 * of it. Inside a piece a point and its partner are means of those at the piece's corners. So is the way
 * between them, corner by corner, and the mean of the bounds holds.
 *
 * Hulls. The two triangles of a quad may be cut along either diagonal. So a descendant's point inside a quad
 * has partners on both, which in slivers may be far along the quad. Instead, let its partner be the nearest
 * point of the hull of the quad's four corners, a tetrahedron. This maps the descendants into the hull, and
 * edges onto edges. A second map takes the hull onto the two triangles: a point of the hull has weights of
 * the corners, those of 1 and 3 being b and e. Take a point p of the diagonal from 0 to 2, and one at t of
 * the way from 1 to 3, w apart. Take m (1 - t) off b and m t off e, where m is the greatest that leaves
 * neither below 0, and add m to p. One of b and e is 0 then, so the point lies on one of the triangles that
 * meet in the diagonal from 0 to 2; it has moved by m w. Points of these triangles stay. The other diagonal
 * is alike. Together the maps take the descendants to the two triangles, edges onto edges, so these are
 * covered, and m w more bounds both ways. m is at most b / (1 - t), e / t and 1. Over a piece's triangle the
 * first map's distance is convex and the weights are linear, so its sum with each of these three is greatest
 * at a corner: the least of the three holds for the piece. */
#include <string.h>

#include "surface_error.h"

enum { ON_EDGE = TW_ERROR_ON_EDGE, IN_TRIANGLE = TW_ERROR_IN_TRIANGLE };

/* The corners of a quad's triangles. The first two are on both sides of one diagonal, the others of the
 * other. */
static const uint8_t quad_triangles[4][3] = {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}, {0, 1, 3}};

void tw_error_begin_base(tw_error_base *b, uint8_t places[4]) {
  b->around = 1;
  for (uint32_t i = 0; i < b->size; i++) {
    b->around = tw_lesser(b->around, (double)b->frame->corners[i]);
    places[i] = (uint8_t)(ON_EDGE << i | ON_EDGE << (i + b->size - 1) % b->size);
    for (uint32_t k = 0; k < 4; k++)
      for (uint32_t j = 0; j < 3; j++)
        if (b->size == 3 || quad_triangles[k][j] == i) places[i] |= (uint8_t)(IN_TRIANGLE << k);
  }
}

/* The point of a triangle nearest to another: Ericson 2005, "Real-Time Collision Detection", 5.1.5. weights:
 * of its corners. */
static void nearest_on_triangle(const double *const corners[3], const double *to, double out[3],
                                double weights[3]) {
  double ab[3], ac[3], at[3], normal[3], inside[3], best = INFINITY;
  tw_difference3(corners[1], corners[0], ab);
  tw_difference3(corners[2], corners[0], ac);
  tw_difference3(to, corners[0], at);
  tw_cross3(ab, ac, normal);
  double square = tw_dot3(normal, normal);
  tw_cross3(at, ac, inside);
  double second = tw_dot3(inside, normal);
  tw_cross3(ab, at, inside);
  double third = tw_dot3(inside, normal);
  if (square > 0 && second >= 0 && third >= 0 && second + third <= square) {
    weights[1] = second / square;
    weights[2] = third / square;
    weights[0] = 1 - weights[1] - weights[2];
    for (int i = 0; i < 3; i++) out[i] = corners[0][i] + weights[1] * ab[i] + weights[2] * ac[i];
    return;
  }
  for (int i = 0; i < 3; i++) {
    int next = (i + 1) % 3;
    double foot[3], moved[3], share = tw_error_nearest_on(corners[i], corners[next], to, foot);
    tw_difference3(to, foot, moved);
    double distance = tw_dot3(moved, moved);
    if (distance >= best) continue;
    best = distance;
    memcpy(out, foot, sizeof foot);
    weights[i] = 1 - share;
    weights[next] = share;
    weights[3 - i - next] = 0;
  }
}

/* Adds what the maps of a hull may move a partner by that has these weights of the corners. */
static void add_maps(const tw_error_hull *h, double size, const double weights[4], double sums[4]) {
  for (int i = 0; i < 4; i++) {
    double share = h->shares[i % 2], own = i < 2 ? 1 - share : share;
    sums[i] = tw_greater(sums[i], size + h->width * weights[i] / own);
  }
}

/* A point over a corner. Planes are looked at only where this decides. */
static void take_at_corner(const tw_error_base *b, tw_error_gap *g, uint32_t i, const double *point) {
  tw_error_gap own = *g;
  double moved[3], most = 0;
  own.size = 0;
  tw_error_gap_take(&own, point, b->corners[i], (double)b->frame->corners[i]);
  if (own.size > g->size && b->planes && b->planes->counts[i] > 0) {
    tw_difference3(point, b->corners[i], moved);
    for (uint32_t k = 0; k < b->planes->counts[i]; k++)
      most = tw_greater(most, fabs(tw_dot3(b->planes->normals[i][k], moved)));
    if (tw_offset_split(moved, g->normal).slide <= g->reach) own.size = tw_lesser(own.size, most);
  }
  g->size = tw_greater(g->size, own.size);
  if (!b->hull) return;
  double weights[4] = {0};
  weights[i] = 1;
  add_maps(b->hull, own.size, weights, g->sums);
}

/* A point over the inside of a triangle, or beside it: then it slides over the faces around. */
static void take_inner(const tw_error_base *b, tw_error_gap *g, const uint8_t triangle[3],
                       const double *point) {
  const double *corners[3] = {b->corners[triangle[0]], b->corners[triangle[1]], b->corners[triangle[2]]};
  double foot[3], unused[3];
  nearest_on_triangle(corners, point, foot, unused);
  tw_error_gap_take(g, point, foot, b->around);
}

/* The same over the hull of a quad: the nearest point of its four triangles is in it. */
static void take_in_hull(const tw_error_base *b, tw_error_gap *g, const double *point) {
  double foot[3], moved[3], own[3], nearest[3] = {0}, weights[4] = {0}, least = INFINITY;
  for (int k = 0; k < 4; k++) {
    const uint8_t *triangle = quad_triangles[k];
    const double *corners[3] = {b->corners[triangle[0]], b->corners[triangle[1]], b->corners[triangle[2]]};
    nearest_on_triangle(corners, point, foot, own);
    tw_difference3(point, foot, moved);
    double square = tw_dot3(moved, moved);
    if (square >= least) continue;
    least = square;
    memcpy(nearest, foot, sizeof nearest);
    memset(weights, 0, sizeof weights);
    for (int i = 0; i < 3; i++) weights[triangle[i]] = own[i];
  }
  tw_error_gap whole = *g;
  whole.size = 0;
  tw_error_gap_take(&whole, point, nearest, b->around);
  g->size = tw_greater(g->size, whole.size);
  add_maps(b->hull, whole.size, weights, g->sums);
}

/* Where the diagonals of a quad are nearest, or almost: each step finds the point of one that is nearest to
 * that of the other. */
tw_error_hull tw_error_find_hull(const double *const corners[4]) {
  enum { STEPS = 8 };
  const double end = 1. / 64; /* neither point is a corner */
  double points[2][3], moved[3];
  tw_error_hull out = {{0.5, 0.5}, 0};
  for (int step = 0; step <= 2 * STEPS; step++) {
    int own = step % 2;
    const double *from = corners[own], *to = corners[own + 2];
    if (step > 0) out.shares[own] = tw_error_nearest_on(from, to, points[1 - own], moved);
    out.shares[own] = tw_greater(end, tw_lesser(1 - end, out.shares[own]));
    for (int c = 0; c < 3; c++) points[own][c] = from[c] + out.shares[own] * (to[c] - from[c]);
  }
  tw_difference3(points[0], points[1], moved);
  out.width = tw_length3(moved);
  return out;
}

static void take_on_edge(const tw_error_base *b, tw_error_gap *g, uint32_t edge, const double *point) {
  double foot[3];
  uint32_t next = (edge + 1) % b->size;
  double share = tw_error_nearest_on(b->corners[edge], b->corners[next], point, foot);
  tw_error_gap whole = *g;
  whole.size = 0;
  tw_error_gap_take(&whole, point, foot, (double)b->frame->edges[edge]);
  g->size = tw_greater(g->size, whole.size);
  if (!b->hull) return;
  double weights[4] = {0};
  weights[edge] = 1 - share;
  weights[next] = share;
  add_maps(b->hull, whole.size, weights, g->sums);
}

void tw_error_take_point(const tw_error_base *b, tw_error_gap *g, uint8_t place, const double *point) {
  double own = (double)b->frame->own, foot[3];
  for (uint32_t i = 0; i < b->size; i++) {
    uint32_t before = (i + b->size - 1) % b->size;
    if (!(place & ON_EDGE << i)) continue;
    if (place & ON_EDGE << before) {
      take_at_corner(b, g, i, point);
      return;
    }
    if (place & ON_EDGE << (i + 1) % b->size) continue; /* the next corner */
    take_on_edge(b, g, i, point);
    return;
  }
  if (b->size == 3) {
    take_inner(b, g, quad_triangles[0], point);
    return;
  }
  if (b->hull) {
    take_in_hull(b, g, point);
    return;
  }
  for (uint32_t diagonal = 0; diagonal < 2; diagonal++) {
    uint32_t first = 2 * diagonal;
    bool is_in[2] = {place & IN_TRIANGLE << first, place & IN_TRIANGLE << (first + 1)};
    if (is_in[0] && is_in[1]) {
      tw_error_nearest_on(b->corners[diagonal], b->corners[diagonal + 2], point, foot);
      tw_error_gap_take(g, point, foot, own);
    } else {
      take_inner(b, g, quad_triangles[is_in[0] ? first : first + 1], point);
    }
  }
}
