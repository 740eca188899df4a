/* One track made ready for sampling. Built by track_build.c, sampled by track_sample.c. */
#ifndef TWEEND_TRACK_H
#define TWEEND_TRACK_H

#include <string.h>

#include "quat.h"
#include "timeline.h"

/* How a track is evaluated, which decides the type of its segments. */
typedef enum track_kind {
  TRACK_ARC,           /* rotation, step and slerp: arc_segment */
  TRACK_NLERP,         /* rotation: arc_segment and nlerp_shape */
  TRACK_SQUAD,         /* rotation: squad_segment */
  TRACK_HERMITE,       /* rotation, cubic spline: cubic [4] */
  TRACK_EULER,         /* rotation: euler_segment */
  TRACK_AXIS_ANGLE,    /* rotation: turn_segment */
  TRACK_VALUES_STEP,   /* float [width] a key */
  TRACK_VALUES_LINEAR, /* float [width] a key */
  TRACK_VALUES_HERMITE /* cubic [width] */
} track_kind;

/* from cos v + toward sin v with v = (time - start) rate. At v = 0 this is `from`, bit for bit: the key.
 * toward is as long as from. */
typedef struct arc_segment {
  float from[4], toward[4];
  float start, rate;
} arc_segment;

/* Its numbers by their places. A track keeps each of them for all its segments in a row, so that many times
 * are sampled in vectors; a clip also keeps them for many tracks in blocks, in the order of time
 * (arc_group.h), for single times. Vectors are loaded whole, with up to ARC_ROOM numbers beyond the last. */
enum { ARC_FROM = 0, ARC_TOWARD = 4, ARC_START = 8, ARC_RATE, ARC_NUMBERS, ARC_ROOM = 15 };

/* Arcs of some tracks side by side, and whose they are. */
enum { ARC_BLOCK = 16 };
typedef struct arc_block {
  float numbers[ARC_NUMBERS][ARC_BLOCK];
  uint32_t nodes[ARC_BLOCK];
} arc_block;

/* The same great arc at the pace of the straight line between its ends: at u the direction is
 * (1 - u versine, u sine). */
typedef struct nlerp_shape {
  float versine, sine; /* of the arc's angle */
} nlerp_shape;

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

/* The axis goes along the great arc from `axis` toward `toward`, the angle linearly. */
typedef struct turn_segment {
  double axis[3], toward[3], axis_angle;
  double start, change;
} turn_segment;

/* Segment i goes from key i to key i + 1; the last one stands still, for times at or after the last
 * key. Immutable. */
typedef struct tw_track {
  track_kind kind;
  uint32_t node;
  tw_path path;
  bool holds;           /* STEP: keeps each value until the next key */
  uint32_t width;       /* floats in a sample */
  tw_euler_order order; /* TRACK_EULER */
  const tw_timeline *timeline;
  uint32_t timeline_index;
  const float *keys; /* [key_count][width]: TRACK_VALUES_STEP, _LINEAR, TRACK_SQUAD, TRACK_HERMITE */
  union {
    const float *arcs;           /* [ARC_NUMBERS][key_count], then room */
    const squad_segment *squads; /* [key_count] */
    const cubic *cubics;         /* [key_count][width] */
    const euler_segment *eulers; /* [key_count] */
    const turn_segment *turns;   /* [key_count] */
  } segments;
  const nlerp_shape *shapes; /* [key_count], TRACK_NLERP */
} tw_track;

/* Compiles keys that tw_clip_create has checked. `interpolation` may differ from the keys' own when
 * `forced`. Memory comes from the arena. TW_INVALID (pointer from the track: "/quaternions/3") on a key
 * that is no rotation, TW_NO_MEMORY. */
tw_status tw_track_build(tw_track *track, tw_arena *arena, const tw_track_keys *keys,
                         tw_interpolation interpolation, bool forced, const tw_timeline *timeline,
                         tw_error *error);

/* Values at clamped times, keys[i] being the key at or before times[i]. out: [count][width]. */
void tw_track_sample(const tw_track *track, const float *times, const uint32_t *keys, size_t count,
                     float *out);

/* Seconds from a key to the next; 0 for the last one. */
double tw_track_seconds(const tw_track *track, uint32_t key);

/* The rotation of a rotation track at `part` of segment `key`, in [0, 1], before it is rounded to single
 * precision; at 0 the key's sample. Of length 1 within 1e-6. */
void tw_track_rotation(const tw_track *track, uint32_t key, double part, double out[4]);

/* About how far a rotation track turns in segment `key`, rather too much than too little: what sampling its
 * path densely enough needs. */
double tw_track_travel(const tw_track *track, uint32_t key);

/* Of a track that has arcs. */
static inline arc_segment track_arc(const tw_track *track, uint32_t key) {
  float numbers[ARC_NUMBERS];
  for (size_t i = 0; i < ARC_NUMBERS; i++)
    numbers[i] = track->segments.arcs[i * track->timeline->key_count + key];
  arc_segment arc;
  memcpy(&arc, numbers, sizeof arc);
  return arc;
}

/* Rotations of a track at [count] times: out[i] is that of arc which[i] of arc_count, which starts at or
 * before times[i]. Quickest where they ascend. out: [count][4]. */
void tw_arcs_sample(const float *arcs, size_t arc_count, const uint32_t *which, const float *times,
                    size_t count, float *out);

/* Puts rotations of many tracks at one time into the local transforms of their nodes: of the arcs before the
 * first one from `block` on that starts later, which there is, those in its block and in `window` ones before
 * it; one after another, so that the last of a node counts. None of them starts later. */
void tw_arcs_pose(const arc_block *blocks, size_t window, size_t block, float time, tw_trs *locals);

/* What does tw_timeline_find_all and these on one instruction set. */
typedef struct tw_track_kernels {
  void (*find_keys)(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                    uint32_t *keys);
  void (*sample_arcs)(const float *arcs, size_t arc_count, const uint32_t *which, const float *times,
                      size_t count, float *out);
  void (*pose_arcs)(const arc_block *blocks, size_t window, size_t block, float time, tw_trs *locals);
} tw_track_kernels;
extern const tw_track_kernels tw_track_kernels_avx2, tw_track_kernels_avx512;

/* 0 for every machine, 1 AVX2, 2 AVX-512; NULL for one that the machine lacks. All give the same bytes. */
const tw_track_kernels *tw_track_kernels_at(uint32_t instruction_set);

#endif
