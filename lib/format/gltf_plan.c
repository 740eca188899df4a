/* Plans a glTF answer: accessors that were preserved of the file, images, then for each mesh its vertices and
 * its triangles by material, then inverse bind matrices, then animations. Sizes come from counts alone; no
 * point is computed. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"
#include "sorted.h"

enum {
  /* of all converted tracks together: two keys may stand for many turns, which take many LINEAR keys */
  ADDED_KEYS_MAX = 1 << 20
};

/* ---- adding ---------------------------------------------------------------------------------- */

/* Adds the accessors that the assets preserved of the file. They come first, because preserved text names
 * them by number. */
static void add_elements(tw_gltf_plan *plan, const tw_gltf_assets *assets) {
  for (uint32_t i = 0; i < assets->element_count; i++) {
    const tw_gltf_elements *elements = &assets->elements[i];
    tw_gltf_view view = {.size = (uint64_t)elements->count * elements->stride,
                         .element_size = 1,
                         .source = TW_GLTF_MEMORY,
                         .memory = elements->bytes,
                         .target = elements->target,
                         .stride = elements->target == TW_GLTF_VERTICES ? elements->stride : 0};
    tw_gltf_accessor accessor = {.view = tw_gltf_add_view(plan, view),
                                 .component = elements->component,
                                 .is_normalized = elements->normalized,
                                 .type = elements->type,
                                 .count = elements->count,
                                 .bound_count = elements->bound_count};
    memcpy(accessor.min, elements->min, sizeof accessor.min);
    memcpy(accessor.max, elements->max, sizeof accessor.max);
    tw_gltf_add_accessor(plan, accessor);
  }
}

/* ---- vertices -------------------------------------------------------------------------------- */

static uint32_t add_rows(tw_gltf_plan *plan, uint32_t mesh, const tw_surface *surface, tw_gltf_view view) {
  view.element_size = view.stride = tw_vertex_size(view.fields, view.field_count);
  view.size = tw_surface_row_count(surface, TW_DOMAIN_VERTICES) * view.stride;
  view.target = TW_GLTF_VERTICES;
  view.source = TW_GLTF_ROWS;
  view.mesh = mesh;
  return tw_gltf_add_view(plan, view);
}

/* Adds an accessor for each field of attributes (morph: -1) or of the displacements of a target; the first
 * field is the position. Returns the first accessor. */
static uint32_t add_fields(tw_gltf_plan *plan, const tw_vertex_field *fields, uint32_t count, int morph,
                           tw_gltf_accessor accessor) {
  uint32_t first = plan->accessor_count;
  accessor.morph = morph;
  for (uint32_t i = 0; i < count; i++) {
    accessor.is_bounded_later = i == 0;
    accessor.offset = fields[i].offset;
    accessor.component = tw_vertex_component(fields[i].coding);
    accessor.is_normalized = tw_vertex_is_normalized(fields[i].coding);
    accessor.type = tw_gltf_type_of((int)fields[i].width);
    tw_gltf_add_accessor(plan, accessor);
  }
  return first;
}

/* Sets fields to vectors, in columns from `column` and bytes from `offset` on. */
static void lay_displacements(tw_vertex_field *fields, uint32_t column, uint32_t offset, uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    fields[i] = (tw_vertex_field){.column = column + 3 * i, .width = 3, .offset = offset + 12 * i};
}

/* Adds displacements in views of their own, as many targets to a view as its stride allows. False without
 * memory. */
static bool add_target_views(tw_gltf_plan *plan, uint32_t index, const tw_surface *surface,
                             tw_gltf_accessor accessor) {
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  uint32_t step = plan->meshes[index].target_step, most = TW_DISPLACEMENTS_MAX / step;
  for (uint32_t first = 0; first < layout->morph_count; first += most) {
    uint32_t rest = layout->morph_count - first, count = rest < most ? rest : most;
    tw_vertex_field *fields = tw_arena_alloc(plan->arena, count, step * sizeof *fields);
    if (!fields) return false;
    lay_displacements(fields, tw_vertex_target_column(layout, count), 0, step * count);
    accessor.view = add_rows(
        plan, index, surface,
        (tw_gltf_view){
            .fields = fields, .field_count = step * count, .first_target = first, .target_count = count});
    for (uint32_t i = 0; i < count; i++)
      add_fields(plan, fields + (size_t)step * i, step, (int)(first + i), accessor);
  }
  return true;
}

