/* Meshes far from the origin: their nodes carry the offset that their points are relative to. */
#include <stdio.h>
#include <string.h>

#include "model_checks.h"
#include "tweend/base.h"

static bool has_origin(const tw_mesh *mesh) {
  return mesh->origin[0] != 0 || mesh->origin[1] != 0 || mesh->origin[2] != 0;
}

static bool shows_far_mesh(const tw_model *model, uint32_t node) {
  uint32_t mesh = model->nodes[node].mesh;
  return mesh < model->mesh_count && has_origin(&model->meshes[mesh]);
}

/* Whether the node's own translation can take an offset of its mesh: it only translates, and neither children
 * nor clips depend on it. */
static bool only_translates(const tw_node *node) {
  const tw_trs usual = TW_TRS_IDENTITY;
  return !node->has_matrix && memcmp(node->rest.rotation, usual.rotation, sizeof usual.rotation) == 0 &&
         memcmp(node->rest.scale, usual.scale, sizeof usual.scale) == 0;
}

/* The extent of the smallest mesh that has one; infinite where none has. */
static double smallest_extent(const tw_model *model) {
  double least = INFINITY;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    double extent = tw_mesh_extent(&model->meshes[i]);
    if (extent > 0 && extent < least) least = extent;
  }
  return least;
}

/* Forgets the exact translations of nodes where floats keep each mesh in its place, and of those that clips
 * move. */
static void forget_places(tw_model *model) {
  uint32_t first = 0;
  for (uint32_t i = 0; i < model->clip_count; i++)
    for (uint32_t k = 0; k < model->clips[i].track_count; k++) {
      const tw_track_keys *track = &model->clips[i].tracks[k];
      if (track->path == TW_TRANSLATION && track->node < model->node_count)
        model->nodes[track->node].place = NULL;
    }
  while (first < model->node_count && !model->nodes[first].place) first++;
  if (first == model->node_count) return;
  double extent = smallest_extent(model);
  for (uint32_t i = first; i < model->node_count; i++) {
    tw_node *node = &model->nodes[i];
    if (node->place && !tw_rounding_shows(node->place, extent)) node->place = NULL;
  }
}

/* place: [3] lives as long as the node. */
static void move_node(tw_node *node, const double by[3], double *place) {
  for (int c = 0; c < 3; c++) {
    place[c] = (double)node->rest.translation[c] + tw_node_fine(node, c) + by[c];
    node->rest.translation[c] = (float)place[c];
  }
  node->place = place;
}

/* Marks the nodes that children or clips depend on. is_needed: [node_count], zeroed. */
static void mark_needed(const tw_model *model, bool *is_needed) {
  for (uint32_t i = 0; i < model->node_count; i++)
    if (model->nodes[i].parent < model->node_count) is_needed[model->nodes[i].parent] = true;
  for (uint32_t i = 0; i < model->clip_count; i++)
    for (uint32_t k = 0; k < model->clips[i].track_count; k++)
      if (model->clips[i].tracks[k].node < model->node_count)
        is_needed[model->clips[i].tracks[k].node] = true;
}

/* Hands the mesh of a node on to a new child. */
static void add_carrier(tw_model *model, uint32_t node, double *place) {
  tw_node *from = &model->nodes[node], *to = &model->nodes[model->node_count++];
  *to = (tw_node){.parent = node,
                  .mesh = from->mesh,
                  .skin = from->skin,
                  .weights = from->weights,
                  .is_hidden = from->is_hidden,
                  .rest = TW_TRS_IDENTITY};
  from->mesh = from->skin = TW_NO_INDEX;
  from->weights = NULL;
  move_node(to, model->meshes[to->mesh].origin, place);
}

/* Moves the nodes that show far meshes, or children that they get: there is room for these. places: a row for
 * each of the nodes. */
static void carry_origins(tw_model *model, const bool *is_needed, double (*places)[3]) {
  uint32_t count = model->node_count;
  for (uint32_t i = 0; i < count; i++) {
    if (!shows_far_mesh(model, i)) continue;
    if (is_needed[i] || !only_translates(&model->nodes[i]))
      add_carrier(model, i, *places++);
    else
      move_node(&model->nodes[i], model->meshes[model->nodes[i].mesh].origin, *places++);
  }
}

static void warn_of_origins(tw_model *model) {
  uint32_t count = 0, first = 0;
  for (uint32_t i = model->mesh_count; i-- > 0;) {
    if (!has_origin(&model->meshes[i])) continue;
    count++;
    first = i;
  }
  if (count == 0) return;
  const double *at = model->meshes[first].origin;
  char more[48] = "";
  if (count > 1)
    snprintf(more, sizeof more, ", and %u more %s likewise", count - 1,
             tw_plural(count - 1, "mesh", "meshes"));
  tw_model_warn(
      model,
      "mesh %u lies so far from the origin that floats would lose its shape: its points are relative "
      "to %.15g %.15g %.15g, by which its node moves it%s",
      first, at[0], at[1], at[2], more);
}

tw_status tw_model_place_far_meshes(tw_model *model, tw_error *error) {
  uint32_t far = 0;
  forget_places(model);
  for (uint32_t i = 0; i < model->node_count; i++) far += shows_far_mesh(model, i);
  warn_of_origins(model);
  if (far > 0) {
    tw_node *nodes = tw_arena_alloc(model->arena, (size_t)model->node_count + far, sizeof *nodes);
    double(*places)[3] = tw_arena_alloc(model->arena, far, sizeof *places);
    bool *is_needed = tw_alloc_zero(model->node_count, sizeof *is_needed);
    bool has_room = nodes && places && is_needed;
    if (has_room) {
      memcpy(nodes, model->nodes, model->node_count * sizeof *nodes);
      model->nodes = nodes;
      mark_needed(model, is_needed);
      carry_origins(model, is_needed, places);
    }
    tw_free(is_needed);
    if (!has_room) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  for (uint32_t i = 0; i < model->mesh_count; i++)
    memset(model->meshes[i].origin, 0, sizeof model->meshes[i].origin);
  return TW_OK;
}
