/* Models: their memory, the checks that every reader ends with, and the names that clients see. */
#include "tweend/model.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "clip.h"
#include "merge_points.h"
#include "mix_check.h"
#include "tweend/base.h"
#include "tweend/detail.h"

const char *const tw_format_names[TW_FORMATS] = {"obj", "tweend", "gltf", "glb", "stl", "ply", "bvh"};
const char *const tw_format_media_types[TW_FORMATS] = {
    "model/obj", "application/json", "model/gltf+json", "model/gltf-binary",
    "model/stl", "model/ply",        "model/x-bvh"};

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
  tw_arena_destroy(model->arena); /* holds the model itself */
}

size_t tw_model_size(const tw_model *model) {
  return tw_arena_size(model->arena);
}

void tw_model_warn(tw_model *model, const char *format, ...) {
  if (model->warning_count == TW_WARNINGS_MAX) {
    model->warnings[TW_WARNINGS_MAX - 1] = "there are more warnings";
    return;
  }
  if (!model->warnings) model->warnings = tw_arena_alloc(model->arena, TW_WARNINGS_MAX, sizeof(char *));
  if (!model->warnings) return;
  tw_error sentence; /* tw_fail cuts the detail between characters */
  char text[sizeof sentence.detail];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  tw_fail(&sentence, TW_OK, "%s", text);
  const char *kept = tw_arena_text(model->arena, sentence.detail, strlen(sentence.detail));
  if (kept) model->warnings[model->warning_count++] = kept;
}

void tw_model_warn_count(tw_model *model, uint64_t count, const char *one, const char *many) {
  if (count > 0) tw_model_warn(model, "%llu %s", (unsigned long long)count, tw_plural(count, one, many));
}

/* ---- names ----------------------------------------------------------------------------------- */

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

typedef struct named_node {
  const char *name;
  uint32_t index;
} named_node;

static int compare_named_nodes(const void *a, const void *b) {
  const named_node *left = a, *right = b;
  int order = strcmp(left->name, right->name);
  if (order != 0) return order;
  return left->index < right->index ? -1 : left->index > right->index;
}

/* Sorts the named nodes for binary search: a model may have many nodes, and requests may ask for many. */
static tw_status sort_names(tw_model *model, tw_error *error) {
  uint32_t count = 0, next = 0;
  for (uint32_t i = 0; i < model->node_count; i++) count += model->nodes[i].name != NULL;
  named_node *sorted = tw_alloc(count, sizeof *sorted);
  uint32_t *nodes = tw_arena_alloc(model->arena, count, sizeof *nodes);
  if (!sorted || !nodes) {
    tw_free(sorted);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  for (uint32_t i = 0; i < model->node_count; i++)
    if (model->nodes[i].name) sorted[next++] = (named_node){model->nodes[i].name, i};
  tw_status status = tw_sort(sorted, count, sizeof *sorted, compare_named_nodes);
  for (uint32_t i = 0; status == TW_OK && i < count; i++) nodes[i] = sorted[i].index;
  tw_free(sorted);
  if (status != TW_OK) return tw_fail(error, status, "the names of the nodes cannot be sorted");
  model->named_node_count = count;
  model->named_nodes = nodes;
  return TW_OK;
}

/* Compares a name with text[0..length) as strcmp does. */
static int compare_text(const char *name, const char *text, size_t length) {
  int order = strncmp(name, text, length);
  return order != 0 ? order : name[strnlen(name, length)] != '\0';
}

/* The index in a generated name, such as "node_3" for kind "node_"; TW_NO_INDEX if the text is no such
 * name. */
static uint32_t made_up_index(const char *kind, const char *text, size_t length, uint32_t count) {
  char buffer[24];
  size_t start = strlen(kind);
  uint64_t index = 0;
  if (length <= start || length >= sizeof buffer || memcmp(text, kind, start) != 0) return TW_NO_INDEX;
  for (size_t i = start; i < length && index < count; i++) index = 10 * index + (uint64_t)(text[i] - '0');
  if (index >= count) return TW_NO_INDEX;
  size_t printed = (size_t)snprintf(buffer, sizeof buffer, "%s%u", kind, (uint32_t)index);
  return printed == length && memcmp(buffer, text, length) == 0 ? (uint32_t)index : TW_NO_INDEX;
}

/* The place in named_nodes of the first name that is not less than name[0..length). */
static uint32_t lower_bound(const tw_model *model, const char *name, size_t length) {
  uint32_t low = 0, high = model->named_node_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (compare_text(model->nodes[model->named_nodes[middle]].name, name, length) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

uint32_t tw_model_namesakes(const tw_model *model, uint32_t node, const uint32_t **out) {
  const char *name = model->nodes[node].name;
  uint32_t first = name ? lower_bound(model, name, strlen(name)) : 0, end = first;
  while (name && end < model->named_node_count && !strcmp(model->nodes[model->named_nodes[end]].name, name))
    end++;
  *out = model->named_nodes + first;
  return end - first;
}

uint32_t tw_model_find_node(const tw_model *model, const char *name, size_t length) {
  uint32_t low = lower_bound(model, name, length);
  uint32_t named = low < model->named_node_count ? model->named_nodes[low] : TW_NO_INDEX;
  if (named != TW_NO_INDEX && compare_text(model->nodes[named].name, name, length) != 0) named = TW_NO_INDEX;
  uint32_t nameless = made_up_index("node_", name, length, model->node_count);
  if (nameless != TW_NO_INDEX && model->nodes[nameless].name) nameless = TW_NO_INDEX;
  return named < nameless ? named : nameless;
}

uint32_t tw_model_find_clip(const tw_model *model, const char *name, size_t length) {
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].name && compare_text(model->clips[i].name, name, length) == 0) return i;
  return made_up_index("clip_", name, length, model->clip_count);
}

/* ---- checks ---------------------------------------------------------------------------------- */

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

/* An empty name becomes NULL. */
static tw_status check_name(const char **name, const char *array, uint32_t index, tw_error *error) {
  if (!*name) return TW_OK;
  if (!tw_utf8_is_name(*name, strlen(*name)))
    return fail_at(error, array, index, "/name", "a name must be UTF-8 text without control characters");
  if (strlen(*name) > TW_NAME_MAX)
    return fail_at(error, array, index, "/name", "a name has at most 1024 bytes");
  if (!**name) *name = NULL;
  return TW_OK;
}

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
  bool *is_used = tw_alloc_zero(mesh->point_count, sizeof *is_used);
  if (!is_used) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  *unused += mesh->point_count;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    *unused -= !is_used[mesh->corners[c]];
    is_used[mesh->corners[c]] = true;
  }
  tw_free(is_used);
  return TW_OK;
}

