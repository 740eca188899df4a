/* A level or two below a mesh of any faces, where patches would have next to nothing to do: rows of points
 * and faces straight from the connectivity of the mesh, be it a cage or what generic steps have made of one.
 * Nothing is built of the refined meshes but their points above the level asked for and its face points; how
 * those are joined follows from the cage by the arithmetic that refine.h tells of. */
#ifndef TWEEND_SHALLOW_H
#define TWEEND_SHALLOW_H

#include "refine.h"

typedef struct tw_shallow {
  tw_topology cage;
  tw_rules rules;
  uint32_t level; /* 1 or 2; 0: not in use */
  bool normals;   /* are asked for */
} tw_shallow;

/* Whether a level can be read so of what some steps make of a mesh: what is then sharp at the cage has to be
 * so for ever at the level above. */
bool tw_shallow_fits(const tw_topology *mesh, uint32_t steps, const tw_rules *rules, uint32_t level);

/* Whether normals can be too: nothing is sharp, and no vertex has two faces alone. */
bool tw_shallow_fits_normals(const tw_topology *cage, const tw_rules *rules);

/* Counts of the level, without arrays. Those of the answer must be within 32 bits. */
tw_topology tw_shallow_counts(const tw_shallow *shallow);

/* With normals: whether level 2 is made from level 1 wherever it is read, rather than kept. Cages of
 * triangles can do so, of which any vector of faces or edges is full. */
bool tw_shallow_is_remade(const tw_shallow *shallow);

/* Points that are kept: all of the level above, then the face points of this one. With normals, which look
 * about them, all of this one; where it is remade, those that it has at the cage's vertices besides. */
size_t tw_shallow_kept_count(const tw_shallow *shallow);

/* Floats that they take: their rows, and some behind the last and behind the level above, which are read with
 * those. */
size_t tw_shallow_kept_size(const tw_shallow *shallow);

/* Computes them. positions: [points][3]; point_of: [cage vertices], NULL when all points are used; kept:
 * [tw_shallow_kept_size]. TW_NO_MEMORY. */
tw_status tw_shallow_keep(const tw_shallow *shallow, const float *positions, const uint32_t *point_of,
                          const tw_parallel_for *parallel, float *kept);

/* Points [first, first + count) of the level, in the order of refine.h: the same bytes as tw_refine_values
 * gives. */
void tw_shallow_points(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                       float *out);

/* The same, each with the unit normal of the limit surface behind it. out: [count][6]. */
void tw_shallow_normals(const tw_shallow *shallow, const float *kept, uint32_t first, uint32_t count,
                        float *out);

/* With each instruction set that this machine has, from 0, which all machines have, to the best; false
 * beyond. All write the same bytes. */
bool tw_shallow_normals_by(uint32_t instruction_set, const tw_shallow *shallow, const float *kept,
                           uint32_t first, uint32_t count, float *out);

/* Corners of quads [first, first + count). out: [count][4]. */
void tw_shallow_quads(const tw_shallow *shallow, uint32_t first, uint32_t count, uint32_t *out);

#endif
