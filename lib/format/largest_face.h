/* The size of a surface's largest face, which both writers reserve room for. */
#ifndef TWEEND_LARGEST_FACE_H
#define TWEEND_LARGEST_FACE_H

#include "tweend/subdiv.h"

/* From level 1 on at most 4, and there are more faces than in the cage; at level 0 the faces are the cage's
 * own, some perhaps left out. */
static inline size_t tw_largest_face(const tw_surface *surface, const tw_mesh *cage) {
  uint64_t faces = tw_surface_get_counts(surface)->faces, largest = 4;
  for (uint64_t face = 0; faces <= cage->face_count && face < faces; face++) {
    uint64_t size = tw_surface_corners_before(surface, face + 1) - tw_surface_corners_before(surface, face);
    if (size > largest) largest = size;
  }
  return (size_t)largest;
}

#endif
