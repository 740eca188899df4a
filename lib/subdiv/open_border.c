/* Cuts a refined mesh back to the faces that an open border leaves, and counts them in closed form. */
#include "open_border.h"

#include <stdlib.h>

static bool on_border(const tw_topology *t, uint32_t corner) {
  return t->vertex_flags[t->corner_vertex[corner]] & TW_VERTEX_BORDER;
}

static bool along_border(const tw_topology *t, uint32_t corner) {
  return t->edge_flags[t->corner_edge[corner]] & TW_EDGE_BORDER;
}

static bool is_loop(const tw_topology *child) {
  return child->face_size == 3;
}

static bool has_parents(const tw_topology *parent, const tw_topology *child, uint32_t face) {
  if (!is_loop(child)) return !on_border(parent, face);
  uint32_t first = face / 4 * 3;
  if (face % 4 < 3) return !on_border(parent, first + face % 4);
  return !along_border(parent, first) && !along_border(parent, first + 1) && !along_border(parent, first + 2);
}

uint32_t tw_open_faces(const tw_topology *parent, const tw_topology *child, tw_arena *arena,
                       uint32_t **faces) {
  *faces = tw_arena_alloc(arena, child->face_count, sizeof **faces);
  uint32_t count = 0;
  for (uint32_t f = 0; *faces && f < child->face_count; f++)
    if (has_parents(parent, child, f)) (*faces)[count++] = f;
  return count;
}

tw_status tw_open_cut(const tw_topology *full, const uint32_t *faces, uint32_t face_count, tw_arena *arena,
                      tw_topology *out, uint32_t **vertices) {
  uint32_t size = full->face_size, *from = tw_alloc(face_count, size * sizeof *from);
  for (uint32_t c = 0; from && c < size * face_count; c++) from[c] = size * faces[c / size] + c % size;
  tw_status status =
      from ? tw_topology_cut(full, face_count, NULL, size * face_count, from, arena, out, vertices)
           : TW_NO_MEMORY;
  tw_free(from);
  if (status != TW_OK) return status;
  tw_topology_sharpen(out, false);
  return full->semi_sum ? tw_topology_sum_semi(out, arena) : TW_OK;
}

tw_surface_counts tw_count_faces(const tw_topology *topology, const uint8_t *visible) {
  const tw_topology *t = topology;
  tw_surface_counts counts = {0, 0, 0, 0};
  for (uint32_t v = 0; v < t->vertex_count; v++) counts.vertices += tw_topology_touches_vertex(t, visible, v);
  if (!visible) return (tw_surface_counts){counts.vertices, t->edge_count, t->face_count, t->corner_count};
  for (uint32_t f = 0; f < t->face_count; f++) {
    if (!visible[f]) continue;
    counts.faces++;
    counts.corners += tw_face_size(t, f);
  }
  for (uint32_t e = 0; e < t->edge_count; e++) counts.edges += tw_topology_touches_edge(t, visible, e);
  return counts;
}

/* Counts of quads by how many of their corners are inner vertices, and of edges by how many of their ends
 * are. A quad whose inner corners are just two opposite ones does not occur: every quad of a refined mesh has
 * a corner whose neighbours lie between it and the border. */
typedef struct border_kinds {
  uint64_t quads[5], edges[3], inner_vertices;
} border_kinds;

static border_kinds sort_all(const tw_topology *t, const uint8_t *visible) {
  border_kinds kinds = {{0}, {0}, 0};
  for (uint32_t q = 0; q < t->face_count; q++) {
    if (visible && !visible[q]) continue;
    int inner = 0;
    for (uint32_t k = 0; k < 4; k++) inner += !on_border(t, 4 * q + k);
    kinds.quads[inner]++;
  }
  for (uint32_t e = 0; e < t->edge_count; e++) {
    if (!tw_topology_touches_edge(t, visible, e)) continue;
    int inner = 0;
    for (int end = 0; end < 2; end++)
      inner += !(t->vertex_flags[t->edge_vertices[e][end]] & TW_VERTEX_BORDER);
    kinds.edges[inner]++;
  }
  for (uint32_t v = 0; v < t->vertex_count; v++)
    kinds.inner_vertices +=
        !(t->vertex_flags[v] & TW_VERTEX_BORDER) && tw_topology_touches_vertex(t, visible, v);
  return kinds;
}

/* The counts after one step. A quad with two inner corners leaves two quads with two; a quad with three
 * leaves two with two and one with three; a quad with one leaves one with one. An edge from the middle of a
 * side to the middle of the quad has an inner end where all child quads around that end remain. */
