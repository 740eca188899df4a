/* Builds half-edges from polygons: edges are matched among those of their lower vertex, in linear time where
 * vertices have few edges. */
#include "topology.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "sorted.h"
#include "union_find.h"

/* ---- corners by vertex ----------------------------------------------------------------------- */

/* Turns counts into run starts, in place. offsets: [count + 1], the last one 0 before; afterwards
 * offsets[count] is the total. */
static void counts_to_offsets(uint32_t *offsets, uint32_t count) {
  uint32_t sum = 0;
  for (uint32_t i = 0; i <= count; i++) {
    uint32_t run = offsets[i];
    offsets[i] = sum;
    sum += run;
  }
}

/* Sorts the corners by their vertices. fan_offsets: zeros before. Returns the most corners of a vertex. */
static uint32_t file_corners(tw_topology *t) {
  uint32_t *offsets = t->fan_offsets, *corners = t->fan_corners, most = 0;
  const uint32_t *vertices = t->corner_vertex, count = t->corner_count;
  for (uint32_t c = 0; c < count; c++) offsets[vertices[c]]++;
  for (uint32_t v = 0; v < t->vertex_count; v++) most = offsets[v] > most ? offsets[v] : most;
  /* Counting sort: while the starts serve as cursors they move to the next run's start, so that afterwards
   * they are shifted by one place. */
  counts_to_offsets(offsets, t->vertex_count);
  for (uint32_t c = 0; c < count; c++) corners[offsets[vertices[c]]++] = c;
  memmove(offsets + 1, offsets, t->vertex_count * sizeof(uint32_t));
  offsets[0] = 0;
  return most;
}

/* Fills corner_face where faces differ in size. False without memory. */
static bool map_corners(tw_topology *t, tw_arena *arena) {
  if (!t->face_offsets) return true;
  t->corner_face = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  if (!t->corner_face) return false;
  for (uint32_t face = 0; face < t->face_count; face++)
    for (uint32_t c = t->face_offsets[face]; c < t->face_offsets[face + 1]; c++) t->corner_face[c] = face;
  return true;
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* A corner not yet matched to an edge. The low 32 bits hold the corner; the high 32 bits hold the key of its
 * edge among those of a vertex: the other vertex, or the known edge. */
typedef uint64_t half_edge;

static uint32_t key_of(half_edge half) {
  return (uint32_t)(half >> 32);
}

/* By key, then corner. */
static int compare_half_edges(const void *left, const void *right) {
  half_edge a = *(const half_edge *)left, b = *(const half_edge *)right;
  return a < b ? -1 : a > b;
}

/* Lists the half-edges of which a vertex is the lower end, sorted. known_edges: as in
 * build_parted, or NULL. halves: has room for one more than two for each of the vertex's corners.
 */
static uint32_t list_half_edges(const tw_topology *t, const uint32_t *known_edges, uint32_t vertex,
                                half_edge *halves) {
  const uint32_t *corners = t->fan_corners + t->fan_offsets[vertex];
  uint32_t corner_count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex], count = 0;
  for (uint32_t i = 0; i < corner_count; i++) {
    uint32_t corner = corners[i], back = tw_corner_previous(t, corner);
    uint32_t to = t->corner_vertex[tw_corner_next(t, corner)], from = t->corner_vertex[back];
    /* Which end is lower follows no pattern: without branches, nothing is mispredicted. */
    halves[count] = (uint64_t)(known_edges ? known_edges[corner] : to) << 32 | corner;
    count += to > vertex;
    halves[count] = (uint64_t)(known_edges ? known_edges[back] : from) << 32 | back;
    count += from > vertex;
  }
  tw_small_sort(halves, count, sizeof *halves, compare_half_edges);
  return count;
}

