/* Root motion: what of a node's motion moves the whole figure, taken out of a clip. */
#ifndef TWEEND_ROOT_MOTION_H
#define TWEEND_ROOT_MOTION_H

#include "tweend/anim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Bits of the parts of a node's motion in the world that are taken. */
enum { TW_ROOT_X = 1, TW_ROOT_Y = 2, TW_ROOT_Z = 4, TW_ROOT_YAW = 8 };

/* The motion R(t) of a node whose world transform is W(t), w(t) its place, D(t) the rotation from W(0) to
 * W(t): a turn about y by the part of D(t) that turns about y (its twist), where TW_ROOT_YAW is taken; then a
 * shift, along each axis that is taken, by w(t) - turn w(0). So R(0) is the identity. Without it the node's
 * world transform is R(t)^-1 W(t), which its translation and rotation are set to; all nodes below go with it,
 * the others stay. */
typedef struct tw_root_job {
  const tw_node *nodes; /* [node_count] */
  uint32_t node_count, node;
  unsigned axes; /* bits */
  /* Gets R(t) in front of its own transform, as tracks of translation and rotation, so that all is as before:
   * the topmost node above `node`, where that is not `node` itself; node_count: a node that the caller puts
   * above `node`; TW_NO_INDEX: none. */
  uint32_t carrier;
} tw_root_job;

/* The node that `job` takes by default: the topmost one that the clip translates, else turns; of several the
 * one with most nodes below. Tracks whose value never changes count where there are no others. TW_NO_INDEX
 * where the clip has none, or without memory. order: from tw_nodes_order. O(nodes + tracks), and looks at
 * some two million values at most. */
uint32_t tw_clip_find_root(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                           uint32_t node_count);

/* Wraps a clip, which *out owns after TW_OK. Of the wrapped clip's keys there are none (tw_clip_reduce with
 * NULL finds some). TW_UNSUPPORTED: a turn below parents with unequal scales, at any time, which a node's
 * transform cannot hold. TW_NO_MEMORY. */
tw_status tw_clip_take_root(tw_clip *clip, const tw_root_job *job, tw_clip **out, tw_error *error);

/* R(t) of a clip made by tw_clip_take_root. Any thread. */
void tw_clip_root_at(const tw_clip *clip, float time, tw_trs *out);

#ifdef __cplusplus
}
#endif
#endif
