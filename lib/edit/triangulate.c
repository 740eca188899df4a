/* Triangulate and quads: cuts faces into triangles, and joins pairs of triangles into quads. */
#include <stdlib.h>
#include <string.h>

#include "ear_clipping.h"
#include "editor.h"
#include "quad_pairing.h"

typedef struct cutter {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  const uint8_t *selected;
  uint8_t *is_cut;          /* [face_count] */
  uint32_t (*triangles)[3]; /* [triangle_count] of the faces that are cut, as corner indices within each */
  uint32_t triangle_count;
  tw_ear_clipper clipper;
  const float **at; /* [largest face] */
} cutter;

/* ---- a quad: the shorter diagonal ---------------------------------------------------------------------- */

static void triangle_normal(const tw_editor *e, const uint32_t corners[3], double out[3]) {
  const float *at[3];
  double a[3], b[3];
  for (int k = 0; k < 3; k++) at[k] = tw_editor_point(e, e->mesh.corners[corners[k]]);
  tw_side3(at[0], at[1], a);
  tw_side3(at[0], at[2], b);
  tw_cross3(a, b, out);
}

/* The squared distance of two corners. */
static double distance(const tw_editor *e, uint32_t a, uint32_t b) {
  double side[3];
  tw_side3(tw_editor_point(e, e->mesh.corners[a]), tw_editor_point(e, e->mesh.corners[b]), side);
  return tw_dot3(side, side);
}

/* Whether a quad's halves along the diagonal from corner `first` (0 or 1) face the same way: then the
 * diagonal lies inside. */
static bool is_inside(const tw_editor *e, uint32_t begin, uint32_t first) {
  double a[3], b[3];
  triangle_normal(e, (uint32_t[]){begin + first, begin + first + 1, begin + first + 2}, a);
  triangle_normal(e, (uint32_t[]){begin + first, begin + first + 2, begin + (first + 3) % 4}, b);
  return tw_dot3(a, b) > 0;
}

/* Cuts a quad along a diagonal, except where both diagonals join a point to itself. */
static void cut_quad(cutter *k, uint32_t begin) {
  const tw_editor *e = k->editor;
  const uint32_t *points = k->t->corner_vertex + begin;
  bool first = is_inside(e, begin, 0), second = is_inside(e, begin, 1);
  bool is_second =
      first == second ? distance(e, begin + 1, begin + 3) < distance(e, begin, begin + 2) : second;
  const uint32_t triangles[2][2][3] = {{{0, 1, 2}, {0, 2, 3}}, {{0, 1, 3}, {1, 2, 3}}};
  if (points[0] == points[2]) is_second = true;
  if (points[1] == points[3]) is_second = false;
  if (points[is_second] == points[is_second + 2]) return;
  memcpy(k->triangles + k->triangle_count, triangles[is_second], sizeof triangles[0]);
  k->triangle_count += 2;
}

/* ---- larger faces: ears -------------------------------------------------------------------------------- */

/* Cuts off ears one after the other. The face stays whole where it has a point twice and cannot be cut up.
 * TW_CANCELLED, TW_NO_MEMORY. */
static tw_status cut_ears(cutter *k, uint32_t face) {
  const uint32_t *points = k->t->corner_vertex + tw_face_begin(k->t, face);
  uint32_t size = tw_face_size(k->t, face), count = 0;
  for (uint32_t i = 0; i < size; i++) k->at[i] = tw_editor_point(k->editor, points[i]);
  tw_ear_clipper_take(&k->clipper, k->at, size);
  tw_status status = tw_ear_clipper_cut(&k->clipper, points, k->editor->limits->parallel,
                                        k->triangles + k->triangle_count, &count);
  k->triangle_count += count;
  if (status == TW_CANCELLED) return tw_fail(k->editor->error, status, "the edits are not wanted any more");
  return status == TW_NO_MEMORY ? tw_editor_no_memory(k->editor) : status;
}

/* ---- triangulate --------------------------------------------------------------------------------------- */

