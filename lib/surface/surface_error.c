/* How far the triangles of each level are from the limit surface: bounds that are proved, from the cage and a
 * few levels.
 *
 * Two steps lead there. Both compare surfaces over one set of faces, so that a point of the one has a partner
 * on the other, and both directions of the Hausdorff distance are bounded at once.
 *
 * 1. Faces around which nothing is irregular, at sharp creases and borders too, are patches of 16 control
 * points. There second differences shrink by four with each step, and the surface differs from the bilinear
 * quads of control points by ((1 - u)^3 + u^3) / 6 of those along u, and as much of those along v; from quads
 * of limit points by at most u (1 - u) / 2 of them (Filip, Magedson and Markot 1986, "Surface algorithms
 * using bounds on derivatives"; Lutterkort and Peters 2001, "Optimized refinable enclosures"). Triangles
 * differ from the bilinear quad by the mixed difference times at most min(u (1 - v), v (1 - u)). So such a
 * face is measured once, for its own level and all deeper ones.
 * 2. Other faces are compared with their children, level by level. Both are triangles, and where the
 * children's diagonals meet in the face point, each of them lies over one triangle of the parent, whichever
 * way that is cut. The difference is then greatest at vertices. Distances add up; around irregular points,
 * where they shrink more slowly and no second difference tells how, the steps themselves are taken, on the
 * few faces around them.
 *
 * After the last step, what is left follows from the convex hull of the control points around a face, in
 * which all deeper levels and the limit lie, as masks have no negative weights.
 *
 * A point's partner is the one with its parameters, or one that is nearer. Along an edge or a diagonal it is
 * the nearest of that edge. Elsewhere points slide along the surface more than they leave it, so a difference
 * is split into a part d along the face's normal and a slide s across it, and counts as |d| + tau |s|: seen
 * along the normal, the faces that the slide can reach are a graph whose slope is at most tau, so that
 * something lies that near under the point. This holds while slides are short beside the faces. At rims
 * (borders, infinitely sharp edges, faces that are left out) nothing may slide, and the whole difference
 * counts; as it does where no normal serves. */
#include <math.h>
#include <string.h>

#include "limit.h"
#include "refine.h"
#include "surface.h"
#include "vector3.h"

enum {
  FACES_MAX = 1 << 17,  /* of a level that is made, from the second on */
  SMALL_PART = 8,       /* of what is enough: faces with less than that are not refined */
  FURTHER_LEVELS = 3,   /* made below the last one asked for, so that what is left is small beside it */
  AROUND_MAX = 64,      /* faces at a vertex that are looked at one by one */
  FACES_AT_ONCE = 1024, /* between two charges of work */
  FACE_WORK = 256
};

/* The least cosine between the normals around a face and its own, for which slides are taken. */
static const double least_cosine = 0.3;

typedef enum face_state {
  FACE_HIDDEN,   /* left out of the answer */
  FACE_AROUND,   /* measured, or outside: only there for the faces beside it */
  FACE_GIVEN_UP, /* there for these too: what was left of it was little */
  FACE_OPEN,     /* from here on open; a regular face that varies too much may be left to its children, */
  FACE_LAST = FACE_OPEN + 2 /* and to theirs, but no further */
} face_state;

/* A level, or the part of it around open faces. */
typedef struct part {
  tw_arena *arena;
  tw_topology topology;
  double *control;     /* [vertices][3] */
  const double *shown; /* as answers have them */
  uint8_t *states;     /* [faces] */
  uint8_t *is_rim;     /* [vertices] */
  uint32_t *made;      /* [faces] the face of the level as it was made; NULL: the same, as nothing is cut */
  double *errors;      /* [faces of the level as it was made] of level_errors */
  uint32_t level, open_count;
} part;

/* A level as it was made, and what is left of it when the next one is. */
typedef struct level_errors {
  uint32_t face_count, vertex_count, face_size;
  uint32_t *corners; /* [face_count][face_size]; NULL at the cage */
  double *errors; /* [face_count] the distance of a face from the limit; of open ones it is summed up last */
  uint32_t left_count; /* faces that are left; 0 at the last level */
  uint32_t *made;      /* [left_count] as in part */
  uint32_t *children;  /* [left_count + 1] the first child of each */
  double *steps;       /* [left_count] of open faces from their children; below 0: of others */
} level_errors;

/* What all levels share. */
typedef struct measuring {
  const tw_mesh *mesh;
  const tw_surface_options *options;
  const tw_parallel_for *parallel;
  tw_rules rules;
  tw_detail_list details;
  double size; /* the greatest coordinate */
} measuring;

typedef struct offset {
  double normal, slide, whole; /* along the face's normal, across it, and its length */
} offset;

static inline uint32_t as_made(const part *p, uint32_t face) {
  return p->made ? p->made[face] : face;
}

static inline const double *at(const double *points, uint32_t vertex) {
  return points + 3 * (size_t)vertex;
}

static void difference(const double *a, const double *b, double out[3]) {
  for (int c = 0; c < 3; c++) out[c] = a[c] - b[c];
}

/* Splits a vector. normal: 0 0 0 where there is none. */
static offset split(const double vector[3], const double normal[3]) {
  double along = tw_dot3(vector, normal), across[3];
  for (int c = 0; c < 3; c++) across[c] = vector[c] - along * normal[c];
  return (offset){fabs(along), tw_length3(across), tw_length3(vector)};
}

static void widen(offset *most, const offset *more) {
  most->normal = fmax(most->normal, more->normal);
  most->slide = fmax(most->slide, more->slide);
  most->whole = fmax(most->whole, more->whole);
}

/* ---- faces and what is around them ----------------------------------------------------------- */

/* Area vectors summed (Newell), made unit. */
static void face_normal(const part *p, uint32_t face, double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  memset(normal, 0, 3 * sizeof *normal);
  const double *first = at(p->shown, t->corner_vertex[begin]);
  for (uint32_t i = 1; i + 1 < size; i++) {
    double a[3], b[3], area[3];
    difference(at(p->shown, t->corner_vertex[begin + i]), first, a);
    difference(at(p->shown, t->corner_vertex[begin + i + 1]), first, b);
    tw_cross3(a, b, area);
    for (int c = 0; c < 3; c++) normal[c] += area[c];
  }
  tw_unit3(normal);
}

/* The cosine between a normal and that of the triangle at a corner; 1 where the triangle has no area. */
static double corner_cosine(const part *p, uint32_t corner, const double normal[3]) {
  const tw_topology *t = &p->topology;
  double a[3], b[3], area[3];
  const double *own = at(p->shown, t->corner_vertex[corner]);
  difference(at(p->shown, t->corner_vertex[tw_corner_next(t, corner)]), own, a);
  difference(at(p->shown, t->corner_vertex[tw_corner_previous(t, corner)]), own, b);
  tw_cross3(a, b, area);
  return tw_unit3(area) > 0 ? tw_dot3(area, normal) : 1;
}

static double face_cosine(const part *p, uint32_t face, const double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double least = 1;
  for (uint32_t i = 0; i < size; i++) least = fmin(least, corner_cosine(p, begin + i, normal));
  return least;
}

/* The corner at the same vertex, in the face across the edge to the previous corner; UINT32_MAX at a rim of
 * the limit surface. */
static uint32_t turn_left(const tw_topology *t, uint32_t corner) {
  uint32_t previous = tw_corner_previous(t, corner);
  return tw_is_infinite(t->edge_sharpness[t->corner_edge[previous]]) ? UINT32_MAX : t->sibling[previous];
}

