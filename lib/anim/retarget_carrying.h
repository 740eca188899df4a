/* A clip that is carried over to another skeleton: what the steps of retarget_keys.c share. */
#ifndef TWEEND_RETARGET_CARRYING_H
#define TWEEND_RETARGET_CARRYING_H

#include "clip.h"
#include "retarget_fit.h"
#include "signal_keys.h"

/* A step of a path through the source: a constant turn, then the joint's rotation. */
typedef struct tw_path_step {
  double gap[4];
  uint32_t track;
  bool is_inverse; /* its inverse: the path goes up */
} tw_path_step;

typedef struct tw_turn_path {
  tw_path_step *steps; /* [count] */
  uint32_t count;
  double end[4]; /* a constant turn behind the last step */
} tw_turn_path;

/* Where a bone points that takes in the source's bones below it: from its joint to the next. */
typedef struct tw_aim {
  const uint32_t *nodes; /* [count] the bones that are taken in, from the upper one down */
  uint32_t count;
  double next[3];   /* the next joint, in the last bone's frame */
  double rest[3];   /* the direction to it at rest, in the frame of the target's bone */
  double offset[4]; /* C of the bone */
} tw_aim;

/* A spine that is swung as a whole: retarget_spine.c. Places in the frames of both figures' hips, unless it
 * says otherwise. */
typedef struct tw_spine_swing {
  uint32_t hips, first;                /* nodes of the target: hips, and the spine's first bone */
  uint32_t *source, source_count;      /* [source_count] nodes from below the hips to the last of the spine */
  uint32_t *target, target_count;      /* [target_count] */
  double source_top[3], target_top[3]; /* of the spine, at rest, in the frames of the last nodes */
  double source_rest[3], target_rest[3]; /* the same places, as the source rests */
  double joint[3];                       /* of the target's first bone */
  double turn[4], ratio;                 /* from the source's hips to the target's */
  float (*room)[4];
} tw_spine_swing;

/* A rotation of the target as a function of time. */
typedef struct tw_bone_turn {
  const tw_aim *own, *above;   /* or NULL */
  const tw_spine_swing *spine; /* of the spine's first bone, and of what hangs on the spine; or NULL */
  bool is_first_of_spine;
  uint32_t spine_depth; /* how many of the spine's nodes are above */
  double spine_hang[4]; /* from the last of these, or the hips, to the parent */
  double hang[4];       /* K^-1, see retarget_keys.c */
  double before[4], after[4];
  tw_turn_path path;
  tw_share share;
  uint32_t part, parts; /* the share: which of how many; parts 1: the whole */
  double rest[4], direction[3];
  double left[4], right[4]; /* of part > 0: around the share */
} tw_bone_turn;

typedef struct tw_carrying {
  const tw_retarget_job *job;
  tw_bone_match match;
  tw_fit fit;
  tw_arena *arena; /* of the result */
  tw_arena *scratch;
  tw_track_keys *tracks;       /* [tracks of the source] with quaternions */
  uint32_t *track_of[3];       /* by path, [nodes of the source] or TW_NO_INDEX */
  tw_clip *clip;               /* of `tracks` */
  uint32_t *depths[2];         /* [nodes of the source, of the target] nodes from the root to each */
  const tw_aim **aims;         /* [bones of the fit] or NULL */
  tw_bone_turn **turns;        /* [nodes of the target] or NULL */
  const tw_spine_swing *spine; /* or NULL */
  tw_track_keys *out;
  uint32_t out_count;
  uint32_t lost_count;
} tw_carrying;

tw_status tw_carrying_no_memory(tw_error *error);

/* ---- scales with signs: retarget_signs.c ----------------------------------------------------- */

/* The job with skeletons and keys whose scales have no signs. It lives in the arena. *signs: of the target's
 * nodes, for tw_signs_give_back; NULL where the target has none. bones: as of tw_bones_list. */
tw_status tw_signs_take(const tw_retarget_job *job, uint32_t bones[2][TW_BONES], tw_arena *arena,
                        tw_retarget_job *out, uint8_t **signs, tw_error *error);

/* Turns keys into those of the target as it was. */
tw_status tw_signs_give_back(const tw_skeleton *target, const uint8_t *signs, tw_arena *arena,
                             tw_clip_keys *keys, tw_error *error);

/* ---- rest poses that are no stance: retarget_stance.c ---------------------------------------- */

