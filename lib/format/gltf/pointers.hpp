// Channels of animations that move nodes by KHR_animation_pointer ("/nodes/3/rotation", "/meshes/1/weights",
// "/nodes/3/weights/0"), which tinygltf does not see.
#ifndef TWEEND_GLTF_POINTERS_HPP
#define TWEEND_GLTF_POINTERS_HPP

#include <algorithm>
#include <charconv>
#include <map>

#include "gltf/document.hpp"

namespace gltf {

// A channel that moves the weights of a mesh.
struct MeshChannel {
  uint32_t mesh, index; // index: of the channel
  const char *text, *preserved;
};

// A channel that moves one weight of a node, or of the nodes that have the weights of a mesh.
struct WeightChannel {
  bool of_mesh;
  uint32_t part, weight; // part: the node or the mesh
  int sampler;
  uint32_t index; // of the channel
  const char *text, *preserved;
  bool is_taken;
};

class Pointers {
public:
  explicit Pointers(Document &document) : document_(document), pointed_(document.budget) {}

  // How many elements there are that pointers may lead to, besides nodes and meshes.
  void know(uint32_t materials, uint32_t cameras, uint32_t lights) {
    materials_ = materials;
    cameras_ = cameras;
    lights_ = lights;
  }

  // Begins an animation.
  void begin(const tinygltf::Animation &animation, uint32_t clip) {
    document_.budget.take(animation.channels.size() * 64); // nodes of the set
    animation_ = &animation;
    clip_ = clip;
    moved_.clear();
    for (const tinygltf::AnimationChannel &channel : animation.channels)
      for (int path = TW_TRANSLATION; path <= TW_WEIGHTS; path++)
        if (channel.target_path == tw_path_names[path])
          moved_.insert({static_cast<uint32_t>(channel.target_node), static_cast<tw_path>(path)});
  }

  // The node and path that a channel moves; none for other pointers. What another channel moves already stays
  // with it: a warning says so, and the pointer is preserved as those to other things are.
  std::optional<PointedChannel> to_node(const char *channel, const std::string &place) {
    const char *target = tw_json_member(channel, "target");
    const char *extension = tw_json_member(tw_json_member(target, "extensions"), "KHR_animation_pointer");
    const char *pointer = tw_json_member(extension, "pointer"), *path_text = tw_json_member(target, "path");
    int sampler = index_of(tw_json_member(channel, "sampler"));
    if (is_track(channel)) return {};
    if (!pointer || *pointer != '"') {
      if (extension || (path_text && value_text(path_text) == "\"pointer\"")) tell_unfit(place, "");
      return {};
    }
    if (sampler < 0 || static_cast<size_t>(sampler) >= animation_->samplers.size()) return {};
    std::string meant = unescape(string_of(pointer));
    if (!may_lead(meant)) tell_unfit(place, "/pointer");
    std::optional<std::pair<uint32_t, tw_path>> part = node_part(meant);
    if (!part) return {};
    auto [node, path] = *part;
    if (path == TW_WEIGHTS && !has_targets(node)) return {};
    if (!moved_.insert(*part).second) {
      tw_model_warn_of_clip(document_.model, clip_,
                            "%s: another channel moves %s of node %u already, so the pointer moves nothing",
                            place.c_str(), tw_path_names[path], node);
      return {};
    }
    return PointedChannel{node, path, sampler, place, nullptr};
  }

  // The mesh whose weights a channel moves by a pointer, if its sampler is there.
  std::optional<uint32_t> to_mesh(const char *channel) const {
    std::optional<std::string> meant = pointer_of(channel);
    if (!meant) return {};
    std::optional<PartPointer> to_mesh = read_pointer(*meant, "/meshes/", document_.source.meshes.size());
    if (!to_mesh || to_mesh->index == TW_NO_INDEX || to_mesh->member != "weights") return {};
    return to_mesh->index;
  }