static void put_triangle(cutter *k, uint32_t face, const uint32_t places[3]) {
  const tw_topology *t = k->t;
  uint32_t begin = tw_face_begin(t, face), size = tw_face_size(t, face);
  for (int i = 0; i < 3; i++) {
    uint32_t corner = begin + places[i];
    bool is_side = (places[i] + 1) % size == places[(i + 1) % 3];
    tw_change_corner(&k->change, t->corner_vertex[corner], corner,
                     is_side ? t->corner_edge[corner] : UINT32_MAX, is_side ? 0 : TW_CHANGE_MADE);
  }
  tw_change_face(&k->change, face, TW_CHANGE_MADE);
}

/* Cuts a selected face. Adds its first triangle, or a face that stays whole. TW_CANCELLED. */
static tw_status put_first(cutter *k, uint32_t face) {
  uint32_t size = tw_face_size(k->t, face), first = k->triangle_count;
  tw_status status = TW_OK;
  if (k->selected[face] && size == 4) cut_quad(k, tw_face_begin(k->t, face));
  if (k->selected[face] && size > 4) status = cut_ears(k, face);
  k->is_cut[face] = k->triangle_count > first;
  if (k->is_cut[face])
    put_triangle(k, face, k->triangles[first]);
  else
    tw_change_keep_face(&k->change, face, NULL, k->selected[face] ? TW_CHANGE_MADE : 0);
  return status;
}

/* Adds all triangles of cut faces but the first ones. */
static void put_others(cutter *k) {
  uint32_t first = 0;
  for (uint32_t f = 0; f < k->t->face_count; f++) {
    if (!k->is_cut[f]) continue;
    uint32_t count = tw_face_size(k->t, f) - 2;
    for (uint32_t i = 1; i < count; i++) put_triangle(k, f, k->triangles[first + i]);
    first += count;
  }
}

tw_status tw_edit_triangulate(tw_editor *editor) {
  uint8_t *selected;
  tw_status status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  cutter k = {.editor = editor, .t = editor->topology, .selected = selected};
  tw_change_size size = {.points = k.t->vertex_count, .faces = k.t->face_count, .corners = k.t->corner_count};
  uint32_t largest = 4;
  for (uint32_t f = 0; f < k.t->face_count; f++) {
    uint32_t corners = tw_face_size(k.t, f);
    if (!selected[f]) continue;
    if (corners > largest) largest = corners;
    size.faces += corners - 3;
    size.corners += 2 * ((uint64_t)corners - 3);
  }
  status = tw_change_init(&k.change, editor, &size);
  if (status != TW_OK) return status;
  k.is_cut = tw_arena_alloc_raw(editor->scratch, k.t->face_count, 1);
  k.triangles = tw_arena_alloc_raw(editor->scratch, size.faces, sizeof *k.triangles);
  k.at = tw_arena_alloc_raw(editor->scratch, largest, sizeof *k.at);
  if (!k.is_cut || !k.triangles || !k.at || !tw_ear_clipper_init(&k.clipper, editor->scratch, largest))
    return tw_editor_no_memory(editor);
  tw_change_keep_points(&k.change);
  for (uint32_t f = 0; f < k.t->face_count && status == TW_OK; f++) status = put_first(&k, f);
  if (status != TW_OK) return status;
  put_others(&k);
  return tw_editor_apply(editor, &k.change);
}

/* ---- quads --------------------------------------------------------------------------------------------- */

typedef struct candidate {
  double quality;
  uint32_t edge, faces[2], quad[4];
} candidate;

static int compare_candidates(const void *left, const void *right) {
  const candidate *a = left, *b = right;
  if (a->quality != b->quality) return a->quality > b->quality ? -1 : 1;
  return a->edge < b->edge ? -1 : a->edge > b->edge;
}

/* is_hole: [face_count]. A hole beside a face of the surface would hide it, or be closed. */
static bool same_groups(const tw_mesh *mesh, const uint8_t *is_hole, const uint32_t faces[2]) {
  return is_hole[faces[0]] == is_hole[faces[1]] &&
         (!mesh->face_groups || mesh->face_groups[faces[0]] == mesh->face_groups[faces[1]]) &&
         (!mesh->face_smoothing || mesh->face_smoothing[faces[0]] == mesh->face_smoothing[faces[1]]);
}

/* Lists the edges at which two selected triangles could become a quad, except creases and edges between
 * groups, or at holes. is_kept: [edge_count] the creases. is_hole: [face_count]. */
