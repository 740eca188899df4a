/* What the name of one bone says: its kind, its side and its digits. */
#ifndef TWEEND_BONE_KINDS_H
#define TWEEND_BONE_KINDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum tw_bone_kind {
  KIND_NONE,
  KIND_HIPS,
  KIND_ROOT,  /* the hips where nothing else is called so */
  KIND_SPINE, /* of which there may be any number, as of KIND_NECK and fingers */
  KIND_NECK,
  KIND_HEAD,
  KIND_JAW,
  KIND_HIP, /* sided: the upper leg; else the hips */
  KIND_EYE,
  KIND_UPPER_LEG,
  KIND_LEG, /* the lower one where there is an upper one, else the upper one */
  KIND_LOWER_LEG,
  KIND_ANKLE,
  KIND_FOOT, /* the toes where there is an ankle */
  KIND_TOES,
  KIND_COLLAR,
  KIND_SHOULDER, /* the upper arm where there is a collar or an elbow, but no arm */
  KIND_UPPER_ARM,
  KIND_ELBOW,
  KIND_LOWER_ARM,
  KIND_WRIST,
  KIND_HAND, /* nothing where there is a wrist */
  KIND_THUMB,
  KIND_INDEX,
  KIND_MIDDLE,
  KIND_RING,
  KIND_LITTLE,
  KIND_FINGER, /* the digits say which one */
  KINDS
} tw_bone_kind;

/* How a file names its bones. */
typedef struct tw_bone_dialect {
  bool has_tails;      /* a number of its own behind each name, as Sketchfab writes them: "Hips_012" */
  bool only_deforming; /* bones without "DEF-" in front steer the others */
  const char *front;   /* [front_size] what most bones have in front of their own names */
  size_t front_size;
} tw_bone_dialect;

/* What a name says. */
typedef struct tw_bone_said {
  tw_bone_kind kind;
  int side;       /* 0 left, 1 right, -1 none */
  char digits[4]; /* of the first number */
  uint32_t number_count;
  bool is_part, is_palm; /* of a finger: "Proximal", "Metacarpal" */
  tw_bone_kind vertebra; /* what it is where "L5" is a vertebra, not something on the left */
} tw_bone_said;

/* name: NULL says nothing. */
tw_bone_said tw_bone_listen(const char *name, const tw_bone_dialect *dialect);

/* Rigify's spine goes from the hips to the head. */
tw_bone_kind tw_bone_rigify_kind(const tw_bone_said *said);

/* Whether "DEF-" stands in front. */
bool tw_bone_is_deforming(const char *name);

/* The part of a name behind its namespace and prefixes. */
const char *tw_bone_behind_prefixes(const char *name);

/* The length of a name without "_012" at its end. */
size_t tw_bone_length_without_tail(const char *name);

#endif
