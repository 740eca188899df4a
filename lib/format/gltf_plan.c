/* The layout of a glTF answer: images, then for each mesh its vertices and its triangles by material, then
 * bind matrices, then animation. Sizes come from counts alone; no point is computed. */
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"
#include "quat.h"

enum {
  ROW_COLUMNS_MAX = TW_GLTF_STRIDE_MAX / sizeof(float),
  ADDED_KEYS_MAX = 1 << 20 /* of all tracks that cannot keep their keys: two may say many turns */
};

/* Views, accessors, nodes and materials are told in the JSON, which is held in memory. */
static const uint64_t PARTS_MAX = 1 << 18;

static const tw_tolerance TOLERANCE = {.angle = 0.0017453292519943296, .distance = 1}; /* 0.1 degrees */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory for the plan of a glTF answer");
}

/* ---- adding -------------------------------------------------------------------------------------------- */

static uint32_t add_view(tw_gltf_plan *plan, tw_gltf_view view) {
  view.offset = plan->data_size;
  plan->data_size = (view.offset + view.size + 3) / 4 * 4;
  plan->views[plan->view_count] = view;
  return plan->view_count++;
}

static uint32_t add_accessor(tw_gltf_plan *plan, tw_gltf_accessor accessor) {
  plan->accessors[plan->accessor_count] = accessor;
  return plan->accessor_count++;
}

static uint32_t add_memory(tw_gltf_plan *plan, const void *memory, uint64_t size) {
  return add_view(
      plan, (tw_gltf_view){.size = size, .element_size = 1, .source = TW_GLTF_MEMORY, .memory = memory});
}

/* Floats in memory as an accessor of their own. */
static uint32_t add_floats(tw_gltf_plan *plan, const float *values, uint64_t count, int width) {
  uint32_t view = add_memory(plan, values, count * (uint64_t)width * sizeof(float));
  return add_accessor(
      plan, (tw_gltf_accessor){.view = view, .component = TW_GLTF_FLOAT, .width = width, .count = count});
}

/* What is handed on, first of all. */
static void add_elements(tw_gltf_plan *plan, const tw_gltf_assets *assets) {
  for (uint32_t i = 0; i < assets->element_count; i++) {
    const tw_gltf_elements *elements = &assets->elements[i];
    uint32_t view = add_memory(plan, elements->bytes, (uint64_t)elements->count * elements->stride);
    plan->views[view].target = elements->target;
    plan->views[view].stride = elements->target == TW_GLTF_VERTICES ? elements->stride : 0;
    add_accessor(plan, (tw_gltf_accessor){.view = view,
                                          .component = elements->component,
                                          .count = elements->count,
                                          .elements = elements});
  }
}

/* ---- vertices ------------------------------------------------------------------------------------------ */

static bool holds_joints(const tw_surface_layout *layout, uint32_t first, uint32_t count) {
  return layout->joints != UINT32_MAX && layout->joints >= first && layout->joints < first + count;
}

/* Joints are written as unsigned shorts, which saves 8 bytes a row. */
static uint32_t bytes_of_columns(const tw_surface_layout *layout, uint32_t first, uint32_t count) {
  return 4 * count - (holds_joints(layout, first, count) ? 8 : 0);
}

static uint32_t add_rows(tw_gltf_plan *plan, uint32_t mesh, const tw_surface *surface, uint32_t first,
                         uint32_t count) {
  uint32_t stride = bytes_of_columns(tw_surface_get_layout(surface), first, count);
  return add_view(plan, (tw_gltf_view){.size = tw_surface_row_count(surface, TW_DOMAIN_VERTICES) * stride,
                                       .element_size = stride,
                                       .stride = stride,
                                       .target = TW_GLTF_VERTICES,
                                       .source = TW_GLTF_ROWS,
                                       .mesh = mesh,
                                       .first_column = first,
                                       .column_count = count});
}

/* An attribute at a column of the view of vertices; none when the layout has none. */
static void add_attribute(tw_gltf_plan *plan, tw_gltf_mesh *mesh, const tw_surface *surface, uint32_t view,
                          const char *semantic, uint32_t column, int width) {
  if (column == UINT32_MAX) return;
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  bool joints = column == layout->joints, positions = column == layout->position;
  tw_gltf_accessor accessor = {.view = view,
                               .offset = bytes_of_columns(layout, 0, column),
                               .component = joints ? TW_GLTF_UNSIGNED_SHORT : TW_GLTF_FLOAT,
                               .width = width,
                               .count = tw_surface_row_count(surface, TW_DOMAIN_VERTICES),
                               .bounds = positions ? TW_GLTF_BOUNDED_LATER : TW_GLTF_UNBOUNDED,
                               .mesh = (uint32_t)(mesh - plan->meshes),
                               .morph = -1};
  mesh->attributes[mesh->attribute_count++] =
      (tw_gltf_attribute){.semantic = semantic, .accessor = add_accessor(plan, accessor)};
  plan->attribute_count++;
}

