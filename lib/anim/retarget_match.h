/* Which bone of one skeleton is which of another. */
#ifndef TWEEND_RETARGET_MATCH_H
#define TWEEND_RETARGET_MATCH_H

#include "tweend/retarget.h"

enum { TW_SPINE_MOST = 16 };

/* The bones between hips and neck, from below. Of more than fit the last one stands last. */
typedef struct tw_spine {
  uint32_t count, nodes[TW_SPINE_MOST];
} tw_spine;

/* The bones that usual names say, of nodes for which is_bone says true, and of one figure where there are
 * several: that with the most bones below its hips. TW_NO_INDEX where there is none. Of a spine the first two
 * and the last are spine, chest and upper chest. bones: [TW_BONES]; arena: scratch. False without memory.
 * O(nodes). */
bool tw_bones_guess(const tw_skeleton *skeleton, const bool *is_bone, tw_arena *arena,
                    uint32_t bones[TW_BONES], tw_spine *spine);

/* Arrays live in the arena that the match was made with. */
typedef struct tw_bone_match {
  uint32_t *source_of; /* [nodes of the target] or TW_NO_INDEX */
  uint8_t *by;         /* [nodes of the target] tw_match */
  uint8_t *role;       /* [nodes of the target] tw_bone by map or name, of the target or else the source;
                          TW_BONES: unknown */
  bool *is_source_bone, *is_target_bone; /* [nodes] */
  bool *is_left;                         /* [nodes of the source] by the map, without a target */
  bool has_map;                          /* both skeletons have humanoid maps */
} tw_bone_match;

/* The matched bones of VRM's: [TW_BONES] of the source and of the target; or TW_NO_INDEX. */
void tw_bones_list(const tw_retarget_job *job, const tw_bone_match *match, uint32_t out[2][TW_BONES]);

/* Matches the bones of a job. TW_INVALID, TW_UNSUPPORTED, TW_NO_MEMORY as tw_retarget_run. */
tw_status tw_bones_match(const tw_retarget_job *job, tw_arena *arena, tw_bone_match *out, tw_error *error);

#endif
