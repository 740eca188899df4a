/* Distances added up over levels. A face is compared with its descendants some levels deeper, and only the
 * distance between those and the limit is added. A sum over all levels in between would count each of their
 * steps in full, though these are not greatest at one place.
 *
 * Each triangle of a descendant lies over one triangle of the face. The distance from the face's triangle is
 * a convex function, so a descendant's triangle is farthest at its corners. That bounds the way from
 * descendants to the face; the way back has the same bound, as descendants cover the face, edges over edges.
 *
 * Faces that are farther than what is known are looked at again, by bounds that cost more. Each holds by
 * itself, so the lesser one counts.
 *
 * Planes. Let a point be d above a corner, along the face's normal, and s beside it. Along s, the height of
 * the faces around the corner changes by g s for each face that is crossed, where g is the gradient of its
 * height: by a mean of these, weighted by the share of the way. So the point is at most max |d - g s| above
 * or below the surface, which is the greatest distance along the normal from the planes of the faces, put
 * through the corner. It is at most |d| + tau |s|, and much less where d is what a slide along a slope makes
 * of it. Inside a piece a point and its partner are means of those at the piece's corners. So is the way
 * between them, corner by corner, and the mean of the bounds holds.
 *
 * Turned views. Where faces around a corner are folded, so that nothing may slide there, the face is looked
 * at along another direction, from which these lean least: what is said above of a face's normal holds for
 * any direction.
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
 * first map's distance is convex and the weights are linear, so its sum with either of these is greatest at a
 * corner: the lesser of both holds for the piece.
 *
 * Limit points. A piece around which all is regular is known without its descendants: its limit points are,
 * by its net of control points, and the limit is as near to their triangles as second differences say. So
 * limit points all over it stand in for it, each at the place that a descendant's corner would have. */
#include <string.h>

#include "sorted.h"
#include "surface_error.h"

enum {
  DEPTH = 3,            /* how many levels deeper a face is compared */
  FACES_AT_ONCE = 1024, /* between two charges of work */
  LOOK_WORK = 4096,     /* of a face that is looked at again */
  PATCH_WORK = 1024,    /* of a piece, by its limit points */
  ON_EDGE = TW_ERROR_ON_EDGE,
  IN_TRIANGLE = TW_ERROR_IN_TRIANGLE
};

/* The corners of a quad's triangles. The first two are on both sides of one diagonal, the others of the
 * other. */
static const uint8_t quad_triangles[4][3] = {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}, {0, 1, 3}};

/* A face of a level, and the place of its corners over the face that it comes of. */
typedef struct piece {
  uint32_t level, face;
  uint8_t places[4]; /* bits */
} piece;

/* A face that is compared with its pieces. */
typedef struct compared {
  const tw_level_errors *levels;
  uint32_t depth;
  bool loop;
  tw_error_base base;
  uint32_t *patches;     /* counts pieces whose limit points are looked at; NULL: none are */
  uint32_t slides_level; /* the first level of pieces that are no patches, and have no children */
  double slides;         /* how far the limit may be from the pieces around these */
} compared;

