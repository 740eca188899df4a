/* A hole in a mesh: a loop of its points, and the patch that covers it. */
#ifndef TWEEND_HOLE_H
#define TWEEND_HOLE_H

#include "editor.h"

enum { TW_PATCH_TERMS = 4 };

/* The edges that patches have between points of the mesh: a hash set of pairs. */
typedef struct tw_patch_edges {
  uint32_t (*pairs)[2]; /* [mask + 1] the lesser point first; the same twice: free */
  uint32_t mask;
} tw_patch_edges;

/* Room for so many, in the editor's arena. TW_NO_MEMORY. */
tw_status tw_patch_edges_init(tw_patch_edges *edges, const tw_editor *editor, uint32_t count);

/* Points are named by their place: in the loop, or behind it where they are the patch's own. A zeroed one may
 * be deinited. */
typedef struct tw_patch {
  const uint32_t *loop;  /* [loop_count] of the editor's mesh, 3 or more, each once */
  tw_patch_edges *edges; /* of the patches before */
  uint32_t loop_count, point_count, triangle_count;
  uint32_t (*triangles)[3]; /* [triangle_count] wound as the loop */
  /* Where the patch has points of its own: */
  uint32_t (*beyond)[3]; /* [triangle_count] the triangle over the side from each corner to the next;
                            UINT32_MAX: the mesh */
  double (*points)[3];   /* [point_count] */
  double *scales;        /* [point_count] how long edges should be there */
  tw_term (*terms)[TW_PATCH_TERMS]; /* [point_count] means of the loop; weights of 0 at the end are none */
  uint32_t room;                    /* of points; of triangles there is room for twice as many */
} tw_patch;

void tw_patch_deinit(tw_patch *patch);

/* Whether the mesh, or a patch before, has an edge between two places of the loop. */
bool tw_patch_is_taken(const tw_patch *patch, const tw_editor *editor, uint32_t a, uint32_t b);

/* Lets the patches behind it know a patch's edges. */
void tw_patch_finish(const tw_patch *patch);

/* Work that is left for holes: triangles looked at, and steps of points. */
typedef struct tw_hole_budget {
  uint64_t triangles, steps;
} tw_hole_budget;

/* In proportion to the editor's mesh. */
tw_hole_budget tw_hole_budget_of(const tw_editor *editor);

/* Covers the patch's loop with the triangles of the least area, without an edge that the mesh has already
 * wherever that can be. A loop that the budget does not do for is cut in halves first, where their ends are
 * nearest to each other. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_patch_triangulate(tw_patch *patch, const tw_editor *editor, tw_hole_budget *budget);

/* What the edges of a mesh say of its points. */
typedef struct tw_rings {
  uint32_t *counts;  /* [vertex_count] of neighbours */
  double (*sums)[3]; /* [vertex_count] of where they are */
  double *scales;    /* [vertex_count] mean length of the edges */
} tw_rings;

/* In the editor's arena; the editor has its topology. O(edges). TW_NO_MEMORY. */
tw_status tw_rings_find(tw_rings *rings, const tw_editor *editor);

/* Cuts the triangles of a patch until they are about as large as those round the hole, points_max points at
 * most in the patch. O(n log n) in what it makes. TW_LIMIT, TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_patch_refine(tw_patch *patch, const tw_editor *editor, const tw_rings *rings,
                          uint64_t points_max);

/* Moves the points of a refined patch so that it goes on as the mesh round the hole is bent, nearly so where
 * the budget does not do. TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_patch_fair(tw_patch *patch, const tw_editor *editor, const tw_rings *rings,
                        tw_hole_budget *budget);

#endif
