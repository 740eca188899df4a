/* Regular faces: one measure holds for a face's own level and for all deeper ones (surface_error.c, 1). */
#include <string.h>

#include "surface_error.h"

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
  const tw_error_part *p;
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
  memcpy(n->against_next, tw_point_at(control, t->corner_vertex[next]), sizeof(double[3]));
  memcpy(n->against_previous, tw_point_at(control, t->corner_vertex[tw_quad_previous(second)]),
         sizeof(double[3]));
  memcpy(n->against_opposite, tw_point_at(control, t->corner_vertex[tw_quad_next(next)]), sizeof(double[3]));
  return true;
}

/* At a crease of two faces a side, the net goes on beyond it without second differences: the crease rule is
 * that of a cubic spline. is_left: the face's edge to the previous corner is the crease. */
static bool fill_crease(const corner_net *n, bool is_left) {
  const tw_topology *t = &n->p->topology;
  const double *control = n->p->control;
  uint32_t other = is_left ? tw_error_turn_right(t, n->corner) : tw_error_turn_left(t, n->corner);
  if (other == UINT32_MAX ||
      (is_left ? tw_error_turn_right(t, other) : tw_error_turn_left(t, other)) != UINT32_MAX)
    return false;
  uint32_t end = is_left ? tw_quad_next(other) : tw_quad_previous(other);
  const double *far = tw_point_at(control, t->corner_vertex[end]),
               *across = tw_point_at(control, t->corner_vertex[tw_quad_next(tw_quad_next(other))]);
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
  enum { EDGES = 4 };
  const tw_topology *t = &n->p->topology;
  uint32_t vertex = t->corner_vertex[n->corner];
  bool right = tw_is_infinite(t->edge_sharpness[t->corner_edge[n->corner]]),
       left = tw_is_infinite(t->edge_sharpness[t->corner_edge[tw_quad_previous(n->corner)]]);
  if (!left && !right) /* the count first: edges of a vertex with very many are not looked at for each face */
    return t->ring_offsets[vertex + 1] - t->ring_offsets[vertex] == EDGES && tw_error_is_plain(t, vertex) &&
           fill_plain(n);
  uint32_t sharp = count_sharp(t, vertex);
  if (sharp == UINT32_MAX || (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD)) return false;
  bool is_corner = t->vertex_sharpness[vertex] > 0 || sharp > 2;
  if (left && right) return is_corner && fill_corner(n);
  return !is_corner && sharp == 2 && fill_crease(n, left);
}