static void add_attributes(tw_gltf_plan *plan, tw_gltf_mesh *mesh, const tw_mesh *source,
                           const tw_surface *surface, uint32_t view) {
  static const char *const uv_semantics[TW_UV_SETS_MAX] = {"TEXCOORD_0", "TEXCOORD_1", "TEXCOORD_2",
                                                           "TEXCOORD_3"};
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  mesh->attributes = plan->attributes + plan->attribute_count;
  add_attribute(plan, mesh, surface, view, "POSITION", layout->position, 3);
  add_attribute(plan, mesh, surface, view, "NORMAL", layout->normal, 3);
  add_attribute(plan, mesh, surface, view, "TANGENT", layout->tangent, 4);
  for (uint32_t set = 0; set < layout->uv_count; set++)
    add_attribute(plan, mesh, surface, view, uv_semantics[set], layout->uvs[set], 2);
  for (uint32_t i = 0; i < layout->attribute_count; i++)
    add_attribute(plan, mesh, surface, view, source->attributes[i].name, layout->attributes[i],
                  (int)source->attributes[i].width);
  add_attribute(plan, mesh, surface, view, "JOINTS_0", layout->joints, 4);
  add_attribute(plan, mesh, surface, view, "WEIGHTS_0", layout->weights, 4);
}

static void add_targets(tw_gltf_plan *plan, uint32_t mesh, const tw_surface *surface, uint32_t view,
                        uint32_t offset, uint32_t first, uint32_t count) {
  uint32_t step = plan->meshes[mesh].target_step;
  for (uint32_t i = 0; i < step * count; i++)
    add_accessor(plan, (tw_gltf_accessor){.view = view,
                                          .offset = offset + 12 * i,
                                          .component = TW_GLTF_FLOAT,
                                          .width = 3,
                                          .count = tw_surface_row_count(surface, TW_DOMAIN_VERTICES),
                                          .bounds = i % step == 0 ? TW_GLTF_BOUNDED_LATER : TW_GLTF_UNBOUNDED,
                                          .mesh = mesh,
                                          .morph = (int)(first + i / step)});
}

/* One view while glTF's largest stride allows it; else the displacements at the end of the row go to views
 * of their own. */
static void add_vertices(tw_gltf_plan *plan, uint32_t index, const tw_mesh *source,
                         const tw_surface *surface) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  bool together = bytes_of_columns(layout, 0, layout->stride) <= TW_GLTF_STRIDE_MAX;
  uint32_t width = layout->morph_width, base = layout->stride - width * layout->morph_count;
  uint32_t view = add_rows(plan, index, surface, 0, together ? layout->stride : base);
  add_attributes(plan, mesh, source, surface, view);
  mesh->target_count = layout->morph_count;
  mesh->target_step = width / 3;
  mesh->first_target = plan->accessor_count;
  if (together) {
    add_targets(plan, index, surface, view, bytes_of_columns(layout, 0, base), 0, layout->morph_count);
    return;
  }
  uint32_t most = ROW_COLUMNS_MAX / width;
  for (uint32_t target = 0; target < layout->morph_count; target += most) {
    uint32_t rest = layout->morph_count - target, count = rest < most ? rest : most;
    view = add_rows(plan, index, surface, base + width * target, width * count);
    add_targets(plan, index, surface, view, 0, target, count);
  }
}

/* All faces of a material from group *i on, which is moved past them. */
static tw_surface_group take_material(const tw_surface *surface, uint32_t *i) {
  tw_surface_group faces = *tw_surface_get_group(surface, *i);
  while (++*i < tw_surface_group_count(surface)) {
    const tw_surface_group *next = tw_surface_get_group(surface, *i);
    if (next->material != faces.material) break;
    faces.face_count += next->face_count;
    faces.corner_count += next->corner_count;
  }
  return faces;
}

