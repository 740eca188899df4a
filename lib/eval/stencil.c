/* Sums of stencils, four points at a time: a vector holds one component of four points. Every point is summed
 * in the same order, wherever it lies in a vector and whatever else is computed. */
#include "stencil.h"

#include "normal.h"

enum { TOGETHER = 4, WIDTH_MAX = 4 };

static inline tw_point load(const float *from) {
  tw_point out;
  memcpy(&out, from, sizeof out);
  return out;
}

/* Sums even and odd control points apart: two independent sums halve the wait for each addition. */
static inline __attribute__((always_inline)) void sum_values(const tw_stencil_job *job, size_t width,
                                                             size_t point, tw_point out[WIDTH_MAX]) {
  const tw_stencil *s = job->stencil;
  const float *weights = s->values + point;
  tw_point even[WIDTH_MAX] = {{0}}, odd[WIDTH_MAX] = {{0}};
  for (size_t k = 0; k < s->control_count; k += 2, weights += 2 * (size_t)s->stride) {
    tw_point one = load(weights), other = load(weights + s->stride);
    for (size_t c = 0; c < width; c++) {
      even[c] += one * job->controls[k][c];
      odd[c] += other * job->controls[k + 1][c];
    }
  }
  for (size_t c = 0; c < width; c++) out[c] = job->origin[c] + (even[c] + odd[c]);
}

/* The cross products of the two tangents. */
static inline void sum_crosses(const tw_stencil_job *job, size_t point, tw_point out[3]) {
  const tw_stencil *s = job->stencil;
  const float *weights = s->tangents + point;
  tw_point a[3] = {{0}}, b[3] = {{0}};
  for (size_t k = 0; k < s->control_count; k++, weights += 2 * (size_t)s->stride) {
    tw_point one = load(weights), other = load(weights + s->stride);
    for (size_t c = 0; c < 3; c++) {
      a[c] += one * job->controls[k][c];
      b[c] += other * job->controls[k][c];
    }
  }
  for (size_t c = 0; c < 3; c++) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

/* The squared length from which cross products are precise enough. A tangent is at most as long as the
 * farthest control point is far, as the absolute values of its weights sum to at most 1. */
static float least_square(const tw_stencil_job *job) {
  float farthest = 0;
  for (uint32_t k = 0; k < job->stencil->control_count; k++) {
    float square = tw_point_square(job->controls[k]);
    if (square > farthest) farthest = square;
  }
  return tw_normal_least_square(10 * farthest * farthest);
}

static inline __attribute__((always_inline)) void put_values(const tw_stencil_job *job, size_t width,
                                                             size_t point, size_t count, float *out) {
  tw_point values[WIDTH_MAX];
  sum_values(job, width, point, values);
  for (size_t p = 0; p < count; p++, out += job->step)
    for (size_t c = 0; c < width; c++) out[c] = values[c][p];
}

/* Returns false where float is not precise enough for all of the normals. */
static inline bool put_normals(const tw_stencil_job *job, float least, size_t point, size_t count,
                               float *out) {
  tw_point n[3];
  sum_crosses(job, point, n);
  tw_point squares = n[0] * n[0] + n[1] * n[1] + n[2] * n[2], scales;
  bool sure = true;
  for (size_t p = 0; p < TOGETHER; p++) scales[p] = 1 / sqrtf(squares[p]);
  for (size_t c = 0; c < 3; c++) n[c] = n[c] * scales + 0.0f; /* turns -0 into 0 */
  for (size_t p = 0; p < count; p++, out += job->step) {
    sure &= squares[p] > least && squares[p] < TW_NORMAL_SQUARE_MAX;
    for (size_t c = 0; c < 3; c++) out[c] = n[c][p];
  }
  return sure;
}

bool tw_stencil_rows(const tw_stencil_job *job, size_t first, size_t count) {
  const tw_stencil_job k = *job; /* a copy: the compiler knows that stores to rows cannot change it */
  float least = k.normals ? least_square(job) : 0;
  ptrdiff_t place = 0;
  bool sure = true;
  for (size_t point = first, end = first + count; point < end;
       point += TOGETHER, place += TOGETHER * k.step) {
    size_t taken = end - point < TOGETHER ? end - point : TOGETHER;
    if (k.values && k.width == 3)
      put_values(&k, 3, point, taken, k.values + place);
    else if (k.values)
      put_values(&k, k.width, point, taken, k.values + place);
    if (k.normals && !put_normals(&k, least, point, taken, k.normals + place)) sure = false;
  }
  return sure;
}
