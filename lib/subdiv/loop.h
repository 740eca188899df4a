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
#include <stdint.h>

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

/* ---- sums --------------------------------------------------------------------------------------- */

/* The masks of Loop's scheme, as sums of points that are found in one way or another. */

enum { TW_LOOP_WIDTH_MAX = 4 };

static inline void tw_loop_add(double *restrict sum, const double *in, uint32_t width) {
  for (uint32_t i = 0; i < width; i++) sum[i] += in[i];
}

/* The middle of a smooth edge from a to b between triangles that face it with c and d. */
static inline void tw_loop_smooth_middle(const double *a, const double *b, const double *c, const double *d,
                                         uint32_t width, double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.375 * (a[i] + b[i]) + 0.125 * (c[i] + d[i]);
}

static inline void tw_loop_sharp_middle(const double *a, const double *b, uint32_t width,
                                        double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.5 * (a[i] + b[i]);
}

/* A vertex of a crease, between its neighbours there. */
static inline void tw_loop_crease(const double *own, const double *a, const double *b, uint32_t width,
                                  double *restrict out) {
  for (uint32_t i = 0; i < width; i++) out[i] = 0.75 * own[i] + 0.125 * (a[i] + b[i]);
}

/* A smooth vertex, of whose neighbours `ring` is the sum. */
static inline void tw_loop_smooth(const double *own, const double *ring, uint32_t valence, double weight,
                                  uint32_t width, double *restrict out) {
  double own_weight = 1 - valence * weight;
  for (uint32_t i = 0; i < width; i++) out[i] = own_weight * own[i] + weight * ring[i];
}

#endif
