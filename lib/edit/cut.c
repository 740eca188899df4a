/* Cuts edges at new points, and the faces at these edges: loop_cut along a ring, subdivide anywhere. Both
 * faces at an edge get its new points as corners, so that no point lies on another face's edge.
 *
 * New points come in this order: those on edges, by edges (sorted by their lesser, then their greater point),
 * on each edge in the direction of edge_vertices; then those inside faces, by faces. */
#include <stdio.h>

#include "editor.h"

/* What a face becomes. */
typedef enum shape {
  SHAPE_KEPT,
  SHAPE_LONGER, /* one face with more corners */
  SHAPE_ACROSS, /* cut across, from one edge to another */
  SHAPE_QUADS,
  SHAPE_TRIANGLES
} shape;

typedef struct cutter {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  const uint8_t *cut; /* [edge_count] 0: not cut, 1: `at` runs along edge_vertices, 2: against */
  uint32_t cuts;
  const double *at;        /* [cuts] */
  bool is_ring;            /* only quads are cut, each from an edge to the opposite one */
  const uint8_t *selected; /* [face_count] faces whose parts count as made; NULL: all faces with parts */
  uint8_t *shapes;         /* [face_count] */
  uint32_t *edge_points;   /* [edge_count] first new point on each */
  uint32_t *corner_mixes;  /* [corner_count] first corner mix of the edge after each corner */
  uint32_t *inner_points;  /* [face_count] first new point inside each */
  uint32_t *inner_mixes;   /* [face_count] first corner mix inside each */
} cutter;

/* A new face corner: its point, and the parent of its corner data. */
typedef struct place {
  uint32_t point, parent;
} place;

static shape find_shape(const cutter *k, uint32_t face) {
  uint32_t begin = tw_face_begin(k->t, face), size = tw_face_size(k->t, face), count = 0, across = 0;
  for (uint32_t i = 0; i < size; i++) {
    if (!k->cut[k->t->corner_edge[begin + i]]) continue;
    across += size == 4 && i < 2 && k->cut[k->t->corner_edge[begin + i + 2]];
    count++;
  }
  if (count == 0) return SHAPE_KEPT;
  if (size == 4 && count == 4) return SHAPE_QUADS;
  if (size == 3 && count == 3 && !k->is_ring) return SHAPE_TRIANGLES;
  return count == 2 && (across == 1 || !k->is_ring) ? SHAPE_ACROSS : SHAPE_LONGER;
}

/* Adds the elements that a face becomes. */
static void count_face(const cutter *k, uint32_t face, tw_change_size *size) {
  uint64_t n = (uint64_t)k->cuts + 1, inner = 0, old = tw_face_size(k->t, face), cut_edges = 0;
  for (uint32_t c = 0; c < old; c++)
    cut_edges += k->cut[k->t->corner_edge[tw_face_begin(k->t, face) + c]] != 0;
  switch ((shape)k->shapes[face]) {
  case SHAPE_KEPT:
  case SHAPE_LONGER:
    size->faces++;
    size->corners += old + cut_edges * k->cuts;
    break;
  case SHAPE_ACROSS:
    size->faces += n;
    size->corners += old + 4 * (uint64_t)k->cuts;
    break;
  case SHAPE_QUADS:
    size->faces += n * n;
    size->corners += 4 * n * n;
    inner = (n - 1) * (n - 1);
    break;
  case SHAPE_TRIANGLES:
    size->faces += n * n;
    size->corners += 3 * n * n;
    inner = (n - 1) * (n - 2) / 2;
    break;
  }
  size->points += inner;
  size->mixes += cut_edges * k->cuts + 2 * inner;
  size->terms += 2 * cut_edges * k->cuts + 2 * old * inner;
}

