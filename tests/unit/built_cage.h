/* Cages built face by face. */
#ifndef BUILT_CAGE_H
#define BUILT_CAGE_H

#include <string.h>

#include "surface_rows.h"

enum { POINTS_MAX = 256, FACES_MAX = 512 };

/* A single allocation; release it with free(). */
typedef struct cage {
  float (*points)[3];
  uint32_t *corners, *offsets;
  uint32_t creases[4][2];
  float sharpness[4];
  tw_mesh mesh;
  uint32_t points_max, faces_max;
} cage;

/* An empty cage with room for so many points, and faces of up to four corners on average. */
static inline cage *new_cage_for(uint32_t points, uint32_t faces) {
  cage *c = calloc(1, sizeof *c + points * sizeof *c->points + (5 * (size_t)faces + 1) * sizeof *c->corners);
  assert_non_null(c);
  c->points_max = points;
  c->faces_max = faces;
  c->points = (float(*)[3])(c + 1);
  c->corners = (uint32_t *)(c->points + points);
  c->offsets = c->corners + 4 * (size_t)faces;
  tw_mesh_init(&c->mesh);
  c->mesh.positions = c->points[0];
  c->mesh.corners = c->corners;
  c->mesh.face_offsets = c->offsets;
  return c;
}

static inline cage *new_cage(void) {
  return new_cage_for(POINTS_MAX, FACES_MAX);
}

/* A cage over the points of another, without its faces. */
static inline cage *new_cage_over(const cage *other) {
  cage *c = new_cage_for(other->points_max, other->faces_max);
  c->mesh.point_count = other->mesh.point_count;
  memcpy(c->points, other->points, other->mesh.point_count * sizeof *c->points);
  return c;
}

static inline uint32_t add_point(cage *c, float x, float y, float z) {
  float point[3] = {x, y, z};
  assert_true(c->mesh.point_count < c->points_max);
  memcpy(c->points[c->mesh.point_count], point, sizeof point);
  return c->mesh.point_count++;
}

static inline void add_face(cage *c, const uint32_t *corners, uint32_t size) {
  assert_true(c->mesh.face_count < c->faces_max);
  memcpy(c->corners + c->mesh.corner_count, corners, size * sizeof *corners);
  c->mesh.corner_count += size;
  c->offsets[++c->mesh.face_count] = c->mesh.corner_count;
}

/* Adds a quad, or two triangles cut along the diagonal from its first corner. */
static inline void add_quad(cage *c, const uint32_t quad[4], bool cut) {
  const uint32_t halves[2][3] = {{quad[0], quad[1], quad[2]}, {quad[0], quad[2], quad[3]}};
  if (!cut) {
    add_face(c, quad, 4);
    return;
  }
  add_face(c, halves[0], 3);
  add_face(c, halves[1], 3);
}

/* Creases the first edge of every third face, four edges in all. */
static inline void crease_some(cage *c, float sharpness) {
  c->mesh.crease_edges = c->creases[0];
  c->mesh.crease_sharpness = c->sharpness;
  for (uint32_t i = 0; i < 4; i++) {
    memcpy(c->creases[i], c->corners + c->offsets[3 * i], sizeof c->creases[i]);
    c->sharpness[i] = sharpness;
  }
  c->mesh.crease_count = 4;
}

/* A grid of columns x rows points at height(x, y), or at height 0 for NULL. cut: triangles, six around each
 * inner point, instead of quads. There is room for more. */
static inline cage *grid(uint32_t columns, uint32_t rows, bool cut, float (*height)(float, float)) {
  cage *c = new_cage_for(columns * rows + POINTS_MAX, 2 * columns * rows + FACES_MAX);
  for (uint32_t y = 0; y < rows; y++)
    for (uint32_t x = 0; x < columns; x++)
      add_point(c, (float)x, (float)y, height ? height((float)x, (float)y) : 0);
  for (uint32_t y = 0; y + 1 < rows; y++)
    for (uint32_t x = 0; x + 1 < columns; x++) {
      uint32_t a = y * columns + x, quad[4] = {a, a + 1, a + columns + 1, a + columns};
      add_quad(c, quad, cut);
    }
  return c;
}

#endif
