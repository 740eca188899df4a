/* The masks of Loop's scheme, as sums of points that are found in one way or another. */
#ifndef TWEEND_LOOP_MASK_H
#define TWEEND_LOOP_MASK_H

#include <stdint.h>

enum { TW_LOOP_WIDTH_MAX = 4 };

static inline void tw_loop_add(double *restrict sum, const double *in, uint32_t width) {
  for (uint32_t i = 0; i < width; i++) sum[i] += in[i];
}

/* The middle of a smooth edge from a to b between triangles that face it with c and d. */
static inline void tw_loop_smooth_middle(const double *a, const double *b, const double *c, const double *d,
                                         uint32_t width, double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.375 * (a[i] + b[i]) + 0.125 * (c[i] + d[i]);
}

static inline void tw_loop_sharp_middle(const double *a, const double *b, uint32_t width,
                                        double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.5 * (a[i] + b[i]);
}

/* A vertex of a crease, between its neighbours there. */
static inline void tw_loop_crease(const double *own, const double *a, const double *b, uint32_t width,
                                  double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.75 * own[i] + 0.125 * (a[i] + b[i]);
}

/* A smooth vertex, of whose neighbours `ring` is the sum. */
static inline void tw_loop_smooth(const double *own, const double *ring, uint32_t valence, double weight,
                                  uint32_t width, double *restrict out) {
  double own_weight = 1 - valence * weight;
  for (uint32_t i = 0; i < width; i++) out[i] = own_weight * own[i] + weight * ring[i];
}

#endif
