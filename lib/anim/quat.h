/* Quaternions in double precision, x y z w: what preparing and sampling tracks share. */
#ifndef TWEEND_QUAT_H
#define TWEEND_QUAT_H

#include "tweend/anim.h"

/* The great arc from one unit quaternion to another: at u it is from cos(u angle) + toward sin(u angle),
 * unit length all along (Shoemake 1985, written with an orthonormal pair so that nothing is divided). */
typedef struct tw_arc {
  double from[4], toward[4];
  double angle; /* in [0, pi]; half of the rotation's angle */
} tw_arc;

static inline double quat_dot(const double a[4], const double b[4]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/* out = a b; may be a or b. */
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

static inline void quat_widen(const float q[4], double out[4]) {
  for (int i = 0; i < 4; i++) out[i] = (double)q[i];
}

static inline void quat_narrow(const double q[4], float out[4]) {
  for (int i = 0; i < 4; i++) out[i] = (float)q[i];
}

/* Length of vector[0..n), with no overflow or underflow for any float input. */
double tw_length(const double *vector, int n);

/* Scales to unit length and returns the length that it had; a zero vector stays and gives 0. */
double tw_normalize(double *vector, int n);

/* What a rotation key is multiplied by, to have unit length on the side of the key before it (NULL: none). A
 * key within 1e-6 of unit length, as printing with seven digits leaves it, keeps its length: 1 or -1. */
double tw_quat_key_scale(const double key[4], const double *previous);

/* Both unit. Does not change signs: from a to -a the arc goes half way round in some direction. */
tw_arc tw_arc_between(const double a[4], const double b[4]);
/* The same to b or -b, whichever is nearer. */
tw_arc tw_arc_short(const double a[4], const double b[4]);
void tw_arc_at(const tw_arc *arc, double u, double out[4]);

/* Of the rotation between two, in [0, pi]; lengths near 1 will do. */
double tw_angle_between(const double a[4], const double b[4]);

/* Half the rotation vector of a unit quaternion, and back. */
void tw_quat_log(const double q[4], double out[3]);
void tw_quat_exp(const double v[3], double out[4]);

/* Of a unit axis and any angle. */
void tw_quat_axis_angle(const double axis[3], double angle, double out[4]);

/* x y z angle of a unit quaternion, the angle in [0, pi]; of no turn the axis is x. */
void tw_axis_angle_of(const double q[4], double out[4]);

/* The unit quaternion of the rotation whose axes agree best with the given ones, zero axes ignored. */
void tw_quat_best(double axes[3][3], double out[4]);

void tw_quat_euler(const double angles[3], tw_euler_order order, double out[4]);
/* As tw_quat_to_euler and tw_quat_to_euler_near. */
void tw_euler_of(const double q[4], tw_euler_order order, double out[3]);
void tw_euler_near(const double q[4], tw_euler_order order, const double previous[3], double out[3]);

/* |cos| of the middle angle, precise up to lock itself. q: of any length. */
double tw_euler_cos_middle(const double q[4], tw_euler_order order);
/* The same as answers tell it: below 1e-7 it is lock, and 0; never above 1. */
static inline double euler_cos_told(double cos_middle) {
  return cos_middle < 1e-7 ? 0 : cos_middle > 1 ? 1 : cos_middle;
}

/* The axes of an order, outermost first: XZY gives 0 2 1. */
extern const unsigned char tw_euler_axes[TW_EULER_ORDERS][3];
/* 1 of an even order, -1 of an odd one. */
static inline double euler_sign(tw_euler_order order) {
  return (tw_euler_axes[order][0] + 1) % 3 == tw_euler_axes[order][1] ? 1 : -1;
}

/* Rotation part of a matrix, columns scaled. The bulk and the single path share it so that both give
 * the same bytes. A quaternion a little off unit length still gives an exact rotation. */
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
