/* Describes a control mesh for a person: counts, and the places where it is not a surface. */
#include <stdlib.h>
#include <string.h>

#include "hard_edges.h"
#include "sorted.h"
#include "topology.h"
#include "union_find.h"
#include "weld.h"

enum { LISTED_MAX = 64 };

/* An extra bit beside the topology's vertex flags. */
enum { VERTEX_USED = 4 };

/* ---- pieces ----------------------------------------------------------------------------------- */

static tw_status count_components(const tw_topology *t, const uint8_t *flags, uint32_t *out) {
  uint32_t *pieces = tw_alloc(t->vertex_count, sizeof *pieces);
  if (!pieces) return TW_NO_MEMORY;
  tw_topology_find_pieces(t, pieces);
  for (uint32_t v = 0; v < t->vertex_count; v++) *out += (flags[v] & VERTEX_USED) && pieces[v] == v;
  tw_free(pieces);
  return TW_OK;
}

/* The corner of `corner`'s face at one end of its edge. */
static uint32_t corner_at(const tw_topology *t, uint32_t corner, uint32_t vertex) {
  return t->corner_vertex[corner] == vertex ? corner : tw_corner_next(t, corner);
}

/* Joins, at each end of an edge, the corners of all its faces: around that vertex these faces belong to one
 * sector. */
static void join_across(const tw_topology *t, uint32_t *sets, uint32_t edge) {
  uint32_t first = t->edge_corner[edge], next = tw_corner_next(t, first);
  for (uint32_t other = t->sibling[first]; other != first; other = t->sibling[other]) {
    tw_union_find_join(sets, first, corner_at(t, other, t->corner_vertex[first]));
    tw_union_find_join(sets, next, corner_at(t, other, t->corner_vertex[next]));
  }
}

/* Counts the loops of the border. A loop turns at a point within one sector, so two loops that only share a
 * point count as two. The count is that of sectors on the border less the joins made by border edges.
 * sectors: union-find of corners. */
static tw_status count_loops(const tw_topology *t, uint32_t *sectors, uint32_t *out) {
  uint32_t count = 0, joined = 0;
  uint8_t *met = tw_alloc_zero(t->corner_count, 1);
  for (uint32_t e = 0; met && e < t->edge_count; e++) {
    if (!(t->edge_flags[e] & TW_EDGE_BORDER)) continue;
    uint32_t ends[2] = {t->edge_corner[e], tw_corner_next(t, t->edge_corner[e])};
    for (int i = 0; i < 2; i++) {
      uint32_t sector = tw_union_find_root(sectors, ends[i]);
      count += !met[sector];
      met[sector] = 1;
    }
  }
  for (uint32_t e = 0; met && e < t->edge_count; e++) {
    if (!(t->edge_flags[e] & TW_EDGE_BORDER)) continue;
    joined += tw_union_find_join(sectors, t->edge_corner[e], tw_corner_next(t, t->edge_corner[e]));
  }
  *out = count - joined;
  tw_free(met);
  return met ? TW_OK : TW_NO_MEMORY;
}

/* ---- points ----------------------------------------------------------------------------------- */

/* Flags the points that faces use, border points, and points of a non-manifold edge or twice in one face.
 * last: [vertex_count] scratch, zeros. */
static void flag_points(const tw_topology *t, uint32_t *last, uint8_t *flags) {
  for (uint32_t e = 0; e < t->edge_count; e++) {
    unsigned edge = t->edge_flags[e], found = (edge & TW_EDGE_BORDER ? TW_VERTEX_BORDER : 0u) |
                                              (edge & TW_EDGE_NONMANIFOLD ? TW_VERTEX_NONMANIFOLD : 0u);
    flags[tw_edge_start(t, e)] |= (uint8_t)found;
    flags[tw_edge_stop(t, e)] |= (uint8_t)found;
  }
  for (uint32_t c = 0; c < t->corner_count; c++) {
    uint32_t v = t->corner_vertex[c], face = tw_corner_face(t, c) + 1;
    flags[v] |= (uint8_t)(VERTEX_USED | (last[v] == face ? TW_VERTEX_NONMANIFOLD : 0));
    last[v] = face;
  }
}

/* A point whose faces form several sectors is not one fan. last: scratch as for flag_points. */
static void flag_sectors(const tw_topology *t, uint32_t *sectors, uint32_t *last, uint8_t *flags) {
  memset(last, 0, t->vertex_count * sizeof *last);
  for (uint32_t c = 0; c < t->corner_count; c++) {
    uint32_t v = t->corner_vertex[c], sector = tw_union_find_root(sectors, c) + 1;
    if (last[v] != 0 && last[v] != sector) flags[v] |= TW_VERTEX_NONMANIFOLD;
    last[v] = sector;
  }
}

