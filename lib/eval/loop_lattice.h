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

typedef struct tw_lattice {
  const double *points; /* (i, j) at 3 * ((j + 1) * stride + i + 1) */
  uint32_t stride;
} tw_lattice;

/* Doubles of scratch that tw_lattice_refine needs. */
size_t tw_lattice_scratch(uint32_t depth);

/* Refines the triangle of a corner, which becomes point (0, 0), by `depth` steps, 1 or more: all points of
 * `rect` and those beside them, also where they lie outside of the triangle. The face is regular. */
tw_lattice tw_lattice_refine(const tw_topology *topology, const double *positions, uint32_t corner,
                             uint32_t depth, tw_lattice_rect rect, double *scratch);

/* Writes point (i, j), and the unit normal of the limit surface there. normal: NULL where not wanted. */
void tw_lattice_row(const tw_lattice *lattice, uint32_t i, uint32_t j, float *point, float *normal);

/* ---- other triangles ------------------------------------------------------------------------ */

/* Takes generic steps for some faces, and writes the rows of their lattices, which begin at each face's first
 * corner: points and, where `width` is 6, normals. Works on a few faces at a time. rules: of the cage. out:
 * [count] [tw_lattice_points][width]. TW_NO_MEMORY, TW_CANCELLED. */
typedef struct tw_lattice_job {
  const tw_topology *topology;
  const tw_rules *rules;
  const double *positions;
  const uint32_t *faces; /* [count] */
  uint32_t count, depth, width;
  const tw_parallel_for *parallel;
} tw_lattice_job;
tw_status tw_lattice_steps(const tw_lattice_job *job, float *out);

#endif