/* Across the edge to the next corner. */
static uint32_t turn_right(const tw_topology *t, uint32_t corner) {
  if (tw_is_infinite(t->edge_sharpness[t->corner_edge[corner]])) return UINT32_MAX;
  return tw_corner_next(t, t->sibling[corner]);
}

/* Lists the corners of a vertex on one side of sharp edges, `corner` first. Returns how many; 0 where there
 * are over AROUND_MAX. */
static uint32_t list_around(const tw_topology *t, uint32_t corner, uint32_t out[AROUND_MAX]) {
  uint32_t count = 0, turned = corner;
  do {
    if (count == AROUND_MAX) return 0;
    out[count++] = turned;
    turned = turn_left(t, turned);
  } while (turned != UINT32_MAX && turned != corner);
  if (turned == corner) return count;
  for (turned = turn_right(t, corner); turned != UINT32_MAX; turned = turn_right(t, turned)) {
    if (count == AROUND_MAX) return 0;
    out[count++] = turned;
  }
  return count;
}

static double slope_of(double cosine) {
  return cosine < least_cosine ? INFINITY : sqrt(fmax(0, 1 - cosine * cosine)) / cosine;
}

/* The least cosine between a normal and the faces at a corner's vertex, on the corner's side of sharp edges.
 */
static double vertex_cosine(const part *p, uint32_t corner, const double normal[3]) {
  uint32_t around[AROUND_MAX], count = list_around(&p->topology, corner, around);
  double least = count > 0 ? 1 : 0;
  for (uint32_t k = 0; k < count && least >= least_cosine; k++)
    least = fmin(least, face_cosine(p, tw_corner_face(&p->topology, around[k]), normal));
  return least;
}

/* The greatest slope of the faces around a face, seen along its normal; infinite where that is no graph. */
static double slope_around(const part *p, uint32_t face, const double normal[3]) {
  uint32_t begin = tw_face_begin(&p->topology, face), size = tw_face_size(&p->topology, face);
  double least = tw_dot3(normal, normal) > 0 ? 1 : 0;
  for (uint32_t i = 0; i < size && least >= least_cosine; i++)
    least = fmin(least, vertex_cosine(p, begin + i, normal));
  return slope_of(least);
}

/* Half of the mean length of a face's edges: as far as its points may slide. */
static double reach(const part *p, uint32_t face) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double sum = 0;
  for (uint32_t i = 0; i < size; i++) {
    double edge[3];
    uint32_t next = tw_corner_next(t, begin + i);
    difference(at(p->shown, t->corner_vertex[next]), at(p->shown, t->corner_vertex[begin + i]), edge);
    sum += tw_length3(edge);
  }
  return sum / (2 * size);
}

static bool is_rim_edge(const part *p, uint32_t edge) {
  const tw_topology *t = &p->topology;
  if (tw_is_infinite(t->edge_sharpness[edge])) return true;
  uint32_t corner = t->edge_corner[edge], other = t->sibling[corner];
  return (p->states[tw_corner_face(t, corner)] == FACE_HIDDEN) !=
         (p->states[tw_corner_face(t, other)] == FACE_HIDDEN);
}

static tw_status find_rims(part *p) {
  const tw_topology *t = &p->topology;
  p->is_rim = tw_arena_alloc(p->arena, t->vertex_count, 1);
  if (!p->is_rim) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    p->is_rim[v] = tw_is_infinite(t->vertex_sharpness[v]) || (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD);
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (is_rim_edge(p, e)) p->is_rim[t->edge_vertices[e][0]] = p->is_rim[t->edge_vertices[e][1]] = 1;
  return TW_OK;
}

/* ---- regular faces --------------------------------------------------------------------------- */

/* The control points of a patch: [v][u], the face's own corners in the middle. */
typedef struct net {
  double points[4][4][3];
} net;

static bool is_plain(const tw_topology *t, uint32_t vertex) {
  if (t->vertex_sharpness[vertex] > 0) return false;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++)
    if (t->edge_sharpness[t->ring_edges[i]] > 0) return false;
  return t->vertex_flags[vertex] == 0;
}

/* Counts the infinitely sharp edges of a vertex; UINT32_MAX where one is semi-sharp. */
static uint32_t count_sharp(const tw_topology *t, uint32_t vertex) {
  uint32_t count = 0;
  if (tw_is_semi_sharp(t->vertex_sharpness[vertex])) return UINT32_MAX;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness)) return UINT32_MAX;
    count += sharpness > 0;
  }
  return count;
}

/* The points of the net at a corner: `out` receives those beyond the corner against the next one, against the
 * previous one, and against the opposite one. */
typedef struct corner_net {
  const part *p;
  uint32_t corner;
  const double *own, *next, *previous, *opposite;
  double *against_next, *against_previous, *against_opposite;
} corner_net;

static void extrapolate(const double *from, const double *to, double *out) {
  for (int c = 0; c < 3; c++) out[c] = 2 * to[c] - from[c];
}

static bool fill_plain(const corner_net *n) {
  const tw_topology *t = &n->p->topology;
  uint32_t first = t->sibling[tw_quad_previous(n->corner)], second = t->sibling[tw_quad_previous(first)],
           third = t->sibling[tw_quad_previous(second)];
  if (t->sibling[tw_quad_previous(third)] != n->corner || second == n->corner) return false;
  uint32_t next = tw_quad_next(second);
  const double *control = n->p->control;
  memcpy(n->against_next, at(control, t->corner_vertex[next]), sizeof(double[3]));
  memcpy(n->against_previous, at(control, t->corner_vertex[tw_quad_previous(second)]), sizeof(double[3]));
  memcpy(n->against_opposite, at(control, t->corner_vertex[tw_quad_next(next)]), sizeof(double[3]));
  return true;
}

/* At a crease of two faces a side, the net goes on beyond it without second differences: the crease rule is
 * that of a cubic spline. is_left: the face's edge to the previous corner is the crease. */
static bool fill_crease(const corner_net *n, bool is_left) {
  const tw_topology *t = &n->p->topology;
  const double *control = n->p->control;
  uint32_t other = is_left ? turn_right(t, n->corner) : turn_left(t, n->corner);
  if (other == UINT32_MAX || (is_left ? turn_right(t, other) : turn_left(t, other)) != UINT32_MAX)
    return false;
  uint32_t end = is_left ? tw_quad_next(other) : tw_quad_previous(other);
  const double *far = at(control, t->corner_vertex[end]),
               *across = at(control, t->corner_vertex[tw_quad_next(tw_quad_next(other))]);
  memcpy(is_left ? n->against_previous : n->against_next, far, sizeof(double[3]));
  extrapolate(is_left ? n->next : n->previous, n->own, is_left ? n->against_next : n->against_previous);
  extrapolate(across, far, n->against_opposite);
  return true;
}

static bool fill_corner(const corner_net *n) {
  extrapolate(n->next, n->own, n->against_next);
  extrapolate(n->previous, n->own, n->against_previous);
  for (int c = 0; c < 3; c++)
    n->against_opposite[c] = 4 * n->own[c] - 2 * n->next[c] - 2 * n->previous[c] + n->opposite[c];
  return true;
}

