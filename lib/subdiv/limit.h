/* Where a vertex of a Catmull-Clark mesh of quads, or of a Loop mesh of triangles, goes at infinite
 * subdivision, and the tangents there.
 *
 * Masks: Loop 1987; Halstead, Kass and DeRose 1993 (interior), Biermann, Levin and Zorin 2000 (borders and
 * creases), in the form OpenSubdiv uses. To the position, sharpness that has not yet decayed counts as if it
 * stayed, as with OpenSubdiv; tangents are those of the vertex after all decay. */
#ifndef TWEEND_LIMIT_H
#define TWEEND_LIMIT_H

#include "topology.h"

typedef struct tw_limit_entry {
  uint32_t vertex;
  float position, tangent1, tangent2;
} tw_limit_entry;

/* Room that tw_limit_mask needs for a vertex. */
static inline uint32_t tw_limit_capacity(const tw_topology *t, uint32_t vertex) {
  return 1 + t->ring_offsets[vertex + 1] - t->ring_offsets[vertex] + t->fan_offsets[vertex + 1] -
         t->fan_offsets[vertex];
}

/* Room for any of its masks. O(vertices). */
uint32_t tw_limit_greatest_capacity(const tw_topology *topology);

/* Masks for the vertex at `corner`; the tangents are those of the sector between infinitely sharp
 * edges in which the corner lies, tangent1 x tangent2 pointing outward. Of linear meshes: those of the
 * corner's own face. Returns the number of entries. */
uint32_t tw_limit_mask(const tw_topology *topology, bool linear, uint32_t corner, tw_limit_entry *entries);

/* Derivatives along the corner's own two sides, which several fields over the same faces have in common
 * when their masks differ: to the next corner frame[0][0] tangent1 + frame[0][1] tangent2, to the previous
 * one likewise with frame[1]. False where the sides themselves say it. */
bool tw_limit_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2]);

#endif
