/* The checks that every reader ends with: of meshes, nodes and skins here. */
#include "model_checks.h"

#include <math.h>
#include <string.h>

#include "clip.h"
#include "merge_points.h"
#include "tweend/base.h"
#include "tweend/detail.h"

static bool all_finite(const float *values, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (!isfinite(values[i])) return false;
  return true;
}

/* Leaves out details that do not fit the mesh, with a warning: another program may have changed the cage. */
static tw_status drop_unfit_details(tw_model *model, uint32_t index, tw_error *error) {
  tw_mesh *mesh = &model->meshes[index];
  tw_status status = tw_mesh_check_details(mesh, error);
  if (status == TW_OK || status == TW_NO_MEMORY) return status;
  mesh->detail_count = 0;
  tw_model_warn(model, "details of mesh %u are left out: they do not fit its faces", index);
  return TW_OK;
}

/* Adds how many points of a mesh no corner of a face is at: surfaces, and so answers, are made of faces. */
static tw_status count_unused(const tw_mesh *mesh, uint64_t *unused, tw_error *error) {
  uint8_t *is_used = tw_alloc_zero(mesh->point_count, 1);
  if (!is_used) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  uint32_t used = 0;
  for (uint32_t c = 0; c < mesh->corner_count; c++) is_used[mesh->corners[c]] = 1;
  for (uint32_t p = 0; p < mesh->point_count; p++) used += is_used[p];
  *unused += mesh->point_count - used;
  tw_free(is_used);
  return TW_OK;
}

/* Checks the meshes, and drops details that do not fit. */
static tw_status finish_meshes(tw_model *model, tw_error *error) {
  uint64_t unused = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh *mesh = &model->meshes[i];
    tw_status status = tw_model_check_name(&mesh->name, "meshes", i, error);
    if (status != TW_OK) return status;
    status = tw_mesh_check(mesh, error, NULL);
    if (status != TW_OK) {
      tw_model_prefix(error, "meshes", i);
      return status;
    }
    status = drop_unfit_details(model, i, error);
    if (status == TW_OK) status = count_unused(mesh, &unused, error);
    if (status != TW_OK) return status;
    for (uint32_t face = 0; mesh->face_materials && face < mesh->face_count; face++) {
      int32_t material = mesh->face_materials[face];
      if (material >= -1 && (material < 0 || (uint32_t)material < model->material_count + model->slot_count))
        continue;
      return tw_model_fail_at(error, "meshes", i, "/materials",
                              "a face names a material that does not exist");
    }
    for (uint32_t face = 0; mesh->face_groups && face < mesh->face_count; face++) {
      uint32_t group = mesh->face_groups[face];
      if (group == TW_NO_INDEX || group < model->group_count) continue;
      return tw_model_fail_at(error, "meshes", i, "/groups", "a face names a group that does not exist");
    }
  }
  tw_model_warn_count(model, unused, "point is in no face: answers leave it out",
                      "points are in no face: answers leave them out");
  return TW_OK;
}

/* Scales a rotation to unit length; false if it is zero or not finite. Counts in *scaled what was off. */
static bool normalise(float q[4], uint32_t *scaled) {
  double unit[4];
  quat_widen(q, unit);
  double length = tw_normalize(unit, 4);
  if (!(length > 1e-20) || !isfinite(length)) return false;
  *scaled += tw_is_off_unit(length);
  quat_narrow(unit, q);
  return true;
}

/* Whether a matrix is a translation, a rotation and a scale, as `trs` has them, but for rounding. */
static bool is_trs(const float matrix[16], const tw_trs *trs) {
  float whole[16], largest = 0;
  tw_trs_to_matrix(trs, whole);
  for (int i = 0; i < 16; i++) largest = fmaxf(largest, i < 12 ? fabsf(matrix[i]) : 0);
  for (int i = 0; i < 16; i++)
    if (fabsf(matrix[i] - whole[i]) > 1e-3f * (i % 4 < 3 ? largest : 1)) return false;
  return true;
}

/* How many nodes do not rest as their file says. */
typedef struct node_losses {
  uint32_t scaled, sheared;
} node_losses;