/* Finds the net of a quad among quads; false where its surface is no single patch. */
static bool find_net(const tw_error_part *p, uint32_t face, tw_error_net *out) {
  static const int places[4][2] = {{1, 1}, {2, 1}, {2, 2}, {1, 2}}; /* u, v */
  const tw_topology *t = &p->topology;
  const double *own[4];
  if (t->face_size != 4) return false;
  uint32_t begin = tw_face_begin(t, face);
  for (int i = 0; i < 4; i++) {
    own[i] = tw_point_at(p->control, t->corner_vertex[begin + (uint32_t)i]);
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
  tw_offset spread, greatest;
} bend;

enum { ALONG_U, ALONG_V, MIXED, KINDS };

/* The differences of a kind: [8] along u or v, [9] mixed. Returns how many. */
static int find_differences(const tw_error_net *n, int kind, double out[9][3]) {
  int count = 0;
  if (kind == MIXED) {
    for (int v = 0; v < 3; v++)
      for (int u = 0; u < 3; u++, count++)
        for (int c = 0; c < 3; c++)
          out[count][c] = n->points[v][u][c] - n->points[v][u + 1][c] - n->points[v + 1][u][c] +
                          n->points[v + 1][u + 1][c];
    return count;
  }
  for (int line = 0; line < 4; line++)
    for (int place = 1; place < 3; place++, count++) {
      const double(*p)[3] = kind == ALONG_U ? &n->points[line][place] : &n->points[place][line],
            (*next)[3] = kind == ALONG_U ? p + 1 : p + 4, (*before)[3] = kind == ALONG_U ? p - 1 : p - 4;
      for (int c = 0; c < 3; c++) out[count][c] = (*before)[c] - 2 * (*p)[c] + (*next)[c];
    }
  return count;
}

static void widen(tw_offset *most, const tw_offset *more) {
  if (more->normal > most->normal) most->normal = more->normal;
  if (more->slide > most->slide) most->slide = more->slide;
  if (more->whole > most->whole) most->whole = more->whole;
}

/* The greatest height along the normal, the greatest slide across it and the greatest length of some vectors.
 * Compares squares, so that three roots are enough. */
static tw_offset find_greatest(double (*vectors)[3], int count, const double normal[3]) {
  tw_offset squares = {0};
  for (int i = 0; i < count; i++) {
    double along = tw_dot3(vectors[i], normal), across[3];
    for (int c = 0; c < 3; c++) across[c] = vectors[i][c] - along * normal[c];
    widen(&squares, &(tw_offset){along * along, tw_dot3(across, across), tw_dot3(vectors[i], vectors[i])});
  }
  return (tw_offset){sqrt(squares.normal), sqrt(squares.slide), sqrt(squares.whole)};
}

static bend find_bend(const tw_error_net *n, int kind, const double normal[3]) {
  double d[9][3];
  int count = find_differences(n, kind, d);
  bend out = {0};
  for (int i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) out.mean[c] += d[i][c] / count;
  out.greatest = find_greatest(d, count, normal);
  for (int i = 0; i < count; i++) tw_difference3(d[i], out.mean, d[i]);
  out.spread = find_greatest(d, count, normal);
  return out;
}

/* a u + b v + c m of the means, which is near that of all points of the patch. */
static void mix_means(const bend bends[KINDS], double a, double b, double c, double out[3]) {
  for (int i = 0; i < 3; i++)
    out[i] = a * bends[ALONG_U].mean[i] + b * bends[ALONG_V].mean[i] + c * bends[MIXED].mean[i];
}

static tw_offset mix(const bend bends[KINDS], double a, double b, double c, const double normal[3]) {
  double sum[3];
  mix_means(bends, a, b, c, sum);
  return tw_offset_split(sum, normal);
}

static tw_offset add_spreads(const bend bends[KINDS], double a, double b, double c, tw_offset to) {
  const tw_offset *u = &bends[ALONG_U].spread, *v = &bends[ALONG_V].spread, *m = &bends[MIXED].spread;
  return (tw_offset){to.normal + a * u->normal + b * v->normal + c * m->normal,
                     to.slide + a * u->slide + b * v->slide + c * m->slide,
                     to.whole + a * u->whole + b * v->whole + c * m->whole};
}

/* The difference between the surface and triangles of its control points. It is convex in u (1 - u), v (1 -
 * v) and the mixed difference's weight, so it is greatest where these are. */
static tw_offset control_deviation(const bend bends[KINDS], const double normal[3]) {
  static const double ends[][3] = {{1. / 6, 1. / 6, 0},        {1. / 24, 1. / 6, 0},
                                   {1. / 6, 1. / 24, 0},       {1. / 24, 1. / 24, 0},
                                   {1. / 24, 1. / 6, 1. / 8},  {1. / 24, 1. / 6, -1. / 8},
                                   {1. / 6, 1. / 24, 1. / 8},  {1. / 6, 1. / 24, -1. / 8},
                                   {1. / 24, 1. / 24, 1. / 4}, {1. / 24, 1. / 24, -1. / 4}};
  enum { ENDS = sizeof ends / sizeof *ends };
  double at[ENDS][3];
  for (int i = 0; i < ENDS; i++) mix_means(bends, ends[i][0], ends[i][1], ends[i][2], at[i]);
  return find_greatest(at, ENDS, normal);
}

/* The greatest l1 l2 a + l2 l3 b + l3 l1 c of weights of sum 1, halved: the square of a circumradius. */
static double interpolation_error(double a, double b, double c) {
  double most = tw_greater(a, tw_greater(b, c)), area = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c);
  if (2 * most >= a + b + c || !(area > 0)) return most / 8;
  return tw_greater(most / 8, a * b * c / area / 2);
}

/* The difference between the surface and triangles of its own points: along each side of a triangle it bends
 * by the second differences in that direction. */
static tw_offset limit_deviation(const bend bends[KINDS], bool spread, const double normal[3]) {
  tw_offset u = mix(bends, 1, 0, 0, normal), v = mix(bends, 0, 1, 0, normal),
            diagonal = mix(bends, 1, 1, 2, normal), other = mix(bends, 1, 1, -2, normal);
  widen(&diagonal, &other);
  if (spread) {
    u = add_spreads(bends, 1, 0, 0, u);
    v = add_spreads(bends, 0, 1, 0, v);
    diagonal = add_spreads(bends, 1, 1, 2, diagonal);
  }
  return (tw_offset){interpolation_error(u.normal, v.normal, diagonal.normal),
                     interpolation_error(u.slide, v.slide, diagonal.slide),
                     interpolation_error(u.whole, v.whole, diagonal.whole)};
}

/* The difference between the surface and its triangles, bounded by the lengths of the greatest second
 * differences alone. This bound is the smaller one where their directions vary much. The mixed difference has
 * the weight 1/4 in the middle of a face; of control points, those along u and v then have a quarter of
 * theirs. */
static double plain_deviation(bool limit, double u, double v, double mixed) {
  if (limit) return (u + v) / 8 + mixed / 4;
  return (u + v) / 6 + (tw_greater(0, mixed - u) + tw_greater(0, mixed - v)) / 8;
}

/* The greatest difference. *usual: along the normal, if second differences were their means everywhere. */
static tw_offset deviation(const bend bends[KINDS], bool limit, const double normal[3], double *usual) {
  tw_offset by_means = limit ? limit_deviation(bends, false, normal) : control_deviation(bends, normal);
  *usual = by_means.normal;
  by_means =
      limit ? limit_deviation(bends, true, normal) : add_spreads(bends, 1. / 6, 1. / 6, 1. / 4, by_means);
  const tw_offset *u = &bends[ALONG_U].greatest, *v = &bends[ALONG_V].greatest, *m = &bends[MIXED].greatest;
  return (tw_offset){tw_lesser(by_means.normal, plain_deviation(limit, u->normal, v->normal, m->normal)),
                     tw_lesser(by_means.slide, plain_deviation(limit, u->slide, v->slide, m->slide)),
                     tw_lesser(by_means.whole, plain_deviation(limit, u->whole, v->whole, m->whole))};
}

