/* Checks a control mesh on entry and describes it for a person. */
#include "tweend/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "topology.h"

void tw_mesh_init(tw_mesh *mesh) {
  memset(mesh, 0, sizeof *mesh);
  mesh->tag_boundary = mesh->tag_uv = mesh->tag_creasing = mesh->tag_triangles = TW_TAG_UNSET;
}

/* ---- check ---------------------------------------------------------------------------------- */

static tw_status check_finite(const float *values, uint64_t rows, uint32_t width, const char *what,
                              tw_error *error) {
  for (uint64_t i = 0; i < rows * width; i++)
    if (!(fabsf(values[i]) <= TW_COORDINATE_MAX)) {
      tw_fail(error, TW_INVALID,
              isfinite(values[i]) ? "a coordinate is beyond 1e18" : "a coordinate is not a finite number");
      return tw_error_at(error, "/%s/%llu/%llu", what, (unsigned long long)(i / width),
                         (unsigned long long)(i % width));
    }
  return TW_OK;
}

static tw_status check_index(uint32_t index, uint32_t count, const char *of, tw_error *error) {
  if (index < count) return TW_OK;
  return tw_fail(error, TW_INVALID, "index %u is out of range: there are %u %s", index, count, of);
}

/* A repeated point in a face. seen: [point_count], the last face + 1 that used each point. */
static tw_status check_face(const tw_mesh *mesh, uint32_t face, uint32_t *seen, tw_error *error) {
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  if (end - begin < 3) {
    tw_fail(error, TW_INVALID, "a face needs at least three corners, this one has %u", end - begin);
    tw_error_at(error, "/faces/%u", face);
    return TW_INVALID;
  }
  for (uint32_t c = begin; c < end; c++) {
    uint32_t point = mesh->corners[c];
    tw_status status = check_index(point, mesh->point_count, "points", error);
    if (status == TW_OK && seen[point] == face + 1)
      status = tw_fail(error, TW_INVALID, "point %u occurs twice in the face", point);
    if (status != TW_OK) {
      tw_error_at(error, "/faces/%u/%u", face, c - begin);
      return TW_INVALID;
    }
    seen[point] = face + 1;
  }
  return TW_OK;
}

static tw_status check_faces(const tw_mesh *mesh, tw_error *error, uint32_t *bad_face) {
  if (mesh->face_count == UINT32_MAX) return tw_fail(error, TW_LIMIT, "too many faces");
  uint32_t *seen = tw_alloc_zero(mesh->point_count, sizeof *seen);
  if (!seen) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = TW_OK;
  for (uint32_t face = 0; face < mesh->face_count && status == TW_OK; face++) {
    status = check_face(mesh, face, seen, error);
    if (status != TW_OK) *bad_face = face;
  }
  free(seen);
  return status;
}

static uint32_t face_of_corner(const tw_mesh *mesh, uint32_t corner) {
  uint32_t begin = 0, end = mesh->face_count;
  while (end - begin > 1) {
    uint32_t middle = begin + (end - begin) / 2;
    if (mesh->face_offsets[middle] <= corner)
      begin = middle;
    else
      end = middle;
  }
  return begin;
}

static tw_status check_uvs(const tw_mesh *mesh, tw_error *error, uint32_t *bad_face) {
  for (uint32_t s = 0; s < mesh->uv_set_count; s++) {
    const tw_uv_set *set = &mesh->uv_sets[s];
    tw_status status = check_finite(set->values, set->value_count, 2, "uvs", error);
    if (status != TW_OK) return status;
    for (uint32_t c = 0; c < mesh->corner_count; c++) {
      status = check_index(set->corners[c], set->value_count, "uvs", error);
      if (status == TW_OK) continue;
      *bad_face = face_of_corner(mesh, c);
      return tw_error_at(error, "/face_uvs/%u/%u", *bad_face, c - mesh->face_offsets[*bad_face]);
    }
  }
  return TW_OK;
}

static tw_status check_sharpness(float sharpness, const char *what, uint32_t index, tw_error *error) {
  if (isfinite(sharpness) && sharpness >= 0) return TW_OK;
  tw_fail(error, TW_INVALID, "sharpness has to be a number from 0 to 10");
  return tw_error_at(error, "/%s/%u/sharpness", what, index);
}

