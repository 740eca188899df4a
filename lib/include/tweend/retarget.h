/* Humanoid bones, and clips of one skeleton carried over to another. */
#ifndef TWEEND_RETARGET_H
#define TWEEND_RETARGET_H

#include "tweend/anim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The bones of VRM 1.0's humanoid, in the order of its specification (VRMC_vrm 1.0, "humanoid"). Each bone of
 * the left side is followed by that of the right side. */
typedef enum tw_bone {
  TW_BONE_HIPS,
  TW_BONE_SPINE,
  TW_BONE_CHEST,
  TW_BONE_UPPER_CHEST,
  TW_BONE_NECK,
  TW_BONE_HEAD,
  TW_BONE_JAW,
  TW_BONE_EYE, /* from here on every bone has two sides: the left one, then the right one */
  TW_BONE_UPPER_LEG = TW_BONE_EYE + 2,
  TW_BONE_LOWER_LEG = TW_BONE_UPPER_LEG + 2,
  TW_BONE_FOOT = TW_BONE_LOWER_LEG + 2,
  TW_BONE_TOES = TW_BONE_FOOT + 2,
  TW_BONE_SHOULDER = TW_BONE_TOES + 2,
  TW_BONE_UPPER_ARM = TW_BONE_SHOULDER + 2,
  TW_BONE_LOWER_ARM = TW_BONE_UPPER_ARM + 2,
  TW_BONE_HAND = TW_BONE_LOWER_ARM + 2,
  TW_BONE_THUMB = TW_BONE_HAND + 2, /* three joints of a finger, from the hand outwards */
  TW_BONE_INDEX = TW_BONE_THUMB + 6,
  TW_BONE_MIDDLE = TW_BONE_INDEX + 6,
  TW_BONE_RING = TW_BONE_MIDDLE + 6,
  TW_BONE_LITTLE = TW_BONE_RING + 6,
  TW_BONES = TW_BONE_LITTLE + 6
} tw_bone;
extern const char *const tw_bone_names[TW_BONES]; /* "hips", "leftUpperLeg", ... */

/* The bone of a name of VRM's, of `length` bytes; TW_BONES for any other name. */
uint32_t tw_bone_find(const char *name, size_t length);

/* ---- retargeting ----------------------------------------------------------------------------------------
 * A clip of one skeleton, the source, becomes keys for another one, the target. Bones are matched by a map of
 * the caller's, by humanoid maps, by equal names, and by the names that usual rigs have (anim/bone_names.c);
 * a name that means another bone in each of two usual rigs, or one that another node already is, does not
 * match itself. Of several figures in a file usual names are those of the one with the most bones below its
 * hips. Bones of spines that differ in number match by their place between hips and neck.
 *
 * Rotations are carried over in the world, relative to each rest pose: target = source * source_rest^-1 *
 * alignment * target_rest. The alignment of a limb turns the target's rest direction, from the joint to the
 * next matched one, into the source's, so that the hand points where the source's points; hands and fingers
 * without a next joint go with their limb. The trunk, shoulders, feet and toes keep their own rest pose,
 * unless it is more than 30 degrees off. Where both have humanoid maps nothing is aligned, since VRM requires
 * T-poses. A source that rests with its legs folded up beside the trunk, as motion capture does whose bones
 * all rest along one axis, is carried over relative to its pose in the clip where it stands straightest, as
 * if it faced forwards there. A figure that faces another way, or has another axis up, moves as it faces; one
 * whose left side is its right one because scales mirror it moves as its mirror image. Bones of the source
 * without counterpart that lead from one matched bone to the next are taken into the one above them: it gets
 * their product, turned so that it points to where the next joint is. Bones of the target without counterpart
 * that do so share its motion: in the spine and neck all of it, in equal parts; elsewhere the turn about the
 * bone's own direction. Spines that bend at other joints are swung about their first one until neck and
 * shoulders are, in the mean, where the source's are. All other bones keep their rest pose. Hips, and matched
 * nodes above them, are moved by the ratio of leg lengths (of hip heights between humanoid maps; of all
 * lengths where there are no legs). Other bones get translations and scales only where they rest as in the
 * source. */

