/* One track compiled for sampling, and its timeline, which finds the key before a time in constant time. */
#ifndef TWEEND_TRACK_H
#define TWEEND_TRACK_H

#include "quat.h"

/* ---- timelines ------------------------------------------------------------------------------- */

/* The first key in this bucket or a later one, and the times of that key and the two after it: most searches
 * then read one place in memory. */
typedef struct tw_bucket {
  float times[3]; /* infinity beyond the last key */
  uint32_t first_key;
} tw_bucket;

/* Key times; tracks with equal times share one timeline. The time from the first key to the last is divided
 * into as many equal buckets as there are keys. Rounding keeps order. So for a time in a bucket, keys of
 * lower buckets are at or before it and keys of higher buckets are after it, and only the bucket's own keys
 * are compared. There are seldom more than two; a crowded bucket is bisected. Immutable. */
typedef struct tw_timeline {
  const float *times;       /* [key_count], strictly increasing */
  const tw_bucket *buckets; /* [last_bucket + 2] */
  uint32_t key_count;
  float first, last; /* first and last key time */
  float last_bucket, buckets_per_second;
} tw_timeline;

/* Copies times[0..key_count) into the arena. They must be finite and strictly increasing, and key_count at
 * least 1. False without memory. */
bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count);

/* A time outside the keys becomes the first or last key time; so does NaN. */
static inline float timeline_clamp(const tw_timeline *timeline, float time) {
  time = time > timeline->first ? time : timeline->first;
  return time < timeline->last ? time : timeline->last;
}

static inline uint32_t timeline_bucket(const tw_timeline *timeline, float clamped) {
  float place = (clamped - timeline->first) * timeline->buckets_per_second;
  return (uint32_t)(int32_t)(place < timeline->last_bucket ? place : timeline->last_bucket);
}

/* The last key at or before a clamped time, for a bucket whose three stored times are all at or before it. */
uint32_t tw_timeline_find_crowded(const tw_timeline *timeline, float clamped, uint32_t bucket);

/* The last key at or before a clamped time in this bucket. */
static inline uint32_t timeline_find_in(const tw_timeline *timeline, float clamped, uint32_t bucket) {
  const tw_bucket *found = timeline->buckets + bucket;
  uint32_t passed = (uint32_t)(found->times[0] <= clamped) + (uint32_t)(found->times[1] <= clamped) +
                    (uint32_t)(found->times[2] <= clamped);
  return passed < 3 ? found->first_key + passed - 1 : tw_timeline_find_crowded(timeline, clamped, bucket);
}

/* Clamps [count] times, in any order, and finds for each the last key at or before it. The arrays do not
 * overlap. */
void tw_timeline_find(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                      uint32_t *keys);

/* ---- tracks ---------------------------------------------------------------------------------- */

/* How a track is evaluated, which decides the type of its segments. */
typedef enum track_kind {
  TRACK_ARC,            /* rotation, step and slerp: tw_arc_segment */
  TRACK_NLERP,          /* rotation: nlerp_segment */
  TRACK_SQUAD,          /* rotation: squad_segment */
  TRACK_HERMITE,        /* rotation, cubic spline: cubic [4] */
  TRACK_EULER,          /* rotation: euler_segment */
  TRACK_AXIS_ANGLE,     /* rotation: turn_segment */
  TRACK_VALUES_STEP,    /* float [width] a key */
  TRACK_VALUES_LINEAR,  /* float [width] a key */
  TRACK_VALUES_HERMITE, /* cubic [width] */
  TRACK_MADE            /* of a clip made of other clips: none */
} track_kind;

/* An arc: from cos v + toward sin v with v = (time - start) rate. At v = 0 this is `from`, the key, bit for
 * bit. `toward` has the same length as `from` and is orthogonal to it. A segment is contiguous in memory,
 * because a pose reads one of each track. */
typedef struct tw_arc_segment {
  float from[4], toward[4];
  float start, rate;
} tw_arc_segment;

/* The same great arc at the pace of the straight line between its ends: (1 - u versine, u sine) at u. */
typedef struct nlerp_segment {
  tw_arc_segment arc;
  float versine, sine; /* versine and sine of the arc's angle */
} nlerp_segment;

typedef struct squad_segment {
  tw_arc keys, controls;
} squad_segment;

