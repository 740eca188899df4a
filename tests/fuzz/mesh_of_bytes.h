/* Builds a mesh from any bytes, including meshes that no reader would produce. */
#ifndef TWEEND_MESH_OF_BYTES_H
#define TWEEND_MESH_OF_BYTES_H

#include "tweend/mesh.h"

enum { POINTS = 32, FACES = 24, FACE_SIZE = 9, CORNERS = FACES * FACE_SIZE, TAGS = 6, VALUES = 16 };

/* A source of bytes; zeros follow its end. */
typedef struct source {
  const uint8_t *at, *end;
} source;

uint32_t take(source *s, uint32_t below);

/* Mostly values of a coarse grid, so that equal values are frequent. */
float take_number(source *s);
void take_numbers(source *s, float *out, size_t count);
float take_sharpness(source *s);

/* All arrays that a mesh may point to. */
typedef struct storage {
  float positions[POINTS][3], colors[POINTS][4], own[POINTS][1], moves[2][POINTS][3], weights[POINTS][8];
  uint16_t joints[POINTS][8];
  uint32_t offsets[FACES + 1], corners[CORNERS], uv_corners[2][CORNERS], normal_corners[CORNERS];
  float uvs[2][VALUES][2], normals[VALUES][3], tangents[VALUES][4], normal_moves[2][VALUES][3];
  uint32_t creases[TAGS][2], sharp_points[TAGS], holes[TAGS], groups[FACES], smoothing[FACES];
  float crease_sharpness[TAGS], point_sharpness[TAGS];
  uint8_t tangent_uvs[FACES];
  float corner_values[VALUES][4], whole[POINTS][1];
  uint32_t value_corners[2][CORNERS];
  tw_attribute attributes[5];
  const float *morphs[2], *morph_normals[2];
} storage;

/* Builds a mesh. It may have no faces, or faces that coincide or have opposite windings, but mostly nothing
 * that readers refuse. */
void take_mesh(source *s, storage *own, tw_mesh *mesh);

/* Adds attributes with values of corners, and whole numbers. */
void take_corner_values(source *s, storage *own, tw_mesh *mesh);

#endif