static uint32_t size_of(const tw_level_errors *l, uint32_t face) {
  return l->begins[face + 1] - l->begins[face];
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

/* Adds what the maps of a hull move a partner by, which has these weights of the corners. */
static void add_maps(const tw_error_hull *h, double size, const double weights[4], double sums[4]) {
  for (int i = 0; i < 4; i++) {
    double share = h->shares[i % 2], most = i < 2 ? 1 - share : share;
    sums[i] = tw_greater(sums[i], size + h->width * tw_lesser(1, weights[i] / most));
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

/* The distance of a piece from the face, and its own from the limit: of that, what the pieces beside it have,
 * as points may slide there, or its own if they do not. */
static double piece_error(const compared *c, const piece *own) {
  const tw_level_errors *l = &c->levels[own->level];
  tw_error_gap g = tw_error_gap_over(&c->base);
  double beside = 0;
  for (uint32_t i = 0; i < size_of(l, own->face); i++) {
    uint32_t vertex = l->corners[l->begins[own->face] + i];
    tw_error_take_point(&c->base, &g, own->places[i], tw_point_at(l->points, vertex));
    beside = tw_greater(beside, l->around[vertex]);
  }
  return tw_error_gap_size(&c->base, &g) + tw_lesser(beside, l->wholes[own->face]);
}

/* A corner of a face at a vertex of four quads: the corners beyond it are those of the net around the face.
 */
typedef struct net_corner {
  const tw_level_errors *level;
  uint32_t face, corner, next, previous; /* the face's corner, and the vertices beside it */
  double *against_next, *against_previous, *against_opposite;
} net_corner;

static bool fill_corner(const net_corner *n) {
  const tw_level_errors *l = n->level;
  uint32_t vertex = l->corners[l->begins[n->face] + n->corner], filled = 0;
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    const uint32_t *quad = l->corners + l->begins[l->fan_faces[k]];
    uint32_t i = 0;
    if (l->fan_faces[k] == n->face) continue;
    while (i < 3 && quad[i] != vertex) i++;
    uint32_t next = quad[(i + 1) % 4], opposite = quad[(i + 2) % 4], previous = quad[(i + 3) % 4];
    int side = previous == n->next ? 0 : next == n->previous ? 1 : 2;
    memcpy(side == 0   ? n->against_previous
           : side == 1 ? n->against_next
                       : n->against_opposite,
           tw_point_at(l->control, side == 0   ? next
                                   : side == 1 ? previous
                                               : opposite),
           sizeof(double[3]));
    filled |= 1u << side;
  }
  return filled == 7 && l->fan_begins[vertex + 1] - l->fan_begins[vertex] == 4;
}

/* The net of a patch around which nothing is a rim, as error_patch.c finds it. */
static bool find_net(const tw_level_errors *l, uint32_t face, tw_error_net *out) {
  static const int places[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}; /* v, u */
  const uint32_t *quad = l->corners + l->begins[face];
  for (uint32_t i = 0; i < 4; i++) {
    const int *here = places[i], *next = places[(i + 1) % 4], *previous = places[(i + 3) % 4];
    int nv = next[0] - here[0], nu = next[1] - here[1], pv = previous[0] - here[0],
        pu = previous[1] - here[1];
    memcpy(out->points[here[0]][here[1]], tw_point_at(l->control, quad[i]), sizeof(double[3]));
    if (!fill_corner(&(net_corner){.level = l,
                                   .face = face,
                                   .corner = i,
                                   .next = quad[(i + 1) % 4],
                                   .previous = quad[(i + 3) % 4],
                                   .against_next = out->points[here[0] - nv][here[1] - nu],
                                   .against_previous = out->points[here[0] - pv][here[1] - pu],
                                   .against_opposite = out->points[here[0] - nv - pv][here[1] - nu - pu]}))
      return false;
  }
  return true;
}

/* The distance of a piece that is a patch, by its limit points; INFINITY for others. */
static double patch_error(const compared *c, const piece *own) {
  const tw_level_errors *l = &c->levels[own->level];
  tw_error_net n;
  double unused;
  if (!l->is_plain[own->face] || own->level >= c->slides_level || !find_net(l, own->face, &n))
    return INFINITY;
  ++*c->patches;
  return c->slides + tw_error_of_limits(&c->base, &n, own->places, tw_error_of_net(&n, true, &unused));
}

/* The index in l->made of a face from which the next level was made; UINT32_MAX for other faces. */
static uint32_t find_left(const tw_level_errors *l, uint32_t face) {
  uint32_t left = tw_lower_bound(l->made, l->left_count, face);
  return left < l->left_count && l->made[left] == face ? left : UINT32_MAX;
}

/* Child `i` of a piece, as tw_refine_topology makes it. */
static piece child_of(const compared *c, const piece *parent, uint32_t size, uint32_t first, uint32_t i) {
  const uint8_t *at = parent->places;
  piece out = {.level = parent->level + 1, .face = first + i};
  if (c->loop) {
    for (uint32_t k = 0; k < 3; k++)
      out.places[k] = i == 3 ? at[(k + 1) % 3] & at[(k + 2) % 3] : at[i] & at[k];
    return out;
  }
  uint8_t middle = size == 4 ? (at[0] & at[2]) | (at[1] & at[3]) : at[0] & at[1] & at[2];
  out.places[0] = at[i];
  out.places[1] = at[i] & at[(i + 1) % size];
  out.places[2] = middle;
  out.places[3] = at[i] & at[(i + size - 1) % size];
  return out;
}

/* Finds what may slide onto patches from pieces that are none, and have no children to tell more. */
static void find_slides(compared *c, uint32_t level, uint32_t face) {
  const tw_level_errors *l = &c->levels[level];
  uint32_t left = level < DEPTH && level < c->depth ? find_left(l, face) : UINT32_MAX;
  if (l->is_plain[face]) return;
  if (left != UINT32_MAX && l->steps[left] >= 0) {
    for (uint32_t i = l->children[left]; i < l->children[left + 1]; i++) find_slides(c, level + 1, i);
    return;
  }
  if (level < c->slides_level) c->slides_level = level;
  for (uint32_t i = 0; i < size_of(l, face); i++)
    c->slides = tw_greater(c->slides, l->around[l->corners[l->begins[face] + i]]);
}

/* The distance of a piece's part of the limit from the face. What is at most `enough` is looked at no
 * further. */
static double find_least(const compared *c, const piece *own, double enough) {
  const tw_level_errors *l = &c->levels[own->level];
  double error = own->level > 0 ? piece_error(c, own) : INFINITY, most = 0;
  if (error > enough && own->level > 0 && c->patches) error = tw_lesser(error, patch_error(c, own));
  if (error <= enough || own->level == DEPTH || own->level == c->depth) return error;
  uint32_t left = find_left(l, own->face), size = size_of(l, own->face);
  if (left == UINT32_MAX || l->steps[left] < 0) return error;
  uint32_t first = l->children[left], count = l->children[left + 1] - first;
  for (uint32_t i = 0; i < count && most < error; i++) {
    piece child = child_of(c, own, size, first, i);
    most = tw_greater(most, find_least(c, &child, tw_greater(most, enough)));
  }
  return tw_lesser(error, most);
}

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

static compared start(const tw_level_errors *levels, uint32_t depth, bool loop, uint32_t left, piece *whole) {
  uint32_t face = levels->made[left], begin = levels->begins[face];
  compared c = {.levels = levels,
                .depth = depth,
                .loop = loop,
                .slides_level = UINT32_MAX,
                .base = {.size = size_of(levels, face), .frame = &levels->frames[left]}};
  *whole = (piece){.face = face};
  for (uint32_t i = 0; i < c.base.size; i++)
    c.base.corners[i] = tw_point_at(levels->points, levels->corners[begin + i]);
  tw_error_begin_base(&c.base, whole->places);
  tw_corners_normal(levels->points, levels->corners + begin, c.base.size, c.base.normal);
  return c;
}

/* Lists the faces of each vertex. */
static tw_status find_fans(tw_arena *arena, tw_level_errors *l) {
  l->fan_begins = tw_arena_alloc(arena, (size_t)l->vertex_count + 2, sizeof *l->fan_begins);
  l->fan_faces = tw_arena_alloc_raw(arena, l->begins[l->face_count], sizeof *l->fan_faces);
  if (!l->fan_begins || !l->fan_faces) return TW_NO_MEMORY;
  uint32_t *ends = l->fan_begins + 1; /* at first the begins: each moves to its end while faces are listed */
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t c = l->begins[f]; c < l->begins[f + 1]; c++) ends[l->corners[c] + 1]++;
  }
  for (uint32_t v = 0; v < l->vertex_count; v++) ends[v + 1] += ends[v];
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t c = l->begins[f]; c < l->begins[f + 1]; c++) l->fan_faces[ends[l->corners[c]]++] = f;
  }
  return TW_OK;
}