  // The weight that a channel moves by a pointer, if its sampler is there: with the channel's index, text and
  // what is preserved of it for the caller to fill in.
  std::optional<WeightChannel> to_weight(const char *channel) const {
    std::optional<std::string> meant = pointer_of(channel);
    if (!meant) return {};
    std::optional<PartPointer> part = read_node_pointer(*meant);
    bool of_mesh = !part;
    if (of_mesh) part = read_pointer(*meant, "/meshes/", document_.source.meshes.size());
    if (!part || part->index == TW_NO_INDEX) return {};
    std::optional<PartPointer> weight = read_pointer(part->member, "weights/", TW_NO_INDEX);
    if (!weight || weight->index == TW_NO_INDEX || !weight->member.empty()) return {};
    int sampler = index_of(tw_json_member(channel, "sampler"));
    return WeightChannel{of_mesh, part->index, weight->index, sampler, 0, channel, nullptr, false};
  }

  // Takes a channel of to_node for the document.
  void take(PointedChannel channel, uint32_t index) {
    const tinygltf::AnimationSampler &keys = animation_->samplers[static_cast<size_t>(channel.sampler)];
    places_.push_back({index, keys.input, keys.output});
    pointed_.push_back(std::move(channel));
  }

  // Takes channels for the nodes that show the mesh and have no weights of their own, in the file or in the
  // animation. False where there is none, and where so many copies of the keys would be too many.
  bool take_nodes(const MeshChannel &channel, const std::string &place) {
    int sampler = index_of(tw_json_member(channel.text, "sampler"));
    const tinygltf::AnimationSampler &keys = animation_->samplers[static_cast<size_t>(sampler)];
    if (!has_followers_) find_followers();
    using Follower = std::pair<uint32_t, uint32_t>;
    auto from = std::lower_bound(followers_.begin(), followers_.end(), Follower(channel.mesh, 0));
    auto end = std::upper_bound(from, followers_.end(), Follower(channel.mesh, TW_NO_INDEX));
    if (!may_copy(keys, static_cast<uint64_t>(end - from))) return false;
    std::vector<uint32_t> shown;
    for (auto at = from; at != end; ++at)
      if (moved_.count({at->second, TW_WEIGHTS}) == 0) shown.push_back(at->second);
    work(static_cast<uint64_t>(end - from));
    if (shown.empty()) return false;
    document_.budget.take(shown.size() * 128); // places of channels, and nodes of the set
    for (uint32_t node : shown) {
      moved_.insert({node, TW_WEIGHTS});
      take({node, TW_WEIGHTS, sampler, place, channel.preserved}, channel.index);
    }
    return true;
  }

  // Takes channels of to_weight: those of a node as one track of all of its weights. Where their times or
  // interpolations differ no such track moves as they do, and they are not taken; nor where so many copies of
  // the keys would be too many. animation: its pointer.
  void take_weights(Vector<WeightChannel> &channels, const std::string &animation) {
    std::map<uint32_t, std::vector<WeightChannel *>> by_node;
    for (WeightChannel &channel : channels) {
      document_.budget.take(64);
      if (!channel.of_mesh) by_node[channel.part].push_back(&channel);
    }
    std::set<uint32_t> own;
    for (const auto &[node, of_node] : by_node) own.insert(node);
    for (WeightChannel &channel : channels) {
      if (!channel.of_mesh) continue;
      if (!has_followers_) find_followers();
      using Follower = std::pair<uint32_t, uint32_t>;
      auto from = std::lower_bound(followers_.begin(), followers_.end(), Follower(channel.part, 0));
      auto end = std::upper_bound(from, followers_.end(), Follower(channel.part, TW_NO_INDEX));
      const tinygltf::AnimationSampler &keys = animation_->samplers[static_cast<size_t>(channel.sampler)];
      if (!may_copy(keys, static_cast<uint64_t>(end - from))) continue;
      for (; from != end; ++from) {
        document_.budget.take(64);
        work(1);
        if (own.count(from->second) == 0) by_node[from->second].push_back(&channel);
      }
    }
    for (auto &[node, of_node] : by_node) {
      if (!are_joinable(node, of_node)) continue;
      const WeightChannel &first = *of_node.front();
      PointedChannel joined{node, TW_WEIGHTS, first.sampler, text(animation, "/channels/", first.index),
                            first.preserved};
      document_.budget.take(of_node.size() * 16 + 128);
      size_t lost = 0;
      for (WeightChannel *channel : of_node) {
        joined.weights.emplace_back(channel->weight, channel->sampler);
        lost += channel != of_node.front() && channel->preserved && !channel->is_taken;
        channel->is_taken = true;
      }
      document_.outline.lose(
          "channel of a morph weight is one with others of its node: its extras are left out",
          "channels of morph weights are one with others of their nodes: their extras are left out", lost);
      moved_.insert({node, TW_WEIGHTS});
      take(std::move(joined), first.index);
    }
  }

