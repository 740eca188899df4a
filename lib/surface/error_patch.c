/* Regular faces: one measure holds for a face's own level and for all deeper ones (surface_error.c, 1). */
#include <string.h>

#include "surface_error.h"

/* One kind of second differences of a net: their mean, how far others are from it, and the greatest. */
typedef struct bend {
  double mean[3];
  tw_offset spread, greatest;
} bend;

static bend find_bend(const tw_error_net *n, int kind, const double normal[3]) {
  double d[9][3];
  int count = tw_error_find_differences(n, kind, d);
  bend out = {0};
  for (int i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) out.mean[c] += d[i][c] / count;
  out.greatest = tw_error_find_greatest(d, count, normal);
  for (int i = 0; i < count; i++) tw_difference3(d[i], out.mean, d[i]);
  out.spread = tw_error_find_greatest(d, count, normal);
  return out;
}

/* a u + b v + c m of the means, which is near that of all points of the patch. */
static void mix_means(const bend bends[TW_ERROR_KINDS], double a, double b, double c, double out[3]) {
  for (int i = 0; i < 3; i++)
    out[i] = a * bends[TW_ERROR_ALONG_U].mean[i] + b * bends[TW_ERROR_ALONG_V].mean[i] +
             c * bends[TW_ERROR_MIXED].mean[i];
}

static tw_offset mix(const bend bends[TW_ERROR_KINDS], double a, double b, double c, const double normal[3]) {
  double sum[3];
  mix_means(bends, a, b, c, sum);
  return tw_offset_split(sum, normal);
}

static tw_offset add_spreads(const bend bends[TW_ERROR_KINDS], double a, double b, double c, tw_offset to) {
  const tw_offset *u = &bends[TW_ERROR_ALONG_U].spread, *v = &bends[TW_ERROR_ALONG_V].spread,
                  *m = &bends[TW_ERROR_MIXED].spread;
  return (tw_offset){to.normal + a * u->normal + b * v->normal + c * m->normal,
                     to.slide + a * u->slide + b * v->slide + c * m->slide,
                     to.whole + a * u->whole + b * v->whole + c * m->whole};
}

/* The difference between the surface and triangles of its control points. It is convex in u (1 - u), v (1 -
 * v) and the mixed difference's weight, so it is greatest where these are. */
static tw_offset control_deviation(const bend bends[TW_ERROR_KINDS], const double normal[3]) {
  static const double ends[][3] = {{1. / 6, 1. / 6, 0},        {1. / 24, 1. / 6, 0},
                                   {1. / 6, 1. / 24, 0},       {1. / 24, 1. / 24, 0},
                                   {1. / 24, 1. / 6, 1. / 8},  {1. / 24, 1. / 6, -1. / 8},
                                   {1. / 6, 1. / 24, 1. / 8},  {1. / 6, 1. / 24, -1. / 8},
                                   {1. / 24, 1. / 24, 1. / 4}, {1. / 24, 1. / 24, -1. / 4}};
  enum { ENDS = sizeof ends / sizeof *ends };
  double at[ENDS][3];
  for (int i = 0; i < ENDS; i++) mix_means(bends, ends[i][0], ends[i][1], ends[i][2], at[i]);
  return tw_error_find_greatest(at, ENDS, normal);
}

/* The greatest l1 l2 a + l2 l3 b + l3 l1 c of weights of sum 1, halved: the square of a circumradius. */
static double interpolation_error(double a, double b, double c) {
  double most = tw_greater(a, tw_greater(b, c)), area = 2 * (a * b + b * c + c * a) - (a * a + b * b + c * c);
  if (2 * most >= a + b + c || !(area > 0)) return most / 8;
  return tw_greater(most / 8, a * b * c / area / 2);
}

/* The difference between the surface and triangles of its own points: along each side of a triangle it bends
 * by the second differences in that direction. */
static tw_offset limit_deviation(const bend bends[TW_ERROR_KINDS], bool spread, const double normal[3]) {
  tw_offset u = mix(bends, 1, 0, 0, normal), v = mix(bends, 0, 1, 0, normal),
            diagonal = mix(bends, 1, 1, 2, normal), other = mix(bends, 1, 1, -2, normal);
  tw_offset_widen(&diagonal, &other);
  if (spread) {
    u = add_spreads(bends, 1, 0, 0, u);
    v = add_spreads(bends, 0, 1, 0, v);
    diagonal = add_spreads(bends, 1, 1, 2, diagonal);
  }
  return (tw_offset){interpolation_error(u.normal, v.normal, diagonal.normal),
                     interpolation_error(u.slide, v.slide, diagonal.slide),
                     interpolation_error(u.whole, v.whole, diagonal.whole)};
}

