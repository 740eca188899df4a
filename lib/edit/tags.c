/* Creases, corners and holes: the sharpness of edges and points, and faces without a surface. Existing tags
 * that are not selected keep their order; selected elements come after them, or lose their tag where the
 * sharpness is 0. */
#include <string.h>

#include "editor.h"

enum { CREASES, CORNERS, HOLES };

/* Where a mesh has the tags of one kind: items: [count][width] the tagged elements, each crease as its two
 * points; sharpness: [count]. */
typedef struct tags {
  uint32_t width, *count;
  const uint32_t **items;
  const float **sharpness;
} tags;

static uint32_t count_selected(const uint8_t *selected, uint32_t count) {
  uint32_t found = 0;
  for (uint32_t i = 0; i < count; i++) found += selected[i] != 0;
  return found;
}

/* Whether a tagged element is selected. points: those of the selected elements. */
static bool is_selected(const tw_editor *e, uint32_t width, const uint32_t *item, const uint8_t *selected,
                        const uint8_t *points) {
  if (width == 1) return selected[*item];
  if (!points[item[0]] || !points[item[1]]) return false; /* which saves most searches */
  uint32_t edge = tw_topology_find_edge(e->topology, item[0], item[1]);
  return edge != UINT32_MAX && selected[edge];
}

/* Writes the tags with those of the selected elements replaced. points: as in is_selected. Returns how many
 * there are. */
static uint32_t put_tags(const tw_editor *e, const uint8_t *selected, const uint8_t *points,
                         uint32_t elements, const tags *before, uint32_t *items, float *sharpness) {
  const tw_topology *t = e->topology;
  uint32_t width = before->width, next = 0;
  double sharp = e->edit->sharpness;
  for (uint32_t i = 0; i < *before->count; i++) {
    const uint32_t *item = *before->items + width * (size_t)i;
    if (is_selected(e, width, item, selected, points)) continue;
    memcpy(items + width * (size_t)next, item, width * sizeof *item);
    sharpness[next++] = (*before->sharpness)[i];
  }
  for (uint32_t i = 0; sharp > 0 && i < elements; i++) {
    if (!selected[i]) continue;
    memcpy(items + width * (size_t)next, width == 2 ? t->edge_vertices[i] : &i, width * sizeof *items);
    sharpness[next++] = (float)sharp;
  }
  return next;
}

/* Replaces one kind of tags, whose arrays get an arena of their own. */
static tw_status retag(tw_editor *e, int kind, const tags *of) {
  uint8_t *selected, *points;
  if (!(e->edit->sharpness >= 0 && e->edit->sharpness <= (double)TW_SHARPNESS_INFINITE))
    return tw_editor_fail(e, TW_INVALID, "/sharpness", "sharpness is a number from 0 to 10");
  tw_status status = tw_editor_select_points(e, &selected, &points);
  if (status == TW_OK && selected) status = tw_editor_name_selected(e, selected, points);
  if (status != TW_OK || !selected) return status;
  const tw_topology *t = e->topology;
  const uint32_t counts[] = {t->face_count, t->edge_count, t->vertex_count};
  uint32_t elements = counts[e->edit->selection.of];
  uint64_t most = (uint64_t)*of->count + count_selected(selected, elements);
  tw_arena *arena = tw_arena_create();
  uint32_t *items = arena ? tw_arena_alloc_raw(arena, most, of->width * sizeof *items) : NULL;
  float *sharpness = items ? tw_arena_alloc_raw(arena, most, sizeof *sharpness) : NULL;
  if (!sharpness) {
    tw_arena_destroy(arena);
    return tw_editor_no_memory(e);
  }
  *of->count = put_tags(e, selected, points, elements, of, items, sharpness);
  *of->items = items;
  *of->sharpness = sharpness;
  tw_arena_destroy(e->tags[kind]);
  e->tags[kind] = arena;
  return TW_OK;
}

tw_status tw_edit_crease(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  const tags creases = {2, &mesh->crease_count, &mesh->crease_edges, &mesh->crease_sharpness};
  return retag(editor, CREASES, &creases);
}

tw_status tw_edit_corner(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  const tags corners = {1, &mesh->sharp_point_count, &mesh->sharp_points, &mesh->point_sharpness};
  return retag(editor, CORNERS, &corners);
}

/* A hole has no degrees: its sharpness only tells whether it is tagged. */
tw_status tw_edit_hole(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  const float *sharpness = tw_arena_alloc(editor->scratch, mesh->hole_count, sizeof *sharpness);
  if (!sharpness) return tw_editor_no_memory(editor);
  const tags holes = {1, &mesh->hole_count, &mesh->holes, &sharpness};
  return retag(editor, HOLES, &holes);
}
