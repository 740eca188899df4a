/* Limit masks: the limit position and tangents of a vertex of a Catmull-Clark mesh, or of a Loop mesh of
 * triangles. Masks of polygons are those of the quads one step below, which is folded into them.
 *
 * Masks: Loop 1987; Halstead, Kass and DeRose 1993 (interior), Biermann, Levin and Zorin 2000 (borders and
 * creases), in the form OpenSubdiv uses. For the position, sharpness that has not yet decayed counts as if it
 * stayed, as in OpenSubdiv. The tangents are those of the vertex after all sharpness has decayed. */
#ifndef TWEEND_LIMIT_H
#define TWEEND_LIMIT_H

#include "topology.h"

typedef struct tw_limit_entry {
  uint32_t vertex;
  float position, tangent1, tangent2;
} tw_limit_entry;

/* Whether an edge or a vertex is semi-sharp. O(edges). */
bool tw_limit_decays(const tw_topology *topology);

/* Steps until all semi-sharp edges of the vertex, and the vertex itself, have decayed. */
uint32_t tw_limit_steps(const tw_topology *topology, uint32_t vertex);

/* Entries of room that tw_limit_mask needs for a vertex: those of the mask and, where sharpness decays or
 * faces are polygons, some to compute it. The room is allocated memory. decays: whether anything may be
 * semi-sharp. O(corners of the vertex). */
uint32_t tw_limit_capacity(const tw_topology *topology, bool decays, uint32_t vertex);

/* The same for any vertex. O(corners). */
uint32_t tw_limit_greatest_capacity(const tw_topology *topology);

/* Computes the masks of the vertex at `corner`. tangent1 x tangent2 points outward. Where infinitely sharp
 * edges split the vertex's faces into sectors, the tangents are those of the sector in which the corner lies;
 * on linear meshes, those of the corner's own face. Returns the number of entries. */
uint32_t tw_limit_mask(const tw_topology *topology, bool linear, uint32_t corner, tw_limit_entry *entries);

/* A corner that has the same masks as `corner` and represents all corners of the vertex that have: those of
 * one sector or side of a crease, or all. O(faces of the vertex). */
uint32_t tw_limit_corner(const tw_topology *topology, bool linear, uint32_t corner);

enum { TW_WHEEL_MAX = 8 };

/* The mask that was computed last, for rows of one vertex that follow each other; and masks at smooth
 * vertices among triangles or quads, whose weights depend on the valence alone. */
typedef struct tw_last_mask {
  tw_limit_entry *entries;     /* room for the greatest mask */
  const tw_topology *topology; /* NULL: none yet */
  uint32_t corner, count;
  bool of_triangles, of_polygons;          /* the wheels are: their masks differ */
  uint32_t wheel_counts[TW_WHEEL_MAX + 1]; /* by valence; 0: not computed yet */
  tw_limit_entry wheels[TW_WHEEL_MAX + 1][1 + 2 * TW_WHEEL_MAX];
} tw_last_mask;

/* Computes the mask at a corner, unless the last one is the same. Returns the number of entries. */
uint32_t tw_limit_mask_after(tw_last_mask *last, const tw_topology *topology, bool linear, uint32_t corner);

/* Converts tangents to derivatives along the corner's own two sides: towards the next corner frame[0][0]
 * tangent1 + frame[0][1] tangent2, towards the previous one frame[1][0] tangent1 + frame[1][1] tangent2.
 * Several fields over the same faces can have different masks; the sides are directions that they share.
 * Returns false where the differences along the sides are themselves the derivatives. */
bool tw_limit_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2]);

/* Finds how the derivatives at a corner follow from its mask, along its two sides, which are directions that
 * all fields share: towards the next corner frame[0][0] tangent1 + frame[0][1] tangent2, towards the previous
 * one by frame[1]. True: the mask is the limit mask. False: it is `sides`, of the differences along the
 * sides. Masks apply to differences from the corner's own value. */
bool tw_slope_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2],
                    tw_limit_entry sides[2]);

#endif
