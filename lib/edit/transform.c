/* Moves, rotates and scales points, and with these the displacements of morph targets. */
#include <math.h>
#include <string.h>

#include "angle.h"
#include "editor.h"

/* A linear map by its rows, the point that it keeps fixed, and a translation that follows. */
typedef struct motion {
  double rows[3][3], about[3], by[3];
} motion;

static void find_mean(const tw_editor *e, const uint8_t *points, double out[3]) {
  double sum[3] = {0, 0, 0};
  uint32_t count = 0;
  for (uint32_t p = 0; p < e->mesh.point_count; p++)
    if (points[p]) {
      for (int i = 0; i < 3; i++) sum[i] += (double)tw_editor_point(e, p)[i];
      count++;
    }
  for (int i = 0; i < 3; i++) out[i] = count > 0 ? sum[i] / count : 0;
}

/* Rodrigues' formula. */
static void turn_about(const double axis[3], double angle, double rows[3][3]) {
  double c = cos(angle), s = sin(angle);
  for (int i = 0; i < 3; i++) {
    int j = (i + 1) % 3, k = (i + 2) % 3;
    rows[i][i] = c + axis[i] * axis[i] * (1 - c);
    rows[i][j] = axis[i] * axis[j] * (1 - c) - axis[k] * s;
    rows[i][k] = axis[i] * axis[k] * (1 - c) + axis[j] * s;
  }
}

static tw_status find_motion(const tw_editor *e, const uint8_t *points, motion *out) {
  const tw_edit *edit = e->edit;
  *out = (motion){.rows = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (edit->kind == TW_EDIT_MOVE) {
    memcpy(out->by, edit->move.by, sizeof out->by);
    return TW_OK;
  }
  bool is_rotation = edit->kind == TW_EDIT_ROTATE;
  bool has_about = is_rotation ? edit->rotate.has_about : edit->scale.has_about;
  if (has_about)
    memcpy(out->about, is_rotation ? edit->rotate.about : edit->scale.about, sizeof out->about);
  else
    find_mean(e, points, out->about);
  if (is_rotation) {
    double axis[3];
    memcpy(axis, edit->rotate.axis, sizeof axis);
    if (tw_unit3(axis) == 0) return tw_editor_fail(e, TW_INVALID, "/axis", "the axis has no length");
    turn_about(axis, edit->rotate.degrees * TW_RADIANS, out->rows);
  } else {
    for (int i = 0; i < 3; i++) out->rows[i][i] = edit->scale.by[i];
  }
  return TW_OK;
}

/* Morph targets show the mesh as if it were moved by the edit once they have displaced its points: their
 * displacements turn and scale with these. */
static tw_status turn_targets(tw_editor *editor, const uint8_t *points, const motion *m) {
  const tw_mesh *mesh = &editor->mesh;
  tw_status status = tw_editor_loosen_targets(editor);
  for (uint32_t t = 0; t < mesh->morph_count; t++)
    for (uint32_t p = 0; status == TW_OK && p < mesh->point_count; p++) {
      if (!points[p]) continue;
      double from[3], to[3];
      for (int i = 0; i < 3; i++) from[i] = (double)mesh->morphs[t][3 * (size_t)p + (size_t)i];
      for (int i = 0; i < 3; i++) to[i] = tw_dot3(m->rows[i], from);
      status = tw_editor_displace(editor, t, p, to);
    }
  return status;
}

tw_status tw_edit_transform(tw_editor *editor) {
  uint8_t *selected, *points;
  motion m;
  tw_status status = tw_editor_select_points(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  status = find_motion(editor, points, &m);
  if (status == TW_OK) status = tw_editor_loosen(editor);
  for (uint32_t p = 0; status == TW_OK && p < editor->mesh.point_count; p++) {
    if (!points[p]) continue;
    const float *at = tw_editor_point(editor, p);
    double from[3], to[3];
    for (int i = 0; i < 3; i++) from[i] = (double)at[i] - m.about[i];
    for (int i = 0; i < 3; i++) to[i] = tw_dot3(m.rows[i], from) + m.about[i] + m.by[i];
    status = tw_editor_place(editor, p, to);
  }
  bool turns = editor->edit->kind != TW_EDIT_MOVE && editor->mesh.morph_count > 0;
  if (status == TW_OK && turns) status = turn_targets(editor, points, &m);
  return status == TW_OK ? tw_editor_name_selected(editor, selected, points) : status;
}