/* Checks the meshes, and drops details that do not fit. */
static tw_status finish_meshes(tw_model *model, tw_error *error) {
  uint64_t unused = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh *mesh = &model->meshes[i];
    tw_status status = check_name(&mesh->name, "meshes", i, error);
    if (status != TW_OK) return status;
    status = tw_mesh_check(mesh, error, NULL);
    if (status != TW_OK) {
      prefix_pointer(error, "meshes", i);
      return status;
    }
    status = drop_unfit_details(model, i, error);
    if (status == TW_OK) status = count_unused(mesh, &unused, error);
    if (status != TW_OK) return status;
    for (uint32_t face = 0; mesh->face_materials && face < mesh->face_count; face++) {
      int32_t material = mesh->face_materials[face];
      if (material >= -1 && (material < 0 || (uint32_t)material < model->material_count + model->slot_count))
        continue;
      return fail_at(error, "meshes", i, "/materials", "a face names a material that does not exist");
    }
    for (uint32_t face = 0; mesh->face_groups && face < mesh->face_count; face++) {
      uint32_t group = mesh->face_groups[face];
      if (group == TW_NO_INDEX || group < model->group_count) continue;
      return fail_at(error, "meshes", i, "/groups", "a face names a group that does not exist");
    }
  }
  tw_model_warn_count(model, unused, "point is in no face: answers leave it out",
                      "points are in no face: answers leave them out");
  return TW_OK;
}

/* Whether a quaternion is off unit length by more than rounding: numbers of bytes are within this. */
static bool is_off_unit(double length) {
  return fabs(length - 1) > 0.01;
}

