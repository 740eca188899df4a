/* Builds half-edges from polygons: edges are matched in buckets by their lower vertex, in linear time where
 * vertices have few edges. */
#include "topology.h"

#include <stdlib.h>
#include <string.h>

#include "sorted.h"
#include "union_find.h"

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

static void join_edge(tw_topology *t, uint32_t edge, uint32_t corner, uint32_t from) {
  uint32_t first = t->edge_corner[edge];
  bool already_paired = t->sibling[first] != first;
  bool same_direction = t->corner_vertex[first] == from;
  if (already_paired || same_direction) t->edge_flags[edge] |= TW_EDGE_NONMANIFOLD;
  t->edge_flags[edge] &= (uint8_t)~TW_EDGE_BORDER;
  t->sibling[corner] = t->sibling[first];
  t->sibling[first] = corner;
}

static void start_edge(tw_topology *t, uint32_t corner) {
  uint32_t edge = t->edge_count++;
  t->edge_corner[edge] = corner;
  t->edge_flags[edge] = TW_EDGE_BORDER;
  t->sibling[corner] = corner;
}

static uint32_t following_vertex(const tw_topology *t, uint32_t begin, uint32_t end, uint32_t corner) {
  return t->corner_vertex[corner + 1 == end ? begin : corner + 1];
}

/* A corner not yet matched to an edge, filed under the lower of its half-edge's two vertices. The low 32 bits
 * hold the corner; the high 32 bits hold the key of its edge within the bucket: the upper vertex, or the
 * known edge. */
typedef uint64_t half_edge;

static uint32_t key_of(half_edge half) {
  return (uint32_t)(half >> 32);
}

/* Files every corner under its half-edge's lower vertex. known_edges: as in tw_topology_build_parted, or
 * NULL. buckets: [vertex_count + 1], zeros before; afterwards the starts of the runs in `halves`. */
static void file_half_edges(const tw_topology *t, const uint32_t *known_edges, uint32_t *buckets,
                            half_edge *halves) {
  for (int pass = 0; pass < 2; pass++) {
    for (uint32_t face = 0; face < t->face_count; face++) {
      uint32_t begin = tw_face_begin(t, face), end = begin + tw_face_size(t, face);
      for (uint32_t corner = begin; corner < end; corner++) {
        uint32_t a = t->corner_vertex[corner], b = following_vertex(t, begin, end, corner);
        uint32_t lower = a < b ? a : b, upper = a < b ? b : a;
        if (pass == 0)
          buckets[lower + 1]++;
        else
          halves[buckets[lower]++] = (uint64_t)(known_edges ? known_edges[corner] : upper) << 32 | corner;
      }
    }
    if (pass == 0)
      for (uint32_t v = 0; v < t->vertex_count; v++) buckets[v + 1] += buckets[v];
  }
  for (uint32_t v = t->vertex_count; v > 0; v--) buckets[v] = buckets[v - 1];
  buckets[0] = 0;
}

/* By key, then corner. */
static int compare_half_edges(const void *left, const void *right) {
  half_edge a = *(const half_edge *)left, b = *(const half_edge *)right;
  return a < b ? -1 : a > b;
}

/* Joins the half-edges of one bucket that have the same key: the same upper vertex or known edge. A face that
 * runs along an edge twice gets two edges there, as in OpenSubdiv. Unless edges are known, they come out
 * sorted by their lower and then their upper vertex, which tw_topology_find_edge relies on. */
static void join_bucket(tw_topology *t, half_edge *halves, uint32_t count) {
  tw_small_sort(halves, count, sizeof *halves, compare_half_edges);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t corner = (uint32_t)halves[i];
    bool same_edge = i > 0 && key_of(halves[i - 1]) == key_of(halves[i]);
    if (same_edge && tw_corner_face(t, (uint32_t)halves[i - 1]) != tw_corner_face(t, corner))
      join_edge(t, t->edge_count - 1, corner, t->corner_vertex[corner]);
    else
      start_edge(t, corner);
  }
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