  // Ends the animation: notes where all of its tracks come from, those that tinygltf sees first. places: of
  // these.
  void end(std::vector<TrackPlace> &places) {
    places.insert(places.end(), places_.begin(), places_.end());
    places_.clear();
    document_.track_places.push_back(std::move(places));
    document_.pointed_channels.push_back(std::move(pointed_));
    pointed_ = Vector<PointedChannel>(document_.budget);
  }

private:
  // The pointer of a channel that tinygltf sees no track in, if its sampler is there.
  std::optional<std::string> pointer_of(const char *channel) const {
    const char *extension = tw_json_member(tw_json_member(tw_json_member(channel, "target"), "extensions"),
                                           "KHR_animation_pointer");
    const char *pointer = tw_json_member(extension, "pointer");
    int sampler = index_of(tw_json_member(channel, "sampler"));
    if (is_track(channel) || !pointer || *pointer != '"' || sampler < 0 ||
        static_cast<size_t>(sampler) >= animation_->samplers.size())
      return {};
    return unescape(string_of(pointer));
  }

  // "/nodes/3/rotation": node 3, and "rotation" of it.
  struct PartPointer {
    uint32_t index; // TW_NO_INDEX where there is no such part
    std::string_view member;
  };

  Document &document_;
  uint32_t materials_ = 0, cameras_ = 0, lights_ = 0;
  const tinygltf::Animation *animation_ = nullptr;
  uint32_t clip_ = 0;
  std::set<std::pair<uint32_t, tw_path>> moved_; // by channels of the animation
  Vector<PointedChannel> pointed_;               // of the animation
  std::vector<TrackPlace> places_;               // of these
  uint64_t copied_values_ = 0, copied_tracks_ = 0;
  bool has_followers_ = false;
  Vector<std::pair<uint32_t, uint32_t>> followers_{document_.budget}; // (mesh, node), ascending

  void tell_unfit(const std::string &place, const char *member) {
    document_.outline.misfit(unfit_extension,
                             [&] { return place + "/target/extensions/KHR_animation_pointer" + member; });
  }

  // Finds the nodes that have the weights of their mesh, by mesh.
  void find_followers() {
    const std::vector<tinygltf::Node> &nodes = document_.source.nodes;
    for (uint32_t i = 0; i < nodes.size(); i++)
      if (has_targets(i) && nodes[i].weights.empty())
        followers_.push_back({static_cast<uint32_t>(nodes[i].mesh), i});
    std::sort(followers_.begin(), followers_.end());
    has_followers_ = true;
  }

  // Whether so many tracks may have copies of a sampler's keys: they take at most half of the values that the
  // file may have, and half of the tracks.
  bool may_copy(const tinygltf::AnimationSampler &keys, uint64_t count) {
    uint64_t numbers = 0;
    for (int accessor : {keys.input, keys.output})
      if (accessor >= 0 && static_cast<size_t>(accessor) < document_.source.accessors.size())
        numbers += document_.source.accessors[static_cast<size_t>(accessor)].count;
    uint64_t left = document_.values_left / 2 - copied_values_;
    if (count == 0 || numbers > left / count || count > TW_TRACKS_MAX / 2 - copied_tracks_) return false;
    copied_values_ += numbers * count;
    copied_tracks_ += count;
    return true;
  }

