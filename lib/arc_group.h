/* The arcs of many tracks in the order of time, so that what a pose at any time needs lies close together:
 * the keys around a moment, and for every so many keys a snapshot that says where each track is (the seek
 * frames of ozz-animation). One search serves all tracks, and a clip larger than the cache is read in a few
 * places, not in one or two for each track. */
#ifndef TWEEND_ARC_GROUP_H
#define TWEEND_ARC_GROUP_H

#include "track.h"

enum { TW_GROUP_TRACKS = 1024 };

/* Immutable. */
typedef struct tw_arc_group {
  struct tw_arc_group *following; /* a clip has as many as its tracks need */
  uint32_t track_count, arc_count;
  const uint32_t *nodes;    /* [track_count] */
  const arc_segment *arcs;  /* [arc_count], by their starts, equal ones by track */
  const uint16_t *tracks;   /* [arc_count] whose each one is */
  float last;               /* start of all */
  tw_timeline snapshots;    /* their times */
  const uint32_t *standing; /* [snapshots][track_count] each track's arc then; before it starts, its first */
  const uint32_t *next;     /* [snapshots] the first arc that starts later */
} tw_arc_group;

/* Takes as many of tracks[which[0..count)], all TRACK_ARC, as one group holds, at least one. Copies what it
 * needs into the arena: 46 bytes a key, however the keys lie, and little more. NULL without memory. */
tw_arc_group *tw_arc_group_create(tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                                  uint32_t count);

/* Puts the rotations of all tracks at any time, a NaN being before all others, into the local transforms of
 * their nodes. The same bits as track by track. O(tracks). */
void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals);

/* About how many arcs start between two times; the first is not the later one. */
uint32_t tw_arc_group_between(const tw_arc_group *group, float first, float last);

#endif
