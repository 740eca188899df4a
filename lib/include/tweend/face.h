/* Faces of VRM characters, expressions and gaze, and clips that move them. */
#ifndef TWEEND_FACE_H
#define TWEEND_FACE_H

#include "tweend/retarget.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Kinds of expressions that others may hold back (VRMC_vrm 1.0, "Procedural override"). */
typedef enum tw_face_part { TW_FACE_BLINK, TW_FACE_GAZE, TW_FACE_MOUTH, TW_FACE_PARTS } tw_face_part;

typedef enum tw_override { TW_OVERRIDE_NONE, TW_OVERRIDE_BLOCK, TW_OVERRIDE_BLEND } tw_override;
extern const char *const tw_override_names[]; /* as in VRMC_vrm; the last is NULL */

typedef struct tw_morph_bind {
  uint32_t node, target; /* a morph target of the node's mesh */
  float weight;          /* of the target where the expression is whole */
} tw_morph_bind;

typedef struct tw_expression {
  const char *name; /* of a preset: that of VRM 1.0 */
  bool is_binary;   /* its weight is 1 above 0.5, else 0 */
  bool moves_materials;
  tw_override overrides[TW_FACE_PARTS];
  uint32_t bind_count;
  const tw_morph_bind *binds; /* [bind_count] */
} tw_expression;

/* A key of a curve: cubic Hermite between two, constant outside. */
typedef struct tw_curve_key {
  float at, value, in_slope, out_slope;
} tw_curve_key;

/* How far eyes turn, or expressions go, by how far the gaze turns: `scale` at `most` degrees and beyond, and
 * before in proportion, or as a curve from 0 to 1 has it. */
typedef struct tw_gaze_range {
  float most, scale; /* most: above 0 */
  uint32_t key_count;
  const tw_curve_key *keys; /* [key_count] `at` ascending; NULL: in proportion */
} tw_gaze_range;

typedef enum tw_gaze { TW_GAZE_NONE, TW_GAZE_BONES, TW_GAZE_EXPRESSIONS } tw_gaze;

/* What a VRM says of its face (VRMC_vrm 1.0, "expressions" and "lookAt"; VRM 0.x, "blendShapeMaster" and
 * "firstPerson"). */
typedef struct tw_face {
  uint32_t expression_count;
  const tw_expression *expressions; /* [expression_count] all of different names */
  tw_gaze gaze;
  tw_gaze_range inner, outer, down, up; /* towards the nose, away from it, down, up */
  bool faces_back;                      /* its front is -z, as in VRM 0.x */
} tw_face;

typedef struct tw_expression_node {
  const char *name;
  uint32_t node; /* its translation along x is the weight of the expression */
} tw_expression_node;

/* The nodes of a VRMA that stand for a face (VRMC_vrm_animation 1.0, "expressions" and "lookAt"). */
typedef struct tw_face_nodes {
  uint32_t expression_count;
  const tw_expression_node *expressions; /* [expression_count] */
  uint32_t gaze; /* the node whose rotation is that of the gaze from straight ahead; or TW_NO_INDEX */
} tw_face_nodes;

/* The part of the name's expressions; TW_FACE_PARTS for others. */
tw_face_part tw_face_part_of(const char *name);

/* Whether VRM 1.0 has a preset expression of this name. */
bool tw_is_preset_expression(const char *name);

/* ---- carrying over ------------------------------------------------------------------------------
 * What a clip moves of a face becomes morph weights of the target's nodes, and turns of its eyes. A weight is
 * the sum, over the expressions that bind it, of the expression's weight times the bind's; the expressions
 * that the clip does not move count 0, and targets that no expression binds keep their rest weight. Weights
 * of expressions are clamped to 0 to 1, then binary ones made 0 or 1, then held back by others: those of a
 * part by 1 less the sum of all that hold it back, binary ones wholly; an expression does not hold back its
 * own part. The gaze goes through the ranges into the turns of the humanoid's eyes, relative to their rest
 * pose, or into the expressions lookUp, lookDown, lookLeft and lookRight. */

typedef struct tw_face_job {
  const tw_clip_keys *keys; /* of the source; tw_clip_create takes them */
  uint32_t source_node_count;
  const tw_face_nodes *source;
  const tw_face *target;
  tw_skeleton skeleton;             /* of the target */
  const uint32_t *morph_counts;     /* [nodes of the target] */
  const float *const *rest_weights; /* [nodes of the target] or NULL: 0 */
  tw_tolerance tolerance;           /* of what is not linear between keys; exact at the source's key times */
  uint32_t max_keys;                /* of a track */
} tw_face_job;

/* Lives in the arena. */
typedef struct tw_face_carried {
  tw_clip_keys keys; /* of the target: name NULL */
  /* Indices of expressions that the clip moves: of the source's, which the target has not; of the target's,
   * which move materials too. */
  uint32_t missing_count, material_count;
  uint32_t *missing, *materials;
  bool has_gaze, moves_gaze; /* the clip moves the gaze; it moves the target's */
} tw_face_carried;

/* Whether a node of the source stands for a part of its face. O(expressions). */
bool tw_face_has_node(const tw_face_nodes *face, uint32_t node);

/* TW_LIMIT, TW_NO_MEMORY, TW_CANCELLED. O(keys * weights), and more keys where the tolerance needs them. */
tw_status tw_face_carry(const tw_face_job *job, tw_arena *arena, tw_face_carried *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