static uint32_t find_candidates(const tw_editor *e, const uint8_t *selected, const uint8_t *is_kept,
                                const uint8_t *is_hole, candidate *out) {
  const tw_topology *t = e->topology;
  uint32_t count = 0;
  for (uint32_t i = 0; i < t->edge_count; i++) {
    candidate c = {
        .edge = i,
        .faces = {tw_corner_face(t, t->edge_corner[i]), tw_corner_face(t, t->sibling[t->edge_corner[i]])}};
    if (t->edge_flags[i] || is_kept[i] || !selected[c.faces[0]] || !selected[c.faces[1]] ||
        !same_groups(&e->mesh, is_hole, c.faces))
      continue;
    c.quality = tw_pair_quality(&e->mesh, c.faces[0], c.faces[1], c.quad);
    if (c.quality > 0) out[count++] = c;
  }
  return count;
}

/* A quad takes the place of the first of its halves. */
static void put_pair(tw_change *change, const tw_topology *t, const candidate *c) {
  for (int i = 0; i < 4; i++) {
    uint32_t corner = c->quad[i], edge = t->corner_edge[corner];
    /* In its own triangle, this corner's half-edge may be the shared edge; the quad's side then belongs to
     * the other triangle. */
    if (edge == c->edge) {
      uint32_t other = t->sibling[corner];
      edge = t->corner_edge[tw_corner_next(t, other)];
    }
    tw_change_corner(change, t->corner_vertex[corner], corner, edge, 0);
  }
  tw_change_face(change, c->faces[0] < c->faces[1] ? c->faces[0] : c->faces[1], TW_CHANGE_MADE);
}

tw_status tw_edit_quads(tw_editor *editor) {
  uint8_t *selected;
  tw_status status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  const tw_mesh *mesh = &editor->mesh;
  const tw_topology *t = editor->topology;
  uint8_t *is_kept = tw_arena_alloc(editor->scratch, t->edge_count, 1);
  candidate *candidates = tw_arena_alloc_raw(editor->scratch, t->edge_count, sizeof *candidates);
  uint32_t *pair_of = tw_arena_alloc_raw(editor->scratch, t->face_count, sizeof *pair_of);
  uint8_t *is_hole = tw_arena_alloc(editor->scratch, t->face_count, 1);
  if (!is_kept || !candidates || !pair_of || !is_hole) return tw_editor_no_memory(editor);
  for (uint32_t i = 0; i < mesh->hole_count; i++) is_hole[mesh->holes[i]] = 1;
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    uint32_t edge =
        tw_topology_find_edge(t, mesh->crease_edges[2 * (size_t)i], mesh->crease_edges[2 * (size_t)i + 1]);
    if (edge != UINT32_MAX && mesh->crease_sharpness[i] > 0) is_kept[edge] = 1;
  }
  uint32_t count = find_candidates(editor, selected, is_kept, is_hole, candidates);
  status = tw_sort(candidates, count, sizeof *candidates, compare_candidates);
  if (status != TW_OK) return status == TW_NO_MEMORY ? tw_editor_no_memory(editor) : tw_editor_go_on(editor);
  memset(pair_of, 0xFF, t->face_count * sizeof *pair_of);
  for (uint32_t i = 0; i < count; i++) {
    const candidate *c = &candidates[i];
    if (pair_of[c->faces[0]] == UINT32_MAX && pair_of[c->faces[1]] == UINT32_MAX)
      pair_of[c->faces[0]] = pair_of[c->faces[1]] = i;
  }
  tw_change change;
  const tw_change_size size = {.points = t->vertex_count, .faces = t->face_count, .corners = t->corner_count};
  status = tw_change_init(&change, editor, &size);
  if (status != TW_OK) return status;
  tw_change_keep_points(&change);
  for (uint32_t f = 0; f < t->face_count; f++) {
    const candidate *c = pair_of[f] == UINT32_MAX ? NULL : &candidates[pair_of[f]];
    if (!c)
      tw_change_keep_face(&change, f, NULL, 0);
    else if (f < c->faces[0] || f < c->faces[1])
      put_pair(&change, t, c);
  }
  return tw_editor_apply(editor, &change);
}
