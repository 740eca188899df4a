// The node hierarchy, the shown scene, skins, and animations.
#include "gltf/document.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "instances.h"

namespace gltf {

namespace {

uint32_t optional_index(int index, size_t count, const std::string &pointer) {
  if (index == -1) return TW_NO_INDEX;
  if (index < 0 || static_cast<size_t>(index) >= count)
    refuse(TW_INVALID, pointer, "index ", index, " is out of range: there ", tw_plural(count, "is", "are"),
           " ", count);
  return static_cast<uint32_t>(index);
}

uint32_t required_index(int index, size_t count, const std::string &pointer) {
  if (index == -1) refuse(TW_INVALID, pointer, "index -1 is out of range");
  return optional_index(index, count, pointer);
}

// Copies the numbers of a member, which has either none or `count`.
void copy_numbers(const std::vector<double> &numbers, size_t count, float *out, const std::string &pointer) {
  if (numbers.empty()) return;
  if (numbers.size() != count)
    refuse(TW_INVALID, pointer, "this needs ", count, " numbers and has ", numbers.size());
  for (size_t i = 0; i < count; i++) out[i] = static_cast<float>(numbers[i]);
}

// Keeps the exact translation of a node, which begins at `first` of its numbers, where floats round it.
void keep_place(Document &document, const std::vector<double> &numbers, size_t first, tw_node &node) {
  const double *exact = numbers.data() + first;
  auto is_rounded = [](double number) { return static_cast<double>(static_cast<float>(number)) != number; };
  if (numbers.empty() || std::none_of(exact, exact + 3, is_rounded)) return;
  double *place = allocate<double>(document, 3);
  std::copy(exact, exact + 3, place);
  node.place = place;
}

void read_node(Document &document, size_t index) {
  const tinygltf::Node &source = document.source.nodes[index];
  tw_node &node = document.model->nodes[index];
  std::string pointer = text("/nodes/", index);
  node.parent = TW_NO_INDEX;
  node.mesh = optional_index(source.mesh, document.source.meshes.size(), pointer + "/mesh");
  node.skin = optional_index(source.skin, document.source.skins.size(), pointer + "/skin");
  node.rest = tw_trs{{0, 0, 0, 1}, {0, 0, 0}, {1, 1, 1}};
  copy_numbers(source.translation, 3, node.rest.translation, pointer + "/translation");
  copy_numbers(source.rotation, 4, node.rest.rotation, pointer + "/rotation");
  copy_numbers(source.scale, 3, node.rest.scale, pointer + "/scale");
  copy_numbers(source.matrix, 16, node.matrix, pointer + "/matrix");
  node.has_matrix = !source.matrix.empty();
  if (node.has_matrix)
    keep_place(document, source.matrix, 12, node);
  else
    keep_place(document, source.translation, 0, node);
}

void read_children(Document &document, size_t index) {
  const std::vector<int> &children = document.source.nodes[index].children;
  for (size_t i = 0; i < children.size(); i++) {
    std::string pointer = text("/nodes/", index, "/children/", i);
    uint32_t child = required_index(children[i], document.source.nodes.size(), pointer);
    uint32_t &parent = document.model->nodes[child].parent;
    if (parent != TW_NO_INDEX) refuse(TW_INVALID, pointer, "node ", child, " has two parents");
    parent = static_cast<uint32_t>(index);
  }
}

// Keeps the order of children where it is another than that of their numbers.
void keep_child_order(Document &document) {
  const std::vector<tinygltf::Node> &nodes = document.source.nodes;
  Vector<tw_gltf_children> kept(document.budget);
  for (size_t i = 0; i < nodes.size(); i++) {
    const std::vector<int> &children = nodes[i].children;
    if (std::is_sorted(children.begin(), children.end())) continue;
    uint32_t *out = allocate<uint32_t>(document, children.size());
    std::transform(children.begin(), children.end(), out,
                   [](int child) { return static_cast<uint32_t>(child); });
    kept.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(children.size()), out});
  }
  tw_gltf_children *copies = allocate<tw_gltf_children>(document, kept.size());
  std::copy(kept.begin(), kept.end(), copies);
  document.assets->reordered = copies;
  document.assets->reordered_count = static_cast<uint32_t>(kept.size());
}

