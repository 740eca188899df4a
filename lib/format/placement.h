/* Where a scene shows its meshes in world space: once for each node, or once for each instance of a node. */
#ifndef TWEEND_PLACEMENT_H
#define TWEEND_PLACEMENT_H

#include "tweend/format.h"

typedef struct tw_placements {
  uint32_t count;
  tw_placement *items; /* [count] by node; nodes that are hidden or show no faces have none */
} tw_placements;

/* Places what a scene shows at its pose. False without memory, or at the end of the work; then too it must be
 * deinited. */
bool tw_placements_find(const tw_scene *scene, tw_placements *out);
/* At how many of the places floats would change the shape of the mesh if all were moved by minus the origin.
 */
uint32_t tw_placements_count_far(const tw_scene *scene, const tw_placements *places, const double origin[3]);
/* Whether a mesh is shown where its coordinates, times the scale, are beyond floats. */
bool tw_placements_are_beyond(const tw_scene *scene, const tw_placements *places, double scale);
void tw_placements_deinit(tw_placements *placements); /* zeroed ones are fine */

#endif
