/* Creases, corners and holes: the sharpness of edges and points, and faces without a surface. Existing tags
 * that are not selected keep their order; selected elements come after them, or lose their tag where the
 * sharpness is 0. */
#include <string.h>

#include "editor.h"

/* Replaces one kind of tags. items: [count][width] the tagged elements, each crease as its two points;
 * sharpness: [count]. Both are replaced by the new arrays. */
static tw_status retag(tw_editor *e, uint32_t width, uint32_t *count, const uint32_t **items,
                       const float **sharpness) {
  uint8_t *selected, *points;
  double sharp = e->edit->sharpness;
  if (!(sharp >= 0 && sharp <= (double)TW_SHARPNESS_INFINITE))
    return tw_editor_fail(e, TW_INVALID, "/sharpness", "sharpness is a number from 0 to 10");
  tw_status status = tw_editor_select_points(e, &selected, &points);
  if (status == TW_OK && selected) status = tw_editor_name_selected(e, selected, points);
  if (status != TW_OK || !selected) return status;
  const tw_topology *t = e->topology;
  const uint32_t counts[] = {t->face_count, t->edge_count, t->vertex_count};
  uint32_t elements = counts[e->edit->selection.of], next = 0;
  uint64_t most = (uint64_t)*count + elements;
  uint32_t *tagged = tw_arena_alloc_raw(e->arena, most, width * sizeof *tagged);
  float *values = tw_arena_alloc_raw(e->arena, most, sizeof *values);
  if (!tagged || !values) return tw_editor_no_memory(e);
  for (uint32_t i = 0; i < *count; i++) {
    const uint32_t *item = *items + width * (size_t)i;
    uint32_t element = width == 2 ? tw_topology_find_edge(t, item[0], item[1]) : *item;
    if (element != UINT32_MAX && selected[element]) continue;
    memcpy(tagged + width * (size_t)next, item, width * sizeof *item);
    values[next++] = (*sharpness)[i];
  }
  for (uint32_t i = 0; sharp > 0 && i < elements; i++) {
    if (!selected[i]) continue;
    memcpy(tagged + width * (size_t)next, width == 2 ? t->edge_vertices[i] : &i, width * sizeof *tagged);
    values[next++] = (float)sharp;
  }
  *count = next;
  *items = tagged;
  *sharpness = values;
  return TW_OK;
}

tw_status tw_edit_crease(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  return retag(editor, 2, &mesh->crease_count, &mesh->crease_edges, &mesh->crease_sharpness);
}

tw_status tw_edit_corner(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  return retag(editor, 1, &mesh->sharp_point_count, &mesh->sharp_points, &mesh->point_sharpness);
}

/* A hole has no degrees: its sharpness only tells whether it is tagged. */
tw_status tw_edit_hole(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  const float *sharpness = tw_arena_alloc(editor->arena, mesh->hole_count, sizeof *sharpness);
  return sharpness ? retag(editor, 1, &mesh->hole_count, &mesh->holes, &sharpness)
                   : tw_editor_no_memory(editor);
}