// Marks a node and all nodes below it. A node has at most one parent, so it is not reached from two roots of
// the hierarchy, and no root leads into a cycle.
void mark_below(const tinygltf::Model &source, uint32_t root, std::vector<bool> &marked) {
  std::vector<uint32_t> waiting = {root};
  while (!waiting.empty()) {
    uint32_t node = waiting.back();
    waiting.pop_back();
    if (marked[node]) continue;
    marked[node] = true;
    for (int child : source.nodes[node].children) waiting.push_back(static_cast<uint32_t>(child));
  }
}

// Refuses cycles: their nodes are reached from no root.
void check_cycles(const Document &document) {
  const tw_model &model = *document.model;
  std::vector<bool> reached(model.node_count);
  for (uint32_t i = 0; i < model.node_count; i++)
    if (model.nodes[i].parent == TW_NO_INDEX) mark_below(document.source, i, reached);
  for (uint32_t i = 0; i < model.node_count; i++)
    if (!reached[i])
      refuse(TW_INVALID, text("/nodes/", i, "/children"), "node ", i, " is in a cycle of nodes");
}

const uint32_t *read_roots(Document &document, size_t index) {
  const std::vector<int> &nodes = document.source.scenes[index].nodes;
  uint32_t *roots = allocate<uint32_t>(document, nodes.size());
  for (size_t i = 0; i < nodes.size(); i++)
    roots[i] = required_index(nodes[i], document.model->node_count, text("/scenes/", index, "/nodes/", i));
  return roots;
}

const char *scene_name(Document &document, const tw_gltf_scene &scene) {
  const char *name = tw_json_member(scene.preserved, "name");
  return name && *name == '"' ? copy_name(document, unescape(string_of(name))) : nullptr;
}

// Whether KHR_node_visibility hides a node, and with it all below.
bool is_invisible(const tw_node &node) {
  const char *extensions = tw_json_member(node.preserved, "extensions");
  const char *visible = tw_json_member(tw_json_member(extensions, "KHR_node_visibility"), "visible");
  return visible && *visible == 'f';
}

void hide_invisible(Document &document) {
  tw_model &model = *document.model;
  std::vector<bool> hidden(model.node_count);
  for (uint32_t i = 0; i < model.node_count; i++)
    if (is_invisible(model.nodes[i])) mark_below(document.source, i, hidden);
  for (uint32_t i = 0; i < model.node_count; i++)
    if (hidden[i]) model.nodes[i].is_hidden = true;
}

void read_scenes(Document &document) {
  const tinygltf::Model &source = document.source;
  tw_model &model = *document.model;
  tw_gltf_assets &assets = *document.assets;
  assets.node_count = model.node_count;
  assets.scene = source.defaultScene < 0 ? TW_NO_INDEX : static_cast<uint32_t>(source.defaultScene);
  if (source.scenes.empty()) return;
  if (source.defaultScene < -1 ||
      (source.defaultScene >= 0 && static_cast<size_t>(source.defaultScene) >= source.scenes.size()))
    refuse(TW_INVALID, "/scene", "there is no scene ", source.defaultScene);
  size_t shown = source.defaultScene < 0 ? 0 : static_cast<size_t>(source.defaultScene);
  for (size_t i = 0; i < source.scenes.size(); i++) {
    assets.scenes[i].nodes = read_roots(document, i);
    assets.scenes[i].node_count = static_cast<uint32_t>(source.scenes[i].nodes.size());
  }
  const tw_gltf_scene &scene = assets.scenes[shown];
  std::vector<bool> inside(model.node_count);
  for (uint32_t i = 0; i < scene.node_count; i++) mark_below(source, scene.nodes[i], inside);
  for (uint32_t i = 0; i < model.node_count; i++) model.nodes[i].is_hidden = !inside[i];
  model.name = scene_name(document, scene);
}

