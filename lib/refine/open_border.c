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

static bool is_near(const tw_topology *parent, const tw_topology *child, const uint8_t *near, uint32_t face) {
  const uint32_t *vertices = parent->corner_vertex;
  if (!is_loop(child)) return near[vertices[face]];
  uint32_t first = face / 4 * 3;
  if (face % 4 < 3) return near[vertices[first + face % 4]];
  return near[vertices[first]] || near[vertices[first + 1]] || near[vertices[first + 2]];
}

uint32_t tw_open_faces(const tw_topology *parent, const tw_topology *child, const uint8_t *near,
                       tw_arena *arena, uint32_t **faces) {
  *faces = tw_arena_alloc(arena, child->face_count, sizeof **faces);
  uint32_t count = 0;
  for (uint32_t f = 0; *faces && f < child->face_count; f++)
    if (has_parents(parent, child, f) && (!near || is_near(parent, child, near, f))) (*faces)[count++] = f;
  return count;
}

bool tw_open_is_rim(const tw_topology *topology, uint32_t face) {
  uint32_t begin = tw_face_begin(topology, face), end = begin + tw_face_size(topology, face);
  for (uint32_t c = begin; c < end; c++)
    if (on_border(topology, c)) return true;
  return false;
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

static bool is_inner(const tw_topology *t, uint32_t vertex) {
  return !(t->vertex_flags[vertex] & TW_VERTEX_BORDER);
}

static uint32_t inner_ends(const tw_topology *t, uint32_t edge) {
  return is_inner(t, t->edge_vertices[edge][0]) + is_inner(t, t->edge_vertices[edge][1]);
}

static bool is_visible(const uint8_t *visible, uint32_t face) {
  return !visible || visible[face];
}

/* The inner vertices of the cage that visible faces touch; each has a child. */
static uint64_t count_inner(const tw_topology *t, const uint8_t *visible) {
  uint64_t count = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    count += is_inner(t, v) && tw_topology_touches_vertex(t, visible, v);
  return count;
}

/* ---- counting of quads ----------------------------------------------------------------------- */

/* Counts of quads by how many of their corners are inner vertices, and of edges by how many of their ends
 * are. A quad whose inner corners are just two opposite ones does not occur: every quad of a refined mesh has
 * a corner whose neighbours lie between it and the border. */
typedef struct border_kinds {
  uint64_t quads[5], edges[3], inner_vertices;
} border_kinds;

static uint64_t count_quads(const border_kinds *k) {
  return k->quads[1] + k->quads[2] + k->quads[3] + k->quads[4];
}

static uint64_t count_edges(const border_kinds *k) {
  return k->edges[0] + k->edges[1] + k->edges[2];
}

/* Sorts what level 1 has of a face: a quad at each inner corner, and an edge from the middle of each side
 * with an inner end to the face point. The face point is an inner vertex where all corners are, the middle of
 * a side where both ends are. Returns whether the face has a face point. */
static bool sort_face(const tw_topology *t, uint32_t face, border_kinds *kinds) {
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face), inner = 0;
  for (uint32_t c = begin; c < begin + size; c++) inner += !on_border(t, c);
  bool is_whole = inner == size;
  for (uint32_t i = 0; i < size; i++) {
    bool before = !on_border(t, begin + (i ? i : size) - 1), own = !on_border(t, begin + i),
         after = !on_border(t, begin + (i + 1 < size ? i + 1 : 0));
    if (own) kinds->quads[1 + before + after + is_whole]++;
    if (own || after) kinds->edges[(own && after) + is_whole]++;
  }
  kinds->inner_vertices += is_whole;
  return inner > 0;
}

/* Sorts what level 1 has of the visible faces of a cage. *vertices: their number at level 1. */
static border_kinds sort_cage(const tw_topology *t, const uint8_t *visible, uint64_t *vertices) {
  border_kinds kinds = {{0}, {0}, count_inner(t, visible)};
  *vertices = kinds.inner_vertices;
  for (uint32_t f = 0; f < t->face_count; f++)
    if (is_visible(visible, f)) *vertices += sort_face(t, f, &kinds);
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t inner = inner_ends(t, e);
    if (inner == 0 || !tw_topology_touches_edge(t, visible, e)) continue;
    *vertices += 1;
    kinds.edges[inner] += inner; /* the halves at inner ends: the middle is inner where both ends are */
    kinds.inner_vertices += inner == 2;
  }
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

tw_surface_counts tw_open_count(const tw_topology *cage, const uint8_t *visible, uint32_t level) {
  uint64_t vertices;
  border_kinds kinds = sort_cage(cage, visible, &vertices);
  /* Stops where numbers near 64 bits, far over the limit. */
  for (uint32_t l = 1; l < level && count_quads(&kinds) < UINT64_MAX / 64; l++) {
    vertices = kinds.inner_vertices + kinds.edges[1] + kinds.edges[2] + count_quads(&kinds);
    kinds = next_kinds(&kinds);
  }
  uint64_t faces = count_quads(&kinds);
  return (tw_surface_counts){vertices, count_edges(&kinds), faces, 4 * faces};
}

