/* One level of Loop's subdivision of a mesh of triangles, with creases.
 *
 * Numbers of a level follow from those of the level above by arithmetic (V, E its counts):
 * vertices: 0.. of vertices, V.. of the middles of edges;
 * faces:    4f + i at corner i of face f, which stays the child's corner i; 4f + 3 amid those, whose corner
 *           i faces child i;
 * edges:    2e and 2e + 1 of edge e (at its first and second end), 2E + c across the face of corner c,
 *           between the middles of the edges that meet there.
 *
 * Rules: Loop 1987; the masks at creases, corners and borders are those of all schemes (crease.h). */
#ifndef TWEEND_LOOP_H
#define TWEEND_LOOP_H

#include "crease.h"
#include "parallel_for.h"

/* Topology and sharpness of the next level; TW_LIMIT, TW_NO_MEMORY. The parent's sharpness must be set. */
tw_status tw_loop_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                           const tw_parallel_for *parallel, tw_topology *child);

/* Values of the next level: in [parent vertices][width], out [child vertices][width]; width 1 to 4. In
 * double, because levels come on top of each other to the end: rounding must stay small beside triangles that
 * shrink with each. */
void tw_loop_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                    const tw_parallel_for *parallel, double *out);

/* The same for `count` rows of the child from `first` on. out: [count][width]. */
void tw_loop_some_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                         uint32_t first, uint32_t count, double *out);

/* How far the smooth rule at a vertex of this valence moves it towards the sum of its neighbours. */
double tw_loop_weight(uint32_t valence);

#endif
