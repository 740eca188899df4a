/* A hole in a mesh: a loop of its points, and the patch that covers it. */
#ifndef TWEEND_HOLE_H
#define TWEEND_HOLE_H

#include "editor.h"

enum {
  TW_PATCH_TERMS = 4,
  TW_FAIR_POINTS_MAX = 250000 /* of the fair patches of a list of edits: some seconds of work */
};

/* The edges that patches made between points of the mesh: a hash set of pairs. */
typedef struct tw_patch_edges {
  uint32_t (*pairs)[2]; /* [mask + 1] the lesser point first; two equal points: free slot */
  uint32_t mask;
} tw_patch_edges;

/* Makes room for `count` edges, in the editor's arena. TW_NO_MEMORY. */
tw_status tw_patch_edges_init(tw_patch_edges *edges, const tw_editor *editor, uint32_t count);

/* The triangles over a hole. A patch's points are numbered by "place": those of the loop first, then the
 * patch's own. A zeroed patch may be deinited. */
typedef struct tw_hole_patch {
  const uint32_t *loop;  /* [loop_count] points of the editor's mesh, 3 or more, all different */
  tw_patch_edges *edges; /* the edges of earlier patches */
  uint32_t loop_count, point_count, triangle_count;
  uint32_t (*triangles)[3]; /* [triangle_count] places, wound as the loop */
  /* Filled by tw_hole_patch_refine: */
  uint32_t (*beyond)[3]; /* [triangle_count] the triangle across each corner's side; UINT32_MAX: the mesh */
  uint8_t *is_fresh;     /* [triangle_count] its sides have to be looked at for swaps */
  double (*points)[3];   /* [point_count] */
  double *scales;        /* [point_count] wanted edge length */
  tw_term (*terms)[TW_PATCH_TERMS]; /* [point_count] means of the loop's places; trailing terms of weight 0
                                       are unused */
  uint32_t room;                    /* for points; there is room for twice as many triangles */
} tw_hole_patch;

void tw_hole_patch_deinit(tw_hole_patch *patch);

/* Whether the mesh, or an earlier patch, has an edge between two places of the loop. */
bool tw_hole_patch_is_taken(const tw_hole_patch *patch, const tw_editor *editor, uint32_t a, uint32_t b);

/* Makes a finished patch's edges known to later patches. */
void tw_hole_patch_finish(const tw_hole_patch *patch);

/* The work for holes that the current edit may do: in proportion to the editor's mesh, and less where edits
 * before it have done several times as much. */
tw_hole_work tw_hole_budget_of(const tw_editor *editor);

/* Covers the patch's loop with triangles of the least total area, where possible without an edge that the
 * mesh has already. A loop that the budget does not suffice for is halved first, where the ends of the halves
 * are nearest to each other. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_hole_patch_triangulate(tw_hole_patch *patch, const tw_editor *editor, tw_hole_work *budget);

/* For each point, what its edges lead to. */
typedef struct tw_rings {
  uint32_t *counts;  /* [vertex_count] number of neighbours */
  double (*sums)[3]; /* [vertex_count] sum of the neighbours' positions */
  double *scales;    /* [vertex_count] mean length of the edges */
} tw_rings;

/* Fills the rings; the arrays live in the editor's arena. The editor must have its topology. O(edges).
 * TW_NO_MEMORY. */
tw_status tw_rings_find(tw_rings *rings, const tw_editor *editor);

/* Splits the triangles of a patch until they are about as large as those round the hole. O(n log n) in the
 * points that it makes. TW_LIMIT: more than `room` points of its own; TW_INVALID: more than own_max; both are
 * estimated before the first is made. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_hole_patch_refine(tw_hole_patch *patch, const tw_editor *editor, const tw_rings *rings,
                               uint64_t room, uint64_t own_max);

/* Moves the own points of a refined patch so that it continues the curvature of the mesh round the hole; only
 * approximately where the budget does not suffice. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_hole_patch_fair(tw_hole_patch *patch, const tw_editor *editor, const tw_rings *rings,
                             tw_hole_work *budget);

#endif
