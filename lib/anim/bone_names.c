/* VRM's names of humanoid bones, and which node of a skeleton is which bone, by the names of all its nodes.
 */
#include <string.h>

#include "bone_kinds.h"
#include "retarget_match.h"

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

typedef struct guesses {
  uint32_t chains[KINDS][2][3], counts[KINDS][2]; /* of each kind and side the first three nodes; how many */
  tw_spine spine;
} guesses;

static void note(guesses *guesses, const tw_bone_said *said, uint32_t node) {
  int side = said->side < 0 ? 0 : said->side;
  uint32_t *count = &guesses->counts[said->kind][side], *chain = guesses->chains[said->kind][side];
  if (*count < 3) chain[*count] = node;
  (*count)++;
  tw_spine *spine = &guesses->spine;
  if (said->kind != KIND_SPINE) return;
  if (spine->count < TW_SPINE_MOST) spine->count++;
  spine->nodes[spine->count - 1] = node;
}

static uint32_t first_of(const guesses *guesses, tw_bone_kind kind, int side) {
  return guesses->counts[kind][side] ? guesses->chains[kind][side][0] : TW_NO_INDEX;
}

/* The first node of two kinds that there is. */
static uint32_t either(const guesses *guesses, tw_bone_kind better, tw_bone_kind other, int side) {
  uint32_t found = first_of(guesses, better, side);
  return found != TW_NO_INDEX ? found : first_of(guesses, other, side);
}

static void settle_side(const guesses *guesses, int side, uint32_t *bones) {
  uint32_t ankle = first_of(guesses, KIND_ANKLE, side), foot = first_of(guesses, KIND_FOOT, side),
           collar = first_of(guesses, KIND_COLLAR, side), shoulder = first_of(guesses, KIND_SHOULDER, side),
           arm = first_of(guesses, KIND_UPPER_ARM, side), elbow = first_of(guesses, KIND_ELBOW, side),
           wrist = first_of(guesses, KIND_WRIST, side), toes = first_of(guesses, KIND_TOES, side);
  uint32_t thigh = first_of(guesses, KIND_UPPER_LEG, side), leg = first_of(guesses, KIND_LEG, side),
           shin = first_of(guesses, KIND_LOWER_LEG, side);
  bool shoulder_is_arm = arm == TW_NO_INDEX && (collar != TW_NO_INDEX || elbow != TW_NO_INDEX);
  bones[TW_BONE_EYE + side] = first_of(guesses, KIND_EYE, side);
  bones[TW_BONE_UPPER_LEG + side] = thigh != TW_NO_INDEX ? thigh : leg;
  bones[TW_BONE_LOWER_LEG + side] = shin != TW_NO_INDEX || thigh == TW_NO_INDEX ? shin : leg;
  bones[TW_BONE_FOOT + side] = ankle != TW_NO_INDEX ? ankle : foot;
  bones[TW_BONE_TOES + side] = toes != TW_NO_INDEX ? toes : ankle != TW_NO_INDEX ? foot : TW_NO_INDEX;
  bones[TW_BONE_SHOULDER + side] = collar != TW_NO_INDEX || shoulder_is_arm ? collar : shoulder;
  bones[TW_BONE_UPPER_ARM + side] = shoulder_is_arm ? shoulder : arm;
  bones[TW_BONE_LOWER_ARM + side] = either(guesses, KIND_LOWER_ARM, KIND_ELBOW, side);
  bones[TW_BONE_HAND + side] = wrist != TW_NO_INDEX ? wrist : first_of(guesses, KIND_HAND, side);
  for (uint32_t finger = 0; finger < 5; finger++)
    for (uint32_t joint = 0; joint < 3 && joint < guesses->counts[KIND_THUMB + finger][side]; joint++)
      bones[TW_BONE_THUMB + 6 * finger + 2 * joint + (uint32_t)side] =
          guesses->chains[KIND_THUMB + finger][side][joint];
}

