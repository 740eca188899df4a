/* The layout of a compiled clip, for the functions that evaluate it. */
#ifndef TWEEND_CLIP_H
#define TWEEND_CLIP_H

#include "track.h"

/* What a pose reads of a TRACK_ARC to find its arc; copied here so that a pose reads memory front to back. */
typedef struct posed_arc {
  tw_timeline timeline;
  const tw_arc_segment *arcs;
  uint32_t node;
} posed_arc;

/* Poses are evaluated whole, or by blocks of so many nodes. */
enum { TW_POSE_BLOCK = 128 };

/* Receives times; both it and who tells them stop where it returns false. */
typedef struct tw_bend_sink {
  bool (*take)(void *context, double time);
  void *context;
  uint64_t *left; /* steps that may still be taken, by clips below one another together */
} tw_bend_sink;

/* Puts a time that took some steps to find. */
static inline bool bend_put(const tw_bend_sink *sink, double time, uint64_t steps) {
  if (*sink->left < steps) return false;
  *sink->left -= steps;
  return sink->take(sink->context, time);
}

/* How clips made of other clips are evaluated. */
typedef struct tw_clip_kind {
  void (*pose)(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
               tw_trs *locals); /* as tw_clip_pose_nodes */
  void (*sample)(const tw_clip *clip, uint32_t track, const float *times, size_t time_count,
                 float *out); /* as tw_clip_sample */
  bool (*bends)(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink);
} tw_clip_kind;

struct tw_clip {
  tw_arena *arena; /* owns everything, this struct too */
  uint32_t node_count, track_count, timeline_count;
  float duration;
  tw_track *tracks;       /* [track_count], in the source's order */
  tw_timeline *timelines; /* [timeline_count] */
  posed_arc *arcs;        /* of all tracks that are arcs, by block of nodes */
  uint32_t *others;       /* by block: tracks of transforms that are not arcs; indices into tracks */
  uint32_t *arc_blocks,
      *other_blocks; /* [blocks + 1] the first arc and the first other track of each block */
  uint8_t *moves;    /* [node_count], bit `path` for each path that a track moves */
  /* A clip made of other clips has no timelines, arcs and others: its tracks only say what it moves. */
  const tw_clip_kind *kind;   /* NULL: a plain clip, of keys */
  void *making;               /* what the kind needs */
  uint32_t part_count, depth; /* depth: of clips made of clips, below one another; 0 for a plain clip */
  struct tw_clip **parts;     /* [part_count] the clips that it is made of, which it owns */
  uint32_t cost;              /* samples of plain clips that one sample takes; at least 1 */
  uint32_t leaves;            /* plain clips that it is made of, itself if it is one */
};

/* tw_clip_pose of some nodes alone. first: a multiple of TW_POSE_BLOCK; count: as many, or what is left of
 * the nodes. locals: [count]. */
void tw_clip_pose_nodes(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                        tw_trs *locals);

/* The same, but leaves alone what no track moves, where the clip is a plain one. */
void tw_clip_move_nodes(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                        tw_trs *locals);

/* Tells times of the clip, in any order, between which the track's path is smooth and turns by less than half
 * a turn; where it jumps, a time just before, too. Of a plain clip: its keys, and times between keys that are
 * far apart. False where it was stopped. */
bool tw_clip_bends(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink);

/* Wraps samples of a track as a LINEAR or STEP track. Makes the signs of rotations continuous, in `values`.
 * The result points to times and values. */
tw_track_keys tw_track_as_keys(const tw_track *track, const float *times, float *values, uint32_t key_count);

/* Bakes a track to keys at these times, which the result points to; its values live in the arena.
 * TW_NO_MEMORY. */
tw_status tw_track_bake(const tw_clip *clip, uint32_t index, const float *times, uint32_t time_count,
                        tw_arena *arena, tw_track_keys *out, tw_error *error);

/* Converts a track of Euler angles that are interpolated each on its own to LINEAR keys: its own, bit for bit
 * at their times, and so many between that slerp stays within `tolerance` (radians, at least 1e-6) and turns
 * as the angles do. *reached becomes a bound on what is left, where that is more. Without further keys the
 * result has the track's own times; other arrays live in the arena. TW_LIMIT: more than max_added keys
 * besides its own; TW_NO_MEMORY. O(keys). */
tw_status tw_euler_keys(const tw_track_keys *track, double tolerance, uint32_t max_added, tw_arena *arena,
                        tw_track_keys *out, double *reached, tw_error *error);

/* Makes all the checks that tw_clip_create documents. may_repeat: key times of a track may be equal. The
 * error's pointer begins with /tracks. TW_INVALID, TW_NO_MEMORY. */
tw_status tw_clip_check(const tw_clip_keys *keys, uint32_t node_count, int force, bool may_repeat,
                        tw_error *error);

/* Makes times rise strictly in a clip that tw_clip_check has passed. Where several keys of a track have one
 * time, the value jumps. The first of these keys, with the value before the jump, is moved to the next
 * smaller float; it is dropped where that is negative or not after the key before. The last one stays, the
 * others are dropped. Sets duplicate_times of such tracks; new arrays live in the arena. TW_NO_MEMORY.
 * O(keys). */
tw_status tw_clip_separate(tw_clip_keys *clip, tw_arena *arena, tw_error *error);

#endif
