/* Applies the list of edits: each edit works on the mesh that the one before it left. */
#include "tweend/edit.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "editor.h"

const char *const tw_edit_names[TW_EDIT_KINDS] = {
    [TW_EDIT_EXTRUDE] = "extrude",
    [TW_EDIT_INSET] = "inset",
    [TW_EDIT_LOOP_CUT] = "loop_cut",
    [TW_EDIT_SUBDIVIDE] = "subdivide",
    [TW_EDIT_DELETE] = "delete",
    [TW_EDIT_MERGE] = "merge",
    [TW_EDIT_FILL] = "fill",
    [TW_EDIT_MIRROR] = "mirror",
    [TW_EDIT_MOVE] = "move",
    [TW_EDIT_ROTATE] = "rotate",
    [TW_EDIT_SCALE] = "scale",
    [TW_EDIT_CREASE] = "crease",
    [TW_EDIT_CORNER] = "corner",
    [TW_EDIT_HOLE] = "hole",
    [TW_EDIT_FLIP] = "flip",
    [TW_EDIT_ORIENT] = "orient",
    [TW_EDIT_TRIANGULATE] = "triangulate",
    [TW_EDIT_QUADS] = "quads",
    [TW_EDIT_DROP_PIECES] = "drop_pieces",
    [TW_EDIT_DESPIKE] = "despike",
    [TW_EDIT_SMOOTH] = "smooth",
};

enum { FACES = 1 << TW_EDIT_FACES, EDGES = 1 << TW_EDIT_EDGES, VERTICES = 1 << TW_EDIT_VERTICES, ALL = 8 };

/* Each edit's function, and the elements it may select. ALL: without a selection it applies to the whole
 * mesh. 0: it uses no selection. */
static const struct {
  tw_status (*apply)(tw_editor *editor);
  uint8_t to;
} kinds[TW_EDIT_KINDS] = {
    [TW_EDIT_EXTRUDE] = {tw_edit_extrude, FACES},
    [TW_EDIT_INSET] = {tw_edit_inset, FACES},
    [TW_EDIT_LOOP_CUT] = {tw_edit_loop_cut, 0},
    [TW_EDIT_SUBDIVIDE] = {tw_edit_subdivide, FACES | EDGES},
    [TW_EDIT_DELETE] = {tw_edit_delete, FACES | EDGES | VERTICES},
    [TW_EDIT_MERGE] = {tw_edit_merge, VERTICES},
    [TW_EDIT_FILL] = {tw_edit_fill, 0},
    [TW_EDIT_MIRROR] = {tw_edit_mirror, 0},
    [TW_EDIT_MOVE] = {tw_edit_transform, FACES | EDGES | VERTICES},
    [TW_EDIT_ROTATE] = {tw_edit_transform, FACES | EDGES | VERTICES},
    [TW_EDIT_SCALE] = {tw_edit_transform, FACES | EDGES | VERTICES},
    [TW_EDIT_CREASE] = {tw_edit_crease, EDGES},
    [TW_EDIT_CORNER] = {tw_edit_corner, VERTICES},
    [TW_EDIT_HOLE] = {tw_edit_hole, FACES},
    [TW_EDIT_FLIP] = {tw_edit_flip, FACES | ALL},
    [TW_EDIT_ORIENT] = {tw_edit_orient, FACES | ALL},
    [TW_EDIT_TRIANGULATE] = {tw_edit_triangulate, FACES | ALL},
    [TW_EDIT_QUADS] = {tw_edit_quads, FACES | ALL},
    [TW_EDIT_DROP_PIECES] = {tw_edit_drop_pieces, 0},
    [TW_EDIT_DESPIKE] = {tw_edit_despike, FACES | EDGES | VERTICES | ALL},
    [TW_EDIT_SMOOTH] = {tw_edit_smooth, FACES | EDGES | VERTICES | ALL},
};