/* Puts the corners and edges of one vertex in counter-clockwise order. False, with the lists as before, when
 * its faces do not form one fan or a face has the vertex twice. */
static bool order_fan(tw_topology *t, uint32_t vertex) {
  uint32_t *corners = t->fan_corners + t->fan_offsets[vertex];
  uint32_t *edges = t->ring_edges + t->ring_offsets[vertex];
  uint32_t corner_count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  uint32_t edge_count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex];
  if (corner_count == 0 || edge_count - corner_count > 1) return false;
  for (uint32_t i = 1; i < corner_count; i++) /* still in the order of their faces */
    if (tw_corner_face(t, corners[i]) == tw_corner_face(t, corners[i - 1])) return false;
  uint32_t start = corners[0];
  bool border = false;
  for (uint32_t i = 0; i < edge_count; i++) {
    uint8_t flags = t->edge_flags[edges[i]];
    if (flags & TW_EDGE_NONMANIFOLD) return false;
    if (flags & TW_EDGE_BORDER) {
      border = true;
      uint32_t corner = t->edge_corner[edges[i]];
      if (t->corner_vertex[corner] == vertex) start = corner;
    }
  }
  if (border != (edge_count == corner_count + 1)) return false;
  /* First walks without writing, so that a vertex that fails keeps its lists whole. */
  uint32_t corner = start;
  for (uint32_t steps = 1;; steps++) {
    uint32_t back = tw_corner_previous(t, corner);
    uint32_t next = t->sibling[back];
    if (next == back || next == start) {
      if (steps != corner_count) return false;
      break;
    }
    if (steps >= corner_count) return false;
    corner = next;
  }
  corner = start;
  for (uint32_t i = 0; i < corner_count; i++) {
    uint32_t back = tw_corner_previous(t, corner);
    corners[i] = corner;
    edges[i] = t->corner_edge[corner];
    if (border && i + 1 == corner_count) edges[i + 1] = t->corner_edge[back];
    corner = t->sibling[back];
  }
  return true;
}