/* A pair of nodes that whoever asks for a clip names as counterparts. */
typedef struct tw_bone_names_pair {
  const char *source, *target; /* names of nodes; target NULL: the source moves nothing */
} tw_bone_names_pair;

/* How whoever asks for a clip wants it carried over; a view. */
typedef struct tw_retarget_wish {
  bool is_auto; /* false: the clip moves nodes by their names, as it is */
  bool holds_feet;
  bool has_map;
  uint32_t pair_count;             /* at most TW_BONE_PAIRS_MAX */
  const tw_bone_names_pair *pairs; /* [pair_count] the map */
} tw_retarget_wish;
enum { TW_BONE_PAIRS_MAX = 1024 };

typedef enum tw_match { TW_MATCH_MAP, TW_MATCH_HUMANOID, TW_MATCH_NAME, TW_MATCH_USUAL } tw_match;
extern const char *const tw_match_names[]; /* "map", "humanoid", "name", "usual" */

/* The nodes of a model; a view. */
typedef struct tw_skeleton {
  const tw_node *nodes;
  const uint32_t *order; /* [node_count] from tw_nodes_order */
  uint32_t node_count;
  const uint32_t *humanoid; /* [TW_BONES], or NULL */
  const bool *is_bone;      /* [node_count] joints of skins and of the humanoid map; NULL: all nodes */
} tw_skeleton;

typedef struct tw_bone_pair {
  uint32_t source, target; /* nodes; a target of TW_NO_INDEX in a map: the source counts as at rest */
} tw_bone_pair;

typedef struct tw_matched_bone {
  uint32_t source, target;
  tw_match by;
  double aligned; /* radians that the target's rest pose is turned by */
} tw_matched_bone;

typedef struct tw_retarget_job {
  tw_skeleton source, target;
  const tw_clip_keys *keys; /* of the source; tw_clip_create takes them */
  uint32_t map_count;
  const tw_bone_pair *map; /* [map_count] each source once, each target once */
  /* Of keys that are not carried over one by one: Euler angles that are interpolated each on its own, turns
   * about axes, products of several tracks. The distance is in parts of the target's size. */
  tw_tolerance tolerance;
  uint32_t max_keys; /* of a track */
  bool holds_feet;   /* feet stay where the source's feet touch the ground, see anim/foot_hold.h */
} tw_retarget_job;

/* Lives in the arena. */
typedef struct tw_retargeted {
  tw_clip_keys keys; /* of the target: name NULL, quaternions for rotations. A track of one source joint has
                        that joint's times and interpolation, and its values are exact; others are LINEAR,
                        with all times of their source tracks and as many between as the tolerance needs, or
                        STEP where all of those are. Arrays may be the job's */
  uint32_t bone_count;
  tw_matched_bone *bones; /* [bone_count] by target */
  double scale;           /* of distances */
  uint32_t without_target_count, without_source_count;
  /* Source bones that the clip moves and no bone of the target follows, ascending. */
  uint32_t *without_target;
  uint32_t *without_source; /* bones of the target that keep their rest pose, ascending */
  float stance_time;        /* of the clip's pose that counts as the source's rest pose; -1: its own does */
  uint32_t held_count;      /* feet that are held; of 2 */
  uint32_t lost_count;      /* translations and scales of matched bones that are not carried over */
} tw_retargeted;

/* TW_INVALID: a map that names a node twice or one that is not there (pointer "/map/3"); TW_UNSUPPORTED: a
 * skeleton without two bones, or fewer than half of the smaller skeleton's bones match; TW_LIMIT,
 * TW_NO_MEMORY, TW_CANCELLED. O(nodes log nodes + keys), and more keys where the tolerance needs them. */
tw_status tw_retarget_run(const tw_retarget_job *job, tw_arena *arena, tw_retargeted *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
