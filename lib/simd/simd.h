/* What all vector code shares: points as vectors, and what the processor has. */
#ifndef TWEEND_SIMD_H
#define TWEEND_SIMD_H

#include <stdbool.h>
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

/* Instruction sets that kernels are compiled for, in the order of their tables; the best one that the
 * processor has is taken at run time. */
enum { TW_SET_ANY, TW_SET_AVX2, TW_SETS };

bool tw_processor_has(uint32_t set);

#endif