static void join_edge(tw_topology *t, uint32_t edge, uint32_t corner) {
  uint32_t first = t->edge_corner[edge];
  bool already_paired = t->sibling[first] != first;
  bool same_direction = t->corner_vertex[first] == t->corner_vertex[corner];
  uint8_t flags = (uint8_t)(t->edge_flags[edge] & ~TW_EDGE_BORDER);
  t->edge_flags[edge] = already_paired || same_direction ? flags | TW_EDGE_NONMANIFOLD : flags;
  t->sibling[corner] = t->sibling[first];
  t->sibling[first] = corner;
}

/* Joins the half-edges of one vertex that have the same key. A face that runs along an edge twice gets two
 * edges there, as in OpenSubdiv. Unless edges are known, they come out sorted by their lower and then their
 * upper vertex, which tw_topology_find_edge relies on. Returns how many edges there are then. */
static uint32_t join_half_edges(tw_topology *t, const half_edge *halves, uint32_t count,
                                uint32_t edge_count) {
  for (uint32_t i = 0; i < count; i++) {
    uint32_t corner = (uint32_t)halves[i];
    bool same_edge = i > 0 && key_of(halves[i - 1]) == key_of(halves[i]);
    if (same_edge && tw_corner_face(t, (uint32_t)halves[i - 1]) != tw_corner_face(t, corner)) {
      join_edge(t, edge_count - 1, corner);
    } else {
      t->edge_corner[edge_count] = corner;
      t->edge_flags[edge_count++] = TW_EDGE_BORDER;
      t->sibling[corner] = corner;
    }
    if (t->corner_edge) t->corner_edge[corner] = edge_count - 1;
  }
  return edge_count;
}

/* Makes edges and siblings of corners by vertex, and corner_edge where it is allocated. halves: as of
 * list_half_edges. */
static tw_status pair(tw_topology *topology, const uint32_t *known_edges, half_edge *halves,
                      tw_arena *arena) {
  tw_topology t = *topology; /* of its own, so that writing to its arrays does not seem to change it */
  t.sibling = tw_arena_alloc_raw(arena, t.corner_count, sizeof(uint32_t));
  /* There is at most one edge for each corner. The unused tails cost address space only. */
  t.edge_corner = tw_arena_alloc_raw(arena, t.corner_count, sizeof(uint32_t));
  t.edge_flags = tw_arena_alloc_raw(arena, t.corner_count, 1);
  if (!t.sibling || !t.edge_corner || !t.edge_flags) return TW_NO_MEMORY;
  uint32_t edge_count = 0;
  for (uint32_t v = 0; v < t.vertex_count; v++)
    edge_count = join_half_edges(&t, halves, list_half_edges(&t, known_edges, v, halves), edge_count);
  t.edge_count = edge_count;
  *topology = t;
  return TW_OK;
}

/* Fills edge_vertices, counts the edges of each vertex in ring_offsets, and gives it the flags of its edges,
 * which mean the same of vertices. */
static void name_edges(tw_topology *topology) {
  static_assert((int)TW_VERTEX_BORDER == (int)TW_EDGE_BORDER, "flags of both");
  static_assert((int)TW_VERTEX_NONMANIFOLD == (int)TW_EDGE_NONMANIFOLD, "flags of both");
  const tw_topology t = *topology;
  for (uint32_t e = 0; e < t.edge_count; e++) {
    uint32_t start = tw_edge_start(&t, e), stop = tw_edge_stop(&t, e);
    uint8_t flags = t.edge_flags[e];
    t.edge_vertices[e][0] = start;
    t.edge_vertices[e][1] = stop;
    t.ring_offsets[start]++;
    t.ring_offsets[stop]++;
    t.vertex_flags[start] |= flags;
    t.vertex_flags[stop] |= flags;
  }
}

/* ---- fans ------------------------------------------------------------------------------------ */

static bool allocate_corners(tw_topology *t, tw_arena *arena) {
  t->fan_offsets = tw_arena_alloc(arena, (size_t)t->vertex_count + 2, sizeof(uint32_t));
  t->fan_corners = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  return t->fan_offsets && t->fan_corners;
}

