/* What one name says, by the names that usual rigs give their bones.
 * A name is cut into its side, its stem (lower-case letters without side, prefix and digits) and its digits:
 * "mixamorig:LeftHandIndex1" is left, "handindex", "1". One table says what a stem means. Sources:
 * - Mixamo: what its FBX downloads are called, "mixamorig:", "mixamorig9:" or, where a program drops colons,
 *   "mixamorig"; Ready Player Me: the same without a prefix (docs.readyplayer.me, "Full-body avatars")
 * - CMU, Bandai, LAFAN1 and others: BVH conversions of mocap.cs.cmu.edu ("LeftUpLeg", "LHipJoint",
 *   "LowerBack"); its ASF files ("lfemur", "upperback"); families of joints that are called after anatomy
 *   ("LeftHip", "LeftKnee", "LeftCollar", "LeftElbow", "Chest2")
 * - Rigify, Blender: Blender's manual, "Rigify": spine to spine.006, "thigh.L", "f_index.01.L"; "DEF-" in
 *   front of deforming bones
 * - Unreal's mannequin: "pelvis", "spine_01", "thigh_l", "calf_l", "ball_l" (Epic's documentation of the
 *   skeleton); MakeHuman's game_engine rig is called likewise
 * - MakeHuman's default rig: default.mhskel: "root", "spine05" to "spine01", "upperleg01.L", "finger2-1.L"
 * - Unity's humanoid: HumanBodyBones: "LeftUpperLeg", "Left Index Proximal"; VRM's and VRoid's
 *   "J_Bip_L_UpperLeg"
 * - OptiTrack's Motive: "Hip", "Ab", "LUArm", "LFArm"; Kinect: JointType of Microsoft's SDK: "SpineBase",
 *   "ElbowLeft"
 * - 3ds Max's Biped ("Bip01 L Thigh", "Finger0"), SMPL ("L_Hip", "L_Collar"), DAZ ("lShldr", "lThighBend"),
 *   Character Creator ("CC_Base_L_Thigh"), Auto-Rig Pro ("thigh_stretch.l", "c_index1.l"), Maya's
 *   AdvancedSkeleton ("Scapula_L", "Root_M"), Perception Neuron ("Robot_LeftUpLeg"), Roblox's R15
 *   ("LowerTorso"), Biovision's own ("LeftUpArm", "LeftLowArm")
 * - Xsens MVN: vertebrae, "L5", "L3", "T12", "T8", and "RightUpperArm"; Rokoko: "LeftFinger2Medial"
 * - Apple's ARKit ("left_upLeg_joint", "spine_1_joint"), Azure Kinect ("SPINE_NAVEL", "HIP_LEFT"), iPi
 *   ("LowerSpine"), VRChat ("Left leg" above "Left knee")
 * - MikuMikuDance's standard bones, with the side in front, or behind as Blender's tools write it
 */
#include "bone_kinds.h"

#include <stdlib.h>
#include <string.h>

static bool is_sided(tw_bone_kind kind) {
  return kind >= KIND_EYE;
}

typedef struct stem_row {
  const char *stem;
  tw_bone_kind kind;
} stem_row;

