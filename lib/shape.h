/* Neighbourhoods of quads: regular ones as 16 control points, irregular ones as shared classes. */
#ifndef TWEEND_SHAPE_H
#define TWEEND_SHAPE_H

#include "limit.h"
#include "patch.h"

/* A quad with all faces that touch it, in canonical order: faces counter-clockwise round corner 0, then
 * 1, 2, 3; each face begins at that corner; points are numbered as they are met. */
typedef struct tw_neighbourhood {
  uint32_t point_count, face_count;
  bool chaikin; /* the rule of its creases */
  size_t key_size;
  uint32_t hash;
  /* The key: what tells neighbourhoods apart. */
  uint32_t (*quads)[4];    /* [face_count] */
  float (*sharpness)[4];   /* [face_count], of the edges that touch the quad's corners, else 0 */
  float *vertex_sharpness; /* [4] */
  float *semi_sum;         /* [point_count] at the ends of those edges, else 0 (Chaikin only) */
  uint32_t *semi_count;    /* [point_count] */
} tw_neighbourhood;

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

  struct tw_common_shape *common;     /* that it is a copy of, or NULL */
  struct tw_patch_class *next_common; /* of the copies in the same shapes */

  uint32_t uses; /* while stencils are made: patches of this class */
  const struct tw_stencil *stencils[2][TW_STENCIL_DEPTH_MAX + 1]; /* of points or of limits, by depth */

  tw_neighbourhood local;
  uint32_t depth;              /* steps that can be taken from here */
  struct tw_patch_class *next; /* in its hash bucket */
};

/* Where the stencils of the classes live. */
tw_arena *tw_patch_shapes_stencils(tw_patch_shapes *shapes);

/* The first of the classes that are copies of common ones. */
tw_patch_class *tw_patch_shapes_commons(const tw_patch_shapes *shapes);

/* The class of one neighbourhood, good for every depth, in shapes of its own that copy none. *shapes: NULL
 * on failure, TW_NO_MEMORY or TW_LIMIT. */
tw_status tw_patch_shapes_of(const tw_neighbourhood *neighbourhood, tw_patch_shapes **shapes,
                             tw_patch_class **out);

uint32_t tw_patch_shapes_scratch(const tw_patch_shapes *shapes); /* refined points, summed over the depths */

enum {
  TW_SMOOTH_FACES_MAX = 32,
  TW_SMOOTH_POINTS_MAX = 8 * TW_SMOOTH_FACES_MAX /* of a quad whose corners have so many faces */
};

/* Number of faces of an inner vertex with nothing sharp at it, 3 to TW_SMOOTH_FACES_MAX; else 0. */
uint8_t tw_vertex_smooth_faces(const tw_topology *topology, uint32_t vertex);

/* The 16 control points round the quad that begins at `corner`, rows of four from (-1, -1); places
 * beyond reflected sides repeat the quad's first corner. False when the quad is not regular.
 * smooth_faces: [vertex_count] tw_vertex_smooth_faces of all, or NULL. */
bool tw_patch_regular(const tw_topology *topology, uint32_t corner, const uint8_t *smooth_faces,
                      uint32_t points[16], uint8_t *reflected);

/* The points of the class of a quad whose corners all have smooth_faces, in the order of tw_patch_classify,
 * as if no point came up twice; returns their number. points: [TW_SMOOTH_POINTS_MAX]. */
uint32_t tw_patch_smooth_points(const tw_topology *topology, uint32_t corner, const uint8_t *smooth_faces,
                                uint32_t *points);

/* What the neighbourhoods of one topology are collected with. */
typedef struct tw_collector tw_collector;

/* topology outlives it. NULL without memory. */
tw_collector *tw_collector_create(const tw_topology *topology, bool chaikin);
void tw_collector_destroy(tw_collector *collector);

/* The class of the quad that begins at `corner`, made if it is new and good for `depth` steps.
 * *points: its points in the topology, valid until the collector's next call. TW_LIMIT: see
 * tw_patches_create. */
tw_status tw_patch_classify(tw_patch_shapes *shapes, tw_collector *collector, uint32_t corner, uint32_t depth,
                            tw_patch_class **out, const uint32_t **points);

#endif