static bool fill(const corner_net *n) {
  const tw_topology *t = &n->p->topology;
  uint32_t vertex = t->corner_vertex[n->corner];
  if (is_plain(t, vertex)) return fill_plain(n);
  uint32_t sharp = count_sharp(t, vertex);
  if (sharp == UINT32_MAX || (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD)) return false;
  bool right = tw_is_infinite(t->edge_sharpness[t->corner_edge[n->corner]]),
       left = tw_is_infinite(t->edge_sharpness[t->corner_edge[tw_quad_previous(n->corner)]]),
       is_corner = t->vertex_sharpness[vertex] > 0 || sharp > 2;
  if (left && right) return is_corner && fill_corner(n);
  return !is_corner && sharp == 2 && left != right && fill_crease(n, left);
}

/* Finds the net of a quad among quads; false where its surface is no single patch. */
static bool find_net(const part *p, uint32_t face, net *out) {
  static const int places[4][2] = {{1, 1}, {2, 1}, {2, 2}, {1, 2}}; /* u, v */
  const tw_topology *t = &p->topology;
  const double *own[4];
  if (t->face_size != 4) return false;
  uint32_t begin = tw_face_begin(t, face);
  for (int i = 0; i < 4; i++) {
    own[i] = at(p->control, t->corner_vertex[begin + (uint32_t)i]);
    memcpy(out->points[places[i][1]][places[i][0]], own[i], sizeof(double[3]));
  }
  for (int i = 0; i < 4; i++) {
    const int *here = places[i], *next = places[(i + 1) % 4], *previous = places[(i + 3) % 4];
    int nu = next[0] - here[0], nv = next[1] - here[1], pu = previous[0] - here[0],
        pv = previous[1] - here[1];
    const corner_net n = {.p = p,
                          .corner = begin + (uint32_t)i,
                          .own = own[i],
                          .next = own[(i + 1) % 4],
                          .previous = own[(i + 3) % 4],
                          .opposite = own[(i + 2) % 4],
                          .against_next = out->points[here[1] - nv][here[0] - nu],
                          .against_previous = out->points[here[1] - pv][here[0] - pu],
                          .against_opposite = out->points[here[1] - nv - pv][here[0] - nu - pu]};
    if (!fill(&n)) return false;
  }
  return true;
}

/* One kind of second differences of a net: their mean, how far others are from it, and the greatest. */
typedef struct bend {
  double mean[3];
  offset spread, greatest;
} bend;

enum { ALONG_U, ALONG_V, MIXED, KINDS };

/* Difference `i` of a kind: [8] along u or v, [9] mixed. */
static void find_difference(const net *n, int kind, int i, double out[3]) {
  int line = i / 2, place = 1 + i % 2, u = i % 3, v = i / 3;
  for (int c = 0; c < 3; c++)
    if (kind == ALONG_U)
      out[c] = n->points[line][place - 1][c] - 2 * n->points[line][place][c] + n->points[line][place + 1][c];
    else if (kind == ALONG_V)
      out[c] = n->points[place - 1][line][c] - 2 * n->points[place][line][c] + n->points[place + 1][line][c];
    else
      out[c] =
          n->points[v][u][c] - n->points[v][u + 1][c] - n->points[v + 1][u][c] + n->points[v + 1][u + 1][c];
}

static bend find_bend(const net *n, int kind, const double normal[3]) {
  int count = kind == MIXED ? 9 : 8;
  bend out = {0};
  double d[3];
  for (int i = 0; i < count; i++) {
    find_difference(n, kind, i, d);
    offset o = split(d, normal);
    widen(&out.greatest, &o);
    for (int c = 0; c < 3; c++) out.mean[c] += d[c] / count;
  }
  for (int i = 0; i < count; i++) {
    find_difference(n, kind, i, d);
    difference(d, out.mean, d);
    offset o = split(d, normal);
    widen(&out.spread, &o);
  }
  return out;
}

/* a u + b v + c m of the means, which is near that of all points of the patch. */
static offset mix(const bend bends[KINDS], double a, double b, double c, const double normal[3]) {
  double sum[3];
  for (int i = 0; i < 3; i++)
    sum[i] = a * bends[ALONG_U].mean[i] + b * bends[ALONG_V].mean[i] + c * bends[MIXED].mean[i];
  return split(sum, normal);
}

static offset add_spreads(const bend bends[KINDS], double a, double b, double c, offset to) {
  const offset *u = &bends[ALONG_U].spread, *v = &bends[ALONG_V].spread, *m = &bends[MIXED].spread;
  return (offset){to.normal + a * u->normal + b * v->normal + c * m->normal,
                  to.slide + a * u->slide + b * v->slide + c * m->slide,
                  to.whole + a * u->whole + b * v->whole + c * m->whole};
}

/* The difference between the surface and triangles of its control points. It is convex in u (1 - u), v (1 -
 * v) and the mixed difference's weight, so it is greatest where these are. */
static offset control_deviation(const bend bends[KINDS], const double normal[3]) {
  static const double ends[][3] = {
      {1. / 6, 1. / 6, 0},       {1. / 24, 1. / 6, 0},      {1. / 6, 1. / 24, 0},      {1. / 24, 1. / 24, 0},
      {1. / 24, 1. / 6, 1. / 8}, {1. / 6, 1. / 24, 1. / 8}, {1. / 24, 1. / 24, 1. / 4}};
  offset most = {0};
  for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
    for (int sign = -1; sign < 2; sign += 2) {
      offset o = mix(bends, ends[i][0], ends[i][1], sign * ends[i][2], normal);
      widen(&most, &o);
    }
  return most;
}

/* The greatest l1 l2 a + l2 l3 b + l3 l1 c of weights of sum 1, halved: the square of a circumradius. */
static double interpolation_error(double a, double b, double c) {
  double most = fmax(a, fmax(b, c)), area = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c);
  if (2 * most >= a + b + c || !(area > 0)) return most / 8;
  return fmax(most / 8, a * b * c / area / 2);
}

/* The difference between the surface and triangles of its own points: along each side of a triangle it bends
 * by the second differences in that direction. */
static offset limit_deviation(const bend bends[KINDS], bool spread, const double normal[3]) {
  offset u = mix(bends, 1, 0, 0, normal), v = mix(bends, 0, 1, 0, normal),
         diagonal = mix(bends, 1, 1, 2, normal), other = mix(bends, 1, 1, -2, normal);
  widen(&diagonal, &other);
  if (spread) {
    u = add_spreads(bends, 1, 0, 0, u);
    v = add_spreads(bends, 0, 1, 0, v);
    diagonal = add_spreads(bends, 1, 1, 2, diagonal);
  }
  return (offset){interpolation_error(u.normal, v.normal, diagonal.normal),
                  interpolation_error(u.slide, v.slide, diagonal.slide),
                  interpolation_error(u.whole, v.whole, diagonal.whole)};
}

/* The difference between the surface and its triangles, bounded by the lengths of the greatest second
 * differences alone. This bound is the smaller one where their directions vary much. The mixed difference has
 * the weight 1/4 in the middle of a face; of control points, those along u and v then have a quarter of
 * theirs. */
static double plain_deviation(bool limit, double u, double v, double mixed) {
  if (limit) return (u + v) / 8 + mixed / 4;
  return (u + v) / 6 + (fmax(0, mixed - u) + fmax(0, mixed - v)) / 8;
}

/* The greatest difference. *usual: along the normal, if second differences were their means everywhere. */
static offset deviation(const net *n, bool limit, const double normal[3], double *usual) {
  bend bends[KINDS];
  for (int kind = 0; kind < KINDS; kind++) bends[kind] = find_bend(n, kind, normal);
  offset by_means = limit ? limit_deviation(bends, false, normal) : control_deviation(bends, normal);
  *usual = by_means.normal;
  by_means =
      limit ? limit_deviation(bends, true, normal) : add_spreads(bends, 1. / 6, 1. / 6, 1. / 4, by_means);
  const offset *u = &bends[ALONG_U].greatest, *v = &bends[ALONG_V].greatest, *m = &bends[MIXED].greatest;
  return (offset){fmin(by_means.normal, plain_deviation(limit, u->normal, v->normal, m->normal)),
                  fmin(by_means.slide, plain_deviation(limit, u->slide, v->slide, m->slide)),
                  fmin(by_means.whole, plain_deviation(limit, u->whole, v->whole, m->whole))};
}

