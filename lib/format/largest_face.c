/* The size of a surface's largest face: 4 at most from level 1 on, where faces are more than the cage's;
 * at level 0 they are the cage's own, some perhaps left out. */
#include "largest_face.h"

size_t tw_largest_face(const tw_surface *surface, const tw_mesh *cage) {
  uint64_t faces = tw_surface_get_counts(surface)->faces, largest = 4;
  for (uint64_t face = 0; faces <= cage->face_count && face < faces; face++) {
    uint64_t size = tw_surface_corners_before(surface, face + 1) - tw_surface_corners_before(surface, face);
    if (size > largest) largest = size;
  }
  return (size_t)largest;
}
