/* The part of a refined mesh's connectivity that is the same in all schemes. */
#include "child.h"

tw_status tw_child_allocate(tw_topology *child, tw_arena *arena) {
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

/* Corner of the child that runs along the half of corner `c`'s edge at `vertex`, on c's side. */
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

void tw_child_split_edges(const tw_topology *parent, tw_topology *child) {
  for (uint32_t e = 0; e < parent->edge_count; e++) split_edge(parent, e, child);
}

tw_child_fans tw_child_link_vertices(const tw_topology *parent, tw_topology *child) {
  const tw_topology *p = parent;
  tw_child_fans fans = {parent, child, 0, 0};
  for (uint32_t v = 0; v < p->vertex_count; v++) {
    for (uint32_t i = p->fan_offsets[v]; i < p->fan_offsets[v + 1]; i++)
      tw_put_corner(&fans, 4 * p->fan_corners[i]);
    for (uint32_t i = p->ring_offsets[v]; i < p->ring_offsets[v + 1]; i++) {
      uint32_t edge = p->ring_edges[i];
      tw_put_edge(&fans, 2 * edge + (p->edge_vertices[edge][0] != v));
    }
    tw_end_fan(&fans, v, p->vertex_flags[v]);
  }
  return fans;
}
