/* The names of humanoid bones: VRM's own, and those that usual rigs give them. */
#include "tweend/retarget.h"

#include <string.h>

#define SIDES(name)  "left" name, "right" name
#define FINGER(name) SIDES(name "Proximal"), SIDES(name "Intermediate"), SIDES(name "Distal")

const char *const tw_bone_names[TW_BONES] = {"hips",
                                             "spine",
                                             "chest",
                                             "upperChest",
                                             "neck",
                                             "head",
                                             "jaw",
                                             SIDES("Eye"),
                                             SIDES("UpperLeg"),
                                             SIDES("LowerLeg"),
                                             SIDES("Foot"),
                                             SIDES("Toes"),
                                             SIDES("Shoulder"),
                                             SIDES("UpperArm"),
                                             SIDES("LowerArm"),
                                             SIDES("Hand"),
                                             SIDES("ThumbMetacarpal"),
                                             SIDES("ThumbProximal"),
                                             SIDES("ThumbDistal"),
                                             FINGER("Index"),
                                             FINGER("Middle"),
                                             FINGER("Ring"),
                                             FINGER("Little")};

uint32_t tw_bone_find(const char *name, size_t length) {
  for (uint32_t i = 0; i < TW_BONES; i++)
    if (strlen(tw_bone_names[i]) == length && memcmp(tw_bone_names[i], name, length) == 0) return i;
  return TW_BONES;
}
