/* Reads a control mesh for subdivision, and counts what its levels have. */
#include "cage.h"

#include <string.h>

#include "open_border.h"
#include "refine.h"
#include "sorted.h"

/* ---- the cage -------------------------------------------------------------------------------- */

/* Renumbers vertices so that points which no face uses are not in the topology. */
static tw_status compact(const tw_mesh *mesh, tw_cage *c, const uint32_t **corners, uint32_t *vertex_count) {
  const uint32_t *points = mesh->corners, point_count = mesh->point_count, corner_count = mesh->corner_count;
  uint32_t *vertex_of = tw_arena_alloc(c->arena, point_count, sizeof *vertex_of);
  if (!vertex_of) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < corner_count; i++) vertex_of[points[i]] = 1;
  uint32_t used = 0;
  for (uint32_t p = 0; p < point_count; p++)
    if (vertex_of[p]) vertex_of[p] = ++used;
  *vertex_count = used;
  *corners = mesh->corners;
  if (used == mesh->point_count) return TW_OK;
  uint32_t *renamed = tw_arena_alloc(c->arena, mesh->corner_count, sizeof *renamed);
  c->point_of = tw_arena_alloc(c->arena, used, sizeof *c->point_of);
  if (!renamed || !c->point_of) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < mesh->corner_count; i++) renamed[i] = vertex_of[mesh->corners[i]] - 1;
  for (uint32_t p = 0; p < mesh->point_count; p++)
    if (vertex_of[p]) c->point_of[vertex_of[p] - 1] = p;
  *corners = renamed;
  return TW_OK;
}

/* The vertex of a point, or UINT32_MAX when no face uses it: point_of ascends. */
static uint32_t vertex_of_point(const tw_cage *c, uint32_t point) {
  if (!c->point_of) return point;
  uint32_t count = c->topology.vertex_count, vertex = tw_lower_bound(c->point_of, count, point);
  return vertex < count && c->point_of[vertex] == point ? vertex : UINT32_MAX;
}

/* Tags of edges and points that no face has are ignored, as in OpenSubdiv. */
static void apply_tags(const tw_mesh *mesh, tw_cage *c) {
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    uint32_t a = vertex_of_point(c, mesh->crease_edges[2 * (size_t)i]),
             b = vertex_of_point(c, mesh->crease_edges[2 * (size_t)i + 1]);
    uint32_t edge =
        a == UINT32_MAX || b == UINT32_MAX ? UINT32_MAX : tw_topology_find_edge(&c->topology, a, b);
    if (edge != UINT32_MAX) c->topology.edge_sharpness[edge] = mesh->crease_sharpness[i];
  }
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) {
    uint32_t v = vertex_of_point(c, mesh->sharp_points[i]);
    if (v != UINT32_MAX) c->topology.vertex_sharpness[v] = mesh->point_sharpness[i];
  }
}

static uint32_t count_sharp(const float *sharpness, uint32_t count) {
  uint32_t sharp = 0;
  for (uint32_t i = 0; i < count; i++) sharp += sharpness[i] > 0;
  return sharp;
}

/* Keeps the tags that apply_tags could apply. Call it before sharpening, which sets sharpness of its own. */
static tw_status keep_tags(tw_cage *c) {
  const tw_topology *t = &c->topology;
  uint32_t creases = count_sharp(t->edge_sharpness, t->edge_count),
           points = count_sharp(t->vertex_sharpness, t->vertex_count);
  uint32_t *edges = tw_arena_alloc(c->arena, creases, 2 * sizeof *edges);
  float *edge_sharpness = tw_arena_alloc(c->arena, creases, sizeof *edge_sharpness);
  uint32_t *vertices = tw_arena_alloc(c->arena, points, sizeof *vertices);
  float *vertex_sharpness = tw_arena_alloc(c->arena, points, sizeof *vertex_sharpness);
  if (!edges || !edge_sharpness || !vertices || !vertex_sharpness) return TW_NO_MEMORY;
  c->tags = (tw_surface_tags){.crease_edges = edges,
                              .crease_sharpness = edge_sharpness,
                              .sharp_points = vertices,
                              .point_sharpness = vertex_sharpness};
  for (uint32_t e = 0; e < t->edge_count; e++) {
    if (!(t->edge_sharpness[e] > 0)) continue;
    memcpy(edges + 2 * (size_t)c->tags.crease_count, t->edge_vertices[e], 2 * sizeof *edges);
    edge_sharpness[c->tags.crease_count++] = t->edge_sharpness[e];
  }
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    if (!(t->vertex_sharpness[v] > 0)) continue;
    vertices[c->tags.sharp_point_count] = v;
    vertex_sharpness[c->tags.sharp_point_count++] = t->vertex_sharpness[v];
  }
  return TW_OK;
}

