/* Reference rotations in double precision, written from the formulas and not from the library, to compare its
 * results with. Quaternions are x y z w. */
#ifndef TWEEND_ROTATION_REFERENCE_H
#define TWEEND_ROTATION_REFERENCE_H

#include <math.h>
#include <stdint.h>

#include "tweend/anim.h"

#define REF_PI      3.14159265358979323846
#define REF_DEGREES (REF_PI / 180)

typedef struct ref_quat {
  double x, y, z, w;
} ref_quat;

static inline ref_quat ref_of(const float q[4]) {
  return (ref_quat){(double)q[0], (double)q[1], (double)q[2], (double)q[3]};
}

static inline ref_quat ref_add(ref_quat a, double s, ref_quat b, double t) {
  return (ref_quat){a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t, a.w * s + b.w * t};
}

static inline double ref_dot(ref_quat a, ref_quat b) {
  return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

static inline ref_quat ref_unit(ref_quat q) {
  return ref_add(q, 1 / sqrt(ref_dot(q, q)), q, 0);
}

static inline ref_quat ref_inverse(ref_quat q) {
  return (ref_quat){-q.x, -q.y, -q.z, q.w};
}

/* The angle between two rotations, whatever the signs and lengths of their quaternions. */
static inline double ref_angle(ref_quat a, ref_quat b) {
  a = ref_unit(a);
  b = ref_unit(b);
  if (ref_dot(a, b) < 0) b = ref_add(b, -1, b, 0);
  ref_quat d = ref_add(a, 1, b, -1), s = ref_add(a, 1, b, 1);
  return 4 * atan2(sqrt(ref_dot(d, d)), sqrt(ref_dot(s, s)));
}

/* Shoemake's slerp: p at u = 0, q at u = 1. Does not change signs. */
static inline ref_quat ref_slerp(ref_quat p, ref_quat q, double u) {
  double angle = acos(fmax(-1, fmin(1, ref_dot(p, q))));
  if (sin(angle) < 1e-9) return ref_unit(ref_add(p, 1 - u, q, u));
  return ref_add(p, sin((1 - u) * angle) / sin(angle), q, sin(u * angle) / sin(angle));
}

static inline ref_quat ref_toward(ref_quat q, ref_quat previous) {
  return ref_dot(q, previous) < 0 ? ref_add(q, -1, q, 0) : q;
}

static inline ref_quat ref_product(ref_quat a, ref_quat b) {
  return (ref_quat){
      a.w * b.x + b.w * a.x + a.y * b.z - a.z * b.y, a.w * b.y + b.w * a.y + a.z * b.x - a.x * b.z,
      a.w * b.z + b.w * a.z + a.x * b.y - a.y * b.x, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

static inline ref_quat ref_axis_angle(double x, double y, double z, double angle) {
  double length = sqrt(x * x + y * y + z * z), s = sin(angle / 2) / length;
  return (ref_quat){x * s, y * s, z * s, cos(angle / 2)};
}

/* A matrix in row-major order, as in books. */
typedef struct ref_matrix {
  double at[3][3];
} ref_matrix;

static inline ref_matrix ref_times(ref_matrix a, ref_matrix b) {
  ref_matrix out = {{{0}}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) out.at[i][j] += a.at[i][k] * b.at[k][j];
  return out;
}

static inline ref_matrix ref_about(char axis, double angle) {
  double c = cos(angle), s = sin(angle);
  if (axis == 'X') return (ref_matrix){{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
  if (axis == 'Y') return (ref_matrix){{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
  return (ref_matrix){{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

/* R = R1 R2 R3 for an order's letters; angles about x, y, z. */
static inline ref_matrix ref_euler(const double angles[3], tw_euler_order order) {
  const char *letters = tw_euler_order_names[order];
  ref_matrix out = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int i = 0; i < 3; i++) out = ref_times(out, ref_about(letters[i], angles[letters[i] - 'X']));
  return out;
}

static inline ref_quat ref_euler_quat(const double angles[3], tw_euler_order order) {
  const char *letters = tw_euler_order_names[order];
  ref_quat out = {0, 0, 0, 1};
  for (int i = 0; i < 3; i++) {
    char axis = letters[i];
    out = ref_product(out, ref_axis_angle(axis == 'X', axis == 'Y', axis == 'Z', angles[axis - 'X']));
  }
  return out;
}

/* The matrix of a rotation, from rotating the unit vectors by q v q*. */
static inline ref_matrix ref_matrix_of(ref_quat q) {
  ref_matrix out;
  q = ref_unit(q);
  for (int j = 0; j < 3; j++) {
    ref_quat v = {j == 0, j == 1, j == 2, 0};
    ref_quat r = ref_product(ref_product(q, v), ref_inverse(q));
    out.at[0][j] = r.x;
    out.at[1][j] = r.y;
    out.at[2][j] = r.z;
  }
  return out;
}

/* The angle between two rotation matrices, from the norm of their difference. */
static inline double ref_matrix_angle(ref_matrix a, ref_matrix b) {
  double sum = 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) sum += (a.at[i][j] - b.at[i][j]) * (a.at[i][j] - b.at[i][j]);
  return 2 * asin(fmin(1, sqrt(sum / 8)));
}

/* Pseudo-random in [0, 1), the same series in every run. */
static inline double ref_random(uint64_t *state) {
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return (double)(*state >> 11) / 9007199254740992.0;
}

static inline double ref_between(uint64_t *state, double low, double high) {
  return low + (high - low) * ref_random(state);
}

static inline ref_quat ref_random_unit(uint64_t *state) {
  for (;;) {
    ref_quat q = {0};
    q.x = ref_between(state, -1, 1);
    q.y = ref_between(state, -1, 1);
    q.z = ref_between(state, -1, 1);
    q.w = ref_between(state, -1, 1);
    double square = ref_dot(q, q);
    if (square > 0.01 && square < 1) return ref_unit(q);
  }
}

static inline void ref_narrow(ref_quat q, float out[4]) {
  out[0] = (float)q.x;
  out[1] = (float)q.y;
  out[2] = (float)q.z;
  out[3] = (float)q.w;
}

#endif
