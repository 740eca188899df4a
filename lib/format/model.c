/* Models: their memory, the checks that every reader ends with, and the names that clients see. */
#include "tweend/format.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clip.h"
#include "tweend/base.h"

const char *const tw_format_names[TW_FORMATS] = {"obj", "tweend", "gltf", "glb"};
const char *const tw_format_media_types[TW_FORMATS] = {"model/obj", "application/json", "model/gltf+json",
                                                       "model/gltf-binary"};

enum { WARNINGS_MAX = 64 };

tw_model *tw_model_create(void) {
  tw_arena *arena = tw_arena_create();
  if (!arena) return NULL;
  tw_model *model = tw_arena_alloc(arena, 1, sizeof *model);
  if (!model) {
    tw_arena_destroy(arena);
    return NULL;
  }
  model->arena = arena;
  return model;
}

void tw_model_destroy(tw_model *model) {
  if (!model) return;
  tw_gltf_assets_destroy(model->assets);
  tw_arena_destroy(model->arena); /* holds the model itself */
}

size_t tw_model_size(const tw_model *model) {
  return tw_arena_size(model->arena) + tw_gltf_assets_size(model->assets);
}

void tw_model_warn(tw_model *model, const char *format, ...) {
  if (model->warning_count == WARNINGS_MAX) {
    model->warnings[WARNINGS_MAX - 1] = "there are more warnings";
    return;
  }
  if (!model->warnings) model->warnings = tw_arena_alloc(model->arena, WARNINGS_MAX, sizeof(char *));
  if (!model->warnings) return;
  tw_error sentence; /* for its cut between characters */
  char text[sizeof sentence.detail];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  tw_fail(&sentence, TW_OK, "%s", text);
  const char *kept = tw_arena_text(model->arena, sentence.detail, strlen(sentence.detail));
  if (kept) model->warnings[model->warning_count++] = kept;
}

/* ---- checks --------------------------------------------------------------------------------- */

static tw_status fail_at(tw_error *error, const char *array, uint32_t index, const char *rest,
                         const char *detail) {
  tw_fail(error, TW_INVALID, "%s", detail);
  tw_error_at(error, "/%s/%u%s", array, index, rest);
  return TW_INVALID;
}

/* Puts "/array/index" before the pointer of an error that is relative to that element. */
static void prefix_pointer(tw_error *error, const char *array, uint32_t index) {
  if (!error) return;
  char relative[sizeof error->pointer];
  memcpy(relative, error->pointer, sizeof relative);
  tw_error_at(error, "/%s/%u%s", array, index, relative);
}

/* An empty name is none. */
static tw_status check_name(const char **name, const char *array, uint32_t index, tw_error *error) {
  if (!*name) return TW_OK;
  if (!tw_utf8_is_name(*name, strlen(*name)))
    return fail_at(error, array, index, "/name", "a name must be UTF-8 text without control characters");
  if (!**name) *name = NULL;
  return TW_OK;
}

static bool all_finite(const float *values, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (!isfinite(values[i])) return false;
  return true;
}

static tw_status check_meshes(tw_model *model, tw_error *error) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh *mesh = &model->meshes[i];
    tw_status status = check_name(&mesh->name, "meshes", i, error);
    if (status != TW_OK) return status;
    status = tw_mesh_check(mesh, error, NULL);
    if (status != TW_OK) {
      prefix_pointer(error, "meshes", i);
      return status;
    }
    for (uint32_t face = 0; mesh->face_materials && face < mesh->face_count; face++) {
      int32_t material = mesh->face_materials[face];
      if (material >= -1 && (material < 0 || (uint32_t)material < model->material_count)) continue;
      return fail_at(error, "meshes", i, "/materials", "a face names a material that does not exist");
    }
    for (uint32_t face = 0; mesh->face_groups && face < mesh->face_count; face++) {
      uint32_t group = mesh->face_groups[face];
      if (group == TW_NO_INDEX || group < model->group_count) continue;
      return fail_at(error, "meshes", i, "/groups", "a face names a group that does not exist");
    }
  }
  return TW_OK;
}