static tw_status begin_change(cutter *k) {
  tw_arena *arena = k->editor->scratch;
  tw_change_size size = {.points = k->t->vertex_count};
  k->shapes = tw_arena_alloc_raw(arena, k->t->face_count, 1);
  k->edge_points = tw_arena_alloc_raw(arena, k->t->edge_count, sizeof(uint32_t));
  k->corner_mixes = tw_arena_alloc_raw(arena, k->t->corner_count, sizeof(uint32_t));
  k->inner_points = tw_arena_alloc_raw(arena, k->t->face_count, sizeof(uint32_t));
  k->inner_mixes = tw_arena_alloc_raw(arena, k->t->face_count, sizeof(uint32_t));
  if (!k->shapes || !k->edge_points || !k->corner_mixes || !k->inner_points || !k->inner_mixes)
    return tw_editor_no_memory(k->editor);
  for (uint32_t e = 0; e < k->t->edge_count; e++)
    if (k->cut[e]) {
      size.points += k->cuts;
      size.mixes += k->cuts;
      size.terms += 2 * (uint64_t)k->cuts;
    }
  for (uint32_t f = 0; f < k->t->face_count; f++) {
    k->shapes[f] = (uint8_t)find_shape(k, f);
    count_face(k, f, &size);
  }
  return tw_change_init(&k->change, k->editor, &size);
}

/* ---- points ---------------------------------------------------------------------------------- */

/* The fraction at which cut i of an edge lies, from edge_vertices[edge][0]. */
static double fraction(const cutter *k, uint32_t edge, uint32_t i) {
  return k->cut[edge] == 1 ? k->at[i] : 1 - k->at[k->cuts - 1 - i];
}

static bool is_along(const cutter *k, uint32_t corner) {
  return k->t->edge_vertices[k->t->corner_edge[corner]][0] == k->t->corner_vertex[corner];
}

static void cut_edges(cutter *k) {
  for (uint32_t e = 0; e < k->t->edge_count; e++) {
    k->edge_points[e] = k->change.point_count;
    for (uint32_t i = 0; k->cut[e] && i < k->cuts; i++) {
      double t = fraction(k, e, i);
      const tw_term terms[2] = {{k->t->edge_vertices[e][0], 1 - t}, {k->t->edge_vertices[e][1], t}};
      uint32_t mix = tw_change_mix(&k->change, terms, 2);
      tw_change_point(&k->change, k->t->vertex_count + mix, TW_CHANGE_MADE);
    }
  }
  for (uint32_t c = 0; c < k->t->corner_count; c++) {
    uint32_t edge = k->t->corner_edge[c], next = tw_corner_next(k->t, c);
    k->corner_mixes[c] = k->change.mix_count;
    for (uint32_t i = 0; k->cut[edge] && i < k->cuts; i++) {
      double t = fraction(k, edge, i);
      const tw_term terms[2] = {{is_along(k, c) ? c : next, 1 - t}, {is_along(k, c) ? next : c, t}};
      tw_change_mix(&k->change, terms, 2);
    }
  }
}

/* The place of cut i of the edge after a corner, counted from that corner. */
static place cut_place(const cutter *k, uint32_t corner, uint32_t i) {
  uint32_t at = is_along(k, corner) ? i : k->cuts - 1 - i;
  return (place){k->edge_points[k->t->corner_edge[corner]] + at,
                 k->t->corner_count + k->corner_mixes[corner] + at};
}

static place corner_place(const cutter *k, uint32_t corner) {
  return (place){k->t->corner_vertex[corner], corner};
}

/* The fraction at which that cut lies, measured from the corner. */
static double corner_fraction(const cutter *k, uint32_t corner, uint32_t i) {
  uint32_t edge = k->t->corner_edge[corner];
  return is_along(k, corner) ? fraction(k, edge, i) : 1 - fraction(k, edge, k->cuts - 1 - i);
}

/* The weights of the face's corners, [4] for a quad or [3] for a triangle, at a point inside it. Column s
 * counts from the first corner to the second, row r from the first to the last. */
static void inner_weights(const cutter *k, uint32_t face, uint32_t r, uint32_t s, double *out) {
  uint32_t begin = tw_face_begin(k->t, face);
  if (k->shapes[face] == SHAPE_TRIANGLES) {
    double n = (double)k->cuts + 1;
    out[1] = s / n;
    out[2] = r / n;
    out[0] = (n - r - s) / n;
    return;
  }
  double u = corner_fraction(k, begin, s - 1), v = 1 - corner_fraction(k, begin + 3, k->cuts - r);
  out[0] = (1 - u) * (1 - v);
  out[1] = u * (1 - v);
  out[2] = u * v;
  out[3] = (1 - u) * v;
}

/* The inner columns of a row begin at 1 and end before this one. */
static uint32_t row_end(const cutter *k, uint32_t face, uint32_t r) {
  return k->shapes[face] == SHAPE_QUADS ? k->cuts + 1 : k->cuts + 1 - r;
}

