/* Classes of irregular quads. All quads with the same neighbourhood share one. */
#ifndef TWEEND_SHAPE_H
#define TWEEND_SHAPE_H

#include "crease.h"
#include "limit.h"
#include "neighbourhood.h"
#include "tweend/subdiv.h"

typedef struct tw_patch_class tw_patch_class;

/* A quarter of an irregular patch, in its parent's orientation. It is a patch itself, over refined points of
 * the parent. */
typedef struct tw_patch_part {
  tw_patch_class *class;  /* NULL: regular */
  const uint32_t *points; /* [16, or the points of the class] rows of the parent's refinement step */
  uint8_t reflected;
} tw_patch_part;

enum { TW_STENCIL_DEPTH_MAX = 4 }; /* deeper grids are computed faster by splitting than by stencils */

struct tw_patch_class {
  uint32_t point_count; /* points 0 to 3 are the quad's corners */
  /* One refinement step as a sparse matrix: rows over the points. NULL until a patch needs the depth. */
  uint32_t refined_count;
  const uint32_t *row_offsets; /* [refined_count + 1] */
  const uint32_t *columns;
  const float *weights;
  tw_patch_part parts[4]; /* the quarters at corners 0, 1, 2, 3 */
  /* Limit masks of the four corners. */
  uint32_t mask_counts[4];
  const tw_limit_entry *masks[4];
  bool framed[4];
  float frames[4][2][2]; /* from tw_limit_frame, where it returned true (framed) */

  uint32_t uses; /* while stencils are made: number of patches of this class */
  const struct tw_stencil *stencils[2][TW_STENCIL_DEPTH_MAX + 1]; /* [0] of points, [1] of limits; by depth */

  tw_neighbourhood local;
  uint32_t depth;              /* refinement steps that are ready from here on */
  struct tw_patch_class *next; /* in its hash bucket */
};

/* The arena that the stencils of the classes live in. */
tw_arena *tw_patch_classes_stencils(tw_patch_classes *classes);

/* Points of scratch memory that the evaluation of any of the classes needs. */
uint32_t tw_patch_classes_scratch(const tw_patch_classes *classes);

/* Finds the class of the quad that begins at `corner`, makes it if it is new, and makes it ready for `depth`
 * steps. *points: the class's points as vertices of the topology, valid until the collector's next call.
 * TW_LIMIT as in tw_patches_create. */
tw_status tw_patch_classify(tw_patch_classes *classes, tw_collector *collector, uint32_t corner,
                            uint32_t depth, tw_patch_class **out, const uint32_t **points);

#endif
