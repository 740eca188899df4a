/* Vectors of three numbers. */
#ifndef TWEEND_VECTOR3_H
#define TWEEND_VECTOR3_H

#include <math.h>
#include <stdbool.h>

static inline void tw_cross3(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}
static inline double tw_dot3(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
static inline void tw_difference3(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}
static inline double tw_determinant3(const double *a, const double *b, const double *c) {
  double across[3];
  tw_cross3(b, c, across);
  return tw_dot3(a, across);
}
static inline double tw_length3(const double *vector) {
  return sqrt(tw_dot3(vector, vector));
}
/* Scales a vector to length 1 and returns the length it had. Without a finite length above 0 the vector
 * becomes 0 0 0, and 0 is returned. */
static inline double tw_unit3(double *vector) {
  double length = tw_length3(vector);
  bool has_length = length > 0 && isfinite(length);
  for (int i = 0; i < 3; i++) vector[i] = has_length ? vector[i] / length : 0;
  return has_length ? length : 0;
}
/* The angle between two vectors in radians, accurate near 0 too. */
static inline double tw_angle3(const double *a, const double *b) {
  double across[3];
  tw_cross3(a, b, across);
  return atan2(tw_length3(across), tw_dot3(a, b));
}
/* The vector from one point to another. */
static inline void tw_side3(const float *from, const float *to, double *out) {
  for (int i = 0; i < 3; i++) out[i] = (double)to[i] - (double)from[i];
}

#endif
