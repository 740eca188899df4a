/* Vertex buffers as files have them. */
#ifndef TWEEND_SOUP_H
#define TWEEND_SOUP_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Faces over vertices; a view. */
typedef struct tw_soup {
  uint32_t vertex_count;
  const float *positions; /* [vertex_count][3], finite */
  uint32_t face_count, corner_count;
  const uint32_t *face_offsets; /* [face_count + 1] */
  const uint32_t *corners;      /* [corner_count] vertices, in range */
  /* Orders two vertices at one place by what else a point has: joints, weights, displacements of morph
   * targets. They are one point only where it returns 0. A total order; less than 0 where a comes first.
   * NULL: the place alone counts. */
  int (*compare)(const void *context, uint32_t a, uint32_t b);
  const void *context;
  const int32_t *face_materials; /* [face_count], or NULL */
} tw_soup;

#ifdef __cplusplus
}
#endif
#endif
