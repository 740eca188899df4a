/* The last level of a Loop mesh: normals and triangles computed from the connectivity of the level above. The
 * last level stores its points only; its connectivity follows by the arithmetic in loop.h. */
#ifndef TWEEND_LOOP_ROWS_H
#define TWEEND_LOOP_ROWS_H

#include "child.h"
#include "limit.h"

/* Whether normals of level `levels` + 1 can be computed this way: all sharpness has decayed by then, and
 * every point has one normal. rules: of the cage. */
bool tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t levels);

/* The counts of the level below `above`, without arrays. They must be within 32 bits. */
tw_topology tw_loop_rows_counts(const tw_topology *above);

/* Unit normals of the limit surface at points [first, first + count) of the level, `stride` floats apart.
 * points: [vertices of the level][3]. mask: room for the largest mask of a vertex of `above`
 * (tw_limit_greatest_capacity). */
void tw_loop_rows_normals(const tw_topology *above, const double *points, uint32_t first, uint32_t count,
                          tw_limit_entry *mask, float *out, uint32_t stride);

/* The unit normal at a smooth vertex of valence 6 from its neighbours, counter-clockwise. */
void tw_loop_regular_normal(const double *own, const double *const ring[6], float *normal);

/* Corners of triangles [first, first + count). out: [count][3]. */
void tw_loop_rows_triangles(const tw_topology *above, uint32_t first, uint32_t count, uint32_t *out);

#endif