/* Adds one view if attributes and displacements fit in glTF's largest stride; else the displacements go to
 * views of their own. False without memory. */
static bool add_vertices(tw_gltf_plan *plan, uint32_t index, const tw_surface *surface,
                         tw_gltf_primitive *primitive) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  tw_vertex_field *fields =
      tw_arena_alloc(plan->arena, TW_VERTEX_FIELDS_MAX + (size_t)TW_DISPLACEMENTS_MAX, sizeof *fields);
  if (!fields) return false;
  mesh->fields = fields;
  mesh->field_count = tw_vertex_fields(layout, &tw_vertex_floats, fields);
  mesh->target_count = layout->morph_count;
  mesh->target_step = layout->morph_width / 3;
  uint32_t size = tw_vertex_size(fields, mesh->field_count), step = mesh->target_step;
  uint32_t together = layout->morph_count;
  assert(size <= TW_VERTEX_STRIDE_MAX); /* see tw_surface_influences */
  if (step * together > (TW_VERTEX_STRIDE_MAX - size) / 12) together = 0;
  lay_displacements(fields + mesh->field_count, layout->morphs, size, step * together);
  tw_gltf_accessor accessor = {
      .count = tw_surface_row_count(surface, TW_DOMAIN_VERTICES), .mesh = index, .pack = TW_NO_INDEX};
  accessor.view = add_rows(plan, index, surface,
                           (tw_gltf_view){.fields = fields,
                                          .field_count = mesh->field_count + step * together,
                                          .target_count = together});
  primitive->first_attribute = add_fields(plan, mesh->fields, mesh->field_count, -1, accessor);
  primitive->first_target = plan->accessor_count;
  for (uint32_t i = 0; i < together; i++)
    add_fields(plan, &fields[mesh->field_count + step * i], step, (int)i, accessor);
  return together == layout->morph_count || add_target_views(plan, index, surface, accessor);
}

/* ---- primitives ------------------------------------------------------------------------------ */

/* Whether all faces are holes: holes are the last groups of a surface. */
static bool is_all_holes(const tw_surface *surface) {
  return tw_surface_get_group(surface, 0)->material >= TW_HOLE_MATERIAL;
}

/* If all faces are holes, adds a primitive that draws nothing (one vertex three times), so that the mesh has
 * its vertices. */
static void add_holder_of_holes(tw_gltf_plan *plan, tw_gltf_mesh *mesh, const tw_gltf_primitive *shared) {
  static const uint32_t corner[3] = {0, 0, 0};
  tw_gltf_primitive *primitive = &mesh->primitives[mesh->primitive_count++];
  *primitive = *shared;
  primitive->faces.material = -1;
  uint32_t view = tw_gltf_add_view(plan, (tw_gltf_view){.size = sizeof corner,
                                                        .element_size = 1,
                                                        .source = TW_GLTF_MEMORY,
                                                        .memory = corner,
                                                        .target = TW_GLTF_INDICES});
  primitive->indices = tw_gltf_add_accessor(
      plan,
      (tw_gltf_accessor){.view = view, .component = TW_GLTF_UNSIGNED_INT, .type = "SCALAR", .count = 3});
}

/* Adds a primitive for each material, with the vertices of `shared`. */
static void add_triangles(tw_gltf_plan *plan, uint32_t index, const tw_surface *surface,
                          const tw_gltf_primitive *shared) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  bool narrow = tw_surface_row_count(surface, TW_DOMAIN_VERTICES) <= UINT16_MAX;
  uint32_t index_size = narrow ? sizeof(uint16_t) : sizeof(uint32_t);
  if (is_all_holes(surface)) add_holder_of_holes(plan, mesh, shared);
  for (uint32_t i = 0; i < tw_surface_group_count(surface);) {
    /* Holes are the last groups of a surface. */
    tw_gltf_primitive *primitive = &mesh->primitives[mesh->primitive_count + mesh->hole_count];
    *primitive = *shared;
    primitive->faces = tw_take_material(surface, &i);
    if (primitive->faces.material >= TW_HOLE_MATERIAL)
      mesh->hole_count++;
    else
      mesh->primitive_count++;
    primitive->triangle_count = tw_count_triangles(&primitive->faces);
    uint32_t view = tw_gltf_add_view(plan, (tw_gltf_view){.size = primitive->triangle_count * 3 * index_size,
                                                          .element_size = 3 * index_size,
                                                          .target = TW_GLTF_INDICES,
                                                          .source = TW_GLTF_TRIANGLES,
                                                          .mesh = index,
                                                          .faces = primitive->faces});
    primitive->indices = tw_gltf_add_accessor(
        plan, (tw_gltf_accessor){.view = view,
                                 .component = narrow ? TW_GLTF_UNSIGNED_SHORT : TW_GLTF_UNSIGNED_INT,
                                 .type = "SCALAR",
                                 .count = primitive->triangle_count * 3});
  }
}

