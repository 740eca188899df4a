/* Counting what an open border leaves of a Loop mesh, level by level.
 *
 * A triangle passes on its corners at inner vertices, and its middle unless one of its edges lies on the
 * border. What those are follows from how many of its vertices are on the border, so that kinds of
 * triangles are enough to count by, and kinds of edges for the vertices. */
#include "open.h"

typedef struct border_kinds {
  uint64_t inside, one, two; /* triangles with no, one and two vertices on the border, and no edge */
  uint64_t strip;            /* with two and the edge between them */
  uint64_t middle;           /* with three, and no edge: only the middle goes on */
  uint64_t last;             /* with three, and an edge: nothing goes on */
  uint64_t inner_vertices;
  uint64_t inner_edges, half_edges; /* with two inner ends, with one */
} border_kinds;

static bool is_inner(const tw_topology *t, uint32_t vertex) {
  return !(t->vertex_flags[vertex] & TW_VERTEX_BORDER);
}

static void sort_triangle(const tw_topology *t, uint32_t face, border_kinds *kinds) {
  uint32_t vertices = 0, edges = 0;
  for (uint32_t c = 3 * face; c < 3 * face + 3; c++) {
    vertices += !is_inner(t, t->corner_vertex[c]);
    edges += (t->edge_flags[t->corner_edge[c]] & TW_EDGE_BORDER) != 0;
  }
  if (vertices == 3)
    *(edges ? &kinds->last : &kinds->middle) += 1;
  else if (vertices == 2)
    *(edges ? &kinds->strip : &kinds->two) += 1;
  else
    *(vertices ? &kinds->one : &kinds->inside) += 1;
}

static border_kinds sort_all(const tw_topology *t, const uint8_t *visible) {
  border_kinds kinds = {0};
  for (uint32_t f = 0; f < t->face_count; f++)
    if (!visible || visible[f]) sort_triangle(t, f, &kinds);
  for (uint32_t v = 0; v < t->vertex_count; v++)
    kinds.inner_vertices += is_inner(t, v) && tw_topology_touches_vertex(t, visible, v);
  for (uint32_t e = 0; e < t->edge_count; e++) {
    if (!tw_topology_touches_edge(t, visible, e)) continue;
    uint32_t ends = is_inner(t, t->edge_vertices[e][0]) + is_inner(t, t->edge_vertices[e][1]);
    kinds.inner_edges += ends == 2;
    kinds.half_edges += ends == 1;
  }
  return kinds;
}

/* The middle of a triangle with one vertex on the border is a strip, of one with two a last one. */
static border_kinds next_kinds(const border_kinds *k) {
  return (border_kinds){
      .inside = 4 * k->inside,
      .one = 2 * k->one,
      .two = k->two,
      .strip = k->one + k->strip,
      .last = k->two + k->middle,
      .inner_vertices = k->inner_vertices + k->inner_edges,
      .inner_edges = 2 * k->inner_edges + 3 * k->inside,
      .half_edges = k->half_edges + 2 * k->one,
  };
}

/* Edges across triangles: three round each that has a middle, one in a strip. */
static uint64_t next_edges(const border_kinds *k) {
  uint64_t across = 3 * (k->inside + k->one + k->two + k->middle) + k->strip;
  return 2 * k->inner_edges + k->half_edges + across;
}

tw_surface_counts tw_loop_open_count(const tw_topology *first, const uint8_t *visible, uint32_t level) {
  uint64_t border_edges = 0;
  for (uint32_t e = 0; e < first->edge_count; e++)
    border_edges +=
        (first->edge_flags[e] & TW_EDGE_BORDER) != 0 && tw_topology_touches_edge(first, visible, e);
  tw_surface_counts counts = tw_count_faces(first, visible);
  border_kinds kinds = sort_all(first, visible);
  /* Stops where numbers near 64 bits, far over the limit. */
  for (uint32_t l = 1; l < level && counts.faces > 0 && counts.corners < UINT64_MAX / 16; l++) {
    /* Every edge off the border has its middle: a triangle that stays behind whole was the middle of one in
     * a mesh that was cut, so that its edges off the border lead to children of the same triangle, which go
     * on. */
    counts.vertices = kinds.inner_vertices + (counts.edges - border_edges);
    counts.edges = next_edges(&kinds);
    border_edges = kinds.one + 2 * kinds.two + kinds.strip + 3 * kinds.middle;
    kinds = next_kinds(&kinds);
    counts.faces = kinds.inside + kinds.one + kinds.two + kinds.strip + kinds.last;
    counts.corners = 3 * counts.faces;
  }
  return counts;
}