/* A patch's directions along u and v, in the plane across the normal: their means, how far others are from
 * these, and their greatest heights. */
typedef struct directions {
  double mean[2][3], spread[2], height[2];
} directions;

static const double *net_step(const net *n, int axis, int line, int i) {
  return axis == 0 ? n->points[line][i] : n->points[i][line];
}

static directions find_directions(const net *n, const double normal[3]) {
  directions out = {0};
  for (int pass = 0; pass < 2; pass++)
    for (int axis = 0; axis < 2; axis++)
      for (int line = 0; line < 4; line++)
        for (int i = 0; i < 3; i++) {
          double d[3], height;
          difference(net_step(n, axis, line, i + 1), net_step(n, axis, line, i), d);
          height = tw_dot3(d, normal);
          for (int c = 0; c < 3; c++) d[c] -= height * normal[c];
          out.height[axis] = fmax(out.height[axis], fabs(height));
          for (int c = 0; c < 3 && pass == 0; c++) out.mean[axis][c] += d[c] / 12;
          if (pass == 0) continue;
          difference(d, out.mean[axis], d);
          out.spread[axis] = fmax(out.spread[axis], tw_length3(d));
        }
  return out;
}

/* The greatest slope of a patch, seen along the normal; infinite where that may be no graph. *least_step: the
 * least that a step of 1 in u and v moves its points across the normal. */
static double patch_slope(const net *n, const double normal[3], double *least_step) {
  const directions d = find_directions(n, normal);
  double across[3];
  tw_cross3(d.mean[0], d.mean[1], across);
  double sum = tw_dot3(d.mean[0], d.mean[0]) + tw_dot3(d.mean[1], d.mean[1]), area = tw_length3(across);
  double least = sqrt(fmax(0, (sum - sqrt(fmax(0, sum * sum - 4 * area * area))) / 2));
  *least_step = least - hypot(d.spread[0], d.spread[1]);
  return *least_step > 0.2 * least ? hypot(d.height[0], d.height[1]) / *least_step : INFINITY;
}

static void second_difference(const double *a, const double *b, const double *c, double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = a[i] - 2 * b[i] + c[i];
}

/* The difference at rims, where nothing slides: that of the curves along them. */
static double rim_deviation(const part *p, uint32_t face, const net *n, bool limit) {
  const tw_topology *t = &p->topology;
  double most = 0, d[3];
  for (int side = 0; side < 4; side++) {
    if (!is_rim_edge(p, t->corner_edge[tw_face_begin(t, face) + (uint32_t)side])) continue;
    int axis = side % 2, line = side == 0 || side == 3 ? 1 : 2;
    for (int i = 1; i < 3; i++) {
      second_difference(net_step(n, axis, line, i - 1), net_step(n, axis, line, i),
                        net_step(n, axis, line, i + 1), d);
      most = fmax(most, tw_length3(d));
    }
  }
  return limit ? most / 8 : most / 6;
}

/* What is known of a face whose deeper levels follow from it. */
typedef struct measure_of_face {
  double error; /* its distance from the limit; below 0: of a face that is open still */
  double usual; /* about what it would be if nothing varied: where `error` is much more, its children tell
                   more */
} measure_of_face;

static measure_of_face measure_patch(const part *p, uint32_t face, const net *n, bool limit) {
  measure_of_face out;
  double normal[3], step = 0;
  face_normal(p, face, normal);
  const offset most = deviation(n, limit, normal, &out.usual);
  double slope = tw_dot3(normal, normal) > 0 ? patch_slope(n, normal, &step) : INFINITY;
  if (isfinite(slope) && most.slide <= step / 2) slope = fmax(slope, slope_around(p, face, normal));
  out.error = most.whole;
  if (isfinite(slope) && most.slide <= step / 2)
    out.error = fmin(most.whole, fmax(most.normal + slope * most.slide, rim_deviation(p, face, n, limit)));
  return out;
}

/* A bilinear patch differs from its triangles by a quarter of the mixed difference, and its children's mixed
 * differences are a quarter of its own. Its edges stay, so nothing slides into other faces. */
static double bilinear_error(const part *p, uint32_t face) {
  const uint32_t *quad = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  double mixed[3], normal[3];
  for (int c = 0; c < 3; c++)
    mixed[c] = at(p->shown, quad[0])[c] - at(p->shown, quad[1])[c] + at(p->shown, quad[2])[c] -
               at(p->shown, quad[3])[c];
  face_normal(p, face, normal);
  offset m = split(mixed, normal);
  double cosine = tw_dot3(normal, normal) > 0 ? face_cosine(p, face, normal) : 0;
  if (cosine < least_cosine) return m.whole / 4;
  return fmin(m.whole, m.normal + m.slide * sqrt(fmax(0, 1 - cosine * cosine)) / cosine) / 4;
}

static measure_of_face measure_settled(const measuring *m, const part *p, uint32_t face) {
  net n;
  if (m->rules.linear && tw_face_size(&p->topology, face) == 4)
    return (measure_of_face){bilinear_error(p, face), INFINITY};
  if (m->rules.loop || m->rules.linear || !find_net(p, face, &n)) return (measure_of_face){-1, 0};
  return measure_patch(p, face, &n, m->options->limit);
}

/* ---- steps ----------------------------------------------------------------------------------- */

/* The differences between a face and its children. */
typedef struct face_step {
  const part *p;
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
  difference(to, from, moved);
  offset o = split(moved, s->normal);
  s->all = fmax(s->all, o.whole);
  if (cosine < 0) {
    s->seen = fmax(s->seen, o.whole);
    return;
  }
  s->slide = fmax(s->slide, o.slide);
  s->seen = fmax(s->seen, o.slide > 0 ? o.normal + slope_of(cosine) * o.slide : o.normal);
}

/* The point of an edge that is nearest to another one. Points of edges and diagonals have partners there: so
 * they may slide along these, as they do around irregular points, at no cost. */
static void nearest_on(const double *a, const double *b, const double *to, double out[3]) {
  double side[3], from[3];
  difference(b, a, side);
  difference(to, a, from);
  double square = tw_dot3(side, side), share = square > 0 ? tw_dot3(from, side) / square : 0;
  share = fmax(0, fmin(1, share));
  for (int c = 0; c < 3; c++) out[c] = a[c] + share * side[c];
}

/* A polygon of five or more corners is cut into triangles in some way that is not looked at: any of them is
 * within the heights of the corners, where the polygon is convex. */
static void take_polygon(face_step *s, uint32_t begin, uint32_t size, const double centre[3]) {
  const part *p = s->p;
  double low = 0, high = 0, widest = 0, to[3];
  for (uint32_t i = 0; i < size; i++) {
    difference(at(p->shown, p->topology.corner_vertex[begin + i]), centre, to);
    double height = tw_dot3(to, s->normal);
    low = fmin(low, height);
    high = fmax(high, height);
    widest = fmax(widest, tw_length3(to));
  }
  bool is_convex = tw_dot3(s->normal, s->normal) > 0 && face_cosine(p, s->face, s->normal) >= least_cosine;
  s->cut = is_convex ? high - low : 2 * widest;
}