static void settle(const guesses *guesses, uint32_t *bones) {
  const tw_spine *spine = &guesses->spine;
  for (uint32_t i = 0; i < TW_BONES; i++) bones[i] = TW_NO_INDEX;
  bones[TW_BONE_HIPS] = either(guesses, KIND_HIPS, KIND_ROOT, 0);
  bones[TW_BONE_NECK] = first_of(guesses, KIND_NECK, 0);
  bones[TW_BONE_HEAD] = first_of(guesses, KIND_HEAD, 0);
  bones[TW_BONE_JAW] = first_of(guesses, KIND_JAW, 0);
  if (spine->count > 0) bones[TW_BONE_SPINE] = spine->nodes[0];
  if (spine->count > 1) bones[TW_BONE_CHEST] = spine->nodes[1];
  if (spine->count > 2) bones[TW_BONE_UPPER_CHEST] = spine->nodes[spine->count - 1];
  for (int side = 0; side < 2; side++) settle_side(guesses, side, bones);
}

/* The nodes of one of several figures in a file: not those below other hips than the chosen ones. */
typedef struct figures {
  const tw_skeleton *skeleton;
  const bool *is_bone;
  tw_bone_dialect dialect;
  tw_bone_kind hips;
  tw_bone_said *said; /* [nodes] by their names; of no bone nothing */
  uint32_t *tops;     /* [nodes] the topmost hips above a node or itself, or TW_NO_INDEX */
  uint32_t *below;    /* [nodes] bones below those */
} figures;

static void find_tops(const figures *f) {
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    uint32_t node = f->skeleton->order[i], parent = f->skeleton->nodes[node].parent;
    uint32_t *top = &f->tops[node];
    *top = parent == TW_NO_INDEX ? TW_NO_INDEX : f->tops[parent];
    if (!f->is_bone[node]) continue;
    if (*top == TW_NO_INDEX && f->said[node].kind == f->hips) *top = node;
    if (*top != TW_NO_INDEX) f->below[*top]++;
  }
}

/* The hips with the most bones below them, of as many the first. */
static uint32_t choose_hips(const figures *f) {
  uint32_t best = TW_NO_INDEX;
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    uint32_t node = f->skeleton->order[i];
    if (f->tops[node] == node && (best == TW_NO_INDEX || f->below[node] > f->below[best])) best = node;
  }
  return best;
}

/* ---- how a file names its bones ---------------------------------------------------------------- */

static const char *bone_name(const figures *f, uint32_t node) {
  return f->is_bone[node] ? f->skeleton->nodes[node].name : NULL;
}

static bool has_tails(const figures *f) {
  enum { FEWEST = 8 };
  uint64_t bones = 0, tails = 0;
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    const char *name = bone_name(f, i);
    if (!name) continue;
    bones++;
    tails += name[tw_bone_length_without_tail(name)] != '\0';
  }
  return bones >= FEWEST && 10 * tails >= 9 * bones;
}

/* The part of a name up to its next separator, behind the front found so far; 0: none. */
static size_t next_part(const tw_bone_dialect *d, const char *name) {
  const char *own = tw_bone_behind_prefixes(name);
  if (strncmp(own, d->front ? d->front : "", d->front_size) != 0) return 0;
  size_t length = strcspn(own + d->front_size, " ._-");
  return length > 0 && own[d->front_size + length] ? length + 1 : 0;
}

static bool has_part(const tw_bone_dialect *d, const char *name, const char *part, size_t length) {
  return next_part(d, name) == length &&
         strncmp(tw_bone_behind_prefixes(name) + d->front_size, part, length) == 0;
}

/* Finds what more than half of the bones have in front of their names (Boyer and Moore's vote, part by part).
 */
static bool find_front(figures *f) {
  enum { PARTS = 3 };
  for (int i = 0; i < PARTS; i++) {
    tw_bone_dialect *d = &f->dialect;
    const char *part = NULL;
    uint64_t votes = 0, bones = 0, having = 0;
    size_t length = 0;
    for (uint32_t n = 0; n < f->skeleton->node_count; n++) {
      const char *name = bone_name(f, n);
      bones += name != NULL;
      if (!name) continue;
      bool agrees = votes > 0 && length > 0 && has_part(d, name, part, length);
      if (votes == 0) part = tw_bone_behind_prefixes(name) + d->front_size, length = next_part(d, name);
      votes = votes == 0 || agrees ? votes + 1 : votes - 1;
    }
    for (uint32_t n = 0; length > 0 && n < f->skeleton->node_count; n++)
      having += bone_name(f, n) && has_part(d, bone_name(f, n), part, length);
    if (2 * having <= bones || length == 0) break;
    d->front = part - d->front_size;
    d->front_size += length;
  }
  return f->dialect.front_size > 0;
}