static const stem_row stems[] = {
    {"hips", KIND_HIP},
    {"hip", KIND_HIP},
    {"pelvis", KIND_HIPS},
    {"spinebase", KIND_HIPS},
    {"lowertorso", KIND_HIPS},
    {"root", KIND_ROOT},
    {"spine", KIND_SPINE},
    {"spinemid", KIND_SPINE},
    {"spineshoulder", KIND_SPINE},
    {"spinenavel", KIND_SPINE},
    {"spinenaval", KIND_SPINE},
    {"spinechest", KIND_SPINE},
    {"lowerspine", KIND_SPINE},
    {"middlespine", KIND_SPINE},
    {"upperspine", KIND_SPINE},
    {"stomach", KIND_SPINE},
    {"chest", KIND_SPINE},
    {"upperchest", KIND_SPINE},
    {"chestupper", KIND_SPINE},
    {"chestlower", KIND_SPINE},
    {"ab", KIND_SPINE},
    {"abdomen", KIND_SPINE},
    {"abdomenupper", KIND_SPINE},
    {"abdomenlower", KIND_SPINE},
    {"lowerback", KIND_SPINE},
    {"upperback", KIND_SPINE},
    {"back", KIND_SPINE},
    {"thorax", KIND_SPINE},
    {"torso", KIND_SPINE},
    {"uppertorso", KIND_SPINE},
    {"waist", KIND_SPINE},
    {"neck", KIND_NECK},
    {"lowerneck", KIND_NECK},
    {"upperneck", KIND_NECK},
    {"necklower", KIND_NECK},
    {"neckupper", KIND_NECK},
    {"necktwist", KIND_NECK},
    {"head", KIND_HEAD},
    {"jaw", KIND_JAW},
    {"lowerjaw", KIND_JAW},
    {"jawroot", KIND_JAW},
    {"eye", KIND_EYE},
    {"upleg", KIND_UPPER_LEG},
    {"upperleg", KIND_UPPER_LEG},
    {"thigh", KIND_UPPER_LEG},
    {"thighbend", KIND_UPPER_LEG},
    {"femur", KIND_UPPER_LEG},
    {"leg", KIND_LEG},
    {"lowerleg", KIND_LOWER_LEG},
    {"lowleg", KIND_LOWER_LEG},
    {"calf", KIND_LOWER_LEG},
    {"shin", KIND_LOWER_LEG},
    {"knee", KIND_LOWER_LEG},
    {"tibia", KIND_LOWER_LEG},
    {"ankle", KIND_ANKLE},
    {"foot", KIND_FOOT},
    {"toe", KIND_TOES},
    {"toes", KIND_TOES},
    {"toebase", KIND_TOES},
    {"ball", KIND_TOES},
    {"collar", KIND_COLLAR},
    {"clavicle", KIND_COLLAR},
    {"scapula", KIND_COLLAR},
    {"shoulder", KIND_SHOULDER},
    {"arm", KIND_UPPER_ARM},
    {"upperarm", KIND_UPPER_ARM},
    {"uparm", KIND_UPPER_ARM},
    {"uarm", KIND_UPPER_ARM},
    {"shldr", KIND_UPPER_ARM},
    {"shldrbend", KIND_UPPER_ARM},
    {"humerus", KIND_UPPER_ARM},
    {"elbow", KIND_ELBOW},
    {"forearm", KIND_LOWER_ARM},
    {"forearmbend", KIND_LOWER_ARM},
    {"farm", KIND_LOWER_ARM},
    {"lowerarm", KIND_LOWER_ARM},
    {"lowarm", KIND_LOWER_ARM},
    {"radius", KIND_LOWER_ARM},
    {"wrist", KIND_WRIST},
    {"hand", KIND_HAND},
    {"thumb", KIND_THUMB},
    {"index", KIND_INDEX},
    {"middle", KIND_MIDDLE},
    {"mid", KIND_MIDDLE},
    {"ring", KIND_RING},
    {"little", KIND_LITTLE},
    {"pinky", KIND_LITTLE},
    {"finger", KIND_FINGER},
    {"センター", KIND_ROOT},
    {"腰", KIND_HIPS},
    {"上半身", KIND_SPINE},
    {"首", KIND_NECK},
    {"頭", KIND_HEAD},
    {"目", KIND_EYE},
    {"足", KIND_LEG},
    {"ひざ", KIND_LOWER_LEG},
    {"足首", KIND_ANKLE},
    {"つま先", KIND_TOES},
    {"肩", KIND_COLLAR},
    {"腕", KIND_UPPER_ARM},
    {"ひじ", KIND_ELBOW},
    {"手首", KIND_WRIST},
    {"親指", KIND_THUMB},
    {"人指", KIND_INDEX},
    {"人差指", KIND_INDEX},
    {"中指", KIND_MIDDLE},
    {"薬指", KIND_RING},
    {"小指", KIND_LITTLE},
};