/* The face point, beside the places that it comes from on the triangles of the face: with either diagonal. */
static void take_face_point(face_step *s, const double *point, double own) {
  const part *p = s->p;
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, s->face), size = tw_face_size(t, s->face);
  double from[3] = {0, 0, 0};
  if (size == 4) {
    for (uint32_t i = 0; i < 2; i++) {
      nearest_on(at(p->shown, t->corner_vertex[begin + i]), at(p->shown, t->corner_vertex[begin + i + 2]),
                 point, from);
      take(s, point, from, own);
    }
    return;
  }
  for (uint32_t i = 0; i < size; i++)
    for (int c = 0; c < 3; c++) from[c] += at(p->shown, t->corner_vertex[begin + i])[c] / size;
  take(s, point, from, own);
  if (size > 4) take_polygon(s, begin, size, from);
}

/* The cosine for the middle of an edge: its two faces. */
static double edge_cosine(const face_step *s, uint32_t corner, double own) {
  const tw_topology *t = &s->p->topology;
  if (is_rim_edge(s->p, t->corner_edge[corner])) return -1;
  return fmin(own, face_cosine(s->p, tw_corner_face(t, t->sibling[corner]), s->normal));
}

/* The distance between a face and its children. */
static double step_error(const measuring *m, const part *p, const double *next, uint32_t face) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  face_step s = {.p = p, .next = next, .face = face};
  face_normal(p, face, s.normal);
  double own = tw_dot3(s.normal, s.normal) > 0 ? face_cosine(p, face, s.normal) : 0;
  for (uint32_t i = 0; i < size; i++) {
    uint32_t vertex = t->corner_vertex[begin + i], edge = t->corner_edge[begin + i];
    const double *point = at(next, t->vertex_count + edge);
    double foot[3];
    take(&s, at(next, vertex), at(p->shown, vertex),
         p->is_rim[vertex] ? -1 : vertex_cosine(p, begin + i, s.normal));
    nearest_on(at(p->shown, t->edge_vertices[edge][0]), at(p->shown, t->edge_vertices[edge][1]), point, foot);
    take(&s, point, foot, edge_cosine(&s, begin + i, own));
  }
  if (!m->rules.loop) take_face_point(&s, at(next, t->vertex_count + t->edge_count + face), own);
  bool may_slide = own >= least_cosine && s.slide <= reach(p, face);
  return (may_slide ? fmin(s.all, s.seen) : s.all) + s.cut;
}

/* ---- what is left ---------------------------------------------------------------------------- */

/* The greatest distance from each vertex to a point of its faces. NULL without memory. */
static double *find_radii(const part *p) {
  const tw_topology *t = &p->topology;
  double *radii = tw_arena_alloc(p->arena, t->vertex_count, sizeof *radii), to[3];
  for (uint32_t f = 0; radii && f < t->face_count; f++) {
    uint32_t begin = tw_face_begin(t, f), size = tw_face_size(t, f);
    double low[3], high[3];
    for (uint32_t i = 0; i < size; i++)
      for (int c = 0; c < 3; c++) {
        double x = at(p->control, t->corner_vertex[begin + i])[c];
        low[c] = i == 0 ? x : fmin(low[c], x);
        high[c] = i == 0 ? x : fmax(high[c], x);
      }
    difference(high, low, to);
    for (uint32_t i = 0; i < size; i++) {
      double *radius = &radii[t->corner_vertex[begin + i]];
      *radius = fmax(*radius, tw_length3(to));
    }
  }
  return radii;
}

/* How thick the points around a face lie, along its normal: the control points of its surface. */
static double thickness(const part *p, uint32_t face, const double normal[3]) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face), around[AROUND_MAX];
  double low = 0, high = 0, to[3];
  const double *origin = at(p->control, t->corner_vertex[begin]);
  for (uint32_t i = 0; i < size; i++) {
    uint32_t count = list_around(t, begin + i, around);
    for (uint32_t k = 0; k < count; k++) {
      uint32_t beside = tw_corner_face(t, around[k]), first = tw_face_begin(t, beside);
      for (uint32_t j = 0; j < tw_face_size(t, beside); j++) {
        difference(at(p->control, t->corner_vertex[first + j]), origin, to);
        double height = tw_dot3(to, normal);
        low = fmin(low, height);
        high = fmax(high, height);
      }
    }
  }
  return high - low;
}

/* How far the points of rims still move: each step moves them a quarter as far. */
static double rest_of_rims(const measuring *m, const part *p, uint32_t face, tw_share *shares) {
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
      difference(at(p->control, shares[k].vertex), at(p->control, vertex), to);
      for (int c = 0; c < 3; c++) moved[c] += (double)shares[k].weight * to[c];
    }
    most = fmax(most, tw_length3(moved) * 4 / 3);
  }
  return most;
}

/* The distance of a face, and of all that is made of it, from the limit surface. */
static double rest_of(const measuring *m, const part *p, const double *radii, uint32_t face,
                      tw_share *shares) {
  const tw_topology *t = &p->topology;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  double normal[3], widest = 0;
  for (uint32_t i = 0; i < size; i++) widest = fmax(widest, 2 * radii[t->corner_vertex[begin + i]]);
  face_normal(p, face, normal);
  double slope = slope_around(p, face, normal);
  if (!isfinite(slope)) return widest;
  return fmin(widest, hypot(1, slope) * thickness(p, face, normal) + rest_of_rims(m, p, face, shares));
}

/* ---- loops over faces ------------------------------------------------------------------------ */

/* A pass over the open faces of a level. */
typedef struct pass {
  const measuring *m;
  part *p;
  enum { PASS_SETTLED, PASS_STEP, PASS_REST } kind;
  const double *next;       /* of steps */
  const double *radii;      /* of the rest */
  double *rests;            /* [faces] of open ones */
  double *steps;            /* [faces] of open ones */
  measure_of_face *of_face; /* [faces] of open ones */
  tw_share *shares[TW_PARALLEL_FOR_PARTS_MAX];
  double most[TW_PARALLEL_FOR_PARTS_MAX];
} pass;

static double measure_face(pass *s, uint32_t index, uint32_t face) {
  if (s->kind == PASS_STEP) return s->steps[face] = step_error(s->m, s->p, s->next, face);
  if (s->kind == PASS_REST) return s->rests[face] = rest_of(s->m, s->p, s->radii, face, s->shares[index]);
  s->of_face[face] = measure_settled(s->m, s->p, face);
  return s->of_face[face].usual < INFINITY ? s->of_face[face].usual : 0;
}

static void measure_faces(void *context, uint32_t index, uint32_t begin, uint32_t end) {
  pass *s = context;
  for (uint32_t f = begin; f < end; f++) {
    if ((f - begin) % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE * FACE_WORK)) return;
    if (s->p->states[f] >= FACE_OPEN) s->most[index] = fmax(s->most[index], measure_face(s, index, f));
  }
}

/* Runs a pass. *most: the greatest distance of an open face. */
static tw_status run(pass *s, double *most) {
  const tw_parallel_for *parallel = s->m->parallel;
  uint32_t faces = s->p->topology.face_count, parts = tw_parallel_for_parts(parallel, faces, FACES_AT_ONCE);
  tw_parallel_for_run(parallel, faces, FACES_AT_ONCE, measure_faces, s);
  *most = 0;
  for (uint32_t i = 0; i < parts; i++) *most = fmax(*most, s->most[i]);
  tw_status status = tw_parallel_for_status(parallel);
  return status == TW_OK ? tw_work_status(NULL) : status;
}

