/* Stencils for those patches whose class many patches share. */
#ifndef TWEEND_PATCH_STENCILS_H
#define TWEEND_PATCH_STENCILS_H

#include "patch.h"
#include "stencil.h"

/* What stencils are made for. scratch_points: of patches of the depth. */
typedef struct tw_stencil_wish {
  uint32_t depth, scratch_points;
  bool limit, normals;
} tw_stencil_wish;

/* Makes one that lives in the arena. TW_NO_MEMORY. */
tw_status tw_stencil_make(tw_patch_class *shape, const tw_stencil_wish *wish, tw_arena *arena,
                          tw_stencil *out);

/* Has those patches summed whose classes many of the patches share, where the depth allows.
 * shapes: those of the patches. limit: as all jobs that want values will have it. normals: these will be
 * asked for too. TW_NO_MEMORY; TW_LIMIT: others who share the classes have left no room. */
tw_status tw_patches_sum(tw_patches *patches, tw_patch_shapes *shapes, bool limit, bool normals);

#endif
