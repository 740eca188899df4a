/* A biped of any proportions, names, rest rotations and extra bones, and a clip on it, for tests of
 * retargeting. The figure stands in a T-pose, faces +z, and is 1.75 high. */
#ifndef TEST_BIPED_H
#define TEST_BIPED_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tweend/retarget.h"

enum { BIPED_MOST = 64, BIPED_KEYS = 9 };

typedef struct biped_options {
  const char *const *names; /* [BIPED_JOINTS] of the joints below; NULL: their own */
  double scale;             /* 0: 1 */
  uint32_t seed;            /* of rest rotations; 0: none */
  double arms_down;         /* radians below the T-pose */
  bool has_twists;          /* bones half way down arms and legs */
  uint32_t spines;          /* bones between hips and neck, 0: 3 */
  uint32_t lacks;           /* joints that are left out, bit i: joint i */
  double turned;            /* about y, radians */
} biped_options;

typedef struct biped_joint {
  const char *name;
  int parent;
  double place[3];
} biped_joint;

enum { BIPED_SPINE = 1, BIPED_NECK = 4, BIPED_JOINTS = 24 };

static const biped_joint biped_joints[BIPED_JOINTS] = {
    {"hips", -1, {0, 0.95, 0}},
    {"spine", 0, {0, 1.05, -0.01}},
    {"chest", 1, {0, 1.17, -0.02}},
    {"upperChest", 2, {0, 1.29, -0.02}},
    {"neck", 3, {0, 1.46, -0.03}},
    {"head", 4, {0, 1.55, 0}},
    {"leftUpperLeg", 0, {0.09, 0.9, 0}},
    {"leftLowerLeg", 6, {0.1, 0.5, 0.01}},
    {"leftFoot", 7, {0.1, 0.09, -0.02}},
    {"leftToes", 8, {0.11, 0.01, 0.11}},
    {"rightUpperLeg", 0, {-0.09, 0.9, 0}},
    {"rightLowerLeg", 10, {-0.1, 0.5, 0.01}},
    {"rightFoot", 11, {-0.1, 0.09, -0.02}},
    {"rightToes", 12, {-0.11, 0.01, 0.11}},
    {"leftShoulder", 3, {0.03, 1.42, -0.02}},
    {"leftUpperArm", 14, {0.16, 1.43, -0.03}},
    {"leftLowerArm", 15, {0.43, 1.43, -0.03}},
    {"leftHand", 16, {0.68, 1.43, -0.02}},
    {"leftIndexProximal", 17, {0.77, 1.43, 0}},
    {"rightShoulder", 3, {-0.03, 1.42, -0.02}},
    {"rightUpperArm", 19, {-0.16, 1.43, -0.03}},
    {"rightLowerArm", 20, {-0.43, 1.43, -0.03}},
    {"rightHand", 21, {-0.68, 1.43, -0.02}},
    {"rightIndexProximal", 22, {-0.77, 1.43, 0}},
};

typedef struct biped {
  uint32_t count;
  tw_node nodes[BIPED_MOST];
  uint32_t order[BIPED_MOST];
  char names[BIPED_MOST][40];
  uint32_t at[BIPED_JOINTS]; /* the node of each joint; TW_NO_INDEX */
  double scale;
  /* a clip */
  tw_track_keys tracks[2 * BIPED_MOST];
  float times[BIPED_KEYS], turns[BIPED_MOST][BIPED_KEYS][4], places[BIPED_KEYS][3];
  tw_clip_keys clip;
} biped;

static inline double biped_random(uint32_t *state) {
  *state = *state * 1664525u + 1013904223u;
  return (double)(*state >> 8) / (1 << 24);
}

static inline void biped_rotation(uint32_t *state, double most, double out[4]) {
  double length = 0;
  do {
    for (int i = 0; i < 3; i++) out[i] = 2 * biped_random(state) - 1;
    length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
  } while (length < 0.1);
  double angle = most * biped_random(state);
  for (int i = 0; i < 3; i++) out[i] *= sin(angle / 2) / length;
  out[3] = cos(angle / 2);
}

static inline void biped_inverse(const double q[4], double out[4]) {
  for (int i = 0; i < 3; i++) out[i] = -q[i];
  out[3] = q[3];
}

/* Hangs a node on another; world rotations and places decide its rest pose. */
static inline uint32_t biped_add(biped *b, const char *name, uint32_t parent, const double place[3],
                                 const double rotation[4], double (*world)[7]) {
  uint32_t node = b->count++;
  double back[4], local[4], way[3];
  snprintf(b->names[node], sizeof b->names[node], "%s", name);
  memcpy(world[node], rotation, 4 * sizeof(double));
  memcpy(world[node] + 4, place, 3 * sizeof(double));
  b->nodes[node] = (tw_node){.name = b->names[node],
                             .parent = parent,
                             .mesh = TW_NO_INDEX,
                             .skin = TW_NO_INDEX,
                             .rest = TW_TRS_IDENTITY};
  memcpy(local, rotation, sizeof local);
  memcpy(way, place, sizeof way);
  if (parent != TW_NO_INDEX) {
    biped_inverse(world[parent], back);
    tw_rotation_multiply(back, rotation, local);
    for (int i = 0; i < 3; i++) way[i] -= world[parent][4 + i];
    tw_rotation_turn(back, way, way);
  }
  for (int i = 0; i < 4; i++) b->nodes[node].rest.rotation[i] = (float)local[i];
  for (int i = 0; i < 3; i++) b->nodes[node].rest.translation[i] = (float)way[i];
  return node;
}

