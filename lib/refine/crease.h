/* How sharpness decays from level to level, and which rule it selects at an edge or a vertex. The same in
 * every scheme.
 *
 * DeRose, Kass and Truong 1998, with the blend at fractional sharpness and the Chaikin decay as OpenSubdiv
 * defines them. */
#ifndef TWEEND_CREASE_H
#define TWEEND_CREASE_H

#include "topology.h"

typedef struct tw_rules {
  bool linear;           /* new points are plain averages: bilinear surfaces, and UVs under TW_UV_ALL */
  bool chaikin;          /* creases decay by Chaikin's rule */
  bool loop;             /* Loop's scheme; false: Catmull and Clark's */
  bool smooth_triangles; /* OpenSubdiv's TRI_SUB_SMOOTH weights next to triangles */
} tw_rules;

/* The rule that shapes the surface at a vertex. */
typedef enum tw_vertex_rule { TW_RULE_SMOOTH, TW_RULE_DART, TW_RULE_CREASE, TW_RULE_CORNER } tw_vertex_rule;

static inline tw_vertex_rule tw_rule_of(float vertex_sharpness, uint32_t sharp_edges) {
  if (vertex_sharpness > 0 || sharp_edges > 2) return TW_RULE_CORNER;
  return (tw_vertex_rule)sharp_edges;
}

/* The rule at a vertex. ends: NULL, or receives the first and last sharp edge of its ring, as indices into
 * the ring. */
tw_vertex_rule tw_vertex_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]);

/* The rule at a vertex once all semi-sharp edges and vertices have decayed. */
tw_vertex_rule tw_settled_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]);

/* The sharpness that an edge has left after one step, in its half at an end where the semi-sharp edges sum to
 * `semi_sum` and number `semi_count` (this edge included; used by Chaikin's rule). */
float tw_decayed_edge(float sharpness, bool chaikin, float semi_sum, uint32_t semi_count);

/* Sets the sharpness of the child's first 2 * edge_count edges, which are the halves of the parent's edges,
 * and of its first vertex_count vertices. The child's sharpness arrays must be 0 before. */
void tw_decay(const tw_topology *parent, const tw_rules *rules, tw_topology *child);

/* The share of the crease mask (the edge's midpoint) in an edge point: 1 where both halves stay sharp or the
 * rules are linear, else the edge's sharpness. Under Chaikin's rule a half can decay from 1.3 to 0 next to
 * smoother edges, so the share can be a little over 1; it is used as it is, as OpenSubdiv does. */
float tw_crease_share(const tw_topology *parent, const tw_rules *rules, uint32_t edge);

/* The shares of the three masks that blend at a vertex while sharpness decays; they sum to 1. */
typedef struct tw_vertex_blend {
  float smooth, crease, corner;
  uint32_t ends[2]; /* sharp edges of the crease mask, as indices into the ring */
} tw_vertex_blend;

tw_vertex_blend tw_blend_at(const tw_topology *parent, const tw_rules *rules, uint32_t vertex);

enum { TW_DECAY_STEPS = 10 }; /* steps in which anything below TW_SHARPNESS_INFINITE decays to 0 */

/* The decay of one edge at a vertex. */
typedef struct tw_edge_decay {
  float sharpness[TW_DECAY_STEPS + 1]; /* of the edge's part at the vertex, after each number of steps */
  uint32_t stays; /* bit i: both halves of that part stay sharp in the step that follows i further ones */
} tw_edge_decay;

/* The decay at one vertex over several steps. Under Chaikin's rule the decay of an edge depends on the other
 * edges. */
typedef struct tw_vertex_decay {
  const tw_topology *topology;
  uint32_t vertex;
  const tw_edge_decay *edges; /* [edges of the vertex], in the order of its ring */
} tw_vertex_decay;

/* Decays the edges of a vertex by `steps` steps, at most TW_DECAY_STEPS; after those all semi-sharp edges
 * have decayed. room: one for each edge of the vertex; the result uses it. */
tw_vertex_decay tw_decay_at(const tw_topology *topology, uint32_t vertex, uint32_t steps,
                            tw_edge_decay *room);

/* tw_crease_share of an edge at the decay's vertex, given by its place in the ring, and tw_blend_at of that
 * vertex, for the step that follows `steps` further ones: fewer than tw_decay_at was asked for. Not for
 * linear rules. */
float tw_crease_share_after(const tw_vertex_decay *decay, uint32_t place, uint32_t steps);
tw_vertex_blend tw_blend_after(const tw_vertex_decay *decay, uint32_t steps);

#endif
