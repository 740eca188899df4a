/* Delete, drop_pieces and merge: remove points and faces, and points left without a face. */
#include <math.h>
#include <string.h>

#include "editor.h"
#include "merge_points.h"
#include "union_find.h"
#include "weld.h"

typedef struct remover {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  uint8_t *is_gone;  /* [face_count] */
  uint32_t *becomes; /* [vertex_count] the old point that each is merged into, or itself */
  uint32_t *points;  /* [vertex_count] its new point, or UINT32_MAX */
  uint32_t merged;   /* after finish: the new point that is a mean, or UINT32_MAX */
} remover;

static tw_status begin(remover *r) {
  r->t = r->editor->topology;
  r->is_gone = tw_arena_alloc(r->editor->scratch, r->t->face_count, 1);
  r->becomes = tw_arena_alloc_raw(r->editor->scratch, r->t->vertex_count, sizeof *r->becomes);
  r->points = tw_arena_alloc_raw(r->editor->scratch, r->t->vertex_count, sizeof *r->points);
  if (!r->is_gone || !r->becomes || !r->points) return tw_editor_no_memory(r->editor);
  for (uint32_t p = 0; p < r->t->vertex_count; p++) r->becomes[p] = p;
  return TW_OK;
}

static uint32_t end_of(const remover *r, uint32_t corner) {
  return r->becomes[r->t->corner_vertex[corner]];
}

/* A corner stays unless the previous corner has become the same point. */
static bool stays(const remover *r, uint32_t corner) {
  return end_of(r, tw_corner_previous(r->t, corner)) != end_of(r, corner);
}

/* The old edge from a corner that stays to the next one that does; the corners between have become the same
 * point as the first. */
static uint32_t edge_behind(const remover *r, uint32_t corner) {
  uint32_t next = tw_corner_next(r->t, corner);
  while (end_of(r, next) == end_of(r, corner)) {
    corner = next;
    next = tw_corner_next(r->t, corner);
  }
  return r->t->corner_edge[corner];
}

/* Removes faces left with fewer than three different points. */
static tw_status drop_thin_faces(remover *r) {
  uint32_t *seen = tw_arena_alloc(r->editor->scratch, r->t->vertex_count, sizeof *seen);
  if (!seen) return tw_editor_no_memory(r->editor);
  for (uint32_t f = 0; f < r->t->face_count; f++) {
    uint32_t different = 0;
    for (uint32_t c = tw_face_begin(r->t, f); c < tw_face_begin(r->t, f) + tw_face_size(r->t, f); c++) {
      if (!stays(r, c)) continue;
      different += seen[end_of(r, c)] != f + 1;
      seen[end_of(r, c)] = f + 1;
    }
    if (different < 3) r->is_gone[f] = 1;
  }
  return TW_OK;
}

/* Makes the mesh without the removed faces, and without points that lost all their faces. doomed:
 * [vertex_count] points that are removed even if they never had a face. made: [vertex_count] or NULL. merged:
 * the point that becomes the mean of terms [term_count]; UINT32_MAX: none. */
static tw_status finish(remover *r, const uint8_t *doomed, const uint8_t *made, uint32_t merged,
                        const tw_term *terms, uint32_t term_count) {
  const tw_topology *t = r->t;
  uint8_t *is_used = tw_arena_alloc(r->editor->scratch, t->vertex_count, 1);
  const tw_change_size size = {t->vertex_count, t->face_count, t->corner_count, term_count > 0, term_count};
  tw_status status = is_used ? tw_change_init(&r->change, r->editor, &size) : tw_editor_no_memory(r->editor);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < t->corner_count; c++)
    if (!r->is_gone[t->corner_face[c]]) is_used[end_of(r, c)] = 1;
  memset(r->points, 0xFF, t->vertex_count * sizeof *r->points);
  for (uint32_t p = 0; p < t->vertex_count; p++) {
    bool is_loose = t->fan_offsets[p] == t->fan_offsets[p + 1] && !doomed[p];
    if (r->becomes[p] != p || !(is_used[p] || is_loose)) continue;
    uint32_t parent = p == merged ? t->vertex_count + tw_change_mix(&r->change, terms, term_count) : p;
    r->points[p] = tw_change_point(&r->change, parent, made && made[p] ? TW_CHANGE_MADE : 0);
  }
  for (uint32_t p = 0; p < t->vertex_count; p++) r->points[p] = r->points[r->becomes[p]];
  r->merged = merged == UINT32_MAX ? UINT32_MAX : r->points[merged];
  r->change.joins = r->points;
  for (uint32_t f = 0; f < t->face_count; f++) {
    if (r->is_gone[f]) continue;
    for (uint32_t c = tw_face_begin(t, f); c < tw_face_begin(t, f) + tw_face_size(t, f); c++)
      if (stays(r, c)) tw_change_corner(&r->change, r->points[end_of(r, c)], c, edge_behind(r, c), 0);
    tw_change_face(&r->change, f, 0);
  }
  return tw_editor_apply(r->editor, &r->change);
}

/* ---- delete ---------------------------------------------------------------------------------- */

