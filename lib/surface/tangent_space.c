/* From derivatives to tangents, in double: products of small derivatives would underflow in float. */
#include "tangent_space.h"

#include <math.h>
#include <string.h>

#include "vector3.h"

/* ---- derivatives ----------------------------------------------------------------------------- */

void tw_patch_slopes(const tw_slope_source *source, uint32_t quad, tw_patch_rect rect, bool backwards,
                     double *scratch, float *out) {
  tw_patch_job job = {.in = source->values,
                      .width = source->width,
                      .backwards = backwards,
                      .derivatives = out,
                      .stride = TW_DERIVATIVE_WIDTH,
                      .scratch = scratch};
  tw_patch_evaluate(source->patches, quad, &job, rect);
}

void tw_corner_slopes(const tw_slope_source *source, uint32_t corner, tw_last_mask *last, float *out) {
  tw_limit_entry sides[2];
  float frame[2][2];
  bool framed = tw_slope_frame(source->topology, source->linear, corner, frame, sides);
  uint32_t width = source->width,
           count = framed ? tw_limit_mask_after(last, source->topology, source->linear, corner) : 2;
  const tw_limit_entry *mask = framed ? last->entries : sides;
  const float *own = source->values + (size_t)source->topology->corner_vertex[corner] * width;
  memset(out, 0, TW_DERIVATIVE_WIDTH * sizeof *out);
  for (uint32_t e = 0; e < count; e++) {
    const float *value = source->values + (size_t)mask[e].vertex * width;
    float first = frame[0][0] * mask[e].tangent1 + frame[0][1] * mask[e].tangent2,
          second = frame[1][0] * mask[e].tangent1 + frame[1][1] * mask[e].tangent2;
    for (uint32_t c = 0; c < width; c++) {
      out[c] += first * (value[c] - own[c]);
      out[TW_DERIVATIVE_SECOND + c] += second * (value[c] - own[c]);
    }
  }
}

/* ---- tangents -------------------------------------------------------------------------------- */

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

/* Squared ratio below which a length is rounding: a millionth of another length. */
static const double negligible = 1e-12;

/* The part of `along` in the plane of the normal, at unit length; false where nothing is left of it. */
static bool flatten(const double normal[3], const double along[3], float out[4]) {
  double length = tw_dot3(along, along), out_of_plane = tw_dot3(normal, along), flat[3];
  for (int c = 0; c < 3; c++) flat[c] = along[c] - out_of_plane * normal[c];
  double square = tw_dot3(flat, flat);
  if (!(square > negligible * length)) return false;
  /* Again: the rounding error of the first time is large beside a short remainder. */
  out_of_plane = tw_dot3(normal, flat);
  for (int c = 0; c < 3; c++) flat[c] -= out_of_plane * normal[c];
  square = tw_dot3(flat, flat);
  for (int c = 0; c < 3; c++) out[c] = (float)(flat[c] / sqrt(square));
  return true;
}

/* out = first a + second b; false where the terms cancel or are 0. */
static bool combine(const double a[3], double first, const double b[3], double second, double out[3]) {
  for (int c = 0; c < 3; c++) out[c] = first * a[c] + second * b[c];
  double terms = first * first * tw_dot3(a, a) + second * second * tw_dot3(b, b);
  return terms > 0 && tw_dot3(out, out) > negligible * terms;
}

/* A tangent along the axis at the greatest angle to the normal. */
static void tangent_along_axis(const double normal[3], float out[4]) {
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
  /* In this direction v is constant, and u grows by the area of the UV map. The sign is the whole face's, so
   * that tangents do not flip where the UV map folds within the face. */
  bool v_grows = va * va + vb * vb > negligible * (ua * ua + ub * ub);
  if (v_grows && combine(a, sign * vb, b, -sign * va, along) && flatten(n, along, out)) return;
  if (combine(a, ua, b, ub, along) && flatten(n, along, out)) return;
  if (!flatten(n, a, out)) tangent_along_axis(n, out);
}

void tw_write_tangents(const float *points, const float *uvs, const uint8_t *frames, size_t count,
                       tw_tangent_columns out) {
  for (size_t i = 0; i < count; i++, out.normals += out.stride, out.tangents += out.stride) {
    size_t place = TW_DERIVATIVE_WIDTH * i;
    tw_tangent_from_derivatives(out.normals, points + place, uvs + place, frames[i] % 2, out.tangents);
  }
}
