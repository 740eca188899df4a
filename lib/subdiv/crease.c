/* Decay of sharpness, and the shares of the masks that it blends. */
#include "crease.h"

#include <math.h>
#include <string.h>

/* The sharpness that is left after some steps of uniform decay. */
static inline float decayed_after(float sharpness, uint32_t steps) {
  if (tw_is_infinite(sharpness)) return TW_SHARPNESS_INFINITE;
  return sharpness > (float)steps ? sharpness - (float)steps : 0;
}

static inline float decayed(float sharpness) {
  return decayed_after(sharpness, 1);
}

float tw_decayed_edge(float sharpness, bool chaikin, float semi_sum, uint32_t semi_count) {
  if (!chaikin || !tw_is_semi_sharp(sharpness) || semi_count < 2) return decayed(sharpness);
  float others = (semi_sum - sharpness) / (float)(semi_count - 1);
  float child = 0.75f * sharpness + 0.25f * others - 1;
  return child > 0 ? child : 0;
}

/* The sharpness of the half of `edge` at `vertex`, after one step. */
static float child_sharpness(const tw_topology *t, const tw_rules *rules, uint32_t edge, uint32_t vertex) {
  float sharpness = t->edge_sharpness[edge];
  if (!rules->chaikin) return decayed(sharpness);
  return tw_decayed_edge(sharpness, true, t->semi_sum[vertex], t->semi_count[vertex]);
}

/* The rule at a vertex when only sharpness over `above` counts, its edges' and its own. */
static tw_vertex_rule rule_above(const tw_topology *t, uint32_t vertex, float above, uint32_t ends[2]) {
  uint32_t sharp = 0, first = t->ring_offsets[vertex];
  for (uint32_t i = first; i < t->ring_offsets[vertex + 1]; i++) {
    if (!(t->edge_sharpness[t->ring_edges[i]] > above)) continue;
    if (ends) ends[sharp == 0 ? 0 : 1] = i - first;
    sharp++;
  }
  return tw_rule_of(t->vertex_sharpness[vertex] > above ? 1 : 0, sharp);
}

tw_vertex_rule tw_vertex_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]) {
  return rule_above(topology, vertex, 0, ends);
}

tw_vertex_rule tw_settled_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]) {
  return rule_above(topology, vertex, nextafterf(TW_SHARPNESS_INFINITE, 0), ends);
}

void tw_decay(const tw_topology *p, const tw_rules *rules, tw_topology *child) {
  child->smooth = p->smooth;
  if (p->smooth) return; /* all 0 */
  for (uint32_t e = 0; e < p->edge_count; e++)
    for (uint32_t end = 0; end < 2; end++)
      child->edge_sharpness[2 * e + end] = child_sharpness(p, rules, e, p->edge_vertices[e][end]);
  for (uint32_t v = 0; v < p->vertex_count; v++) child->vertex_sharpness[v] = decayed(p->vertex_sharpness[v]);
}

float tw_crease_share(const tw_topology *p, const tw_rules *rules, uint32_t edge) {
  float sharpness = p->edge_sharpness[edge];
  if (rules->linear) return 1;
  if (!(sharpness > 0)) return 0;
  bool stays = child_sharpness(p, rules, edge, p->edge_vertices[edge][0]) > 0 &&
               child_sharpness(p, rules, edge, p->edge_vertices[edge][1]) > 0;
  return stays ? 1 : sharpness;
}

/* ---- steps to come -------------------------------------------------------------------------- */

/* The sharpness, after `steps` steps, of the part of the edge at the decay's vertex. */
static float near_part_after(const tw_vertex_decay *d, uint32_t edge, uint32_t steps) {
  float sharpness = d->topology->edge_sharpness[edge];
  if (!d->topology->semi_sum) return decayed_after(sharpness, steps);
  for (uint32_t i = 0; i < steps; i++) sharpness = tw_decayed_edge(sharpness, true, d->sum[i], d->count[i]);
  return sharpness;
}

/* The sharpness, after `steps` steps (1 or more), of the next part of the edge, which continues the part at
 * the decay's vertex. In the first step all edges at the far vertex count; in decayed_after steps the vertex
 * between the two parts has no other semi-sharp edges. */
static float far_part_after(const tw_vertex_decay *d, uint32_t edge, uint32_t steps) {
  const tw_topology *t = d->topology;
  if (!t->semi_sum) return decayed_after(t->edge_sharpness[edge], steps);
  uint32_t far = tw_far_end(t, edge, d->vertex);
  float beyond = tw_decayed_edge(t->edge_sharpness[edge], true, t->semi_sum[far], t->semi_count[far]);
  for (uint32_t i = 1; i < steps; i++) {
    float near = near_part_after(d, edge, i);
    beyond = tw_decayed_edge(near, true, near + beyond, near > 0 && beyond > 0 ? 2 : 1);
  }
  return beyond;
}