static bool allocate_rings(tw_topology *t, tw_arena *arena) {
  t->ring_offsets = tw_arena_alloc(arena, (size_t)t->vertex_count + 2, sizeof(uint32_t));
  t->ring_edges = tw_arena_alloc_raw(arena, t->edge_count, 2 * sizeof(uint32_t));
  t->vertex_flags = tw_arena_alloc(arena, t->vertex_count, 1);
  return t->ring_offsets && t->ring_edges && t->vertex_flags;
}

tw_status tw_topology_allocate_fans(tw_topology *topology, tw_arena *arena) {
  bool complete = allocate_corners(topology, arena) && allocate_rings(topology, arena);
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Walks round a vertex, counter-clockwise. Returns false when its faces do not form one fan or a face has the
 * vertex twice. Its flags are those of its edges. walked: [corners] receives them. */
static bool walk_fan(const tw_topology *t, uint32_t vertex, uint32_t *walked) {
  const uint32_t *corners = t->fan_corners + t->fan_offsets[vertex];
  uint32_t corner_count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  uint32_t edge_count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex];
  bool border = t->vertex_flags[vertex] & TW_VERTEX_BORDER;
  if (corner_count == 0 || edge_count != corner_count + border ||
      t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD)
    return false;
  for (uint32_t i = 1; i < corner_count; i++) /* in the order of their faces */
    if (tw_corner_face(t, corners[i]) == tw_corner_face(t, corners[i - 1])) return false;
  uint32_t start = corners[0];
  for (uint32_t i = 0; border && i < corner_count; i++)
    if (t->sibling[corners[i]] == corners[i]) start = corners[i];
  uint32_t corner = start, steps = 0;
  for (;;) {
    walked[steps++] = corner;
    uint32_t back = tw_corner_previous(t, corner), next = t->sibling[back];
    if (next == back || next == start) return steps == corner_count;
    if (steps == corner_count) return false;
    corner = next;
  }
}

/* Fills the ring of a vertex whose faces form no fan: its edges, ascending. edges: scratch, two for each of
 * its corners. */
static void list_edges(const tw_topology *t, uint32_t vertex, uint32_t *edges) {
  uint32_t *ring = t->ring_edges + t->ring_offsets[vertex], count = 0;
  for (uint32_t i = t->fan_offsets[vertex]; i < t->fan_offsets[vertex + 1]; i++) {
    edges[count++] = t->corner_edge[t->fan_corners[i]];
    edges[count++] = t->corner_edge[tw_corner_previous(t, t->fan_corners[i])];
  }
  tw_small_sort(edges, count, sizeof *edges, tw_compare_uint32);
  for (uint32_t i = 0; i < count; i++)
    if (i == 0 || edges[i] != edges[i - 1]) *ring++ = edges[i];
}

/* Orders the fans, fills the rings and completes the vertex flags. ring_offsets: how many edges each vertex
 * has, before. scratch: two for each corner of any vertex. */
static void link_fans(tw_topology *topology, uint32_t *scratch) {
  const tw_topology t = *topology;
  counts_to_offsets(t.ring_offsets, t.vertex_count);
  for (uint32_t v = 0; v < t.vertex_count; v++) {
    if (!walk_fan(&t, v, scratch)) {
      t.vertex_flags[v] |= TW_VERTEX_NONMANIFOLD;
      list_edges(&t, v, scratch);
      continue;
    }
    uint32_t *corners = t.fan_corners + t.fan_offsets[v], *edges = t.ring_edges + t.ring_offsets[v];
    uint32_t count = t.fan_offsets[v + 1] - t.fan_offsets[v];
    for (uint32_t i = 0; i < count; i++) {
      corners[i] = scratch[i];
      edges[i] = t.corner_edge[scratch[i]];
    }
    if (t.vertex_flags[v] & TW_VERTEX_BORDER)
      edges[count] = t.corner_edge[tw_corner_previous(&t, scratch[count - 1])];
  }
}

