/* From derivatives to tangents, in double: products of small derivatives would vanish in float. */
#include "tangents.h"

#include <math.h>

bool tw_uv_is_mirrored(const tw_topology *uv, const float *values, uint32_t face) {
  uint32_t begin = tw_face_begin(uv, face), size = tw_face_size(uv, face);
  const float *origin = values + 2 * (size_t)uv->corner_vertex[begin];
  double area = 0;
  for (uint32_t i = 1; i + 1 < size; i++) {
    const float *a = values + 2 * (size_t)uv->corner_vertex[begin + i],
                *b = values + 2 * (size_t)uv->corner_vertex[begin + i + 1];
    area += ((double)a[0] - (double)origin[0]) * ((double)b[1] - (double)origin[1]) -
            ((double)a[1] - (double)origin[1]) * ((double)b[0] - (double)origin[0]);
  }
  return area < 0;
}

static double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Less than a millionth of a length is rounding. */
static const double negligible = 1e-12;

/* The part of `along` in the plane of the normal, at unit length; false where nothing is left. */
static bool flatten(const double normal[3], const double along[3], float out[4]) {
  double length = dot(along, along), out_of_plane = dot(normal, along), flat[3];
  for (int c = 0; c < 3; c++) flat[c] = along[c] - out_of_plane * normal[c];
  double square = dot(flat, flat);
  if (!(square > negligible * length)) return false;
  /* Once more: what the first time left out of plane is large beside a short remainder. */
  out_of_plane = dot(normal, flat);
  for (int c = 0; c < 3; c++) flat[c] -= out_of_plane * normal[c];
  square = dot(flat, flat);
  for (int c = 0; c < 3; c++) out[c] = (float)(flat[c] / sqrt(square));
  return true;
}

/* first a + second b; false where that is nothing beside its terms. */
static bool combine(const double a[3], double first, const double b[3], double second, double out[3]) {
  for (int c = 0; c < 3; c++) out[c] = first * a[c] + second * b[c];
  double terms = first * first * dot(a, a) + second * second * dot(b, b);
  return terms > 0 && dot(out, out) > negligible * terms;
}

static void lean_on_axis(const double normal[3], float out[4]) {
  int farthest = 0;
  for (int c = 1; c < 3; c++)
    if (fabs(normal[c]) < fabs(normal[farthest])) farthest = c;
  double axis[3] = {0, 0, 0};
  axis[farthest] = 1;
  flatten(normal, axis, out);
}

void tw_tangent_from_derivatives(const float normal[3], const float points[TW_DERIVATIVE_WIDTH],
                                 const float uvs[TW_DERIVATIVE_WIDTH], bool mirrored, float out[4]) {
  double n[3], a[3], b[3], along[3];
  for (int c = 0; c < 3; c++) {
    n[c] = (double)normal[c];
    a[c] = (double)points[c];
    b[c] = (double)points[TW_DERIVATIVE_SECOND + c];
  }
  double ua = (double)uvs[0], va = (double)uvs[1];
  double ub = (double)uvs[TW_DERIVATIVE_SECOND], vb = (double)uvs[TW_DERIVATIVE_SECOND + 1];
  double sign = mirrored ? -1 : 1;
  out[3] = (float)sign;
  /* Along this v stands still, and u grows by the UVs' area: the sign is that of the whole face, so that
   * tangents do not turn back where the map folds over within it. */
  bool v_grows = va * va + vb * vb > negligible * (ua * ua + ub * ub);
  if (v_grows && combine(a, sign * vb, b, -sign * va, along) && flatten(n, along, out)) return;
  if (combine(a, ua, b, ub, along) && flatten(n, along, out)) return;
  if (!flatten(n, a, out)) lean_on_axis(n, out);
}
