/* What patches cost that are worth it only when many points come of them: an estimate, from a cage alone. */
#ifndef TWEEND_PATCH_COST_H
#define TWEEND_PATCH_COST_H

#include "topology.h"

/* As many quads as the generic step makes in the time that planning patches takes, and splitting those that
 * are not regular. They begin at the cage where all its faces are quads, else at the first level. O(cage). */
uint64_t tw_patch_cost(const tw_topology *cage);

#endif
