/* A closer look at regular faces whose points slide far along the surface, as they do around irregular points
 * (surface_error.c, 4). */
#include <string.h>

#include "surface_error.h"

enum {
  PARTS = 4,                   /* of a face's side, at which its limit surface is looked at */
  SPLITS = TW_ERROR_LOOKED - 2 /* deeper levels that are looked at */
};

/* The limit points of a face all over it: [v][u]. */
static void find_lattice(const tw_error_net *n, double out[PARTS + 1][PARTS + 1][3]) {
  static const double shares[PARTS + 1][4] = {{64. / 384, 256. / 384, 64. / 384, 0},
                                              {27. / 384, 235. / 384, 121. / 384, 1. / 384},
                                              {8. / 384, 184. / 384, 184. / 384, 8. / 384},
                                              {1. / 384, 121. / 384, 235. / 384, 27. / 384},
                                              {0, 64. / 384, 256. / 384, 64. / 384}};
  for (int u = 0; u <= PARTS; u++) {
    double line[4][3];
    for (int v = 0; v < 4; v++)
      for (int c = 0; c < 3; c++)
        line[v][c] = shares[u][0] * n->points[v][0][c] + shares[u][1] * n->points[v][1][c] +
                     shares[u][2] * n->points[v][2][c] + shares[u][3] * n->points[v][3][c];
    for (int v = 0; v <= PARTS; v++)
      for (int c = 0; c < 3; c++)
        out[v][u][c] = shares[v][0] * line[0][c] + shares[v][1] * line[1][c] + shares[v][2] * line[2][c] +
                       shares[v][3] * line[3][c];
  }
}

/* The least cosine between a normal and those of a quad's four triangles, squared with its sign. */
static double quad_cosine(const double *quad[4], const double normal[3]) {
  double sides[4][3], across[3], least = 1;
  for (int i = 0; i < 4; i++) tw_difference3(quad[(i + 1) % 4], quad[i], sides[i]);
  for (int i = 0; i < 4; i++) {
    tw_cross3(sides[(i + 3) % 4], sides[i], across);
    double height = tw_dot3(across, normal), square = tw_dot3(across, across);
    if (height * fabs(height) < least * square) least = height * fabs(height) / square;
  }
  return least;
}

/* The corners of a patch's face. */
static void find_face(const tw_error_net *n, double out[4][3]) {
  static const int places[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}; /* v, u */
  for (int i = 0; i < 4; i++) memcpy(out[i], n->points[places[i][0]][places[i][1]], sizeof out[i]);
}

/* A regular face, and what is known of it before the closer look. */
typedef struct patch {
  tw_error_net net;
  bool corner_rims[4], side_rims[4]; /* where nothing may slide beyond */
  double error;                      /* its distance, which deeper levels have a quarter of */
  double hull;                       /* the most that it and they have */
} patch;

/* The face, and how far points may slide around it. *inside: the least cosine of faces on this side of rims.
 */
static void find_base(const patch *p, tw_error_base *out) {
  static const int places[4][2] = {{1, 1}, {1, 2}, {2, 2}, {2, 1}}, /* v, u */
      beside[4][2] = {{0, 1}, {1, 2}, {2, 1}, {1, 0}};
  double cosines[3][3], edge[3], sum = 0, face[4][3];
  *out = (tw_error_base){.size = 4, .around = 1};
  find_face(&p->net, face);
  tw_corners_normal(face[0], (const uint32_t[4]){0, 1, 2, 3}, 4, out->normal);
  for (int v = 0; v < 3; v++)
    for (int u = 0; u < 3; u++) {
      const double(*low)[3] = &p->net.points[v][u], (*high)[3] = &p->net.points[v + 1][u];
      double squared = quad_cosine((const double *[4]){low[0], low[1], high[1], high[0]}, out->normal);
      cosines[v][u] = squared > 0 ? sqrt(squared) : squared;
    }
  double own = cosines[1][1], inside = own;
  for (int i = 0; i < 4; i++) {
    int v = places[i][0], u = places[i][1];
    double side = p->side_rims[i] ? -1 : tw_lesser(own, cosines[beside[i][0]][beside[i][1]]);
    double corner = p->corner_rims[i] ? -1
                                      : tw_lesser(tw_lesser(cosines[v - 1][u - 1], cosines[v - 1][u]),
                                                  tw_lesser(cosines[v][u - 1], cosines[v][u]));
    if (!p->side_rims[i]) inside = tw_lesser(inside, side);
    if (!p->corner_rims[i]) inside = tw_lesser(inside, corner);
    if (p->corner_rims[i] && !p->side_rims[i] && !p->side_rims[(i + 3) % 4]) inside = -1;
    out->corners[i] = p->net.points[v][u];
    out->at_corner[i] = corner;
    out->at_edge[i] = side;
    out->around = tw_lesser(out->around, corner);
    tw_difference3(face[(i + 1) % 4], face[i], edge);
    sum += tw_length3(edge);
  }
  out->own = own;
  out->inside = inside;
  out->reach = own >= TW_LEAST_COSINE ? sum / 8 : 0;
}

