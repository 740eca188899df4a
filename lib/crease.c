/* Decay of sharpness, and the masks that it blends. */
#include "crease.h"

#include <string.h>

static float decayed(float sharpness) {
  if (tw_is_infinite(sharpness)) return TW_SHARPNESS_INFINITE;
  return sharpness > 1 ? sharpness - 1 : 0;
}

/* Sharpness of the half of `edge` at `vertex` after one step. */
static float child_sharpness(const tw_topology *t, const tw_rules *rules, uint32_t edge, uint32_t vertex) {
  float sharpness = t->edge_sharpness[edge];
  if (!rules->chaikin || !tw_is_semi_sharp(sharpness) || t->semi_count[vertex] < 2) return decayed(sharpness);
  float others = (t->semi_sum[vertex] - sharpness) / (float)(t->semi_count[vertex] - 1);
  float child = 0.75f * sharpness + 0.25f * others - 1;
  return child > 0 ? child : 0;
}

tw_vertex_rule tw_vertex_rule_at(const tw_topology *topology, uint32_t vertex, uint32_t ends[2]) {
  uint32_t sharp = 0, first = topology->ring_offsets[vertex];
  for (uint32_t i = first; i < topology->ring_offsets[vertex + 1]; i++) {
    if (!(topology->edge_sharpness[topology->ring_edges[i]] > 0)) continue;
    if (ends) ends[sharp == 0 ? 0 : 1] = i - first;
    sharp++;
  }
  return tw_rule_of(topology->vertex_sharpness[vertex], sharp);
}

void tw_decay(const tw_topology *p, const tw_rules *rules, tw_topology *child) {
  for (uint32_t e = 0; e < p->edge_count; e++)
    for (uint32_t end = 0; end < 2; end++)
      child->edge_sharpness[2 * e + end] = child_sharpness(p, rules, e, p->edge_vertices[e][end]);
  for (uint32_t v = 0; v < p->vertex_count; v++) child->vertex_sharpness[v] = decayed(p->vertex_sharpness[v]);
  child->smooth = p->smooth;
}

float tw_crease_share(const tw_topology *p, const tw_rules *rules, uint32_t edge) {
  float sharpness = p->edge_sharpness[edge];
  if (rules->linear) return 1;
  if (!(sharpness > 0)) return 0;
  bool stays = child_sharpness(p, rules, edge, p->edge_vertices[edge][0]) > 0 &&
               child_sharpness(p, rules, edge, p->edge_vertices[edge][1]) > 0;
  return stays ? 1 : sharpness;
}

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

/* Share that the parent's rule keeps when the child has another one: the mean of the sharpness that
 * is about to vanish, at most 1 (OpenSubdiv's fractional weight). */
static float parent_share(const tw_topology *p, const tw_rules *rules, uint32_t vertex) {
  float sum = 0;
  uint32_t count = 0;
  float own = p->vertex_sharpness[vertex];
  if (own > 0 && decayed(own) == 0) {
    sum = own;
    count = 1;
  }
  for (uint32_t i = p->ring_offsets[vertex]; i < p->ring_offsets[vertex + 1]; i++) {
    uint32_t edge = p->ring_edges[i];
    float sharpness = p->edge_sharpness[edge];
    if (!(sharpness > 0) || child_sharpness(p, rules, edge, vertex) > 0) continue;
    sum += sharpness;
    count++;
  }
  if (count == 0) return 0;
  float share = sum / (float)count;
  return share > 1 ? 1 : share;
}

tw_vertex_blend tw_blend_at(const tw_topology *p, const tw_rules *rules, uint32_t vertex) {
  tw_vertex_blend blend = {0, 0, 0, {0, 0}};
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tw_vertex_rule_at(p, vertex, ends);
  if (rules->linear) rule = TW_RULE_CORNER;
  if (rule <= TW_RULE_DART || rules->linear) {
    add_rule(&blend, rule, ends, 1);
    return blend;
  }
  uint32_t child_ends[2] = {0, 0}, child_sharp = 0;
  for (uint32_t i = p->ring_offsets[vertex]; i < p->ring_offsets[vertex + 1]; i++) {
    if (!(child_sharpness(p, rules, p->ring_edges[i], vertex) > 0)) continue;
    child_ends[child_sharp == 0 ? 0 : 1] = i - p->ring_offsets[vertex];
    child_sharp++;
  }
  tw_vertex_rule child_rule = tw_rule_of(decayed(p->vertex_sharpness[vertex]), child_sharp);
  bool same = child_rule == rule;
  float share = same ? 1 : parent_share(p, rules, vertex);
  add_rule(&blend, rule, ends, share);
  if (!same) add_rule(&blend, child_rule, child_ends, 1 - share);
  return blend;
}