/* The normal of the triangle that a corner and its two neighbours span, as long as twice its area. */
static void corner_normal(const tw_level_errors *l, uint32_t face, uint32_t corner, double out[3]) {
  uint32_t size = size_of(l, face);
  const uint32_t *corners = l->corners + l->begins[face];
  const double *own = tw_point_at(l->points, corners[corner]);
  double next[3], previous[3];
  tw_difference3(tw_point_at(l->points, corners[(corner + 1) % size]), own, next);
  tw_difference3(tw_point_at(l->points, corners[(corner + size - 1) % size]), own, previous);
  tw_cross3(next, previous, out);
}

/* The planes of the triangles of a vertex's faces, of quads by either diagonal. Returns how many; 0 where
 * there is no room for all. */
static uint32_t find_planes(const tw_level_errors *l, uint32_t vertex, const double along[3],
                            double out[TW_AROUND_MAX][3]) {
  uint32_t count = 0;
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    uint32_t face = l->fan_faces[k], triangles = size_of(l, face) == 3 ? 1 : size_of(l, face);
    for (uint32_t i = 0; i < triangles; i++) {
      double normal[3];
      corner_normal(l, face, i, normal);
      double height = tw_dot3(normal, along);
      if (!(height > 0)) continue; /* it has no area: others lean less (TW_LEAST_COSINE) */
      if (count == TW_AROUND_MAX) return 0;
      for (int c = 0; c < 3; c++) out[count][c] = normal[c] / height;
      count++;
    }
  }
  return count;
}

