/* Cutting a refined mesh back to what the border leaves, and counting without doing so. */
#include "open.h"

uint32_t tw_open_quads(const tw_topology *parent, tw_arena *arena, uint32_t **quads) {
  *quads = tw_arena_alloc(arena, parent->corner_count, sizeof **quads);
  uint32_t count = 0;
  for (uint32_t c = 0; *quads && c < parent->corner_count; c++)
    if (!(parent->vertex_flags[parent->corner_vertex[c]] & TW_VERTEX_BORDER)) (*quads)[count++] = c;
  return count;
}

/* Names the vertices of the quads anew, in the order of their old names. */
static tw_status rename_vertices(const tw_topology *full, const uint32_t *quads, uint32_t quad_count,
                                 tw_arena *arena, uint32_t *corners, uint32_t **vertices,
                                 uint32_t *vertex_count) {
  uint32_t *names = tw_arena_alloc(arena, full->vertex_count, sizeof *names);
  if (!names) return TW_NO_MEMORY;
  for (uint32_t q = 0; q < quad_count; q++)
    for (uint32_t k = 0; k < 4; k++) names[full->corner_vertex[4 * quads[q] + k]] = 1;
  *vertex_count = 0;
  for (uint32_t v = 0; v < full->vertex_count; v++)
    if (names[v]) names[v] = ++*vertex_count;
  *vertices = tw_arena_alloc(arena, *vertex_count, sizeof **vertices);
  if (!*vertices) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < full->vertex_count; v++)
    if (names[v]) (*vertices)[names[v] - 1] = v;
  for (uint32_t q = 0; q < quad_count; q++)
    for (uint32_t k = 0; k < 4; k++) corners[4 * q + k] = names[full->corner_vertex[4 * quads[q] + k]] - 1;
  return TW_OK;
}

tw_status tw_open_cut(const tw_topology *full, const uint32_t *quads, uint32_t quad_count, tw_arena *arena,
                      tw_topology *out, uint32_t **vertices) {
  uint32_t *corners = tw_arena_alloc(arena, quad_count, sizeof(uint32_t[4]));
  if (!corners) return TW_NO_MEMORY;
  uint32_t vertex_count;
  tw_status status = rename_vertices(full, quads, quad_count, arena, corners, vertices, &vertex_count);
  if (status == TW_OK)
    status = tw_topology_build(out, arena, vertex_count, quad_count, NULL, 4 * quad_count, corners);
  if (status == TW_OK) status = tw_topology_soften(out, arena);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < out->corner_count; c++) {
    uint32_t old = 4 * quads[c / 4] + c % 4;
    out->edge_sharpness[out->corner_edge[c]] = full->edge_sharpness[full->corner_edge[old]];
  }
  for (uint32_t v = 0; v < vertex_count; v++)
    out->vertex_sharpness[v] = full->vertex_sharpness[(*vertices)[v]];
  tw_topology_sharpen(out, false);
  return full->semi_sum ? tw_topology_sum_semi(out, arena) : TW_OK;
}

/* Quads by how many of their corners are inner vertices. A quad with opposite inner corners alone does
 * not come up: every quad of a refined mesh has a corner whose neighbours lie between it and the
 * border. */
typedef struct border_kinds {
  uint64_t inner[5];
} border_kinds;

static border_kinds sort_quads(const tw_topology *t) {
  border_kinds kinds = {{0}};
  for (uint32_t q = 0; q < t->face_count; q++) {
    int inner = 0;
    for (uint32_t k = 0; k < 4; k++)
      inner += !(t->vertex_flags[t->corner_vertex[4 * q + k]] & TW_VERTEX_BORDER);
    kinds.inner[inner]++;
  }
  return kinds;
}

/* One step: of a quad with two inner corners two strips of the border remain, of one with three two
 * strips and the same turn, of one with one inner corner the same. */
static border_kinds next_kinds(border_kinds k) {
  border_kinds next = {{0, k.inner[1], 2 * (k.inner[2] + k.inner[3]), k.inner[3], 4 * k.inner[4]}};
  return next;
}

static uint64_t face_count(border_kinds k) {
  return k.inner[1] + k.inner[2] + k.inner[3] + k.inner[4];
}

tw_surface_counts tw_open_count(const tw_topology *first, uint32_t level) {
  uint64_t border_vertices = 0, border_edges = 0;
  for (uint32_t v = 0; v < first->vertex_count; v++)
    border_vertices += (first->vertex_flags[v] & TW_VERTEX_BORDER) != 0;
  for (uint32_t e = 0; e < first->edge_count; e++)
    border_edges += (first->edge_flags[e] & TW_EDGE_BORDER) != 0;
  tw_surface_counts counts = {first->vertex_count, first->edge_count, first->face_count, first->corner_count};
  border_kinds kinds = sort_quads(first);
  for (uint32_t l = 1; l < level && counts.faces > 0; l++) {
    counts.vertices =
        counts.faces - kinds.inner[0] + (counts.edges - border_edges) + (counts.vertices - border_vertices);
    kinds = next_kinds(kinds);
    counts.faces = face_count(kinds);
    counts.corners = 4 * counts.faces;
    /* A strip has one edge on the border, a lone corner two; border and vertices on it are as many. */
    border_edges = border_vertices = kinds.inner[2] + 2 * kinds.inner[1];
    counts.edges = (counts.corners + border_edges) / 2;
  }
  return counts;
}
