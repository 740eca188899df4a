/* The last one or two levels of a Loop mesh: rows of points and triangles straight from the connectivity
 * above them. Nothing is built of those levels but the points of the level above the one asked for; how they
 * are joined follows by the arithmetic that loop.h tells of. */
#ifndef TWEEND_LOOP_ROWS_H
#define TWEEND_LOOP_ROWS_H

#include "child.h"
#include "limit.h"

typedef struct tw_loop_rows {
  tw_topology above;
  tw_rules rules;
  uint32_t levels; /* from there to the rows, 1 or 2; 0: not in use */
  bool normals;    /* are asked for */
} tw_loop_rows;

/* How many levels of a surface at `level` can be read so, whose cage this is: over two what is sharp has to
 * stay so. */
uint32_t tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t level);

/* Whether it can be read so with normals: all has decayed above, and every point has one normal. */
bool tw_loop_rows_fit_normals(const tw_topology *cage, const tw_rules *rules, uint32_t level);

/* Counts of the level, without arrays. Those of the answer must be within 32 bits. */
tw_topology tw_loop_rows_counts(const tw_loop_rows *rows);

/* Points that are kept: all of the level above the rows; with normals, or one level down, all rows. */
size_t tw_loop_rows_kept_count(const tw_loop_rows *rows);

/* Computes them. points: [vertices above][3]; kept: [tw_loop_rows_kept_count][3]. TW_NO_MEMORY. */
tw_status tw_loop_rows_keep(const tw_loop_rows *rows, const double *points, const tw_parallel_for *parallel,
                            double *kept);

/* Points [first, first + count) of the level, in the order of loop.h. */
void tw_loop_rows_points(const tw_loop_rows *rows, const double *kept, uint32_t first, uint32_t count,
                         float *out);

/* Unit normals of the limit surface at the same points, `stride` floats apart. mask: room for the largest of
 * a vertex above (tw_limit_capacity). */
void tw_loop_rows_normals(const tw_loop_rows *rows, const double *kept, uint32_t first, uint32_t count,
                          tw_limit_entry *mask, float *out, uint32_t stride);

/* Corners of triangles [first, first + count). out: [count][3]. */
void tw_loop_rows_triangles(const tw_loop_rows *rows, uint32_t first, uint32_t count, uint32_t *out);

#endif