// Reads the morph weights that a node has in place of its mesh's.
void read_weights(Document &document) {
  size_t unfit = 0;
  for (uint32_t i = 0; i < document.model->node_count; i++) {
    const std::vector<double> &weights = document.source.nodes[i].weights;
    tw_node &node = document.model->nodes[i];
    if (weights.empty()) continue;
    if (node.mesh == TW_NO_INDEX || document.model->meshes[node.mesh].morph_count != weights.size()) {
      unfit++;
      continue;
    }
    float *out = allocate<float>(document, weights.size());
    copy_numbers(weights, weights.size(), out, text("/nodes/", i, "/weights"));
    for (size_t k = 0; k < weights.size(); k++)
      if (!std::isfinite(out[k]))
        refuse(TW_INVALID, text("/nodes/", i, "/weights"), "a weight is not finite");
    node.weights = out;
  }
  if (unfit > 0)
    tw_model_warn(
        document.model, "morph weights of %zu %s other targets", unfit,
        tw_plural(unfit, "node are left out: its mesh has", "nodes are left out: their meshes have"));
}

const float *identity_matrices(Document &document, size_t count) {
  float *matrices = allocate_zero<float>(document, count * 16);
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 16; k += 5) matrices[16 * i + k] = 1;
  return matrices;
}

const float *read_inverse_binds(Document &document, Accessors &accessors, int accessor, size_t count,
                                const std::string &pointer) {
  if (accessor == -1) return identity_matrices(document, count);
  const Elements &elements = accessors.open(accessor, TINYGLTF_TYPE_MAT4, pointer);
  if (elements.count() > count)
    document.outline.lose("inverse bind matrix is left out: its skin has fewer joints",
                          "inverse bind matrices are left out: their skins have fewer joints",
                          elements.count() - count);
  if (elements.component_type() != TINYGLTF_COMPONENT_TYPE_FLOAT)
    refuse(TW_INVALID, text("/accessors/", accessor, "/componentType"), "inverse bind matrices are floats");
  if (elements.count() < count)
    refuse(TW_INVALID, text("/accessors/", accessor, "/count"), "the skin has ", count, " joints and only ",
           elements.count(), " inverse bind matrices");
  float *matrices = allocate<float>(document, count * 16);
  constexpr float rounding = 1e-5f;
  size_t projective = 0;
  for (size_t i = 0; i < count; i++) {
    float *matrix = matrices + 16 * i;
    elements.read(static_cast<uint32_t>(i), matrix);
    const float rest[] = {matrix[3], matrix[7], matrix[11], matrix[15] - 1};
    projective += std::any_of(std::begin(rest), std::end(rest),
                              [](float value) { return std::fabs(value) > rounding; });
  }
  if (projective > 0)
    document.outline.lose("inverse bind matrix is no affine transform: its last row is not 0 0 0 1",
                          "inverse bind matrices are no affine transforms: their last rows are not 0 0 0 1",
                          projective);
  return matrices;
}

// ---- animations. A sampler that several channels name is read once.

struct Keys {
  uint32_t count;
  const float *times;
};

// Reads the clips one after the other. They share the keys of an accessor.
class ClipReader {
public:
  ClipReader(Document &document, Accessors &accessors) : document_(document), accessors_(accessors) {}