tw_vertex_decay tw_decay_at(const tw_topology *topology, uint32_t vertex, uint32_t steps) {
  const tw_topology *t = topology;
  tw_vertex_decay d = {.topology = t, .vertex = vertex};
  if (!t->semi_sum) return d;
  d.sum[0] = t->semi_sum[vertex];
  d.count[0] = t->semi_count[vertex];
  for (uint32_t step = 1; step <= steps; step++)
    for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
      float sharpness = near_part_after(&d, t->ring_edges[i], step);
      if (!tw_is_semi_sharp(sharpness)) continue;
      d.sum[step] += sharpness;
      d.count[step]++;
    }
  return d;
}

float tw_crease_share_after(const tw_vertex_decay *decay, uint32_t edge, uint32_t steps) {
  float sharpness = near_part_after(decay, edge, steps);
  if (!(sharpness > 0)) return 0;
  bool stays = near_part_after(decay, edge, steps + 1) > 0 && far_part_after(decay, edge, steps + 1) > 0;
  return stays ? 1 : sharpness;
}

/* ---- vertices ------------------------------------------------------------------------------- */

static void add_rule(tw_vertex_blend *blend, tw_vertex_rule rule, const uint32_t ends[2], float share) {
  if (rule == TW_RULE_CORNER) {
    blend->corner += share;
  } else if (rule == TW_RULE_CREASE) {
    blend->crease += share;
    memcpy(blend->ends, ends, sizeof blend->ends);
  } else {
    blend->smooth += share;
  }
}

/* A step at a vertex, before and after which sharpness is asked for. */
typedef struct vertex_step {
  const tw_topology *t;
  const tw_rules *rules;        /* for the step from `t` to its child; decay is NULL */
  const tw_vertex_decay *decay; /* for the step that follows `steps` further ones */
  uint32_t vertex, steps;
} vertex_step;

static inline float edge_before(const vertex_step *s, uint32_t edge) {
  return s->decay ? near_part_after(s->decay, edge, s->steps) : s->t->edge_sharpness[edge];
}
static inline float edge_after(const vertex_step *s, uint32_t edge) {
  return s->decay ? near_part_after(s->decay, edge, s->steps + 1)
                  : child_sharpness(s->t, s->rules, edge, s->vertex);
}

/* The share that the parent's rule keeps when the child has another rule: the mean of the sharpness that
 * vanishes in the step, at most 1 (OpenSubdiv's fractional weight). */
static inline float parent_share(const vertex_step *s) {
  float sum = 0;
  uint32_t count = 0;
  float own = decayed_after(s->t->vertex_sharpness[s->vertex], s->steps);
  if (own > 0 && decayed(own) == 0) {
    sum = own;
    count = 1;
  }
  for (uint32_t i = s->t->ring_offsets[s->vertex]; i < s->t->ring_offsets[s->vertex + 1]; i++) {
    uint32_t edge = s->t->ring_edges[i];
    float sharpness = edge_before(s, edge);
    if (!(sharpness > 0) || edge_after(s, edge) > 0) continue;
    sum += sharpness;
    count++;
  }
  if (count == 0) return 0;
  float share = sum / (float)count;
  return share > 1 ? 1 : share;
}

/* The rule before (0) or after (1) the step. */
static inline tw_vertex_rule step_rule(const vertex_step *s, uint32_t after, uint32_t ends[2]) {
  uint32_t sharp = 0, first = s->t->ring_offsets[s->vertex];
  for (uint32_t i = first; i < s->t->ring_offsets[s->vertex + 1]; i++) {
    uint32_t edge = s->t->ring_edges[i];
    if (!((after ? edge_after(s, edge) : edge_before(s, edge)) > 0)) continue;
    ends[sharp == 0 ? 0 : 1] = i - first;
    sharp++;
  }
  return tw_rule_of(decayed_after(s->t->vertex_sharpness[s->vertex], s->steps + after), sharp);
}

static inline tw_vertex_blend blend_in(const vertex_step *s) {
  tw_vertex_blend blend = {0, 0, 0, {0, 0}};
  uint32_t ends[2][2] = {{0}, {0}};
  tw_vertex_rule rule = step_rule(s, 0, ends[0]);
  if (rule <= TW_RULE_DART) {
    add_rule(&blend, rule, ends[0], 1);
    return blend;
  }
  tw_vertex_rule child_rule = step_rule(s, 1, ends[1]);
  bool same = child_rule == rule;
  float share = same ? 1 : parent_share(s);
  add_rule(&blend, rule, ends[0], share);
  if (!same) add_rule(&blend, child_rule, ends[1], 1 - share);
  return blend;
}

tw_vertex_blend tw_blend_at(const tw_topology *p, const tw_rules *rules, uint32_t vertex) {
  if (rules->linear) return (tw_vertex_blend){0, 0, 1, {0, 0}};
  return blend_in(&(vertex_step){p, rules, NULL, vertex, 0});
}

tw_vertex_blend tw_blend_after(const tw_vertex_decay *decay, uint32_t steps) {
  return blend_in(&(vertex_step){decay->topology, NULL, decay, decay->vertex, steps});
}
