/* Prints the JSON of a glTF answer: in each object the members that the plan knows, then those that were
 * preserved of the file. */
#include <stdlib.h>
#include <string.h>

#include "gltf_json_writer.h"
#include "tweend/json_text.h"

/* ---- views and accessors --------------------------------------------------------------------- */

/* The extension that says where the compressed bytes of a view are. */
static void put_compression(tw_gltf_writer *writer, const tw_gltf_view *view) {
  tw_member_open(writer->text, "extensions", "{");
  tw_member_open(writer->text, TW_GLTF_MESHOPT, "{");
  tw_member_count(writer->text, "buffer", 0);
  if (view->offset) tw_member_count(writer->text, "byteOffset", view->offset);
  tw_member_count(writer->text, "byteLength", view->size);
  tw_member_count(writer->text, "byteStride", view->decoded.stride);
  tw_member_count(writer->text, "count", view->decoded.count);
  tw_member_string(writer->text, "mode", view->decoded.mode);
  tw_text_add(writer->text, "}}");
}

static void put_views(tw_gltf_writer *writer) {
  if (writer->plan->view_count == 0) return;
  tw_member_open(writer->text, "bufferViews", "[");
  for (uint32_t i = 0; i < writer->plan->view_count; i++) {
    const tw_gltf_view *view = &writer->plan->views[i];
    tw_gltf_open_object(writer);
    bool is_compressed = view->decoded.mode;
    uint64_t offset = is_compressed ? view->decoded.offset : view->offset;
    tw_member_count(writer->text, "buffer", is_compressed ? 1 : 0);
    if (offset) tw_member_count(writer->text, "byteOffset", offset);
    tw_member_count(writer->text, "byteLength", is_compressed ? view->decoded.size : view->size);
    if (view->stride) tw_member_count(writer->text, "byteStride", view->stride);
    if (view->target) tw_member_count(writer->text, "target", (uint64_t)view->target);
    if (is_compressed) put_compression(writer, view);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* Prints each float as the double that it is, because readers compare bounds with the data. */
static void put_bounds(tw_gltf_writer *writer, const char *member, const float *bounds, uint32_t count) {
  tw_member_open(writer->text, member, "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_text_element(writer->text);
    tw_text_double(writer->text, (double)bounds[i]);
  }
  tw_text_add(writer->text, "]");
}

/* Prints three fields of spaces for bounds that are filled in later; returns where the first one stands. */
static size_t put_later(tw_gltf_writer *writer, const char *member) {
  char blanks[TW_GLTF_BOUND_TEXT];
  memset(blanks, ' ', sizeof blanks);
  tw_member_open(writer->text, member, "[");
  size_t place = writer->text->size;
  for (int i = 0; i < 3; i++) {
    tw_text_element(writer->text);
    tw_text_bytes(writer->text, blanks, sizeof blanks);
  }
  tw_text_add(writer->text, "]");
  return place;
}

static void put_accessor(tw_gltf_writer *writer, tw_gltf_accessor *accessor) {
  if (accessor->view != TW_NO_INDEX) tw_member_count(writer->text, "bufferView", accessor->view);
  if (accessor->offset) tw_member_count(writer->text, "byteOffset", accessor->offset);
  tw_member_count(writer->text, "componentType", (uint64_t)accessor->component);
  tw_member_count(writer->text, "count", accessor->count);
  tw_member_string(writer->text, "type", accessor->type);
  if (accessor->is_normalized) tw_member_open(writer->text, "normalized", "true");
  if (accessor->bound_count > 0) {
    put_bounds(writer, "max", accessor->max, accessor->bound_count);
    put_bounds(writer, "min", accessor->min, accessor->bound_count);
  }
  if (accessor->is_bounded_later) {
    accessor->max_text = put_later(writer, "max");
    accessor->min_text = put_later(writer, "min");
  }
}

static void put_accessors(tw_gltf_writer *writer) {
  if (writer->plan->accessor_count == 0) return;
  tw_member_open(writer->text, "accessors", "[");
  for (uint32_t i = 0; i < writer->plan->accessor_count; i++) {
    tw_gltf_open_object(writer);
    put_accessor(writer, &writer->plan->accessors[i]);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* ---- nodes ----------------------------------------------------------------------------------- */

/* What the JSON needs to know of each node beside the node itself. */
typedef struct node_facts {
  uint32_t first_child; /* place in the model's node_order, where its other children follow; or TW_NO_INDEX */
  bool animated;        /* so it must not have a matrix */
} node_facts;

/* NULL without memory. */
static node_facts *find_facts(const tw_scene *scene) {
  const tw_model *model = scene->model;
  node_facts *facts = tw_alloc(model->node_count, sizeof *facts);
  if (!facts) return NULL;
  for (uint32_t i = 0; i < model->node_count; i++) facts[i] = (node_facts){.first_child = TW_NO_INDEX};
  for (uint32_t place = model->node_count; place-- > 0;) {
    uint32_t parent = model->nodes[model->node_order[place]].parent;
    if (parent != TW_NO_INDEX) facts[parent].first_child = place;
  }
  for (uint32_t i = 0; i < scene->clip_count; i++)
    for (uint32_t j = 0; j < scene->clips[i].track_count; j++)
      facts[scene->clips[i].tracks[j].node].animated = true;
  return facts;
}

static void put_floats_unless(tw_gltf_writer *writer, const char *member, const float *values, size_t count,
                              const float *usual) {
  for (size_t i = 0; i < count; i++) {
    if (values[i] == usual[i]) continue;
    tw_member_floats(writer->text, member, values, count);
    return;
  }
}

/* Prints the elements of an exact translation, as it is in a pose. */
static void put_place(tw_gltf_writer *writer, const tw_node *node, const float *translation) {
  for (int c = 0; c < 3; c++) {
    tw_text_element(writer->text);
    tw_text_double(writer->text, (double)translation[c] + tw_node_fine(node, c));
  }
}

static void put_matrix(tw_gltf_writer *writer, const tw_node *node) {
  enum { PLACE = 12 };
  if (!node->place) {
    tw_member_floats(writer->text, "matrix", node->matrix, 16);
    return;
  }
  tw_member_open(writer->text, "matrix", "[");
  for (int i = 0; i < PLACE; i++) {
    tw_text_element(writer->text);
    tw_text_float(writer->text, node->matrix[i]);
  }
  put_place(writer, node, node->matrix + PLACE);
  tw_text_element(writer->text);
  tw_text_float(writer->text, node->matrix[15]);
  tw_text_add(writer->text, "]");
}

static void put_transform(tw_gltf_writer *writer, uint32_t index, bool animated) {
  const tw_scene *scene = writer->scene;
  const tw_node *node = &scene->model->nodes[index];
  bool moved = animated || (scene->posed_by && tw_clip_moves(scene->posed_by, index));
  if (node->has_matrix && !moved) {
    put_matrix(writer, node);
    return;
  }
  const tw_trs *local = scene->pose ? &scene->pose[index] : &node->rest, usual = TW_TRS_IDENTITY;
  if (node->place) {
    tw_member_open(writer->text, "translation", "[");
    put_place(writer, node, local->translation);
    tw_text_add(writer->text, "]");
  } else {
    put_floats_unless(writer, "translation", local->translation, 3, usual.translation);
  }
  put_floats_unless(writer, "rotation", local->rotation, 4, usual.rotation);
  put_floats_unless(writer, "scale", local->scale, 3, usual.scale);
}

/* The members of a node that shows a mesh: mesh, skin and weights. */
static void put_mesh_of(tw_gltf_writer *writer, uint32_t index) {
  const tw_scene *scene = writer->scene;
  const tw_node *node = &scene->model->nodes[index];
  tw_member_count(writer->text, "mesh", node->mesh);
  if (tw_gltf_node_is_skinned(scene, node)) tw_member_count(writer->text, "skin", node->skin);
  const float *weights = scene->weights ? scene->weights[index] : NULL;
  if (!weights) weights = node->weights;
  uint32_t count = writer->plan->meshes[node->mesh].target_count;
  if (weights && count > 0) tw_member_floats(writer->text, "weights", weights, count);
}

/* Prints the children of a node in the file's order, if it is not that of their numbers. False for other
 * nodes. */
static bool put_reordered(tw_gltf_writer *writer, uint32_t index) {
  const tw_gltf_assets *assets = writer->assets;
  uint32_t low = 0, high = assets->reordered_count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (assets->reordered[middle].node < index)
      low = middle + 1;
    else
      high = middle;
  }
  if (low == assets->reordered_count || assets->reordered[low].node != index) return false;
  for (uint32_t i = 0; i < assets->reordered[low].count; i++) {
    tw_text_element(writer->text);
    tw_text_count(writer->text, assets->reordered[low].nodes[i]);
  }
  return true;
}

/* The holder of the node's mesh comes first, and children that the file has not come last. */
static void put_children(tw_gltf_writer *writer, uint32_t first, uint32_t index, uint32_t holder) {
  const tw_model *model = writer->scene->model;
  if (first == TW_NO_INDEX && holder == TW_NO_INDEX) return;
  tw_member_open(writer->text, "children", "[");
  if (holder != TW_NO_INDEX) tw_text_count(writer->text, holder);
  bool is_reordered = put_reordered(writer, index);
  for (uint32_t i = first; i < model->node_count && model->nodes[model->node_order[i]].parent == index; i++) {
    if (is_reordered && model->node_order[i] < writer->assets->node_count) continue;
    tw_text_element(writer->text);
    tw_text_count(writer->text, model->node_order[i]);
  }
  tw_text_add(writer->text, "]");
}

static void put_node(tw_gltf_writer *writer, node_facts facts, uint32_t index) {
  const tw_node *node = &writer->scene->model->nodes[index];
  uint32_t holder = tw_gltf_holder_of(writer->plan, index);
  tw_gltf_open_object(writer);
  tw_gltf_put_name(writer, node->name);
  if (node->mesh != TW_NO_INDEX && holder == TW_NO_INDEX) put_mesh_of(writer, index);
  put_transform(writer, index, facts.animated);
  put_children(writer, facts.first_child, index, holder);
  tw_gltf_put_preserved(writer, node->preserved, NULL);
  tw_gltf_close_object(writer);
}

/* An added node that holds the mesh of node `index`, and turns its 16-bit positions into coordinates. */
static void put_holder(tw_gltf_writer *writer, uint32_t index) {
  const tw_grid *grid = &writer->scene->packs[writer->scene->model->nodes[index].mesh]->options.grid;
  const float scale[3] = {grid->scale, grid->scale, grid->scale};
  tw_gltf_open_object(writer);
  put_mesh_of(writer, index);
  tw_member_floats(writer->text, "translation", grid->origin, 3);
  tw_member_floats(writer->text, "scale", scale, 3);
  tw_gltf_close_object(writer);
}

static void put_nodes(tw_gltf_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->node_count == 0) return;
  node_facts *facts = find_facts(writer->scene);
  if (!facts) writer->text->failed = true;
  tw_member_open(writer->text, "nodes", "[");
  for (uint32_t i = 0; facts && i < model->node_count; i++) put_node(writer, facts[i], i);
  for (uint32_t i = 0; facts && i < writer->plan->holder_count; i++)
    put_holder(writer, writer->plan->holders[i]);
  tw_text_add(writer->text, "]");
  tw_free(facts);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

/* The root of a node that a scene lists: itself, or the node that the answer adds above it. */
static uint32_t listed_root(const tw_gltf_writer *writer, uint32_t node) {
  uint32_t parent = writer->scene->model->nodes[node].parent;
  return parent != TW_NO_INDEX && parent >= writer->assets->node_count ? parent : node;
}

/* Prints the roots from node `first` on. The file's own nodes say in an extension whether they are visible;
 * of nodes that the answer adds, only the visible ones are printed. but: one that is printed already. */
static void put_roots(tw_gltf_writer *writer, uint32_t first, uint32_t but) {
  const tw_model *model = writer->scene->model;
  for (uint32_t i = first; i < model->node_count; i++) {
    bool is_added = i >= writer->assets->node_count;
    if (model->nodes[i].parent != TW_NO_INDEX || (is_added && model->nodes[i].is_hidden)) continue;
    if (i == but) continue;
    tw_text_element(writer->text);
    tw_text_count(writer->text, i);
  }
}

/* One of the file's scenes. Roots that the answer has beside the file's go to the default scene. */
static void put_scene(tw_gltf_writer *writer, uint32_t index) {
  const tw_gltf_scene *scene = &writer->assets->scenes[index];
  uint32_t file_nodes = writer->assets->node_count;
  bool is_shown = index == (writer->assets->scene == TW_NO_INDEX ? 0 : writer->assets->scene);
  bool has_more = is_shown && writer->scene->model->node_count > file_nodes;
  tw_gltf_open_object(writer);
  if (scene->node_count > 0 || has_more) {
    tw_member_open(writer->text, "nodes", "[");
    uint32_t added = TW_NO_INDEX; /* there is one at most: for the root motion */
    for (uint32_t i = 0; i < scene->node_count; i++) {
      uint32_t root = listed_root(writer, scene->nodes[i]);
      if (root != scene->nodes[i]) added = root;
      tw_text_element(writer->text);
      tw_text_count(writer->text, root);
    }
    if (has_more) put_roots(writer, file_nodes, added);
    tw_text_add(writer->text, "]");
  }
  tw_gltf_put_preserved(writer, scene->preserved, NULL);
  tw_gltf_close_object(writer);
}

static void put_scenes(tw_gltf_writer *writer) {
  const tw_gltf_assets *assets = writer->assets;
  if (assets->scene_count == 0) {
    if (writer->scene->model->node_count == 0) return;
    tw_member_count(writer->text, "scene", 0);
    tw_text_add(writer->text, ",\"scenes\":[{\"nodes\":[");
    put_roots(writer, 0, TW_NO_INDEX);
    tw_text_add(writer->text, "]}]");
    return;
  }
  if (assets->scene != TW_NO_INDEX) tw_member_count(writer->text, "scene", assets->scene);
  tw_member_open(writer->text, "scenes", "[");
  for (uint32_t i = 0; i < assets->scene_count; i++) put_scene(writer, i);
  tw_text_add(writer->text, "]");
}

/* ---- skins and animations -------------------------------------------------------------------- */

static void put_skins(tw_gltf_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->skin_count == 0) return;
  tw_member_open(writer->text, "skins", "[");
  for (uint32_t i = 0; i < model->skin_count; i++) {
    const tw_skin *skin = &model->skins[i];
    tw_gltf_open_object(writer);
    tw_gltf_put_name(writer, skin->name);
    tw_gltf_put_indices(writer, "joints", skin->joints, skin->joint_count);
    tw_member_count(writer->text, "inverseBindMatrices", writer->plan->skin_matrices[i]);
    if (skin->skeleton != TW_NO_INDEX) tw_member_count(writer->text, "skeleton", skin->skeleton);
    tw_gltf_put_preserved(writer, skin->preserved, NULL);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* The members of one part (channel, target or sampler) of a preserved track. */
static void put_part(tw_gltf_writer *writer, const char *preserved, const char *name) {
  tw_gltf_put_preserved(writer, tw_json_member(preserved, name), NULL);
}

/* The channels, or samplers, as `name` says, that animate something else than nodes; they follow those of
 * nodes. */
static void put_loose_channels(tw_gltf_writer *writer, const char *loose, const char *name,
                               uint32_t sampler) {
  tw_json_item item;
  for (bool more = tw_json_first(loose, &item); more; more = tw_gltf_next_item(writer, &item)) {
    tw_gltf_open_object(writer);
    if (strcmp(name, "channel") == 0) tw_member_count(writer->text, "sampler", sampler++);
    put_part(writer, item.value, name);
    tw_gltf_close_object(writer);
  }
}

static void put_channel(tw_gltf_writer *writer, const tw_gltf_channel *channel, uint32_t sampler) {
  tw_gltf_open_object(writer);
  tw_member_count(writer->text, "sampler", sampler);
  tw_member_open(writer->text, "target", "{");
  tw_member_count(writer->text, "node", channel->node);
  tw_member_string(writer->text, "path", tw_path_names[channel->path]);
  put_part(writer, channel->preserved, "target");
  tw_gltf_close_object(writer);
  put_part(writer, channel->preserved, "channel");
  tw_gltf_close_object(writer);
}

static void put_sampler(tw_gltf_writer *writer, const tw_gltf_channel *channel) {
  static const char *const interpolations[] = {"STEP", "LINEAR", "CUBICSPLINE"};
  tw_gltf_open_object(writer);
  tw_member_count(writer->text, "input", channel->input);
  tw_member_string(writer->text, "interpolation", interpolations[channel->interpolation]);
  tw_member_count(writer->text, "output", channel->output);
  put_part(writer, channel->preserved, "sampler");
  tw_gltf_close_object(writer);
}

static void put_animation(tw_gltf_writer *writer, const tw_gltf_animation *animation) {
  const tw_clip_keys *clip = &writer->scene->clips[animation->clip];
  const tw_gltf_channel *channels = writer->plan->channels + animation->first_channel;
  tw_gltf_open_object(writer);
  tw_gltf_put_name(writer, clip->name);
  tw_member_open(writer->text, "channels", "[");
  const char *loose = tw_gltf_loose_of(writer->scene, clip);
  for (uint32_t i = 0; i < animation->channel_count; i++) put_channel(writer, &channels[i], i);
  if (loose) put_loose_channels(writer, loose, "channel", animation->channel_count);
  tw_text_add(writer->text, "]");
  tw_member_open(writer->text, "samplers", "[");
  for (uint32_t i = 0; i < animation->channel_count; i++) put_sampler(writer, &channels[i]);
  if (loose) put_loose_channels(writer, loose, "sampler", 0);
  tw_text_add(writer->text, "]");
  tw_gltf_put_preserved(writer, clip->preserved, NULL);
  tw_gltf_close_object(writer);
}

static void put_animations(tw_gltf_writer *writer) {
  if (writer->plan->animation_count == 0) return;
  tw_member_open(writer->text, "animations", "[");
  for (uint32_t i = 0; i < writer->plan->animation_count; i++)
    put_animation(writer, &writer->plan->animations[i]);
  tw_text_add(writer->text, "]");
}

/* ---- assets ---------------------------------------------------------------------------------- */

static void put_images(tw_gltf_writer *writer) {
  if (writer->assets->image_count == 0) return;
  tw_member_open(writer->text, "images", "[");
  for (uint32_t i = 0; i < writer->assets->image_count; i++) {
    const tw_gltf_image *image = &writer->assets->images[i];
    tw_gltf_open_object(writer);
    if (image->bytes) {
      tw_member_count(writer->text, "bufferView", writer->plan->image_views[i]);
      if (image->mime_type) tw_member_open(writer->text, "mimeType", image->mime_type);
    }
    tw_gltf_put_preserved(writer, image->preserved, NULL);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* A material of an OBJ, which gives a name, or of tweend JSON, which gives a colour. It is no metal, which
 * glTF's default is: without an environment metals are black. */
static void put_plain_material(tw_gltf_writer *writer, uint32_t index) {
  const tw_model *model = writer->scene->model;
  tw_gltf_open_object(writer);
  tw_gltf_put_name(writer, model->material_names[index]);
  tw_member_open(writer->text, "pbrMetallicRoughness", "{");
  if (model->material_colors) {
    const float *color = model->material_colors + 3 * (size_t)index;
    tw_member_floats(writer->text, "baseColorFactor", (const float[4]){color[0], color[1], color[2], 1}, 4);
  }
  tw_member_count(writer->text, "metallicFactor", 0);
  tw_text_add(writer->text, "}");
  tw_gltf_close_object(writer);
}

static void put_materials(tw_gltf_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->assets) {
    tw_gltf_put_objects(writer, "materials", &writer->assets->materials);
    return;
  }
  if (model->material_count == 0) return;
  tw_member_open(writer->text, "materials", "[");
  for (uint32_t i = 0; i < model->material_count; i++) put_plain_material(writer, i);
  tw_text_add(writer->text, "]");
}

static void put_asset(tw_gltf_writer *writer) {
  tw_member_open(writer->text, "asset", "{");
  tw_member_string(writer->text, "version", "2.0");
  tw_text_add(writer->text, ",\"generator\":\"tweend ");
  tw_text_add(writer->text, tw_version());
  tw_text_add(writer->text, "\"");
  tw_gltf_put_preserved(writer, writer->assets->asset, NULL);
  tw_gltf_close_object(writer);
}

/* ---- the whole ------------------------------------------------------------------------------- */

const tw_gltf_assets *tw_gltf_assets_bare(tw_arena *arena, const tw_gltf_assets *assets) {
  tw_gltf_assets *bare = assets ? tw_arena_alloc(arena, 1, sizeof *bare) : NULL;
  if (bare) *bare = (tw_gltf_assets){.asset = assets->asset, .scene = TW_NO_INDEX};
  return bare;
}

/* Whether a number, or each of an array, is `wanted`, or is not there. */
static bool are_all(const char *value, double wanted) {
  tw_json_item item;
  double number = wanted;
  if (!value) return true;
  if (*value != '[')
    return tw_read_double(value, (size_t)(tw_json_skip(value) - value), &number) > 0 && number == wanted;
  for (bool more = tw_json_first(value, &item); more; more = tw_json_next(tw_json_skip(item.value), &item))
    if (!are_all(item.value, wanted)) return false;
  return true;
}

uint32_t tw_gltf_moved_textures(const tw_gltf_assets *assets) {
  uint32_t count = 0;
  for (uint32_t i = 0; assets && i < assets->materials.count; i++) {
    const char *pbr = tw_json_member(assets->materials.items[i], "pbrMetallicRoughness");
    const char *extensions = tw_json_member(tw_json_member(pbr, "baseColorTexture"), "extensions");
    const char *transform = tw_json_member(extensions, "KHR_texture_transform");
    bool is_identity = are_all(tw_json_member(transform, "offset"), 0) &&
                       are_all(tw_json_member(transform, "rotation"), 0) &&
                       are_all(tw_json_member(transform, "scale"), 1);
    count += !is_identity;
  }
  return count;
}

void tw_gltf_put_json(tw_text *text, tw_gltf_plan *plan, const tw_scene *scene) {
  const tw_gltf_assets *assets = tw_gltf_assets_of(scene->model);
  tw_gltf_writer writer = {.plan = plan, .scene = scene, .assets = assets, .text = text};
  put_asset(&writer);
  put_scenes(&writer);
  put_nodes(&writer);
  tw_gltf_put_meshes(&writer);
  put_skins(&writer);
  put_animations(&writer);
  put_materials(&writer);
  tw_gltf_put_objects(&writer, "textures", &assets->textures);
  put_images(&writer);
  tw_gltf_put_objects(&writer, "samplers", &assets->samplers);
  tw_gltf_put_objects(&writer, "cameras", &assets->cameras);
  put_accessors(&writer);
  put_views(&writer);
  tw_gltf_put_preserved(&writer, assets->root, NULL);
  tw_gltf_put_extensions(&writer);
  tw_text_add(text, "}");
  tw_free(writer.used);
}
