/* Quads of a Catmull-Clark mesh as patches: any point of any level, computed directly from control points.
 *
 * A patch refined `depth` times is a grid of (2^depth + 1)^2 points. Column index i grows along the quad's
 * first side, row index j along its last side backwards, so that (0, 0) is the quad's first corner. Where the
 * quad and its surroundings are regular the grid is a separable uniform cubic B-spline over 16 control
 * points. A border or an infinitely sharp crease along a side is regular too: the row of control points
 * beyond the side is the reflection of the row within. Every other quad is irregular and belongs to a class,
 * which all patches with the same neighbourhood share. One refinement step of a class is a sparse matrix that
 * splits the patch into quarters, each of which is regular or of a class again. */
#ifndef TWEEND_PATCH_H
#define TWEEND_PATCH_H

#include "bspline.h"
#include "parallel_for.h"
#include "patch_class.h"
#include "topology.h"
#include "tweend/subdiv.h"

typedef struct tw_patch {
  tw_patch_class *class;  /* NULL: regular */
  uint32_t first_control; /* index in tw_patches.controls of its 16 points, of its class's points, or of the
                           * four corners of a linear one */
  uint8_t reflected;      /* of a regular patch: bit s is set where the row beyond side s is a reflection */
  bool summed;            /* its points are summed by the stencil that its class has for the depth */
} tw_patch;

typedef struct tw_patches {
  const tw_topology *base; /* all quads, each of four different vertices; outlives the patches */
  uint32_t depth;
  bool linear;             /* patches are bilinear, whatever is around their quads */
  tw_patch *patches;       /* [base->face_count] */
  uint32_t *controls;      /* control points of all patches, as vertices of base */
  tw_spline *splines;      /* [depth + 1] */
  uint32_t scratch_points; /* points of scratch memory that an evaluation needs */
  size_t size;             /* bytes held */
} tw_patches;

/* Makes patches of all quads of `base`. classes: receives the irregular classes, and outlives the patches.
 * TW_LIMIT: there are more irregular classes, or a larger one, than is worth the memory; then refine by
 * generic steps. parallel: asked whether the patches are still wanted; or NULL. TW_CANCELLED,
 * TW_NO_MEMORY. */
tw_status tw_patches_create(tw_patches *patches, const tw_topology *base, const tw_rules *rules,
                            uint32_t depth, tw_patch_classes *classes, const tw_parallel_for *parallel);
void tw_patches_deinit(tw_patches *patches); /* a zeroed one may be deinited */

/* What tw_patch_evaluate computes, and where it goes.
 * in: [base vertices][width], width 1 to 4.
 * values (NULL: not wanted): point (i, j) goes to values + ((j - j0) * (i1 - i0 + 1) + (i - i0)) * stride.
 * normals (NULL: not wanted), placed likewise, for width 3 only: unit length; where the surface has no
 * tangent plane, the normal of the control quad, and +Y where that has none either.
 * derivatives (NULL: not wanted), placed likewise, 8 floats wide: along i from 0, along j from 4. They serve
 * to compare fields of the same quads; their scale differs from point to point and from field to field. At an
 * irregular corner they are along the quad's sides there, which all fields share; with `unframed` they are
 * any two tangents there, which suffices for normals.
 * limit: values are points on the limit surface. backwards: all outputs run from the last point to the first.
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

/* rect: a corner, the inside of a side, or whole lines of the inside; any rectangle where no patch is summed
 * by a stencil. */
void tw_patch_evaluate(const tw_patches *patches, uint32_t quad, const tw_patch_job *job, tw_patch_rect rect);

/* The rectangles of corner k, and of the inside of the side that begins there, in a grid of side^2 cells.
 * *backwards: the rectangle's order of points is opposite to the direction from corner k to the next. */
tw_patch_rect tw_patch_corner(uint32_t side, uint32_t k);
tw_patch_rect tw_patch_side(uint32_t side, uint32_t k, bool *backwards);

/* The vertices of the base that an evaluation of the patch reads. */
const uint32_t *tw_patch_controls(const tw_patches *patches, uint32_t quad, uint32_t *count);

#endif
