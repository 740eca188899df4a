/* One step to the next level, in either scheme (catmull_clark.h, loop.h). */
#ifndef TWEEND_REFINE_H
#define TWEEND_REFINE_H

#include "child.h"

/* Topology and sharpness of the next level. The parent's sharpness must be set. TW_LIMIT, TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_refine_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                             const tw_parallel_for *parallel, tw_topology *child);

/* Number of shares in the largest mask, or a few more. O(parent). */
uint32_t tw_refine_mask_capacity(const tw_topology *parent);

/* Writes the shares of a child's vertex, which sum to 1, and returns their number. A vertex comes up twice
 * only where edges are doubled. */
uint32_t tw_refine_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

/* Number of the child's vertices that are face points; they come last. Loop's scheme has none. */
static inline uint32_t tw_refine_face_points(const tw_topology *parent, const tw_rules *rules) {
  return rules->loop ? 0 : parent->face_count;
}

/* in: [parent vertices][width], out: [child vertices][width]; width 1 to 4. In double, because each level
 * builds on the one above: its rounding errors must stay small beside faces that shrink with each level.
 * TW_NO_MEMORY. */
tw_status tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                           const tw_parallel_for *parallel, double *out);

#endif