/* Lets a source that rests folded rest as it stands in the clip; *time is when, else -1. bones: of the
 * source, as of tw_bones_list. What the job takes lives in the arena. */
tw_status tw_stance_take(const tw_bone_match *match, uint32_t bones[2][TW_BONES], tw_arena *arena,
                         tw_retarget_job *job, float *time, tw_error *error);

/* ---- the source's tracks: retarget_tracks.c -------------------------------------------------- */

/* Takes the source's tracks, rotations as quaternions, and compiles them. What the map leaves out rests. */
tw_status tw_tracks_take(tw_carrying *c, tw_error *error);

/* The local transform of a node of the source at a time. */
tw_trs tw_carrying_source_at(const tw_carrying *c, uint32_t node, float time);

/* place = the transform of a place. */
void tw_move_place(const tw_trs *trs, double place[3]);

/* Whether a track moves a node of the source. */
bool tw_carrying_moves(const tw_carrying *c, uint32_t node);

/* ---- turns: retarget_turns.c ----------------------------------------------------------------- */

/* The rotation of a node at rest. */
void tw_rest_turn(const tw_skeleton *skeleton, uint32_t node, double out[4]);

/* Where a node rests in the frame of one above it; false where that is not above. */
bool tw_rest_place_in(const tw_skeleton *skeleton, uint32_t above, uint32_t node, double out[3]);

/* Makes the turns of all matched bones, and of those that share them. */
tw_status tw_turns_make(tw_carrying *c, tw_error *error);

/* joints: the rotation of each step's joint. lead: a turn before all others. */
void tw_turn_evaluate(const tw_bone_turn *turn, const float (*joints)[4], const double lead[4],
                      double out[4]);

/* Evaluates at one time, before the spine is swung. time: NULL: as the source rests. room: [steps][4]. */
void tw_turn_unswung(const tw_carrying *c, const tw_bone_turn *turn, const float *time, float (*room)[4],
                     double out[4]);

enum { TW_TURN_STEPS_MOST = 1 << 20 };

/* TW_LIMIT where all turns together, and the steps that were taken to make them, look at more nodes than
 * TW_TURN_STEPS_MOST. */
tw_status tw_turns_measure(const tw_carrying *c, uint64_t steps, tw_error *error);

/* Lists the tracks of the source that a turn depends on, some more than once, and returns their number.
 * tracks: NULL: only counts them. */
uint32_t tw_turn_tracks(const tw_carrying *c, const tw_bone_turn *turn, uint32_t *tracks);

/* How many nodes evaluating a turn looks at. */
uint64_t tw_turn_cost(const tw_carrying *c, const tw_bone_turn *turn);

/* ---- spines that bend elsewhere: retarget_spine.c -------------------------------------------- */

/* Where the spines bend at different joints, computes the swing and adds it to the turns that it changes.
 * Call after tw_turns_make. Errors as tw_turns_measure, and TW_NO_MEMORY. */
tw_status tw_spine_make(tw_carrying *c, tw_error *error);

/* Adds a track of the first joint's translation, where the swing alone leaves the top too far off at some
 * time. */
tw_status tw_spine_carry(tw_carrying *c, tw_error *error);

/* Evaluates a turn at one time. room: [steps][4]. */
void tw_turn_at(const tw_carrying *c, const tw_bone_turn *turn, float time, float (*room)[4], double out[4]);

/* ---- keys of the result: retarget_samples.c -------------------------------------------------- */

/* Adds what a signal of the source's tracks gives as a track of the target's node. The signal's tracks and
 * limits are the job's. */
tw_status tw_signal_carry(tw_carrying *c, tw_signal signal, uint32_t node, tw_error *error);

/* What becomes of a value, or of a tangent. */
typedef void tw_map_value(const void *context, const double *value, bool is_tangent, double *out);

/* Adds a copy of a track's keys for another node. */
tw_status tw_keys_carry(tw_carrying *c, const tw_track_keys *track, uint32_t node, tw_map_value *map,
                        const void *context, tw_error *error);

/* ---- places: retarget_places.c --------------------------------------------------------------- */

/* Radians and parts within which two bones rest alike. */
#define TW_REST_LIKE 1e-3

/* Whether scales of hips, or of a matched node above them, go over: along the same axes. */
bool tw_carries_scale(const tw_fitted_bone *bone);

/* Carries the translation of hips, and of matched nodes above them, over by their places in the world. */
tw_status tw_places_carry(tw_carrying *c, tw_error *error);

#endif