/* A patch's directions along u and v, in the plane across the normal: their means, how far others are from
 * these, and their greatest heights. */
typedef struct directions {
  double mean[2][3], spread[2], height[2];
} directions;

static const double *net_step(const tw_error_net *n, int axis, int line, int i) {
  return axis == 0 ? n->points[line][i] : n->points[i][line];
}

static directions find_directions(const tw_error_net *n, const double normal[3]) {
  enum { LINES = 4, STEPS = 3 };
  directions out = {0};
  for (int axis = 0; axis < 2; axis++) {
    double d[LINES * STEPS][3], height = 0, square = 0;
    for (int i = 0; i < LINES * STEPS; i++) {
      int line = i / STEPS, place = i % STEPS;
      tw_difference3(net_step(n, axis, line, place + 1), net_step(n, axis, line, place), d[i]);
      double along = tw_dot3(d[i], normal);
      if (fabs(along) > height) height = fabs(along);
      for (int c = 0; c < 3; c++) {
        d[i][c] -= along * normal[c];
        out.mean[axis][c] += d[i][c] / (LINES * STEPS);
      }
    }
    for (int i = 0; i < LINES * STEPS; i++) {
      tw_difference3(d[i], out.mean[axis], d[i]);
      if (tw_dot3(d[i], d[i]) > square) square = tw_dot3(d[i], d[i]);
    }
    out.height[axis] = height;
    out.spread[axis] = sqrt(square);
  }
  return out;
}

/* The greatest slope of a patch, seen along the normal; infinite where that may be no graph. *least_step: the
 * least that a step of 1 in u and v moves its points across the normal. */
static double patch_slope(const tw_error_net *n, const double normal[3], double *least_step) {
  const directions d = find_directions(n, normal);
  double across[3];
  tw_cross3(d.mean[0], d.mean[1], across);
  double sum = tw_dot3(d.mean[0], d.mean[0]) + tw_dot3(d.mean[1], d.mean[1]), area = tw_length3(across);
  double least = sqrt(tw_greater(0, (sum - sqrt(tw_greater(0, sum * sum - 4 * area * area))) / 2));
  *least_step = least - hypot(d.spread[0], d.spread[1]);
  return *least_step > 0.2 * least ? hypot(d.height[0], d.height[1]) / *least_step : INFINITY;
}

/* ---- a closer look ------------------------------------------------------------------------------ */

/* The control points of a patch in Bezier form, in whose hull it lies; its corners are limit points. */
static void find_bezier(const tw_error_net *n, tw_error_net *out) {
  static const double shares[4][4] = {{1. / 6, 4. / 6, 1. / 6, 0},
                                      {0, 2. / 3, 1. / 3, 0},
                                      {0, 1. / 3, 2. / 3, 0},
                                      {0, 1. / 6, 4. / 6, 1. / 6}};
  double lines[4][4][3];
  memset(lines, 0, sizeof lines);
  memset(out, 0, sizeof *out);
  for (int v = 0; v < 4; v++)
    for (int u = 0; u < 4; u++)
      for (int k = 0; k < 4; k++)
        for (int c = 0; c < 3; c++) lines[v][u][c] += shares[u][k] * n->points[v][k][c];
  for (int v = 0; v < 4; v++)
    for (int k = 0; k < 4; k++)
      for (int u = 0; u < 4; u++)
        for (int c = 0; c < 3; c++) out->points[v][u][c] += shares[v][k] * lines[k][u][c];
}

static void split_line(const double *a, const double *b, const double *c, const double *d, double *out[5]) {
  for (int k = 0; k < 3; k++) {
    out[0][k] = (a[k] + b[k]) / 2;
    out[1][k] = (a[k] + 6 * b[k] + c[k]) / 8;
    out[2][k] = (b[k] + c[k]) / 2;
    out[3][k] = (b[k] + 6 * c[k] + d[k]) / 8;
    out[4][k] = (c[k] + d[k]) / 2;
  }
}

/* The nets of a patch's quarters. */
static void split_net(const tw_error_net *n, tw_error_net out[4]) {
  double lines[4][5][3], points[5][5][3];
  for (int v = 0; v < 4; v++) {
    double *line[5] = {lines[v][0], lines[v][1], lines[v][2], lines[v][3], lines[v][4]};
    split_line(n->points[v][0], n->points[v][1], n->points[v][2], n->points[v][3], line);
  }
  for (int u = 0; u < 5; u++) {
    double *line[5] = {points[0][u], points[1][u], points[2][u], points[3][u], points[4][u]};
    split_line(lines[0][u], lines[1][u], lines[2][u], lines[3][u], line);
  }
  for (int child = 0; child < 4; child++)
    for (int v = 0; v < 4; v++)
      memcpy(out[child].points[v], points[v + child / 2][child % 2], sizeof out[child].points[v]);
}

/* The corners of a patch's face. */
static void find_face(const tw_error_net *n, double out[4][3]) {
  static const int places[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}; /* v, u */
  for (int i = 0; i < 4; i++) memcpy(out[i], n->points[places[i][0]][places[i][1]], sizeof out[i]);
}

static double face_slope(const tw_error_net *n, const double normal[3]) {
  double corners[4][3];
  find_face(n, corners);
  return tw_error_quad_slope(corners, normal);
}

