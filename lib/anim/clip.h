/* The layout of a compiled clip, for the functions that evaluate it. */
#ifndef TWEEND_CLIP_H
#define TWEEND_CLIP_H

#include "track.h"

/* What a pose reads of a TRACK_ARC to find its arc; copied here so that a pose reads memory front to back. */
typedef struct posed_arc {
  tw_timeline timeline;
  const tw_arc_segment *arcs;
  uint32_t node;
} posed_arc;

struct tw_clip {
  tw_arena *arena; /* owns everything, this struct too */
  uint32_t node_count, track_count, timeline_count;
  float duration;
  tw_track *tracks;       /* [track_count], in the source's order */
  tw_timeline *timelines; /* [timeline_count] */
  posed_arc *arcs;        /* [arc_count] */
  uint32_t *others;       /* [other_count] tracks of transforms that are not arcs: indices into tracks */
  uint32_t arc_count, other_count;
  uint8_t *moves; /* [node_count], bit `path` for each path that a track moves */
};

/* Wraps samples of a track as a LINEAR or STEP track. Makes the signs of rotations continuous, in `values`.
 * The result points to times and values. */
tw_track_keys tw_track_as_keys(const tw_track *track, const float *times, float *values, uint32_t key_count);

/* Bakes a track to keys at these times, which the result points to; its values live in the arena.
 * TW_NO_MEMORY. */
tw_status tw_track_bake(const tw_clip *clip, uint32_t index, const float *times, uint32_t time_count,
                        tw_arena *arena, tw_track_keys *out, tw_error *error);

/* Converts a track of Euler angles that are interpolated each on its own to LINEAR keys: its own, bit for bit
 * at their times, and so many between that slerp stays within `tolerance` (radians, at least 1e-6) and turns
 * as the angles do. *reached becomes a bound on what is left, where that is more. Without further keys the
 * result has the track's own times; other arrays live in the arena. TW_LIMIT: more than max_added keys
 * besides its own; TW_NO_MEMORY. O(keys). */
tw_status tw_euler_keys(const tw_track_keys *track, double tolerance, uint32_t max_added, tw_arena *arena,
                        tw_track_keys *out, double *reached, tw_error *error);

/* Makes all the checks that tw_clip_create documents. may_repeat: key times of a track may be equal. The
 * error's pointer begins with /tracks. TW_INVALID, TW_NO_MEMORY. */
tw_status tw_clip_check(const tw_clip_keys *keys, uint32_t node_count, int force, bool may_repeat,
                        tw_error *error);

/* Makes times rise strictly in a clip that tw_clip_check has passed. Where several keys of a track have one
 * time, the value jumps. The first of these keys, with the value before the jump, is moved to the next
 * smaller float; it is dropped where that is negative or not after the key before. The last one stays, the
 * others are dropped. Sets duplicate_times of such tracks; new arrays live in the arena. TW_NO_MEMORY.
 * O(keys). */
tw_status tw_clip_separate(tw_clip_keys *clip, tw_arena *arena, tw_error *error);

#endif