static tw_bone_kind find_stem(const char *stem) {
  for (size_t i = 0; i < sizeof stems / sizeof *stems; i++)
    if (strcmp(stems[i].stem, stem) == 0) return stems[i].kind;
  return KIND_NONE;
}

/* Prefixes of bones' names; digits and a separator may follow each. */
static const char *const prefixes[] = {"mixamorig", "valvebiped", "bip",   "cc_base", "def", "j_bip",
                                       "character", "joint",      "robot", "b_",      NULL};

enum { WORDS = 8, WORD_SIZE = 24, STEM_SIZE = 64, NAME_SIZE = 200 };

/* A name cut into words: runs of letters of which only the first is a capital, and runs of digits. */
typedef struct words {
  char text[WORDS][WORD_SIZE];
  uint32_t count;
} words;

static bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

static bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

/* Of any script; all but capitals of ASCII count as small. */
static bool is_letter(char c) {
  return is_upper(c) || (c >= 'a' && c <= 'z') || (unsigned char)c >= 0x80;
}

static char lower(char c) {
  if (is_upper(c)) return (char)(c - 'A' + 'a');
  return c;
}

/* A word goes on with the next character. "ABc" are the words "A" and "Bc". */
static bool goes_on(const char *at) {
  char here = at[0], next = at[1];
  if (is_digit(here) || is_digit(next)) return is_digit(here) && is_digit(next);
  if (!is_letter(next)) return false;
  if (is_upper(here) && is_upper(next)) return !(is_letter(at[2]) && !is_upper(at[2]));
  return !is_upper(next);
}

/* False for a name that is none of a bone: longer than any in the table, or with other characters. */
static bool cut(const char *name, words *out) {
  *out = (words){0};
  for (const char *c = name; *c; c++) {
    if (!is_letter(*c) && !is_digit(*c)) {
      if (strchr(" ._-", *c)) continue;
      return false;
    }
    size_t length = 0;
    if (out->count == WORDS) return false;
    char *word = out->text[out->count++];
    for (;; c++) {
      if (length + 1 == WORD_SIZE) return false;
      word[length++] = lower(*c);
      if (!goes_on(c)) break;
    }
    word[length] = '\0';
  }
  return true;
}

/* What stands behind a prefix; NULL where the name does not begin with it. */
static const char *behind(const char *name, const char *prefix) {
  const char *rest = name;
  for (const char *c = prefix; *c; c++, rest++)
    if (lower(*rest) != *c) return NULL;
  const char *end = rest;
  while (is_digit(*rest)) rest++;
  while (*rest && strchr(" ._-", *rest)) rest++;
  bool is_apart = rest > end || is_upper(*rest) || end[-1] == '_';
  return *rest && is_apart ? rest : NULL;
}

static const char *behind_namespace(const char *name) {
  for (const char *c = name; *c; c++)
    if (*c == ':' || *c == '|') name = c + 1;
  return name;
}

const char *tw_bone_behind_prefixes(const char *name) {
  name = behind_namespace(name);
  for (uint32_t i = 0; prefixes[i]; i++) {
    const char *rest = behind(name, prefixes[i]);
    if (rest) name = rest;
  }
  return name;
}

size_t tw_bone_length_without_tail(const char *name) {
  size_t length = strlen(name), end = length;
  while (end > 0 && is_digit(name[end - 1])) end--;
  return end > 1 && length - end >= 2 && name[end - 1] == '_' ? end - 1 : length;
}

bool tw_bone_is_deforming(const char *name) {
  return behind(behind_namespace(name), "def") != NULL;
}

/* Copies a bone's own name: without what the dialect has around it, and with Japanese sides and digits as
 * Latin ones. Returns false where the dialect says that the node is no bone of the figure, or the name is too
 * long. */
