/* Vectors of 16 bytes, four floats or two doubles, as the compiler's vector extension has them. A point is
 * four floats. */
#ifndef TWEEND_SIMD_H
#define TWEEND_SIMD_H

#include <stdint.h>
#include <string.h>

/* A point as four floats, so that one operation handles all coordinates; the last float has no meaning. In
 * memory points remain rows of three floats. */
typedef float tw_point __attribute__((vector_size(16)));
typedef double tw_point_halves __attribute__((vector_size(16)));

static inline void tw_store_point(tw_point point, float *row) {
  double two = ((tw_point_halves)point)[0]; /* its first two floats as one double */
  memcpy(row, &two, sizeof two);
  row[2] = point[2];
}

/* Stores the first `width` floats, 1 to 4. */
static inline void tw_store_values(tw_point values, uint32_t width, float *row) {
  if (width == 3)
    tw_store_point(values, row);
  else if (width == 2)
    memcpy(row, &values, 2 * sizeof *row);
  else if (width == 1)
    row[0] = values[0];
  else
    memcpy(row, &values, sizeof values);
}

/* Widens a box, its low and its high corner, by a point. */
static inline void tw_box_widen(tw_point box[2], tw_point point) {
  typedef int32_t lanes __attribute__((vector_size(16)));
  const lanes low = point<box[0], high = point> box[1];
  box[0] = (tw_point)(((lanes)point & low) | ((lanes)box[0] & ~low));
  box[1] = (tw_point)(((lanes)point & high) | ((lanes)box[1] & ~high));
}

/* Loads `width` floats, 1 to 4; the others become 0. */
static inline tw_point tw_load_values(const float *row, uint32_t width) {
  if (width == 3) return (tw_point){row[0], row[1], row[2], 0}; /* the usual width; in registers */
  tw_point out = {0};
  memcpy(&out, row, width * sizeof *row);
  return out;
}

#endif