/* The greatest slope of a patch and of all its levels: their derivatives along u and v are means of steps. */
static double slope_of_pairs(const tw_error_net *n, const double normal[3]) {
  enum { STEPS = 3, ALL = 4 * STEPS };
  double along_v[3][ALL], most = 1;
  for (int i = 0; i < ALL; i++)
    for (int c = 0; c < 3; c++)
      along_v[c][i] = net_step(n, 1, i / STEPS, i % STEPS + 1)[c] - net_step(n, 1, i / STEPS, i % STEPS)[c];
  for (int i = 0; i < ALL; i++) {
    double u[3], heights[ALL], squares[ALL];
    tw_difference3(net_step(n, 0, i / STEPS, i % STEPS + 1), net_step(n, 0, i / STEPS, i % STEPS), u);
    for (int k = 0; k < ALL; k++) {
      double x = u[1] * along_v[2][k] - u[2] * along_v[1][k], y = u[2] * along_v[0][k] - u[0] * along_v[2][k],
             z = u[0] * along_v[1][k] - u[1] * along_v[0][k];
      heights[k] = x * normal[0] + y * normal[1] + z * normal[2];
      squares[k] = x * x + y * y + z * z;
    }
    for (int k = 0; k < ALL; k++) {
      if (!(heights[k] > 0)) return INFINITY;
      if (squares[k] > most * heights[k] * heights[k]) most = squares[k] / (heights[k] * heights[k]);
    }
  }
  return sqrt(most - 1);
}

/* The same, of its quarters where these may be less: then of its own level too. What is at most `enough` is
 * looked at no further. */
static double closer_slope(const tw_error_net *n, const double normal[3], double enough) {
  tw_error_net quarters[4];
  double slope = slope_of_pairs(n, normal);
  if (slope <= enough) return slope;
  double most = face_slope(n, normal);
  split_net(n, quarters);
  for (int i = 0; i < 4 && most < slope; i++) most = tw_greater(most, slope_of_pairs(&quarters[i], normal));
  return tw_lesser(slope, most);
}

/* Whether the limit surface of a patch, seen along the normal, lies over its face and the faces around it,
 * which are a graph along that normal. So it is where the patch's hull reaches less far beyond the sides and
 * corners of its face than each outer edge of the faces around lies beyond one of these. */
static bool stays_around(const tw_error_net *n, const double normal[3]) {
  enum { SIDES = 4, WAYS = 2 * SIDES, EDGES = 12 };
  static const int outer[EDGES][2] = {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {1, 3}, {2, 3},
                                      {3, 3}, {3, 2}, {3, 1}, {3, 0}, {2, 0}, {1, 0}}; /* v, u */
  tw_error_net bezier;
  double face[4][3], out[WAYS][3], beyond[EDGES][WAYS], to[3], farthest = 0, width = INFINITY;
  find_bezier(n, &bezier);
  find_face(n, face);
  for (int i = 0; i < SIDES; i++) {
    tw_difference3(face[(i + 1) % SIDES], face[i], to);
    tw_cross3(to, normal, out[i]);
    tw_unit3(out[i]);
  }
  for (int i = 0; i < SIDES; i++) {
    for (int c = 0; c < 3; c++) out[SIDES + i][c] = out[i][c] + out[(i + SIDES - 1) % SIDES][c];
    tw_unit3(out[SIDES + i]);
  }
  for (int way = 0; way < WAYS; way++) {
    for (int i = 0; i < 16; i++) {
      tw_difference3(bezier.points[i / 4][i % 4], face[way % SIDES], to);
      farthest = tw_greater(farthest, tw_dot3(to, out[way]));
    }
    for (int i = 0; i < EDGES; i++) {
      tw_difference3(n->points[outer[i][0]][outer[i][1]], face[way % SIDES], to);
      beyond[i][way] = tw_dot3(to, out[way]);
    }
  }
  for (int i = 0; i < EDGES; i++) {
    double most = 0;
    for (int way = 0; way < WAYS; way++)
      most = tw_greater(most, tw_lesser(beyond[i][way], beyond[(i + 1) % EDGES][way]));
    width = tw_lesser(width, most);
  }
  return farthest <= width;
}

static void second_difference(const double *a, const double *b, const double *c, double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = a[i] - 2 * b[i] + c[i];
}

/* The distance between the sides of a face that are rims, where nothing slides, and their limit curves. ends:
 * only of sides at which the surface ends, not of sharp edges between two faces. */
static double rim_deviation(const tw_error_part *p, uint32_t face, const tw_error_net *n, bool limit,
                            bool ends) {
  const tw_topology *t = &p->topology;
  double most = 0, d[3];
  for (int side = 0; side < 4; side++) {
    uint32_t edge = t->corner_edge[tw_face_begin(t, face) + (uint32_t)side];
    if (ends ? !tw_error_is_end(p, edge) : !tw_error_is_rim(p, edge)) continue;
    int axis = side % 2, line = side == 0 || side == 3 ? 1 : 2;
    for (int i = 1; i < 3; i++) {
      second_difference(net_step(n, axis, line, i - 1), net_step(n, axis, line, i),
                        net_step(n, axis, line, i + 1), d);
      most = tw_greater(most, tw_length3(d));
    }
  }
  return limit ? most / 8 : most / 6;
}

/* The difference where points slide. At sharp edges between two faces they either stay, or slide as far as
 * the faces on both sides allow: both are bounds, and the lesser one counts. */