static bool own_name(const char *name, const tw_bone_dialect *dialect, char out[NAME_SIZE]) {
  static const struct { const char *from, *to; } letters[] = {{"左", "left."}, {"右", "right."}};
  if (dialect->only_deforming && !tw_bone_is_deforming(name)) return false;
  const char *own = tw_bone_behind_prefixes(name);
  size_t size = 0, length = dialect->has_tails ? tw_bone_length_without_tail(own) : strlen(own);
  const char *end = own + length;
  if (dialect->front_size > 0) {
    if (length <= dialect->front_size || strncmp(own, dialect->front, dialect->front_size) != 0) return false;
    own += dialect->front_size;
  }
  while (own < end && size + 8 < NAME_SIZE) {
    const char *put = NULL;
    for (size_t i = 0; i < 2; i++)
      if (strncmp(own, letters[i].from, strlen(letters[i].from)) == 0) put = letters[i].to;
    if (put) {
      memcpy(out + size, put, strlen(put));
      size += strlen(put);
      own += strlen(letters[0].from);
    } else if (strncmp(own, "\xEF\xBC", 2) == 0 && (unsigned char)own[2] >= 0x90 &&
               (unsigned char)own[2] <= 0x99) { /* U+FF10 to U+FF19 */
      out[size++] = (char)('0' + ((unsigned char)own[2] - 0x90));
      own += 3;
    } else {
      out[size++] = *own++;
    }
  }
  out[size] = '\0';
  return own >= end;
}

static int side_of(const char *word) {
  if (strcmp(word, "left") == 0 || strcmp(word, "l") == 0) return 0;
  if (strcmp(word, "right") == 0 || strcmp(word, "r") == 0) return 1;
  return -1;
}

static bool is_one_of(const char *word, const char *const *list) {
  for (; *list; list++)
    if (strcmp(word, *list) == 0) return true;
  return false;
}

static bool is_part_of_finger(const char *word) {
  static const char *const parts[] = {"proximal", "intermediate", "medial", "distal", NULL};
  return is_one_of(word, parts);
}

/* The words that only tell which joint of a finger it is, that it is a joint, or that a bone is in the
 * middle. CMU's "LeftHipJoint" is no "LeftHip", and Sketchfab's "_rootJoint" no bone. stem: of the words
 * before. */
static bool is_filler(const char *word, uint32_t index, uint32_t count, const char *stem) {
  static const char *const joints[] = {"jnt", "stretch", "bone", NULL};
  static const char *const middles[] = {"c", "m", "x", NULL};
  bool is_end = index == 0 || index + 1 == count;
  if (strcmp(word, "joint") == 0) return *stem && strcmp(stem, "hip") != 0 && strcmp(stem, "root") != 0;
  return is_part_of_finger(word) || is_one_of(word, joints) || (is_end && is_one_of(word, middles));
}

static bool is_finger(tw_bone_kind kind) {
  return kind >= KIND_THUMB && kind <= KIND_LITTLE;
}

/* A stem with what families of rigs put in front of fingers or behind. */
static tw_bone_kind find_kind(const char *stem) {
  static const char back[] = "finger";
  tw_bone_kind found = find_stem(stem);
  if (found != KIND_NONE) return found;
  char front[STEM_SIZE];
  size_t size = strlen(stem);
  if (size > strlen(back) && strcmp(stem + size - strlen(back), back) == 0) {
    memcpy(front, stem, size - strlen(back));
    front[size - strlen(back)] = '\0';
    return is_finger(find_stem(front)) ? find_stem(front) : KIND_NONE;
  }
  const char *const fronts[] = {"hand", "f"};
  for (size_t i = 0; i < sizeof fronts / sizeof *fronts; i++) {
    size_t length = strlen(fronts[i]);
    if (strncmp(stem, fronts[i], length) == 0 && is_finger(find_stem(stem + length)))
      return find_stem(stem + length);
  }
  return KIND_NONE;
}

