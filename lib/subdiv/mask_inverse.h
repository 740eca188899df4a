/* From the values of a level back to those of the level above. */
#ifndef TWEEND_MASK_INVERSE_H
#define TWEEND_MASK_INVERSE_H

#include "crease.h"
#include "parallel_for.h"

/* Values of the parent's vertices whose child's values, by tw_refine_values, are nearest to the given ones:
 * their squared distances have the least sum. Of several such, those nearest to the mean of the given values.
 * child: [child vertices][width] in the numbers of catmull_clark.h or loop.h; width 1 to 4. out: [parent
 * vertices][width]. *error: the greatest distance between a given value and that of the answer.
 * A step is a sparse matrix, its rows the masks, whose least squares conjugate gradients find; they take
 * about a hundred rounds of O(masks). parallel: asked between rounds whether the result is still wanted; or
 * NULL. TW_LIMIT, TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_invert_masks(const tw_topology *parent, const tw_rules *rules, uint32_t width,
                          const double *child, const tw_parallel_for *parallel, double *out, double *error);

#endif