static double slid_deviation(const tw_error_part *p, uint32_t face, const tw_error_net *n, bool limit,
                             const double normal[3], const tw_offset *most, double slope) {
  double inside = most->normal + slope * most->slide, rims = rim_deviation(p, face, n, limit, false);
  if (rims <= inside) return inside;
  slope = tw_greater(slope, tw_error_slope_beyond(p, face, normal));
  if (!isfinite(slope)) return rims;
  return tw_lesser(rims,
                   tw_greater(most->normal + slope * most->slide, rim_deviation(p, face, n, limit, true)));
}

/* Lowers distances on a face's own level and the next ones by one that these have a quarter of each. */
static void lower(double error, double errors[TW_ERROR_LOOKED]) {
  for (int i = 0; i < TW_ERROR_LOOKED; i++, error /= 4) errors[i] = tw_lesser(errors[i], error);
}

static tw_face_measure measure_patch(const tw_error_part *p, uint32_t face, const tw_error_net *n,
                                     bool limit) {
  const uint32_t *quad = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  tw_face_measure out = {.errors = {INFINITY, INFINITY, INFINITY}};
  out.is_plain = !p->is_rim[quad[0]] && !p->is_rim[quad[1]] && !p->is_rim[quad[2]] && !p->is_rim[quad[3]];
  double normal[3], step = 0;
  bend bends[KINDS];
  tw_error_normal(p, face, normal);
  for (int kind = 0; kind < KINDS; kind++) bends[kind] = find_bend(n, kind, normal);
  const tw_offset most = out.offset = deviation(bends, limit, normal, &out.usual);
  double slope = tw_dot3(normal, normal) > 0 ? patch_slope(n, normal, &step) : INFINITY;
  if (isfinite(slope) && most.slide <= step / 2)
    slope = tw_greater(slope, tw_error_slope_around(p, face, normal));
  double error = out.whole = most.whole;
  if (isfinite(slope) && most.slide <= step / 2)
    error = tw_lesser(error, slid_deviation(p, face, n, limit, normal, &most, slope));
  lower(error, out.errors);
  return out;
}

/* A bilinear patch differs from its triangles by a quarter of the mixed difference, and its children's mixed
 * differences are a quarter of its own. Its edges stay, so nothing slides into other faces. */
static tw_face_measure measure_bilinear(const tw_error_part *p, uint32_t face) {
  const uint32_t *quad = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  double mixed[3], normal[3];
  for (int c = 0; c < 3; c++)
    mixed[c] = tw_point_at(p->shown, quad[0])[c] - tw_point_at(p->shown, quad[1])[c] +
               tw_point_at(p->shown, quad[2])[c] - tw_point_at(p->shown, quad[3])[c];
  tw_error_normal(p, face, normal);
  tw_offset m = tw_offset_split(mixed, normal);
  double cosine = tw_dot3(normal, normal) > 0 ? tw_error_face_cosine(p, face, normal) : 0;
  double error = m.slide > 0 ? tw_lesser(m.whole, m.normal + m.slide * tw_error_slope(cosine)) : m.whole;
  return (tw_face_measure){
      .errors = {error / 4, error / 16, error / 64}, .whole = m.whole / 4, .usual = INFINITY};
}

tw_face_measure tw_error_of_patch(const tw_measuring *m, const tw_error_part *p, uint32_t face) {
  tw_error_net n;
  if (m->rules.linear && tw_face_size(&p->topology, face) == 4) return measure_bilinear(p, face);
  if (m->rules.loop || m->rules.linear || !find_net(p, face, &n)) return (tw_face_measure){.errors = {-1}};
  return measure_patch(p, face, &n, m->options->limit);
}

/* The greatest slope of what points of a face slide over, of which `slope` is that of the faces around;
 * INFINITY where they may lie beyond these. What is at most `enough` is looked at no further. */
static double find_slope(const tw_error_net *n, const double normal[3], double slope, const tw_offset *most,
                         double enough) {
  if (!isfinite(slope) || !stays_around(n, normal)) return INFINITY;
  double allowed = (enough - most->normal) / most->slide;
  return tw_greater(slope, closer_slope(n, normal, tw_greater(slope, allowed)));
}

/* ---- limit points all over a face ----------------------------------------------------------------
 *
 * Where points slide far, the slope around is much to charge for the whole slide. Limit points all over a
 * face are compared with the triangle that each comes from, so that only what leaves that triangle is
 * charged, as for pieces in error_sums.c: triangles of limit points lie over one triangle of the face each,
 * whichever way that is cut, and the limit surface is as near to these as second differences say. That is no
 * guess about points between, so the sum is a bound, of both ways. It tells of one level alone. */

enum { PARTS = 4 }; /* of a face's side */

