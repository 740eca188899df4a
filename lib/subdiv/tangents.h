/* Tangents that fit a normal map, from the derivatives of points and UVs along the same two directions.
 *
 * The frame is MikkTSpace's (Mikkelsen 2008), as glTF 2.0 wants it: the tangent lies along growing u, in
 * the plane of the normal; the bitangent w (normal x tangent) lies along growing v, v up. */
#ifndef TWEEND_TANGENTS_H
#define TWEEND_TANGENTS_H

#include "topology.h"

/* Rows of derivatives as tw_patch_job has them. */
enum { TW_DERIVATIVE_WIDTH = 8, TW_DERIVATIVE_SECOND = 4 };

/* Whether a face lies in its UV set (values: [vertices of uv][2], v up) the other way round than in space. A
 * face without area there does not. */
bool tw_uv_is_mirrored(const tw_topology *uv, const float *values, uint32_t face);

/* out: a unit vector orthogonal to the normal (unit length), and w = -1 where mirrored, else 1.
 * Always finite: where v stands still the tangent lies along growing u; where UVs do not grow at all, or
 * along the normal alone, it lies along the first direction; where that has no length either, along the
 * axis that is farthest from the normal. */
void tw_tangent_from_derivatives(const float normal[3], const float points[TW_DERIVATIVE_WIDTH],
                                 const float uvs[TW_DERIVATIVE_WIDTH], bool mirrored, float out[4]);

#endif
