/* Rotation algebra. Single precision outside, double within: inputs are few and errors add up. */
#include "quat.h"

#include <math.h>
#include <string.h>

double tw_length(const double *vector, int n) {
  double sum = 0;
  for (int i = 0; i < n; i++) sum += vector[i] * vector[i];
  return sqrt(sum);
}

double tw_normalize(double *vector, int n) {
  double length = tw_length(vector, n);
  if (length > 0)
    for (int i = 0; i < n; i++) vector[i] /= length;
  return length;
}

tw_arc tw_arc_between(const double a[4], const double b[4]) {
  tw_arc arc;
  double cosine = quat_dot(a, b);
  memcpy(arc.from, a, sizeof arc.from);
  for (int i = 0; i < 4; i++) arc.toward[i] = b[i] - a[i] * cosine;
  double sine = tw_normalize(arc.toward, 4);
  if (sine > 1e-12) {
    arc.angle = atan2(sine, cosine);
    return arc;
  }
  /* Parallel: what is left of b is rounding. */
  const double across[4] = {-a[1], a[0], -a[3], a[2]};
  memcpy(arc.toward, across, sizeof arc.toward);
  arc.angle = cosine < 0 ? acos(-1.0) : 0;
  return arc;
}

void tw_arc_at(const tw_arc *arc, double u, double out[4]) {
  double c = cos(arc->angle * u), s = sin(arc->angle * u);
  for (int i = 0; i < 4; i++) out[i] = arc->from[i] * c + arc->toward[i] * s;
}

double tw_angle_between(const double a[4], const double b[4]) {
  double difference = 0, sum = 0;
  for (int i = 0; i < 4; i++) {
    difference += (a[i] - b[i]) * (a[i] - b[i]);
    sum += (a[i] + b[i]) * (a[i] + b[i]);
  }
  return 4 * atan2(sqrt(fmin(difference, sum)), sqrt(fmax(difference, sum)));
}

void tw_quat_log(const double q[4], double out[3]) {
  double length = tw_length(q, 3);
  double scale = length > 0 ? atan2(length, q[3]) / length : 0;
  for (int i = 0; i < 3; i++) out[i] = q[i] * scale;
}

void tw_quat_exp(const double v[3], double out[4]) {
  double angle = tw_length(v, 3);
  double scale = angle > 0 ? sin(angle) / angle : 1;
  for (int i = 0; i < 3; i++) out[i] = v[i] * scale;
  out[3] = cos(angle);
}

void tw_quat_axis_angle(const double axis[3], double angle, double out[4]) {
  double s = sin(angle / 2);
  for (int i = 0; i < 3; i++) out[i] = axis[i] * s;
  out[3] = cos(angle / 2);
}

void tw_quat_multiply(const float a[4], const float b[4], float out[4]) {
  double p[4], q[4];
  quat_widen(a, p);
  quat_widen(b, q);
  quat_multiply(p, q, p);
  quat_narrow(p, out);
}

void tw_quat_inverse(const float q[4], float out[4]) {
  for (int i = 0; i < 3; i++) out[i] = -q[i];
  out[3] = q[3];
}

void tw_quat_from_axis_angle(const double axis[3], double angle, float out[4]) {
  double unit[3] = {axis[0], axis[1], axis[2]}, q[4];
  tw_normalize(unit, 3);
  tw_quat_axis_angle(unit, angle, q);
  if (tw_normalize(q, 4) == 0) q[3] = 1; /* a zero axis */
  quat_narrow(q, out);
}

void tw_quat_to_axis_angle(const float q[4], float out[4]) {
  double p[4];
  quat_widen(q, p);
  if (p[3] < 0)
    for (int i = 0; i < 4; i++) p[i] = -p[i];
  double sine = tw_normalize(p, 3);
  if (sine == 0) p[0] = 1;
  p[3] = 2 * atan2(sine, p[3]);
  quat_narrow(p, out);
}

void tw_quat_to_matrix3(const float q[4], float out[9]) {
  quat_matrix(q, out);
}

/* Starts from the largest of the four components, so nothing small is divided by (Shepperd 1978). */
void tw_quat_from_matrix3(const float m[9], float out[4]) {
  double xx = (double)m[0], yy = (double)m[4], zz = (double)m[8], q[4];
  double yz = (double)m[5], zy = (double)m[7], zx = (double)m[6], xz = (double)m[2];
  double xy = (double)m[1], yx = (double)m[3];
  if (xx + yy + zz > 0) {
    const double w[4] = {yz - zy, zx - xz, xy - yx, 1 + xx + yy + zz};
    memcpy(q, w, sizeof q);
  } else if (xx >= yy && xx >= zz) {
    const double x[4] = {1 + xx - yy - zz, xy + yx, zx + xz, yz - zy};
    memcpy(q, x, sizeof q);
  } else if (yy >= zz) {
    const double y[4] = {xy + yx, 1 - xx + yy - zz, yz + zy, zx - xz};
    memcpy(q, y, sizeof q);
  } else {
    const double z[4] = {zx + xz, yz + zy, 1 - xx - yy + zz, xy - yx};
    memcpy(q, z, sizeof q);
  }
  if (tw_normalize(q, 4) == 0) q[3] = 1;
  quat_narrow(q, out);
}

/* v + 2 r x (r x v + w v), r the vector part. */
void tw_quat_rotate(const float q[4], const float point[3], float out[3]) {
  double r[4], v[3] = {(double)point[0], (double)point[1], (double)point[2]}, t[3];
  quat_widen(q, r);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    t[i] = r[j] * v[k] - r[k] * v[j] + r[3] * v[i];
  }
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    out[i] = (float)(v[i] + 2 * (r[j] * t[k] - r[k] * t[j]));
  }
}

void tw_quat_slerp(const float a[4], const float b[4], float u, float out[4]) {
  double p[4], q[4];
  quat_widen(a, p);
  quat_widen(b, q);
  tw_normalize(p, 4);
  tw_normalize(q, 4);
  if (quat_dot(p, q) < 0)
    for (int i = 0; i < 4; i++) q[i] = -q[i];
  tw_arc arc = tw_arc_between(p, q);
  tw_arc_at(&arc, (double)u, p);
  quat_narrow(p, out);
}