/* Limit points of a patch, [v][u]. */
static void find_limits(const tw_error_net *n, double out[PARTS + 1][PARTS + 1][3]) {
  double shares[PARTS + 1][4]; /* of control points, at each part of a side */
  for (int i = 0; i <= PARTS; i++) {
    double t = (double)i / PARTS, s = 1 - t;
    shares[i][0] = s * s * s / 6;
    shares[i][1] = (3 * t * t * t - 6 * t * t + 4) / 6;
    shares[i][2] = (3 * s * s * s - 6 * s * s + 4) / 6;
    shares[i][3] = t * t * t / 6;
  }
  for (int u = 0; u <= PARTS; u++) {
    double line[4][3];
    const double *by = shares[u];
    for (int v = 0; v < 4; v++)
      for (int c = 0; c < 3; c++)
        line[v][c] = by[0] * n->points[v][0][c] + by[1] * n->points[v][1][c] + by[2] * n->points[v][2][c] +
                     by[3] * n->points[v][3][c];
    for (int v = 0; v <= PARTS; v++)
      for (int c = 0; c < 3; c++)
        out[v][u][c] = shares[v][0] * line[0][c] + shares[v][1] * line[1][c] + shares[v][2] * line[2][c] +
                       shares[v][3] * line[3][c];
  }
}

void tw_error_split_places(const uint8_t at[4], uint8_t out[4][4]) {
  const uint8_t sides[4] = {at[0] & at[1], at[1] & at[2], at[2] & at[3], at[3] & at[0]},
                middle = (at[0] & at[2]) | (at[1] & at[3]);
  const uint8_t quarters[4][4] = {{at[0], sides[0], middle, sides[3]},
                                  {sides[0], at[1], sides[1], middle},
                                  {middle, sides[1], at[2], sides[2]},
                                  {sides[3], middle, sides[2], at[3]}};
  memcpy(out, quarters, sizeof quarters);
}

/* Where a patch's limit points lie over a face, from the places of its corners: in both halves of each side
 * as tw_refine_topology makes them. */
static void find_places(const uint8_t at[4], int v, int u, int size, uint8_t out[PARTS + 1][PARTS + 1]) {
  if (size == 0) return;
  const int half = size / 2;
  uint8_t quarters[4][4];
  tw_error_split_places(at, quarters);
  out[v][u] = at[0];
  out[v][u + size] = at[1];
  out[v + size][u + size] = at[2];
  out[v + size][u] = at[3];
  for (int i = 0; i < 4; i++)
    find_places(quarters[i], i < 2 ? v : v + half, i == 1 || i == 2 ? u + half : u, half, out);
}

/* The least cosine between a normal and those of the triangles at the corners of one of a net's nine quads.
 */
static double quad_cosine(const tw_error_net *n, int v, int u, const double normal[3]) {
  const double *quad[4] = {n->points[v][u], n->points[v][u + 1], n->points[v + 1][u + 1],
                           n->points[v + 1][u]};
  double sides[4][3], across[3], least = 1;
  for (int i = 0; i < 4; i++) tw_difference3(quad[(i + 1) % 4], quad[i], sides[i]);
  for (int i = 0; i < 4; i++) {
    tw_cross3(sides[(i + 3) % 4], sides[i], across);
    if (tw_unit3(across) > 0) least = tw_lesser(least, tw_dot3(across, normal));
  }
  return least;
}

/* How a face's points may slide over the eight faces around it, which are regular and no rims. Returns the
 * greatest slope of all these. */
static double find_frame(const tw_error_net *n, double normal[3], tw_error_frame *out) {
  static const uint32_t order[4] = {0, 1, 2, 3};
  static const int first[4][2] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}}, /* of four faces at a corner: v, u */
      beside[4][2] = {{0, 1}, {1, 2}, {2, 1}, {1, 0}};             /* across an edge */
  double cosines[3][3], reach = 0, least = 1, face[4][3], side[3];
  find_face(n, face);
  tw_corners_normal(face[0], order, 4, normal);
  for (int v = 0; v < 3; v++)
    for (int u = 0; u < 3; u++) {
      cosines[v][u] = quad_cosine(n, v, u, normal);
      least = tw_lesser(least, cosines[v][u]);
    }
  for (int i = 0; i < 4; i++) {
    int v = first[i][0], u = first[i][1];
    out->corners[i] = tw_error_rounded_down(tw_lesser(tw_lesser(cosines[v][u], cosines[v][u + 1]),
                                                      tw_lesser(cosines[v + 1][u], cosines[v + 1][u + 1])));
    out->edges[i] = tw_error_rounded_down(tw_lesser(cosines[1][1], cosines[beside[i][0]][beside[i][1]]));
    tw_difference3(face[(i + 1) % 4], face[i], side);
    reach += tw_length3(side) / 8;
  }
  out->own = tw_error_rounded_down(cosines[1][1]);
  out->reach = (float)(reach * (1 - 1e-6));
  return tw_error_slope(least);
}

/* The difference between a patch and triangles of its own limit points: its part along the normal, and the
 * slide across it. */
static tw_offset offset_of_limits(const tw_error_net *n, const double normal[3]) {
  bend bends[KINDS];
  double usual;
  for (int kind = 0; kind < KINDS; kind++) bends[kind] = find_bend(n, kind, normal);
  return deviation(bends, true, normal, &usual);
}

