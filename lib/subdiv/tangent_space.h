/* Tangents that fit a normal map, from the derivatives of points and UVs along the same two directions.
 *
 * The frame is MikkTSpace's (Mikkelsen 2008), as glTF 2.0 wants it: the tangent lies along growing u, in
 * the plane of the normal; the bitangent w (normal x tangent) lies along growing v, v up. */
#ifndef TWEEND_TANGENT_SPACE_H
#define TWEEND_TANGENT_SPACE_H

#include "limit.h"
#include "patch.h"

/* Rows of derivatives as tw_patch_job has them. */
enum { TW_DERIVATIVE_WIDTH = 8, TW_DERIVATIVE_SECOND = 4 };

/* What rows of tangents are made from: values [vertices][width] of one field of a surface. */
typedef struct tw_slope_source {
  const tw_topology *topology;
  const tw_patches *patches; /* where rows are of patches */
  bool linear;
  const float *values;
  uint32_t width;
} tw_slope_source;

/* Derivatives at part of a patch. scratch: [patches->scratch_points][4]; out: [rows][TW_DERIVATIVE_WIDTH]. */
void tw_patch_slopes(const tw_slope_source *source, uint32_t quad, tw_patch_rect rect, double *scratch,
                     float *out);

/* Derivatives at a corner along its two sides, which all fields share, as a mask: tangent1 towards the next
 * corner, tangent2 towards the previous one. mask: room for tw_limit_capacity entries. Returns their number;
 * weights of the vertex itself mean nothing. */
uint32_t tw_slope_mask(const tw_topology *topology, bool linear, uint32_t corner, tw_limit_entry *mask);

/* The same evaluated. out: [TW_DERIVATIVE_WIDTH]. */
void tw_corner_slopes(const tw_slope_source *source, uint32_t corner, tw_limit_entry *mask, float *out);

/* Whether a face lies in its UV set (values: [vertices of uv][2], v up) the other way round than in space. A
 * face without area there does not. */
bool tw_uv_is_mirrored(const tw_topology *uv, const float *values, uint32_t face);

/* out: a unit vector orthogonal to the normal (unit length), and w = -1 where mirrored, else 1.
 * Always finite: where v stands still the tangent lies along growing u; where UVs do not grow at all, or
 * along the normal alone, it lies along the first direction; where that has no length either, along the
 * axis that is farthest from the normal. */
void tw_tangent_from_derivatives(const float normal[3], const float points[TW_DERIVATIVE_WIDTH],
                                 const float uvs[TW_DERIVATIVE_WIDTH], bool mirrored, float out[4]);

/* A column of tangents, `stride` floats apart, from one of normals. points, uvs: [count] of the rows;
 * backwards: from the last to the first. */
typedef struct tw_tangent_columns {
  const float *normals;
  float *tangents;
  uint32_t stride;
} tw_tangent_columns;

void tw_write_tangents(const float *points, const float *uvs, size_t count, bool backwards, bool mirrored,
                       tw_tangent_columns out);

#endif