/* The least cosine between a direction and the normals of a face's corners. worst: receives that normal. */
static double face_cosine(const tw_level_errors *l, uint32_t face, const double along[3], double worst[3]) {
  double least = 1, normal[3];
  for (uint32_t i = 0; i < size_of(l, face); i++) {
    corner_normal(l, face, i, normal);
    if (!(tw_unit3(normal) > 0) || tw_dot3(normal, along) >= least) continue;
    least = tw_dot3(normal, along);
    memcpy(worst, normal, sizeof normal);
  }
  return least;
}

/* The same of all faces at a vertex. */
static double fan_cosine(const tw_level_errors *l, uint32_t vertex, const double along[3], double worst[3]) {
  double least = 1, own[3] = {0};
  for (uint32_t k = l->fan_begins[vertex]; k < l->fan_begins[vertex + 1]; k++) {
    double cosine = face_cosine(l, l->fan_faces[k], along, own);
    if (cosine >= least) continue;
    least = cosine;
    memcpy(worst, own, sizeof own);
  }
  return least;
}

/* The direction that leans least from the normals at the corners of a face where the surface is folded: its
 * end comes nearer to the middle of the least ball around these (Badoiu and Clarkson 2003, "Smaller core-sets
 * for balls"). False where there is none. */
static bool turn(const tw_level_errors *l, uint32_t face, const tw_error_frame *frame, double along[3]) {
  enum { STEPS = 24 };
  const uint32_t *corners = l->corners + l->begins[face];
  double middle[3] = {along[0], along[1], along[2]};
  for (int step = 1; step <= STEPS; step++) {
    double least = 1, worst[3] = {0}, own[3] = {0};
    for (uint32_t i = 0; i < size_of(l, face); i++) {
      if ((double)frame->corners[i] >= TW_LEAST_COSINE || (double)frame->corners[i] <= -1) continue;
      double cosine = fan_cosine(l, corners[i], along, own);
      if (cosine >= least) continue;
      least = cosine;
      memcpy(worst, own, sizeof own);
    }
    if (least == 1) return false;
    for (int c = 0; c < 3; c++) along[c] = middle[c] += (worst[c] - middle[c]) / (step + 1);
    if (!(tw_unit3(along) > 0)) return false;
  }
  return true;
}

/* The frame of a face for another direction than its normal. */
static tw_error_frame turned_frame(const tw_level_errors *l, uint32_t face, const tw_error_frame *frame,
                                   const double along[3]) {
  const uint32_t *corners = l->corners + l->begins[face];
  double unused[3];
  uint32_t size = size_of(l, face);
  tw_error_frame out = {.own = tw_error_rounded_down(face_cosine(l, face, along, unused)),
                        .reach = frame->reach};
  for (uint32_t i = 0; i < size; i++)
    out.corners[i] = (double)frame->corners[i] <= -1
                         ? -1
                         : tw_error_rounded_down(fan_cosine(l, corners[i], along, unused));
  for (uint32_t i = 0; i < size; i++) /* the faces of an edge are among those of its ends */
    out.edges[i] = (double)frame->edges[i] <= -1
                       ? -1
                       : (float)tw_greater((double)out.corners[i], (double)out.corners[(i + 1) % size]);
  return out;
}