static tw_status check_tags(const tw_mesh *mesh, tw_error *error) {
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = &mesh->crease_edges[2 * i];
    tw_status status = check_index(ends[0], mesh->point_count, "points", error);
    if (status == TW_OK) status = check_index(ends[1], mesh->point_count, "points", error);
    if (status != TW_OK) return tw_error_at(error, "/creases/%u/edge", i);
    status = check_sharpness(mesh->crease_sharpness[i], "creases", i, error);
    if (status != TW_OK) return status;
  }
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) {
    tw_status status = check_index(mesh->sharp_points[i], mesh->point_count, "points", error);
    if (status != TW_OK) return tw_error_at(error, "/corners/%u/vertex", i);
    status = check_sharpness(mesh->point_sharpness[i], "corners", i, error);
    if (status != TW_OK) return status;
  }
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    tw_status status = check_index(mesh->holes[i], mesh->face_count, "faces", error);
    if (status != TW_OK) return tw_error_at(error, "/holes/%u", i);
  }
  return TW_OK;
}

static tw_status check_point_data(const tw_mesh *mesh, tw_error *error) {
  tw_status status = check_finite(mesh->positions, mesh->point_count, 3, "positions", error);
  if (status == TW_OK && mesh->colors)
    status = check_finite(mesh->colors, mesh->point_count, 4, "colors", error);
  if (status == TW_OK && mesh->skin.joints)
    status = check_finite(mesh->skin.weights, mesh->point_count, 4, "weights", error);
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++)
    status = check_finite(mesh->morphs[m], mesh->point_count, 3, "morphs", error);
  return status;
}

tw_status tw_mesh_check(const tw_mesh *mesh, tw_error *error, uint32_t *face) {
  uint32_t ignored;
  if (!face) face = &ignored;
  *face = UINT32_MAX;
  tw_status status = check_point_data(mesh, error);
  if (status == TW_OK) status = check_faces(mesh, error, face);
  if (status == TW_OK) status = check_uvs(mesh, error, face);
  if (status == TW_OK) status = check_tags(mesh, error);
  return status;
}

/* ---- describe ------------------------------------------------------------------------------- */

enum { LISTED_MAX = 64 };

/* Follows `parents` to the root, halving the path on the way. */
static uint32_t find_root(uint32_t *parents, uint32_t item) {
  while (parents[item] != item) {
    parents[item] = parents[parents[item]];
    item = parents[item];
  }
  return item;
}

static void join_sets(uint32_t *parents, uint32_t a, uint32_t b) {
  uint32_t root_a = find_root(parents, a), root_b = find_root(parents, b);
  if (root_a < root_b)
    parents[root_b] = root_a;
  else
    parents[root_a] = root_b;
}

/* Roots among the vertices that `wanted` flags, after joining along the edges that `through` flags
 * (0: all edges). UINT32_MAX without memory. */
static uint32_t count_components(const tw_topology *t, uint8_t edge_flag, uint8_t vertex_flag) {
  uint32_t *parents = tw_alloc(t->vertex_count, sizeof *parents);
  if (!parents) return UINT32_MAX;
  for (uint32_t v = 0; v < t->vertex_count; v++) parents[v] = v;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (!edge_flag || (t->edge_flags[e] & edge_flag))
      join_sets(parents, t->edge_vertices[e][0], t->edge_vertices[e][1]);
  uint32_t count = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    bool used = t->fan_offsets[v + 1] > t->fan_offsets[v];
    count += used && parents[v] == v && (!vertex_flag || (t->vertex_flags[v] & vertex_flag));
  }
  free(parents);
  return count;
}

static int compare_uint32(const void *left, const void *right) {
  uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return a < b ? -1 : a > b;
}

/* Sorts values and counts equal ones into fresh arrays. */
static tw_status tally(uint32_t *values, uint32_t count, uint32_t **keys, uint32_t **counts,
                       uint32_t *key_count) {
  qsort(values, count, sizeof *values, compare_uint32);
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

static bool is_extraordinary(const tw_topology *t, uint32_t v, uint32_t *valence) {
  uint32_t faces = t->fan_offsets[v + 1] - t->fan_offsets[v];
  *valence = t->ring_offsets[v + 1] - t->ring_offsets[v];
  if (faces == 0 || (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD)) return false;
  return t->vertex_flags[v] & TW_VERTEX_BORDER ? *valence != 3 && *valence != 2 : *valence != 4;
}

static void describe_points(const tw_mesh *mesh, const tw_topology *t, tw_mesh_facts *facts) {
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    if (t->fan_offsets[v + 1] == t->fan_offsets[v]) {
      facts->unused_points++;
      continue;
    }
    const float *p = &mesh->positions[3 * (size_t)v];
    for (int i = 0; i < 3; i++) {
      if (facts->vertices == 0 || p[i] < facts->min[i]) facts->min[i] = p[i];
      if (facts->vertices == 0 || p[i] > facts->max[i]) facts->max[i] = p[i];
    }
    facts->vertices++;
    if (!(t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD)) continue;
    facts->nonmanifold_vertices++;
    if (facts->listed_nonmanifold_vertices < LISTED_MAX)
      facts->nonmanifold_vertex_points[facts->listed_nonmanifold_vertices++] = v;
  }
}

