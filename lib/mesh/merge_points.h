/* Makes points of a mesh one, in place. */
#ifndef TWEEND_MERGE_POINTS_H
#define TWEEND_MERGE_POINTS_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The warning of tw_merged.faces. */
#define TW_WELD_DROPPED_WARNING "%llu faces are left out: welding brings their corners together"

/* What has become one. */
typedef struct tw_merged {
  uint32_t points; /* that are one with another now */
  uint32_t faces;  /* dropped: fewer than three different points are left */
} tw_merged;

/* Joins border edges as tw_weld_points does, of a checked mesh that nobody else sees yet. Only meshes without
 * tags on edges, points and faces. Warns of nothing; *reversed: edges of faces wound against each other. A
 * point has the attributes of its first; equal texture coordinates become one value. O(n log n) at worst, and
 * quick where no two points are at one place. TW_NO_MEMORY: the mesh is as it was. */
tw_status tw_mesh_close_seams(tw_mesh *mesh, tw_merged *out, uint32_t *reversed, tw_error *error);

/* Makes one of the points within a distance, 0: at the same place, as tw_weld_within does; tags follow. */
tw_status tw_mesh_merge_within(tw_mesh *mesh, double distance, tw_merged *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
