/* Points as vectors of four floats, of which the last means nothing: each operation is one of all
 * coordinates. In memory points stay rows of three. */
#ifndef TWEEND_POINT_H
#define TWEEND_POINT_H

#include <string.h>

typedef float tw_point __attribute__((vector_size(16)));
typedef double tw_point_halves __attribute__((vector_size(16)));

/* Reads one float more than the row: behind the last row of an array there has to be one. */
static inline tw_point tw_load_point(const float *row) {
  tw_point point;
  memcpy(&point, row, sizeof point);
  return point;
}

static inline void tw_store_point(tw_point point, float *row) {
  double two = ((tw_point_halves)point)[0]; /* of its floats, as one number */
  memcpy(row, &two, sizeof two);
  row[2] = point[2];
}

/* The same for a row that another one is stored behind later: writes one float more. */
static inline void tw_store_inner_point(tw_point point, float *row) {
  memcpy(row, &point, sizeof point);
}

#endif
