/* Clips for glTF: keys in place of those that it cannot express, and fewer of them if that is asked for. */
#ifndef API_REDUCED_CLIPS_H
#define API_REDUCED_CLIPS_H

#include "cache.h"
#include "call.h"
#include "tweend/anim.h"

/* Which keyframes are reduced, and how much. */
typedef struct api_reduction {
  bool is_wide; /* LINEAR tracks are reduced too, not only those that glTF cannot express */
  tw_tolerance tolerance;
} api_reduction;

typedef struct api_clips_to_reduce {
  const tw_clip_keys *clips;   /* [clip_count] */
  const tw_clip *const *mixed; /* [clip_count] clips without keys, else NULL */
  uint32_t clip_count, node_count;
  const api_reduction *reduction;
  uint32_t max_keys; /* limit on the keys of a track */
} api_clips_to_reduce;

/* Whether a clip has such tracks, or no keys. */
bool api_clips_need_reduction(const api_clips_to_reduce *source);

/* Reduces the clips, or takes the entry of the key, as in api_call_take: that takes far longer than sending.
 * entry: holds the keys of *out, which lives in the call's arena. *reached: the largest error that is left.
 */
api_outcome api_clips_reduce(api_call *call, const char *key, const api_clips_to_reduce *source,
                             api_entry **entry, const tw_clip_keys **out, tw_tolerance *reached);

#endif