double tw_error_of_limits(const tw_error_base *b, const tw_error_net *n, const uint8_t places[4]) {
  const double parts = PARTS * PARTS; /* second differences of a part are this much less */
  double limits[PARTS + 1][PARTS + 1][3], slope = tw_error_slope(b->around);
  uint8_t at[PARTS + 1][PARTS + 1];
  tw_error_gap gap = tw_error_gap_over(b);
  tw_offset rest = offset_of_limits(n, b->normal);
  /* Points of the limit between those that are looked at slide, too. Both slides add up, so the latter have
   * that much less of the reach. */
  if (rest.slide / parts < gap.reach && rest.normal + slope * rest.slide < rest.whole) {
    gap.reach -= rest.slide / parts;
    rest.whole = rest.normal + slope * rest.slide;
  }
  find_limits(n, limits);
  find_places(places, 0, 0, PARTS, at);
  for (int v = 0; v <= PARTS; v++)
    for (int u = 0; u <= PARTS; u++) tw_error_take_point(b, &gap, at[v][u], limits[v][u]);
  return tw_error_gap_size(b, &gap) + rest.whole / parts;
}

/* The distance of the limit from a face whose corners are control points. */
static double error_of_control(const tw_error_net *n) {
  tw_error_frame frame;
  tw_error_base base = {.size = 4, .frame = &frame};
  double face[4][3];
  uint8_t places[4];
  find_frame(n, base.normal, &frame);
  find_face(n, face);
  for (int i = 0; i < 4; i++) base.corners[i] = face[i];
  tw_error_begin_base(&base, places);
  return tw_error_of_limits(&base, n, places);
}

/* The same of a face whose corners are limit points. Points slide over faces around it that are at most as
 * steep as `slope`, seen along the normal; where that is infinite, nothing slides. */
static double error_of_limit(const tw_error_net *n, const double normal[3], double slope, double reach) {
  static const int ends[4][2] = {{0, 0}, {0, PARTS}, {PARTS, PARTS}, {PARTS, 0}}; /* v, u */
  const float cosine = isfinite(slope) ? tw_error_rounded_down(1 / sqrt(1 + slope * slope)) : -1;
  const tw_error_frame frame = {.corners = {cosine, cosine, cosine, cosine},
                                .edges = {cosine, cosine, cosine, cosine},
                                .own = cosine,
                                .reach = (float)reach};
  tw_error_base base = {.size = 4, .frame = &frame, .normal = {normal[0], normal[1], normal[2]}};
  double limits[PARTS + 1][PARTS + 1][3];
  uint8_t places[4];
  find_limits(n, limits);
  for (int i = 0; i < 4; i++) base.corners[i] = limits[ends[i][0]][ends[i][1]];
  tw_error_begin_base(&base, places);
  return tw_error_of_limits(&base, n, places);
}

/* The same of a face of a level that shows limit points. */
static double error_of_shown(const tw_error_part *p, uint32_t face, const tw_error_net *n) {
  const uint32_t *quad = p->topology.corner_vertex + tw_face_begin(&p->topology, face);
  tw_error_frame frame;
  tw_error_base base = {.size = 4, .frame = &frame};
  uint8_t places[4];
  tw_error_normal(p, face, base.normal);
  tw_error_find_frame(p, face, base.normal, &frame);
  for (int i = 0; i < 4; i++) base.corners[i] = tw_point_at(p->shown, quad[i]);
  tw_error_begin_base(&base, places);
  return tw_error_of_limits(&base, n, places);
}

/* Lowers the distances of a face's children and of theirs, where these are more than is enough: by second
 * differences, and by limit points where that is too much. normal, reach: of the face; slope: of the faces
 * around it.
 * The children's points slide over those of the faces around too, of which the slope is not known where these
 * lie at an irregular point. It need not be. Seen along the normal, what slides out of the face lies between
 * the chord of a side and the side's limit curve. Over the chord the patch's own slope counts; the curve is
 * the neighbour's as well, which counts how far it is from its own triangles. Between them that triangle is
 * flat, and so is the patch, over so short a way: its distance is at most the greater of both. What is told
 * is the greatest of all faces. */
static void look_at_children(const tw_error_net *n, const double normal[3], double slope, double reach,
                             const double enough[TW_ERROR_LOOKED], double errors[TW_ERROR_LOOKED]) {
  tw_error_net quarters[4];
  tw_offset own[4];
  double most = 0, after = 0, allowed = INFINITY;
  if (errors[1] <= enough[1] && errors[2] <= enough[2]) return;
  split_net(n, quarters);
  for (int i = 0; i < 4; i++) {
    own[i] = offset_of_limits(&quarters[i], normal);
    allowed = tw_lesser(allowed, (tw_lesser(enough[1], 4 * enough[2]) - own[i].normal) / own[i].slide);
  }
  slope = tw_greater(slope, closer_slope(n, normal, tw_greater(slope, allowed)));
  for (int i = 0; i < 4; i++) {
    double slid = tw_lesser(own[i].whole, own[i].normal + slope * own[i].slide),
           error = isfinite(slope) && own[i].slide <= reach / 2 ? slid : own[i].whole;
    after = tw_greater(after, (isfinite(slope) && own[i].slide <= reach ? slid : own[i].whole) / 4);
    if (error > enough[1]) error = tw_lesser(error, error_of_limit(&quarters[i], normal, slope, reach / 2));
    most = tw_greater(most, error);
  }
  errors[1] = tw_lesser(errors[1], most);
  errors[2] = tw_lesser(errors[2], after);
}

/* Looks at the limit points of a face of control points, and at those of its children, whose second
 * differences are a quarter. */
