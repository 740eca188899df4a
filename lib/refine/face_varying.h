/* The connectivity of values of corners, as texture coordinates are. */
#ifndef TWEEND_FACE_VARYING_H
#define TWEEND_FACE_VARYING_H

#include "topology.h"
#include "tweend/subdiv.h"

/* Makes the topology of a cage's values of corners, sharpened by the interpolation rule. cage: the points'
 * topology, sharpened. values: [corners] index of the value at each. TW_NO_MEMORY.
 * *values_of: [topology vertices], index of each vertex's value. */
tw_status tw_channel_topology(const tw_topology *cage, const uint32_t *values, tw_uv_rule rule,
                              tw_arena *arena, tw_topology *out, uint32_t **values_of);

#endif