  void read(size_t index) {
    const tinygltf::Animation &source = document_.source.animations[index];
    document_.budget.place = text("/animations/", index);
    const Vector<PointedChannel> &pointed = document_.pointed_channels[index];
    const size_t own = source.channels.size(), count = own + pointed.size();
    std::vector<TrackPlace> &places = document_.track_places[index];
    tw_track_keys *tracks = allocate_zero<tw_track_keys>(document_, count);
    size_t kept = 0;
    for (size_t i = 0; i < own; i++) {
      if (lacks_targets(source.channels[i])) continue;
      places[kept] = places[i];
      read_channel(source, text("/animations/", index), i, places[kept], tracks[kept]);
      tracks[kept++].preserved = document_.channel_texts[index][i];
    }
    document_.outline.lose("channel of morph weights is left out: its node shows no morph targets",
                           "channels of morph weights are left out: their nodes show no morph targets",
                           own - kept);
    for (size_t i = 0; i < pointed.size(); i++) {
      places[kept] = places[own + i];
      read_pointed(source, text("/animations/", index), pointed[i], tracks[kept++]);
    }
    places.resize(kept);
    tw_clip_keys &clip = document_.model->clips[index];
    clip.track_count = static_cast<uint32_t>(kept);
    clip.tracks = tracks;
  }

private:
  Document &document_;
  Accessors &accessors_;
  std::map<int, Keys> times_;           // by accessor
  std::map<int, const float *> values_; // by accessor

  // Whether a channel moves morph weights that are nowhere. Exporters leave such behind where they leave the
  // targets or the mesh out.
  bool lacks_targets(const tinygltf::AnimationChannel &channel) const {
    const std::vector<tinygltf::Node> &nodes = document_.source.nodes;
    if (channel.target_path != tw_path_names[TW_WEIGHTS] || channel.target_node < 0 ||
        static_cast<size_t>(channel.target_node) >= nodes.size())
      return false;
    int mesh = nodes[static_cast<size_t>(channel.target_node)].mesh;
    return mesh < 0 || document_.model->meshes[mesh].morph_count == 0;
  }

  static tw_interpolation find_interpolation(const std::string &name, const std::string &pointer) {
    if (name == "LINEAR") return TW_LINEAR;
    if (name == "STEP") return TW_STEP;
    if (name == "CUBICSPLINE") return TW_CUBICSPLINE;
    refuse(TW_INVALID, pointer + "/interpolation", "an interpolation is LINEAR, STEP or CUBICSPLINE");
  }

  static tw_path find_path(const std::string &name, const std::string &pointer) {
    for (int path = TW_TRANSLATION; path <= TW_WEIGHTS; path++)
      if (name == tw_path_names[path]) return static_cast<tw_path>(path);
    refuse(TW_INVALID, pointer + "/target/path", "a path is translation, rotation, scale or weights");
  }

  void read_channel(const tinygltf::Animation &source, const std::string &animation, size_t index,
                    TrackPlace &place, tw_track_keys &track) {
    const tinygltf::AnimationChannel &channel = source.channels[index];
    std::string pointer = text(animation, "/channels/", place.channel);
    tw_path path = find_path(channel.target_path, pointer);
    if (channel.target_node < 0 || static_cast<uint32_t>(channel.target_node) >= document_.model->node_count)
      refuse(TW_INVALID, pointer + "/target/node", "there is no node ", channel.target_node);
    if (channel.sampler < 0 || static_cast<size_t>(channel.sampler) >= source.samplers.size())
      refuse(TW_INVALID, pointer + "/sampler", "there is no sampler ", channel.sampler);
    place.input = source.samplers[static_cast<size_t>(channel.sampler)].input;
    place.output = source.samplers[static_cast<size_t>(channel.sampler)].output;
    track.node = static_cast<uint32_t>(channel.target_node);
    read_keys(source, animation, path, channel.sampler, track);
  }

  void read_pointed(const tinygltf::Animation &source, const std::string &animation,
                    const PointedChannel &channel, tw_track_keys &track) {
    track.node = channel.node;
    track.preserved = channel.preserved;
    if (channel.weights.empty())
      read_keys(source, animation, channel.path, channel.sampler, track);
    else
      read_weights_apart(source, animation, channel, track);
  }

