/* Stencils for patches whose class is common. */
#ifndef TWEEND_PATCH_STENCILS_H
#define TWEEND_PATCH_STENCILS_H

#include "patch.h"

/* Chooses the patches that are summed by stencils (those whose class many of the patches share, up to a
 * depth), and makes the stencils. classes: those the patches were made with. limit: whether the jobs will
 * want limit points. normals: whether the jobs will want normals too. TW_NO_MEMORY; TW_LIMIT: the stencils of
 * other meshes that share the classes have left no room. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_classes *classes, bool limit, bool normals);

#endif