/* ---- packs ----------------------------------------------------------------------------------- */

static uint32_t add_part(tw_gltf_plan *plan, uint32_t mesh, const tw_packs *packs, uint32_t pack,
                         uint32_t part) {
  const tw_pack_part whole = tw_packs_part(packs, pack, part);
  tw_gltf_view view = {.size = tw_packs_part_size(packs, pack, part),
                       .element_size = 1,
                       .stride = whole.has_vertices ? whole.stride : 0,
                       .target = whole.has_vertices ? TW_GLTF_VERTICES : TW_GLTF_INDICES,
                       .source = TW_GLTF_PACK,
                       .mesh = mesh,
                       .pack = pack,
                       .part = part};
  if (packs->options.encoding == TW_ENCODING_MESHOPT) {
    bool is_ngon = packs->options.polygons == TW_POLYGONS_NGON;
    view.decoded = (tw_gltf_decoded){.mode = whole.has_vertices ? "ATTRIBUTES"
                                             : is_ngon          ? "INDICES"
                                                                : "TRIANGLES",
                                     .offset = plan->decoded_size,
                                     .size = (uint64_t)whole.count * whole.stride,
                                     .count = whole.count,
                                     .stride = whole.stride};
    plan->decoded_size += (view.decoded.size + 3) / 4 * 4;
  }
  return tw_gltf_add_view(plan, view);
}

static void add_pack(tw_gltf_plan *plan, uint32_t index, const tw_packs *packs, uint32_t pack) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  tw_gltf_primitive *primitive = &mesh->primitives[mesh->primitive_count++];
  const tw_pack *cut = &packs->packs[pack];
  primitive->faces = packs->runs[cut->run].faces;
  primitive->first_triangle = cut->first_triangle;
  primitive->triangle_count = cut->triangle_count;
  tw_gltf_accessor accessor = {.count = cut->vertex_count, .mesh = index, .pack = pack};
  accessor.view = add_part(plan, index, packs, pack, 0);
  primitive->first_attribute = add_fields(plan, mesh->fields, mesh->field_count, -1, accessor);
  primitive->first_target = plan->accessor_count;
  for (uint32_t part = 1; part < packs->part_count - 1; part++) {
    const tw_pack_part whole = tw_packs_part(packs, pack, part);
    accessor.view = add_part(plan, index, packs, pack, part);
    for (uint32_t i = 0; i < whole.target_count; i++) {
      tw_vertex_field fields[2];
      tw_packs_target_fields(packs, i, fields);
      add_fields(plan, fields, mesh->target_step, (int)(whole.first_target + i), accessor);
    }
  }
  uint32_t view = add_part(plan, index, packs, pack, packs->part_count - 1);
  primitive->indices =
      tw_gltf_add_accessor(plan, (tw_gltf_accessor){.view = view,
                                                    .component = TW_GLTF_UNSIGNED_SHORT,
                                                    .type = "SCALAR",
                                                    .count = 3 * (uint64_t)cut->triangle_count});
}

static void add_packs(tw_gltf_plan *plan, uint32_t index, const tw_packs *packs) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  mesh->fields = packs->fields;
  mesh->field_count = packs->field_count;
  mesh->target_count = packs->target_count;
  mesh->target_step = packs->target_step;
  for (uint32_t pack = 0; pack < packs->pack_count; pack++) add_pack(plan, index, packs, pack);
}

/* ---- meshes ---------------------------------------------------------------------------------- */

/* The accessor of all meshes without faces: glTF has no mesh without a primitive, and no primitive without
 * points, so they get one triangle of no size. */
