/* Values of the next level, in either scheme. */
#ifndef TWEEND_REFINE_H
#define TWEEND_REFINE_H

#include "crease.h"
#include "parallel_for.h"

/* in: [parent vertices][width], out: [child vertices][width]; width 1 to 4. In double, because levels come on
 * top of each other: rounding stays small beside faces that shrink with each. TW_NO_MEMORY. */
tw_status tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                           const tw_parallel_for *parallel, double *out);

#endif
