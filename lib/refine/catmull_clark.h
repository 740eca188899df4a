/* One level of Catmull-Clark or bilinear subdivision of any polygon mesh, with creases.
 *
 * The numbers of a child level follow by arithmetic from those of its parent level (V, E, F: the parent's
 * counts):
 * vertices: 0.. for vertices, V.. for edges, V + E.. for faces;
 * faces:    quad c for corner c: its vertex, the middle of its edge, the face point, the middle of the
 * previous edge;
 * edges:    2e and 2e + 1 for edge e (at its first and second end), 2E + c from the middle of corner c's edge
 * to the face point.
 *
 * Rules: Catmull and Clark 1978; creases DeRose, Kass and Truong 1998, with the blend at fractional sharpness
 * and the Chaikin decay as OpenSubdiv defines them. */
#ifndef TWEEND_CATMULL_CLARK_H
#define TWEEND_CATMULL_CLARK_H

#include "child.h"

/* Topology and sharpness of the next level. The parent's sharpness must be set. TW_LIMIT, TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_catmull_clark_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                                    const tw_parallel_for *parallel, tw_topology *child);

/* As tw_refine_mask. */
uint32_t tw_catmull_clark_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child,
                               tw_share *shares);

#endif
