/* Tangents for normal maps, from the derivatives of points and UVs along the same two directions.
 *
 * The frame is MikkTSpace's (Mikkelsen 2008), as glTF 2.0 wants it: the tangent points along growing u in the
 * plane of the normal; the bitangent w (normal x tangent) points along growing v, v up. */
#ifndef TWEEND_TANGENT_SPACE_H
#define TWEEND_TANGENT_SPACE_H

#include "limit.h"
#include "patch.h"

/* Width of a row of derivatives, and where the second one begins, as in tw_patch_job. */
enum { TW_DERIVATIVE_WIDTH = 8, TW_DERIVATIVE_SECOND = 4 };

/* The values whose derivatives are wanted: [vertices][width] of one field of a surface. */
typedef struct tw_slope_source {
  const tw_topology *topology;
  const tw_patches *patches; /* for tw_patch_slopes */
  bool linear;
  const float *values;
  uint32_t width;
} tw_slope_source;

/* Computes derivatives at part of a patch. backwards: from its last point to its first. scratch:
 * [patches->scratch_points][4]; out: [rows][TW_DERIVATIVE_WIDTH]. */
void tw_patch_slopes(const tw_slope_source *source, uint32_t quad, tw_patch_rect rect, bool backwards,
                     double *scratch, float *out);

/* Computes the derivatives at a corner along its two sides (tw_slope_frame). out: [TW_DERIVATIVE_WIDTH]. */
void tw_corner_slopes(const tw_slope_source *source, uint32_t corner, tw_last_mask *last, float *out);

/* Whether a face is mirrored in its UV set: wound clockwise, v up. A face without area in UV space is not.
 * values: [vertices of uv][2], v up. */
bool tw_uv_is_mirrored(const tw_topology *uv, const float *values, uint32_t face);

/* Computes a tangent. out: a unit vector orthogonal to the normal (unit length), and w: -1 where mirrored,
 * else 1. Always finite. Where v does not vary the tangent points along growing u. Where UVs do not vary at
 * all, or only along the normal, it points along the first direction; where that has no length either, along
 * the axis at the greatest angle to the normal. */
void tw_tangent_from_derivatives(const float normal[3], const float points[TW_DERIVATIVE_WIDTH],
                                 const float uvs[TW_DERIVATIVE_WIDTH], bool mirrored, float out[4]);

/* The columns of normals and tangents in rows that are `stride` floats apart. */
typedef struct tw_tangent_columns {
  const float *normals;
  float *tangents;
  uint32_t stride;
} tw_tangent_columns;

/* Writes the tangents of `count` rows from their normals. points, uvs: [count][TW_DERIVATIVE_WIDTH]
 * derivatives. frames: [count] tangent frames: odd where the map is mirrored. */
void tw_write_tangents(const float *points, const float *uvs, const uint8_t *frames, size_t count,
                       tw_tangent_columns out);

#endif
