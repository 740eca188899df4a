/* Vectors of three numbers. */
#ifndef TWEEND_VECTOR3_H
#define TWEEND_VECTOR3_H

static inline void tw_cross3(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static inline double tw_dot3(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#endif
