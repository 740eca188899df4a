/* Reads any bytes as a mesh and as edits of it: the result is a valid mesh, or the input is refused. */
#include <stdlib.h>

#include "mesh_of_bytes.h"
#include "quad_pairing.h"
#include "tweend/coarsen.h"
#include "tweend/edit.h"
#include "tweend/format.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { EDITS = 5, LIST = 6 };

/* The arrays that edits point to. */
typedef struct lists {
  uint32_t indices[EDITS][LIST][2];
  double cuts[EDITS][3];
} lists;

static void take_vector(source *s, double out[3]) {
  for (int c = 0; c < 3; c++) out[c] = (double)take_number(s);
}

static void take_edge(source *s, const tw_mesh *mesh, uint32_t out[2]) {
  uint32_t corner = mesh->corner_count > 1 ? take(s, mesh->corner_count - 1) : 0;
  for (uint32_t k = 0; k < 2; k++)
    out[k] = mesh->corner_count > 1 ? mesh->corners[corner + k] : take(s, POINTS);
}

static tw_selection take_selection(source *s, const tw_mesh *mesh, uint32_t indices[LIST][2]) {
  tw_selection selection = {.of = (tw_edit_element)take(s, 3),
                            .by = (tw_select)take(s, TW_SELECT_SHARPER + 1)};
  selection.indices = indices[0];
  selection.count = take(s, LIST + 1);
  for (uint32_t i = 0; i < LIST; i++) {
    take_edge(s, mesh, indices[i]);
    if (selection.of != TW_EDIT_EDGES) indices[i][0] = take(s, 40);
  }
  selection.name = selection.by == TW_SELECT_GROUP ? "a" : "made";
  selection.degrees = take(s, 181);
  take_vector(s, selection.direction);
  take_vector(s, selection.min);
  take_vector(s, selection.max);
  return selection;
}

static tw_edit take_edit(source *s, const tw_mesh *mesh, uint32_t indices[LIST][2], double *cuts) {
  tw_edit edit = {.kind = (tw_edit_kind)take(s, TW_EDIT_KINDS), .is_optional = true, .name = "made"};
  edit.selection = take_selection(s, mesh, indices);
  double number = (double)take_number(s);
  uint32_t flag = take(s, 2), count = 1 + take(s, 3);
  double vector[3];
  take_vector(s, vector);
  for (uint32_t i = 0; i < 3; i++) cuts[i] = (i + 1) / 4.0;
  switch (edit.kind) {
  case TW_EDIT_EXTRUDE:
    edit.extrude = (tw_extrude_edit){flag, take(s, 2), number, {vector[0], vector[1], vector[2]}};
    break;
  case TW_EDIT_INSET: edit.inset = (tw_inset_edit){flag, number}; break;
  case TW_EDIT_LOOP_CUT:
    edit.loop_cut = (tw_loop_cut_edit){{0, 0}, count, flag ? cuts : NULL};
    take_edge(s, mesh, edit.loop_cut.edge);
    break;
  case TW_EDIT_SUBDIVIDE: edit.subdivide.cuts = count; break;
  case TW_EDIT_MERGE: edit.merge = (tw_merge_edit){number, flag, {vector[0], vector[1], vector[2]}}; break;
  case TW_EDIT_FILL:
    edit.fill = (tw_fill_edit){flag, {0, 0}, take(s, 20), (tw_fill_method)take(s, 3)};
    take_edge(s, mesh, edit.fill.border);
    break;
  case TW_EDIT_MIRROR: edit.mirror = (tw_mirror_edit){(int)take(s, 3), number}; break;
  case TW_EDIT_MOVE: edit.move = (tw_move_edit){{vector[0], vector[1], vector[2]}}; break;
  case TW_EDIT_ROTATE:
    edit.rotate = (tw_rotate_edit){{vector[0], vector[1], 1}, number * 100, flag, {1, number, 0}};
    break;
  case TW_EDIT_SCALE:
    edit.scale = (tw_scale_edit){{vector[0], vector[1], vector[2]}, flag, {number, 0, 1}};
    break;
  case TW_EDIT_CREASE:
  case TW_EDIT_CORNER:
  case TW_EDIT_HOLE: edit.sharpness = (double)take_sharpness(s); break;
  case TW_EDIT_DROP_PIECES: edit.drop_pieces.faces = take(s, 8); break;
  case TW_EDIT_DESPIKE: edit.despike.factor = 0.1 + take(s, 8); break;
  case TW_EDIT_SMOOTH: edit.smooth = (tw_smooth_edit){(tw_smooth_method)flag, count}; break;
  case TW_EDIT_DELETE:
  case TW_EDIT_FLIP:
  case TW_EDIT_ORIENT:
  case TW_EDIT_TRIANGULATE:
  case TW_EDIT_QUADS: break;
  }
  return edit;
}