/* ---- building -------------------------------------------------------------------------------- */

/* Makes edges and fans of corners by vertex. halves: as of pair. */
static tw_status link(tw_topology *t, const uint32_t *known_edges, half_edge *halves, tw_arena *arena) {
  t->corner_edge = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  tw_status status = t->corner_edge ? pair(t, known_edges, halves, arena) : TW_NO_MEMORY;
  if (status != TW_OK) return status;
  t->edge_vertices = tw_arena_alloc_raw(arena, t->edge_count, sizeof *t->edge_vertices);
  if (!t->edge_vertices || !allocate_rings(t, arena)) return TW_NO_MEMORY;
  name_edges(t);
  link_fans(t, (uint32_t *)halves);
  return TW_OK;
}

static void start_topology(tw_topology *t, uint32_t vertex_count, uint32_t face_count,
                           const uint32_t *face_offsets, uint32_t corner_count, const uint32_t *corners) {
  memset(t, 0, sizeof *t);
  t->vertex_count = vertex_count;
  t->face_count = face_count;
  t->corner_count = corner_count;
  t->face_offsets = face_offsets;
  if (!face_offsets) t->face_size = corner_count == 3 * (uint64_t)face_count ? 3 : 4;
  t->corner_vertex = (uint32_t *)corners; /* never written through */
}

static tw_status build(tw_topology *t, const uint32_t *known_edges, tw_arena *arena) {
  if (!allocate_corners(t, arena) || !map_corners(t, arena)) return TW_NO_MEMORY;
  half_edge *halves = tw_alloc(2 * (size_t)file_corners(t) + 1, sizeof *halves);
  tw_status status = halves ? link(t, known_edges, halves, arena) : TW_NO_MEMORY;
  tw_free(halves);
  return status;
}

tw_status tw_topology_pair(tw_topology *topology, tw_arena *arena, uint32_t vertex_count, uint32_t face_count,
                           const uint32_t *face_offsets, uint32_t corner_count, const uint32_t *corners) {
  tw_topology *t = topology;
  start_topology(t, vertex_count, face_count, face_offsets, corner_count, corners);
  t->fan_offsets = tw_alloc_zero((size_t)vertex_count + 1, sizeof(uint32_t));
  t->fan_corners = tw_alloc(corner_count, sizeof(uint32_t));
  bool has_memory = map_corners(t, arena) && t->fan_offsets && t->fan_corners;
  half_edge *halves = has_memory ? tw_alloc(2 * (size_t)file_corners(t) + 1, sizeof *halves) : NULL;
  tw_status status = halves ? pair(t, NULL, halves, arena) : TW_NO_MEMORY;
  tw_free(halves);
  tw_free(t->fan_offsets);
  tw_free(t->fan_corners);
  t->fan_offsets = t->fan_corners = NULL;
  return status;
}

tw_status tw_topology_build(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                            uint32_t face_count, const uint32_t *face_offsets, uint32_t corner_count,
                            const uint32_t *corners) {
  start_topology(topology, vertex_count, face_count, face_offsets, corner_count, corners);
  return build(topology, NULL, arena);
}

/* As tw_topology_build, for triangles or quads whose edges are already numbered. known_edges: [face_size *
 * face_count] the edge at each corner. Edges with different numbers stay apart even where they have the same
 * ends, as the inner edges of two triangles over the same points do. */
static tw_status build_parted(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                              uint32_t face_count, uint32_t face_size, const uint32_t *corners,
                              const uint32_t *known_edges) {
  start_topology(topology, vertex_count, face_count, NULL, face_size * face_count, corners);
  return build(topology, known_edges, arena);
}

tw_status tw_topology_soften(tw_topology *topology, tw_arena *arena) {
  topology->edge_sharpness = tw_arena_alloc(arena, topology->edge_count, sizeof(float));
  topology->vertex_sharpness = tw_arena_alloc(arena, topology->vertex_count, sizeof(float));
  return topology->edge_sharpness && topology->vertex_sharpness ? TW_OK : TW_NO_MEMORY;
}

