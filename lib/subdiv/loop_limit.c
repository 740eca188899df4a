/* Limit masks of Loop's scheme at vertices that are not pinned. */
#include <math.h>

#include "limit_mask.h"
#include "loop.h"

static const double pi = 3.14159265358979323846;

void tw_loop_limit_smooth(const tw_limit_neighbours *n) {
  float ring = (float)(1 / (n->ring_count + 3 / (8 * tw_loop_weight(n->ring_count))));
  for (uint32_t i = 0; i < n->ring_count; i++) tw_ring_entry(n, i)->position = ring;
  n->entries[0].position = 1 - (float)n->ring_count * ring;
}

/* The subdominant eigenvectors of the subdivision matrix, along edges 0 and 1. */
void tw_loop_tangents_smooth(const tw_limit_neighbours *n) {
  static const float regular[6] = {1, 0.5f, -0.5f, -1, -0.5f, 0.5f};
  uint32_t count = n->ring_count;
  double step = 2 * pi / count;
  for (uint32_t i = 0; i < count; i++) {
    float weight = count == 6 ? regular[i] : (float)cos(i * step);
    tw_ring_entry(n, i)->tangent1 = weight;
    tw_ring_entry(n, i + 1)->tangent2 = weight;
  }
}

/* Scaled like the tangent along the crease: faces that share its half turn equally give both the same
 * length. */
void tw_loop_tangents_across(const tw_limit_neighbours *n, uint32_t first, uint32_t faces) {
  double step = pi / faces, inner = 2 * sin(step) / faces, ends = -1 / (faces * tan(step / 2)), own = 0;
  if (faces == 2) { /* along the edge between them */
    ends = 0;
    own = -1;
  } else if (faces == 3) { /* as on a regular mesh with its reflection beyond the crease */
    ends = -inner / 2;
    own = -inner;
  }
  n->entries[0].tangent2 = (float)own;
  tw_ring_entry(n, first)->tangent2 += (float)ends;
  tw_ring_entry(n, first + faces)->tangent2 += (float)ends;
  for (uint32_t i = 1; i < faces; i++)
    tw_ring_entry(n, first + i)->tangent2 += (float)(2 * sin(i * step) / faces);
}
