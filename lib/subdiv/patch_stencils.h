/* Stencils for those patches whose class many patches share. */
#ifndef TWEEND_PATCH_STENCILS_H
#define TWEEND_PATCH_STENCILS_H

#include "patch.h"

/* Has those patches summed whose classes many of the patches share, where the depth allows.
 * shapes: those of the patches. limit: as all jobs that want values will have it. normals: these will be
 * asked for too. TW_NO_MEMORY; TW_LIMIT: others who share the classes have left no room. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals);

#endif
