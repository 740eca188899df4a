/* Rotation algebra, and conversion between TRS and 4 x 4 matrices. Arguments are in single precision,
 * computation in double: inputs are few and errors add up. */
#include "quat.h"

#include <math.h>
#include <string.h>

#include "vector3.h"

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

double tw_quat_key_scale(const double key[4], const double *previous) {
  static const double tolerance = 1e-6;
  double length = tw_length(key, 4), sign = previous && quat_dot(key, previous) < 0 ? -1 : 1;
  return fabs(length - 1) <= tolerance ? sign : sign / length;
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
  /* Parallel: the remainder of b is rounding error. */
  const double across[4] = {-a[1], a[0], -a[3], a[2]};
  memcpy(arc.toward, across, sizeof arc.toward);
  arc.angle = cosine < 0 ? acos(-1.0) : 0;
  return arc;
}

tw_arc tw_arc_short(const double a[4], const double b[4]) {
  double sign = quat_dot(a, b) < 0 ? -1 : 1;
  const double nearer[4] = {sign * b[0], sign * b[1], sign * b[2], sign * b[3]};
  return tw_arc_between(a, nearer);
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

void tw_axis_angle_of(const double q[4], double out[4]) {
  for (int i = 0; i < 4; i++) out[i] = q[3] < 0 ? -q[i] : q[i];
  double sine = tw_normalize(out, 3);
  if (sine == 0) out[0] = 1;
  out[3] = 2 * atan2(sine, out[3]);
}

void tw_quat_to_axis_angle(const float q[4], float out[4]) {
  double p[4], turn[4];
  quat_widen(q, p);
  tw_axis_angle_of(p, turn);
  quat_narrow(turn, out);
}

/* ---- transforms ------------------------------------------------------------------------------ */

/* Two axes with a cosine above this are sheared: ten times what products of single precision rotations
 * leave. */
static const double SHEAR = 1e-5;

void tw_trs_to_matrix(const tw_trs *trs, float out[16]) {
  float rotation[9];
  quat_matrix(trs->rotation, rotation);
  for (size_t column = 0; column < 3; column++) {
    for (size_t row = 0; row < 3; row++)
      out[4 * column + row] = rotation[3 * column + row] * trs->scale[column];
    out[4 * column + 3] = 0;
    out[12 + column] = trs->translation[column];
  }
  out[15] = 1;
}

/* One Jacobi rotation: turns rows and columns p and q of the symmetric k so that k[p][q] becomes 0; `vectors`
 * accumulates the turns. Uses square roots only: unlike the C library's sines, they round alike on all
 * processors. Where scales are 0, many rotations fit equally well, and the last bit would choose among
 * them. */
static void jacobi_turn(double k[4][4], double vectors[4][4], int p, int q) {
  static const double NOTHING =
      1e-100; /* negligible beside axes of length 1; its square does not underflow */
  if (fabs(k[p][q]) < NOTHING) return;
  double x = k[q][q] - k[p][p], y = 2 * k[p][q], length = sqrt(x * x + y * y);
  double larger = sqrt((length + fabs(x)) / (2 * length)), smaller = fabs(y) / (2 * length * larger);
  double c = x < 0 ? smaller : larger, s = copysign(x < 0 ? larger : smaller, y);
  for (int i = 0; i < 4; i++) {
    double kp = k[i][p], kq = k[i][q], vp = vectors[i][p], vq = vectors[i][q];
    k[i][p] = c * kp - s * kq;
    k[i][q] = s * kp + c * kq;
    vectors[i][p] = c * vp - s * vq;
    vectors[i][q] = s * vp + c * vq;
  }
  for (int i = 0; i < 4; i++) {
    double kp = k[p][i], kq = k[q][i];
    k[p][i] = c * kp - s * kq;
    k[q][i] = s * kp + c * kq;
  }
}

/* The result is the eigenvector of the largest eigenvalue of Davenport's matrix (Wahba's problem), found by
 * Jacobi rotations. */
void tw_quat_best(double axes[3][3], double out[4]) {
  double trace = axes[0][0] + axes[1][1] + axes[2][2];
  double k[4][4], vectors[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) k[i][j] = axes[i][j] + axes[j][i] - (i == j ? trace : 0);
    int next = (i + 1) % 3, last = (i + 2) % 3;
    k[i][3] = k[3][i] = axes[next][last] - axes[last][next];
  }
  k[3][3] = trace;
  for (int sweep = 0; sweep < 12; sweep++)
    for (int p = 0; p < 3; p++)
      for (int q = p + 1; q < 4; q++) jacobi_turn(k, vectors, p, q);
  int best = 3;
  for (int i = 0; i < 3; i++)
    if (k[i][i] > k[best][best]) best = i;
  for (int i = 0; i < 4; i++) out[i] = vectors[i][best];
}

static bool has_shear(double axes[3][3]) {
  for (int i = 0; i < 3; i++)
    if (fabs(tw_dot3(axes[i], axes[(i + 1) % 3])) > SHEAR) return true;
  return false;
}

bool tw_trs_from_matrix(const float m[16], tw_trs *out) {
  double columns[3][3], axes[3][3], q[4];
  bool exact = m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) columns[i][j] = axes[i][j] = (double)m[4 * i + j];
    if (tw_normalize(axes[i], 3) == 0) exact = false;
  }
  if (has_shear(axes)) exact = false;
  if (tw_determinant3(axes[0], axes[1], axes[2]) < 0)
    for (int j = 0; j < 3; j++) axes[0][j] = -axes[0][j];
  tw_quat_best(axes, q);
  quat_narrow(q, out->rotation);
  if (out->rotation[3] < 0)
    for (int i = 0; i < 4; i++) out->rotation[i] = -out->rotation[i];
  float rotation[9];
  quat_matrix(out->rotation, rotation);
  for (size_t i = 0; i < 3; i++) {
    const double axis[3] = {(double)rotation[3 * i], (double)rotation[3 * i + 1],
                            (double)rotation[3 * i + 2]};
    /* Where TRS can hold the matrix exactly, takes the column's length itself, which is free of the
     * rotation's rounding. */
    double along = tw_dot3(axis, columns[i]), length = tw_length(columns[i], 3);
    out->scale[i] = (float)(exact ? copysign(length, along) : along);
    out->translation[i] = m[12 + i];
  }
  return exact;
}

void tw_matrix_multiply(const float a[16], const float b[16], float out[16]) {
  float product[16];
  for (size_t column = 0; column < 4; column++) {
    const float *factors = b + 4 * column;
    for (size_t row = 0; row < 4; row++)
      product[4 * column + row] =
          a[row] * factors[0] + a[4 + row] * factors[1] + a[8 + row] * factors[2] + a[12 + row] * factors[3];
  }
  memcpy(out, product, sizeof product);
}

void tw_matrix_move(const float m[16], float point[3]) {
  const double from[3] = {(double)point[0], (double)point[1], (double)point[2]};
  for (int row = 0; row < 3; row++) {
    double sum = (double)m[12 + row];
    for (int column = 0; column < 3; column++) sum += (double)m[4 * column + row] * from[column];
    point[row] = (float)sum;
  }
}