/* Flags the vertices as tw_topology_build would, without the memory of fans and rings, and counts the
 * border's loops. flags: [vertex_count], zeros. */
static tw_status look_round_points(const tw_topology *t, uint8_t *flags, tw_mesh_stats *facts) {
  uint32_t *sectors = tw_alloc(t->corner_count, sizeof *sectors);
  uint32_t *last = tw_alloc_zero(t->vertex_count, sizeof *last);
  tw_status status = sectors && last ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) {
    tw_union_find_init(sectors, t->corner_count);
    for (uint32_t e = 0; e < t->edge_count; e++) join_across(t, sectors, e);
    flag_points(t, last, flags);
    flag_sectors(t, sectors, last, flags);
  }
  tw_free(last);
  if (status == TW_OK && facts->boundary_edges > 0) status = count_loops(t, sectors, &facts->boundary_loops);
  tw_free(sectors);
  return status;
}

/* ---- seams ------------------------------------------------------------------------------------ */

static void copy_ends(const tw_topology *t, uint32_t edge, uint32_t out[2]) {
  out[0] = tw_edge_start(t, edge);
  out[1] = tw_edge_stop(t, edge);
}

static void list_reversed(const tw_topology *t, uint32_t edge, tw_mesh_stats *facts) {
  if (facts->listed_reversed_edges < LISTED_MAX)
    copy_ends(t, edge, facts->reversed_edge_points[facts->listed_reversed_edges++]);
}

static void count_reversed(const tw_topology *t, tw_mesh_stats *facts) {
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t first = t->edge_corner[e], other = t->sibling[first];
    bool is_pair = (t->edge_flags[e] & TW_EDGE_NONMANIFOLD) && t->sibling[other] == first;
    if (!is_pair) continue;
    facts->reversed_edges++;
    list_reversed(t, e, facts);
  }
}

/* A border edge, keyed by the positions of its ends. */
typedef struct border {
  uint32_t low, high, edge;
  bool is_downward; /* from high to low */
} border;

static int compare_borders(const void *left, const void *right) {
  const border *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return a->edge < b->edge ? -1 : a->edge > b->edge;
}

/* Whether border edges, which are of different faces' sides or of one face twice, have the same points. */
static bool have_same_points(const tw_topology *t, const border *first, const border *end) {
  uint32_t ends[2], other[2];
  copy_ends(t, first->edge, ends);
  for (const border *b = first + 1; b < end; b++) {
    copy_ends(t, b->edge, other);
    bool is_turned = b->is_downward != first->is_downward;
    if (other[is_turned] != ends[0] || other[!is_turned] != ends[1]) return false;
  }
  return true;
}

/* Counts border edges that lie on each other. places: [point_count] the first point at each point's position.
 * borders: [facts->boundary_edges] scratch. */
static tw_status match_borders(const tw_topology *t, const uint32_t *places, border *borders,
                               tw_mesh_stats *facts) {
  uint32_t count = 0;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t from = places[tw_edge_start(t, e)], to = places[tw_edge_stop(t, e)];
    if ((t->edge_flags[e] & TW_EDGE_BORDER) && from != to)
      borders[count++] = from < to ? (border){from, to, e, false} : (border){to, from, e, true};
  }
  tw_status status = tw_sort(borders, count, sizeof *borders, compare_borders);
  for (uint32_t i = 0, end; i < count && status == TW_OK; i = end) {
    end = i + 1;
    while (end < count && borders[end].low == borders[i].low && borders[end].high == borders[i].high) end++;
    if (end - i > 1) facts->seam_edges += end - i;
    if (end - i > 1 && have_same_points(t, &borders[i], &borders[end])) facts->folded_edges += end - i;
    if (end - i != 2 || borders[i].is_downward != borders[i + 1].is_downward) continue;
    facts->reversed_borders++;
    list_reversed(t, borders[i].edge, facts);
  }
  return status;
}

static tw_status describe_seams(const tw_mesh *mesh, const tw_topology *t, tw_mesh_stats *facts) {
  facts->reversed_edge_points = tw_alloc(LISTED_MAX, sizeof *facts->reversed_edge_points);
  if (!facts->reversed_edge_points) return TW_NO_MEMORY;
  if (facts->nonmanifold_edges > 0) count_reversed(t, facts);
  if (facts->boundary_edges < 2) return TW_OK;
  uint32_t *places = tw_alloc(mesh->point_count, sizeof *places);
  border *borders = tw_alloc(facts->boundary_edges, sizeof *borders);
  tw_status status = places && borders
                         ? tw_find_equal_rows(mesh->positions, 3, mesh->point_count, places, NULL)
                         : TW_NO_MEMORY;
  if (status == TW_OK) status = match_borders(t, places, borders, facts);
  tw_free(places);
  tw_free(borders);
  return status;
}

