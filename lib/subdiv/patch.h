/* Quads of a Catmull-Clark mesh as patches: any point of any level, straight from the control points.
 *
 * A patch refined `depth` times is a grid of (2^depth + 1)^2 points; column i runs along the quad's
 * first side, row j along its last, backwards, so that (0, 0) is its first corner. Where the quad
 * and its surroundings are regular the grid is a separable uniform cubic B-spline over 16 control
 * points. A border or an infinitely sharp crease along a side is regular too: the row beyond it
 * is the reflection of the row within. Everything else is split into four: in a class, which all
 * patches of the same local shape share, one step is a sparse matrix, and the quarters are
 * regular or of a class again. */
#ifndef TWEEND_PATCH_H
#define TWEEND_PATCH_H

#include "bspline.h"
#include "parallel_for.h"
#include "patch_class.h"
#include "topology.h"
#include "tweend/subdiv.h"

typedef struct tw_patch {
  tw_patch_class *shape;  /* NULL: regular */
  uint32_t first_control; /* 16 control points, or the points of the shape */
  uint8_t reflected;      /* regular: bit s set when the row beyond side s is a reflection */
  bool summed;            /* by the stencil that its class has for the depth */
} tw_patch;

typedef struct tw_patches {
  const tw_topology *base; /* all quads, each of four vertices; outlives the patches */
  uint32_t depth;
  tw_patch *patches;       /* [base->face_count] */
  uint32_t *controls;      /* vertices of base */
  tw_spline *splines;      /* [depth + 1] */
  uint32_t scratch_points; /* points of scratch an evaluation needs */
  size_t size;             /* bytes held */
} tw_patches;

/* Makes patches of all quads of `base`. shapes: takes up their irregular shapes, and outlives them.
 * TW_LIMIT: there are more distinct irregular shapes, or a larger one, than is worth the memory; refine
 * further in the generic way instead. parallel: asked whether they are still wanted; or NULL. TW_CANCELLED,
 * TW_NO_MEMORY. */
tw_status tw_patches_create(tw_patches *patches, const tw_topology *base, const tw_rules *rules,
                            uint32_t depth, tw_patch_shapes *shapes, const tw_parallel_for *parallel);
void tw_patches_deinit(tw_patches *patches); /* a zeroed one may be deinited */

/* Evaluates part of one patch.
 * in: [base vertices][width], width 1 to 4. values (NULL: not wanted): point (i, j) goes to
 * values + ((j - j0) * (i1 - i0 + 1) + (i - i0)) * stride. normals likewise, of width 3 only: unit
 * length; where the surface has no tangent plane, the normal of the control quad, and +Y where that
 * has none either. limit: points on the limit surface.
 * derivatives likewise, 8 floats wide: along i from 0, along j from 4. They are good for comparing fields
 * of the same quads, each to a scale of its own: at an irregular corner they stand for the directions of
 * the quad's sides there, which all fields share. unframed: any two tangents there, which suit normals.
 * backwards: all of these run from the last point to the first.
 * scratch: [scratch_points][4]. */
typedef struct tw_patch_job {
  const float *in;
  uint32_t width;
  bool limit, backwards;
  float *values, *normals;
  uint32_t stride;
  double *scratch;
  float *derivatives;
  bool unframed;
} tw_patch_job;

/* rect: a corner, the inside of a side, or lines of the inside; any, where nothing is summed. */
void tw_patch_evaluate(const tw_patches *patches, uint32_t quad, const tw_patch_job *job, tw_patch_rect rect);

/* Where a grid of side^2 cells has its corner k, and the inside of the side that begins there; backwards: the
 * rectangle runs against the direction that leads from corner to corner. */
tw_patch_rect tw_patch_corner(uint32_t side, uint32_t k);
tw_patch_rect tw_patch_side(uint32_t side, uint32_t k, bool *backwards);

/* The vertices of the base that shape a patch: all that an evaluation reads. */
const uint32_t *tw_patch_controls(const tw_patches *patches, uint32_t quad, uint32_t *count);

#endif
