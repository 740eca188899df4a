/* Which faces of a mesh are the children of one face, by connectivity alone. */
#ifndef TWEEND_COARSE_FACES_H
#define TWEEND_COARSE_FACES_H

#include "topology.h"

/* In a mesh that one step of Catmull and Clark's, or of Loop's, made, a face's part in its parent follows
 * from its neighbour's. So one face of a piece decides for the piece, and has four parts to choose from:
 * - a quad: which of its corners stays, 0 to 3; the next one is the middle of an edge, then come the face
 * point and the middle of another edge;
 * - a triangle: which of its corners stays, 0 to 2; or 3, where it lies amid its parent. */
enum { TW_PARTS = 4 };

/* A piece: faces that hang together by edges. */
typedef struct tw_piece {
  uint32_t face_count;
  const uint32_t *faces;
} tw_piece;

/* Parts of all faces of the piece of a face, if that face has this part.
 * t: all quads or all triangles, no edge of more than two faces. parts: [face_count], of the piece's faces
 * UINT8_MAX before. faces: [face_count] room for those of the piece, in the order in which they are met.
 * Returns false where the piece is no refinement with it; *piece and the parts are set all the same.
 * O(piece). */
bool tw_coarse_parts(const tw_topology *t, uint32_t face, uint8_t part, uint8_t *parts, uint32_t *faces,
                     tw_piece *piece);

/* The parents. */
typedef struct tw_coarse_faces {
  uint32_t face_count, corner_count;
  uint32_t *face_offsets; /* [face_count + 1] */
  /* [corner_count] the child's corner that stays. The child's next corner is the middle of the edge behind.
   */
  uint32_t *origins;
} tw_coarse_faces;

/* Parents come in the order of their first children, their corners from that child on. seen: [vertex_count]
 * of quads, [face_count] of triangles, zeroed; out: room for as many faces and corners as there are faces.
 * O(piece). */
void tw_coarse_faces_of(const tw_topology *t, const uint8_t *parts, const tw_piece *piece, uint8_t *seen,
                        tw_coarse_faces *out);

#endif
