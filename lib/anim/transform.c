/* Translation, rotation, scale against 4 x 4 matrices. */
#include "quat.h"

#include <math.h>
#include <string.h>

/* Cosine between two axes from which they count as sheared: ten times what products of single
 * precision rotations leave. */
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

static double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double determinant(double m[3][3]) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
         m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

/* Turns rows and columns p and q of the symmetric k so that k[p][q] vanishes; vectors gathers the
 * turns. By roots alone, which round alike on all processors, as sines of the C library do not: where scales
 * are 0, many rotations agree as well, and the last bit would choose among them. */
static void jacobi_turn(double k[4][4], double vectors[4][4], int p, int q) {
  static const double NOTHING = 1e-100; /* beside axes of length 1; its square is a number yet */
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

/* The rotation whose axes agree best with the given ones, zero axes having no say: the eigenvector of
 * the largest eigenvalue of Davenport's matrix (Wahba's problem), found by Jacobi's turns. */
static void best_rotation(double axes[3][3], double out[4]) {
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
    if (fabs(dot(axes[i], axes[(i + 1) % 3])) > SHEAR) return true;
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
  if (determinant(axes) < 0)
    for (int j = 0; j < 3; j++) axes[0][j] = -axes[0][j];
  best_rotation(axes, q);
  quat_narrow(q, out->rotation);
  if (out->rotation[3] < 0)
    for (int i = 0; i < 4; i++) out->rotation[i] = -out->rotation[i];
  float rotation[9];
  quat_matrix(out->rotation, rotation);
  for (size_t i = 0; i < 3; i++) {
    const double axis[3] = {(double)rotation[3 * i], (double)rotation[3 * i + 1],
                            (double)rotation[3 * i + 2]};
    /* Along an axis that agrees, the length itself: free of the rotation's rounding. */
    double along = dot(axis, columns[i]), length = tw_length(columns[i], 3);
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
