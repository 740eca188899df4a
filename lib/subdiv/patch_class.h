/* Classes of irregular quads, shared by all whose neighbourhoods are the same. */
#ifndef TWEEND_SHAPE_H
#define TWEEND_SHAPE_H

#include "crease.h"
#include "limit.h"
#include "neighbourhood.h"
#include "tweend/subdiv.h"

typedef struct tw_patch_class tw_patch_class;

/* A quarter of an irregular patch, in its parent's orientation. */
typedef struct tw_patch_part {
  tw_patch_class *shape;  /* NULL: regular */
  const uint32_t *points; /* 16, or the points of the shape: refined points of the parent */
  uint8_t reflected;
} tw_patch_part;

enum { TW_STENCIL_DEPTH_MAX = 4 }; /* the grid of a deeper patch is split faster than it is summed up */

struct tw_patch_class {
  uint32_t point_count; /* 0 to 3 are the quad's corners */
  /* One refinement step: sparse rows over the points. NULL until a patch needs the depth. */
  uint32_t refined_count;
  const uint32_t *row_offsets; /* [refined_count + 1] */
  const uint32_t *columns;
  const float *weights;
  tw_patch_part parts[4]; /* at corner 0, 1, 2, 3 */
  /* Limit masks of the four corners. */
  uint32_t mask_counts[4];
  const tw_limit_entry *masks[4];
  bool framed[4];
  float frames[4][2][2]; /* of tw_limit_frame, where framed */

  uint32_t uses; /* while stencils are made: patches of this class */
  const struct tw_stencil *stencils[2][TW_STENCIL_DEPTH_MAX + 1]; /* of points or of limits, by depth */

  tw_neighbourhood local;
  uint32_t depth;              /* steps that can be taken from here */
  struct tw_patch_class *next; /* in its hash bucket */
};

/* Where the stencils of the classes live. */
tw_arena *tw_patch_shapes_stencils(tw_patch_shapes *shapes);

uint32_t tw_patch_shapes_scratch(const tw_patch_shapes *shapes); /* refined points, summed over the depths */

/* The class of the quad that begins at `corner`, made if it is new and good for `depth` steps.
 * *points: its points in the topology, valid until the collector's next call. TW_LIMIT: see
 * tw_patches_create. */
tw_status tw_patch_classify(tw_patch_shapes *shapes, tw_collector *collector, uint32_t corner, uint32_t depth,
                            tw_patch_class **out, const uint32_t **points);

#endif
