/* Triangles of a Loop mesh as lattices: the points that generic steps make of a triangle, from the points
 * around it.
 *
 * A lattice of side n has points (i, j), i and j from 0 on, i + j at most n. (0, 0), (n, 0) and (0, n) are at
 * the triangle's corners, beginning with any one of them. */
#ifndef TWEEND_LOOP_LATTICE_H
#define TWEEND_LOOP_LATTICE_H

#include "crease.h"
#include "parallel_for.h"
#include "topology.h"

enum { TW_LATTICE_DEPTH_MAX = 6 };

static inline uint32_t tw_lattice_points(uint32_t side) {
  return (side + 1) * (side + 2) / 2;
}
/* The place of a point when points are in order of j, then i. */
static inline uint32_t tw_lattice_place(uint32_t side, uint32_t i, uint32_t j) {
  return j * (side + 1) - j * (j - 1) / 2 + i;
}

/* The lattice points of a triangle that steps make of another: corners of descendant `child` after `depth`
 * steps, with the numbers of loop.h. */
void tw_lattice_child(uint32_t depth, uint32_t child, uint32_t corners[3][2]);

/* ---- regular triangles ---------------------------------------------------------------------- */

/* Whether only smooth vertices of valence 6 are at a face's corners. */
bool tw_lattice_is_regular(const tw_topology *topology, uint32_t face);

typedef struct tw_lattice_rect {
  int32_t i0, i1, j0, j1;
} tw_lattice_rect;

/* Values at the vertices of a topology: [vertex_count][width] as doubles, or where these are NULL as floats.
 */
typedef struct tw_lattice_source {
  const tw_topology *topology;
  const double *exact;
  const float *rounded;
  uint32_t width; /* 1 to 4 */
} tw_lattice_source;

typedef struct tw_lattice {
  const double *values; /* (i, j) at width * ((j + 1) * stride + i + 1) */
  uint32_t stride, width;
} tw_lattice;

/* Doubles of scratch that tw_lattice_refine needs. */
size_t tw_lattice_scratch(uint32_t depth);

/* Refines the triangle of a corner, which becomes point (0, 0), by `depth` steps, 1 or more: all points of
 * `rect` and those beside them, also where they lie outside of the triangle. The face is regular. */
tw_lattice tw_lattice_refine(const tw_lattice_source *source, uint32_t corner, uint32_t depth,
                             tw_lattice_rect rect, double *scratch);

/* Writes the value at (i, j). limit: of the limit surface. */
void tw_lattice_value(const tw_lattice *lattice, uint32_t i, uint32_t j, bool limit, float *out);

/* Writes the unit normal of the limit surface at (i, j) of a lattice of points. */
void tw_lattice_normal(const tw_lattice *lattice, uint32_t i, uint32_t j, float *out);

/* As tw_lattice_value, of values that are linear over each face. */
void tw_lattice_linear(const tw_lattice_source *source, uint32_t corner, uint32_t side, uint32_t i,
                       uint32_t j, float *out);

/* ---- other triangles ------------------------------------------------------------------------ */

/* Takes generic steps for some faces, and writes the rows of their lattices, which begin at each face's first
 * corner: values, at the limit where that is wanted, and then the normals of points where these are. Works on
 * a few faces at a time. rules: of the cage. out: [count][tw_lattice_points][tw_lattice_width]. TW_NO_MEMORY,
 * TW_CANCELLED. */
typedef struct tw_lattice_job {
  tw_lattice_source source;
  const tw_rules *rules;
  const uint32_t *faces; /* [count] */
  uint32_t count, depth;
  bool limit, normals;
  const tw_parallel_for *parallel;
} tw_lattice_job;
static inline uint32_t tw_lattice_width(const tw_lattice_job *job) {
  return job->source.width + (job->normals ? 3 : 0);
}
tw_status tw_lattice_steps(const tw_lattice_job *job, float *out);

#endif
