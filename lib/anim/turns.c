/* Half turns and longer ones between keys. */
#include "turns.h"

#include <math.h>

static const double PI = 3.14159265358979323846;
static const double HALF_TURN_COSINE = 1e-6; /* of half the angle; rounding leaves a tenth of it */
static const double ANGLE_ROOM = 1e-6;       /* of 180 degrees: keys in degrees and in single precision */

static tw_turn judge_angle(double change) {
  double turns = fabs(change) / PI - 1;
  return turns < -ANGLE_ROOM ? TURN_SHORT : turns > ANGLE_ROOM ? TURN_LONG : TURN_HALF;
}

static tw_turn judge_keys(const tw_track *track, uint32_t key) {
  double from[4], to[4];
  tw_track_rotation(track, key, 0, from);
  tw_track_rotation(track, key + 1, 0, to);
  return fabs(quat_dot(from, to)) < HALF_TURN_COSINE ? TURN_HALF : TURN_SHORT;
}

bool tw_track_says_angles(const tw_track *track) {
  return track->kind == TRACK_EULER || track->kind == TRACK_AXIS_ANGLE;
}

tw_turn tw_track_turn(const tw_track *track, uint32_t key) {
  if (track->kind == TRACK_AXIS_ANGLE) return judge_angle(track->segments.turns[key].change);
  if (track->kind == TRACK_EULER) {
    const double *change = track->segments.eulers[key].change;
    return judge_angle(fmax(fmax(fabs(change[0]), fabs(change[1])), fabs(change[2])));
  }
  bool joins = track->kind == TRACK_ARC || track->kind == TRACK_NLERP || track->kind == TRACK_SQUAD;
  return joins && !track->holds ? judge_keys(track, key) : TURN_SHORT;
}