/* ---- cutting --------------------------------------------------------------------------------- */

/* Renumbers the vertices of some corners, in the order of their old numbers. names: [full->vertex_count],
 * zeros before; afterwards 1 + the new number of each vertex that is used. *old: [*count] the old numbers. */
static tw_status rename_vertices(const tw_topology *full, uint32_t corner_count, const uint32_t *from,
                                 tw_arena *arena, uint32_t *names, uint32_t *count, uint32_t **old) {
  for (uint32_t c = 0; c < corner_count; c++) names[full->corner_vertex[from[c]]] = 1;
  *count = 0;
  for (uint32_t v = 0; v < full->vertex_count; v++)
    if (names[v]) names[v] = ++*count;
  *old = tw_arena_alloc_raw(arena, *count, sizeof **old);
  if (!*old) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < full->vertex_count; v++)
    if (names[v]) (*old)[names[v] - 1] = v;
  return TW_OK;
}

tw_status tw_topology_cut(const tw_topology *full, uint32_t face_count, const uint32_t *face_offsets,
                          uint32_t corner_count, const uint32_t *from, tw_arena *arena, tw_topology *out,
                          uint32_t **vertices) {
  uint32_t *names = tw_alloc_zero(full->vertex_count, sizeof *names),
           *edges = tw_alloc(corner_count, sizeof *edges),
           *corners = tw_arena_alloc_raw(arena, corner_count, sizeof *corners), count;
  tw_status status = names && edges && corners
                         ? rename_vertices(full, corner_count, from, arena, names, &count, vertices)
                         : TW_NO_MEMORY;
  for (uint32_t c = 0; status == TW_OK && c < corner_count; c++) {
    corners[c] = names[full->corner_vertex[from[c]]] - 1;
    edges[c] = full->corner_edge[from[c]];
  }
  if (status == TW_OK)
    status = face_offsets
                 ? tw_topology_build(out, arena, count, face_count, face_offsets, corner_count, corners)
                 : build_parted(out, arena, count, face_count, full->face_size, corners, edges);
  if (status == TW_OK) status = tw_topology_soften(out, arena);
  for (uint32_t e = 0; status == TW_OK && e < out->edge_count; e++)
    out->edge_sharpness[e] = full->edge_sharpness[edges[out->edge_corner[e]]];
  for (uint32_t v = 0; status == TW_OK && v < count; v++)
    out->vertex_sharpness[v] = full->vertex_sharpness[(*vertices)[v]];
  tw_free(names);
  tw_free(edges);
  return status;
}

/* ---- sharpness ------------------------------------------------------------------------------- */

/* Whether a vertex lies on a plain non-manifold crease: exactly two non-manifold edges, no border, and more
 * faces than edges. */
static bool on_nonmanifold_crease(const tw_topology *t, uint32_t vertex) {
  uint32_t nonmanifold = 0, border = 0;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    uint8_t flags = t->edge_flags[t->ring_edges[i]];
    nonmanifold += (flags & TW_EDGE_NONMANIFOLD) != 0;
    border += (flags & TW_EDGE_BORDER) != 0;
  }
  uint32_t faces = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  uint32_t edges = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex];
  return nonmanifold == 2 && border == 0 && faces > edges;
}

void tw_topology_sharpen(tw_topology *topology, bool corners) {
  tw_topology *t = topology;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (t->edge_flags[e]) t->edge_sharpness[e] = TW_SHARPNESS_INFINITE;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    uint32_t faces = t->fan_offsets[v + 1] - t->fan_offsets[v];
    uint32_t edges = t->ring_offsets[v + 1] - t->ring_offsets[v];
    bool corner = corners && faces == 1 && edges == 2;
    bool pinched = (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD) && !on_nonmanifold_crease(t, v);
    if (corner || pinched) t->vertex_sharpness[v] = TW_SHARPNESS_INFINITE;
  }
}