static void add_triangles(tw_gltf_plan *plan, uint32_t index, const tw_surface *surface) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  bool narrow = tw_surface_row_count(surface, TW_DOMAIN_VERTICES) <= UINT16_MAX;
  uint32_t index_size = narrow ? sizeof(uint16_t) : sizeof(uint32_t);
  mesh->first_indices = plan->accessor_count;
  for (uint32_t i = 0; i < tw_surface_group_count(surface); mesh->primitive_count++) {
    tw_surface_group faces = take_material(surface, &i);
    uint64_t triangles = faces.corner_count - 2 * faces.face_count;
    uint32_t view = add_view(plan, (tw_gltf_view){.size = triangles * 3 * index_size,
                                                  .element_size = 3 * index_size,
                                                  .target = TW_GLTF_INDICES,
                                                  .source = TW_GLTF_TRIANGLES,
                                                  .mesh = index,
                                                  .faces = faces});
    add_accessor(plan, (tw_gltf_accessor){.view = view,
                                          .component = narrow ? TW_GLTF_UNSIGNED_SHORT : TW_GLTF_UNSIGNED_INT,
                                          .width = 1,
                                          .count = triangles * 3});
  }
}

/* glTF has no mesh without a primitive, and no primitive without points: one triangle of no size. */
static void add_nothing(tw_gltf_plan *plan) {
  if (plan->nothing != TW_NO_INDEX) return;
  plan->nothing = add_accessor(plan, (tw_gltf_accessor){.view = TW_NO_INDEX,
                                                        .component = TW_GLTF_FLOAT,
                                                        .width = 3,
                                                        .count = 3,
                                                        .bounds = TW_GLTF_BOUNDED});
}

static void add_meshes(tw_gltf_plan *plan, const tw_scene *scene) {
  plan->nothing = TW_NO_INDEX;
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    const tw_surface *surface = scene->surfaces[i];
    if (tw_surface_get_counts(surface)->faces > 0) {
      add_vertices(plan, i, &scene->model->meshes[i], surface);
      add_triangles(plan, i, surface);
    } else {
      plan->meshes[i].target_count = scene->model->meshes[i].morph_count;
      if (!scene->model->assets || !scene->model->meshes[i].loose) add_nothing(plan);
    }
  }
}

/* ---- tracks as glTF can hold them ---------------------------------------------------------------------- */

/* Scales quaternions, of a spline with their tangents, to unit length and to the side of the one before, as
 * tw_clip does. Keys that are so already stay the track's own. */
static tw_status straighten(const tw_track_keys *track, tw_arena *arena, tw_track_keys *out,
                            tw_error *error) {
  bool is_spline = track->interpolation == TW_CUBICSPLINE;
  size_t width = is_spline ? 12 : 4, value = is_spline ? 4 : 0;
  float *scaled = NULL;
  double previous[4];
  for (size_t key = 0; key < track->key_count; key++) {
    double rotation[4];
    quat_widen(track->values + key * width + value, rotation);
    double scale = tw_quat_key_scale(rotation, key > 0 ? previous : NULL);
    for (int i = 0; i < 4; i++) previous[i] = rotation[i] * scale;
    if (scale == 1) continue;
    if (!scaled) {
      scaled = tw_arena_alloc_raw(arena, track->key_count, width * sizeof *scaled);
      if (!scaled) return no_memory(error);
      memcpy(scaled, track->values, track->key_count * width * sizeof *scaled);
    }
    for (size_t i = 0; i < width; i++)
      scaled[key * width + i] = (float)((double)track->values[key * width + i] * scale);
  }
  *out = *track;
  if (scaled) out->values = scaled;
  return TW_OK;
}

static tw_status take_spline(const tw_track_keys *track, tw_arena *arena, tw_track_keys *out,
                             tw_error *error) {
  *out = *track;
  tw_status status = track->path == TW_ROTATION ? straighten(track, arena, out, error) : TW_OK;
  if (status == TW_OK && track->key_count == 1) {
    out->interpolation = TW_STEP;
    out->values += out->width; /* between its tangents */
  }
  return status;
}

/* glTF interpolates between the keys as the track does. */
static bool is_native(const tw_track_keys *track) {
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  return track->interpolation == TW_STEP;
}

static tw_status take_rotation(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena,
                               tw_track_keys *out, tw_error *error) {
  if (is_native(track) && track->form == TW_KEY_QUATERNION) return straighten(track, arena, out, error);
  tw_track_keys alone = *track;
  alone.node = 0;
  const tw_clip_keys keys = {.track_count = 1, .tracks = &alone};
  tw_clip_keys taken;
  tw_tolerance reached;
  tw_clip *clip = NULL;
  tw_status status = tw_clip_create(&keys, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  status = is_native(track)
               ? tw_clip_bake(clip, track->times, track->key_count, arena, &taken, error)
               : tw_clip_reduce(clip, &keys, TOLERANCE, max_keys, arena, &taken, &reached, error);
  tw_clip_destroy(clip);
  if (status != TW_OK) return status;
  *out = taken.tracks[0];
  out->node = track->node;
  return TW_OK;
}

tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena, tw_track_keys *out,
                          tw_error *error) {
  if (track->interpolation == TW_CUBICSPLINE) return take_spline(track, arena, out, error);
  if (track->path == TW_ROTATION) return take_rotation(track, max_keys, arena, out, error);
  *out = *track;
  return TW_OK;
}

