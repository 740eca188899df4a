/* Judges a clip as a whole: whether it loops, how its root travels, which nodes never move, when feet touch
 * the ground and how far they slide, how noisy its tracks are, and single keys that leap out. */
#ifndef TWEEND_CLIP_REPORT_H
#define TWEEND_CLIP_REPORT_H

#include "tweend/anim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How the last pose differs from the first: each node relative to its parent. */
typedef struct tw_clip_seam {
  uint32_t node;   /* of the largest angle; of the largest distance where nothing turns; TW_NO_INDEX: all are
                      equal */
  double angle;    /* radians, the largest of all nodes */
  double distance; /* the largest of all nodes, in the world */
  double speed;    /* radians a second, the largest difference of angular velocities, as vectors */
} tw_clip_seam;

/* The motion in the world of the topmost node that the clip moves. */
typedef struct tw_clip_travel {
  uint32_t node;   /* TW_NO_INDEX: the clip moves none */
  double distance; /* from the first place to the last, straight */
  double speed;    /* the length of the path by the clip's duration */
  double turn;     /* radians about +y from the first pose on, whole turns included */
} tw_clip_travel;

/* A time in which a foot stands on the ground. */
typedef struct tw_contact {
  uint32_t node;
  double from, to;
  double slide; /* the largest horizontal distance from where the foot was at `from` */
} tw_contact;

typedef struct tw_track_noise {
  uint32_t track; /* as in the clip's keys */
  double rms;     /* radians for rotations; of translations in the world; else as the values */
} tw_track_noise;

/* A single key that leaps out of the path of its neighbours, and back. */
typedef struct tw_pop {
  uint32_t node;
  double time, angle; /* radians from where the neighbours lead */
} tw_pop;

typedef struct tw_clip_report {
  tw_clip_seam loop;
  tw_clip_travel root;
  uint32_t still_count, foot_count, contact_count, noise_count, pop_count;
  uint32_t *still;      /* [still_count] nodes that the clip does not move, ascending */
  const uint32_t *feet; /* [foot_count] those whose contacts are told; the caller's where it names them */
  double height;        /* how high the nodes reach at rest; contacts are found only above 0 */
  tw_contact *contacts;
  tw_track_noise *noise;
  tw_pop *pops;
} tw_clip_report;

typedef struct tw_inspect_job {
  const tw_clip_keys *keys;
  const tw_node *nodes;  /* [node_count] */
  const uint32_t *order; /* of tw_nodes_order */
  uint32_t node_count, foot_count;
  const uint32_t *feet; /* [foot_count] nodes; NULL: those that usual names tell (anim/bone_names.c); without
                           these, those whose names have "foot" in them, else "ankle" */
  /* NULL, or the clip of tw_clip_take_root that the keys follow, without its root's motion: feet below the
   * root's node are judged with it put back, since one that stands slides when it is taken. */
  const tw_clip *without_root;
  uint32_t root;    /* the node */
  const double *up; /* [3] of unit length, in the world, along which heights are; NULL: y */
} tw_inspect_job;

/* Inspects a clip on its nodes. The arrays of the report live in the arena.
 *
 * Motion is followed at 60 frames a second, less densely where frames times nodes are over 4 million. A foot
 * touches the ground for three frames or more while it is slower than a quarter of the figure's height at
 * rest a second, and less than 3 % of that height above its lowest place; or above where it stands, as on
 * steps, if in the quarters of a second before and after it is higher, together by 1 % of that height; at the
 * clip's ends, if on its way to or from the other place where it is slow it is that much above the straight
 * line. Noise
 * is what a parabola through seven keys leaves of the middle one, for tracks of seven keys or more that do
 * not step. A pop is a key over 5 degrees, and over eight times the track's median, away from the slerp of
 * its neighbours, which are at most 0.1 s apart.
 *
 * Errors are those of tw_clip_create; TW_NO_MEMORY, TW_CANCELLED. O(frames nodes + keys log keys). */
tw_status tw_clip_inspect(const tw_inspect_job *job, tw_arena *arena, tw_clip_report *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
