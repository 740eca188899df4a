// The JSON of a glTF answer, written by tinygltf. It loses nothing that a plan holds: extensions it
// cannot write (of buffer views, accessors, samplers, skins) do not occur in one.
#include "gltf/gltf.h"

#include "gltf/document.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <sstream>

namespace {

const char *text_or_empty(const char *text) {
  return text ? text : "";
}

template <size_t Count> bool is(const float (&values)[Count], const float (&wanted)[Count]) {
  for (size_t i = 0; i < Count; i++)
    if (values[i] != wanted[i]) return false;
  return true;
}

template <size_t Count> std::vector<double> numbers(const float (&values)[Count]) {
  return std::vector<double>(values, values + Count);
}

int accessor_type(int width) {
  switch (width) {
  case 1: return TINYGLTF_TYPE_SCALAR;
  case 16: return TINYGLTF_TYPE_MAT4;
  default: return width; // TINYGLTF_TYPE_VEC2 is 2, and so on
  }
}

void add_views(tinygltf::Model &out, const tw_gltf_plan &plan) {
  out.bufferViews.resize(plan.view_count);
  for (uint32_t i = 0; i < plan.view_count; i++) {
    const tw_gltf_view &view = plan.views[i];
    tinygltf::BufferView &written = out.bufferViews[i];
    written.buffer = 0;
    written.byteOffset = view.offset;
    written.byteLength = view.size;
    written.target = view.target;
    if (view.target == TW_GLTF_VERTICES) written.byteStride = view.element_size;
  }
}

void add_accessors(tinygltf::Model &out, const tw_gltf_plan &plan) {
  out.accessors.resize(plan.accessor_count);
  for (uint32_t i = 0; i < plan.accessor_count; i++) {
    const tw_gltf_accessor &accessor = plan.accessors[i];
    tinygltf::Accessor &written = out.accessors[i];
    written.bufferView = static_cast<int>(accessor.view);
    written.byteOffset = accessor.offset;
    written.componentType = accessor.component;
    written.type = accessor_type(accessor.width);
    written.count = accessor.count;
    if (accessor.bounds == TW_GLTF_BOUNDED) {
      written.minValues = {accessor.min};
      written.maxValues = {accessor.max};
    } else if (accessor.bounds == TW_GLTF_BOUNDED_LATER) {
      // NaN is written as null: widen_bounds finds it.
      written.minValues.assign(3, std::numeric_limits<double>::quiet_NaN());
      written.maxValues = written.minValues;
    }
  }
}

std::map<std::string, int> attributes_of(const tw_gltf_mesh &mesh) {
  std::map<std::string, int> attributes;
  for (uint32_t i = 0; i < mesh.attribute_count; i++)
    attributes[mesh.attributes[i].semantic] = static_cast<int>(mesh.attributes[i].accessor);
  return attributes;
}

// ---- groups of faces: glTF has none. Cutting primitives at them would cost a draw call each, so they are
// told as ranges of indices, the form in which three.js has them (BufferGeometry.addGroup).

tinygltf::Value words(const char *names) {
  tinygltf::Value::Array out;
  for (const char *word = names; *word;) {
    size_t length = std::strcspn(word, " ");
    if (length > 0) out.emplace_back(std::string(word, length));
    word += length + (word[length] == ' ');
  }
  return tinygltf::Value(std::move(out));
}

// tinygltf's integers have 32 bits; a double is exact far beyond them.
tinygltf::Value number(uint64_t value) {
  return value <= INT32_MAX ? tinygltf::Value(static_cast<int>(value))
                            : tinygltf::Value(static_cast<double>(value));
}

uint64_t indices_of(uint64_t corners, uint64_t faces) {
  return 3 * (corners - 2 * faces);
}

// The extras of a primitive that draws `faces`: {"groups": [{"names": [...], "start": n, "count": n}, ...]},
// ranges of its indices, in order. Faces in no group are in no range; without any range the value is
// null. next_group: the first of the surface's groups among the faces; is moved past them.
tinygltf::Value group_ranges(const tw_model &model, const tw_surface &surface, const tw_surface_group &faces,
                             uint32_t &next_group) {
  tinygltf::Value::Array ranges;
  for (; next_group < tw_surface_group_count(&surface); next_group++) {
    const tw_surface_group &group = *tw_surface_get_group(&surface, next_group);
    if (group.first_face >= faces.first_face + faces.face_count) break;
    if (group.names == TW_NO_INDEX) continue;
    tinygltf::Value::Object range;
    range["names"] = words(model.group_names[group.names]);
    range["start"] =
        number(indices_of(group.first_corner - faces.first_corner, group.first_face - faces.first_face));
    range["count"] = number(indices_of(group.corner_count, group.face_count));
    ranges.emplace_back(std::move(range));
  }
  if (ranges.empty()) return tinygltf::Value();
  tinygltf::Value::Object extras;
  extras["groups"] = tinygltf::Value(std::move(ranges));
  return tinygltf::Value(std::move(extras));
}

void add_primitives(tinygltf::Mesh &out, const tw_gltf_mesh &mesh, const tw_gltf_plan &plan,
                    const tw_scene &scene) {
  const tw_surface *surface = scene.surfaces[mesh.source];
  const std::map<std::string, int> attributes = attributes_of(mesh);
  uint32_t group = 0;
  for (uint32_t i = 0; i < mesh.primitive_count; i++) {
    const uint32_t indices = mesh.first_indices + i;
    const tw_surface_group &faces = plan.views[plan.accessors[indices].view].faces;
    tinygltf::Primitive primitive;
    primitive.attributes = attributes;
    primitive.indices = static_cast<int>(indices);
    primitive.material = faces.material;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    for (uint32_t target = 0; target < mesh.target_count; target++)
      primitive.targets.push_back({{"POSITION", static_cast<int>(mesh.first_target + target)}});
    if (scene.polygons == TW_POLYGONS_NGON)
      primitive.extensions["FB_ngon_encoding"] = tinygltf::Value(tinygltf::Value::Object());
    if (plan.names_groups) primitive.extras = group_ranges(*scene.model, *surface, faces, group);
    out.primitives.push_back(std::move(primitive));
  }
}

void add_meshes(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_scene &scene) {
  out.meshes.resize(plan.mesh_count);
  for (uint32_t i = 0; i < plan.mesh_count; i++) {
    const tw_gltf_mesh &mesh = plan.meshes[i];
    const tw_mesh &source = scene.model->meshes[mesh.source];
    out.meshes[i].name = text_or_empty(source.name);
    if (mesh.target_count && source.morph_weights)
      out.meshes[i].weights.assign(source.morph_weights, source.morph_weights + mesh.target_count);
    add_primitives(out.meshes[i], mesh, plan, scene);
  }
  if (plan.mesh_count && scene.polygons == TW_POLYGONS_NGON) out.extensionsUsed.push_back("FB_ngon_encoding");
}

// An animated node must not have a matrix.
std::vector<bool> animated_nodes(const tw_scene &scene) {
  std::vector<bool> animated(scene.model->node_count, false);
  for (uint32_t i = 0; i < scene.clip_count; i++)
    for (uint32_t j = 0; j < scene.clips[i].track_count; j++) animated[scene.clips[i].tracks[j].node] = true;
  return animated;
}

void add_transform(tinygltf::Node &out, const tw_scene &scene, uint32_t index, bool animated) {
  const tw_node &node = scene.model->nodes[index];
  bool moved = animated || (scene.posed_by && tw_clip_moves(scene.posed_by, index));
  if (node.has_matrix && !moved) {
    out.matrix = numbers(node.matrix);
    return;
  }
  const tw_trs &local = scene.pose ? scene.pose[index] : node.rest;
  if (!is(local.translation, {0, 0, 0})) out.translation = numbers(local.translation);
  if (!is(local.rotation, {0, 0, 0, 1})) out.rotation = numbers(local.rotation);
  if (!is(local.scale, {1, 1, 1})) out.scale = numbers(local.scale);
}

void add_mesh(tinygltf::Node &out, const tw_gltf_plan &plan, const tw_scene &scene, uint32_t index) {
  const uint32_t source = scene.model->nodes[index].mesh;
  const uint32_t number = source == TW_NO_INDEX ? TW_NO_INDEX : plan.mesh_numbers[source];
  if (number == TW_NO_INDEX) return;
  out.mesh = static_cast<int>(number);
  const float *weights = scene.weights ? scene.weights[index] : nullptr;
  if (weights) out.weights.assign(weights, weights + plan.meshes[number].target_count);
}

void add_nodes(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_scene &scene) {
  const tw_model &model = *scene.model;
  const std::vector<bool> animated = animated_nodes(scene);
  tinygltf::Scene root;
  out.nodes.resize(model.node_count);
  for (uint32_t i = 0; i < model.node_count; i++) {
    const tw_node &node = model.nodes[i];
    tinygltf::Node &written = out.nodes[i];
    written.name = text_or_empty(node.name);
    add_mesh(written, plan, scene, i);
    if (tw_gltf_node_is_skinned(&scene, &node)) written.skin = static_cast<int>(plan.skin_numbers[node.skin]);
    add_transform(written, scene, i, animated[i]);
    if (node.parent == TW_NO_INDEX)
      root.nodes.push_back(static_cast<int>(i));
    else
      out.nodes[node.parent].children.push_back(static_cast<int>(i));
  }
  // tinygltf writes a node without any member as null.
  for (tinygltf::Node &node : out.nodes)
    if (node.name.empty() && node.mesh < 0 && node.children.empty() && node.matrix.empty() &&
        node.translation.empty() && node.rotation.empty() && node.scale.empty())
      node.translation.assign(3, 0);
  if (root.nodes.empty()) return;
  out.scenes.push_back(std::move(root));
  out.defaultScene = 0;
}

void add_skins(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_scene &scene) {
  for (uint32_t i = 0; i < scene.model->skin_count; i++) {
    if (plan.skin_numbers[i] == TW_NO_INDEX) continue;
    const tw_skin &skin = scene.model->skins[i];
    tinygltf::Skin written;
    written.name = text_or_empty(skin.name);
    written.joints.assign(skin.joints, skin.joints + skin.joint_count);
    written.inverseBindMatrices = static_cast<int>(plan.skin_matrices[i]);
    if (skin.skeleton != TW_NO_INDEX) written.skeleton = static_cast<int>(skin.skeleton);
    out.skins.push_back(std::move(written));
  }
}

void add_channel(tinygltf::Animation &out, const tw_gltf_channel &channel) {
  static const char *const paths[] = {"translation", "rotation", "scale", "weights"};
  static const char *const interpolations[] = {"STEP", "LINEAR", "CUBICSPLINE"};
  tinygltf::AnimationSampler sampler;
  sampler.input = static_cast<int>(channel.input);
  sampler.output = static_cast<int>(channel.output);
  sampler.interpolation = interpolations[channel.interpolation];
  tinygltf::AnimationChannel written;
  written.sampler = static_cast<int>(out.samplers.size());
  written.target_node = static_cast<int>(channel.node);
  written.target_path = paths[channel.path];
  out.samplers.push_back(std::move(sampler));
  out.channels.push_back(std::move(written));
}

void add_animations(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_scene &scene) {
  for (uint32_t i = 0; i < plan.animation_count; i++) {
    const tw_gltf_animation &planned = plan.animations[i];
    tinygltf::Animation animation;
    animation.name = text_or_empty(scene.clips[planned.clip].name);
    for (uint32_t j = 0; j < planned.channel_count; j++)
      add_channel(animation, plan.channels[planned.first_channel + j]);
    out.animations.push_back(std::move(animation));
  }
}

void add_images(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_gltf_assets &assets) {
  out.images.resize(assets.images.size());
  for (size_t i = 0; i < assets.images.size(); i++) {
    const tinygltf::Image &image = assets.images[i];
    tinygltf::Image &written = out.images[i];
    written.name = image.name;
    written.extensions = image.extensions;
    written.extras = image.extras;
    written.uri = image.uri;
    if (plan.image_views[i] == TW_NO_INDEX) continue;
    written.mimeType = image.mimeType;
    written.bufferView = static_cast<int>(plan.image_views[i]);
  }
}

void add_assets(tinygltf::Model &out, const tw_gltf_plan &plan, const tw_model &model) {
  if (!model.assets) { // the names that an OBJ gives
    out.materials.resize(model.material_count);
    for (uint32_t i = 0; i < model.material_count; i++)
      out.materials[i].name = text_or_empty(model.material_names[i]);
    return;
  }
  const tw_gltf_assets &assets = *model.assets;
  out.materials = assets.materials;
  out.textures = assets.textures;
  // tinygltf writes a texture without any member as null.
  for (tinygltf::Texture &texture : out.textures)
    if (texture.sampler < 0 && texture.source < 0 && texture.name.empty() && texture.extensions.empty() &&
        texture.extras.Type() == tinygltf::NULL_TYPE)
      texture.extras = tinygltf::Value(tinygltf::Value::Object());
  out.samplers = assets.samplers;
  add_images(out, plan, assets);
  for (const std::string &name : assets.extensions_used) out.extensionsUsed.push_back(name);
  for (const std::string &name : assets.extensions_required) out.extensionsRequired.push_back(name);
  out.asset.copyright = assets.copyright;
}

std::string write(const tw_gltf_plan &plan, const tw_scene &scene) {
  tinygltf::Model out;
  out.asset.generator = std::string("tweend ") + tw_version();
  add_views(out, plan);
  add_accessors(out, plan);
  add_meshes(out, plan, scene);
  add_nodes(out, plan, scene);
  add_skins(out, plan, scene);
  add_animations(out, plan, scene);
  add_assets(out, plan, *scene.model);
  tinygltf::TinyGLTF writer;
  writer.SetImageWriter(nullptr, nullptr); // the default one encodes pixels, and there are none
  std::ostringstream stream;
  writer.WriteGltfSceneToStream(&out, stream, false, false);
  return stream.str();
}

// Replaces the bounds that come later by fields of spaces. Accessors come first in tinygltf's output
// and hold no text, so the first `count` matches are theirs.
std::string widen_bounds(const std::string &narrow, size_t (*bounds)[6], size_t count) {
  static const char pattern[] = "\"max\":[null,null,null],\"min\":[null,null,null]";
  static const char *const openings[6] = {"\"max\":[", ",", ",", "],\"min\":[", ",", ","};
  std::string wide;
  size_t done = 0;
  for (size_t i = 0; i < count; i++) {
    size_t found = narrow.find(pattern, done);
    if (found == std::string::npos) throw std::logic_error("bounds not found");
    wide.append(narrow, done, found - done);
    for (size_t number = 0; number < 6; number++) {
      wide += openings[number];
      bounds[i][number] = wide.size();
      wide.append(TW_GLTF_BOUND_TEXT, ' ');
    }
    wide += ']';
    done = found + sizeof pattern - 1;
  }
  wide.append(narrow, done);
  return wide;
}

void fill(tw_gltf_json *json, const tw_gltf_plan &plan, const tw_scene &scene) {
  size_t later = 0;
  for (uint32_t i = 0; i < plan.accessor_count; i++)
    later += plan.accessors[i].bounds == TW_GLTF_BOUNDED_LATER;
  json->bounds = static_cast<size_t(*)[6]>(tw_alloc(later, sizeof *json->bounds));
  if (!json->bounds) throw std::bad_alloc();
  std::string text = widen_bounds(write(plan, scene), json->bounds, later);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  json->text = static_cast<char *>(tw_alloc(text.size(), 1));
  if (!json->text) throw std::bad_alloc();
  std::memcpy(json->text, text.data(), text.size());
  json->size = text.size();
}

} // namespace

tw_status tw_gltf_json_init(tw_gltf_json *json, const tw_gltf_plan *plan, const tw_scene *scene,
                            tw_error *error) {
  *json = {};
  try {
    fill(json, *plan, *scene);
    return TW_OK;
  } catch (const std::bad_alloc &) {
    tw_gltf_json_deinit(json);
    return tw_fail(error, TW_NO_MEMORY, "Out of memory.");
  } catch (...) {
    tw_gltf_json_deinit(json);
    return tw_fail(error, TW_INVALID, "The model's names or materials cannot be written as JSON.");
  }
}

void tw_gltf_json_deinit(tw_gltf_json *json) {
  std::free(json->text);
  std::free(json->bounds);
  *json = {};
}

uint32_t tw_gltf_image_count(const tw_gltf_assets *assets) {
  return assets ? static_cast<uint32_t>(assets->images.size()) : 0;
}

const uint8_t *tw_gltf_image_bytes(const tw_gltf_assets *assets, uint32_t image, size_t *size) {
  const tinygltf::Image &found = assets->images[image];
  *size = found.image.size();
  return found.image.data();
}
