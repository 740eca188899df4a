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

/* Values of the next level: in [parent vertices][width], out [child vertices][width]. */
void tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const float *in,
                      const tw_parallel_for *parallel, float *out);

/* Weight of each face point of a smooth edge with `faces` faces, `triangles` of them triangles. */
float tw_smooth_face_weight(const tw_rules *rules, uint32_t faces, uint32_t triangles);

/* ---- masks -------------------------------------------------------------------------------------- */

/* The generic step as numbers: what each new vertex is made of. For values that are not rows of floats, and
 * for vertices one by one; rows go faster through tw_refine_values, which follows the same rules. */

/* A share of one of the parent's vertices or, from vertex_count + edge_count on, of the child's vertex of
 * that number, which is a face point. */
typedef struct tw_share {
  uint32_t vertex;
  float weight;
} tw_share;

/* Shares that the largest mask has. O(parent). */
uint32_t tw_refine_mask_capacity(const tw_topology *parent);

/* Fills in the shares of a vertex of the child, which sum to 1, and returns their number. No vertex comes
 * up twice but for the ends of doubled edges. */
uint32_t tw_refine_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

/* The same for Loop's scheme, whose children are all made of the parent's vertices. */
uint32_t tw_loop_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares);

#endif