static tw_status check_node(const tw_model *model, uint32_t index, node_losses *losses, tw_error *error) {
  tw_node *node = &model->nodes[index];
  if (node->mesh != TW_NO_INDEX && node->mesh >= model->mesh_count)
    return tw_model_fail_at(error, "nodes", index, "/mesh", "the node's mesh does not exist");
  if (node->skin != TW_NO_INDEX && node->skin >= model->skin_count)
    return tw_model_fail_at(error, "nodes", index, "/skin", "the node's skin does not exist");
  if (node->has_matrix) {
    if (!all_finite(node->matrix, 16))
      return tw_model_fail_at(error, "nodes", index, "/matrix", "the node's matrix is not finite");
    tw_trs_from_matrix(node->matrix, &node->rest);
    losses->sheared += !is_trs(node->matrix, &node->rest);
    return TW_OK;
  }
  if (!all_finite(node->rest.translation, 3))
    return tw_model_fail_at(error, "nodes", index, "/translation", "the node's translation is not finite");
  if (!all_finite(node->rest.scale, 3))
    return tw_model_fail_at(error, "nodes", index, "/scale", "the node's scale is not finite");
  if (!normalise(node->rest.rotation, &losses->scaled))
    return tw_model_fail_at(error, "nodes", index, "/rotation", "the node's rotation is zero or not finite");
  return TW_OK;
}

/* Adds one node a mesh, for a source without a hierarchy. */
static tw_status add_mesh_nodes(tw_model *model, tw_error *error) {
  model->nodes = tw_arena_alloc(model->arena, model->mesh_count, sizeof *model->nodes);
  if (!model->nodes) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  model->node_count = model->mesh_count;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    model->nodes[i] = (tw_node){.name = model->meshes[i].name,
                                .parent = TW_NO_INDEX,
                                .mesh = i,
                                .skin = TW_NO_INDEX,
                                .rest = TW_TRS_IDENTITY};
  return TW_OK;
}

/* Tells of meshes that no node of the shown scene shows, and of other nodes that show a mesh again: flat
 * forms have only what is shown. */
static tw_status warn_of_unshown(tw_model *model, tw_error *error) {
  bool *is_shown = tw_alloc_zero(model->mesh_count, sizeof *is_shown);
  uint64_t unshown = model->mesh_count, again = 0;
  if (!is_shown) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (node->mesh >= model->mesh_count || node->is_hidden) continue;
    unshown -= !is_shown[node->mesh];
    is_shown[node->mesh] = true;
  }
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    again += node->mesh < model->mesh_count && node->is_hidden && is_shown[node->mesh];
  }
  tw_free(is_shown);
  tw_model_warn_count(model, unshown,
                      "mesh is in no node of the shown scene: OBJ, STL, PLY and 3MF leave it out",
                      "meshes are in no node of the shown scene: OBJ, STL, PLY and 3MF leave them out");
  tw_model_warn_count(
      model, again, "node that is not shown has a mesh that others show: OBJ, STL, PLY and 3MF leave it out",
      "nodes that are not shown have meshes that others show: OBJ, STL, PLY and 3MF leave them out");
  return TW_OK;
}

/* Gives each mesh a node where there are none, moves far meshes by their nodes, and checks and sorts all
 * nodes. */
static tw_status finish_nodes(tw_model *model, tw_error *error) {
  if (model->node_count == 0 && model->mesh_count > 0) {
    tw_status status = add_mesh_nodes(model, error);
    if (status != TW_OK) return status;
  }
  tw_status prepared = tw_model_place_far_meshes(model, error);
  if (prepared == TW_OK) prepared = warn_of_unshown(model, error);
  if (prepared != TW_OK) return prepared;
  node_losses losses = {0};
  for (uint32_t i = 0; i < model->node_count; i++) {
    tw_status status = tw_model_check_name(&model->nodes[i].name, "nodes", i, error);
    if (status == TW_OK) status = check_node(model, i, &losses, error);
    if (status != TW_OK) return status;
  }
  tw_model_warn_count(
      model, losses.sheared,
      "node has a matrix that is more than a translation, a rotation and a scale: poses in TRS, and "
      "clips that move it, have the nearest of these",
      "nodes have matrices that are more than a translation, a rotation and a scale: poses in TRS, "
      "and clips that move them, have the nearest of these");
  tw_model_warn_count(model, losses.scaled,
                      "node has a rotation that is not of unit length: it is scaled to it",
                      "nodes have rotations that are not of unit length: they are scaled to it");
  model->node_order = tw_arena_alloc(model->arena, model->node_count, sizeof *model->node_order);
  if (!model->node_order) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  return tw_nodes_order(model->nodes, model->node_count, model->node_order, error);
}