static bool is_too_large(const measuring *m, const part *p) {
  uint64_t children = m->rules.loop ? 4 * (uint64_t)p->topology.face_count : p->topology.corner_count;
  bool must = p->level == 0 || p->level < tw_deepest_detail(&m->details);
  return children > (must ? TW_GENERIC_FACES_MAX : FACES_MAX);
}

/* Whether a face's children would tell more. */
static bool tells_more(const part *p, uint32_t face, const measure_of_face *own, double allowed) {
  bool is_measured = p->states[face] >= FACE_OPEN && own->error >= 0;
  return is_measured && p->states[face] < FACE_LAST && own->error > allowed && own->usual < INFINITY;
}

/* Raises what is allowed until the faces whose children would tell more have room beside the irregular ones.
 */
static double leave_room(const part *p, const measure_of_face *of_face, double allowed) {
  enum { PLACES = 24 }; /* of a face: its children, and those beside it that are made for these */
  for (;;) {
    uint64_t count = 0;
    double least = INFINITY;
    for (uint32_t f = 0; f < p->topology.face_count; f++) {
      if (!tells_more(p, f, &of_face[f], allowed)) continue;
      count++;
      least = fmin(least, of_face[f].error);
    }
    if (count * PLACES <= FACES_MAX) return allowed;
    allowed = 1.5 * least;
  }
}

/* Measures the faces whose deeper levels follow from them: these are not open any more, unless their children
 * would tell more of what is the greatest and have room. others: a distance of other faces. *most: the
 * greatest of those settled. */
static tw_status settle(const measuring *m, part *p, const tw_error_wish *wish, double others, double *most) {
  const double loose = 1.25;
  uint32_t faces = p->topology.face_count;
  pass s = {.m = m,
            .p = p,
            .kind = PASS_SETTLED,
            .of_face = tw_arena_alloc_raw(p->arena, faces, sizeof *s.of_face)};
  double usual;
  if (!s.of_face) return TW_NO_MEMORY;
  tw_status status = run(&s, &usual);
  if (status != TW_OK) return status;
  double allowed = fmax(loose * fmax(usual, others), wish->enough / SMALL_PART);
  if (is_too_large(m, p)) allowed = leave_room(p, s.of_face, allowed);
  *most = 0;
  for (uint32_t f = 0; f < faces; f++) {
    if (p->states[f] < FACE_OPEN || s.of_face[f].error < 0) continue;
    if (tells_more(p, f, &s.of_face[f], allowed)) {
      p->states[f]++;
      p->errors[f] = s.of_face[f].error; /* which holds where it is given up */
      continue;
    }
    *most = fmax(*most, s.of_face[f].error);
    p->errors[f] = s.of_face[f].error;
    p->states[f] = FACE_AROUND;
    p->open_count--;
  }
  return TW_OK;
}

/* Finds what is left of each open face: *rests, in the part's arena. */
static tw_status find_rests(const measuring *m, part *p, double **rests, double *most) {
  pass s = {.m = m, .p = p, .kind = PASS_REST, .radii = find_radii(p)};
  uint32_t faces = p->topology.face_count, parts = tw_parallel_for_parts(m->parallel, faces, FACES_AT_ONCE),
           capacity = tw_refine_mask_capacity(&p->topology);
  s.rests = *rests = tw_arena_alloc_raw(p->arena, faces, sizeof *s.rests);
  for (uint32_t i = 0; i < parts && s.radii && s.rests; i++) {
    s.shares[i] = tw_arena_alloc_raw(p->arena, capacity, sizeof **s.shares);
    if (!s.shares[i]) return TW_NO_MEMORY;
  }
  return s.radii && s.rests ? run(&s, most) : TW_NO_MEMORY;
}

/* Gives up open faces of which at most so much is left, so that no deeper level of them is made. A measured
 * one may be nearer by its own measure, which shrinks with each level. *given_up: the most that was left of
 * one; *settled: of measured ones. */
static void give_up(part *p, const double *rests, double limit, double *given_up, double *settled) {
  for (uint32_t f = 0; f < p->topology.face_count; f++) {
    if (p->states[f] < FACE_OPEN || (isfinite(limit) && !(rests[f] <= limit))) continue;
    double *error = &p->errors[as_made(p, f)];
    bool is_measured = *error > 0 && *error <= rests[f];
    p->states[f] = is_measured ? FACE_AROUND : FACE_GIVEN_UP;
    p->open_count--;
    if (!is_measured) *error = rests[f];
    double *most = is_measured ? settled : given_up;
    *most = fmax(*most, *error);
  }
}

/* ---- levels ---------------------------------------------------------------------------------- */

/* Whether limit masks of this level are those of its scheme. */
static bool has_limit_masks(const measuring *m, const tw_topology *t) {
  return m->rules.loop || m->rules.linear || t->face_size == 4;
}

static double *copy_points(const part *p, const double *points) {
  size_t count = 3 * (size_t)p->topology.vertex_count;
  double *copy = tw_arena_alloc_raw(p->arena, count, sizeof *copy);
  if (copy) memcpy(copy, points, count * sizeof *copy);
  return copy;
}

/* Moves shown points to the limit. */
static tw_status push_to_limit(const measuring *m, part *p) {
  const tw_topology *t = &p->topology;
  tw_limit_entry *mask = tw_arena_alloc_raw(p->arena, tw_limit_greatest_capacity(t), sizeof *mask);
  double *limit = copy_points(p, p->shown), to[3];
  if (!mask || !limit) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    if (v % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE * FACE_WORK)) return TW_CANCELLED;
    uint32_t count = tw_limit_mask(t, m->rules.linear, t->fan_corners[t->fan_offsets[v]], mask);
    for (uint32_t i = 0; i < count; i++) {
      difference(at(p->shown, mask[i].vertex), at(p->shown, v), to);
      for (int c = 0; c < 3; c++) limit[3 * (size_t)v + (size_t)c] += (double)mask[i].position * to[c];
    }
  }
  p->shown = limit;
  return TW_OK;
}

/* Adds details, and finds the points that answers show. At a cage of polygons limits are those of the next
 * level: then p->shown is NULL. */
static tw_status show(const measuring *m, part *p) {
  tw_detail_step step = {&m->details, &p->topology, &m->rules, p->level, p->level};
  p->shown = p->control;
  if (p->level <= tw_deepest_detail(&m->details) && m->details.count > 0) {
    double *shown = copy_points(p, p->control);
    tw_status status = shown ? tw_details_add(&step, m->parallel, shown) : TW_NO_MEMORY;
    step.answer = TW_LEVEL_MAX + 1; /* a deeper one, so that only the level's own detail is added */
    if (status == TW_OK) status = tw_details_add(&step, m->parallel, p->control);
    if (status != TW_OK) return status;
    p->shown = shown;
  }
  tw_status status = find_rims(p);
  if (status != TW_OK || !m->options->limit || m->rules.linear) return status;
  if (has_limit_masks(m, &p->topology)) return push_to_limit(m, p);
  p->shown = NULL;
  return TW_OK;
}

