/* How much room the corners of one face of a surface take. */
#ifndef TWEEND_LARGEST_FACE_H
#define TWEEND_LARGEST_FACE_H

#include "tweend/subdiv.h"

/* Corners of the surface's largest face, at least 4. O(faces of the cage). */
size_t tw_largest_face(const tw_surface *surface, const tw_mesh *cage);

#endif
