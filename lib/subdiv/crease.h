/* How sharpness decays from level to level, and what it makes of the rule at an edge or a vertex: the same
 * in every scheme.
 *
 * DeRose, Kass and Truong 1998, with the blend at fractional sharpness and the Chaikin decay as
 * OpenSubdiv defines them. */
#ifndef TWEEND_CREASE_H
#define TWEEND_CREASE_H

#include "topology.h"

typedef struct tw_rules {
  bool linear;           /* new points are plain averages: bilinear, and UVs under the rule `all` */
  bool chaikin;          /* creases decay by Chaikin's rule */
  bool loop;             /* Loop's scheme, else Catmull and Clark's */
  bool smooth_triangles; /* OpenSubdiv's TRI_SUB_SMOOTH weights next to triangles */
} tw_rules;

/* What shapes the surface at a vertex. */
typedef enum tw_vertex_rule { TW_RULE_SMOOTH, TW_RULE_DART, TW_RULE_CREASE, TW_RULE_CORNER } tw_vertex_rule;

static inline tw_vertex_rule tw_rule_of(float vertex_sharpness, uint32_t sharp_edges) {
  if (vertex_sharpness > 0 || sharp_edges > 2) return TW_RULE_CORNER;
  return (tw_vertex_rule)sharp_edges;
}

/* Rule at a vertex; ends (NULL allowed) receives the first and last sharp edge of its ring, as indices
 * into the ring. */
tw_vertex_rule tw_vertex_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]);

/* The same once all that is semi-sharp has decayed. */
tw_vertex_rule tw_settled_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]);

/* Sharpness that is left of an edge after one step, at the end where the semi-sharp edges sum to `semi_sum`
 * and number `semi_count`. */
float tw_decayed_edge(float sharpness, bool chaikin, float semi_sum, uint32_t semi_count);

/* Sharpness of the child's first 2 edge_count edges, the halves of the parent's at its first and its
 * second end, and of its first vertex_count vertices. The child's is 0 before. */
void tw_decay(const tw_topology *parent, const tw_rules *rules, tw_topology *child);

/* How much of the crease's midpoint an edge takes: all where both halves stay sharp, else as much as it
 * is sharp. Under Chaikin's rule that may be a little over 1 (a half can decay from 1.3 to 0 next to
 * smoother ones), and is taken so, as OpenSubdiv does. */
float tw_crease_share(const tw_topology *parent, const tw_rules *rules, uint32_t edge);

/* Shares of the three masks that meet at a vertex while sharpness decays; they sum to 1. */
typedef struct tw_vertex_blend {
  float smooth, crease, corner;
  uint32_t ends[2]; /* sharp edges of the crease mask, as indices into the ring */
} tw_vertex_blend;

tw_vertex_blend tw_blend_at(const tw_topology *parent, const tw_rules *rules, uint32_t vertex);

enum { TW_DECAY_STEPS = 10 }; /* to TW_SHARPNESS_INFINITE */

/* How the edges at one vertex decay over some steps: under Chaikin's rule they look at each other. */
typedef struct tw_vertex_decay {
  const tw_topology *topology;
  uint32_t vertex;
  /* Of the semi-sharp edges before each step, Chaikin's rule alone. */
  float sum[TW_DECAY_STEPS + 1];
  uint32_t count[TW_DECAY_STEPS + 1];
} tw_vertex_decay;

/* steps: at most TW_DECAY_STEPS, after which all has decayed. */
tw_vertex_decay tw_decay_at(const tw_topology *topology, uint32_t vertex, uint32_t steps);

/* Both as they will be in the step after `steps` further ones, the edge at the decay's vertex. */
float tw_crease_share_after(const tw_vertex_decay *decay, uint32_t edge, uint32_t steps);
tw_vertex_blend tw_blend_after(const tw_vertex_decay *decay, uint32_t steps);

#endif