static tw_status start(measuring *m, part *p) {
  tw_surface_options options = *m->options;
  options.level = 1; /* of which faces the answer has */
  options.tagged = false;
  tw_cage cage;
  *p = (part){.arena = tw_arena_create()};
  tw_status status = p->arena ? tw_cage_read(m->mesh, &options, p->arena, &cage) : TW_NO_MEMORY;
  if (status != TW_OK) return status;
  p->topology = cage.topology;
  p->states = cage.visible;
  for (uint32_t f = 0; f < cage.topology.face_count; f++) {
    p->states[f] = cage.visible[f] ? FACE_OPEN : FACE_HIDDEN;
    p->open_count += p->states[f] == FACE_OPEN;
  }
  p->control = tw_arena_alloc_raw(p->arena, cage.topology.vertex_count, 3 * sizeof *p->control);
  if (!p->control) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < cage.topology.vertex_count; v++)
    for (size_t c = 0; c < 3; c++) {
      float x = m->mesh->positions[3 * (size_t)(cage.point_of ? cage.point_of[v] : v) + c];
      p->control[3 * (size_t)v + c] = (double)x;
      m->size = fmax(m->size, fabs((double)x));
    }
  return show(m, p);
}

static tw_status refine(const measuring *m, const part *p, part *child) {
  *child = (part){.arena = tw_arena_create(), .level = p->level + 1};
  if (!child->arena) return TW_NO_MEMORY;
  tw_topology *t = &child->topology;
  tw_status status = tw_refine_topology(&p->topology, &m->rules, child->arena, m->parallel, t);
  if (status != TW_OK) return status;
  child->control = tw_arena_alloc_raw(child->arena, t->vertex_count, 3 * sizeof *child->control);
  child->states = tw_arena_alloc_raw(child->arena, t->face_count, 1);
  if (!child->control || !child->states) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) {
    child->states[f] = p->states[m->rules.loop ? f / 4 : tw_corner_face(&p->topology, f)];
    child->open_count += child->states[f] >= FACE_OPEN;
  }
  status = tw_refine_values(&p->topology, &m->rules, 3, p->control, m->parallel, child->control);
  return status == TW_OK ? show(m, child) : status;
}

/* Lists the corners of open faces and of those around them; NULL without memory. */
static uint32_t *list_corners(const part *p, uint32_t *count) {
  const tw_topology *t = &p->topology;
  uint8_t *touched = tw_arena_alloc(p->arena, t->vertex_count, 1);
  uint32_t *corners = tw_arena_alloc_raw(p->arena, t->corner_count, sizeof *corners), size = t->face_size;
  *count = 0;
  if (!touched || !corners) return NULL;
  for (uint32_t c = 0; c < t->corner_count; c++)
    if (p->states[c / size] >= FACE_OPEN) touched[t->corner_vertex[c]] = 1;
  for (uint32_t f = 0; f < t->face_count; f++) {
    bool is_listed = false;
    for (uint32_t i = 0; i < size; i++) is_listed |= touched[t->corner_vertex[size * f + i]];
    for (uint32_t i = 0; is_listed && i < size; i++) corners[(*count)++] = size * f + i;
  }
  return corners;
}

/* Copies what is known of faces and vertices. corners, vertices: those of `from`. */
static tw_status take_part(const part *from, const uint32_t *corners, const uint32_t *vertices, part *out) {
  uint32_t size = from->topology.face_size, count = out->topology.vertex_count;
  double *shown = NULL;
  out->states = tw_arena_alloc_raw(out->arena, out->topology.face_count, 1);
  out->made = tw_arena_alloc_raw(out->arena, out->topology.face_count, sizeof *out->made);
  out->control = tw_arena_gather(out->arena, from->control, vertices, count, 3 * sizeof *out->control);
  out->is_rim = tw_arena_gather(out->arena, from->is_rim, vertices, count, 1);
  if (from->shown != from->control)
    shown = tw_arena_gather(out->arena, from->shown, vertices, count, 3 * sizeof *shown);
  out->shown = shown ? shown : out->control;
  if (!out->states || !out->made || !out->control || !out->is_rim || (from->shown != from->control && !shown))
    return TW_NO_MEMORY;
  for (uint32_t f = 0; f < out->topology.face_count; f++) {
    uint32_t face = corners[size * f] / size;
    out->states[f] = from->states[face];
    out->made[f] = as_made(from, face);
  }
  return TW_OK;
}

/* Cuts away what is not around open faces, where that is much. Points at the cut will be wrong after a step,
 * but no step reads them. Under Chaikin's rule all edges at a vertex decide how sharp they stay. */
static tw_status cut(const measuring *m, part *p) {
  const tw_topology *t = &p->topology;
  if (t->face_size == 0 || p->level < tw_deepest_detail(&m->details)) return TW_OK;
  if (m->rules.chaikin && tw_limit_decays(t)) return TW_OK;
  uint32_t count, *vertices, *corners = list_corners(p, &count);
  if (!corners) return TW_NO_MEMORY;
  if (count > t->corner_count / 4 * 3) return TW_OK;
  part out = {
      .arena = tw_arena_create(), .errors = p->errors, .level = p->level, .open_count = p->open_count};
  tw_status status = out.arena ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK)
    status =
        tw_topology_cut(t, count / t->face_size, NULL, count, corners, out.arena, &out.topology, &vertices);
  if (status == TW_OK && m->rules.chaikin) status = tw_topology_sum_semi(&out.topology, out.arena);
  if (status == TW_OK) status = take_part(p, corners, vertices, &out);
  tw_arena_destroy(p->arena);
  *p = out;
  return status;
}

/* ---- all levels ------------------------------------------------------------------------------ */

enum { LEVELS_MAX = TW_LEVEL_MAX + FURTHER_LEVELS };

/* What each level was found to be. */
typedef struct findings {
  tw_arena *arena;
  level_errors levels[LEVELS_MAX + 1];
  double settled[LEVELS_MAX + 1]; /* the distance of measured faces from the limit */
  double rests[LEVELS_MAX + 1];   /* of those given up, on this level or before */
  double step;                    /* of open faces at the level before the last from their children */
  uint32_t last;
} findings;

/* Leaves the faces from which deeper levels are made: those of which more is left than a small part of what
 * is enough and, where these are too many, of the most that is left of any. None at the last level. */
static tw_status narrow(const measuring *m, part *p, const tw_error_wish *wish, findings *found) {
  double *rests, most;
  bool is_last = p->level == wish->level_max + FURTHER_LEVELS,
       is_narrowed = p->level >= tw_deepest_detail(&m->details);
  if (!is_last && !(wish->enough > 0 && is_narrowed) && !is_too_large(m, p))
    return p->level > 0 ? cut(m, p) : TW_OK;
  tw_status status = find_rests(m, p, &rests, &most);
  if (status != TW_OK) return status;
  double *given_up = &found->rests[p->level], *settled = &found->settled[p->level];
  give_up(p, rests, is_last ? INFINITY : is_narrowed ? wish->enough / SMALL_PART : 0, given_up, settled);
  for (int attempt = 0; attempt < 2 && p->open_count > 0; attempt++) {
    if (p->level > 0) status = cut(m, p);
    if (status != TW_OK || !is_too_large(m, p)) return status;
    status = find_rests(m, p, &rests, &most);
    if (status != TW_OK) return status;
    give_up(p, rests, attempt == 0 && is_narrowed ? most / SMALL_PART : INFINITY, given_up, settled);
  }
  return TW_OK;
}

/* Begins to keep what is known of a level that was just made. */
static tw_status keep_made(findings *found, part *p) {
  const tw_topology *t = &p->topology;
  level_errors *kept = &found->levels[p->level];
  kept->face_count = t->face_count;
  kept->vertex_count = t->vertex_count;
  kept->face_size = t->face_size;
  kept->errors = p->errors = tw_arena_alloc(found->arena, t->face_count, sizeof *p->errors);
  if (!p->errors) return TW_NO_MEMORY;
  if (p->level == 0) return TW_OK;
  kept->corners = tw_arena_alloc_raw(found->arena, t->corner_count, sizeof *kept->corners);
  if (!kept->corners) return TW_NO_MEMORY;
  memcpy(kept->corners, t->corner_vertex, t->corner_count * sizeof *kept->corners);
  return TW_OK;
}

