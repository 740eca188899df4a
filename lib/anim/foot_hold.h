/* Feet of a retargeted clip that stay where they touch the ground. */
#ifndef TWEEND_FOOT_HOLD_H
#define TWEEND_FOOT_HOLD_H

#include "retarget_match.h"

/* Bends the legs of the target so that each foot stands still, as seen from above, while the source's foot
 * touches the ground (tw_clip_inspect), and comes and goes softly. Feet keep their height and rotation in the
 * world. Legs of feet that are moved keep their knees a little bent. Where a leg is too short for it, the
 * hips above both legs go down, by up to a tenth of its length. up: of the source's world. size: of the
 * target. keys: of the target; the tracks of the upper and lower legs and the feet, and the translation of
 * the hips, are replaced, as LINEAR keys within the job's tolerance that live in the arena. held: how many
 * feet. Errors as tw_retarget_run. O(keys of the legs' ways, and of the result). */
tw_status tw_feet_hold(const tw_retarget_job *job, const tw_bone_match *match, const double up[3],
                       double size, tw_arena *arena, tw_clip_keys *keys, uint32_t *held, tw_error *error);

#endif
