/* Converts rotations of any form to and from unit quaternions, in double precision. */
#include "quat.h"

#include <math.h>
#include <string.h>

#include "vector3.h"

const uint32_t tw_rotation_widths[TW_ROTATION_FORMS] = {4, 4, 3, 9};

static const double ANGLE_MOST = 1e9;                /* the limit that tracks have too */
static const double MATRIX_TOLERANCE = 1e-3 + 1e-12; /* numbers that are rounded may stand at the limit */

/* Scales to unit length without overflow or underflow of the squares; false for a zero vector. */
static bool make_unit(double *vector, int n) {
  double most = 0;
  for (int i = 0; i < n; i++) most = fmax(most, fabs(vector[i]));
  if (most == 0) return false;
  for (int i = 0; i < n; i++) vector[i] /= most;
  tw_normalize(vector, n);
  return true;
}

static tw_status read_quaternion(const double values[4], double q[4], tw_error *error) {
  double unit[4] = {values[0], values[1], values[2], values[3]};
  if (!make_unit(unit, 4)) return tw_fail(error, TW_INVALID, "a zero quaternion is no rotation");
  for (int i = 0; i < 4; i++) q[i] = unit[i];
  return TW_OK;
}

static tw_status fail_angle(double angle, tw_error *error) {
  return tw_fail(error, TW_INVALID, "the angle %g is beyond %g radians", angle, ANGLE_MOST);
}

static tw_status read_axis_angle(const double values[4], double q[4], tw_error *error) {
  double axis[3] = {values[0], values[1], values[2]};
  if (!make_unit(axis, 3)) return tw_fail(error, TW_INVALID, "a zero axis has no direction");
  if (fabs(values[3]) > ANGLE_MOST) return fail_angle(values[3], error);
  tw_quat_axis_angle(axis, values[3], q);
  return TW_OK;
}

static tw_status read_euler(const double values[3], tw_euler_order order, double q[4], tw_error *error) {
  for (int i = 0; i < 3; i++)
    if (fabs(values[i]) > ANGLE_MOST) return fail_angle(values[i], error);
  tw_quat_euler(values, order, q);
  return TW_OK;
}

/* Reads a matrix that is a rotation within MATRIX_TOLERANCE, as the rotation that fits it best: rounded
 * matrices stand for a rotation. */
static tw_status read_matrix(const double m[9], double q[4], tw_error *error) {
  double axes[3][3];
  for (int i = 0; i < 9; i++) axes[i / 3][i % 3] = m[i];
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      double product = tw_dot3(axes[i], axes[j]);
      double off = i == j ? sqrt(product) - 1 : product;
      /* A product that overflows fails the comparison, too. */
      if (fabs(off) <= MATRIX_TOLERANCE) continue;
      if (i == j)
        return tw_fail(error, TW_INVALID, "the matrix is no rotation: column %d has length %.4g", i,
                       sqrt(product));
      return tw_fail(error, TW_INVALID,
                     "the matrix is no rotation: columns %d and %d are not at right angles", i, j);
    }
  if (tw_determinant3(axes[0], axes[1], axes[2]) < 0)
    return tw_fail(error, TW_INVALID, "the matrix is no rotation: it mirrors");
  tw_quat_best(axes, q);
  return TW_OK;
}

tw_status tw_rotation_read(tw_rotation_form form, tw_euler_order order, const double *values, double q[4],
                           tw_error *error) {
  switch (form) {
  case TW_AS_AXIS_ANGLE: return read_axis_angle(values, q, error);
  case TW_AS_EULER: return read_euler(values, order, q, error);
  case TW_AS_MATRIX: return read_matrix(values, q, error);
  case TW_AS_QUATERNION:
  case TW_ROTATION_FORMS: break;
  }
  return read_quaternion(values, q, error);
}

/* The columns are the rotated axes. */
static void write_matrix(const double q[4], double out[9]) {
  for (int i = 0; i < 3; i++) {
    double axis[3] = {i == 0, i == 1, i == 2};
    tw_rotation_turn(q, axis, out + 3 * (size_t)i);
  }
}

void tw_rotation_write(const double q[4], tw_rotation_form form, tw_euler_order order, double *out) {
  switch (form) {
  case TW_AS_AXIS_ANGLE: tw_axis_angle_of(q, out); return;
  case TW_AS_EULER: tw_euler_of(q, order, out); return;
  case TW_AS_MATRIX: write_matrix(q, out); return;
  case TW_AS_QUATERNION:
  case TW_ROTATION_FORMS: break;
  }
  for (int i = 0; i < 4; i++) out[i] = q[i];
}

void tw_rotation_multiply(const double a[4], const double b[4], double out[4]) {
  quat_multiply(a, b, out);
  tw_normalize(out, 4);
}

void tw_rotation_slerp(const double a[4], const double b[4], double u, double out[4]) {
  tw_arc arc = tw_arc_short(a, b);
  tw_arc_at(&arc, u, out);
}

/* v + 2 r x (r x v + w v), where r is the quaternion's vector part. */
void tw_rotation_turn(const double q[4], const double v[3], double out[3]) {
  double t[3], turned[3];
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    t[i] = q[j] * v[k] - q[k] * v[j] + q[3] * v[i];
  }
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    turned[i] = v[i] + 2 * (q[j] * t[k] - q[k] * t[j]);
  }
  memcpy(out, turned, sizeof turned);
}

double tw_rotation_cos_middle(const double q[4], tw_euler_order order) {
  return euler_cos_told(tw_euler_cos_middle(q, order));
}