/* Marks the vertices at border edges that are not infinitely sharp by a crease. TW_BOUNDARY_NONE leaves out
 * the faces at these vertices: they have no surface. */
static tw_status mark_loose(const tw_cage *c, uint8_t **loose) {
  const tw_topology *t = &c->topology;
  *loose = tw_arena_alloc(c->arena, t->vertex_count, 1);
  if (!*loose) return TW_NO_MEMORY;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if ((t->edge_flags[e] & TW_EDGE_BORDER) && !tw_is_infinite(t->edge_sharpness[e]))
      (*loose)[t->edge_vertices[e][0]] = (*loose)[t->edge_vertices[e][1]] = 1;
  return TW_OK;
}

static bool touches(const tw_topology *t, uint32_t face, const uint8_t *marked) {
  for (uint32_t i = 0; i < tw_face_size(t, face); i++)
    if (marked[t->corner_vertex[tw_face_begin(t, face) + i]]) return true;
  return false;
}

/* Chooses the faces of the answer. Call it before sharpening: it looks at the mesh's own creases. */
static tw_status choose_visible(const tw_mesh *mesh, const tw_surface_options *options, tw_cage *c) {
  c->visible = tw_arena_alloc(c->arena, mesh->face_count, 1);
  if (!c->visible) return TW_NO_MEMORY;
  uint8_t *loose = NULL;
  if (options->boundary == TW_BOUNDARY_NONE && options->scheme != TW_BILINEAR && options->level > 0) {
    tw_status status = mark_loose(c, &loose);
    if (status != TW_OK) return status;
  }
  for (uint32_t f = 0; f < mesh->face_count; f++) c->visible[f] = !loose || !touches(&c->topology, f, loose);
  for (uint32_t i = 0; i < mesh->hole_count; i++) c->visible[mesh->holes[i]] = 0;
  return TW_OK;
}

/* NULL where all faces are triangles or all are quads: a topology then needs no offsets. */
static const uint32_t *offsets_of(const tw_mesh *mesh) {
  if (mesh->face_count == 0) return mesh->face_offsets;
  uint32_t size = mesh->face_offsets[1];
  if (size != 3 && size != 4) return mesh->face_offsets;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    if (mesh->face_offsets[f + 1] != size * (f + 1)) return mesh->face_offsets;
  return NULL;
}

/* Whether all vertices, and so all edges, are interior and manifold. */
static bool is_closed(const tw_topology *t) {
  uint8_t flags = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++) flags |= t->vertex_flags[v];
  return flags == 0;
}

tw_status tw_cage_read(const tw_mesh *mesh, const tw_surface_options *options, tw_arena *arena, tw_cage *c) {
  memset(c, 0, sizeof *c);
  c->arena = arena;
  const uint32_t *corners;
  uint32_t vertex_count;
  tw_status status = compact(mesh, c, &corners, &vertex_count);
  if (status == TW_OK)
    status = tw_topology_build(&c->topology, arena, vertex_count, mesh->face_count, offsets_of(mesh),
                               mesh->corner_count, corners);
  if (status == TW_OK) status = tw_topology_soften(&c->topology, arena);
  if (status != TW_OK) return status;
  apply_tags(mesh, c);
  if (tw_keeps_tags(mesh, options)) status = keep_tags(c);
  if (status == TW_OK) status = choose_visible(mesh, options, c);
  if (status != TW_OK) return status;
  tw_topology_sharpen(&c->topology, options->boundary == TW_BOUNDARY_EDGE_AND_CORNER);
  c->topology.smooth = mesh->crease_count == 0 && mesh->sharp_point_count == 0 && is_closed(&c->topology);
  return options->creasing == TW_CREASE_CHAIKIN ? tw_topology_sum_semi(&c->topology, arena) : TW_OK;
}

/* ---- counts ---------------------------------------------------------------------------------- */