/* ---- images, skins, animation -------------------------------------------------------------------------- */

static void add_images(tw_gltf_plan *plan, const tw_model *model) {
  const tw_gltf_assets *assets = tw_gltf_assets_of(model);
  for (uint32_t i = 0; i < assets->image_count; i++) {
    const tw_gltf_image *image = &assets->images[i];
    plan->image_views[i] = image->bytes ? add_memory(plan, image->bytes, image->size) : TW_NO_INDEX;
  }
}

bool tw_gltf_node_is_skinned(const tw_scene *scene, const tw_node *node) {
  if (node->skin == TW_NO_INDEX || node->mesh == TW_NO_INDEX) return false;
  const tw_surface *surface = scene->surfaces[node->mesh];
  return tw_surface_get_counts(surface)->faces && tw_surface_get_layout(surface)->joints != UINT32_MAX;
}

static void add_skins(tw_gltf_plan *plan, const tw_model *model) {
  for (uint32_t i = 0; i < model->skin_count; i++)
    plan->skin_matrices[i] = add_floats(plan, model->skins[i].inverse_bind, model->skins[i].joint_count, 16);
}

/* glTF has weights only where a mesh with as many targets is shown. */
static bool fits_node(const tw_gltf_plan *plan, const tw_scene *scene, const tw_track_keys *track) {
  if (track->key_count == 0) return false;
  if (track->path != TW_WEIGHTS) return true;
  uint32_t mesh = scene->model->nodes[track->node].mesh;
  return mesh != TW_NO_INDEX && plan->meshes[mesh].target_count == track->width;
}

static uint32_t add_times(tw_gltf_plan *plan, const tw_track_keys *keys) {
  uint32_t input = add_floats(plan, keys->times, keys->key_count, 1);
  plan->accessors[input].bounds = TW_GLTF_BOUNDED;
  plan->accessors[input].min = keys->times[0];
  plan->accessors[input].max = keys->times[keys->key_count - 1];
  return input;
}

static uint32_t add_values(tw_gltf_plan *plan, const tw_track_keys *keys) {
  uint64_t count = (uint64_t)keys->key_count * (keys->interpolation == TW_CUBICSPLINE ? 3 : 1);
  return keys->path == TW_WEIGHTS ? add_floats(plan, keys->values, count * keys->width, 1)
                                  : add_floats(plan, keys->values, count, (int)keys->width);
}

static tw_status add_channels(tw_gltf_plan *plan, const tw_scene *scene, const tw_clip_keys *clip,
                              uint32_t *added_keys_left, tw_error *error) {
  const float *shared_times = NULL; /* tracks of one node often share their times */
  uint32_t shared_count = 0, input = 0;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (!fits_node(plan, scene, track)) continue;
    tw_track_keys keys;
    tw_status status = tw_gltf_keys_of(track, *added_keys_left, plan->arena, &keys, error);
    if (status != TW_OK) return status;
    if (keys.times != track->times) *added_keys_left -= keys.key_count;
    if (keys.times != shared_times || keys.key_count != shared_count) input = add_times(plan, &keys);
    shared_times = keys.times;
    shared_count = keys.key_count;
    plan->channels[plan->channel_count++] = (tw_gltf_channel){.node = track->node,
                                                              .path = track->path,
                                                              .interpolation = keys.interpolation,
                                                              .input = input,
                                                              .output = add_values(plan, &keys),
                                                              .kept = track->kept};
  }
  return TW_OK;
}

static tw_status add_animations(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  uint32_t added_keys_left = ADDED_KEYS_MAX;
  for (uint32_t i = 0; i < scene->clip_count; i++) {
    uint32_t first = plan->channel_count;
    tw_status status = add_channels(plan, scene, &scene->clips[i], &added_keys_left, error);
    if (status != TW_OK) return status;
    uint32_t count = plan->channel_count - first;
    bool has_loose = scene->model->assets && scene->clips[i].loose;
    if (count > 0 || has_loose)
      plan->animations[plan->animation_count++] = (tw_gltf_animation){i, first, count};
  }
  return TW_OK;
}

/* ---- groups -------------------------------------------------------------------------------------------- */

