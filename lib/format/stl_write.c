/* Facets of binary STL: the normal, three points, two bytes of nothing. A point is the same bytes in all
 * facets that meet there. */
#include "flat.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void tw_stl_put_head(const tw_flat_scene *flat, const char *unit, uint64_t triangles, uint8_t *out) {
  char text[TW_STL_HEAD + 1] = "";
  uint32_t count = (uint32_t)triangles;
  int length = snprintf(text, sizeof text, "tweend %s, unit: %s", tw_version(), unit);
  if (flat->is_moved)
    snprintf(text + length, sizeof text - (size_t)length, ", moved by %.9g %.9g %.9g", -flat->origin[0],
             -flat->origin[1], -flat->origin[2]);
  memset(out, 0, TW_STL_HEAD);
  memcpy(out, text, strnlen(text, TW_STL_HEAD - sizeof count));
  memcpy(out + TW_STL_HEAD - sizeof count, &count, sizeof count);
}

/* The unit normal of a facet; 0 0 0 where it has no area. */
static void normal_of(const float *a, const float *b, const float *c, float out[3]) {
  double u[3], v[3], n[3];
  for (int i = 0; i < 3; i++) {
    u[i] = (double)b[i] - (double)a[i];
    v[i] = (double)c[i] - (double)a[i];
  }
  n[0] = u[1] * v[2] - u[2] * v[1];
  n[1] = u[2] * v[0] - u[0] * v[2];
  n[2] = u[0] * v[1] - u[1] * v[0];
  double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], shrink = square > 0 ? 1 / sqrt(square) : 0;
  for (int i = 0; i < 3; i++) out[i] = (float)(n[i] * shrink) + 0.0f;
}

uint32_t tw_stl_put_facets(tw_flat_tools *tools, const tw_flat_part *part, uint64_t first, uint64_t most,
                           uint8_t *out) {
  uint32_t count = tw_flat_read_triangles(tools, part, first, most);
  const uint32_t *places = tools->places[0], second = part->is_mirrored ? 2 : 1;
  const float *values = tools->points.values;
  for (uint32_t i = 0; i < count; i++, places += 3, out += TW_STL_FACET) {
    const float *a = values + 3 * (size_t)places[0], *b = values + 3 * (size_t)places[second],
                *c = values + 3 * (size_t)places[3 - second];
    float normal[3];
    normal_of(a, b, c, normal);
    memcpy(out, normal, sizeof normal);
    memcpy(out + 12, a, 12);
    memcpy(out + 24, b, 12);
    memcpy(out + 36, c, 12);
    out[48] = out[49] = 0;
  }
  return count;
}