static void add_nothing(tw_gltf_plan *plan) {
  if (plan->nothing != TW_NO_INDEX) return;
  plan->nothing = tw_gltf_add_accessor(
      plan,
      (tw_gltf_accessor){
          .view = TW_NO_INDEX, .component = TW_GLTF_FLOAT, .type = "VEC3", .count = 3, .bound_count = 3});
}

/* How many primitives a mesh with faces needs, those of holes included. */
static uint32_t count_primitives(const tw_scene *scene, uint32_t mesh) {
  if (scene->packs) return scene->packs[mesh]->pack_count;
  uint32_t count = is_all_holes(scene->surfaces[mesh]);
  for (uint32_t group = 0; group < tw_surface_group_count(scene->surfaces[mesh]); count++)
    tw_take_material(scene->surfaces[mesh], &group);
  return count;
}

static bool add_mesh(tw_gltf_plan *plan, const tw_scene *scene, uint32_t index) {
  tw_gltf_mesh *mesh = &plan->meshes[index];
  mesh->primitives = tw_arena_alloc(plan->arena, count_primitives(scene, index), sizeof *mesh->primitives);
  if (!mesh->primitives) return false;
  if (scene->packs) {
    add_packs(plan, index, scene->packs[index]);
    return true;
  }
  tw_gltf_primitive shared = {0};
  if (!add_vertices(plan, index, scene->surfaces[index], &shared)) return false;
  add_triangles(plan, index, scene->surfaces[index], &shared);
  return tw_gltf_add_cage_tags(plan, scene, index);
}

static tw_status add_meshes(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  plan->nothing = TW_NO_INDEX;
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    if (tw_surface_get_counts(scene->surfaces[i])->faces > 0) {
      if (!add_mesh(plan, scene, i)) return tw_gltf_no_memory(error);
    } else { /* holes are faces in cages only */
      plan->meshes[i].target_count = scene->model->meshes[i].morph_count;
      if (!scene->model->assets || !scene->model->meshes[i].loose) add_nothing(plan);
    }
  }
  return TW_OK;
}

/* ---- images, skins, animation ---------------------------------------------------------------- */

static void add_images(tw_gltf_plan *plan, const tw_model *model) {
  const tw_gltf_assets *assets = tw_gltf_assets_of(model);
  for (uint32_t i = 0; i < assets->image_count; i++) {
    const tw_gltf_image *image = &assets->images[i];
    plan->image_views[i] = image->bytes ? tw_gltf_add_memory(plan, image->bytes, image->size) : TW_NO_INDEX;
  }
}

const tw_gltf_assets *tw_gltf_assets_of(const tw_model *model) {
  static const tw_gltf_assets none = {.scene = TW_NO_INDEX};
  return model->assets ? model->assets : &none;
}

const char *tw_gltf_loose_of(const tw_scene *scene, const tw_clip_keys *clip) {
  return tw_gltf_assets_of(scene->model)->element_count > 0 ? clip->loose : NULL;
}

bool tw_gltf_node_is_skinned(const tw_scene *scene, const tw_node *node) {
  if (node->skin == TW_NO_INDEX || node->mesh == TW_NO_INDEX) return false;
  const tw_surface *surface = scene->surfaces[node->mesh];
  const tw_mesh *mesh = &scene->model->meshes[node->mesh];
  if (tw_surface_get_counts(surface)->faces == 0) /* points and lines, which pass through */
    return scene->model->assets && mesh->loose && mesh->loose_has_joints;
  return tw_surface_get_layout(surface)->joints != UINT32_MAX;
}

/* Whether the mesh's positions are shorts on a grid. */
static bool has_places(const tw_scene *scene, uint32_t mesh) {
  return scene->packs && scene->packs[mesh]->pack_count > 0 &&
         scene->packs[mesh]->fields->coding == TW_CODED_PLACES;
}

/* The inverse bind matrices of a skin whose meshes have positions on the grid: each turns them into
 * coordinates first. NULL without memory. */
static const float *undo_grid(tw_arena *arena, const tw_skin *skin, const tw_grid *grid) {
  float *out = tw_arena_alloc(arena, skin->joint_count, 16 * sizeof *out);
  for (uint32_t joint = 0; out && joint < skin->joint_count; joint++) {
    const float *from = skin->inverse_bind + 16 * (size_t)joint;
    float *to = out + 16 * (size_t)joint;
    for (int row = 0; row < 4; row++) {
      double moved = (double)from[12 + row];
      for (int column = 0; column < 3; column++) {
        to[4 * column + row] = from[4 * column + row] * grid->scale;
        moved += (double)from[4 * column + row] * (double)grid->origin[column];
      }
      to[12 + row] = (float)moved;
    }
  }
  return out;
}