static tw_status check_skins(tw_model *model, tw_error *error) {
  for (uint32_t i = 0; i < model->skin_count; i++) {
    tw_skin *skin = &model->skins[i];
    tw_status status = tw_model_check_name(&skin->name, "skins", i, error);
    if (status != TW_OK) return status;
    if (skin->joint_count == 0) return tw_model_fail_at(error, "skins", i, "/joints", "a skin needs a joint");
    for (uint32_t j = 0; j < skin->joint_count; j++)
      if (skin->joints[j] >= model->node_count)
        return tw_model_fail_at(error, "skins", i, "/joints", "a joint is not a node of the model");
    if (!all_finite(skin->inverse_bind, (size_t)skin->joint_count * 16))
      return tw_model_fail_at(error, "skins", i, "/inverseBindMatrices",
                              "an inverse bind matrix is not finite");
    if (skin->skeleton != TW_NO_INDEX && skin->skeleton >= model->node_count)
      return tw_model_fail_at(error, "skins", i, "/skeleton", "the skeleton is not a node of the model");
  }
  return TW_OK;
}

/* Checks that the joint numbers of a mesh exist in the skin of every node that shows it, and tells of skins
 * that move nothing: answers leave them out. */
static tw_status check_skinned_nodes(tw_model *model, tw_error *error) {
  uint32_t *highest = tw_alloc_zero(model->mesh_count, sizeof *highest);
  if (!highest) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_mesh *mesh = &model->meshes[i];
    if (!mesh->skin.joints) continue;
    for (size_t j = 0; j < mesh->skin.width * (size_t)mesh->point_count; j++)
      if (mesh->skin.joints[j] > highest[i]) highest[i] = mesh->skin.joints[j];
  }
  tw_status status = TW_OK;
  uint32_t idle = 0;
  for (uint32_t i = 0; i < model->node_count && status == TW_OK; i++) {
    const tw_node *node = &model->nodes[i];
    if (node->skin == TW_NO_INDEX) continue;
    const tw_mesh *mesh = node->mesh == TW_NO_INDEX ? NULL : &model->meshes[node->mesh];
    idle += !mesh || !(mesh->skin.joints || mesh->loose_has_joints);
    if (mesh && mesh->skin.joints && highest[node->mesh] >= model->skins[node->skin].joint_count)
      status = tw_model_fail_at(error, "nodes", i, "/skin", "the mesh uses more joints than the skin has");
  }
  tw_free(highest);
  tw_model_warn_count(model, idle, "node has a skin and shows no mesh with joints: its skin is left out",
                      "nodes have skins and show no mesh with joints: their skins are left out");
  return status;
}

/* Warns of meshes whose answers cannot hold all influences of a point. */
static void warn_of_influences(tw_model *model) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_mesh *mesh = &model->meshes[i];
    uint32_t held = tw_surface_influences(mesh, 0);
    if (held < mesh->skin.width)
      tw_model_warn(model,
                    "mesh %u has so many attributes that its answers keep the %u heaviest of %u joints of a "
                    "point",
                    i, held, mesh->skin.width);
  }
}

tw_status tw_model_finish(tw_model *model, tw_error *error) {
  tw_status status = finish_meshes(model, error);
  if (status == TW_OK) status = finish_nodes(model, error);
  if (status == TW_OK) status = tw_model_sort_names(model, error);
  if (status == TW_OK) status = check_skins(model, error);
  if (status == TW_OK) status = check_skinned_nodes(model, error);
  if (status == TW_OK) status = tw_model_check_clips(model, error);
  if (status == TW_OK) warn_of_influences(model);
  return status;
}

tw_status tw_model_end(tw_model *model, tw_status status, tw_model **out, tw_error *error) {
  if (status == TW_OK) status = tw_model_finish(model, error);
  if (status == TW_OK)
    *out = model;
  else
    tw_model_destroy(model);
  return status;
}

tw_status tw_model_weld(tw_model *model, double distance, tw_error *error) {
  uint64_t dropped = 0, shortened = 0, bent = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_merged merged;
    tw_status status = tw_mesh_merge_within(&model->meshes[i], distance, model->arena, &merged, error);
    if (status == TW_OK) status = drop_unfit_details(model, i, error);
    if (status != TW_OK) return status;
    dropped += merged.faces;
    shortened += merged.shortened;
    bent += merged.bent;
  }
  tw_model_warn_count(model, bent,
                      "point becomes one with a point of other joints or morph targets, and follows this",
                      "points become one with a point of other joints or morph targets, and follow these");
  tw_model_warn_count(model, dropped, TW_WELD_DROPPED_FACE, TW_WELD_DROPPED_FACES);
  tw_model_warn_count(model, shortened, "face names a point twice in a row: it keeps it once",
                      "faces name a point twice in a row: they keep it once");
  return TW_OK;
}
