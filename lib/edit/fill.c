/* Closes holes, each by a face that runs along the border against the faces there, or by a patch of
 * triangles. */

#include "editor.h"
#include "hole.h"

typedef struct filler {
  tw_editor *editor;
  const tw_topology *t;
  uint8_t *is_seen; /* [edge_count] of border edges: walked already */
  uint32_t *walk;   /* [walk_count] corners before the border's edges, which the walk follows against their
                       direction */
  uint32_t walk_count;
  uint32_t *place_of; /* [vertex_count] 1 + the index in the walk of the edge that starts there, or 0 */
  uint32_t *corners;  /* [corner_count] of all holes, as in the walk */
  uint32_t *holes;    /* [hole_count + 1] first corner of each */
  uint32_t hole_count, corner_count;
  tw_hole_patch *patches; /* [hole_count] malloc'ed; NULL: each hole gets a face */
} filler;

static bool is_border(const tw_topology *t, uint32_t corner) {
  return (t->edge_flags[t->corner_edge[corner]] & TW_EDGE_BORDER) != 0;
}

/* The corner before the border edge that ends where another corner's border edge starts, found by walking
 * round the faces between. UINT32_MAX where an edge on the way is non-manifold. Passes each corner of a fan
 * once. */
static uint32_t before_on_border(const tw_topology *t, uint32_t corner) {
  for (corner = tw_corner_previous(t, corner); !is_border(t, corner);
       corner = tw_corner_previous(t, t->sibling[corner]))
    if (t->edge_flags[t->corner_edge[corner]] & TW_EDGE_NONMANIFOLD) return UINT32_MAX;
  return corner;
}

/* Where a hole's side starts: it runs against the face's edge. */
static uint32_t start_of(const filler *h, uint32_t corner) {
  return h->t->corner_vertex[tw_corner_next(h->t, corner)];
}

/* Removes the edges from index `from` on from the walk: they form a loop. It becomes a hole if the edit asks
 * for it. only: the corner whose edge has to be in the loop, or UINT32_MAX. */
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

/* Walks along the border from a corner's edge. Where the walk returns to a point, it closes a loop: borders
 * that meet in a point are separate holes. */
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

/* ---- patches --------------------------------------------------------------------------------- */

static void drop_patches(filler *h) {
  for (uint32_t i = 0; h->patches && i < h->hole_count; i++) tw_hole_patch_deinit(&h->patches[i]);
  tw_free(h->patches);
}

typedef struct hole_size {
  uint32_t size, hole;
} hole_size;

static int compare_sizes(const void *left, const void *right) {
  const hole_size *a = left, *b = right;
  if (a->size != b->size) return a->size < b->size ? -1 : 1;
  return a->hole < b->hole ? -1 : a->hole > b->hole;
}

/* Notes the work that was done: what is gone of the budget. */
static void count_work(tw_editor *e, const tw_hole_work *budget, const tw_hole_work *left) {
  e->hole_work.triangles += budget->triangles - left->triangles;
  e->hole_work.steps += budget->steps - left->steps;
  e->hole_work.points += budget->points - left->points;
}

/* Makes the patch of a hole, whose loop is set. room: for points of its own. */
static tw_status make_patch(tw_hole_patch *p, const tw_editor *e, const tw_rings *rings, uint64_t *room,
                            tw_hole_work *left) {
  tw_status status = tw_editor_go_on(e);
  if (status == TW_OK) status = tw_hole_patch_triangulate(p, e, left);
  if (status == TW_OK && rings) {
    status = tw_hole_patch_refine(p, e, rings, *room, left->points);
    if (status != TW_OK) return status;
    *room -= p->point_count - p->loop_count;
    left->points -= p->point_count - p->loop_count;
    status = tw_hole_patch_fair(p, e, rings, left);
  }
  if (status == TW_OK) tw_hole_patch_finish(p);
  return status;
}