static tw_status add_skins(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  const tw_model *model = scene->model;
  const tw_grid **grids = tw_arena_alloc(plan->arena, model->skin_count, sizeof *grids);
  if (!grids) return tw_gltf_no_memory(error);
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (tw_gltf_node_is_skinned(scene, node) && has_places(scene, node->mesh))
      grids[node->skin] = &scene->packs[node->mesh]->options.grid; /* meshes of a skin share one */
  }
  for (uint32_t i = 0; i < model->skin_count; i++) {
    const tw_skin *skin = &model->skins[i];
    const float *matrices = grids[i] ? undo_grid(plan->arena, skin, grids[i]) : skin->inverse_bind;
    if (!matrices) return tw_gltf_no_memory(error);
    plan->skin_matrices[i] = tw_gltf_add_floats(plan, matrices, skin->joint_count, 16);
  }
  return TW_OK;
}

/* Whether a child node has to hold the mesh and turn its 16-bit positions into coordinates (tw_gltf_plan's
 * holders). The matrices of a skin do so themselves. */
static bool needs_holder(const tw_scene *scene, const tw_node *node) {
  return node->mesh != TW_NO_INDEX && has_places(scene, node->mesh) && !tw_gltf_node_is_skinned(scene, node);
}

static void add_holders(tw_gltf_plan *plan, const tw_scene *scene) {
  plan->first_holder = scene->model->node_count;
  for (uint32_t i = 0; i < scene->model->node_count; i++)
    if (needs_holder(scene, &scene->model->nodes[i])) plan->holders[plan->holder_count++] = i;
}

uint32_t tw_gltf_holder_of(const tw_gltf_plan *plan, uint32_t node) {
  uint32_t at = tw_lower_bound(plan->holders, plan->holder_count, node);
  return at < plan->holder_count && plan->holders[at] == node ? plan->first_holder + at : TW_NO_INDEX;
}

/* Whether glTF can hold a track: it needs keys, and weights a mesh with as many targets. */
static bool fits_node(const tw_gltf_plan *plan, const tw_scene *scene, const tw_track_keys *track) {
  if (track->key_count == 0) return false;
  if (track->path != TW_WEIGHTS) return true;
  uint32_t mesh = scene->model->nodes[track->node].mesh;
  return mesh != TW_NO_INDEX && plan->meshes[mesh].target_count == track->width;
}

static uint32_t add_times(tw_gltf_plan *plan, const tw_track_keys *keys) {
  uint32_t view = tw_gltf_add_memory(plan, keys->times, keys->key_count * sizeof(float));
  return tw_gltf_add_accessor(plan, (tw_gltf_accessor){.view = view,
                                                       .component = TW_GLTF_FLOAT,
                                                       .type = "SCALAR",
                                                       .count = keys->key_count,
                                                       .bound_count = 1,
                                                       .min = {keys->times[0]},
                                                       .max = {keys->times[keys->key_count - 1]}});
}

static uint32_t add_values(tw_gltf_plan *plan, const tw_track_keys *keys) {
  uint64_t count = (uint64_t)keys->key_count * (keys->interpolation == TW_CUBICSPLINE ? 3 : 1);
  return keys->path == TW_WEIGHTS ? tw_gltf_add_floats(plan, keys->values, count * keys->width, 1)
                                  : tw_gltf_add_floats(plan, keys->values, count, (int)keys->width);
}