  // Reads samplers of one weight each into a track of all weights of a node.
  void read_weights_apart(const tinygltf::Animation &source, const std::string &animation,
                          const PointedChannel &channel, tw_track_keys &track) {
    const tinygltf::AnimationSampler &first = source.samplers[static_cast<size_t>(channel.sampler)];
    const std::string pointer = text(animation, "/samplers/", channel.sampler);
    track.path = TW_WEIGHTS;
    track.form = TW_KEY_VALUES;
    track.interpolation = find_interpolation(first.interpolation, pointer);
    const Keys &keys = read_times(first.input, pointer + "/input");
    track.key_count = keys.count;
    track.times = keys.times;
    track.width = morph_count(channel.node, pointer);
    // In-tangents, values and out-tangents of a key, or its values alone.
    const size_t parts = track.interpolation == TW_CUBICSPLINE ? 3 : 1, rows = parts * keys.count;
    document_.spend_values(uint64_t{rows} * track.width + keys.count, pointer,
                           "the keys that animations name");
    const tw_node &node = document_.model->nodes[channel.node];
    const float *rest = node.weights ? node.weights : document_.model->meshes[node.mesh].morph_weights;
    float *values = allocate_zero<float>(document_, rows * track.width);
    for (size_t row = parts / 2; rest && row < rows; row += parts)
      std::copy(rest, rest + track.width, values + row * track.width);
    for (const auto &[weight, sampler] : channel.weights) {
      if (weight >= track.width) refuse(TW_INVALID, pointer, "there is no morph target ", weight);
      int output = source.samplers[static_cast<size_t>(sampler)].output;
      const Elements &elements =
          accessors_.open(output, TINYGLTF_TYPE_SCALAR, text(animation, "/samplers/", sampler, "/output"));
      if (elements.count() != rows)
        refuse(TW_INVALID, text("/accessors/", output, "/count"), "the sampler's keys need ", rows,
               " values, and there are ", elements.count());
      document_.spend_values(elements.count(), pointer, "the keys that animations name");
      for (uint32_t row = 0; row < rows; row++) elements.read(row, values + row * track.width + weight);
    }
    track.values = values;
  }

  void read_keys(const tinygltf::Animation &source, const std::string &animation, tw_path path, int sampler,
                 tw_track_keys &track) {
    track.path = path;
    track.form = path == TW_ROTATION ? TW_KEY_QUATERNION : TW_KEY_VALUES;
    read_sampler(source.samplers[static_cast<size_t>(sampler)], text(animation, "/samplers/", sampler),
                 track);
  }

  void read_sampler(const tinygltf::AnimationSampler &sampler, const std::string &pointer,
                    tw_track_keys &track) {
    track.interpolation = find_interpolation(sampler.interpolation, pointer);
    const Keys &keys = read_times(sampler.input, pointer + "/input");
    track.key_count = keys.count;
    track.times = keys.times;
    int type = track.path == TW_WEIGHTS    ? TINYGLTF_TYPE_SCALAR
               : track.path == TW_ROTATION ? TINYGLTF_TYPE_VEC4
                                           : TINYGLTF_TYPE_VEC3;
    const Elements &elements = accessors_.open(sampler.output, type, pointer + "/output");
    uint64_t each = track.interpolation == TW_CUBICSPLINE ? 3 : 1;
    track.width = track.path == TW_WEIGHTS ? morph_count(track.node, pointer) : elements.width();
    uint64_t wanted = each * keys.count * (track.path == TW_WEIGHTS ? track.width : 1);
    if (elements.count() != wanted)
      refuse(TW_INVALID, text("/accessors/", sampler.output, "/count"), "the sampler's keys need ", wanted,
             " values, and there are ", elements.count());
    track.values = read_values(sampler.output, elements);
    // Counted for each track, because each makes its own copy when it is compiled.
    uint64_t size = elements.count() * uint64_t{elements.width()} + keys.count;
    document_.spend_values(size, pointer, "the keys that animations name");
  }

  uint32_t morph_count(uint32_t node, const std::string &pointer) const {
    int mesh = document_.source.nodes[node].mesh;
    uint32_t count = mesh < 0 ? 0 : document_.model->meshes[mesh].morph_count;
    if (count == 0) // of a pointer
      refuse(TW_INVALID, pointer + "/output", "weights need a node whose mesh has morph targets");
    return count;
  }