/* The greatest difference. *usual: along the normal, if second differences were their means everywhere. */
static tw_offset deviation(const bend bends[TW_ERROR_KINDS], bool limit, const double normal[3],
                           double *usual) {
  tw_offset by_means = limit ? limit_deviation(bends, false, normal) : control_deviation(bends, normal);
  *usual = by_means.normal;
  by_means =
      limit ? limit_deviation(bends, true, normal) : add_spreads(bends, 1. / 6, 1. / 6, 1. / 4, by_means);
  const tw_offset *u = &bends[TW_ERROR_ALONG_U].greatest, *v = &bends[TW_ERROR_ALONG_V].greatest,
                  *m = &bends[TW_ERROR_MIXED].greatest;
  return (tw_offset){
      tw_lesser(by_means.normal, tw_error_plain_deviation(limit, u->normal, v->normal, m->normal)),
      tw_lesser(by_means.slide, tw_error_plain_deviation(limit, u->slide, v->slide, m->slide)),
      tw_lesser(by_means.whole, tw_error_plain_deviation(limit, u->whole, v->whole, m->whole))};
}

/* A patch's directions along u and v, in the plane across the normal: their means, how far others are from
 * these, and their greatest heights. */
typedef struct directions {
  double mean[2][3], spread[2], height[2];
} directions;

static directions find_directions(const tw_error_net *n, const double normal[3]) {
  enum { LINES = 4, STEPS = 3 };
  directions out = {0};
  for (int axis = 0; axis < 2; axis++) {
    double d[LINES * STEPS][3], height = 0, square = 0;
    for (int i = 0; i < LINES * STEPS; i++) {
      int line = i / STEPS, place = i % STEPS;
      tw_difference3(tw_error_net_step(n, axis, line, place + 1), tw_error_net_step(n, axis, line, place),
                     d[i]);
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

/* The distance between the sides of a face that are rims, where nothing slides, and their limit curves. ends:
 * only of sides at which the surface ends, not of sharp edges between two faces. */
static double rim_deviation(const tw_error_part *p, uint32_t face, const tw_error_net *n, bool limit,
                            bool ends) {
  const tw_topology *t = &p->topology;
  double most = 0;
  for (int side = 0; side < 4; side++) {
    uint32_t edge = t->corner_edge[tw_face_begin(t, face) + (uint32_t)side];
    if (ends ? !tw_error_is_end(p, edge) : !tw_error_is_rim(p, edge)) continue;
    most = tw_greater(most, tw_error_of_side(n, side, limit));
  }
  return most;
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

static tw_face_measure measure_patch(const tw_error_part *p, uint32_t face, const tw_error_net *n,
                                     bool limit) {
  tw_face_measure out = {.fall = 0.25F};
  double normal[3], step = 0;
  bend bends[TW_ERROR_KINDS];
  tw_error_normal(p, face, normal);
  for (int kind = 0; kind < TW_ERROR_KINDS; kind++) bends[kind] = find_bend(n, kind, normal);
  const tw_offset most = deviation(bends, limit, normal, &out.usual);
  double slope = tw_dot3(normal, normal) > 0 ? patch_slope(n, normal, &step) : INFINITY;
  if (isfinite(slope) && most.slide <= step / 2)
    slope = tw_greater(slope, tw_error_slope_around(p, face, normal));
  out.error = out.whole = most.whole;
  if (isfinite(slope) && most.slide <= step / 2)
    out.error = tw_lesser(most.whole, slid_deviation(p, face, n, limit, normal, &most, slope));
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
  return (tw_face_measure){.error = error / 4, .whole = m.whole / 4, .usual = INFINITY, .fall = 0.25F};
}

tw_face_measure tw_error_of_patch(const tw_measuring *m, const tw_error_part *p, uint32_t face) {
  tw_error_net n;
  if (m->rules.linear && tw_face_size(&p->topology, face) == 4) return measure_bilinear(p, face);
  if (m->rules.loop || m->rules.linear || !tw_error_find_net(p, face, &n))
    return (tw_face_measure){.error = -1};
  return measure_patch(p, face, &n, m->options->limit);
}
