/* The last level of a Loop mesh: normals and triangles straight from the connectivity above it. Nothing is
 * built of the level but its points; how they are joined follows by the arithmetic that loop.h tells of. */
#ifndef TWEEND_LOOP_ROWS_H
#define TWEEND_LOOP_ROWS_H

#include "child.h"
#include "limit.h"

/* Whether normals can be computed this way for level `levels` + 1: all sharpness has decayed by then, and
 * every point has one normal. */
bool tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t levels);

/* Counts of the level, without arrays. They must be within 32 bits. */
tw_topology tw_loop_rows_counts(const tw_topology *above);

/* Unit normals of the limit surface at points [first, first + count) of the level, `stride` floats apart.
 * points: all of them, [][3]. mask: room for the largest of a vertex above (tw_limit_capacity). */
void tw_loop_rows_normals(const tw_topology *above, const double *points, uint32_t first, uint32_t count,
                          tw_limit_entry *mask, float *out, uint32_t stride);

/* Corners of triangles [first, first + count). out: [count][3]. */
void tw_loop_rows_triangles(const tw_topology *above, uint32_t first, uint32_t count, uint32_t *out);

#endif
