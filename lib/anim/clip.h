/* A compiled clip, as clip.c makes it and pose.c evaluates it. */
#ifndef TWEEND_CLIP_H
#define TWEEND_CLIP_H

#include "arc_group.h"

/* Checks everything about a clip that needs no computing; see tw_clip_create. */
tw_status tw_clip_check(const tw_clip_keys *keys, uint32_t node_count, int force, tw_error *error);

/* Samples of a track as keys of one, LINEAR or STEP. Makes the signs of rotations continuous. The result
 * points to times and values. */
tw_track_keys tw_track_as_keys(const tw_track *track, const float *times, float *values, uint32_t key_count);

struct tw_clip {
  tw_arena *arena; /* holds everything, the clip itself too */
  uint32_t node_count, track_count, timeline_count;
  float duration;
  tw_track *tracks;       /* [track_count], as in the source */
  tw_timeline *timelines; /* [timeline_count] */
  uint32_t *by_timeline;  /* [track_count] tracks, ordered by timeline, then as in the source */
  tw_arc_group *groups;   /* TRACK_ARC tracks, where there are more than one; NULL where not */
  uint32_t other_count;
  uint32_t *others; /* [other_count] the rest but for weights, in that order */
  uint8_t *moves;   /* [node_count], a bit for each path */
};

#endif
