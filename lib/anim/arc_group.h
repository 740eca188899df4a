/* The arcs of many tracks in the order of time, so that a pose reads one stretch of them, in vectors of
 * tracks, and no other place in memory. An arc that goes on when the stretch has left it is repeated (as by
 * the seek frames of ozz-animation, but each when its turn comes). */
#ifndef TWEEND_ARC_GROUP_H
#define TWEEND_ARC_GROUP_H

#include "track.h"

enum { TW_GROUP_TRACKS = 1024 };

/* Immutable. */
typedef struct tw_arc_group {
  struct tw_arc_group *following; /* a clip has as many as its tracks need */
  uint32_t track_count;
  uint32_t window;        /* blocks in which each track is found */
  tw_timeline frames;     /* times, from the first start of all to the last */
  const uint32_t *places; /* [frames] the block where what starts later is looked for */
  size_t block_count;
  const arc_block *blocks; /* behind the last arc are others that never start */
} tw_arc_group;

/* Takes as many of tracks[which[0..count)], all TRACK_ARC, as one group holds, at least one. Copies what it
 * needs into the arena: 46 bytes a key, twice as many at most however the keys lie. NULL without memory. */
tw_arc_group *tw_arc_group_create(tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                                  uint32_t count);

/* Puts the rotations of all tracks at any time, a NaN being before all others, into the local transforms of
 * their nodes. The same bits as track by track. O(tracks). */
void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals);

#endif
