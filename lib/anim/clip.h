/* A compiled clip, as its evaluators see it. */
#ifndef TWEEND_CLIP_H
#define TWEEND_CLIP_H

#include "track.h"

struct tw_clip {
  tw_arena *arena; /* holds everything, the clip itself too */
  uint32_t node_count, track_count, timeline_count;
  float duration;
  tw_track *tracks;       /* [track_count], as in the source */
  tw_timeline *timelines; /* [timeline_count] */
  /* [posed_count] tracks of transforms (all but weights): the first arc_count are TRACK_ARC. Of each part,
   * those of one timeline follow each other, as in the source. */
  uint32_t *posed;
  uint32_t arc_count, posed_count;
  uint8_t *moves; /* [node_count], a bit for each path */
};

/* Samples of a track as keys of one, LINEAR or STEP. Makes the signs of rotations continuous. The result
 * points to times and values. */
tw_track_keys tw_track_as_keys(const tw_track *track, const float *times, float *values, uint32_t key_count);

#endif