tw_status tw_topology_allocate_fans(tw_topology *topology, tw_arena *arena) {
  tw_topology *t = topology;
  t->fan_offsets = tw_arena_alloc(arena, (size_t)t->vertex_count + 2, sizeof(uint32_t));
  t->ring_offsets = tw_arena_alloc(arena, (size_t)t->vertex_count + 2, sizeof(uint32_t));
  t->fan_corners = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  t->ring_edges = tw_arena_alloc_raw(arena, t->edge_count, 2 * sizeof(uint32_t));
  t->vertex_flags = tw_arena_alloc(arena, t->vertex_count, 1);
  bool complete = t->fan_offsets && t->ring_offsets && t->fan_corners && t->ring_edges && t->vertex_flags;
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Sorts the corners by their vertices. fan_offsets: zeros before. */
static void file_corners(tw_topology *t) {
  /* Counting sort: while the starts serve as cursors they move to the next run's start, so that afterwards
   * they are shifted by one place. */
  for (uint32_t c = 0; c < t->corner_count; c++) t->fan_offsets[t->corner_vertex[c]]++;
  counts_to_offsets(t->fan_offsets, t->vertex_count);
  for (uint32_t c = 0; c < t->corner_count; c++) t->fan_corners[t->fan_offsets[t->corner_vertex[c]]++] = c;
  memmove(t->fan_offsets + 1, t->fan_offsets, t->vertex_count * sizeof(uint32_t));
  t->fan_offsets[0] = 0;
}

/* Fills the rings, orders the fans and sets the vertex flags, from the finished edges and the corners that
 * file_corners sorted. */
static void link_fans(tw_topology *t) {
  for (uint32_t e = 0; e < t->edge_count; e++)
    for (int end = 0; end < 2; end++) t->ring_offsets[t->edge_vertices[e][end]]++;
  counts_to_offsets(t->ring_offsets, t->vertex_count);
  for (uint32_t e = 0; e < t->edge_count; e++)
    for (int end = 0; end < 2; end++) t->ring_edges[t->ring_offsets[t->edge_vertices[e][end]]++] = e;
  memmove(t->ring_offsets + 1, t->ring_offsets, t->vertex_count * sizeof(uint32_t));
  t->ring_offsets[0] = 0;

  for (uint32_t v = 0; v < t->vertex_count; v++) {
    if (!order_fan(t, v)) t->vertex_flags[v] |= TW_VERTEX_NONMANIFOLD;
    for (uint32_t i = t->ring_offsets[v]; i < t->ring_offsets[v + 1]; i++)
      if (t->edge_flags[t->ring_edges[i]] & TW_EDGE_BORDER) t->vertex_flags[v] |= TW_VERTEX_BORDER;
  }
}

/* Makes edges and siblings. known_edges: as in tw_topology_build_parted, or NULL. */
static tw_status pair(tw_topology *t, const uint32_t *known_edges, tw_arena *arena) {
  t->sibling = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  /* There is at most one edge for each corner. The unused tails cost address space only. */
  t->edge_corner = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  t->edge_flags = tw_arena_alloc_raw(arena, t->corner_count, 1);
  uint32_t *buckets = tw_alloc_zero((size_t)t->vertex_count + 1, sizeof *buckets);
  half_edge *halves = tw_alloc(t->corner_count, sizeof *halves);
  bool has_room = map_corners(t, arena) && t->sibling && t->edge_corner && t->edge_flags && buckets && halves;
  if (has_room) {
    file_half_edges(t, known_edges, buckets, halves);
    for (uint32_t v = 0; v < t->vertex_count; v++)
      join_bucket(t, halves + buckets[v], buckets[v + 1] - buckets[v]);
  }
  tw_free(buckets);
  tw_free(halves);
  return has_room ? TW_OK : TW_NO_MEMORY;
}

/* Fills corner_edge and edge_vertices. */
static tw_status name_edges(tw_topology *t, tw_arena *arena) {
  t->corner_edge = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t));
  t->edge_vertices = tw_arena_alloc_raw(arena, t->edge_count, sizeof *t->edge_vertices);
  if (!t->corner_edge || !t->edge_vertices) return TW_NO_MEMORY;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t first = t->edge_corner[e], corner = first;
    t->edge_vertices[e][0] = tw_edge_start(t, e);
    t->edge_vertices[e][1] = tw_edge_stop(t, e);
    do {
      t->corner_edge[corner] = e;
      corner = t->sibling[corner];
    } while (corner != first);
  }
  return TW_OK;
}

static tw_status link(tw_topology *t, const uint32_t *known_edges, tw_arena *arena) {
  tw_status status = pair(t, known_edges, arena);
  if (status == TW_OK) status = name_edges(t, arena);
  if (status == TW_OK) status = tw_topology_allocate_fans(t, arena);
  if (status != TW_OK) return status;
  file_corners(t);
  link_fans(t);
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

tw_status tw_topology_pair(tw_topology *topology, tw_arena *arena, uint32_t vertex_count, uint32_t face_count,
                           const uint32_t *face_offsets, uint32_t corner_count, const uint32_t *corners) {
  start_topology(topology, vertex_count, face_count, face_offsets, corner_count, corners);
  return pair(topology, NULL, arena);
}

tw_status tw_topology_build(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                            uint32_t face_count, const uint32_t *face_offsets, uint32_t corner_count,
                            const uint32_t *corners) {
  start_topology(topology, vertex_count, face_count, face_offsets, corner_count, corners);
  return link(topology, NULL, arena);
}

tw_status tw_topology_build_parted(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                                   uint32_t face_count, uint32_t face_size, const uint32_t *corners,
                                   const uint32_t *known_edges) {
  start_topology(topology, vertex_count, face_count, NULL, face_size * face_count, corners);
  return link(topology, known_edges, arena);
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
                 : tw_topology_build_parted(out, arena, count, face_count, full->face_size, corners, edges);
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