static tw_status check_selection(const tw_editor *e) {
  const tw_selection *s = &e->edit->selection;
  uint8_t to = kinds[e->edit->kind].to;
  if (to == 0) return TW_OK;
  if (s->by == TW_SELECT_NOTHING) {
    if (to & ALL) return TW_OK;
    return tw_editor_fail(e, TW_INVALID, "", "the edit does not say what it is applied to");
  }
  if (to & 1 << s->of) return TW_OK;
  char place[32];
  snprintf(place, sizeof place, "/%s", tw_edit_element_names[s->of]);
  return tw_editor_fail(e, TW_INVALID, place, "the edit is not applied to %s", tw_edit_element_names[s->of]);
}

static tw_status apply_edit(tw_editor *e) {
  tw_status status = check_selection(e);
  e->is_named = false;
  if (status == TW_OK) status = kinds[e->edit->kind].apply(e);
  /* An edit that did nothing still defines its name, as nothing. */
  if (status == TW_OK && !e->is_named) tw_editor_name(e);
  return status == TW_OK ? tw_editor_clear_scratch(e) : status;
}

/* The work of an edit, in points and corners: ten rounds of smoothing count as much as another edit. Each
 * edit maps all names to its new mesh, so each name counts too, even if it names nothing. */
static uint64_t work_of(const tw_editor *e) {
  enum { NAME = 4 };
  uint64_t elements = (uint64_t)e->mesh.point_count + e->mesh.corner_count,
           named = NAME * (uint64_t)e->named_count;
  uint32_t rounds = e->edit->kind == TW_EDIT_SMOOTH ? e->edit->smooth.iterations / 10 : 0;
  for (uint32_t n = 0; n < e->named_count; n++)
    named += (uint64_t)e->named[n].face_count + e->named[n].point_count + e->named[n].edge_count;
  return elements * (1 + (uint64_t)rounds) + named;
}

static tw_status apply_all(tw_editor *e, const tw_edit *edits, uint32_t edit_count) {
  uint64_t work = 0;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < edit_count && status == TW_OK; i++) {
    e->edit = &edits[i];
    e->index = i;
    work += work_of(e);
    if (work > e->limits->work)
      return tw_editor_fail(e, TW_LIMIT, "", "too many edits of too large a mesh, or with too many names");
    status = tw_editor_go_on(e);
    if (status == TW_OK) status = apply_edit(e);
  }
  return status;
}

/* Copies what each name refers to in the finished mesh. */
static tw_status hand_out_named(const tw_editor *e, tw_arena *arena, tw_made *made, uint32_t *made_count) {
  *made_count = e->named_count;
  for (uint32_t i = 0; i < e->named_count; i++) {
    const tw_named *named = &e->named[i];
    uint32_t *faces = tw_arena_alloc_raw(arena, named->face_count, sizeof *faces);
    uint32_t *vertices = tw_arena_alloc_raw(arena, named->point_count, sizeof *vertices);
    if (!faces || !vertices) return tw_editor_no_memory(e);
    if (named->face_count > 0) memcpy(faces, named->faces, named->face_count * sizeof *faces);
    if (named->point_count > 0) memcpy(vertices, named->points, named->point_count * sizeof *vertices);
    made[i] = (tw_made){named->name, named->face_count, named->point_count, faces, vertices};
  }
  return TW_OK;
}

tw_status tw_mesh_edit(const tw_mesh *mesh, const tw_model *model, const tw_edit *edits, uint32_t edit_count,
                       const tw_edit_limits *limits, tw_arena *arena, tw_mesh *out, tw_made *made,
                       uint32_t *made_count, tw_edit_losses *losses, tw_error *error) {
  if (made) *made_count = 0;
  if (losses) *losses = (tw_edit_losses){0};
  if (edit_count == 0) {
    *out = *mesh;
    return TW_OK;
  }
  tw_editor e = {.mesh = *mesh,
                 .arena = tw_arena_create(),
                 .scratch = tw_arena_create(),
                 .model = model,
                 .limits = limits,
                 .named = tw_alloc_zero(edit_count, sizeof(tw_named)),
                 .error = error};
  tw_status status =
      e.arena && e.scratch && e.named ? apply_all(&e, edits, edit_count) : tw_editor_no_memory(&e);
  if (status == TW_OK && made) status = hand_out_named(&e, arena, made, made_count);
  if (status == TW_OK) status = tw_editor_copy(&e, arena, out);
  if (losses) *losses = e.losses;
  tw_editor_deinit(&e);
  return status;
}
