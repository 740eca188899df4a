/* Quaternions in double precision, x y z w, as preparing and sampling tracks use them. */
#ifndef TWEEND_QUAT_H
#define TWEEND_QUAT_H

#include "tweend/anim.h"

/* The great arc from one unit quaternion to another. At u it is from cos(u angle) + toward sin(u angle),
 * always of unit length (Shoemake 1985, written with an orthonormal pair so that nothing is divided). */
typedef struct tw_arc {
  double from[4], toward[4];
  double angle; /* in [0, pi]; half the angle of the rotation */
} tw_arc;

static const double TW_QUAT_IDENTITY[4] = {0, 0, 0, 1};

static inline double quat_dot(const double a[4], const double b[4]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/* out = a b; out may be a or b. */
static inline void quat_multiply(const double a[4], const double b[4], double out[4]) {
  double x = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1];
  double y = a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0];
  double z = a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3];
  double w = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2];
  out[0] = x;
  out[1] = y;
  out[2] = z;
  out[3] = w;
}

/* The inverse of a unit quaternion. */
static inline void quat_conjugate(const double q[4], double out[4]) {
  for (int i = 0; i < 3; i++) out[i] = -q[i];
  out[3] = q[3];
}

static inline void quat_widen(const float q[4], double out[4]) {
  for (int i = 0; i < 4; i++) out[i] = (double)q[i];
}

static inline void quat_narrow(const double q[4], float out[4]) {
  for (int i = 0; i < 4; i++) out[i] = (float)q[i];
}

/* Length of vector[0..n), with no overflow or underflow for any float input. */
double tw_length(const double *vector, int n);

/* Scales to unit length and returns the previous length. A zero vector stays and gives 0. */
double tw_normalize(double *vector, int n);

/* The factor that gives a rotation key unit length and a dot product of at least 0 with the key before it
 * (NULL: none). A key within 1e-6 of unit length, as printing with seven digits leaves it, keeps its length:
 * the factor is 1 or -1. */
double tw_quat_key_scale(const double key[4], const double *previous);

/* The arc from a to b, both of unit length. Does not change signs: from a to -a the arc goes half way round
 * in an arbitrary direction. */
tw_arc tw_arc_between(const double a[4], const double b[4]);
/* The arc from a to b or -b, whichever is nearer. */
tw_arc tw_arc_short(const double a[4], const double b[4]);
void tw_arc_at(const tw_arc *arc, double u, double out[4]);

/* The angle of the rotation from a to b, in [0, pi]. Lengths near 1 are enough. */
double tw_angle_between(const double a[4], const double b[4]);

/* Half the rotation vector of a unit quaternion, and the quaternion of half a rotation vector. */
void tw_quat_log(const double q[4], double out[3]);
void tw_quat_exp(const double v[3], double out[4]);

/* The quaternion of a unit axis and any angle. */
void tw_quat_axis_angle(const double axis[3], double angle, double out[4]);

/* Axis x y z and angle of a unit quaternion, the angle in [0, pi]; the identity's axis is x. */
void tw_axis_angle_of(const double q[4], double out[4]);

/* The unit quaternion of the rotation whose axes best fit the given ones; zero axes are ignored. */
void tw_quat_best(double axes[3][3], double out[4]);

void tw_quat_euler(const double angles[3], tw_euler_order order, double out[4]);
/* As tw_quat_to_euler and tw_quat_to_euler_near, in double precision. */
void tw_euler_of(const double q[4], tw_euler_order order, double out[3]);
void tw_euler_near(const double q[4], tw_euler_order order, const double previous[3], double out[3]);

/* |cos| of the middle angle, precise right up to lock. q: of any length but 0. */
double tw_euler_cos_middle(const double q[4], tw_euler_order order);
/* The value as answers give it: below 1e-7 it counts as lock and becomes 0; at most 1. */
static inline double euler_cos_told(double cos_middle) {
  return cos_middle < 1e-7 ? 0 : cos_middle > 1 ? 1 : cos_middle;
}

/* The axes of an order, outermost first: XZY gives 0 2 1. */
extern const unsigned char tw_euler_axes[TW_EULER_ORDERS][3];
/* 1 for an even order, -1 for an odd one. */
static inline double euler_sign(tw_euler_order order) {
  return (tw_euler_axes[order][0] + 1) % 3 == tw_euler_axes[order][1] ? 1 : -1;
}

/* The rotation matrix of a quaternion, by columns. Bulk and single evaluation share this function so that
 * both give the same bytes. A quaternion slightly off unit length still gives an exact rotation. */
static inline void quat_matrix(const float q[4], float out[9]) {
  float x = q[0], y = q[1], z = q[2], w = q[3];
  float s = 2.0f / (x * x + y * y + z * z + w * w);
  float xs = x * s, ys = y * s, zs = z * s;
  float xx = x * xs, xy = x * ys, xz = x * zs;
  float yy = y * ys, yz = y * zs, zz = z * zs;
  float wx = w * xs, wy = w * ys, wz = w * zs;
  out[0] = 1 - (yy + zz);
  out[1] = xy + wz;
  out[2] = xz - wy;
  out[3] = xy - wz;
  out[4] = 1 - (xx + zz);
  out[5] = yz + wx;
  out[6] = xz + wy;
  out[7] = yz - wx;
  out[8] = 1 - (xx + yy);
}

#endif
