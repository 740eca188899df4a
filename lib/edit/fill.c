/* Closes holes by a face each, which runs against the border, or by triangles. */
#include "editor.h"
#include "hole.h"

typedef struct filler {
  tw_editor *editor;
  const tw_topology *t;
  uint8_t *is_seen; /* [edge_count] of edges of the border */
  uint32_t *walk;   /* [walk_count] corners behind which the border's edges are, against their direction */
  uint32_t walk_count;
  uint32_t *place_of; /* [vertex_count] 1 + where in the walk the edge is that runs from each, or 0 */
  uint32_t *corners;  /* [corner_count] of the holes, as in the walk */
  uint32_t *holes;    /* [hole_count + 1] first of each */
  uint32_t hole_count, corner_count;
  uint32_t (
      *triangles)[3]; /* [corner_count - 2 hole_count] places in each hole, one after the other; NULL: no */
} filler;

static bool is_border(const tw_topology *t, uint32_t corner) {
  return (t->edge_flags[t->corner_edge[corner]] & TW_EDGE_BORDER) != 0;
}

/* The corner with the border's edge that ends where that of another one begins: round the faces between.
 * UINT32_MAX where an edge there is not one of two faces. Each corner of a fan is passed once. */
static uint32_t before_on_border(const tw_topology *t, uint32_t corner) {
  for (corner = tw_corner_previous(t, corner); !is_border(t, corner);
       corner = tw_corner_previous(t, t->sibling[corner]))
    if (t->edge_flags[t->corner_edge[corner]] & TW_EDGE_NONMANIFOLD) return UINT32_MAX;
  return corner;
}

/* Where a hole's side runs from: against the face's. */
static uint32_t start_of(const filler *h, uint32_t corner) {
  return h->t->corner_vertex[tw_corner_next(h->t, corner)];
}

/* Takes edges from the walk's end, back to place `from`: a loop. It is a hole where the edit asks for it.
 * only: the corner whose edge has to be in it, or UINT32_MAX. */
static void take_loop(filler *h, uint32_t from, uint32_t only) {
  uint32_t size = h->walk_count - from, most = h->editor->edit->fill.max_edges;
  bool is_asked = only == UINT32_MAX;
  for (uint32_t i = from; i < h->walk_count; i++) {
    is_asked |= h->walk[i] == only;
    h->place_of[start_of(h, h->walk[i])] = 0;
  }
  if (is_asked && size >= 3 && (most == 0 || size <= most)) {
    for (uint32_t i = from; i < h->walk_count; i++) h->corners[h->corner_count++] = h->walk[i];
    h->holes[++h->hole_count] = h->corner_count;
  }
  h->walk_count = from;
}

/* Walks along the border from a corner's edge. Where the walk comes to a point again, a loop ends that lies
 * on one side of it: borders that meet in a point are holes of their own. */
static void walk_border(filler *h, uint32_t first, uint32_t only) {
  uint32_t corner = first;
  do {
    uint32_t start = start_of(h, corner);
    if (h->place_of[start] > 0) take_loop(h, h->place_of[start] - 1, only);
    h->is_seen[h->t->corner_edge[corner]] = 1;
    h->walk[h->walk_count++] = corner;
    h->place_of[start] = h->walk_count;
    corner = before_on_border(h->t, corner);
  } while (corner != UINT32_MAX && !h->is_seen[h->t->corner_edge[corner]]);
  if (corner == first) take_loop(h, 0, only);
  while (h->walk_count > 0) h->place_of[start_of(h, h->walk[--h->walk_count])] = 0;
}

static tw_status find_holes(filler *h) {
  const tw_edit *edit = h->editor->edit;
  if (!edit->fill.has_border) {
    for (uint32_t c = 0; c < h->t->corner_count; c++)
      if (is_border(h->t, c) && !h->is_seen[h->t->corner_edge[c]]) walk_border(h, c, UINT32_MAX);
    if (h->hole_count > 0 || edit->is_optional) return TW_OK;
    return tw_editor_fail(h->editor, TW_INVALID, "", "there is no hole to fill");
  }
  uint32_t edge;
  tw_status status = tw_editor_find_edge(h->editor, edit->fill.border, "/border", &edge);
  if (status != TW_OK) return status;
  uint32_t corner = h->t->edge_corner[edge];
  if (!is_border(h->t, corner)) {
    if (edit->is_optional) return TW_OK;
    return tw_editor_fail(h->editor, TW_INVALID, "/border", "the edge is not on a border");
  }
  walk_border(h, corner, corner);
  if (h->hole_count > 0 || edit->is_optional) return TW_OK;
  return tw_editor_fail(h->editor, TW_INVALID, "/border",
                        "the border is no loop of at least three edges and at most max_edges");
}