/* Where a joint rests. */
static inline void biped_place(const biped_options *options, uint32_t joint, double out[3]) {
  const biped_joint *from = &biped_joints[joint];
  memcpy(out, from->place, 3 * sizeof *out);
  bool is_left = joint >= 15 && joint <= 18, is_right = joint >= 20;
  if (is_left || is_right) {
    const double *shoulder = biped_joints[is_left ? 15 : 20].place;
    double angle = is_left ? -options->arms_down : options->arms_down;
    double x = out[0] - shoulder[0], y = out[1] - shoulder[1];
    out[0] = shoulder[0] + x * cos(angle) - y * sin(angle);
    out[1] = shoulder[1] + x * sin(angle) + y * cos(angle);
  }
  double x = out[0], z = out[2];
  out[0] = x * cos(options->turned) + z * sin(options->turned);
  out[2] = -x * sin(options->turned) + z * cos(options->turned);
  for (int i = 0; i < 3; i++) out[i] *= options->scale;
}

static inline bool biped_is_limb(uint32_t joint) {
  return joint == 6 || joint == 7 || joint == 10 || joint == 11 || joint == 15 || joint == 16 ||
         joint == 20 || joint == 21;
}

static inline void biped_make(biped *b, biped_options options) {
  static double world[BIPED_MOST][7];
  uint32_t state = options.seed, last[BIPED_JOINTS];
  if (options.scale == 0) options.scale = 1;
  if (options.spines == 0) options.spines = 3;
  *b = (biped){.scale = options.scale};
  for (uint32_t i = 0; i < BIPED_JOINTS; i++) {
    const biped_joint *joint = &biped_joints[i];
    double rotation[4] = {0, sin(options.turned / 2), 0, cos(options.turned / 2)}, place[3], own[4];
    b->at[i] = last[i] = TW_NO_INDEX;
    int parent = joint->parent;
    if (i >= BIPED_SPINE + options.spines && i < BIPED_NECK) continue;
    if (options.lacks >> i & 1) continue;
    while (parent > 0 && b->at[parent] == TW_NO_INDEX) parent--;
    if (options.seed) {
      biped_rotation(&state, 3, own);
      tw_rotation_multiply(rotation, own, rotation);
    }
    biped_place(&options, i, place);
    const char *name = options.names ? options.names[i] : joint->name;
    b->at[i] = last[i] = biped_add(b, name, parent < 0 ? TW_NO_INDEX : last[parent], place, rotation, world);
    if (!options.has_twists || !biped_is_limb(i)) continue;
    double next[3], middle[3], twist_own[4] = {0, 0, 0, 1};
    char twist[40];
    biped_place(&options, i + 1, next);
    for (int k = 0; k < 3; k++) middle[k] = (place[k] + next[k]) / 2;
    if (options.seed) biped_rotation(&state, 3, twist_own);
    tw_rotation_multiply(rotation, twist_own, rotation);
    snprintf(twist, sizeof twist, "%s Twist", name);
    last[i] = biped_add(b, twist, b->at[i], middle, rotation, world);
  }
  tw_error error;
  if (tw_nodes_order(b->nodes, b->count, b->order, &error) != TW_OK) b->count = 0;
}

static inline void biped_turn_track(biped *b, uint32_t *used, uint32_t node, double most, uint32_t *state) {
  double rest[4], turn[4], key[4];
  for (int i = 0; i < 4; i++) rest[i] = (double)b->nodes[node].rest.rotation[i];
  const char *end = strrchr(b->nodes[node].name, ' ');
  const float *way = b->nodes[node + 1].rest.translation; /* of a twist bone's child */
  for (int k = 0; k < BIPED_KEYS; k++) {
    biped_rotation(state, most, turn);
    if (end && strcmp(end, " Twist") == 0) {
      double length = sqrt((double)(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]));
      for (int i = 0; i < 3; i++) turn[i] = sin(most * k / 20) * (double)way[i] / length;
      turn[3] = cos(most * k / 20);
    }
    tw_rotation_multiply(rest, turn, key);
    for (int i = 0; i < 4; i++) b->turns[node][k][i] = (float)key[i];
  }
  b->tracks[(*used)++] = (tw_track_keys){.node = node,
                                         .path = TW_ROTATION,
                                         .interpolation = TW_LINEAR,
                                         .form = TW_KEY_QUATERNION,
                                         .width = 4,
                                         .key_count = BIPED_KEYS,
                                         .times = b->times,
                                         .values = b->turns[node][0]};
}

/* Every bone turns by up to `most` from its rest pose, those of the spine by a sixth of that; the hips walk.
 */
static inline void biped_animate(biped *b, double most, uint32_t seed) {
  uint32_t used = 0, state = seed;
  for (int k = 0; k < BIPED_KEYS; k++) {
    b->times[k] = 0.25f * (float)k;
    const tw_trs *rest = &b->nodes[0].rest;
    for (int i = 0; i < 3; i++)
      b->places[k][i] = rest->translation[i] +
                        (float)(b->scale * (0.2 * biped_random(&state) - 0.1 + (i == 2 ? 0.3 * k : 0)));
  }
  for (uint32_t node = 0; node < b->count; node++) {
    bool is_spine = false;
    for (uint32_t i = 0; i < 6; i++) is_spine |= b->at[i] == node;
    biped_turn_track(b, &used, node, is_spine ? most / 6 : most, &state);
  }
  b->tracks[used++] = (tw_track_keys){.node = 0,
                                      .path = TW_TRANSLATION,
                                      .interpolation = TW_LINEAR,
                                      .width = 3,
                                      .key_count = BIPED_KEYS,
                                      .times = b->times,
                                      .values = b->places[0]};
  b->clip = (tw_clip_keys){.track_count = used, .tracks = b->tracks};
}

#endif
