/* What the processor has beyond what every one has. Kernels are compiled for several sets of instructions,
 * and the best one that is there is taken at run time. */
#ifndef TWEEND_PROCESSOR_H
#define TWEEND_PROCESSOR_H

#include <stdbool.h>
#include <stdint.h>

/* Kernels stand in this order in their tables. */
enum { TW_SET_ANY, TW_SET_AVX2, TW_SETS };

bool tw_processor_has(uint32_t set);

#endif
