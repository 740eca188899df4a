/* Computes unit normals where float alone does not suffice. */
#include "normal.h"

#include "vector3.h"

/* Computes the normal in double from scaled tangents, for lengths that float cannot square. False where a
 * tangent has no finite length above 0, or where they are parallel. */
static bool find_normal(tw_point a, tw_point b, float out[3]) {
  double scale_a = 0, scale_b = 0;
  for (int i = 0; i < 3; i++) {
    scale_a = fmax(scale_a, fabs((double)a[i]));
    scale_b = fmax(scale_b, fabs((double)b[i]));
  }
  if (!(scale_a > 0) || !(scale_b > 0) || !isfinite(scale_a) || !isfinite(scale_b)) return false;
  double u[3], v[3], n[3];
  for (int i = 0; i < 3; i++) {
    u[i] = a[i] / scale_a;
    v[i] = b[i] / scale_b;
  }
  tw_cross3(u, v, n);
  double square = tw_dot3(n, n);
  if (!(square > 1e-12)) return false; /* parallel, as far as float can tell */
  for (int i = 0; i < 3; i++) out[i] = (float)(n[i] / sqrt(square));
  return true;
}

void tw_careful_normal(tw_point tangent1, tw_point tangent2, const tw_point quad[4], float normal[3]) {
  if (find_normal(tangent1, tangent2, normal)) return;
  if (find_normal(quad[2] - quad[0], quad[3] - quad[1], normal)) return;
  normal[0] = normal[2] = 0;
  normal[1] = 1;
}
