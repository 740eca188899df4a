/* Vectors of 16 bytes, four floats or two doubles, by the compiler's vector extension. A point is four
 * floats. */
#ifndef TWEEND_SIMD_H
#define TWEEND_SIMD_H

#include <stdint.h>
#include <string.h>

/* A point as a vector of four floats, of which the last means nothing: each operation is one of all
 * coordinates. In memory points stay rows of three. */
typedef float tw_point __attribute__((vector_size(16)));
typedef double tw_point_halves __attribute__((vector_size(16)));

static inline void tw_store_point(tw_point point, float *row) {
  double two = ((tw_point_halves)point)[0]; /* of its floats, as one number */
  memcpy(row, &two, sizeof two);
  row[2] = point[2];
}

/* width: 1 to 4, so many of its floats. */
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

/* The same back, the rest 0. */
static inline tw_point tw_load_values(const float *row, uint32_t width) {
  if (width == 3) return (tw_point){row[0], row[1], row[2], 0}; /* most of all; in registers */
  tw_point out = {0};
  memcpy(&out, row, width * sizeof *row);
  return out;
}

#endif
