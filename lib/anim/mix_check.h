/* The layers of the mixed clips of a file. */
#ifndef TWEEND_MIX_CHECK_H
#define TWEEND_MIX_CHECK_H

#include "tweend/mix.h"

/* Checks the layers of all mixed clips, the other parts of which are checked, and that none is mixed of
 * itself, of too many clips or too deep; sets mixed_duration. TW_INVALID and TW_LIMIT with a pointer from
 * "/clips"; TW_NO_MEMORY. */
tw_status tw_clips_check_layers(tw_clip_keys *clips, uint32_t clip_count, tw_error *error);

#endif
