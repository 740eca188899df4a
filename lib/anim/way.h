/* Where a node of a clip is at any time: the transforms on the way to it from the top, in double precision.
 */
#ifndef TWEEND_WAY_H
#define TWEEND_WAY_H

#include "clip.h"

/* Columns of the linear part, then the translation. */
typedef struct tw_affine {
  double axes[3][3], at[3];
} tw_affine;

extern const tw_affine TW_AFFINE_IDENTITY;

tw_affine tw_affine_of(const tw_trs *trs);
tw_affine tw_affine_product(const tw_affine *a, const tw_affine *b);
/* m p for a point; out may be p. */
void tw_affine_move(const tw_affine *m, const double p[3], double out[3]);
/* Solves m x = v for the linear part. Without an inverse x is 0. */
void tw_affine_solve(const tw_affine *m, const double v[3], double x[3]);
/* A turn of the world as one in the frame m: m^-1 q m, where m scales evenly. Mirrored frames turn it round.
 */
void tw_affine_turn_inside(const tw_affine *m, const double q[4], double out[4]);

/* A node that may move. */
typedef struct tw_way_node {
  uint32_t tracks[3]; /* by path, of the clip; TW_NO_INDEX: as at rest */
  tw_trs rest;
  tw_affine before; /* of nodes above it that stand still */
} tw_way_node;

typedef struct tw_way {
  uint32_t count;
  tw_way_node *nodes; /* [count] those above that move */
  tw_affine still;    /* of those that stand still, between the last one that moves and the node */
  tw_way_node own;    /* the node itself */
} tw_way;

/* The tracks of a node's translation, rotation and scale; TW_NO_INDEX where there is none. */
typedef struct tw_node_tracks {
  uint32_t tracks[3];
} tw_node_tracks;

/* Those of each of the clip's nodes. NULL without memory. O(nodes + tracks). */
tw_node_tracks *tw_way_list_tracks(const tw_clip *clip, tw_arena *arena);

/* The node without what is above it. */
tw_way_node tw_way_node_of(const tw_node_tracks *all, const tw_node *nodes, uint32_t node);

/* The way to a node; it lives in the arena. False without memory. O(depth). */
bool tw_way_find(const tw_node_tracks *all, const tw_node *nodes, uint32_t node, tw_arena *arena,
                 tw_way *out);

/* A node's own transform, and the transform in the world of the node's parent. clip: the one whose tracks the
 * way has. */
tw_trs tw_way_local_at(const tw_clip *clip, const tw_way_node *node, float time);
tw_affine tw_way_parent_at(const tw_clip *clip, const tw_way *way, float time);

/* tw_clip_bends of all tracks on the way, and of a node's own. */
bool tw_way_bends(const tw_clip *clip, const tw_way *way, const tw_bend_sink *sink);
bool tw_way_node_bends(const tw_clip *clip, const tw_way_node *node, const tw_bend_sink *sink);

#endif