/* c[0] + u (c[1] + u (c[2] + u c[3])) */
typedef struct cubic {
  double c[4];
} cubic;

typedef struct euler_segment {
  double start[3], change[3];
} euler_segment;

/* The axis moves along the great arc from `axis` toward `toward`, while the angle changes linearly from
 * `start`. */
typedef struct turn_segment {
  double axis[3], toward[3], axis_angle;
  double start, change;
} turn_segment;

/* Segment i goes from key i to key i + 1. The last one stands still, for times at or after the last key.
 * Immutable. */
typedef struct tw_track {
  track_kind kind;
  uint32_t node;
  tw_path path;
  bool holds;           /* STEP: each value holds until the next key */
  uint32_t width;       /* floats in a sample */
  tw_euler_order order; /* TRACK_EULER */
  const tw_timeline *timeline;
  uint32_t timeline_index;
  const float *keys; /* [key_count][width]: TRACK_VALUES_STEP, _LINEAR, TRACK_SQUAD, TRACK_HERMITE */
  union {
    const tw_arc_segment *arcs;  /* [key_count] */
    const nlerp_segment *nlerps; /* [key_count] */
    const squad_segment *squads; /* [key_count] */
    const cubic *cubics;         /* [key_count][width] */
    const euler_segment *eulers; /* [key_count] */
    const turn_segment *turns;   /* [key_count] */
    const void *any;
  } segments;
} tw_track;

/* Compiles keys that tw_clip_check has accepted. `interpolation` may differ from the keys' own when `forced`.
 * Memory comes from the arena. TW_INVALID (pointer relative to the track: "/quaternions/3") on a key that is
 * no rotation; TW_NO_MEMORY. */
tw_status tw_track_build(tw_track *track, tw_arena *arena, const tw_track_keys *keys,
                         tw_interpolation interpolation, bool forced, const tw_timeline *timeline,
                         tw_error *error);

enum { TW_TRACK_BATCH = 64 };

/* Samples at clamped times. keys[i] is the last key at or before times[i]. count: at most TW_TRACK_BATCH.
 * out: [count] places for `width` floats, `step` bytes apart. */
void tw_track_sample(const tw_track *track, const float *times, const uint32_t *keys, size_t count,
                     float *out, size_t step);

/* Evaluates each arc at its own clamped time, which is not before the arc's start. count: at most
 * TW_TRACK_BATCH. out[i]: 4 floats. A result's bits depend only on its own arc and time. */
void tw_arcs_sample(const tw_arc_segment *const *arcs, const float *times, size_t count, float *const *out);

/* Seconds from a key to the next; 0 for the last one. */
double tw_track_seconds(const tw_track *track, uint32_t key);

/* The rotation of a rotation track at `part`, in [0, 1], of segment `key`, not yet rounded to single
 * precision; at 0 it is the key's sample. Its length is 1 within 1e-6. */
void tw_track_rotation(const tw_track *track, uint32_t key, double part, double out[4]);

/* The angle that the path turns through between two of its rotations, of which nothing between them is known:
 * the lesser one, up to 180 degrees. The signs of a spline's quaternions are continuous, so they tell up to
 * 360 degrees. */
double tw_track_angle(const tw_track *track, const double from[4], const double to[4]);

/* An estimate of how far a rotation track turns in segment `key`, too large rather than too small. It tells
 * how densely the path has to be sampled. */
double tw_track_travel(const tw_track *track, uint32_t key);

/* Classes of the step between two keys. In the last two the way it turns is arbitrary, or is not the way that
 * quaternions turn between the same rotations. */
typedef enum tw_turn {
  TURN_SHORT, /* neither; splines and STEP tracks too */
  TURN_HALF,  /* 180 degrees, but for rounding */
  TURN_LONG   /* an angle changes by more than 180 degrees */
} tw_turn;

/* Classifies the step from a key of a rotation track to the next. Slerp, nlerp and squad never turn by more
 * than 180 degrees. */
tw_turn tw_track_turn(const tw_track *track, uint32_t key);

/* The same from one triple of Euler angles to another, each interpolated on its own. */
tw_turn tw_angles_turn(const double from[3], const double to[3]);

/* Whether the track interpolates the keys' own angles, which tell how far a step turns. */
bool tw_track_says_angles(const tw_track *track);

#endif
