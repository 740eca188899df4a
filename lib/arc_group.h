/* The arcs of many tracks in frames (the seek frames of ozz-animation): each says where all tracks are at its
 * time, and which arcs start from then on until the next one. A pose reads one frame from its beginning on,
 * in vectors of tracks, and no other place in memory. */
#ifndef TWEEND_ARC_GROUP_H
#define TWEEND_ARC_GROUP_H

#include "track.h"

enum { TW_GROUP_TRACKS = 1024 };

/* Immutable. */
typedef struct tw_arc_group {
  struct tw_arc_group *following; /* a clip has as many as its tracks need */
  uint32_t track_count;
  uint32_t standing_count; /* blocks that a frame begins with: each track's arc then; before it starts, its
                              first. Behind the last track they repeat it */
  float last;              /* start of all */
  tw_timeline frames;      /* their times */
  const uint32_t *places;  /* [frames + 1] the first block of each, and the end of the last */
  const arc_block *blocks; /* of all frames; behind the last arc of one there are others that never start */
} tw_arc_group;

/* Takes as many of tracks[which[0..count)], all TRACK_ARC, as one group holds, at least one. Copies what it
 * needs into the arena: 88 bytes a key, more by half for a dozen of tracks and however the keys lie. NULL
 * without memory. */
tw_arc_group *tw_arc_group_create(tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                                  uint32_t count);

/* Puts the rotations of all tracks at any time, a NaN being before all others, into the local transforms of
 * their nodes. The same bits as track by track. O(tracks). */
void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals);

#endif