static void look_at_control(const tw_error_net *n, const double enough[TW_ERROR_LOOKED],
                            double errors[TW_ERROR_LOOKED]) {
  tw_error_net quarters[4];
  double most = 0;
  if (errors[0] > enough[0]) errors[0] = tw_lesser(errors[0], error_of_control(n));
  if (errors[1] > enough[1]) {
    split_net(n, quarters);
    for (int i = 0; i < 4 && most < errors[1]; i++) most = tw_greater(most, error_of_control(&quarters[i]));
    errors[1] = tw_lesser(errors[1], most);
  }
}

void tw_error_look_closely(const tw_error_part *p, uint32_t face, double enough, tw_face_measure *own) {
  tw_error_net n;
  double normal[3];
  tw_error_normal(p, face, normal);
  if (!find_net(p, face, &n)) return;
  double slope = find_slope(&n, normal, tw_error_slope_around(p, face, normal), &own->offset, enough);
  if (isfinite(slope)) lower(slid_deviation(p, face, &n, false, normal, &own->offset, slope), own->errors);
}

void tw_error_look_all_over(const tw_error_part *p, uint32_t face, const double enough[TW_ERROR_LOOKED],
                            tw_face_measure *own) {
  double *errors = own->errors, normal[3];
  tw_error_net n;
  if (p->shown == p->control) {
    if (own->is_plain && find_net(p, face, &n)) look_at_control(&n, enough, errors);
    return;
  }
  if (!find_net(p, face, &n)) return;
  if (errors[0] > enough[0]) errors[0] = tw_lesser(errors[0], error_of_shown(p, face, &n));
  tw_error_normal(p, face, normal);
  double slope =
      own->is_plain ? tw_error_slope_around(p, face, normal) : INFINITY; /* at rims nothing slides */
  look_at_children(&n, normal, slope, tw_error_reach(p, face), enough, errors);
}

/* The deviation of control points, where points slide over the faces around. */
static void look_at_slides(const tw_error_net *n, const double enough[TW_ERROR_LOOKED],
                           double errors[TW_ERROR_LOOKED]) {
  tw_error_frame frame;
  double normal[3], usual, slope = find_frame(n, normal, &frame);
  bend bends[KINDS];
  for (int kind = 0; kind < KINDS; kind++) bends[kind] = find_bend(n, kind, normal);
  const tw_offset most = deviation(bends, false, normal, &usual);
  slope = find_slope(n, normal, slope, &most, tw_lesser(enough[0], tw_lesser(4 * enough[1], 16 * enough[2])));
  lower(most.whole, errors);
  if (isfinite(slope)) lower(most.normal + slope * most.slide, errors);
}

void tw_error_look_at_net(const tw_error_net *n, bool limit, const double enough[TW_ERROR_LOOKED],
                          double errors[TW_ERROR_LOOKED]) {
  if (!limit) {
    look_at_slides(n, enough, errors);
    look_at_control(n, enough, errors);
    return;
  }
  tw_error_frame frame;
  double normal[3], slope = find_frame(n, normal, &frame);
  if (errors[0] > enough[0])
    errors[0] =
        tw_lesser(errors[0], error_of_limit(n, normal, tw_greater(slope, closer_slope(n, normal, slope)),
                                            (double)frame.reach));
  look_at_children(n, normal, slope, (double)frame.reach, enough, errors);
}

/* ---- patches around irregular points ----------------------------------------------------------- */

/* The derivatives in the middle of a patch. */
static void find_middle(const tw_error_net *n, double along_u[3], double along_v[3]) {
  static const double steps[4] = {-1. / 8, -5. / 8, 5. / 8, 1. / 8},
                      sums[4] = {1. / 48, 23. / 48, 23. / 48, 1. / 48};
  memset(along_u, 0, sizeof(double[3]));
  memset(along_v, 0, sizeof(double[3]));
  for (int v = 0; v < 4; v++)
    for (int u = 0; u < 4; u++)
      for (int c = 0; c < 3; c++) {
        along_u[c] += sums[v] * steps[u] * n->points[v][u][c];
        along_v[c] += steps[v] * sums[u] * n->points[v][u][c];
      }
}

/* How thick the points of a net lie along the third axis, over a plane that follows the patch. */
static double thickness(const tw_error_net *n, const double u[3], const double v[3]) {
  double area = u[0] * v[1] - u[1] * v[0], low = INFINITY, high = -INFINITY;
  double x = (u[2] * v[1] - u[1] * v[2]) / area, y = (u[0] * v[2] - u[2] * v[0]) / area;
  if (!(area > 0)) return INFINITY;
  for (int i = 0; i < 16; i++) {
    const double *at = n->points[i / 4][i % 4];
    double height = at[2] - x * at[0] - y * at[1];
    low = tw_lesser(low, height);
    high = tw_greater(high, height);
  }
  return high - low;
}

double tw_error_of_net(const tw_error_net *n, bool limit, double *hull) {
  double u[3], v[3], d[9][3], squares[KINDS] = {0};
  for (int kind = 0; kind < KINDS; kind++) {
    int count = find_differences(n, kind, d);
    for (int i = 0; i < count; i++) squares[kind] = tw_greater(squares[kind], tw_dot3(d[i], d[i]));
  }
  find_middle(n, u, v);
  *hull = thickness(n, u, v);
  return plain_deviation(limit, sqrt(squares[ALONG_U]), sqrt(squares[ALONG_V]), sqrt(squares[MIXED]));
}