/* How many inner points of a face come before row r. */
static uint32_t inner_before(const cutter *k, uint32_t face, uint32_t r) {
  uint32_t rows = r - 1;
  if (k->shapes[face] == SHAPE_QUADS) return rows * k->cuts;
  return (uint32_t)((uint64_t)rows * (2 * (uint64_t)k->cuts - 1 - rows) / 2);
}

static void fill_inside(cutter *k, uint32_t face) {
  uint32_t begin = tw_face_begin(k->t, face), size = tw_face_size(k->t, face);
  bool is_inside = k->shapes[face] == SHAPE_QUADS || k->shapes[face] == SHAPE_TRIANGLES;
  k->inner_points[face] = k->change.point_count;
  for (int of_corners = 0; is_inside && of_corners < 2; of_corners++) {
    k->inner_mixes[face] = k->change.mix_count;
    for (uint32_t r = 1; r <= k->cuts; r++)
      for (uint32_t s = 1; s < row_end(k, face, r); s++) {
        double weights[4];
        tw_term terms[4];
        inner_weights(k, face, r, s, weights);
        for (uint32_t i = 0; i < size; i++)
          terms[i] = (tw_term){of_corners ? begin + i : k->t->corner_vertex[begin + i], weights[i]};
        uint32_t mix = tw_change_mix(&k->change, terms, size);
        if (!of_corners) tw_change_point(&k->change, k->t->vertex_count + mix, TW_CHANGE_MADE);
      }
  }
}

/* ---- faces ----------------------------------------------------------------------------------- */

/* Adds a corner. edge: the old edge that the edge after the corner is part of; UINT32_MAX: it crosses the
 * face. */
static void put(cutter *k, place at, uint32_t edge) {
  bool is_made = k->is_ring ? edge == UINT32_MAX : edge != UINT32_MAX && k->cut[edge];
  tw_change_corner(&k->change, at.point, at.parent, edge, is_made ? TW_CHANGE_MADE : 0);
}

static void end_face(cutter *k, uint32_t face) {
  bool has_parts = k->shapes[face] > SHAPE_LONGER;
  bool is_made = k->selected ? k->selected[face] != 0 : has_parts;
  tw_change_face(&k->change, face, is_made ? TW_CHANGE_MADE : 0);
}

/* A place of the grid over a face whose edges are all cut. */
static place grid_place(const cutter *k, uint32_t face, uint32_t r, uint32_t s) {
  uint32_t begin = tw_face_begin(k->t, face), n = k->cuts + 1;
  bool is_quad = k->shapes[face] == SHAPE_QUADS;
  uint32_t last = is_quad ? n : n - r; /* the row's last column */
  if (r == 0)
    return s == 0 ? corner_place(k, begin) : s == n ? corner_place(k, begin + 1) : cut_place(k, begin, s - 1);
  if (r == n) {
    if (is_quad && s == n) return corner_place(k, begin + 2);
    return s == 0 ? corner_place(k, begin + (is_quad ? 3 : 2)) : cut_place(k, begin + 2, n - 1 - s);
  }
  if (s == 0) return cut_place(k, begin + (is_quad ? 3 : 2), n - 1 - r);
  if (s == last) return cut_place(k, begin + 1, r - 1);
  uint32_t inner = inner_before(k, face, r) + s - 1;
  return (place){k->inner_points[face] + inner, k->t->corner_count + k->inner_mixes[face] + inner};
}

static void put_quad(cutter *k, uint32_t face, uint32_t r, uint32_t s) {
  const uint32_t *edges = k->t->corner_edge + tw_face_begin(k->t, face);
  put(k, grid_place(k, face, r, s), r == 0 ? edges[0] : UINT32_MAX);
  put(k, grid_place(k, face, r, s + 1), s == k->cuts ? edges[1] : UINT32_MAX);
  put(k, grid_place(k, face, r + 1, s + 1), r == k->cuts ? edges[2] : UINT32_MAX);
  put(k, grid_place(k, face, r + 1, s), s == 0 ? edges[3] : UINT32_MAX);
  end_face(k, face);
}

