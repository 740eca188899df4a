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

#ifdef __cplusplus
}
#endif
#endif
