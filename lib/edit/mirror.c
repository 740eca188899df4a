/* Adds a mirror image of the points and the faces, in their order. A name then also refers to the images of
 * its elements. */
#include <math.h>
#include <string.h>

#include "editor.h"

typedef struct mirror {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  int axis;
  uint8_t *is_on;            /* [vertex_count] on the plane: the point is its own image */
  uint8_t *is_flat;          /* [face_count] all points are on the plane: the face would lie on its image */
  uint32_t *points, *images; /* [vertex_count] the new point, and its image */
} mirror;

static void measure(mirror *m) {
  double weld = m->editor->edit->mirror.weld;
  for (uint32_t p = 0; p < m->t->vertex_count; p++)
    m->is_on[p] = fabs((double)tw_editor_point(m->editor, p)[m->axis]) <= weld;
  memset(m->is_flat, 1, m->t->face_count);
  for (uint32_t c = 0; c < m->t->corner_count; c++)
    if (!m->is_on[m->t->corner_vertex[c]]) m->is_flat[m->t->corner_face[c]] = 0;
}

/* Adds points and images. Points that only removed faces have are removed too. */
static bool put_points(mirror *m) {
  const tw_topology *t = m->t;
  uint8_t *is_used = tw_arena_alloc(m->editor->scratch, t->vertex_count, 1);
  if (!is_used) return false;
  for (uint32_t c = 0; c < t->corner_count; c++)
    if (!m->is_flat[t->corner_face[c]]) is_used[t->corner_vertex[c]] = 1;
  for (uint32_t p = 0; p < t->vertex_count; p++) {
    if (!is_used[p] && t->fan_offsets[p] != t->fan_offsets[p + 1]) continue;
    m->points[p] = m->images[p] = tw_change_point(&m->change, p, 0);
    if (m->is_on[p])
      m->change.shifts[m->points[p]][m->axis] = -(double)tw_editor_point(m->editor, p)[m->axis];
  }
  for (uint32_t p = 0; p < t->vertex_count; p++) {
    if (!is_used[p] || m->is_on[p]) continue;
    m->images[p] = tw_change_point(&m->change, p, TW_CHANGE_MADE);
    m->change.shifts[m->images[p]][m->axis] = -2 * (double)tw_editor_point(m->editor, p)[m->axis];
  }
  return true;
}

/* Mirrors the displacements of an image, and keeps those of a point on the plane there: the point is its own
 * image. Returns whether that changes one of the latter. */
static bool turn_displacements(const tw_mesh *mesh, size_t point, int axis, bool is_image) {
  bool is_flattened = false;
  for (uint32_t i = 0; i < mesh->morph_count; i++) {
    float *displacement = (float *)mesh->morphs[i] + 3 * point + axis;
    is_flattened |= !is_image && *displacement != 0;
    *displacement = is_image ? -*displacement : 0;
  }
  return is_flattened;
}

/* first: the first point that is an image. All points on the plane are exactly there by now. */
static void turn_morphs(tw_editor *e, int axis, bool welds, uint32_t first) {
  for (uint32_t p = 0; p < e->mesh.point_count; p++)
    if (p >= first || (welds && tw_editor_point(e, p)[axis] == 0))
      e->losses.flattened += turn_displacements(&e->mesh, p, axis, p >= first);
}

tw_status tw_edit_mirror(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  if (edit->mirror.axis < 0 || edit->mirror.axis > 2)
    return tw_editor_fail(editor, TW_INVALID, "/axis", "an axis is x, y or z");
  if (!isfinite(edit->mirror.weld))
    return tw_editor_fail(editor, TW_INVALID, "/weld", "the distance is not a finite number");
  tw_status status = tw_editor_need_topology(editor);
  if (status != TW_OK) return status;
  mirror m = {.editor = editor, .t = editor->topology, .axis = edit->mirror.axis};
  const tw_change_size size = {.points = 2 * (uint64_t)m.t->vertex_count,
                               .faces = 2 * (uint64_t)m.t->face_count,
                               .corners = 2 * (uint64_t)m.t->corner_count};
  status = tw_change_init(&m.change, editor, &size);
  if (status != TW_OK) return status;
  m.is_on = tw_arena_alloc(editor->scratch, m.t->vertex_count, 1);
  m.is_flat = tw_arena_alloc(editor->scratch, m.t->face_count, 1);
  m.points = tw_arena_alloc_raw(editor->scratch, m.t->vertex_count, sizeof *m.points);
  m.images = tw_arena_alloc_raw(editor->scratch, m.t->vertex_count, sizeof *m.images);
  m.change.shifts = tw_arena_alloc(editor->scratch, size.points, sizeof *m.change.shifts);
  if (!m.is_on || !m.is_flat || !m.points || !m.images || !m.change.shifts)
    return tw_editor_no_memory(editor);
  measure(&m);
  if (!put_points(&m)) return tw_editor_no_memory(editor);
  uint32_t first = m.change.point_count;
  for (uint32_t p = 0; p < m.change.point_count; p++)
    if (m.change.point_flags[p] && p < first) first = p;
  for (uint32_t f = 0; f < m.t->face_count; f++)
    if (!m.is_flat[f]) tw_change_keep_face(&m.change, f, m.points, 0);
  for (uint32_t f = 0; f < m.t->face_count; f++)
    if (!m.is_flat[f]) tw_change_turn_face(&m.change, f, m.images, TW_CHANGE_MADE);
  status = tw_editor_apply(editor, &m.change);
  if (status == TW_OK) turn_morphs(editor, edit->mirror.axis, edit->mirror.weld >= 0, first);
  return status;
}