static tw_status add_channels(tw_gltf_plan *plan, const tw_scene *scene, const tw_clip_keys *clip,
                              uint32_t *added_keys_left, uint64_t *steps_left, tw_error *error) {
  const float *shared_times = NULL; /* tracks of one node often share their times */
  uint32_t shared_count = 0, input = 0;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    if (!fits_node(plan, scene, track)) continue;
    tw_track_keys keys;
    tw_status status = tw_gltf_keys_of(track, *added_keys_left, steps_left, plan->arena, &keys, error);
    if (status != TW_OK) return status;
    uint32_t own = track->interpolation == TW_EULER ? track->key_count : 0;
    if (keys.times != track->times) *added_keys_left -= keys.key_count - own;
    if (keys.times != shared_times || keys.key_count != shared_count) input = add_times(plan, &keys);
    shared_times = keys.times;
    shared_count = keys.key_count;
    uint32_t holder = track->path == TW_WEIGHTS ? tw_gltf_holder_of(plan, track->node) : TW_NO_INDEX;
    plan->channels[plan->channel_count++] =
        (tw_gltf_channel){.node = holder == TW_NO_INDEX ? track->node : holder,
                          .path = track->path,
                          .interpolation = keys.interpolation,
                          .input = input,
                          .output = add_values(plan, &keys),
                          .preserved = track->preserved};
  }
  return TW_OK;
}

static tw_status add_animations(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  uint32_t added_keys_left = ADDED_KEYS_MAX;
  uint64_t steps_left = TW_REDUCTION_STEPS;
  for (uint32_t i = 0; i < scene->clip_count; i++) {
    uint32_t first = plan->channel_count;
    tw_status status = add_channels(plan, scene, &scene->clips[i], &added_keys_left, &steps_left, error);
    if (status != TW_OK) return status;
    uint32_t count = plan->channel_count - first;
    if (count > 0 || tw_gltf_loose_of(scene, &scene->clips[i]))
      plan->animations[plan->animation_count++] = (tw_gltf_animation){i, first, count};
  }
  return TW_OK;
}

/* ---- groups ---------------------------------------------------------------------------------- */

/* Whether the groups of all meshes together are few and short enough for the JSON. Each mesh of a cage names
 * its groups once more in extras.tweend, which at most doubles their text. */
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

/* ---- the whole ------------------------------------------------------------------------------- */

static uint64_t count_tracks(const tw_scene *scene) {
  uint64_t count = 0;
  for (uint32_t i = 0; i < scene->clip_count; i++) count += scene->clips[i].track_count;
  return count;
}

static tw_status allocate(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  const tw_model *model = scene->model;
  plan->arena = tw_arena_create();
  if (!plan->arena) return tw_gltf_no_memory(error);
  plan->meshes = tw_arena_alloc(plan->arena, model->mesh_count, sizeof *plan->meshes);
  plan->animations = tw_arena_alloc(plan->arena, scene->clip_count, sizeof *plan->animations);
  plan->channels = tw_arena_alloc(plan->arena, (size_t)count_tracks(scene), sizeof *plan->channels);
  plan->image_views =
      tw_arena_alloc(plan->arena, tw_gltf_assets_of(model)->image_count, sizeof *plan->image_views);
  plan->skin_matrices = tw_arena_alloc(plan->arena, model->skin_count, sizeof *plan->skin_matrices);
  plan->holders = tw_arena_alloc(plan->arena, model->node_count, sizeof *plan->holders);
  bool all = plan->meshes && plan->animations && plan->channels && plan->image_views && plan->skin_matrices &&
             plan->holders;
  return all ? TW_OK : tw_gltf_no_memory(error);
}

tw_status tw_gltf_plan_init(tw_gltf_plan *plan, const tw_scene *scene, tw_error *error) {
  const tw_model *model = scene->model;
  *plan = (tw_gltf_plan){.part_count =
                             (scene->packs ? 2 : 1) * (uint64_t)model->node_count + model->material_count};
  tw_status status = tw_gltf_check_parts(plan, error);
  if (status == TW_OK) status = allocate(plan, scene, error);
  if (status == TW_OK) {
    plan->names_groups = names_groups(scene);
    add_elements(plan, tw_gltf_assets_of(model));
    add_images(plan, model);
    add_holders(plan, scene);
    status = add_meshes(plan, scene, error);
    if (status == TW_OK) status = add_skins(plan, scene, error);
    if (status == TW_OK) status = add_animations(plan, scene, error);
    if (status == TW_OK) status = tw_gltf_check_parts(plan, error);
  }
  if (status != TW_OK) tw_gltf_plan_deinit(plan);
  return status;
}

void tw_gltf_plan_deinit(tw_gltf_plan *plan) {
  tw_arena_destroy(plan->arena);
  tw_free(plan->views);
  tw_free(plan->accessors);
  *plan = (tw_gltf_plan){0};
}
