/* Tangents at a vertex that semi-sharp edges meet in, or that is semi-sharp itself: they are those of the
 * vertex that it will be once all has decayed, so that both sides of a crease that rounds off in the end have
 * the same normal. A step leads from a vertex with its neighbours to the same place one level down, and so
 * carries weights there to weights here. */
#include <assert.h>
#include <math.h>

#include "limit_mask.h"
#include "loop.h"

static uint32_t steps_to_settle(const tw_topology *t, uint32_t vertex) {
  float greatest = 0, own = t->vertex_sharpness[vertex];
  if (tw_is_semi_sharp(own)) greatest = own;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness) && sharpness > greatest) greatest = sharpness;
  }
  return (uint32_t)ceilf(greatest);
}

static void add(tw_limit_entry *entry, float weight, float tangent1, float tangent2) {
  entry->tangent1 += weight * tangent1;
  entry->tangent2 += weight * tangent2;
}

static void scale(tw_limit_entry *entry, float weight) {
  entry->tangent1 *= weight;
  entry->tangent2 *= weight;
}

/* Weights of the vertex one level down go to the vertex and its neighbours; smooth: what its neighbours take
 * of it where it is smooth. Leaves entry 0 without its own. */
static tw_limit_entry take_vertex(const tw_limit_neighbours *m, const tw_vertex_blend *blend, float own) {
  tw_limit_entry v = m->entries[0];
  scale(&m->entries[0], blend->corner + 0.75f * blend->crease + blend->smooth * own);
  return v;
}

static void give_to_ring(const tw_limit_neighbours *m, const tw_vertex_blend *blend, float smooth,
                         const tw_limit_entry *v) {
  for (uint32_t i = 0; i < m->ring_count; i++)
    add(tw_ring_entry(m, i), blend->smooth * smooth, v->tangent1, v->tangent2);
  for (int i = 0; blend->crease > 0 && i < 2; i++)
    add(tw_ring_entry(m, blend->ends[i]), 0.125f * blend->crease, v->tangent1, v->tangent2);
}

static float ring_share(const tw_limit_neighbours *m, const tw_vertex_decay *decay, uint32_t i,
                        uint32_t steps) {
  uint32_t edge = m->t->ring_edges[m->t->ring_offsets[m->vertex] + i % m->ring_count];
  return tw_crease_share_after(decay, edge, steps);
}

/* Among quads. Weights of face points are gathered first, in place of those of the faces' far corners, and
 * given to the four corners of each face in the end. */
static void quad_step(const tw_limit_neighbours *m, const tw_vertex_decay *decay, uint32_t steps) {
  float n = (float)m->fan_count;
  tw_vertex_blend blend = tw_blend_after(decay, steps);
  tw_limit_entry v = take_vertex(m, &blend, (n - 2) / n);
  for (uint32_t i = 0; i < m->fan_count; i++) {
    tw_limit_entry *face = tw_fan_entry(m, i);
    add(face, blend.smooth / (n * n), v.tangent1, v.tangent2);
    for (uint32_t side = i; side < i + 2; side++) {
      const tw_limit_entry *edge = tw_ring_entry(m, side);
      float smooth = 1 - ring_share(m, decay, side, steps);
      add(face, 0.25f * smooth, edge->tangent1, edge->tangent2);
    }
  }
  for (uint32_t i = 0; i < m->ring_count; i++) {
    tw_limit_entry *edge = tw_ring_entry(m, i);
    scale(edge, 0.25f + 0.25f * ring_share(m, decay, i, steps));
    add(&m->entries[0], 1, edge->tangent1, edge->tangent2);
  }
  give_to_ring(m, &blend, 1 / (n * n), &v);
  for (uint32_t i = 0; i < m->fan_count; i++) {
    tw_limit_entry *face = tw_fan_entry(m, i);
    scale(face, 0.25f);
    add(&m->entries[0], 1, face->tangent1, face->tangent2);
    add(tw_ring_entry(m, i), 1, face->tangent1, face->tangent2);
    add(tw_ring_entry(m, i + 1), 1, face->tangent1, face->tangent2);
  }
}

/* Among triangles, where what an edge point takes from the points that face the edge goes to the neighbours
 * in the ring. */
static void triangle_step(const tw_limit_neighbours *m, const tw_vertex_decay *decay, uint32_t steps) {
  tw_vertex_blend blend = tw_blend_after(decay, steps);
  uint32_t count = m->ring_count;
  float weight = blend.smooth > 0 ? (float)tw_loop_weight(count) : 0;
  tw_limit_entry v = take_vertex(m, &blend, 1 - (float)count * weight);
  tw_limit_entry first = *tw_ring_entry(m, 0), before = *tw_ring_entry(m, count - 1);
  for (uint32_t i = 0; i < count; i++) {
    tw_limit_entry *edge = tw_ring_entry(m, i), own = *edge;
    tw_limit_entry after = i + 1 < count ? *tw_ring_entry(m, i + 1) : first;
    float crease = ring_share(m, decay, i, steps);
    float crease_before = ring_share(m, decay, i + count - 1, steps);
    float crease_after = ring_share(m, decay, i + 1, steps);
    scale(edge, 0.375f + 0.125f * crease);
    add(&m->entries[0], 1, edge->tangent1, edge->tangent2);
    add(edge, 0.125f * (1 - crease_before), before.tangent1, before.tangent2);
    add(edge, 0.125f * (1 - crease_after), after.tangent1, after.tangent2);
    before = own;
  }
  give_to_ring(m, &blend, weight, &v);
}

void tw_limit_settle(const tw_limit_neighbours *neighbours) {
  const tw_limit_neighbours *m = neighbours;
  assert(m->ring_count > 0);
  uint32_t steps = steps_to_settle(m->t, m->vertex);
  tw_vertex_decay decay = tw_decay_at(m->t, m->vertex, steps);
  while (steps-- > 0) {
    if (m->t->face_size == 3)
      triangle_step(m, &decay, steps);
    else
      quad_step(m, &decay, steps);
  }
}