  const Keys &read_times(int accessor, const std::string &pointer) {
    auto found = times_.find(accessor);
    if (found != times_.end()) return found->second;
    const Elements &elements = accessors_.open(accessor, TINYGLTF_TYPE_SCALAR, pointer);
    std::string place = text("/accessors/", accessor);
    if (elements.component_type() != TINYGLTF_COMPONENT_TYPE_FLOAT)
      refuse(TW_INVALID, place + "/componentType", "key times are floats");
    spend(elements, place);
    float *times = allocate<float>(document_, elements.count());
    for (uint32_t i = 0; i < elements.count(); i++) {
      elements.read(i, times + i);
      if (times[i] < 0) refuse(TW_INVALID, place, "key time ", i, " is negative");
      if (i > 0 && !(times[i] >= times[i - 1]))
        refuse(TW_INVALID, place, "key time ", i, " is before the one before it");
    }
    return times_[accessor] = {elements.count(), times};
  }

  const float *read_values(int accessor, const Elements &elements) {
    auto found = values_.find(accessor);
    if (found != values_.end()) return found->second;
    spend(elements, text("/accessors/", accessor));
    float *values = allocate<float>(document_, size_t{elements.count()} * elements.width());
    for (uint32_t i = 0; i < elements.count(); i++) elements.read(i, values + size_t{i} * elements.width());
    return values_[accessor] = values;
  }

  // Counts the values of an accessor: accessors may lie over the same bytes.
  void spend(const Elements &elements, const std::string &pointer) {
    uint64_t size = uint64_t{elements.count()} * elements.width();
    document_.spend_values(size, pointer, "the keys of animations");
  }
};

} // namespace

void read_nodes(Document &document) {
  size_t count = document.source.nodes.size();
  document.budget.place = "/nodes";
  Hold hold(document.budget, 16 * count); // for the marks and the stack of mark_below
  for (size_t i = 0; i < count; i++) read_node(document, i);
  for (size_t i = 0; i < count; i++) read_children(document, i);
  check_cycles(document);
  keep_child_order(document);
  read_scenes(document);
  hide_invisible(document);
  read_weights(document);
  for (uint32_t i = 0; i < document.model->node_count; i++)
    if (!tw_instances_are_fit(document.model, i))
      document.outline.misfit(unfit_extension,
                              [&] { return text("/nodes/", i, "/extensions/EXT_mesh_gpu_instancing"); });
}

void read_skins(Document &document, Accessors &accessors) {
  const std::vector<tinygltf::Skin> &skins = document.source.skins;
  for (size_t i = 0; i < skins.size(); i++) {
    const tinygltf::Skin &source = skins[i];
    tw_skin &skin = document.model->skins[i];
    std::string pointer = text("/skins/", i);
    document.budget.place = pointer;
    size_t count = source.joints.size(), nodes = document.source.nodes.size();
    if (count == 0) refuse(TW_INVALID, pointer + "/joints", "a skin needs a joint");
    if (count > UINT16_MAX + size_t{1})
      refuse(TW_LIMIT, pointer + "/joints", "a skin has at most 65536 joints");
    uint32_t *joints = allocate<uint32_t>(document, count);
    for (size_t j = 0; j < count; j++)
      joints[j] = required_index(source.joints[j], nodes, text(pointer, "/joints/", j));
    skin.joint_count = static_cast<uint32_t>(count);
    skin.joints = joints;
    skin.inverse_bind = read_inverse_binds(document, accessors, source.inverseBindMatrices, count,
                                           pointer + "/inverseBindMatrices");
    skin.skeleton = optional_index(source.skeleton, nodes, pointer + "/skeleton");
  }
}

void read_clips(Document &document, Accessors &accessors) {
  ClipReader reader(document, accessors);
  for (uint32_t i = 0; i < document.model->clip_count; i++) reader.read(i);
}

} // namespace gltf