/* Looks at a face again, by planes, by limit points of patches and by its hull. */
static void look_again(const compared *by, const piece *whole, double enough, double *error) {
  const tw_level_errors *l = by->levels;
  compared c = *by;
  tw_error_planes planes;
  c.base.around = 1;
  for (uint32_t i = 0; i < c.base.size; i++) {
    double cosine = (double)c.base.frame->corners[i];
    uint32_t vertex = l->corners[l->begins[whole->face] + i];
    c.base.around = tw_lesser(c.base.around, cosine);
    planes.counts[i] =
        cosine >= TW_LEAST_COSINE ? find_planes(l, vertex, c.base.normal, planes.normals[i]) : 0;
  }
  c.base.planes = &planes;
  *error = tw_lesser(*error, find_least(&c, whole, enough));
  if (*error <= enough || c.base.size < 4) return;
  const tw_error_hull hull = tw_error_find_hull(c.base.corners);
  c.base.hull = &hull;
  *error = tw_lesser(*error, find_least(&c, whole, enough));
}

/* Compares an open face with what comes of it. */
static tw_status refine_error(tw_arena *scratch, tw_level_errors *levels, uint32_t depth, bool loop,
                              uint32_t left, double enough) {
  uint32_t face = levels->made[left], patches = 0;
  double *error = &levels->errors[face];
  piece whole;
  if (size_of(levels, face) > 4) return TW_OK;
  compared c = start(levels, depth, loop, left, &whole);
  *error = tw_lesser(*error, find_least(&c, &whole, enough));
  if (*error <= enough) return TW_OK;
  for (uint32_t i = 0; i <= depth && i <= DEPTH; i++) {
    tw_status status = levels[i].fan_begins ? TW_OK : find_fans(scratch, &levels[i]);
    if (status != TW_OK) return status;
  }
  if (!tw_work(LOOK_WORK)) return TW_CANCELLED;
  find_slides(&c, 0, face);
  c.patches = &patches;
  look_again(&c, &whole, enough, error);
  if (*error > enough && turn(levels, face, c.base.frame, c.base.normal)) {
    tw_error_frame turned = turned_frame(levels, face, c.base.frame, c.base.normal);
    c.base.frame = &turned;
    look_again(&c, &whole, enough, error);
  }
  return tw_work((uint64_t)PATCH_WORK * patches) ? TW_OK : TW_CANCELLED;
}

static tw_status find_around(tw_arena *arena, tw_level_errors *l) {
  l->around = tw_arena_alloc(arena, l->vertex_count, sizeof *l->around);
  if (!l->around) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < l->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t i = l->begins[f]; i < l->begins[f + 1]; i++) {
      double *greatest = &l->around[l->corners[i]];
      *greatest = tw_greater(*greatest, l->errors[f]);
    }
  }
  return TW_OK;
}

tw_status tw_error_sum_up(tw_arena *scratch, tw_level_errors *levels, uint32_t depth, bool loop,
                          double *most) {
  tw_level_errors *below = &levels[1];
  tw_status status = find_around(scratch, below);
  if (status != TW_OK) return status;
  uint32_t farthest = UINT32_MAX;
  for (uint32_t f = 0; f < levels->left_count; f++) {
    double greatest = 0;
    if (levels->steps[f] < 0) continue;
    for (uint32_t c = below->begins[levels->children[f]]; c < below->begins[levels->children[f + 1]]; c++)
      greatest = tw_greater(greatest, below->around[below->corners[c]]);
    levels->errors[levels->made[f]] = levels->steps[f] + greatest;
    if (farthest == UINT32_MAX || levels->errors[levels->made[f]] > levels->errors[levels->made[farthest]])
      farthest = f;
  }
  /* The farthest face first: it tells what of others does not matter. */
  if (farthest != UINT32_MAX) {
    status = refine_error(scratch, levels, depth, loop, farthest, *most);
    if (status != TW_OK) return status;
    *most = tw_greater(*most, levels->errors[levels->made[farthest]]);
  }
  for (uint32_t f = 0; f < levels->left_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    if (levels->steps[f] < 0 || levels->errors[levels->made[f]] <= *most) continue;
    status = refine_error(scratch, levels, depth, loop, f, *most);
    if (status != TW_OK) return status;
    *most = tw_greater(*most, levels->errors[levels->made[f]]);
  }
  return TW_OK;
}