/* How many points patches may have of their own: each brings two faces. */
static uint64_t room_for_points(const tw_editor *e) {
  const tw_edit_limits *limits = e->limits;
  uint64_t faces = limits->faces > e->mesh.face_count ? limits->faces - e->mesh.face_count : 0;
  return limits->points < faces / 2 ? limits->points : faces / 2;
}

/* Makes the patches of all holes, small holes first: they have the fewest possible covers. TW_LIMIT,
 * TW_CANCELLED, TW_NO_MEMORY. */
static tw_status make_patches(filler *h) {
  tw_editor *e = h->editor;
  bool is_fair = e->edit->fill.method == TW_FILL_FAIR;
  const tw_hole_work budget = tw_hole_budget_of(e);
  tw_hole_work left = budget;
  tw_rings rings;
  uint32_t *points = tw_arena_alloc_raw(e->scratch, h->corner_count, sizeof *points);
  hole_size *order = tw_arena_alloc_raw(e->scratch, h->hole_count, sizeof *order);
  uint64_t room = room_for_points(e);
  h->patches = tw_alloc_zero(h->hole_count, sizeof *h->patches);
  if (!points || !order || !h->patches) return tw_editor_no_memory(e);
  for (uint32_t i = 0; i < h->corner_count; i++) points[i] = start_of(h, h->corners[i]);
  for (uint32_t i = 0; i < h->hole_count; i++) order[i] = (hole_size){h->holes[i + 1] - h->holes[i], i};
  tw_patch_edges edges;
  tw_status status = tw_sort(order, h->hole_count, sizeof *order, compare_sizes);
  if (status == TW_OK) status = tw_patch_edges_init(&edges, e, h->corner_count);
  if (status == TW_OK && is_fair) status = tw_rings_find(&rings, e);
  for (uint32_t i = 0; i < h->hole_count && status == TW_OK; i++) {
    tw_hole_patch *p = &h->patches[order[i].hole];
    p->loop = points + h->holes[order[i].hole];
    p->edges = &edges;
    p->loop_count = order[i].size;
    status = make_patch(p, e, is_fair ? &rings : NULL, &room, &left);
  }
  count_work(e, &budget, &left);
  return status;
}

/* Adds a hole's corner, with the texture coordinates of the face across the border. is_side: the edge after
 * it is the border's. */
static void put_side(const filler *h, tw_change *change, uint32_t place, bool is_side) {
  const tw_topology *t = h->t;
  uint32_t corner = h->corners[place], next = tw_corner_next(t, corner);
  tw_change_corner(change, t->corner_vertex[next], next, is_side ? t->corner_edge[corner] : UINT32_MAX,
                   TW_CHANGE_MADE);
}

/* Adds the mix for a patch's own point: a mean of the hole's points, or of the corners there. */
static uint32_t put_mix(const filler *h, tw_change *change, uint32_t hole, uint32_t place, bool of_corners) {
  tw_term terms[TW_PATCH_TERMS];
  uint32_t count = 0;
  for (; count < TW_PATCH_TERMS && h->patches[hole].terms[place][count].weight > 0; count++) {
    terms[count] = h->patches[hole].terms[place][count];
    uint32_t corner = h->corners[h->holes[hole] + terms[count].index];
    terms[count].index = of_corners ? tw_corner_next(h->t, corner) : start_of(h, corner);
  }
  return tw_change_mix(change, terms, count);
}

static void put_patch(const filler *h, tw_change *change, uint32_t hole) {
  const tw_hole_patch *p = &h->patches[hole];
  uint32_t first_point = change->point_count, first = h->holes[hole];
  for (uint32_t i = p->loop_count; i < p->point_count; i++) {
    uint32_t mix = put_mix(h, change, hole, i, false);
    tw_change_point(change, h->t->vertex_count + mix, TW_CHANGE_MADE);
  }
  uint32_t first_mix = change->mix_count;
  for (uint32_t i = p->loop_count; i < p->point_count; i++) put_mix(h, change, hole, i, true);
  for (uint32_t i = 0; i < p->triangle_count; i++) {
    for (int k = 0; k < 3; k++) {
      uint32_t place = p->triangles[i][k], behind = p->triangles[i][(k + 1) % 3];
      uint32_t own = place - p->loop_count;
      if (place < p->loop_count)
        put_side(h, change, first + place, (place + 1) % p->loop_count == behind);
      else
        tw_change_corner(change, first_point + own, h->t->corner_count + first_mix + own, UINT32_MAX,
                         TW_CHANGE_MADE);
    }
    tw_change_face(change, h->t->corner_face[h->corners[first]], TW_CHANGE_NEW | TW_CHANGE_MADE);
  }
}