/* Rotation to unit length; false for one that has none. */
static bool normalise(float q[4]) {
  double length = 0;
  for (int i = 0; i < 4; i++) length += (double)q[i] * (double)q[i];
  length = sqrt(length);
  if (!(length > 1e-20) || !isfinite(length)) return false;
  for (int i = 0; i < 4; i++) q[i] = (float)((double)q[i] / length);
  return true;
}

static tw_status check_node(const tw_model *model, uint32_t index, tw_error *error) {
  tw_node *node = &model->nodes[index];
  if (node->mesh != TW_NO_INDEX && node->mesh >= model->mesh_count)
    return fail_at(error, "nodes", index, "/mesh", "the node's mesh does not exist");
  if (node->skin != TW_NO_INDEX && node->skin >= model->skin_count)
    return fail_at(error, "nodes", index, "/skin", "the node's skin does not exist");
  if (node->has_matrix) {
    if (!all_finite(node->matrix, 16))
      return fail_at(error, "nodes", index, "/matrix", "the node's matrix is not finite");
    tw_trs_from_matrix(node->matrix, &node->rest);
    return TW_OK;
  }
  if (!all_finite(node->rest.translation, 3))
    return fail_at(error, "nodes", index, "/translation", "the node's translation is not finite");
  if (!all_finite(node->rest.scale, 3))
    return fail_at(error, "nodes", index, "/scale", "the node's scale is not finite");
  if (!normalise(node->rest.rotation))
    return fail_at(error, "nodes", index, "/rotation", "the node's rotation is zero or not finite");
  return TW_OK;
}

/* One node a mesh, for a source that has no hierarchy. */
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

static tw_status check_nodes(tw_model *model, tw_error *error) {
  if (model->node_count == 0 && model->mesh_count > 0) {
    tw_status status = add_mesh_nodes(model, error);
    if (status != TW_OK) return status;
  }
  for (uint32_t i = 0; i < model->node_count; i++) {
    tw_status status = check_name(&model->nodes[i].name, "nodes", i, error);
    if (status == TW_OK) status = check_node(model, i, error);
    if (status != TW_OK) return status;
  }
  model->node_order = tw_arena_alloc(model->arena, model->node_count, sizeof *model->node_order);
  if (!model->node_order) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  return tw_nodes_order(model->nodes, model->node_count, model->node_order, error);
}

static tw_status check_skins(tw_model *model, tw_error *error) {
  for (uint32_t i = 0; i < model->skin_count; i++) {
    tw_skin *skin = &model->skins[i];
    tw_status status = check_name(&skin->name, "skins", i, error);
    if (status != TW_OK) return status;
    if (skin->joint_count == 0) return fail_at(error, "skins", i, "/joints", "a skin needs a joint");
    for (uint32_t j = 0; j < skin->joint_count; j++)
      if (skin->joints[j] >= model->node_count)
        return fail_at(error, "skins", i, "/joints", "a joint is not a node of the model");
    if (!all_finite(skin->inverse_bind, (size_t)skin->joint_count * 16))
      return fail_at(error, "skins", i, "/inverseBindMatrices", "an inverse bind matrix is not finite");
    if (skin->skeleton != TW_NO_INDEX && skin->skeleton >= model->node_count)
      return fail_at(error, "skins", i, "/skeleton", "the skeleton is not a node of the model");
  }
  return TW_OK;
}

/* The joint numbers that the points of each mesh use exist in the skin that its node names. */
static tw_status check_skinned_nodes(const tw_model *model, tw_error *error) {
  uint32_t *highest = tw_alloc_zero(model->mesh_count, sizeof *highest);
  if (!highest) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_mesh *mesh = &model->meshes[i];
    if (!mesh->skin.joints) continue;
    for (size_t j = 0; j < (size_t)mesh->point_count * 4; j++)
      if (mesh->skin.joints[j] > highest[i]) highest[i] = mesh->skin.joints[j];
  }
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < model->node_count && status == TW_OK; i++) {
    const tw_node *node = &model->nodes[i];
    if (node->skin == TW_NO_INDEX || node->mesh == TW_NO_INDEX) continue;
    if (model->meshes[node->mesh].skin.joints && highest[node->mesh] >= model->skins[node->skin].joint_count)
      status = fail_at(error, "nodes", i, "/skin", "the mesh uses more joints than the skin has");
  }
  free(highest);
  return status;
}