static void describe_edges(const tw_topology *t, tw_mesh_facts *facts) {
  facts->edges = t->edge_count;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    facts->boundary_edges += (t->edge_flags[e] & TW_EDGE_BORDER) != 0;
    if (!(t->edge_flags[e] & TW_EDGE_NONMANIFOLD)) continue;
    facts->nonmanifold_edges++;
    if (facts->listed_nonmanifold_edges < LISTED_MAX)
      memcpy(facts->nonmanifold_edge_points[facts->listed_nonmanifold_edges++], t->edge_vertices[e],
             sizeof *t->edge_vertices);
  }
}

static tw_status describe_valences(const tw_topology *t, tw_mesh_facts *facts) {
  uint32_t *values = tw_alloc(t->vertex_count, sizeof *values);
  if (!values) return TW_NO_MEMORY;
  uint32_t valence;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (is_extraordinary(t, v, &valence)) values[facts->extraordinary_vertices++] = valence;
  tw_status status = tally(values, facts->extraordinary_vertices, &facts->valences, &facts->valence_vertices,
                           &facts->valence_count);
  free(values);
  return status;
}

static tw_status describe_faces(const tw_mesh *mesh, tw_mesh_facts *facts) {
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
  free(sizes);
  return status;
}

static tw_status describe(const tw_mesh *mesh, tw_arena *arena, tw_mesh_facts *facts) {
  tw_topology topology;
  tw_status status = tw_topology_build(&topology, arena, mesh->point_count, mesh->face_count,
                                       mesh->face_offsets, mesh->corner_count, mesh->corners);
  if (status != TW_OK) return status;
  facts->nonmanifold_edge_points = tw_alloc(LISTED_MAX, sizeof *facts->nonmanifold_edge_points);
  facts->nonmanifold_vertex_points = tw_alloc(LISTED_MAX, sizeof *facts->nonmanifold_vertex_points);
  if (!facts->nonmanifold_edge_points || !facts->nonmanifold_vertex_points) return TW_NO_MEMORY;
  describe_points(mesh, &topology, facts);
  describe_edges(&topology, facts);
  status = describe_valences(&topology, facts);
  if (status == TW_OK) status = describe_faces(mesh, facts);
  facts->components = count_components(&topology, 0, 0);
  facts->boundary_loops = count_components(&topology, TW_EDGE_BORDER, TW_VERTEX_BORDER);
  if (facts->components == UINT32_MAX || facts->boundary_loops == UINT32_MAX) return TW_NO_MEMORY;
  facts->euler_characteristic = (int64_t)facts->vertices - facts->edges + facts->faces;
  facts->creases = mesh->crease_count;
  facts->sharp_points = mesh->sharp_point_count;
  facts->holes = mesh->hole_count;
  return status;
}

tw_status tw_mesh_describe(const tw_mesh *mesh, tw_mesh_facts *facts, tw_error *error) {
  memset(facts, 0, sizeof *facts);
  tw_arena *arena = tw_arena_create();
  tw_status status = arena ? describe(mesh, arena, facts) : TW_NO_MEMORY;
  tw_arena_destroy(arena);
  if (status == TW_OK) return TW_OK;
  tw_mesh_facts_deinit(facts);
  return tw_fail(error, status, "out of memory");
}

void tw_mesh_facts_deinit(tw_mesh_facts *facts) {
  free(facts->valences);
  free(facts->valence_vertices);
  free(facts->face_sizes);
  free(facts->face_size_faces);
  free(facts->nonmanifold_edge_points);
  free(facts->nonmanifold_vertex_points);
  memset(facts, 0, sizeof *facts);
}
