/* Creases, corners and holes: sharpness of edges and points, and faces without a surface. Tags of before that
 * are not selected stay in their order; those that are selected come after them, or go where the sharpness is
 * 0. */
#include <string.h>

#include "editor.h"

static tw_status check_sharpness(const tw_editor *e) {
  double sharpness = e->edit->sharpness;
  if (sharpness >= 0 && sharpness <= (double)TW_SHARPNESS_INFINITE) return TW_OK;
  return tw_editor_fail(e, TW_INVALID, "/sharpness", "sharpness is a number from 0 to 10");
}

static tw_status select_tagged(tw_editor *e, uint8_t **selected, uint8_t **points) {
  tw_status status = check_sharpness(e);
  if (status == TW_OK) status = tw_editor_select(e, selected);
  if (status == TW_OK && *selected) status = tw_editor_points_of(e, *selected, points);
  if (status == TW_OK && *selected) status = tw_editor_name_selected(e, *selected, *points);
  return status;
}

tw_status tw_edit_crease(tw_editor *editor) {
  uint8_t *selected, *points;
  tw_mesh *mesh = &editor->mesh;
  tw_status status = select_tagged(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  const tw_topology *t = editor->topology;
  uint64_t most = (uint64_t)mesh->crease_count + t->edge_count;
  uint32_t(*edges)[2] = tw_arena_alloc_raw(editor->arena, most, sizeof *edges), count = 0;
  float *sharpness = tw_arena_alloc_raw(editor->arena, most, sizeof *sharpness);
  if (!edges || !sharpness) return tw_editor_no_memory(editor);
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = mesh->crease_edges + 2 * (size_t)i;
    uint32_t edge = tw_topology_find_edge(t, ends[0], ends[1]);
    if (edge != UINT32_MAX && selected[edge]) continue;
    memcpy(edges[count], ends, sizeof *edges);
    sharpness[count++] = mesh->crease_sharpness[i];
  }
  for (uint32_t e = 0; editor->edit->sharpness > 0 && e < t->edge_count; e++) {
    if (!selected[e]) continue;
    memcpy(edges[count], t->edge_vertices[e], sizeof *edges);
    sharpness[count++] = (float)editor->edit->sharpness;
  }
  mesh->crease_count = count;
  mesh->crease_edges = edges[0];
  mesh->crease_sharpness = sharpness;
  return TW_OK;
}

tw_status tw_edit_corner(tw_editor *editor) {
  uint8_t *selected, *points;
  tw_mesh *mesh = &editor->mesh;
  tw_status status = select_tagged(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  uint64_t most = (uint64_t)mesh->sharp_point_count + mesh->point_count;
  uint32_t *sharp = tw_arena_alloc_raw(editor->arena, most, sizeof *sharp), count = 0;
  float *sharpness = tw_arena_alloc_raw(editor->arena, most, sizeof *sharpness);
  if (!sharp || !sharpness) return tw_editor_no_memory(editor);
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) {
    if (selected[mesh->sharp_points[i]]) continue;
    sharp[count] = mesh->sharp_points[i];
    sharpness[count++] = mesh->point_sharpness[i];
  }
  for (uint32_t p = 0; editor->edit->sharpness > 0 && p < mesh->point_count; p++) {
    if (!selected[p]) continue;
    sharp[count] = p;
    sharpness[count++] = (float)editor->edit->sharpness;
  }
  mesh->sharp_point_count = count;
  mesh->sharp_points = sharp;
  mesh->point_sharpness = sharpness;
  return TW_OK;
}

tw_status tw_edit_hole(tw_editor *editor) {
  uint8_t *selected, *points;
  tw_mesh *mesh = &editor->mesh;
  tw_status status = select_tagged(editor, &selected, &points);
  if (status != TW_OK || !selected) return status;
  uint64_t most = (uint64_t)mesh->hole_count + mesh->face_count;
  uint32_t *holes = tw_arena_alloc_raw(editor->arena, most, sizeof *holes), count = 0;
  if (!holes) return tw_editor_no_memory(editor);
  for (uint32_t i = 0; i < mesh->hole_count; i++)
    if (!selected[mesh->holes[i]]) holes[count++] = mesh->holes[i];
  for (uint32_t f = 0; editor->edit->sharpness > 0 && f < mesh->face_count; f++)
    if (selected[f]) holes[count++] = f;
  mesh->hole_count = count;
  mesh->holes = holes;
  return TW_OK;
}