/* ---- counting of triangles ------------------------------------------------------------------- */

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

/* What level 1 has of the visible faces. border_edges: of the edges. */
typedef struct level_one {
  triangle_kinds kinds;
  uint64_t vertices, edges, border_edges;
} level_one;

/* Whether the middle child of a triangle remains at level 1. */
static bool has_middle(const tw_topology *t, uint32_t face) {
  return !along_border(t, 3 * face) && !along_border(t, 3 * face + 1) && !along_border(t, 3 * face + 2);
}

/* Whether the middle of an edge is an inner vertex of level 1: all children around it remain. */
static bool has_inner_middle(const tw_topology *t, uint32_t edge) {
  if (inner_ends(t, edge) < 2) return false;
  uint32_t first = t->edge_corner[edge], corner = first;
  do {
    if (!has_middle(t, corner / 3)) return false;
    corner = t->sibling[corner];
  } while (corner != first);
  return true;
}

/* Whether level 1 has the middle of an edge in a visible face. */
static bool has_visible_middle(const tw_topology *t, const uint8_t *visible, uint32_t edge) {
  bool has_ends = inner_ends(t, edge) > 0;
  uint32_t first = t->edge_corner[edge], corner = first;
  do {
    if (is_visible(visible, corner / 3) && (has_ends || has_middle(t, corner / 3))) return true;
    corner = t->sibling[corner];
  } while (corner != first);
  return false;
}

/* Adds a triangle with so many vertices and edges on the border. */
static void add_triangle(uint32_t vertices, uint32_t edges, triangle_kinds *kinds) {
  if (vertices == 3)
    *(edges ? &kinds->last : &kinds->middle) += 1;
  else if (vertices == 2)
    *(edges ? &kinds->strip : &kinds->two) += 1;
  else
    *(vertices ? &kinds->one : &kinds->inside) += 1;
}

static void add_edge(uint32_t inner, level_one *out) {
  out->edges++;
  out->kinds.inner_edges += inner == 2;
  out->kinds.half_edges += inner == 1;
}

/* Adds what level 1 has of a triangle: the children, and the edges between the middle one and those at the
 * corners. */
static void add_children(const tw_topology *t, uint32_t face, level_one *out) {
  bool middle = has_middle(t, face), inner[3], at[3]; /* inner: middles of the sides; at: corners */
  for (uint32_t i = 0; i < 3; i++) {
    inner[i] = has_inner_middle(t, t->corner_edge[3 * face + i]);
    at[i] = !on_border(t, 3 * face + i);
  }
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t before = i ? i - 1 : 2;
    if (at[i]) add_triangle(2u - inner[i] - inner[before], !middle, &out->kinds);
    if (at[i] || middle) add_edge((uint32_t)inner[i] + inner[before], out);
    out->border_edges += at[i] != middle;
  }
  if (middle) add_triangle(3u - inner[0] - inner[1] - inner[2], 3u - at[0] - at[1] - at[2], &out->kinds);
}

static level_one sort_triangles(const tw_topology *t, const uint8_t *visible) {
  level_one out = {.vertices = count_inner(t, visible)};
  out.kinds.inner_vertices = out.vertices;
  for (uint32_t f = 0; f < t->face_count; f++)
    if (is_visible(visible, f)) add_children(t, f, &out);
  for (uint32_t e = 0; e < t->edge_count; e++) {
    out.vertices += has_visible_middle(t, visible, e);
    if (!tw_topology_touches_edge(t, visible, e)) continue;
    uint32_t inner = has_inner_middle(t, e);
    for (uint32_t end = 0; end < inner_ends(t, e); end++) add_edge(1 + inner, &out);
    out.kinds.inner_vertices += inner;
  }
  return out;
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

static uint64_t count_triangles(const triangle_kinds *k) {
  return k->inside + k->one + k->two + k->strip + k->middle + k->last;
}

tw_surface_counts tw_loop_open_count(const tw_topology *cage, const uint8_t *visible, uint32_t level) {
  const level_one first = sort_triangles(cage, visible);
  triangle_kinds kinds = first.kinds;
  uint64_t vertices = first.vertices, edges = first.edges, border_edges = first.border_edges;
  /* Stops where numbers near 64 bits, far over the limit. */
  for (uint32_t l = 1; l < level && count_triangles(&kinds) < UINT64_MAX / 64; l++) {
    /* Every edge off the border has a middle that remains. A triangle of which no child remains was a middle
     * child in the level above, which was cut; across its edges off the border lie children of the same
     * triangle, which do leave children. */
    vertices = kinds.inner_vertices + (edges - border_edges);
    edges = next_edges(&kinds);
    border_edges = kinds.one + 2 * kinds.two + kinds.strip + 3 * kinds.middle;
    kinds = next_triangle_kinds(&kinds);
  }
  uint64_t faces = count_triangles(&kinds);
  return (tw_surface_counts){vertices, edges, faces, 3 * faces};
}
