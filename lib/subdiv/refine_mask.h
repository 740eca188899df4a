/* The generic step as numbers: what each new vertex is made of. For values that are not rows of floats, and
 * for rows in double; floats go faster through tw_refine_values, which follows the same rules. */
#ifndef TWEEND_REFINE_MASK_H
#define TWEEND_REFINE_MASK_H

#include "refine.h"

/* A share of one of the parent's vertices or, from vertex_count + edge_count on, of the child's vertex of
 * that number, which is a face point. */
typedef struct tw_share {
  uint32_t vertex;
  float weight;
} tw_share;

/* Shares that the largest mask has. O(parent). */
uint32_t tw_refine_mask_capacity(const tw_topology *parent);

/* Fills in the shares of a vertex of the child, which sum to 1, and returns their number. No vertex comes
 * up twice but for the ends of doubled edges. */
uint32_t tw_refine_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

/* The same for Loop's scheme, whose children are all made of the parent's vertices. */
uint32_t tw_loop_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

/* tw_refine_values in double, for differences between points that lie close together. TW_NO_MEMORY. */
tw_status tw_refine_exact(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                          const tw_parallel_for *parallel, double *out);

#endif