/* ---- numbers ---------------------------------------------------------------------------------- */

/* Sorts values and counts equal ones into fresh arrays, which the caller owns on failure too. */
static tw_status tally(uint32_t *values, uint32_t count, uint32_t **keys, uint32_t **counts,
                       uint32_t *key_count) {
  tw_status status = tw_sort(values, count, sizeof *values, tw_compare_uint32);
  if (status != TW_OK) return status;
  uint32_t distinct = 0;
  for (uint32_t i = 0; i < count; i++) distinct += i == 0 || values[i] != values[i - 1];
  *keys = tw_alloc(distinct, sizeof **keys);
  *counts = tw_alloc_zero(distinct, sizeof **counts);
  *key_count = 0;
  if (!*keys || !*counts) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < count; i++) {
    if (i == 0 || values[i] != values[i - 1]) (*keys)[(*key_count)++] = values[i];
    (*counts)[*key_count - 1]++;
  }
  return TW_OK;
}

static bool is_extraordinary(uint8_t flags, uint32_t valence) {
  if (!(flags & VERTEX_USED) || (flags & TW_VERTEX_NONMANIFOLD)) return false;
  return flags & TW_VERTEX_BORDER ? valence != 3 && valence != 2 : valence != 4;
}

static void describe_points(const tw_mesh *mesh, const uint8_t *flags, tw_mesh_stats *facts) {
  for (uint32_t v = 0; v < mesh->point_count; v++) {
    if (!(flags[v] & VERTEX_USED)) {
      facts->unused_points++;
      continue;
    }
    const float *p = &mesh->positions[3 * (size_t)v];
    for (int i = 0; i < 3; i++) {
      if (facts->vertices == 0 || p[i] < facts->min[i]) facts->min[i] = p[i];
      if (facts->vertices == 0 || p[i] > facts->max[i]) facts->max[i] = p[i];
    }
    facts->vertices++;
    if (!(flags[v] & TW_VERTEX_NONMANIFOLD)) continue;
    facts->nonmanifold_vertices++;
    if (facts->listed_nonmanifold_vertices < LISTED_MAX)
      facts->nonmanifold_vertex_points[facts->listed_nonmanifold_vertices++] = v;
  }
}

static void describe_edges(const tw_topology *t, tw_mesh_stats *facts) {
  facts->edges = t->edge_count;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    facts->boundary_edges += (t->edge_flags[e] & TW_EDGE_BORDER) != 0;
    if (!(t->edge_flags[e] & TW_EDGE_NONMANIFOLD)) continue;
    facts->nonmanifold_edges++;
    if (facts->listed_nonmanifold_edges < LISTED_MAX)
      copy_ends(t, e, facts->nonmanifold_edge_points[facts->listed_nonmanifold_edges++]);
  }
}

static tw_status describe_valences(const tw_topology *t, const uint8_t *flags, tw_mesh_stats *facts) {
  uint32_t *values = tw_alloc_zero(t->vertex_count, sizeof *values);
  if (!values) return TW_NO_MEMORY;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    values[tw_edge_start(t, e)]++;
    values[tw_edge_stop(t, e)]++;
  }
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (is_extraordinary(flags[v], values[v])) values[facts->extraordinary_vertices++] = values[v];
  tw_status status = tally(values, facts->extraordinary_vertices, &facts->valences, &facts->valence_vertices,
                           &facts->valence_count);
  tw_free(values);
  return status;
}

static tw_status describe_faces(const tw_mesh *mesh, tw_mesh_stats *facts) {
  facts->faces = mesh->face_count;
  uint32_t *sizes = tw_alloc(mesh->face_count, sizeof *sizes);
  if (!sizes) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    sizes[f] = mesh->face_offsets[f + 1] - mesh->face_offsets[f];
    facts->triangles += sizes[f] == 3;
    facts->quads += sizes[f] == 4;
    facts->ngons += sizes[f] > 4;
  }
  tw_status status =
      tally(sizes, mesh->face_count, &facts->face_sizes, &facts->face_size_faces, &facts->face_size_count);
  tw_free(sizes);
  return status;
}

static tw_status describe_groups(const tw_mesh *mesh, tw_mesh_stats *facts) {
  if (!mesh->face_groups) return TW_OK;
  uint32_t *values = tw_alloc(mesh->face_count, sizeof *values), count = 0;
  if (!values) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    if (mesh->face_groups[f] != UINT32_MAX) values[count++] = mesh->face_groups[f];
  tw_status status = tally(values, count, &facts->groups, &facts->group_faces, &facts->group_count);
  tw_free(values);
  return status;
}