/* Covers every hole. TW_NO_MEMORY. */
static tw_status triangulate(filler *h) {
  tw_arena *arena = h->editor->arena;
  tw_hole_budget budget = tw_hole_budget_of(h->editor);
  uint32_t *points = tw_arena_alloc_raw(arena, h->corner_count, sizeof *points), count = 0;
  h->triangles = tw_arena_alloc_raw(arena, h->corner_count, sizeof *h->triangles);
  if (!points || !h->triangles) return tw_editor_no_memory(h->editor);
  for (uint32_t i = 0; i < h->corner_count; i++) points[i] = start_of(h, h->corners[i]);
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < h->hole_count && status == TW_OK; i++) {
    uint32_t first = h->holes[i], size = h->holes[i + 1] - first;
    status = tw_hole_triangulate(h->editor, points + first, size, &budget, h->triangles + count);
    count += size - 2;
  }
  return status;
}

/* A corner at a place of a hole has the texture coordinates of the faces on the other side. */
static void put_corner(const filler *h, tw_change *change, uint32_t place, bool is_side) {
  const tw_topology *t = h->t;
  uint32_t corner = h->corners[place], next = tw_corner_next(t, corner);
  tw_change_corner(change, t->corner_vertex[next], next, is_side ? t->corner_edge[corner] : UINT32_MAX,
                   TW_CHANGE_MADE);
}

static void put_hole(const filler *h, tw_change *change, uint32_t hole) {
  uint32_t first = h->holes[hole], size = h->holes[hole + 1] - first;
  uint32_t parent = h->t->corner_face[h->corners[first]];
  if (!h->triangles) {
    for (uint32_t i = 0; i < size; i++) put_corner(h, change, first + i, true);
    tw_change_face(change, parent, TW_CHANGE_NEW | TW_CHANGE_MADE);
    return;
  }
  /* Two triangles fewer than corners for each hole before. */
  for (uint32_t i = first - 2 * hole; i < first - 2 * hole + size - 2; i++) {
    for (int k = 0; k < 3; k++) {
      uint32_t place = h->triangles[i][k], behind = h->triangles[i][(k + 1) % 3];
      put_corner(h, change, first + place, (place + 1) % size == behind);
    }
    tw_change_face(change, parent, TW_CHANGE_NEW | TW_CHANGE_MADE);
  }
}

tw_status tw_edit_fill(tw_editor *editor) {
  tw_status status = tw_editor_need_topology(editor);
  if (status != TW_OK) return status;
  const tw_topology *t = editor->topology;
  filler h = {.editor = editor, .t = t};
  uint32_t borders = 0;
  for (uint32_t e = 0; e < t->edge_count; e++) borders += (t->edge_flags[e] & TW_EDGE_BORDER) != 0;
  h.is_seen = tw_arena_alloc(editor->arena, t->edge_count, 1);
  h.corners = tw_arena_alloc_raw(editor->arena, borders, sizeof *h.corners);
  h.walk = tw_arena_alloc_raw(editor->arena, borders, sizeof *h.walk);
  h.place_of = tw_arena_alloc(editor->arena, t->vertex_count, sizeof *h.place_of);
  h.holes = tw_arena_alloc(editor->arena, (size_t)borders + 1, sizeof *h.holes);
  if (!h.is_seen || !h.corners || !h.walk || !h.place_of || !h.holes) return tw_editor_no_memory(editor);
  status = find_holes(&h);
  if (status != TW_OK || h.hole_count == 0) return status;
  if (editor->edit->fill.method == TW_FILL_TRIANGLES) status = triangulate(&h);
  if (status != TW_OK) return status;
  tw_change change;
  uint64_t triangles = (uint64_t)h.corner_count - 2 * (uint64_t)h.hole_count;
  const tw_change_size size = {.points = t->vertex_count,
                               .faces = (uint64_t)t->face_count + (h.triangles ? triangles : h.hole_count),
                               .corners = (uint64_t)t->corner_count +
                                          (h.triangles ? 3 * triangles : h.corner_count)};
  status = tw_change_init(&change, editor, &size);
  if (status != TW_OK) return status;
  tw_change_keep_points(&change);
  for (uint32_t f = 0; f < t->face_count; f++) tw_change_keep_face(&change, f, NULL, 0);
  for (uint32_t i = 0; i < h.hole_count; i++) put_hole(&h, &change, i);
  return tw_editor_apply(editor, &change);
}
