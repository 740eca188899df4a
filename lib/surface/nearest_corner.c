/* Whole numbers, which name things and so are never mixed: a point of any level has those of the nearest
 * corner of its face in the cage. A face whose corners agree keeps its number everywhere. */
#include <string.h>

#include "surface.h"

enum { AT_ONCE = 256 }; /* faces that are read together */

static uint32_t origin_of(const tw_surface *s, uint32_t base_face) {
  return s->origins ? s->origins[base_face] : base_face;
}

/* Replaces a triangle's barycentric coordinates, in units of 1 / 2^levels of the cage's, by those of a child
 * (loop.h) in units of half the size. */
static void take_child(uint32_t child, uint32_t corners[3][3]) {
  uint32_t out[3][3];
  for (uint32_t i = 0; i < 3; i++) {
    /* The middle's corner i is opposite to child i; other children have middles of the sides at `child`. */
    uint32_t a = child == 3 ? (i + 1) % 3 : child, b = child == 3 ? (i + 2) % 3 : i;
    for (int k = 0; k < 3; k++) out[i][k] = corners[a][k] + corners[b][k];
  }
  memcpy(corners, out, sizeof out);
}

/* The nearest corner of a cage triangle to a corner of one of its descendants. face: its number. */
static uint32_t nearest_in_triangle(uint32_t face, uint32_t corner, uint32_t levels) {
  uint32_t at[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, nearest = 0;
  for (uint32_t level = levels; level-- > 0;) take_child(face >> 2 * level & 3, at);
  for (uint32_t k = 1; k < 3; k++)
    if (at[corner][k] > at[corner][nearest]) nearest = k;
  return 3 * (face >> 2 * levels) + nearest;
}

uint32_t tw_nearest_corner(const tw_surface *surface, uint32_t base_corner) {
  const tw_surface *s = surface;
  uint32_t levels = s->base_level;
  if (levels == 0) return base_corner;
  if (s->rules.loop) return nearest_in_triangle(origin_of(s, base_corner / 3), base_corner % 3, levels);
  /* A face of the first level lies at one corner of the cage and has its number. */
  return origin_of(s, base_corner / 4) >> 2 * (levels - 1);
}

/* The corner of a quad of the base that is nearest to a point of its patch. */
static uint32_t corner_in_quad(const tw_surface *s, uint32_t i, uint32_t j) {
  bool right = 2 * i > s->side, upper = 2 * j > s->side;
  return upper ? (right ? 2 : 3) : (right ? 1 : 0);
}

void tw_nearest_values(const tw_surface *surface, const tw_values *values, uint32_t quad, tw_patch_rect rect,
                       bool backwards, float *out, uint32_t stride) {
  size_t count = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1), place = 0, width = values->width;
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1; i++, place++) {
      uint32_t corner = tw_nearest_corner(surface, 4 * quad + corner_in_quad(surface, i, j));
      float *to = out + (backwards ? count - 1 - place : place) * stride;
      memcpy(to, values->at_corners + width * corner, width * sizeof *to);
    }
}

tw_status tw_nearest_fill(const tw_surface *surface, tw_values *values) {
  const tw_shallow *levels = &surface->levels[values->field];
  uint32_t faces[AT_ONCE][4], count = levels->at[levels->level].face_count;
  values->points = values->refined = tw_alloc_zero(tw_shallow_points(levels), sizeof *values->points);
  if (!values->points) return TW_NO_MEMORY;
  for (uint32_t first = 0, taken; first < count; first += taken) {
    taken = count - first < AT_ONCE ? count - first : AT_ONCE;
    tw_shallow_faces(levels, first, taken, faces[0]);
    for (uint32_t i = 0; i < taken; i++) {
      /* Faces of the first of these levels have the numbers of the base's corners. */
      uint32_t corner = tw_nearest_corner(surface, (first + i) >> 2 * (levels->level - 1));
      for (int k = 0; k < 4; k++)
        memcpy(&values->points[faces[i][k]], values->at_corners + (size_t)values->width * corner,
               values->width * sizeof *values->at_corners);
    }
  }
  return TW_OK;
}
