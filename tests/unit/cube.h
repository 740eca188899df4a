/* The cube of many tests. */
#ifndef CUBE_H
#define CUBE_H

#include "tweend/mesh.h"

static const float cube_points[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                        {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const uint32_t cube_corners[24] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4,
                                          1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
static const uint32_t cube_offsets[7] = {0, 4, 8, 12, 16, 20, 24};

static inline tw_mesh cube(void) {
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = 8;
  mesh.positions = cube_points[0];
  mesh.face_count = 6;
  mesh.corner_count = 24;
  mesh.face_offsets = cube_offsets;
  mesh.corners = cube_corners;
  return mesh;
}

#endif