static border_kinds next_kinds(const border_kinds *k) {
  const uint64_t *quads = k->quads, *edges = k->edges;
  return (border_kinds){{0, quads[1], 2 * (quads[2] + quads[3]), quads[3], 4 * quads[4]},
                        {2 * quads[1] + 2 * quads[2] + 2 * quads[3], edges[1] + quads[2] + 2 * quads[3],
                         2 * edges[2] + 4 * quads[4]},
                        k->inner_vertices + edges[2] + quads[4]};
}

tw_surface_counts tw_open_count(const tw_topology *first, const uint8_t *visible, uint32_t level) {
  tw_surface_counts counts = tw_count_faces(first, visible);
  border_kinds kinds = sort_all(first, visible);
  /* Stops where numbers near 64 bits, far over the limit. */
  for (uint32_t l = 1; l < level && counts.faces > 0 && counts.corners < UINT64_MAX / 16; l++) {
    uint64_t kept = kinds.quads[1] + kinds.quads[2] + kinds.quads[3] + kinds.quads[4];
    counts.vertices = kinds.inner_vertices + kinds.edges[1] + kinds.edges[2] + kept;
    kinds = next_kinds(&kinds);
    counts.edges = kinds.edges[0] + kinds.edges[1] + kinds.edges[2];
    counts.faces = kinds.quads[1] + kinds.quads[2] + kinds.quads[3] + kinds.quads[4];
    counts.corners = 4 * counts.faces;
  }
  return counts;
}

/* ---- counting of triangles ---------------------------------------------------------------------- */

/* Counts of what an open border leaves of a Loop mesh, level by level.
 *
 * A triangle leaves its children at inner vertices, and its middle child unless one of its edges lies on the
 * border. The kinds of these children follow from how many of the triangle's vertices are on the border, so
 * counts by kinds of triangles suffice, and by kinds of edges for the vertices. */

typedef struct triangle_kinds {
  uint64_t inside, one, two; /* triangles with no, one and two vertices on the border, and no edge */
  uint64_t strip;            /* triangles with two, and the edge between them on the border */
  uint64_t middle;           /* with three, and no edge: only the middle child remains */
  uint64_t last;             /* with three, and an edge: no child remains */
  uint64_t inner_vertices;
  uint64_t inner_edges, half_edges; /* edges with two inner ends, with one */
} triangle_kinds;

static bool is_inner(const tw_topology *t, uint32_t vertex) {
  return !(t->vertex_flags[vertex] & TW_VERTEX_BORDER);
}

static void sort_triangle(const tw_topology *t, uint32_t face, triangle_kinds *kinds) {
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

static triangle_kinds sort_triangles(const tw_topology *t, const uint8_t *visible) {
  triangle_kinds kinds = {0};
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

/* The middle child of a triangle with one vertex on the border is a strip, of one with two vertices a last
 * one. */
static triangle_kinds next_triangle_kinds(const triangle_kinds *k) {
  return (triangle_kinds){
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

/* The number of edges of the next level. Edges across triangles: three around each middle child that remains,
 * one in a strip. */
static uint64_t next_edges(const triangle_kinds *k) {
  uint64_t across = 3 * (k->inside + k->one + k->two + k->middle) + k->strip;
  return 2 * k->inner_edges + k->half_edges + across;
}

tw_surface_counts tw_loop_open_count(const tw_topology *first, const uint8_t *visible, uint32_t level) {
  uint64_t border_edges = 0;
  for (uint32_t e = 0; e < first->edge_count; e++)
    border_edges +=
        (first->edge_flags[e] & TW_EDGE_BORDER) != 0 && tw_topology_touches_edge(first, visible, e);
  tw_surface_counts counts = tw_count_faces(first, visible);
  triangle_kinds kinds = sort_triangles(first, visible);
  /* Stops where numbers near 64 bits, far over the limit. */
  for (uint32_t l = 1; l < level && counts.faces > 0 && counts.corners < UINT64_MAX / 16; l++) {
    /* Every edge off the border has a middle that remains. A triangle of which no child remains was a middle
     * child in the level above, which was cut; across its edges off the border lie children of the same
     * triangle, which do leave children. */
    counts.vertices = kinds.inner_vertices + (counts.edges - border_edges);
    counts.edges = next_edges(&kinds);
    border_edges = kinds.one + 2 * kinds.two + kinds.strip + 3 * kinds.middle;
    kinds = next_triangle_kinds(&kinds);
    counts.faces = kinds.inside + kinds.one + kinds.two + kinds.strip + kinds.last;
    counts.corners = 3 * counts.faces;
  }
  return counts;
}
