/* What the kernels of the normals of shallow surfaces are told. */
#ifndef TWEEND_SHALLOW_NORMALS_H
#define TWEEND_SHALLOW_NORMALS_H

#include "shallow.h"

/* Weights of the neighbours along an edge and across a face, of valences that many vertices have in common.
 */
enum { TW_COMMON_VALENCES = 16 };
typedef struct tw_shallow_weights {
  bool known[TW_COMMON_VALENCES];
  float edges[TW_COMMON_VALENCES][TW_COMMON_VALENCES], faces[TW_COMMON_VALENCES][TW_COMMON_VALENCES];
} tw_shallow_weights;

/* n: the valence. */
double tw_shallow_edge_weight(uint32_t i, uint32_t n);
double tw_shallow_face_weight(uint32_t i, uint32_t n);
void tw_shallow_learn(tw_shallow_weights *w, uint32_t n);

/* A level: the points at the cage's vertices, in the middle of its edges and of its faces and, of level 2, in
 * the middle of level 1's edges, which are the halves of the cage's and the spokes from a corner's edge to
 * the face point, and in that of its faces. Of a level 2 that is remade the first three are those of level 1,
 * and there are no halves and spokes. */
typedef struct tw_shallow_level {
  uint32_t number; /* 1 or 2 */
  tw_topology cage;
  const float *vertices, *edges, *faces, *halves, *spokes, *centres;
  const float *remade;         /* at the cage's vertices; NULL: level 2 is kept */
  tw_shallow_weights *weights; /* those of valence 3 are known */
} tw_shallow_level;

/* What rows are of, as they follow each other in a level; of level 1 the first three. */
enum {
  TW_SHALLOW_VERTICES,
  TW_SHALLOW_EDGES,
  TW_SHALLOW_FACES,
  TW_SHALLOW_HALVES,
  TW_SHALLOW_SPOKES,
  TW_SHALLOW_CENTRES,
  TW_SHALLOW_KINDS
};

/* Rows [begin, end) of a kind. points: of the kind's first row, and four floats behind its last one, NULL
 * where they are remade; out: of the row `begin`. */
typedef struct tw_shallow_rows {
  const float *points;
  uint32_t begin, end;
  float *out;
} tw_shallow_rows;

/* rows: [TW_SHALLOW_KINDS]. */
typedef void tw_shallow_fill(const tw_shallow_level *level, const tw_shallow_rows *rows);
tw_shallow_fill tw_shallow_fill_anywhere;
#ifdef __x86_64__
tw_shallow_fill tw_shallow_fill_avx2, tw_shallow_fill_avx512;
#endif

#endif
