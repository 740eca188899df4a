/* Finds which faces of a mesh are the children of one parent face, by connectivity alone. */
#ifndef TWEEND_COARSE_FACES_H
#define TWEEND_COARSE_FACES_H

#include "topology.h"

/* A face's part is its place in its parent. In a mesh that one step of Catmull and Clark's or of Loop's
 * scheme made, a face's part follows from its neighbour's part, so the part of one face decides those of its
 * whole piece. There are four parts to choose from:
 * - a quad: which of its corners is a vertex of the parent, 0 to 3; the next corner is the middle of an edge,
 *   then come the face point and the middle of another edge;
 * - a triangle: which of its corners is a vertex of the parent, 0 to 2; 3 for the child in the middle. */
enum { TW_PARTS = 4 };

/* A piece: faces that are connected across edges. */
typedef struct tw_piece {
  uint32_t face_count;
  const uint32_t *faces;
} tw_piece;

/* Derives the parts of all faces in the piece of `face` from the assumption that `face` has `part`.
 * t: all quads or all triangles, no edge of more than two faces. parts: [face_count], UINT8_MAX for the faces
 * of the piece before the call. faces: [face_count], room for the faces of the piece in the order in which
 * they are met. Returns false where the assumption makes the piece no refinement; *piece and parts are set
 * all the same. O(piece). */
bool tw_coarse_parts(const tw_topology *t, uint32_t face, uint8_t part, uint8_t *parts, uint32_t *faces,
                     tw_piece *piece);

/* The parent faces that were found. */
typedef struct tw_coarse_faces {
  uint32_t face_count, corner_count;
  uint32_t *face_offsets; /* [face_count + 1] */
  /* [corner_count] the child's corner at this corner of the parent. The child's next corner is the middle of
   * the parent's edge that begins here. */
  uint32_t *origins;
} tw_coarse_faces;

/* Finds the parents of a piece, in the order of their first children; a parent's corners begin at its first
 * child. seen: [vertex_count] for quads, [face_count] for triangles, zeroed. out: face_offsets and origins
 * have room for piece->face_count parents and corners. O(piece). */
void tw_coarse_faces_of(const tw_topology *t, const uint8_t *parts, const tw_piece *piece, uint8_t *seen,
                        tw_coarse_faces *out);

#endif
