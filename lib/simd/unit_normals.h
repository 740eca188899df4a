/* Unit normals of tangents in vectors as wide as the compiler may use. No product is contracted and no root
 * approximated, so that all instruction sets give the same bytes, those of tw_normal_from_tangents. */
#ifndef TWEEND_UNIT_NORMALS_H
#define TWEEND_UNIT_NORMALS_H

#include <math.h>

#include "normal.h"
#include "wide.h"

static inline __attribute__((always_inline)) vector greater(vector a, vector b) {
  mask more = a > b;
  return (vector)(((mask)a & more) | ((mask)b & ~more));
}

static inline vector root(vector square) {
  for (int l = 0; l < LANES; l++) square[l] = sqrtf(square[l]);
  return square;
}

static inline __attribute__((always_inline)) bool all_set(mask m) {
  four_mask all = (four_mask)four_of((vector)m, 0);
  for (size_t n = 1; n < LANES / 4; n++) all &= (four_mask)four_of((vector)m, n);
  uint64_t halves[2];
  memcpy(halves, &all, sizeof halves);
  return (halves[0] & halves[1]) == UINT64_MAX;
}

static inline mask first_mask(void) {
  return (mask){0} == 0;
}

/* Cross products, and what each is multiplied by to become a unit normal. */
typedef struct crossed {
  vector of[3], scale;
} crossed;

/* least: what the square of each has to exceed; outward: 1, or -1 to turn them over; sure: which of all so
 * far need no closer look. */
static inline __attribute__((always_inline)) crossed
cross_tangents(const vector a[3], const vector b[3], vector least, vector outward, mask *sure) {
  crossed n;
  for (size_t c = 0; c < 3; c++) n.of[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
  vector square = n.of[0] * n.of[0] + n.of[1] * n.of[1] + n.of[2] * n.of[2];
  *sure &= (square > least) & (square < TW_NORMAL_SQUARE_MAX);
  n.scale = outward / root(square);
  return n;
}

/* With no zero below 0: a patch has the same normals turned round. */
static inline __attribute__((always_inline)) void normalise(const crossed *n, vector *out) {
  for (size_t c = 0; c < 3; c++) out[c] = n->of[c] * n->scale + 0.0f;
}

static inline __attribute__((always_inline)) void
unit_normals(const vector a[3], const vector b[3], vector least, vector outward, vector *out, mask *sure) {
  crossed n = cross_tangents(a, b, least, outward, sure);
  normalise(&n, out);
}

#endif