/* Whether the groups of all meshes together are few and short enough for the JSON. */
static bool names_groups(const tw_scene *scene) {
  enum { RANGES_MAX = 16384, TEXT_MAX = 1 << 20 };
  uint32_t ranges = 0;
  size_t text = 0;
  for (uint32_t i = 0; i < scene->model->mesh_count; i++)
    for (uint32_t g = 0; g < tw_surface_group_count(scene->surfaces[i]); g++) {
      uint32_t names = tw_surface_get_group(scene->surfaces[i], g)->names;
      if (names == TW_NO_INDEX) continue;
      text += strlen(scene->model->group_names[names]);
      if (++ranges > RANGES_MAX || text > TEXT_MAX) return false;
    }
  return true;
}

/* ---- the whole ----------------------------------------------------------------------------------------- */

static uint32_t count_attributes(const tw_surface_layout *layout) {
  uint32_t count = 1 + layout->uv_count + layout->attribute_count;
  count += layout->normal != UINT32_MAX;
  count += layout->tangent != UINT32_MAX;
  return layout->joints != UINT32_MAX ? count + 2 : count;
}

static uint32_t count_materials(const tw_surface *surface) {
  uint32_t count = 0;
  for (uint32_t group = 0; group < tw_surface_group_count(surface); count++) take_material(surface, &group);
  return count;
}

static uint64_t count_tracks(const tw_scene *scene) {
  uint64_t count = 0;
  for (uint32_t i = 0; i < scene->clip_count; i++) count += scene->clips[i].track_count;
  return count;
}

/* Upper bounds of views and accessors. */
static void count_most(const tw_scene *scene, uint64_t *views, uint64_t *accessors) {
  const tw_model *model = scene->model;
  uint64_t tracks = count_tracks(scene);
  const tw_gltf_assets *assets = tw_gltf_assets_of(model);
  *views = assets->element_count + assets->image_count + model->skin_count + 2 * tracks;
  *accessors = assets->element_count + model->skin_count + 2 * tracks;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_surface_layout *layout = tw_surface_get_layout(scene->surfaces[i]);
    uint64_t materials = count_materials(scene->surfaces[i]);
    *views += 1 + layout->morph_count + materials;
    *accessors += count_attributes(layout) + layout->morph_width / 3 * layout->morph_count + materials;
  }
}

static tw_status allocate(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  const tw_model *model = scene->model;
  uint64_t views, accessors;
  count_most(scene, &views, &accessors);
  uint64_t parts = views + accessors + model->node_count + model->material_count;
  if (parts > PARTS_MAX)
    return tw_fail(error, TW_LIMIT,
                   "as glTF the answer would have %llu nodes, materials, accessors and buffer views, over "
                   "the limit of %llu",
                   (unsigned long long)parts, (unsigned long long)PARTS_MAX);
  plan->arena = tw_arena_create();
  if (!plan->arena) return no_memory(error);
  plan->views = tw_arena_alloc(plan->arena, (size_t)views, sizeof *plan->views);
  plan->accessors = tw_arena_alloc(plan->arena, (size_t)accessors, sizeof *plan->accessors);
  plan->meshes = tw_arena_alloc(plan->arena, model->mesh_count, sizeof *plan->meshes);
  plan->attributes = tw_arena_alloc(plan->arena, (size_t)accessors, sizeof *plan->attributes);
  plan->animations = tw_arena_alloc(plan->arena, scene->clip_count, sizeof *plan->animations);
  plan->channels = tw_arena_alloc(plan->arena, (size_t)count_tracks(scene), sizeof *plan->channels);
  plan->image_views =
      tw_arena_alloc(plan->arena, tw_gltf_assets_of(model)->image_count, sizeof *plan->image_views);
  plan->skin_matrices = tw_arena_alloc(plan->arena, model->skin_count, sizeof *plan->skin_matrices);
  bool all = plan->views && plan->accessors && plan->meshes && plan->attributes && plan->animations &&
             plan->channels && plan->image_views && plan->skin_matrices;
  return all ? TW_OK : no_memory(error);
}

tw_status tw_gltf_plan_init(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  *plan = (tw_gltf_plan){0};
  tw_status status = allocate(plan, scene, error);
  if (status == TW_OK) {
    plan->names_groups = names_groups(scene);
    add_elements(plan, tw_gltf_assets_of(scene->model));
    add_images(plan, scene->model);
    add_meshes(plan, scene);
    add_skins(plan, scene->model);
    status = add_animations(plan, scene, error);
  }
  if (status != TW_OK) tw_gltf_plan_deinit(plan);
  return status;
}

void tw_gltf_plan_deinit(tw_gltf_plan *plan) {
  tw_arena_destroy(plan->arena);
  *plan = (tw_gltf_plan){0};
}
