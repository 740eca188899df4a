/* Functions that all edits share: errors, the topology, positions, names. */
#include "editor.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

tw_status tw_editor_no_memory(const tw_editor *editor) {
  return tw_fail(editor->error, TW_NO_MEMORY, "out of memory");
}

tw_status tw_editor_go_on(const tw_editor *editor) {
  tw_status status = tw_parallel_for_status(editor->limits->parallel);
  return status == TW_OK ? status : tw_fail(editor->error, status, "the edits are not wanted any more");
}

tw_status tw_editor_fail(const tw_editor *editor, tw_status status, const char *place, const char *format,
                         ...) {
  char detail[256];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(detail, sizeof detail, format, arguments);
  va_end(arguments);
  tw_fail(editor->error, status, "%s", detail);
  tw_error_at(editor->error, "/%u%s", editor->index, place);
  return status;
}

tw_status tw_editor_need_topology(tw_editor *editor) {
  if (editor->topology) return TW_OK;
  const tw_mesh *mesh = &editor->mesh;
  tw_topology *topology = tw_arena_alloc(editor->arena, 1, sizeof *topology);
  tw_status status = topology
                         ? tw_topology_build(topology, editor->arena, mesh->point_count, mesh->face_count,
                                             mesh->face_offsets, mesh->corner_count, mesh->corners)
                         : TW_NO_MEMORY;
  if (status != TW_OK) return tw_editor_no_memory(editor);
  editor->topology = topology;
  return TW_OK;
}

/* ---- positions ------------------------------------------------------------------------------- */

void tw_mesh_drop_normals(tw_mesh *mesh) {
  memset(&mesh->normals, 0, sizeof mesh->normals);
  mesh->morph_normals = NULL;
}

tw_status tw_editor_loosen(tw_editor *editor) {
  tw_mesh_drop_normals(&editor->mesh);
  if (editor->is_loose) return TW_OK;
  size_t size = (size_t)editor->mesh.point_count * sizeof(float[3]);
  float *positions = tw_arena_alloc_raw(editor->arena, size, 1);
  if (!positions) return tw_editor_no_memory(editor);
  if (size > 0) memcpy(positions, editor->mesh.positions, size);
  editor->mesh.positions = positions;
  editor->is_loose = true;
  return TW_OK;
}

tw_status tw_editor_loosen_targets(tw_editor *editor) {
  tw_mesh *mesh = &editor->mesh;
  if (editor->has_loose_targets) return TW_OK;
  size_t size = (size_t)mesh->point_count * sizeof(float[3]);
  const float **targets = tw_arena_alloc(editor->arena, mesh->morph_count, sizeof *targets);
  if (!targets) return tw_editor_no_memory(editor);
  for (uint32_t i = 0; i < mesh->morph_count; i++) {
    float *own = tw_arena_alloc_raw(editor->arena, size, 1);
    if (!own) return tw_editor_no_memory(editor);
    if (size > 0) memcpy(own, mesh->morphs[i], size);
    targets[i] = own;
  }
  mesh->morphs = targets;
  editor->has_loose_targets = true;
  return TW_OK;
}

static tw_status fail_far(const tw_editor *editor) {
  return tw_editor_fail(editor, TW_INVALID, "", "the edit moves a point beyond 1e18");
}

tw_status tw_editor_displace(tw_editor *editor, uint32_t target, uint32_t point, const double by[3]) {
  float *out = (float *)editor->mesh.morphs[target] + 3 * (size_t)point;
  for (int i = 0; i < 3; i++) {
    if (!(fabs(by[i]) <= (double)TW_COORDINATE_MAX)) return fail_far(editor);
    out[i] = (float)by[i];
  }
  return TW_OK;
}

tw_status tw_editor_place(tw_editor *editor, uint32_t point, const double at[3]) {
  float *out = tw_editor_positions(editor) + 3 * (size_t)point;
  for (int i = 0; i < 3; i++) {
    if (!(fabs(at[i]) <= (double)TW_COORDINATE_MAX)) return fail_far(editor);
    out[i] = (float)at[i];
  }
  return TW_OK;
}

/* ---- names ----------------------------------------------------------------------------------- */

uint32_t *tw_list_flagged(tw_arena *arena, const uint8_t *flags, uint8_t mask, uint32_t count,
                          uint32_t *listed) {
  uint32_t next = 0;
  for (uint32_t i = 0; i < count; i++) next += (flags[i] & mask) != 0;
  uint32_t *out = tw_arena_alloc_raw(arena, next, sizeof *out);
  *listed = out ? next : 0;
  next = 0;
  for (uint32_t i = 0; out && i < count; i++)
    if (flags[i] & mask) out[next++] = i;
  return out;
}

tw_named *tw_editor_name(tw_editor *editor) {
  const char *name = editor->edit->name;
  if (!name) return NULL;
  uint32_t kept = 0;
  editor->is_named = true;
  for (uint32_t i = 0; i < editor->named_count; i++)
    if (strcmp(editor->named[i].name, name) != 0)
      editor->named[kept++] = editor->named[i];
    else
      tw_arena_destroy(editor->named[i].arena);
  editor->named[kept] = (tw_named){.name = name};
  editor->named_count = kept + 1;
  return &editor->named[kept];
}

tw_status tw_editor_name_own(tw_editor *editor, tw_named **named) {
  *named = tw_editor_name(editor);
  if (!*named) return TW_OK;
  (*named)->arena = tw_arena_create();
  return (*named)->arena ? TW_OK : tw_editor_no_memory(editor);
}

/* ---- what the editor holds ------------------------------------------------------------------- */

tw_status tw_editor_clear_scratch(tw_editor *editor) {
  tw_arena_destroy(editor->scratch);
  editor->scratch = tw_arena_create();
  return editor->scratch ? TW_OK : tw_editor_no_memory(editor);
}

void tw_editor_deinit(tw_editor *editor) {
  for (uint32_t i = 0; i < editor->named_count; i++) tw_arena_destroy(editor->named[i].arena);
  for (int i = 0; i < 3; i++) tw_arena_destroy(editor->tags[i]);
  tw_free(editor->named);
  tw_arena_destroy(editor->scratch);
  tw_arena_destroy(editor->arena);
}