/* Scales a rotation to unit length; false if it is zero or not finite. Counts in *scaled what was off. */
static bool normalise(float q[4], uint32_t *scaled) {
  double unit[4];
  quat_widen(q, unit);
  double length = tw_normalize(unit, 4);
  if (!(length > 1e-20) || !isfinite(length)) return false;
  *scaled += is_off_unit(length);
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
    return fail_at(error, "nodes", index, "/mesh", "the node's mesh does not exist");
  if (node->skin != TW_NO_INDEX && node->skin >= model->skin_count)
    return fail_at(error, "nodes", index, "/skin", "the node's skin does not exist");
  if (node->has_matrix) {
    if (!all_finite(node->matrix, 16))
      return fail_at(error, "nodes", index, "/matrix", "the node's matrix is not finite");
    tw_trs_from_matrix(node->matrix, &node->rest);
    losses->sheared += !is_trs(node->matrix, &node->rest);
    return TW_OK;
  }
  if (!all_finite(node->rest.translation, 3))
    return fail_at(error, "nodes", index, "/translation", "the node's translation is not finite");
  if (!all_finite(node->rest.scale, 3))
    return fail_at(error, "nodes", index, "/scale", "the node's scale is not finite");
  if (!normalise(node->rest.rotation, &losses->scaled))
    return fail_at(error, "nodes", index, "/rotation", "the node's rotation is zero or not finite");
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

/* ---- meshes far from the origin -------------------------------------------------------------- */

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

/* Gives the frames of far meshes to the nodes that show them. */
static tw_status place_far_meshes(tw_model *model, tw_error *error) {
  uint32_t far = 0;
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
  forget_places(model);
  tw_status prepared = place_far_meshes(model, error);
  if (prepared == TW_OK) prepared = warn_of_unshown(model, error);
  if (prepared != TW_OK) return prepared;
  node_losses losses = {0};
  for (uint32_t i = 0; i < model->node_count; i++) {
    tw_status status = check_name(&model->nodes[i].name, "nodes", i, error);
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
      status = fail_at(error, "nodes", i, "/skin", "the mesh uses more joints than the skin has");
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
    uint32_t held = tw_mesh_influences(mesh, 0);
    if (held < mesh->skin.width)
      tw_model_warn(model,
                    "mesh %u has so many attributes that its answers keep the %u heaviest of %u joints of a "
                    "point",
                    i, held, mesh->skin.width);
  }
}

/* Checks that a track of weights has one number for each morph target of its node's mesh. On a node without a
 * mesh it moves nothing. */
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

/* Counts the steps of a rotation track that turn by 180 degrees or more. Compiles a window of keys at a time,
 * so that memory does not grow with the track; each window begins with the last key of the one before. */
static tw_status count_turns(const tw_track_keys *track, uint32_t *count, bool *says_angles,
                             tw_error *error) {
  enum { WINDOW = 4096 };
  *count = 0;
  *says_angles = track->interpolation == TW_EULER;
  for (uint32_t key = 0; *says_angles && key + 1 < track->key_count; key++) {
    const double *angles = track->angles + 3 * (size_t)key;
    *count += tw_angles_turn(angles, angles + 3) != TURN_SHORT;
  }
  if (*says_angles) return TW_OK;
  for (uint32_t first = 0; first + 1 < track->key_count; first += WINDOW) {
    tw_track_keys part = *track;
    part.node = 0;
    part.key_count = track->key_count - first < WINDOW + 1 ? track->key_count - first : WINDOW + 1;
    part.times += first;
    if (part.values) part.values += (size_t)first * track->width;
    if (part.angles) part.angles += (size_t)first * track->width;
    tw_clip *clip;
    tw_status status =
        tw_clip_create(&(tw_clip_keys){.track_count = 1, .tracks = &part}, 1, -1, &clip, error);
    if (status != TW_OK) return status;
    for (uint32_t key = 0; key + 1 < part.key_count; key++)
      *count += tw_track_turn(&clip->tracks[0], key) != TURN_SHORT;
    *says_angles = tw_track_says_angles(&clip->tracks[0]);
    tw_clip_destroy(clip);
  }
  return TW_OK;
}

/* Warns of tracks with steps of 180 degrees or more: they load, but may not move as meant. */
static tw_status warn_of_turns(tw_model *model, uint32_t index, tw_error *error) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    bool joins = track->interpolation != TW_STEP && track->interpolation != TW_CUBICSPLINE, says_angles;
    uint32_t count = 0;
    if (track->path != TW_ROTATION || !joins) continue;
    tw_status status = count_turns(track, &count, &says_angles, error);
    if (status != TW_OK) return status;
    if (count == 0) continue;
    tw_model_warn(model, "%u %s of %s: clip \"%s\", node \"%s\"", count, tw_plural(count, "step", "steps"),
                  says_angles ? "180 degrees or more, which quaternions would turn another way"
                              : "exactly 180 degrees, whose way is arbitrary",
                  tw_model_clip_name(model, index, clip_name),
                  tw_model_node_name(model, track->node, node_name));
  }
  return TW_OK;
}

/* Counts the quaternions of a track that are off unit length; those of splines stay as they are. */
static uint64_t count_off_unit(const tw_track_keys *track) {
  uint64_t count = 0;
  bool is_scaled = track->form == TW_KEY_QUATERNION && track->interpolation != TW_CUBICSPLINE;
  for (uint32_t i = 0; is_scaled && i < track->key_count; i++) {
    double key[4];
    quat_widen(track->values + 4 * (size_t)i, key);
    count += is_off_unit(tw_length(key, 4));
  }
  return count;
}

