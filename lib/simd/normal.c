/* Normals of any two tangents: quickly where float suffices, else with care. */
#include "normal.h"

#include <math.h>

static void cross(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/* As cross and normalise, in double and scaled, for lengths that float cannot square. */
static bool careful_normal(const float a[3], const float b[3], float out[3]) {
  double scale_a = 0, scale_b = 0;
  for (int i = 0; i < 3; i++) {
    scale_a = fmax(scale_a, fabs((double)a[i]));
    scale_b = fmax(scale_b, fabs((double)b[i]));
  }
  if (!(scale_a > 0) || !(scale_b > 0) || !isfinite(scale_a) || !isfinite(scale_b)) return false;
  double u[3], v[3], n[3], square = 0;
  for (int i = 0; i < 3; i++) {
    u[i] = a[i] / scale_a;
    v[i] = b[i] / scale_b;
  }
  for (int i = 0; i < 3; i++) {
    n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    square += n[i] * n[i];
  }
  if (!(square > 1e-12)) return false; /* parallel as far as float can tell */
  for (int i = 0; i < 3; i++) out[i] = (float)(n[i] / sqrt(square));
  return true;
}

/* As wide.h has it. */
static bool quick_normal(const float a[3], const float b[3], float out[3]) {
  float n[3];
  cross(a, b, n);
  float square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  float lengths = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
  if (!(square > tw_normal_least_square(lengths) && square < TW_NORMAL_SQUARE_MAX)) return false;
  float scale = 1 / sqrtf(square);
  for (int i = 0; i < 3; i++) out[i] = n[i] * scale + 0.0f;
  return true;
}

void tw_normal_from_tangents(const float tangent1[3], const float tangent2[3], const float *const quad[4],
                             float normal[3]) {
  if (quick_normal(tangent1, tangent2, normal) || careful_normal(tangent1, tangent2, normal)) return;
  float diagonal1[3], diagonal2[3];
  for (int i = 0; i < 3; i++) {
    diagonal1[i] = quad[2][i] - quad[0][i];
    diagonal2[i] = quad[3][i] - quad[1][i];
  }
  if (careful_normal(diagonal1, diagonal2, normal)) return;
  normal[0] = normal[2] = 0;
  normal[1] = 1;
}
