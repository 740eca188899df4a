/* The inverse of a step: from the values of a level back to those of the level above. */
#ifndef TWEEND_MASK_INVERSE_H
#define TWEEND_MASK_INVERSE_H

#include "crease.h"
#include "parallel_for.h"

/* Finds the parent's values from which tw_refine_values makes values nearest to the given ones: least
 * squares. Of several solutions it takes the one nearest to the mean of the given values.
 * child: [child vertices][width] in the numbers of catmull_clark.h or loop.h; width 1 to 4. out: [parent
 * vertices][width]. *error: the greatest distance between a given value and the refined solution.
 * A step is a sparse matrix whose rows are the masks. Conjugate gradients solve the least-squares problem in
 * about a hundred rounds of O(masks). parallel: asked between rounds whether the result is still wanted; or
 * NULL. TW_LIMIT, TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_invert_masks(const tw_topology *parent, const tw_rules *rules, uint32_t width,
                          const double *child, const tw_parallel_for *parallel, double *out, double *error);

#endif
