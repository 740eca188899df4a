/* One level of Catmull-Clark or bilinear subdivision of any polygon mesh, with creases.
 *
 * Numbers of a level follow from those of the level above by arithmetic (V, E, F its counts):
 * vertices: 0.. of vertices, V.. of edges, V + E.. of faces;
 * faces:    quad c of corner c: its vertex, middle of its edge, face point, middle of the edge before;
 * edges:    2e and 2e + 1 of edge e (at its first and second end), 2E + c from the middle of corner
 *           c's edge to the face point.
 *
 * Rules: Catmull and Clark 1978; creases DeRose, Kass and Truong 1998, with the blend at fractional
 * sharpness and the Chaikin decay as OpenSubdiv defines them. */
#ifndef TWEEND_REFINE_H
#define TWEEND_REFINE_H

#include "crease.h"
#include "parallel_for.h"
#include "topology.h"

/* Topology and sharpness of the next level; TW_NO_MEMORY. The parent's sharpness must be set. */
tw_status tw_refine_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                             const tw_parallel_for *parallel, tw_topology *child);

/* The same, but of the child only its counts and corner_vertex: enough to draw a last level. */
tw_status tw_refine_corners(const tw_topology *parent, tw_arena *arena, const tw_parallel_for *parallel,
                            tw_topology *child);

/* Values of the next level: in [parent vertices][width], out [child vertices][width]. */
void tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const float *in,
                      const tw_parallel_for *parallel, float *out);

/* The same for points, any of them alone: the child's face points once, and from those any rows of it.
 * in: [parent vertices][3]; face_points: [parent faces][3]; out: [count][3]. */
void tw_refine_face_points(const tw_topology *parent, const float *in, float *face_points);
void tw_refine_points(const tw_topology *parent, const tw_rules *rules, const float *in,
                      const float *face_points, uint32_t first, uint32_t count, float *out);

/* Weight of each face point of a smooth edge with `faces` faces, `triangles` of them triangles. */
float tw_smooth_face_weight(const tw_rules *rules, uint32_t faces, uint32_t triangles);

#endif