/* Warns of splines of rotations whose keys glTF cannot hold as they are. */
static void warn_of_lengths(tw_model *model, uint32_t index) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->interpolation == TW_CUBICSPLINE && !tw_keys_fit_gltf(track))
      tw_model_warn(
          model,
          "the spline's quaternions are not of unit length: it moves as they say, and glTF answers have "
          "LINEAR keys within 0.1 degrees of it: clip \"%s\", node \"%s\"",
          tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
}

/* Warns of tracks with several keys at one time. */
static void warn_of_duplicates(tw_model *model, uint32_t index) {
  char clip_name[24], node_name[24];
  const tw_clip_keys *clip = &model->clips[index];
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (track->duplicate_times > 0)
      tw_model_warn(
          model, "%u %s at the time of the one before, where the %s jump%s: clip \"%s\", node \"%s\"",
          track->duplicate_times, tw_plural(track->duplicate_times, "key", "keys"),
          tw_path_names[track->path], track->path == TW_WEIGHTS ? "" : "s",
          tw_model_clip_name(model, index, clip_name), tw_model_node_name(model, track->node, node_name));
  }
}

static int compare_clip_names(const void *a, const void *b) {
  const tw_clip_keys *left = *(const tw_clip_keys *const *)a, *right = *(const tw_clip_keys *const *)b;
  int order = strcmp(left->name, right->name);
  return order != 0 ? order : (left > right) - (left < right);
}

/* Says of a clip that shares its name with one before it how to ask for it. */
static tw_status warn_of_namesakes(tw_model *model, tw_error *error) {
  const tw_clip_keys **sorted = tw_alloc(model->clip_count, sizeof *sorted);
  uint32_t count = 0;
  if (!sorted) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].name) sorted[count++] = &model->clips[i];
  tw_status status = tw_sort(sorted, count, sizeof *sorted, compare_clip_names);
  for (uint32_t i = 1; status == TW_OK && i < count; i++)
    if (strcmp(sorted[i]->name, sorted[i - 1]->name) == 0)
      tw_model_warn(model, "another clip is called %.100s, too: clip_%u asks for this one", sorted[i]->name,
                    (uint32_t)(sorted[i] - model->clips));
  tw_free(sorted);
  return status == TW_OK ? TW_OK : tw_fail(error, status, "the names of the clips cannot be sorted");
}

static tw_status check_clips(tw_model *model, tw_error *error) {
  tw_status status = TW_OK;
  uint64_t scaled = 0, empty = 0;
  for (uint32_t i = 0; i < model->clip_count && status == TW_OK; i++) {
    status = check_name(&model->clips[i].name, "clips", i, error);
    if (status != TW_OK) return status;
    status = tw_clip_check(&model->clips[i], model->node_count, -1, true, error);
    if (status == TW_OK) status = tw_clip_separate(&model->clips[i], model->arena, error);
    if (status != TW_OK) {
      prefix_pointer(error, "clips", i);
      return status;
    }
    warn_of_duplicates(model, i);
    warn_of_lengths(model, i);
    status = check_weight_tracks(model, i, error);
    if (status == TW_OK) status = warn_of_turns(model, i, error);
    const tw_clip_keys *clip = &model->clips[i];
    for (uint32_t k = 0; k < clip->track_count; k++) scaled += count_off_unit(&clip->tracks[k]);
    empty += clip->track_count == 0 && clip->layer_count == 0 && !clip->loose;
  }
  tw_model_warn_count(model, scaled, "rotation key is not of unit length: it is scaled to it",
                      "rotation keys are not of unit length: they are scaled to it");
  tw_model_warn_count(model, empty, "clip has no tracks: glTF answers leave it out",
                      "clips have no tracks: glTF answers leave them out");
  return status;
}

tw_status tw_model_finish(tw_model *model, tw_error *error) {
  tw_status status = finish_meshes(model, error);
  if (status == TW_OK) status = finish_nodes(model, error);
  if (status == TW_OK) status = sort_names(model, error);
  if (status == TW_OK) status = check_skins(model, error);
  if (status == TW_OK) status = check_skinned_nodes(model, error);
  if (status == TW_OK) status = check_clips(model, error);
  if (status == TW_OK) status = tw_clips_check_layers(model->clips, model->clip_count, error);
  if (status == TW_OK) status = warn_of_namesakes(model, error);
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