/* Keeps what is left of a level whose children are made. The children of a measured face differ by a quarter
 * of what it does, those of one given up by no more than it. */
static tw_status keep_left(const measuring *m, findings *found, const part *p, const part *child) {
  const tw_topology *t = &p->topology;
  level_errors *kept = &found->levels[p->level];
  kept->left_count = t->face_count;
  kept->made = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->made);
  kept->children = tw_arena_alloc_raw(found->arena, (size_t)t->face_count + 1, sizeof *kept->children);
  kept->steps = tw_arena_alloc_raw(found->arena, t->face_count, sizeof *kept->steps);
  if (!kept->made || !kept->children || !kept->steps) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) {
    double share = p->states[f] == FACE_AROUND ? 0.25 : p->states[f] == FACE_GIVEN_UP ? 1 : 0;
    kept->made[f] = as_made(p, f);
    kept->steps[f] = -1;
    kept->children[f] = m->rules.loop ? 4 * f : tw_face_begin(t, f);
    kept->children[f + 1] = m->rules.loop ? 4 * f + 4 : kept->children[f] + tw_face_size(t, f);
    for (uint32_t c = kept->children[f]; c < kept->children[f + 1]; c++)
      child->errors[c] = share * p->errors[kept->made[f]];
  }
  return TW_OK;
}

/* Compares a level with the next, which replaces it. */
static tw_status step(const measuring *m, part *p, findings *found) {
  part child;
  tw_status status = refine(m, p, &child);
  if (status == TW_OK) status = keep_made(found, &child);
  if (status == TW_OK) status = keep_left(m, found, p, &child);
  if (status == TW_OK && !p->shown) {
    p->shown = copy_points(p, child.shown); /* vertices keep their numbers and limits */
    if (!p->shown) status = TW_NO_MEMORY;
  }
  pass s = {.m = m, .p = p, .kind = PASS_STEP, .next = child.shown, .steps = found->levels[p->level].steps};
  if (status == TW_OK) status = run(&s, &found->step);
  tw_arena_destroy(p->arena);
  *p = child;
  return status;
}

static tw_status measure(const measuring *m, part *p, const tw_error_wish *wish, findings *out) {
  double settled = 0, most;
  uint32_t deepest = tw_deepest_detail(&m->details);
  for (;; out->last++) {
    bool can_settle = p->shown && p->level >= deepest;
    tw_status status = can_settle ? settle(m, p, wish, fmax(settled, out->step) / 4, &most) : TW_OK;
    if (status != TW_OK) return status;
    settled = fmax(settled / 4, can_settle ? most : 0);
    out->settled[out->last] = settled;
    out->rests[out->last] = out->last > 0 ? out->rests[out->last - 1] : 0;
    if (p->open_count > 0) status = p->shown ? narrow(m, p, wish, out) : TW_OK;
    if (p->open_count == 0 || status != TW_OK) return status;
    settled = out->settled[out->last];
    status = step(m, p, out);
    if (status != TW_OK) return status;
  }
}

/* The distance of each open face of a level: that from its children, and the greatest that these and the ones
 * beside them have, as points may slide there. *most: the greatest. */
static tw_status sum_up_level(tw_arena *scratch, const level_errors *level, const level_errors *below,
                              double *most) {
  uint32_t size = below->face_size;
  double *at_vertices = tw_arena_alloc(scratch, below->vertex_count, sizeof *at_vertices);
  if (!at_vertices) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < below->face_count; f++) {
    if (f % FACES_AT_ONCE == 0 && !tw_work(FACES_AT_ONCE)) return TW_CANCELLED;
    for (uint32_t i = 0; i < size; i++) {
      double *greatest = &at_vertices[below->corners[size * f + i]];
      *greatest = fmax(*greatest, below->errors[f]);
    }
  }
  for (uint32_t f = 0; f < level->left_count; f++) {
    double greatest = 0;
    if (level->steps[f] < 0) continue;
    for (uint32_t c = size * level->children[f]; c < size * level->children[f + 1]; c++)
      greatest = fmax(greatest, at_vertices[below->corners[c]]);
    level->errors[level->made[f]] = level->steps[f] + greatest;
    *most = fmax(*most, level->steps[f] + greatest);
  }
  return TW_OK;
}

/* Adds up the distances. Levels below the last one lie in the hulls that the rest was found by. */
static tw_status sum_up(const findings *found, uint32_t level_max, double rounding, double *out) {
  for (uint32_t level = found->last; level <= level_max; level++)
    out[level] = rounding + fmax(ldexp(found->settled[found->last], -2 * (int)(level - found->last)),
                                 found->rests[found->last]);
  for (uint32_t level = found->last; level-- > 0;) {
    double most = fmax(found->settled[level], found->rests[level]);
    tw_status status = sum_up_level(found->arena, &found->levels[level], &found->levels[level + 1], &most);
    if (status != TW_OK) return status;
    if (level <= level_max) out[level] = most + rounding;
  }
  return TW_OK;
}

static bool has_border(const tw_topology *t) {
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (t->edge_flags[e] & TW_EDGE_BORDER) return true;
  return false;
}

/* Whether level 0 cannot be told: it has faces that deeper levels leave out, or points that masks do not
 * tell. */
static bool is_odd_cage(const measuring *m, const part *cage) {
  const tw_topology *t = &cage->topology;
  uint32_t hidden = 0;
  for (uint32_t f = 0; f < t->face_count; f++) hidden += cage->states[f] == FACE_HIDDEN;
  return hidden > m->mesh->hole_count || (!cage->shown && (m->details.count > 0 || tw_limit_decays(t)));
}

tw_status tw_surface_errors(const tw_mesh *mesh, const tw_surface_options *options, const tw_error_wish *wish,
                            const tw_parallel_for *parallel, double *out, tw_error *error) {
  enum {
    PARTS_OF_SIZE = 3000000
  }; /* floats round to fewer than this many parts of a coordinate, masks too */
  measuring m = {.mesh = mesh,
                 .options = options,
                 .parallel = parallel,
                 .rules = tw_rules_of(options),
                 .details = {mesh->detail_count, mesh->details}};
  tw_status status = tw_cage_check_options(mesh, options, error);
  if (status != TW_OK) return status;
  part p = {0};
  findings found = {.arena = tw_arena_create()};
  status = found.arena ? start(&m, &p) : TW_NO_MEMORY;
  if (status == TW_OK) status = keep_made(&found, &p);
  bool is_odd = status == TW_OK && is_odd_cage(&m, &p);
  if (status == TW_OK && options->boundary == TW_BOUNDARY_OPEN && has_border(&p.topology))
    status = tw_fail(error, TW_UNSUPPORTED, "with boundary=open each level is smaller than the one before");
  if (status == TW_OK) status = measure(&m, &p, wish, &found);
  tw_arena_destroy(p.arena);
  if (status == TW_OK) status = sum_up(&found, wish->level_max, m.size / PARTS_OF_SIZE, out);
  tw_arena_destroy(found.arena);
  if (status == TW_OK && is_odd) out[0] = INFINITY;
  if (status == TW_CANCELLED) return tw_fail(error, status, "the distances are not wanted any more");
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