static void put_triangles(cutter *k, uint32_t face, uint32_t r, uint32_t s, bool is_first) {
  const uint32_t *edges = k->t->corner_edge + tw_face_begin(k->t, face);
  bool is_last = r + s == k->cuts;
  if (is_first) {
    put(k, grid_place(k, face, r, s), r == 0 ? edges[0] : UINT32_MAX);
    put(k, grid_place(k, face, r, s + 1), is_last ? edges[1] : UINT32_MAX);
    put(k, grid_place(k, face, r + 1, s), s == 0 ? edges[2] : UINT32_MAX);
    end_face(k, face);
  } else if (!is_last) {
    put(k, grid_place(k, face, r, s + 1), UINT32_MAX);
    put(k, grid_place(k, face, r + 1, s + 1), UINT32_MAX);
    put(k, grid_place(k, face, r + 1, s), UINT32_MAX);
    end_face(k, face);
  }
}

/* Adds the corners from `first` to `last` with the cuts on the edges between, but not those after `last`. */
static void put_run(cutter *k, uint32_t face, uint32_t first, uint32_t last) {
  uint32_t begin = tw_face_begin(k->t, face), size = tw_face_size(k->t, face);
  for (uint32_t i = first;; i = (i + 1) % size) {
    uint32_t edge = k->t->corner_edge[begin + i];
    put(k, corner_place(k, begin + i), edge);
    if (i == last) return;
    for (uint32_t cut = 0; k->cut[edge] && cut < k->cuts; cut++) put(k, cut_place(k, begin + i, cut), edge);
  }
}

static void put_longer(cutter *k, uint32_t face) {
  uint32_t begin = tw_face_begin(k->t, face), last = tw_face_size(k->t, face) - 1;
  uint32_t edge = k->t->corner_edge[begin + last];
  put_run(k, face, 0, last);
  for (uint32_t cut = 0; k->cut[edge] && cut < k->cuts; cut++) put(k, cut_place(k, begin + last, cut), edge);
  end_face(k, face);
}

/* Adds the parts of a face cut from edge i to edge j: first the part with the first corner, then those
 * between, then the part after edge i. */
static void put_across(cutter *k, uint32_t face, bool is_first) {
  uint32_t begin = tw_face_begin(k->t, face), size = tw_face_size(k->t, face), i = 0, n = k->cuts;
  while (!k->cut[k->t->corner_edge[begin + i]]) i++;
  uint32_t j = i + 1;
  while (!k->cut[k->t->corner_edge[begin + j]]) j++;
  uint32_t edge_i = k->t->corner_edge[begin + i], edge_j = k->t->corner_edge[begin + j];
  if (is_first) {
    put_run(k, face, (j + 1) % size, i);
    put(k, cut_place(k, begin + i, 0), UINT32_MAX);
    put(k, cut_place(k, begin + j, n - 1), edge_j);
    end_face(k, face);
    return;
  }
  for (uint32_t part = 0; part + 1 < n; part++) {
    put(k, cut_place(k, begin + i, part), edge_i);
    put(k, cut_place(k, begin + i, part + 1), UINT32_MAX);
    put(k, cut_place(k, begin + j, n - 2 - part), edge_j);
    put(k, cut_place(k, begin + j, n - 1 - part), UINT32_MAX);
    end_face(k, face);
  }
  put(k, cut_place(k, begin + i, n - 1), edge_i);
  put_run(k, face, i + 1, j);
  put(k, cut_place(k, begin + j, 0), UINT32_MAX);
  end_face(k, face);
}

/* Adds the first part of a face, or all its other parts. */
static void put_face(cutter *k, uint32_t face, bool is_first) {
  uint32_t n = k->cuts + 1;
  switch ((shape)k->shapes[face]) {
  case SHAPE_KEPT:
    if (is_first) tw_change_keep_face(&k->change, face, NULL, 0);
    break;
  case SHAPE_LONGER:
    if (is_first) put_longer(k, face);
    break;
  case SHAPE_ACROSS: put_across(k, face, is_first); break;
  case SHAPE_QUADS:
    for (uint32_t r = 0; r < (is_first ? 1 : n); r++)
      for (uint32_t s = 0; s < (is_first ? 1 : n); s++)
        if (is_first || r + s > 0) put_quad(k, face, r, s);
    break;
  case SHAPE_TRIANGLES:
    for (uint32_t r = 0; r < (is_first ? 1 : n); r++)
      for (uint32_t s = 0; s < (is_first ? 1 : n - r); s++) {
        if (is_first || r + s > 0) put_triangles(k, face, r, s, true);
        if (!is_first) put_triangles(k, face, r, s, false);
      }
    break;
  }
}