static void set_sharpness(float *at, float sharpness, tw_mesh_stats *facts) {
  facts->overruled_tags += *at > 0 && *at != sharpness;
  facts->repeated_tags += *at > 0 && *at == sharpness;
  *at = sharpness;
}

/* Counts the tags on edges, points and faces that exist; of several tags on one element the last counts. */
static tw_status describe_tags(const tw_mesh *mesh, tw_topology *t, const uint8_t *flags, tw_arena *arena,
                               tw_mesh_stats *facts) {
  uint8_t *is_hole = tw_arena_alloc(arena, mesh->face_count, 1);
  if (!is_hole || tw_topology_soften(t, arena) != TW_OK) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = mesh->crease_edges + 2 * (size_t)i;
    uint32_t edge = tw_topology_find_edge(t, ends[0], ends[1]);
    if (edge != UINT32_MAX) set_sharpness(&t->edge_sharpness[edge], mesh->crease_sharpness[i], facts);
    bool is_lost = edge == UINT32_MAX && mesh->crease_sharpness[i] > 0;
    if (is_lost && facts->lost_creases++ == 0) memcpy(facts->lost_crease, ends, 2 * sizeof *ends);
  }
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++)
    set_sharpness(&t->vertex_sharpness[mesh->sharp_points[i]], mesh->point_sharpness[i], facts);
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    facts->repeated_tags += is_hole[mesh->holes[i]];
    is_hole[mesh->holes[i]] = 1;
  }
  for (uint32_t e = 0; e < t->edge_count; e++) facts->creases += t->edge_sharpness[e] > 0;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    facts->sharp_points += t->vertex_sharpness[v] > 0 && (flags[v] & VERTEX_USED);
  for (uint32_t f = 0; f < mesh->face_count; f++) facts->holes += is_hole[f];
  return TW_OK;
}

static tw_status describe(const tw_mesh *mesh, tw_arena *arena, tw_mesh_stats *facts) {
  tw_topology topology;
  tw_status status = describe_faces(mesh, facts);
  if (status != TW_OK) return status;
  /* Faces of one size need no map from corners to faces. */
  bool is_even = facts->triangles == facts->faces || facts->quads == facts->faces;
  status = tw_topology_pair(&topology, arena, mesh->point_count, mesh->face_count,
                            is_even ? NULL : mesh->face_offsets, mesh->corner_count, mesh->corners);
  if (status != TW_OK) return status;
  facts->nonmanifold_edge_points = tw_alloc(LISTED_MAX, sizeof *facts->nonmanifold_edge_points);
  facts->nonmanifold_vertex_points = tw_alloc(LISTED_MAX, sizeof *facts->nonmanifold_vertex_points);
  uint8_t *flags = tw_arena_alloc(arena, mesh->point_count, 1);
  if (!facts->nonmanifold_edge_points || !facts->nonmanifold_vertex_points || !flags) return TW_NO_MEMORY;
  describe_edges(&topology, facts);
  status = look_round_points(&topology, flags, facts);
  if (status != TW_OK) return status;
  describe_points(mesh, flags, facts);
  status = describe_seams(mesh, &topology, facts);
  if (status == TW_OK) status = describe_valences(&topology, flags, facts);
  if (status == TW_OK) status = describe_groups(mesh, facts);
  if (status == TW_OK) status = count_components(&topology, flags, &facts->components);
  /* Comes before describe_tags, whose arrays stay in the arena: beside the topology this call needs the most
   * memory. */
  if (status == TW_OK) status = tw_hard_edges_count(mesh, &topology, &facts->hard_edges);
  if (status == TW_OK) status = describe_tags(mesh, &topology, flags, arena, facts);
  facts->euler_characteristic = (int64_t)facts->vertices - facts->edges + facts->faces;
  return status;
}

tw_status tw_mesh_describe(const tw_mesh *mesh, tw_mesh_stats *facts, tw_error *error) {
  memset(facts, 0, sizeof *facts);
  tw_arena *arena = tw_arena_create();
  tw_status status = arena ? describe(mesh, arena, facts) : TW_NO_MEMORY;
  tw_arena_destroy(arena);
  if (status == TW_OK) return TW_OK;
  tw_mesh_stats_deinit(facts);
  return tw_fail(error, status, "out of memory");
}

void tw_mesh_stats_deinit(tw_mesh_stats *facts) {
  tw_free(facts->valences);
  tw_free(facts->valence_vertices);
  tw_free(facts->face_sizes);
  tw_free(facts->face_size_faces);
  tw_free(facts->groups);
  tw_free(facts->group_faces);
  tw_free(facts->nonmanifold_edge_points);
  tw_free(facts->nonmanifold_vertex_points);
  tw_free(facts->reversed_edge_points);
  memset(facts, 0, sizeof *facts);
}