/* The counts of the next level. */
static tw_surface_counts next_counts(tw_surface_counts c, bool loop) {
  if (loop)
    return (tw_surface_counts){c.vertices + c.edges, 2 * c.edges + c.corners, 4 * c.faces, 4 * c.corners};
  tw_surface_counts next = {c.vertices + c.edges + c.faces, 2 * c.edges + c.corners, c.corners,
                            4 * c.corners};
  return next;
}

static tw_surface_counts counts_at(tw_surface_counts cage, bool loop, uint32_t level) {
  /* Stops before 64 bits overflow. Only cages near 2^32 corners get there within TW_LEVEL_MAX levels, and
   * their counts are far over the limit by then. */
  for (uint32_t i = 0; i < level && cage.corners < UINT64_MAX / 16; i++) cage = next_counts(cage, loop);
  return cage;
}

tw_surface_counts tw_cage_counts_at(const tw_cage *cage, bool loop, uint32_t level) {
  const tw_topology *t = &cage->topology;
  return counts_at((tw_surface_counts){t->vertex_count, t->edge_count, t->face_count, t->corner_count}, loop,
                   level);
}

static tw_status fail_count(tw_error *error) {
  return tw_fail(error, TW_LIMIT, "the surface would have over 4,294,967,294 vertices, edges or faces");
}

/* Checks the limits. refined_faces: at the answer's level, those left out of the answer included, since
 * generic steps refine them too. */
static tw_status check_counts(const tw_surface_options *options, bool shrinks, const tw_surface_counts *c,
                              uint64_t refined_faces, tw_error *error) {
  uint64_t limit = UINT32_MAX - 1;
  if (c->vertices > limit || c->edges > limit || c->faces > limit) return fail_count(error);
  if (refined_faces <= TW_GENERIC_FACES_MAX || options->level < 2) return TW_OK;
  if (!shrinks && options->scheme != TW_LOOP) return TW_OK;
  return tw_fail(error, TW_LIMIT, "%s is limited to %d faces, holes included",
                 shrinks ? "boundary=open" : "scheme loop", TW_GENERIC_FACES_MAX);
}

/* Counts a mesh that shrinks from its border. */
static void count_open(const tw_surface_options *options, const tw_cage *c, tw_surface_counts *out,
                       uint64_t *refined_faces) {
  const tw_topology *t = &c->topology;
  uint32_t level = options->level;
  bool loop = options->scheme == TW_LOOP;
  *out = loop ? tw_loop_open_count(t, c->visible, level) : tw_open_count(t, c->visible, level);
  *refined_faces = (loop ? tw_loop_open_count(t, NULL, level) : tw_open_count(t, NULL, level)).faces;
}

bool tw_cage_shrinks(const tw_cage *cage, const tw_surface_options *options) {
  if (options->boundary != TW_BOUNDARY_OPEN || options->level == 0) return false;
  const tw_topology *t = &cage->topology;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (t->edge_flags[e] & TW_EDGE_BORDER) return true;
  return false;
}

tw_status tw_cage_count(const tw_surface_options *options, tw_cage *c, tw_surface_counts *out,
                        tw_error *error) {
  bool shrinks = tw_cage_shrinks(c, options);
  if (shrinks) {
    count_open(options, c, out, &c->refined_faces);
  } else {
    bool loop = options->scheme == TW_LOOP, whole = !memchr(c->visible, 0, c->topology.face_count);
    tw_surface_counts all = tw_cage_counts_at(c, loop, options->level);
    *out = whole ? all : counts_at(tw_count_faces(&c->topology, c->visible), loop, options->level);
    c->refined_faces = all.faces;
  }
  return check_counts(options, shrinks, out, c->refined_faces, error);
}

tw_status tw_cage_check_options(const tw_mesh *mesh, const tw_surface_options *options, tw_error *error) {
  if (options->level > TW_LEVEL_MAX) return tw_fail(error, TW_LIMIT, "level is over %d", TW_LEVEL_MAX);
  if (options->scheme != TW_LOOP) return TW_OK;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    if (mesh->face_offsets[f + 1] - mesh->face_offsets[f] != 3) {
      tw_fail(error, TW_INVALID, "scheme loop subdivides triangles only, this face has %u corners",
              mesh->face_offsets[f + 1] - mesh->face_offsets[f]);
      return tw_error_at(error, "/faces/%u", f);
    }
  return TW_OK;
}
