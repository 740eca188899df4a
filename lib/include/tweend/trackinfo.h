/* Diagnostics of a rotation track: how far and how fast it turns, doubtful keys, and how near it comes to
 * gimbal lock in each Euler order. Angles in radians, times in seconds. */
#ifndef TWEEND_TRACKINFO_H
#define TWEEND_TRACKINFO_H

#include "tweend/anim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The place of a path that is nearest to gimbal lock in one Euler order. */
typedef struct tw_gimbal {
  double time;
  double cos_middle;    /* |cos| of the order's middle angle: 1 is farthest from lock, 0 is lock */
  double amplification; /* 1 / cos_middle: rate of the outer angles over that of the rotation; INFINITY at
                           lock */
} tw_gimbal;

enum { TW_TRACK_WARNINGS = 8, TW_TRACK_WARNING_SIZE = 200 };

typedef struct tw_track_report {
  uint32_t key_count;
  double start, duration; /* time of the first key, and from it to the last */

  double total_angle;   /* travelled along the path as it is interpolated; STEP jumps count */
  double largest_step;  /* the most that is travelled from one key to the next */
  uint32_t largest_key; /* from which key */
  double peak_velocity; /* radians a second; of STEP 0, as it only jumps */
  double peak_time;

  uint32_t sign_flips; /* quaternion keys on the other side than the key before: q and -q are one rotation */
  uint32_t non_unit_keys; /* quaternion keys whose length is off 1 by more than 1e-5 */
  uint32_t half_turns;    /* steps of exactly 180 degrees: on which side slerp would pass is arbitrary */
  uint32_t long_steps;    /* steps over 180 degrees, which quaternions would shorten */
  uint32_t euler_wraps;   /* Euler keys with an angle more than 180 degrees from the key before's */

  tw_euler_order order;               /* the track's own where its keys are Euler angles, else XYZ */
  tw_gimbal gimbals[TW_EULER_ORDERS]; /* for each order, least cos_middle along the path, not only at keys */
  tw_euler_order best_order;          /* the one whose worst place is farthest from lock */
  int lost_axis; /* 0 x, 1 y, 2 z: at lock of `order` turns as the order's first axis does */

  bool has_stray;     /* for Euler tracks: */
  double stray_angle; /* most that interpolating angle by angle departs from slerp between the same keys */
  double stray_time;

  uint32_t warning_count;
  char warnings[TW_TRACK_WARNINGS][TW_TRACK_WARNING_SIZE]; /* sentences */
} tw_track_report;

/* As many steps a segment are enough for any track. */
enum { TW_TRACK_STEPS = 512 };

/* Inspects one rotation track; keys as in tw_clip_create, whose errors it gives with pointers from
 * "/tracks/0". Slerp, nlerp and turns about one axis are exact. Other paths are followed in steps of at most
 * 5 degrees, as long as no segment takes more than steps_most (at least 1), and looked at more closely where
 * they may come nearest to lock: cos_middle is then exact to about 1e-7. O(keys x steps). */
tw_status tw_track_inspect(const tw_track_keys *keys, uint32_t steps_most, tw_track_report *out,
                           tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