  // Whether channels that move one weight each are as one channel of all weights of a node would be.
  bool are_joinable(uint32_t node, const std::vector<WeightChannel *> &channels) const {
    if (!has_targets(node) || moved_.count({node, TW_WEIGHTS}) > 0) return false;
    const tinygltf::Mesh &mesh =
        document_.source.meshes[static_cast<size_t>(document_.source.nodes[node].mesh)];
    auto keys_of = [&](const WeightChannel *channel) -> const tinygltf::AnimationSampler & {
      return animation_->samplers[static_cast<size_t>(channel->sampler)];
    };
    const tinygltf::AnimationSampler &first = keys_of(channels.front());
    std::set<uint32_t> weights;
    for (const WeightChannel *channel : channels) {
      const tinygltf::AnimationSampler &keys = keys_of(channel);
      bool is_alike = keys.input == first.input && keys.interpolation == first.interpolation;
      if (!is_alike || channel->weight >= mesh.primitives[0].targets.size() ||
          !weights.insert(channel->weight).second)
        return false;
    }
    return true;
  }

  bool has_targets(uint32_t node) const {
    int mesh = document_.source.nodes[node].mesh;
    if (mesh < 0 || static_cast<size_t>(mesh) >= document_.source.meshes.size()) return false;
    const std::vector<tinygltf::Primitive> &primitives =
        document_.source.meshes[static_cast<size_t>(mesh)].primitives;
    return !primitives.empty() && !primitives[0].targets.empty();
  }

  // Nothing for pointers to something else than `head`, of which there are `count`.
  static std::optional<PartPointer> read_pointer(std::string_view pointer, std::string_view head,
                                                 size_t count) {
    if (pointer.substr(0, head.size()) != head) return {};
    pointer.remove_prefix(head.size());
    std::string_view digits = pointer.substr(0, pointer.find('/'));
    pointer.remove_prefix(std::min(digits.size() + 1, pointer.size()));
    uint32_t index = 0;
    auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    bool is_there = error == std::errc() && end == digits.data() + digits.size() &&
                    (digits.size() == 1 || digits[0] != '0') && index < count;
    return PartPointer{is_there ? index : TW_NO_INDEX, pointer};
  }

  std::optional<PartPointer> read_node_pointer(std::string_view pointer) const {
    return read_pointer(pointer, "/nodes/", document_.source.nodes.size());
  }

  // Whether a pointer is one, and, where it leads to a part, to one that is there.
  bool may_lead(std::string_view pointer) const {
    const std::pair<std::string_view, size_t> arrays[] = {
        {"/nodes/", document_.source.nodes.size()},
        {"/meshes/", document_.source.meshes.size()},
        {"/materials/", materials_},
        {"/cameras/", cameras_},
        {"/extensions/KHR_lights_punctual/lights/", lights_}};
    for (const auto &[head, count] : arrays)
      if (std::optional<PartPointer> found = read_pointer(pointer, head, count))
        return found->index != TW_NO_INDEX;
    return !pointer.empty() && pointer[0] == '/';
  }

  // The node and path that a pointer leads to.
  std::optional<std::pair<uint32_t, tw_path>> node_part(std::string_view pointer) const {
    std::optional<PartPointer> to_node = read_node_pointer(pointer);
    if (!to_node || to_node->index == TW_NO_INDEX) return {};
    for (int path = TW_TRANSLATION; path <= TW_WEIGHTS; path++)
      if (to_node->member == tw_path_names[path]) return {{to_node->index, static_cast<tw_path>(path)}};
    return {};
  }
};

} // namespace gltf

#endif
