/* A mesh as a view of arrays, and the cube that many tests use. */
#ifndef CUBE_H
#define CUBE_H

#include "tweend/mesh.h"

static const float cube_points[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                        {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const uint32_t cube_corners[24] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4,
                                          1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
static const uint32_t cube_offsets[7] = {0, 4, 8, 12, 16, 20, 24};

static inline tw_mesh mesh_of(const float *points, uint32_t point_count, const uint32_t *corners,
                              const uint32_t *offsets, uint32_t face_count) {
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = point_count;
  mesh.positions = points;
  mesh.face_count = face_count;
  mesh.corner_count = offsets[face_count];
  mesh.face_offsets = offsets;
  mesh.corners = corners;
  return mesh;
}

static inline tw_mesh cube(void) {
  return mesh_of(cube_points[0], 8, cube_corners, cube_offsets, 6);
}

#endif