/* Reads the names of all nodes, then those that mean something else in some rigs: a spine counted up to
 * spine.006 is Rigify's, which begins at the hips and ends in neck and head; "L5" and "T8" are vertebrae only
 * where a figure has both lumbar and thoracic ones. */
static void listen_to_all(figures *f) {
  bool is_rigify = false, has_lumbar = false, has_thoracic = false;
  f->hips = KIND_ROOT;
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    tw_bone_said *said = &f->said[i];
    *said = tw_bone_listen(bone_name(f, i), &f->dialect);
    is_rigify |= said->kind == KIND_SPINE && strcmp(said->digits, "006") == 0;
    has_lumbar |= said->vertebra == KIND_SPINE && said->side == 0;
    has_thoracic |= said->vertebra == KIND_SPINE && said->side < 0;
  }
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    tw_bone_said *said = &f->said[i];
    if (has_lumbar && has_thoracic && said->vertebra != KIND_NONE) {
      said->kind = said->vertebra;
      said->side = -1;
    }
    if (is_rigify && said->kind == KIND_SPINE) said->kind = tw_bone_rigify_kind(said);
    if (said->kind == KIND_HIPS) f->hips = KIND_HIPS;
  }
}

/* Guesses the bones of a figure from names that are read by f->dialect. Returns whether they make a figure.
 */
static bool guess(figures *f, uint32_t bones[TW_BONES], tw_spine *spine) {
  guesses guesses = {0};
  listen_to_all(f);
  memset(f->below, 0, f->skeleton->node_count * sizeof *f->below);
  find_tops(f);
  uint32_t hips = choose_hips(f);
  for (uint32_t i = 0; i < f->skeleton->node_count; i++) {
    uint32_t node = f->skeleton->order[i], top = f->tops[node];
    if (!f->is_bone[node] || (top != TW_NO_INDEX && top != hips)) continue;
    if (f->said[node].kind != KIND_NONE) note(&guesses, &f->said[node], node);
  }
  settle(&guesses, bones);
  *spine = guesses.spine;
  bool has_legs = bones[TW_BONE_UPPER_LEG] != TW_NO_INDEX && bones[TW_BONE_UPPER_LEG + 1] != TW_NO_INDEX;
  bool has_arms = bones[TW_BONE_UPPER_ARM] != TW_NO_INDEX && bones[TW_BONE_UPPER_ARM + 1] != TW_NO_INDEX;
  return bones[TW_BONE_HIPS] != TW_NO_INDEX && (has_legs || has_arms);
}

bool tw_bones_guess(const tw_skeleton *skeleton, const bool *is_bone, tw_arena *arena,
                    uint32_t bones[TW_BONES], tw_spine *spine) {
  uint32_t count = skeleton->node_count, others[TW_BONES];
  tw_spine other_spine;
  figures f = {.skeleton = skeleton,
               .is_bone = is_bone,
               .said = tw_arena_alloc_raw(arena, count, sizeof *f.said),
               .tops = tw_arena_alloc_raw(arena, count, sizeof *f.tops),
               .below = tw_arena_alloc_raw(arena, count, sizeof *f.below)};
  if (!f.said || !f.tops || !f.below) return false;
  f.dialect.has_tails = has_tails(&f);
  for (uint32_t i = 0; i < count; i++)
    f.dialect.only_deforming |= bone_name(&f, i) && tw_bone_is_deforming(bone_name(&f, i));
  if (f.dialect.only_deforming && guess(&f, bones, spine)) return true;
  f.dialect.only_deforming = false;
  if (guess(&f, bones, spine) || !find_front(&f) || !guess(&f, others, &other_spine)) return true;
  memcpy(bones, others, sizeof others);
  *spine = other_spine;
  return true;
}