/* The finger that the digits of a name stand for: Biped counts "Finger0", "Finger01", "Finger1"; MakeHuman
 * "finger1-1"; Rokoko "Finger1Metacarpal" of the thumb, "Finger2Proximal". */
static tw_bone_kind find_finger(const tw_bone_said *said) {
  int first = said->digits[0] - (said->number_count > 1 || said->is_part || said->is_palm ? '1' : '0');
  bool is_thumb = first == 0;
  if (said->number_count == 0 || first < 0 || first >= 5 || (said->is_palm && !is_thumb)) return KIND_NONE;
  return (tw_bone_kind)(KIND_THUMB + first);
}

/* "L5", "T8", "C1". */
static tw_bone_kind find_vertebra(const words *words) {
  static const char letters[] = "ltc";
  static const int counts[] = {5, 12, 7};
  const char *found = strchr(letters, words->text[0][0]);
  if (words->count != 2 || words->text[0][1] != '\0' || !found || !is_digit(words->text[1][0]))
    return KIND_NONE;
  long number = strtol(words->text[1], NULL, 10);
  if (number < 1 || number > counts[found - letters]) return KIND_NONE;
  return *found == 'c' ? KIND_NECK : KIND_SPINE;
}

/* Finds the kind and the side of a stem that begins with its side: "lfemur", "leftfemur". */
static void take_side(const char *stem, tw_bone_said *out) {
  static const char *const fronts[] = {"left", "right", "l", "r"};
  for (int i = 0; i < 4 && out->kind == KIND_NONE; i++) {
    size_t length = strlen(fronts[i]);
    if (strncmp(stem, fronts[i], length) != 0) continue;
    out->kind = find_kind(stem + length);
    out->side = i % 2;
    if (!is_sided(out->kind) && out->kind != KIND_HIP) out->kind = KIND_NONE;
  }
}

tw_bone_kind tw_bone_rigify_kind(const tw_bone_said *said) {
  long number = said->number_count > 0 ? strtol(said->digits, NULL, 10) : 0;
  return number == 0 ? KIND_HIPS : number < 4 ? KIND_SPINE : number < 6 ? KIND_NECK : KIND_HEAD;
}

tw_bone_said tw_bone_listen(const char *name, const tw_bone_dialect *dialect) {
  tw_bone_said out = {.side = -1};
  words words;
  char own[NAME_SIZE], stem[STEM_SIZE] = "";
  if (!name || !own_name(name, dialect, own) || !cut(own, &words)) return out;
  out.vertebra = find_vertebra(&words);
  for (uint32_t i = 0; i < words.count; i++) {
    const char *word = words.text[i];
    bool is_finger = strcmp(stem, "finger") == 0, is_thumb = strcmp(stem, "thumb") == 0;
    if (is_digit(word[0])) {
      if (out.number_count++ == 0) strncpy(out.digits, word, sizeof out.digits - 1);
    } else if (out.side < 0 && side_of(word) >= 0) {
      out.side = side_of(word);
    } else if ((is_finger || is_thumb) && strcmp(word, "metacarpal") == 0) {
      out.is_palm = true;
    } else if (!is_filler(word, i, words.count, stem)) {
      if (strlen(stem) + strlen(word) >= STEM_SIZE) return out;
      strcat(stem, word);
    } else {
      out.is_part = is_part_of_finger(word);
    }
  }
  out.kind = find_kind(stem);
  if (out.kind == KIND_NONE && out.side < 0) take_side(stem, &out);
  if (out.kind == KIND_FINGER) out.kind = find_finger(&out);
  if (out.kind == KIND_TOES && out.number_count > 1) out.kind = KIND_NONE; /* one of several toes */
  if (out.kind == KIND_HIP) out.kind = out.side < 0 ? KIND_HIPS : KIND_UPPER_LEG;
  if (is_sided(out.kind) != (out.side >= 0)) out.kind = KIND_NONE;
  return out;
}