static void demand(bool holds) {
  if (!holds) abort();
}

static void check_ascending(const uint32_t *indices, uint32_t count, uint32_t below) {
  for (uint32_t i = 0; i < count; i++) demand(indices[i] < below && (i == 0 || indices[i - 1] < indices[i]));
}

/* Asserts that an edited mesh passes the functions that take any mesh. */
static void check_mesh(const tw_mesh *mesh, tw_arena *arena) {
  tw_mesh_stats stats;
  tw_mesh creased, paired = {.point_count = mesh->point_count,
                             .face_count = mesh->face_count,
                             .corner_count = mesh->corner_count,
                             .positions = mesh->positions,
                             .face_offsets = mesh->face_offsets,
                             .corners = mesh->corners,
                             .face_materials = mesh->face_materials}; /* no tags */
  tw_coarsened found;
  const tw_surface_options options = {.level = 2};
  demand(tw_mesh_check(mesh, NULL, NULL) == TW_OK);
  demand(tw_mesh_describe(mesh, &stats, NULL) == TW_OK);
  tw_mesh_stats_deinit(&stats);
  demand(tw_pair_triangles(&paired, arena, NULL) == TW_OK && tw_mesh_check(&paired, NULL, NULL) == TW_OK);
  demand(tw_mesh_with_creases(mesh, TW_CREASES_AUTO, 30, 2, true, arena, &creased, NULL) == TW_OK);
  demand(tw_mesh_check(&creased, NULL, NULL) == TW_OK);
  if (tw_mesh_coarsen(mesh, &options, NULL, arena, &found, NULL) == TW_OK)
    demand(tw_mesh_check(&found.mesh, NULL, NULL) == TW_OK);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  static const tw_edit_limits limits = {1 << 12, 1 << 12, 1 << 14, 1 << 18, NULL};
  static const char *group_names[3] = {"a", "b", "a b"};
  source s = {bytes, bytes + size};
  storage *own = calloc(1, sizeof *own);
  lists *list = calloc(1, sizeof *list);
  tw_arena *arena = tw_arena_create();
  demand(own && list && arena);
  const tw_model model = {.group_count = 3, .group_names = group_names};
  tw_edit edits[EDITS];
  tw_made made[EDITS];
  tw_mesh mesh, out;
  uint32_t edit_count = 1 + take(&s, EDITS), made_count = 0;
  take_mesh(&s, own, &mesh);
  for (uint32_t i = 0; i < edit_count; i++) edits[i] = take_edit(&s, &mesh, list->indices[i], list->cuts[i]);
  take_corner_values(&s, own, &mesh);
  if (tw_mesh_check(&mesh, NULL, NULL) == TW_OK &&
      tw_mesh_edit(&mesh, &model, edits, edit_count, &limits, arena, &out, made, &made_count, NULL, NULL) ==
          TW_OK) {
    for (uint32_t i = 0; i < made_count; i++) {
      check_ascending(made[i].faces, made[i].face_count, out.face_count);
      check_ascending(made[i].vertices, made[i].vertex_count, out.point_count);
    }
    check_mesh(&out, arena);
  }
  tw_arena_destroy(arena);
  free(list);
  free(own);
  return 0;
}
