/* Follows a rotation track's path: how far and how fast it turns, how near it comes to gimbal lock. */
#ifndef TWEEND_TRACKPATH_H
#define TWEEND_TRACKPATH_H

#include "track.h"
#include "tweend/trackinfo.h"

/* Fills what of the zeroed report the path tells: angles, speed, half turns, long steps, the cosines of all
 * orders and their times, and the stray where has_stray is set.
 * steps_most: in which a segment is followed at most, at least 1. */
void tw_track_follow(const tw_track *track, uint32_t steps_most, tw_track_report *report);

#endif
