/* Meshes as glTF, for tests of what is read of them: a square of which a test varies the document, and a
 * cube. */
#ifndef SQUARE_AND_CUBE_H
#define SQUARE_AND_CUBE_H

#include <stdio.h>
#include <string.h>

#include "glb.h"

/* ACCESSOR(0, 48, U16, 6, SCALAR): view, offset, type, count and kind. */
#define ACCESSOR(view, offset, type, count, kind)                                                            \
  "{'bufferView':" #view ",'byteOffset':" #offset ",'componentType':" type ",'count':" #count                \
  ",'type':'" #kind "'}"
#define I16 "5122"
#define U16 "5123"
#define F32 "5126"

/* A square of two triangles: 4 positions at 0, 6 indices of 16 bits at 48, then 4 spare bytes and
 * 12 more. */
typedef struct square_bin {
  float positions[4][3];
  uint16_t indices[6];
  uint8_t spare[16];
} square_bin;

static const square_bin square = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {0, 1, 2, 0, 2, 3}, {0}};

#define SQUARE_BUFFER                                                                                        \
  "'buffers':[{'byteLength':76}],'bufferViews':[{'buffer':0,'byteLength':48},"                               \
  "{'buffer':0,'byteOffset':48,'byteLength':28}]"
#define POSITIONS ACCESSOR(0, 0, F32, 4, VEC3)
#define INDICES   ACCESSOR(1, 0, U16, 6, SCALAR)
#define PRIMITIVE "{'attributes':{'POSITION':0},'indices':1}"

/* The square's document with these accessors and primitives, and members before. */
static inline const char *square_json_with(const char *members, const char *accessors,
                                           const char *primitives) {
  static char text[4096];
  snprintf(text, sizeof text,
           "{%s" ASSET "," SQUARE_BUFFER ",'accessors':[%s],'meshes':[{'name':'m','primitives':[%s]}]}",
           members, accessors, primitives);
  return text;
}

static inline const char *square_json(const char *accessors, const char *primitives) {
  return square_json_with("", accessors, primitives);
}

/* The square as it is. */
static inline tw_model *read_square(const char *accessors, const char *primitives) {
  return glb_read(square_json(accessors, primitives), &square, sizeof square);
}

/* A cube as a renderer wants it: 24 vertices, each face with its own four and its own texture. */
typedef struct cube_bin {
  float positions[24][3];
  float uvs[24][2];
  uint16_t indices[36];
} cube_bin;

static inline cube_bin make_cube(void) {
  static const uint8_t faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                      {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  static const float points[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  static const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  cube_bin bin;
  for (uint16_t face = 0; face < 6; face++) {
    for (uint16_t k = 0; k < 4; k++) {
      memcpy(bin.positions[4 * face + k], points[faces[face][k]], 12);
      memcpy(bin.uvs[4 * face + k], corners[k], 8);
    }
    static const uint16_t split[6] = {0, 1, 2, 0, 2, 3};
    for (int k = 0; k < 6; k++) bin.indices[6 * face + k] = (uint16_t)(4 * face + split[k]);
  }
  return bin;
}

static inline const char *cube_json(const char *extension) {
  static char json[2048];
  snprintf(json, sizeof json,
           "{" ASSET "%s,'buffers':[{'byteLength':552}],'bufferViews':[{'buffer':0,'byteLength':552}],"
           "'accessors':[{'bufferView':0,'componentType':5126,'count':24,'type':'VEC3'},"
           "{'bufferView':0,'byteOffset':288,'componentType':5126,'count':24,'type':'VEC2'},"
           "{'bufferView':0,'byteOffset':480,'componentType':5123,'count':36,'type':'SCALAR'}],"
           "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1},'indices':2}]}]}",
           extension);
  return json;
}

#define NGON ",'extensionsUsed':['FB_ngon_encoding']"

#endif
