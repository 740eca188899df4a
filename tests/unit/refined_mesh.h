/* A subdivision level of a cage as a mesh. */
#ifndef REFINED_MESH_H
#define REFINED_MESH_H

#include <math.h>

#include "built_cage.h"

typedef struct level {
  rows r;
  float *points;
  uint32_t *corners, *offsets;
  tw_mesh mesh;
} level;

static inline tw_surface_options options_of(tw_scheme scheme, uint32_t depth) {
  return (tw_surface_options){.level = depth, .scheme = scheme};
}

static inline level refine(const tw_mesh *cage, tw_surface_options options) {
  level l = {.r = read_rows(cage, options)};
  tw_mesh_init(&l.mesh);
  l.mesh.point_count = (uint32_t)tw_surface_row_count(l.r.surface, TW_DOMAIN_POINTS);
  l.points = all_rows(l.r.surface, TW_DOMAIN_POINTS);
  l.corners = faces_of(&l.r, TW_DOMAIN_POINTS);
  const tw_surface_counts *counts = tw_surface_get_counts(l.r.surface);
  l.mesh.face_count = (uint32_t)counts->faces;
  l.mesh.corner_count = (uint32_t)counts->corners;
  l.offsets = malloc((counts->faces + 1) * sizeof *l.offsets);
  assert_non_null(l.offsets);
  for (uint32_t f = 0; f <= l.mesh.face_count; f++) l.offsets[f] = (options.scheme == TW_LOOP ? 3 : 4) * f;
  l.mesh.positions = l.points;
  l.mesh.corners = l.corners;
  l.mesh.face_offsets = l.offsets;
  return l;
}

static inline void free_level(level *l) {
  free_rows(&l->r);
  free(l->points);
  free(l->corners);
  free(l->offsets);
}

static inline float greatest_difference(const float *a, const float *b, size_t count) {
  float greatest = 0;
  for (size_t i = 0; i < count; i++) greatest = fmaxf(greatest, fabsf(a[i] - b[i]));
  return greatest;
}

#endif
