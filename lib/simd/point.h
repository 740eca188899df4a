/* Points as vectors of four floats, of which the last means nothing: each operation is one of all
 * coordinates. In memory points stay rows of three. */
#ifndef TWEEND_POINT_H
#define TWEEND_POINT_H

#include <string.h>

typedef float tw_point __attribute__((vector_size(16)));
typedef double tw_point_halves __attribute__((vector_size(16)));

static inline void tw_store_point(tw_point point, float *row) {
  double two = ((tw_point_halves)point)[0]; /* of its floats, as one number */
  memcpy(row, &two, sizeof two);
  row[2] = point[2];
}

#endif