tw_status tw_topology_sum_semi(tw_topology *topology, tw_arena *arena) {
  tw_topology *t = topology;
  t->semi_sum = tw_arena_alloc(arena, t->vertex_count, sizeof(float));
  t->semi_count = tw_arena_alloc(arena, t->vertex_count, sizeof(uint32_t));
  if (!t->semi_sum || !t->semi_count) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    for (uint32_t i = t->ring_offsets[v]; i < t->ring_offsets[v + 1]; i++) {
      float sharpness = t->edge_sharpness[t->ring_edges[i]];
      if (!tw_is_semi_sharp(sharpness)) continue;
      t->semi_sum[v] += sharpness;
      t->semi_count[v]++;
    }
  return TW_OK;
}

tw_status tw_topology_copy_semi(tw_topology *topology, const tw_topology *from, tw_arena *arena) {
  tw_topology *t = topology;
  t->semi_sum = tw_arena_alloc(arena, t->vertex_count, sizeof(float));
  t->semi_count = tw_arena_alloc(arena, t->vertex_count, sizeof(uint32_t));
  if (!t->semi_sum || !t->semi_count) return TW_NO_MEMORY;
  for (uint32_t c = 0; c < t->corner_count; c++) {
    t->semi_sum[t->corner_vertex[c]] = from->semi_sum[from->corner_vertex[c]];
    t->semi_count[t->corner_vertex[c]] = from->semi_count[from->corner_vertex[c]];
  }
  return TW_OK;
}

/* -1, 0 or 1 as the edge comes before, at or after the vertex pair. */
static int compare_edge(const tw_topology *t, uint32_t edge, uint32_t lower, uint32_t upper) {
  uint32_t a = tw_edge_start(t, edge), b = tw_edge_stop(t, edge), low = a < b ? a : b, high = a < b ? b : a;
  if (low != lower) return low < lower ? -1 : 1;
  return high < upper ? -1 : high > upper;
}

uint32_t tw_topology_find_edge(const tw_topology *topology, uint32_t a, uint32_t b) {
  uint32_t lower = a < b ? a : b, upper = a < b ? b : a;
  uint32_t begin = 0, end = topology->edge_count;
  while (begin < end) {
    uint32_t middle = begin + (end - begin) / 2;
    int order = compare_edge(topology, middle, lower, upper);
    if (order == 0) return middle;
    if (order < 0)
      begin = middle + 1;
    else
      end = middle;
  }
  return UINT32_MAX;
}

void tw_topology_find_pieces(const tw_topology *topology, uint32_t *pieces) {
  tw_union_find_init(pieces, topology->vertex_count);
  for (uint32_t e = 0; e < topology->edge_count; e++)
    tw_union_find_join(pieces, tw_edge_start(topology, e), tw_edge_stop(topology, e));
}

bool tw_topology_touches_vertex(const tw_topology *topology, const uint8_t *faces, uint32_t vertex) {
  const tw_topology *t = topology;
  uint32_t i = t->fan_offsets[vertex], end = t->fan_offsets[vertex + 1];
  while (faces && i < end && !faces[tw_corner_face(t, t->fan_corners[i])]) i++;
  return i < end;
}

bool tw_topology_touches_edge(const tw_topology *topology, const uint8_t *faces, uint32_t edge) {
  const tw_topology *t = topology;
  uint32_t first = t->edge_corner[edge], corner = first;
  do {
    if (!faces || faces[tw_corner_face(t, corner)]) return true;
    corner = t->sibling[corner];
  } while (corner != first);
  return false;
}

bool tw_topology_parts_normals(const tw_topology *topology) {
  const tw_topology *t = topology;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (tw_is_infinite(t->edge_sharpness[e]) && t->edge_flags[e] != TW_EDGE_BORDER) return true;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD) return true;
  return false;
}
