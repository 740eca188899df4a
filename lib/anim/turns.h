/* Steps between two keys whose way is arbitrary, or another one between the same rotations as quaternions. */
#ifndef TWEEND_TURNS_H
#define TWEEND_TURNS_H

#include "track.h"

typedef enum tw_turn {
  TURN_SHORT, /* nothing of note */
  TURN_HALF,  /* exactly 180 degrees, but for rounding */
  TURN_LONG   /* an angle that changes by more */
} tw_turn;

/* The step from a key of a rotation track to the next one, by what the keys say: quaternions that slerp,
 * nlerp or squad joins are never more than 180 degrees apart, splines and steps have no way of their own to
 * judge. */
tw_turn tw_track_turn(const tw_track *track, uint32_t key);

/* Whether the keys' own angles say how far a step turns. */
bool tw_track_says_angles(const tw_track *track);

#endif