/* A weights track has one number a morph target of its node's mesh; without a mesh it moves nothing. */
static tw_status check_weight_tracks(const tw_model *model, uint32_t index, tw_error *error) {
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->path != TW_WEIGHTS) continue;
    uint32_t mesh = model->nodes[track->node].mesh;
    if (mesh == TW_NO_INDEX || model->meshes[mesh].morph_count == track->width) continue;
    tw_fail(error, TW_INVALID, "a track of weights does not fit the morph targets of its node's mesh");
    tw_error_at(error, "/clips/%u/tracks/%u", index, i);
    return TW_INVALID;
  }
  return TW_OK;
}

/* Names the tracks with steps of 180 degrees and more: they load, but may not move as meant. */
static void warn_of_turns(tw_model *model, uint32_t index, const tw_clip *clip) {
  char clip_name[24], node_name[24];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    if (track->path != TW_ROTATION) continue;
    uint32_t count = 0;
    for (uint32_t key = 0; key + 1 < track->timeline->key_count; key++)
      count += tw_track_turn(track, key) != TURN_SHORT;
    if (count == 0) continue;
    tw_model_warn(
        model, "%u step%s of %s: clip \"%s\", node \"%s\"", count, count > 1 ? "s" : "",
        tw_track_says_angles(track) ? "180 degrees or more, which quaternions would turn another way"
                                    : "exactly 180 degrees, whose way is arbitrary",
        tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
}

static tw_status check_clips(tw_model *model, tw_error *error) {
  for (uint32_t i = 0; i < model->clip_count; i++) {
    tw_status status = check_name(&model->clips[i].name, "clips", i, error);
    if (status != TW_OK) return status;
    tw_clip *clip = NULL;
    status = tw_clip_create(&model->clips[i], model->node_count, -1, &clip, error);
    if (status != TW_OK) {
      prefix_pointer(error, "clips", i);
      return status;
    }
    warn_of_turns(model, i, clip);
    tw_clip_destroy(clip);
    status = check_weight_tracks(model, i, error);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

tw_status tw_model_finish(tw_model *model, tw_error *error) {
  tw_status status = check_meshes(model, error);
  if (status == TW_OK) status = check_nodes(model, error);
  if (status == TW_OK) status = check_skins(model, error);
  if (status == TW_OK) status = check_skinned_nodes(model, error);
  if (status == TW_OK) status = check_clips(model, error);
  return status;
}

/* ---- names ---------------------------------------------------------------------------------- */

const char *tw_model_node_name(const tw_model *model, uint32_t node, char buffer[24]) {
  if (model->nodes[node].name) return model->nodes[node].name;
  snprintf(buffer, 24, "node_%u", node);
  return buffer;
}

const char *tw_model_clip_name(const tw_model *model, uint32_t clip, char buffer[24]) {
  if (model->clips[clip].name) return model->clips[clip].name;
  snprintf(buffer, 24, "clip_%u", clip);
  return buffer;
}

static bool same_text(const char *text, const char *other, size_t length) {
  return strlen(text) == length && memcmp(text, other, length) == 0;
}

uint32_t tw_model_find_node(const tw_model *model, const char *name, size_t length) {
  char buffer[24];
  for (uint32_t i = 0; i < model->node_count; i++)
    if (same_text(tw_model_node_name(model, i, buffer), name, length)) return i;
  return TW_NO_INDEX;
}

uint32_t tw_model_find_clip(const tw_model *model, const char *name, size_t length) {
  char buffer[24];
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (same_text(tw_model_clip_name(model, i, buffer), name, length)) return i;
  return TW_NO_INDEX;
}