/* Positions the patches' own points, which are the last of the mesh, from `next` on. */
static tw_status place_points(const filler *h, uint32_t next) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < h->hole_count; i++)
    for (uint32_t k = h->patches[i].loop_count; k < h->patches[i].point_count && status == TW_OK; k++)
      status = tw_editor_place(h->editor, next++, h->patches[i].points[k]);
  return status;
}

/* ---- the edit -------------------------------------------------------------------------------- */

static void put_face(const filler *h, tw_change *change, uint32_t hole) {
  for (uint32_t i = h->holes[hole]; i < h->holes[hole + 1]; i++) put_side(h, change, i, true);
  tw_change_face(change, h->t->corner_face[h->corners[h->holes[hole]]], TW_CHANGE_NEW | TW_CHANGE_MADE);
}

static tw_status close_holes(filler *h) {
  const tw_topology *t = h->t;
  tw_change change;
  tw_change_size size = {.points = t->vertex_count, .faces = t->face_count, .corners = t->corner_count};
  for (uint32_t i = 0; i < h->hole_count; i++) {
    const tw_hole_patch *p = h->patches ? &h->patches[i] : NULL;
    uint64_t own = p ? p->point_count - p->loop_count : 0;
    size.points += own;
    size.faces += p ? p->triangle_count : 1;
    size.corners += p ? 3 * (uint64_t)p->triangle_count : h->holes[i + 1] - h->holes[i];
    size.mixes += 2 * own;
    size.terms += (uint64_t)(2 * TW_PATCH_TERMS) * own;
  }
  tw_status status = tw_change_init(&change, h->editor, &size);
  if (status != TW_OK) return status;
  uint32_t first = t->vertex_count;
  tw_change_keep_points(&change);
  for (uint32_t f = 0; f < t->face_count; f++) tw_change_keep_face(&change, f, NULL, 0);
  for (uint32_t i = 0; i < h->hole_count; i++)
    if (h->patches)
      put_patch(h, &change, i);
    else
      put_face(h, &change, i);
  status = tw_editor_apply(h->editor, &change);
  return status == TW_OK && h->patches ? place_points(h, first) : status;
}

tw_status tw_edit_fill(tw_editor *editor) {
  tw_status status = tw_editor_need_topology(editor);
  if (status != TW_OK) return status;
  const tw_topology *t = editor->topology;
  filler h = {.editor = editor, .t = t};
  uint32_t borders = 0;
  for (uint32_t e = 0; e < t->edge_count; e++) borders += (t->edge_flags[e] & TW_EDGE_BORDER) != 0;
  h.is_seen = tw_arena_alloc(editor->scratch, t->edge_count, 1);
  h.corners = tw_arena_alloc_raw(editor->scratch, borders, sizeof *h.corners);
  h.walk = tw_arena_alloc_raw(editor->scratch, borders, sizeof *h.walk);
  h.place_of = tw_arena_alloc(editor->scratch, t->vertex_count, sizeof *h.place_of);
  h.holes = tw_arena_alloc(editor->scratch, (size_t)borders + 1, sizeof *h.holes);
  if (!h.is_seen || !h.corners || !h.walk || !h.place_of || !h.holes) return tw_editor_no_memory(editor);
  status = find_holes(&h);
  if (status != TW_OK || h.hole_count == 0) return status;
  if (editor->edit->fill.method != TW_FILL_NGON) status = make_patches(&h);
  if (status == TW_OK) status = close_holes(&h);
  drop_patches(&h);
  return status;
}
