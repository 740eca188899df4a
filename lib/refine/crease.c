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

/* ---- steps to come --------------------------------------------------------------------------- */

/* In which steps both halves of an edge's part at the vertex stay sharp: the half at the vertex, which is the
 * next part, and the far half. In the first step all edges at the far vertex count; in later steps the vertex
 * between the two halves has no other semi-sharp edges. sharpness: as in tw_edge_decay. */
static uint32_t find_stays(const tw_topology *t, uint32_t far, const float *sharpness, uint32_t steps) {
  uint32_t stays = 0;
  float beyond = 0;
  for (uint32_t i = 0; i < steps; i++) {
    float near = sharpness[i];
    if (!t->semi_sum)
      beyond = sharpness[i + 1];
    else if (i == 0)
      beyond = tw_decayed_edge(near, true, t->semi_sum[far], t->semi_count[far]);
    else
      beyond = tw_decayed_edge(near, true, near + beyond, near > 0 && beyond > 0 ? 2 : 1);
    if (sharpness[i + 1] > 0 && beyond > 0) stays |= 1u << i;
  }
  return stays;
}

tw_vertex_decay tw_decay_at(const tw_topology *topology, uint32_t vertex, uint32_t steps,
                            tw_edge_decay *room) {
  const tw_topology *t = topology;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  uint32_t ring_count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex];
  float sum = t->semi_sum ? t->semi_sum[vertex] : 0;
  uint32_t count = t->semi_sum ? t->semi_count[vertex] : 0;
  for (uint32_t i = 0; i < ring_count; i++) room[i].sharpness[0] = t->edge_sharpness[ring[i]];
  for (uint32_t step = 0; step < steps; step++) {
    float next_sum = 0;
    uint32_t next_count = 0;
    for (uint32_t i = 0; i < ring_count; i++) {
      float *sharpness = room[i].sharpness;
      sharpness[step + 1] = t->semi_sum ? tw_decayed_edge(sharpness[step], true, sum, count)
                                        : decayed_after(sharpness[0], step + 1);
      if (!tw_is_semi_sharp(sharpness[step + 1])) continue;
      next_sum += sharpness[step + 1];
      next_count++;
    }
    sum = next_sum;
    count = next_count;
  }
  for (uint32_t i = 0; i < ring_count; i++)
    room[i].stays = find_stays(t, tw_far_end(t, ring[i], vertex), room[i].sharpness, steps);
  return (tw_vertex_decay){t, vertex, room};
}

float tw_crease_share_after(const tw_vertex_decay *decay, uint32_t place, uint32_t steps) {
  const tw_edge_decay *edge = &decay->edges[place];
  return edge->stays >> steps & 1 ? 1 : edge->sharpness[steps];
}

/* ---- vertices -------------------------------------------------------------------------------- */

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

static inline uint32_t ring_size(const vertex_step *s) {
  return s->t->ring_offsets[s->vertex + 1] - s->t->ring_offsets[s->vertex];
}
static inline uint32_t ring_edge(const vertex_step *s, uint32_t place) {
  return s->t->ring_edges[s->t->ring_offsets[s->vertex] + place];
}

/* The sharpness of an edge, given by its place in the ring. */
static inline float edge_before(const vertex_step *s, uint32_t place) {
  return s->decay ? s->decay->edges[place].sharpness[s->steps] : s->t->edge_sharpness[ring_edge(s, place)];
}
static inline float edge_after(const vertex_step *s, uint32_t place) {
  return s->decay ? s->decay->edges[place].sharpness[s->steps + 1]
                  : child_sharpness(s->t, s->rules, ring_edge(s, place), s->vertex);
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
  for (uint32_t i = 0; i < ring_size(s); i++) {
    float sharpness = edge_before(s, i);
    if (!(sharpness > 0) || edge_after(s, i) > 0) continue;
    sum += sharpness;
    count++;
  }
  if (count == 0) return 0;
  float share = sum / (float)count;
  return share > 1 ? 1 : share;
}

/* The rule before (0) or after (1) the step. */
static inline tw_vertex_rule step_rule(const vertex_step *s, uint32_t after, uint32_t ends[2]) {
  uint32_t sharp = 0;
  for (uint32_t i = 0; i < ring_size(s); i++) {
    if (!((after ? edge_after(s, i) : edge_before(s, i)) > 0)) continue;
    ends[sharp == 0 ? 0 : 1] = i;
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
