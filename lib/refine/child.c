/* The part of a refined mesh's connectivity that is the same in all schemes. */
#include "child.h"

#include <string.h>

tw_status tw_child_count(tw_topology *child, uint64_t vertices, uint64_t edges, uint64_t faces,
                         uint32_t face_size) {
  uint64_t corners = face_size * faces;
  if (vertices >= UINT32_MAX || edges >= UINT32_MAX || corners >= UINT32_MAX) return TW_LIMIT;
  *child = (tw_topology){.vertex_count = (uint32_t)vertices,
                         .edge_count = (uint32_t)edges,
                         .face_count = (uint32_t)faces,
                         .corner_count = (uint32_t)corners,
                         .face_size = face_size};
  return TW_OK;
}

static tw_status allocate(tw_topology *child, tw_arena *arena) {
  size_t edges = child->edge_count, corners = child->corner_count;
  child->corner_vertex = tw_arena_alloc(arena, corners, sizeof(uint32_t));
  child->corner_edge = tw_arena_alloc(arena, corners, sizeof(uint32_t));
  child->sibling = tw_arena_alloc(arena, corners, sizeof(uint32_t));
  child->edge_vertices = tw_arena_alloc(arena, edges, sizeof(uint32_t[2]));
  child->edge_corner = tw_arena_alloc(arena, edges, sizeof(uint32_t));
  child->edge_flags = tw_arena_alloc(arena, edges, 1);
  bool complete = child->corner_vertex && child->corner_edge && child->sibling && child->edge_vertices &&
                  child->edge_corner && child->edge_flags;
  tw_status status = complete ? tw_topology_allocate_fans(child, arena) : TW_NO_MEMORY;
  return status == TW_OK ? tw_topology_soften(child, arena) : status;
}

/* The child's corner along the half of corner c's edge at `vertex`, in c's face. */
static uint32_t half_at(const tw_topology *parent, const tw_topology *child, uint32_t c, uint32_t vertex) {
  if (parent->corner_vertex[c] == vertex) return 4 * c;
  return tw_corner_previous(child, 4 * tw_corner_next(parent, c));
}

static void split_edge(const tw_topology *p, uint32_t edge, tw_topology *child) {
  uint32_t first = p->edge_corner[edge];
  for (uint32_t end = 0; end < 2; end++) {
    uint32_t vertex = p->edge_vertices[edge][end], half = 2 * edge + end;
    uint32_t c = first, at = half_at(p, child, first, vertex);
    child->edge_corner[half] = at;
    child->edge_vertices[half][end] = vertex;
    child->edge_vertices[half][1 - end] = p->vertex_count + edge;
    child->edge_flags[half] = p->edge_flags[edge];
    do {
      c = p->sibling[c];
      uint32_t next = half_at(p, child, c, vertex);
      child->sibling[at] = next;
      at = next;
    } while (c != first);
  }
}

static void split_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  (void)part;
  for (uint32_t e = begin; e < end; e++) split_edge(s->parent, e, s->child);
}

/* ---- fans ------------------------------------------------------------------------------------ */

/* Flags of the vertex in the middle of an edge. */
static uint8_t middle_flags(uint8_t edge_flags) {
  if (edge_flags & TW_EDGE_NONMANIFOLD) return TW_VERTEX_NONMANIFOLD;
  return edge_flags & TW_EDGE_BORDER ? TW_VERTEX_BORDER : 0;
}

static uint32_t faces_at(const tw_topology *t, uint32_t edge) {
  uint32_t faces = 0, first = t->edge_corner[edge], corner = first;
  do {
    faces++;
    corner = t->sibling[corner];
  } while (corner != first);
  return faces;
}

/* Vertices of the parent keep their counts of corners and edges. The counts of an edge's middle follow from
 * the number of faces at the edge. Here each count is written alone; place_fans sums them up. */
static void count_fans(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  const tw_topology *p = s->parent;
  (void)part;
  for (uint32_t e = begin; e < end; e++) {
    uint32_t faces = faces_at(p, e), vertex = p->vertex_count + e;
    s->child->fan_offsets[vertex + 1] = s->middle_corners * faces;
    s->child->ring_offsets[vertex + 1] = s->middle_edges * faces + 2;
  }
}

static void place_fans(const tw_child_step *s) {
  const tw_topology *p = s->parent;
  uint32_t *fans = s->child->fan_offsets, *rings = s->child->ring_offsets, vertices = p->vertex_count,
           middles_end = vertices + p->edge_count;
  memcpy(fans, p->fan_offsets, ((size_t)vertices + 1) * sizeof *fans);
  memcpy(rings, p->ring_offsets, ((size_t)vertices + 1) * sizeof *rings);
  for (uint32_t v = vertices; v < middles_end; v++) {
    fans[v + 1] += fans[v];
    rings[v + 1] += rings[v];
  }
  for (uint32_t v = middles_end; v < s->child->vertex_count; v++) {
    uint32_t size = tw_face_size(p, v - middles_end);
    fans[v + 1] = fans[v] + size;
    rings[v + 1] = rings[v] + size;
  }
}

static void link_vertices(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  const tw_topology *p = s->parent;
  tw_child_fans fans = tw_start_fans(s, begin);
  (void)part;
  for (uint32_t v = begin; v < end; v++) {
    for (uint32_t i = p->fan_offsets[v]; i < p->fan_offsets[v + 1]; i++)
      tw_put_corner(&fans, 4 * p->fan_corners[i]);
    for (uint32_t i = p->ring_offsets[v]; i < p->ring_offsets[v + 1]; i++) {
      uint32_t edge = p->ring_edges[i];
      tw_put_edge(&fans, 2 * edge + (p->edge_vertices[edge][0] != v));
    }
    s->child->vertex_flags[v] = p->vertex_flags[v];
  }
}

static void link_middles(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  const tw_topology *p = s->parent;
  tw_child_fans fans = tw_start_fans(s, p->vertex_count + begin);
  (void)part;
  for (uint32_t e = begin; e < end; e++) {
    s->link_edge(&fans, e);
    s->child->vertex_flags[p->vertex_count + e] = middle_flags(p->edge_flags[e]);
  }
}

/* ---- the step -------------------------------------------------------------------------------- */

tw_status tw_child_make(const tw_child_step *step, const tw_rules *rules, tw_arena *arena,
                        const tw_parallel_for *parallel) {
  tw_child_step s = *step;
  const tw_topology *p = s.parent;
  tw_status status = allocate(s.child, arena);
  if (status != TW_OK) return status;
  tw_parallel_for_run(parallel, p->face_count, TW_PARALLEL_FOR_LEAST, s.split_faces, &s);
  tw_parallel_for_run(parallel, p->edge_count, TW_PARALLEL_FOR_LEAST, split_edges, &s);
  tw_decay(p, rules, s.child);
  tw_parallel_for_run(parallel, p->edge_count, TW_PARALLEL_FOR_LEAST, count_fans, &s);
  place_fans(&s);
  status = tw_parallel_for_status(parallel);
  if (status != TW_OK) return status;
  tw_parallel_for_run(parallel, p->vertex_count, TW_PARALLEL_FOR_LEAST, link_vertices, &s);
  tw_parallel_for_run(parallel, p->edge_count, TW_PARALLEL_FOR_LEAST, link_middles, &s);
  if (s.link_faces) tw_parallel_for_run(parallel, p->face_count, TW_PARALLEL_FOR_LEAST, s.link_faces, &s);
  return rules->chaikin ? tw_topology_sum_semi(s.child, arena) : TW_OK;
}
