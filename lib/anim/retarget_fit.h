/* How a skeleton is laid over another: rest poses, alignments, chains of bones between matched ones. */
#ifndef TWEEND_RETARGET_FIT_H
#define TWEEND_RETARGET_FIT_H

#include "retarget_match.h"

/* The rest pose of one skeleton in the world. */
typedef struct tw_rest {
  double (*rotation)[4]; /* [nodes] products of the nodes' rotations, scales left out */
  double (*place)[3];    /* [nodes] */
  double *unit;          /* [nodes] how long a length of 1 in the node's frame is, in the mean of its axes */
} tw_rest;

/* How a bone in between moves. */
typedef enum tw_share { TW_SHARE_ALL, TW_SHARE_TWIST } tw_share;

/* A matched bone of the target. */
typedef struct tw_fitted_bone {
  uint32_t source, target;
  uint32_t above; /* the next matched bone above it, as an index into the fit's bones; or TW_NO_INDEX */
  uint32_t last;  /* node of the source whose rotation in the world it takes: `source`, or the last of the
                     bones below that it takes in */
  uint32_t first_between, between_count; /* nodes of the target that share its motion: fit.between */
  tw_share share;
  double direction[3]; /* of TW_SHARE_TWIST: unit, in the target's frame of the bone */
  bool is_carrier; /* hips, and matched nodes above them; without hips those without a matched one above */
  double alignment[4]; /* A: in the target's world */
  double offset[4];    /* C: target world = turned^-1 * source world * C */
} tw_fitted_bone;

typedef struct tw_fit {
  tw_rest source, target;
  uint32_t bone_count;
  tw_fitted_bone *bones; /* [bone_count] in the order of the target's hierarchy: parents first */
  uint32_t *bone_of;     /* [nodes of the target] or TW_NO_INDEX */
  uint32_t *between;
  bool *is_taken_in;     /* [nodes of the source] a bone of the target does what it and others do together */
  double turned[4];      /* B: from the target's world to the source's, where figures face otherwise */
  double up[3];          /* in the source's world: an axis of it, y where the figure's is none */
  double scale;          /* of distances */
  double size;           /* of the target: from its first bone to the farthest one */
  double hips_offset[3]; /* place of the target's hips = turned^-1 * scale * source place + this */
  uint32_t hips;         /* a bone; or TW_NO_INDEX */
} tw_fit;

/* TW_NO_MEMORY. Everything lives in the arena. O(nodes). */
tw_status tw_retarget_fit(const tw_retarget_job *job, const tw_bone_match *match, tw_arena *arena,
                          tw_fit *out, tw_error *error);

/* The axes of a figure as columns: to its left, up, and forwards. False where it has none. */
bool tw_find_axes(const double *left, const double *right, const double *low, const double *high,
                  double axes[3][3]);

#endif