static tw_status cut(cutter *k) {
  tw_status status = begin_change(k);
  if (status != TW_OK) return status;
  tw_change_keep_points(&k->change);
  cut_edges(k);
  for (uint32_t f = 0; f < k->t->face_count; f++) fill_inside(k, f);
  for (uint32_t f = 0; f < k->t->face_count; f++) put_face(k, f, true);
  for (uint32_t f = 0; f < k->t->face_count; f++) put_face(k, f, false);
  return tw_editor_apply(k->editor, &k->change);
}

/* ---- the edits ------------------------------------------------------------------------------- */

static tw_status check_cuts(const tw_editor *e, uint32_t cuts) {
  if (cuts >= 1 && cuts <= TW_EDIT_CUTS_MAX) return TW_OK;
  return tw_editor_fail(e, TW_INVALID, "/cuts", "an edge is cut 1 to %d times", TW_EDIT_CUTS_MAX);
}

static tw_status check_places(const tw_editor *e, const double *at, uint32_t cuts) {
  for (uint32_t i = 0; i < cuts; i++) {
    if (at[i] > (i == 0 ? 0 : at[i - 1]) && at[i] < 1) continue;
    char place[32];
    snprintf(place, sizeof place, "/at/%u", i);
    return tw_editor_fail(e, TW_INVALID, place, "cuts are between 0 and 1, each behind the one before");
  }
  return TW_OK;
}

/* NULL without memory. */
static const double *even_places(tw_arena *arena, uint32_t cuts) {
  double *out = tw_arena_alloc_raw(arena, cuts, sizeof *out);
  for (uint32_t i = 0; out && i < cuts; i++) out[i] = (i + 1) / ((double)cuts + 1);
  return out;
}

tw_status tw_edit_loop_cut(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  uint32_t edge;
  tw_status status = check_cuts(editor, edit->loop_cut.cuts);
  if (status == TW_OK && edit->loop_cut.at)
    status = check_places(editor, edit->loop_cut.at, edit->loop_cut.cuts);
  if (status == TW_OK) status = tw_editor_find_edge(editor, edit->loop_cut.edge, "/edge", &edge);
  if (status != TW_OK) return status;
  cutter k = {.editor = editor, .t = editor->topology, .cuts = edit->loop_cut.cuts, .is_ring = true};
  uint8_t *ring = tw_arena_alloc(editor->scratch, k.t->edge_count, 1);
  k.at = edit->loop_cut.at ? edit->loop_cut.at : even_places(editor->scratch, k.cuts);
  if (!ring || !k.at) return tw_editor_no_memory(editor);
  tw_find_ring(k.t, edge, ring);
  /* The ring's flags are relative to edge_vertices of `edge`; `at` runs from the edit's edge[0]. */
  if (k.t->edge_vertices[edge][0] != edit->loop_cut.edge[0])
    for (uint32_t e = 0; e < k.t->edge_count; e++) ring[e] = ring[e] ? 3 - ring[e] : 0;
  uint32_t edges = 0;
  for (uint32_t e = 0; e < k.t->edge_count; e++) edges += ring[e] != 0;
  if (edges < 2) {
    if (edit->is_optional) return TW_OK;
    return tw_editor_fail(editor, TW_INVALID, "/edge", "no face of four corners is at this edge");
  }
  k.cut = ring;
  return cut(&k);
}

tw_status tw_edit_subdivide(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  uint8_t *selected;
  tw_status status = check_cuts(editor, edit->subdivide.cuts);
  if (status == TW_OK) status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  cutter k = {.editor = editor, .t = editor->topology, .cuts = edit->subdivide.cuts};
  uint8_t *edges = tw_arena_alloc(editor->scratch, k.t->edge_count, 1);
  k.at = even_places(editor->scratch, k.cuts);
  if (!edges || !k.at) return tw_editor_no_memory(editor);
  bool is_faces = edit->selection.of == TW_EDIT_FACES;
  if (is_faces) k.selected = selected;
  for (uint32_t c = 0; is_faces && c < k.t->corner_count; c++)
    if (selected[k.t->corner_face[c]]) edges[k.t->corner_edge[c]] = 1;
  /* A selected ring has flags 1 and 2 for directions, which evenly spaced cuts do not need. */
  for (uint32_t e = 0; !is_faces && e < k.t->edge_count; e++) edges[e] = selected[e] != 0;
  k.cut = edges;
  return cut(&k);
}
