/* Normals of many tangents, four at a time. */
#include "normal_rows.h"

#include <math.h>

#include "normal.h"

typedef int32_t mask __attribute__((vector_size(16)));

/* One coordinate of four points each. */
typedef struct lanes {
  tw_point x, y, z;
} lanes;

static inline lanes lanes_of(const tw_point *points) {
  tw_point low = __builtin_shufflevector(points[0], points[1], 0, 4, 1, 5),
           high = __builtin_shufflevector(points[2], points[3], 0, 4, 1, 5),
           z_low = __builtin_shufflevector(points[0], points[1], 2, 6, 2, 6),
           z_high = __builtin_shufflevector(points[2], points[3], 2, 6, 2, 6);
  return (lanes){__builtin_shufflevector(low, high, 0, 1, 4, 5),
                 __builtin_shufflevector(low, high, 2, 3, 6, 7),
                 __builtin_shufflevector(z_low, z_high, 0, 1, 4, 5)};
}

static inline void points_of(const lanes *l, tw_point *points) {
  tw_point low = __builtin_shufflevector(l->x, l->y, 0, 4, 1, 5),
           high = __builtin_shufflevector(l->x, l->y, 2, 6, 3, 7);
  points[0] = __builtin_shufflevector(low, l->z, 0, 1, 4, 4);
  points[1] = __builtin_shufflevector(low, l->z, 2, 3, 5, 5);
  points[2] = __builtin_shufflevector(high, l->z, 0, 1, 6, 6);
  points[3] = __builtin_shufflevector(high, l->z, 2, 3, 7, 7);
}

static inline tw_point dot(const lanes *a, const lanes *b) {
  return a->x * b->x + a->y * b->y + a->z * b->z;
}

static inline tw_point root(tw_point square) {
  tw_point out;
  for (int l = 0; l < 4; l++) out[l] = sqrtf(square[l]);
  return out;
}

/* Four unit normals, by the arithmetic of tw_normal_from_tangents where that is quick. Clears lanes of `sure`
 * that need a closer look. */
static inline lanes cross(const tw_point *along1, const tw_point *along2, mask *sure) {
  lanes a = lanes_of(along1), b = lanes_of(along2);
  lanes n = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  tw_point square = dot(&n, &n), lengths = dot(&a, &a) * dot(&b, &b);
  *sure &= (square > lengths * 1e-6f) & (square > 1e-24f) & (square < TW_NORMAL_SQUARE_MAX);
  tw_point scale = 1 / root(square);
  return (lanes){n.x * scale, n.y * scale, n.z * scale};
}

/* A point and its normal. */
static inline void put_row(tw_point point, tw_point normal, float *row) {
  tw_point rest = __builtin_shufflevector(point, normal, 2, 4, 5, 6);
  memcpy(row, &point, sizeof point);
  memcpy(row + 2, &rest, sizeof rest);
}

bool tw_normal_put_rows(tw_normal_batch *batch, uint32_t from, uint32_t to, const float *points,
                        float *restrict out) {
  tw_point(*along)[TW_NORMAL_BATCH + TW_NORMAL_SPARE] = batch->along;
  for (uint32_t i = to; i < to + TW_NORMAL_SPARE; i++)
    for (int k = 0; k < 2; k++) along[k][i] = along[k][to - 1];
  mask sure = {-1, -1, -1, -1};
  for (uint32_t i = from; i < to; i += 4) {
    tw_point normals[4];
    lanes four = cross(along[0] + i, along[1] + i, &sure);
    points_of(&four, normals);
    for (uint32_t k = i; k < i + 4 && k < to; k++, out += TW_NORMAL_ROW)
      put_row(tw_load_point(points + 3 * (size_t)k), normals[k - i], out);
  }
  return (sure[0] & sure[1] & sure[2] & sure[3]) != 0;
}

void tw_normal_look_closer(const tw_normal_batch *batch, uint32_t i, const float *const quad[4],
                           float normal[3]) {
  tw_normal_from_tangents((const float *)&batch->along[0][i], (const float *)&batch->along[1][i], quad,
                          normal);
}
