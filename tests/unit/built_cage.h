/* Cages put together face by face. */
#ifndef BUILT_CAGE_H
#define BUILT_CAGE_H

#include <string.h>

#include "surface_rows.h"

enum { POINTS_MAX = 256, FACES_MAX = 512 };

typedef struct cage {
  float points[POINTS_MAX][3];
  uint32_t corners[4 * FACES_MAX], offsets[FACES_MAX + 1];
  uint32_t creases[4][2];
  float sharpness[4];
  tw_mesh mesh;
} cage;

static inline cage *new_cage(void) {
  cage *c = calloc(1, sizeof *c);
  assert_non_null(c);
  tw_mesh_init(&c->mesh);
  c->mesh.positions = c->points[0];
  c->mesh.corners = c->corners;
  c->mesh.face_offsets = c->offsets;
  return c;
}

static inline uint32_t add_point(cage *c, float x, float y, float z) {
  float point[3] = {x, y, z};
  assert_true(c->mesh.point_count < POINTS_MAX);
  memcpy(c->points[c->mesh.point_count], point, sizeof point);
  return c->mesh.point_count++;
}

static inline void add_face(cage *c, const uint32_t *corners, uint32_t size) {
  assert_true(c->mesh.face_count < FACES_MAX);
  memcpy(c->corners + c->mesh.corner_count, corners, size * sizeof *corners);
  c->mesh.corner_count += size;
  c->offsets[++c->mesh.face_count] = c->mesh.corner_count;
}

/* A quad as it is, or cut along the diagonal from its first corner. */
static inline void add_quad(cage *c, const uint32_t quad[4], bool cut) {
  const uint32_t halves[2][3] = {{quad[0], quad[1], quad[2]}, {quad[0], quad[2], quad[3]}};
  if (!cut) {
    add_face(c, quad, 4);
    return;
  }
  add_face(c, halves[0], 3);
  add_face(c, halves[1], 3);
}

/* The first edges of four faces. */
static inline void crease_some(cage *c, float sharpness) {
  c->mesh.crease_edges = c->creases[0];
  c->mesh.crease_sharpness = c->sharpness;
  for (uint32_t i = 0; i < 4; i++) {
    memcpy(c->creases[i], c->corners + c->offsets[3 * i], sizeof c->creases[i]);
    c->sharpness[i] = sharpness;
  }
  c->mesh.crease_count = 4;
}

/* Quads over columns x rows points at height(x, y), 0 for NULL; cut: triangles, six round each inner point.
 */
static inline cage *grid(uint32_t columns, uint32_t rows, bool cut, float (*height)(float, float)) {
  cage *c = new_cage();
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