/* The bits of a lattice's point. */
static uint8_t place_at(int u, int v) {
  const bool is_on[4] = {v == 0, u == PARTS, v == PARTS, u == 0},
             is_in[4] = {u >= v, u <= v, u + v >= PARTS, u + v <= PARTS};
  uint32_t bits = 0;
  for (int i = 0; i < 4; i++)
    bits |= (is_on[i] ? (uint32_t)TW_ERROR_ON_EDGE << i : 0) |
            (is_in[i] ? (uint32_t)TW_ERROR_IN_TRIANGLE << i : 0);
  return (uint8_t)bits;
}

/* The greatest slope of a patch and of all its levels: their derivatives along u and v are means of steps. */
static double slope_of_pairs(const tw_error_net *n, const double normal[3]) {
  enum { STEPS = 3, ALL = 4 * STEPS };
  double along_v[3][ALL], most = 1;
  for (int i = 0; i < ALL; i++)
    for (int c = 0; c < 3; c++)
      along_v[c][i] = tw_error_net_step(n, 1, i / STEPS, i % STEPS + 1)[c] -
                      tw_error_net_step(n, 1, i / STEPS, i % STEPS)[c];
  for (int i = 0; i < ALL; i++) {
    double u[3], heights[ALL], squares[ALL];
    tw_difference3(tw_error_net_step(n, 0, i / STEPS, i % STEPS + 1),
                   tw_error_net_step(n, 0, i / STEPS, i % STEPS), u);
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

/* The greatest difference between a patch and its face, or triangles of limit points, by its greatest second
 * differences. */
static tw_offset difference_of(const tw_offset bends[TW_ERROR_KINDS], bool limit, double share) {
  const tw_offset *u = &bends[TW_ERROR_ALONG_U], *v = &bends[TW_ERROR_ALONG_V], *m = &bends[TW_ERROR_MIXED];
  return (tw_offset){share * tw_error_plain_deviation(limit, u->normal, v->normal, m->normal),
                     share * tw_error_plain_deviation(limit, u->slide, v->slide, m->slide),
                     share * tw_error_plain_deviation(limit, u->whole, v->whole, m->whole)};
}

/* The difference where points slide, but for those of rims. */
static double slid(const patch *p, const tw_offset *o, bool limit, double share, double slope, double reach) {
  double rims = 0;
  if (!isfinite(slope) || o->slide > reach) return o->whole;
  for (int i = 0; i < 4; i++)
    if (p->side_rims[i]) rims = tw_greater(rims, share * tw_error_of_side(&p->net, i, limit));
  return tw_lesser(o->whole, tw_greater(rims, o->normal + slope * o->slide));
}

/* The distance between a face and its limit: that of limit points all over it from the triangle that each
 * comes from, and how far the surface is from triangles of these points. Lowers what is known of deeper
 * levels, unless that is at most `enough`. */
static double look(patch *p, double enough) {
  const double share = 1. / (PARTS * PARTS);
  double lattice[PARTS + 1][PARTS + 1][3], d[9][3];
  tw_error_base base;
  tw_offset bends[TW_ERROR_KINDS];
  find_base(p, &base);
  find_lattice(&p->net, lattice);
  tw_error_gap gap = tw_error_gap_from(&base);
  for (int v = 0; v <= PARTS; v++)
    for (int u = 0; u <= PARTS; u++) tw_error_take_point(&base, &gap, place_at(u, v), lattice[v][u]);
  for (int kind = 0; kind < TW_ERROR_KINDS; kind++)
    bends[kind] = tw_error_find_greatest(d, tw_error_find_differences(&p->net, kind, d), base.normal);
  const tw_offset rest = difference_of(bends, true, share), all = difference_of(bends, false, 1);
  double own = gap.size + slid(p, &rest, true, share, tw_error_slope(base.inside), gap.reach);
  if (tw_lesser(p->error / 4, p->hull) > enough && base.inside >= TW_LEAST_COSINE)
    p->error = tw_lesser(p->error, slid(p, &all, false, 1, slope_of_pairs(&p->net, base.normal), gap.reach));
  return own;
}

static void split_patch(const patch *p, patch out[4]) {
  static const int quarters[4] = {0, 1, 3, 2}; /* at the corners */
  tw_error_net nets[4];
  tw_error_split_net(&p->net, nets);
  for (int i = 0; i < 4; i++) {
    int next = (i + 1) % 4, before = (i + 3) % 4;
    patch *own = &out[i];
    *own = (patch){.net = nets[quarters[i]], .error = p->error / 4, .hull = p->hull};
    own->corner_rims[i] = p->corner_rims[i];
    own->corner_rims[next] = own->side_rims[i] = p->side_rims[i];
    own->corner_rims[before] = own->side_rims[before] = p->side_rims[before];
  }
}

/* Raises the distances of a patch on its own level and deeper ones. enough: what is less is looked at no
 * further. splits: how many deeper levels are looked at; levels below these have a quarter of what was known
 * before the look, as that tells of one level alone. */
static void take_patch(patch *p, const double *enough, double *errors, uint32_t count, int splits) {
  double own = tw_lesser(p->error, p->hull);
  double deeper = count > 1 ? tw_greater(enough[1], errors[1]) : INFINITY;
  if (own > tw_greater(enough[0], errors[0])) own = tw_lesser(own, look(p, deeper));
  errors[0] = tw_greater(errors[0], own);
  if (splits > 0 && tw_lesser(p->error / 4, p->hull) > deeper) {
    patch quarters[4];
    split_patch(p, quarters);
    for (int i = 0; i < 4; i++) take_patch(&quarters[i], enough + 1, errors + 1, count - 1, splits - 1);
    return;
  }
  double error = p->error;
  for (uint32_t k = 1; k < count && (error > p->hull || k == 1); k++) {
    error /= 4;
    errors[k] = tw_greater(errors[k], tw_lesser(error, p->hull));
  }
}

void tw_error_look_closely(const tw_error_part *p, uint32_t face, const double *enough,
                           tw_face_measure *own) {
  uint32_t begin = tw_face_begin(&p->topology, face);
  patch of_face = {.error = own->error, .hull = INFINITY};
  double next = 0;
  if (!tw_error_find_net(p, face, &of_face.net)) return;
  for (uint32_t i = 0; i < 4; i++) {
    of_face.corner_rims[i] = p->is_rim[p->topology.corner_vertex[begin + i]];
    of_face.side_rims[i] = tw_error_is_rim(p, p->topology.corner_edge[begin + i]);
  }
  memset(own->closely, 0, sizeof own->closely);
  take_patch(&of_face, enough, own->closely, TW_ERROR_LOOKED, SPLITS);
  own->is_close = true;
  own->error = 0;
  for (int i = TW_ERROR_LOOKED; i-- > 0;
       next = own->error) { /* so that no level is farther than the one before */
    own->error = tw_greater(own->error, own->closely[i]);
    if (next > 0)
      own->fall = (float)tw_lesser(1, tw_greater((double)own->fall, next / own->error * (1 + 1e-6)));
  }
}

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

void tw_error_take_net(const tw_error_net *n, bool limit, bool graph, const double *enough, double *errors,
                       uint32_t count) {
  double u[3], v[3], d[9][3], squares[TW_ERROR_KINDS] = {0};
  for (int kind = 0; kind < TW_ERROR_KINDS; kind++) {
    int differences = tw_error_find_differences(n, kind, d);
    for (int i = 0; i < differences; i++) squares[kind] = tw_greater(squares[kind], tw_dot3(d[i], d[i]));
  }
  find_middle(n, u, v);
  patch p = {.net = *n, .hull = graph ? thickness(n, u, v) : INFINITY};
  p.error = tw_error_plain_deviation(limit, sqrt(squares[TW_ERROR_ALONG_U]), sqrt(squares[TW_ERROR_ALONG_V]),
                                     sqrt(squares[TW_ERROR_MIXED]));
  take_patch(&p, enough, errors, count, limit ? 0 : SPLITS);
}