tw_status tw_edit_delete(tw_editor *editor) {
  remover r = {.editor = editor};
  uint8_t *selected;
  tw_status status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  status = begin(&r);
  uint8_t *doomed = tw_arena_alloc(editor->scratch, editor->topology->vertex_count, 1);
  if (status == TW_OK && !doomed) status = tw_editor_no_memory(editor);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < r.t->corner_count; c++) {
    const uint32_t of[] = {r.t->corner_face[c], r.t->corner_edge[c], r.t->corner_vertex[c]};
    if (selected[of[editor->edit->selection.of]]) r.is_gone[r.t->corner_face[c]] = 1;
  }
  if (editor->edit->selection.of == TW_EDIT_VERTICES) doomed = selected;
  return finish(&r, doomed, NULL, UINT32_MAX, NULL, 0);
}

tw_status tw_edit_drop_pieces(tw_editor *editor) {
  remover r = {.editor = editor};
  tw_status status = tw_editor_need_topology(editor);
  if (status == TW_OK) status = begin(&r);
  if (status != TW_OK) return status;
  uint32_t *pieces = tw_arena_alloc_raw(editor->scratch, r.t->vertex_count, sizeof *pieces);
  uint32_t *sizes = tw_arena_alloc(editor->scratch, r.t->vertex_count, sizeof *sizes);
  uint8_t *doomed = tw_arena_alloc(editor->scratch, r.t->vertex_count, 1);
  if (!pieces || !sizes || !doomed) return tw_editor_no_memory(editor);
  tw_topology_find_pieces(r.t, pieces);
  for (int pass = 0; pass < 2; pass++)
    for (uint32_t f = 0; f < r.t->face_count; f++) {
      uint32_t *size = sizes + tw_union_find_root(pieces, r.t->corner_vertex[tw_face_begin(r.t, f)]);
      if (pass == 0)
        ++*size;
      else
        r.is_gone[f] = *size < editor->edit->drop_pieces.faces;
    }
  return finish(&r, doomed, NULL, UINT32_MAX, NULL, 0);
}

/* ---- merge ----------------------------------------------------------------------------------- */

/* Merges each listed point into the first one within the distance. */
static tw_status join_near(remover *r, const uint32_t *list, uint32_t count, double distance) {
  tw_arena *arena = r->editor->scratch;
  float *positions = tw_arena_alloc_raw(arena, count, sizeof(float[3]));
  uint32_t *point_of = tw_arena_alloc_raw(arena, count, sizeof *point_of);
  uint32_t *first = tw_arena_alloc_raw(arena, count, sizeof *first), point_count = 0, next = 0;
  if (!positions || !point_of || !first) return tw_editor_no_memory(r->editor);
  for (uint32_t i = 0; i < count; i++)
    memcpy(positions + 3 * (size_t)i, tw_editor_point(r->editor, list[i]), sizeof(float[3]));
  double least = distance > 0 ? fmax(distance, TW_WELD_LEAST) : distance;
  if (tw_weld_within(positions, count, least, point_of, &point_count, NULL) != TW_OK)
    return tw_editor_no_memory(r->editor);
  for (uint32_t i = 0; i < count; i++) {
    if (point_of[i] == next) first[next++] = list[i];
    r->becomes[list[i]] = first[point_of[i]];
    r->editor->losses.bent += !tw_mesh_points_move_alike(&r->editor->mesh, list[i], first[point_of[i]]);
  }
  bool parted[TW_ATTRIBUTES_MAX];
  tw_status status =
      tw_mesh_part_attributes(&r->editor->mesh, r->becomes, r->t->vertex_count, arena, parted, NULL);
  return status == TW_OK ? TW_OK : tw_editor_no_memory(r->editor);
}

static tw_status join_all(remover *r, const uint32_t *list, uint32_t count, tw_term **terms) {
  *terms = tw_arena_alloc_raw(r->editor->scratch, count, sizeof **terms);
  if (!*terms) return tw_editor_no_memory(r->editor);
  for (uint32_t i = 0; i < count; i++) {
    (*terms)[i] = (tw_term){list[i], 1.0 / count};
    r->becomes[list[i]] = list[0];
  }
  return TW_OK;
}

tw_status tw_edit_merge(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  remover r = {.editor = editor};
  uint8_t *selected;
  if (!isfinite(edit->merge.distance))
    return tw_editor_fail(editor, TW_INVALID, "/distance", "the distance is not a finite number");
  tw_status status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  uint32_t count;
  uint32_t *list = tw_list_flagged(editor->scratch, selected, 0xFF, editor->mesh.point_count, &count);
  uint8_t *doomed = tw_arena_alloc(editor->scratch, editor->mesh.point_count, 1);
  if (!list || !doomed) return tw_editor_no_memory(editor);
  bool is_near = edit->merge.distance >= 0;
  tw_term *terms = NULL;
  status = begin(&r);
  if (status == TW_OK)
    status = is_near ? join_near(&r, list, count, edit->merge.distance) : join_all(&r, list, count, &terms);
  if (status == TW_OK) status = drop_thin_faces(&r);
  if (status != TW_OK) return status;
  status = finish(&r, doomed, selected, is_near ? UINT32_MAX : list[0], terms, is_near ? 0 : count);
  bool is_placed = edit->merge.has_to && status == TW_OK && r.merged != UINT32_MAX;
  return is_placed ? tw_editor_place(editor, r.merged, edit->merge.to) : status;
}
