/* A hole in a mesh: a loop of its points, covered with triangles. */
#ifndef TWEEND_HOLE_H
#define TWEEND_HOLE_H

#include "editor.h"

/* Work that is left for holes, in triangles looked at. */
typedef struct tw_hole_budget {
  uint64_t triangles;
} tw_hole_budget;

/* In proportion to the editor's mesh. */
tw_hole_budget tw_hole_budget_of(const tw_editor *editor);

/* Covers a loop with the triangles of the least area: [count - 2] triples of places in the loop, as it is
 * wound, without an edge that the mesh has already wherever that can be. A loop that the budget does not do
 * for is cut in halves first, where their ends are nearest to each other.
 * points: [count] of the editor's mesh, count 3 or more, each once. TW_NO_MEMORY. */
tw_status tw_hole_triangulate(const tw_editor *editor, const uint32_t *points, uint32_t count,
                              tw_hole_budget *budget, uint32_t (*out)[3]);

#endif
