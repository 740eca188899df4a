// Animations. A sampler that several channels name is read once.
#include "gltf/document.hpp"

#include <map>

namespace gltf {

namespace {

struct Keys {
  uint32_t count;
  const float *times;
};

// Reads the clips one after the other, with what they share.
class ClipReader {
public:
  ClipReader(Document &document, Accessors &accessors) : document_(document), accessors_(accessors) {}

  void read(size_t index) {
    const tinygltf::Animation &source = document_.source.animations[index];
    tw_track_keys *tracks = allocate<tw_track_keys>(document_, source.channels.size());
    uint32_t count = 0, skipped = 0;
    for (size_t i = 0; i < source.channels.size(); i++) {
      if (read_channel(source, text("/animations/", index), i, tracks[count]))
        count++;
      else
        skipped++;
    }
    if (skipped > 0)
      tw_model_warn(document_.model, "%u channels of clip %zu animate something else than nodes", skipped,
                    index);
    tw_clip_keys &clip = document_.model->clips[index];
    clip.name = copy_name(document_, source.name);
    clip.track_count = count;
    clip.tracks = tracks;
  }

private:
  Document &document_;
  Accessors &accessors_;
  std::map<int, Keys> times_;           // by accessor
  std::map<int, const float *> values_; // by accessor

  static bool find_path(const std::string &name, tw_path &path) {
    static const std::map<std::string, tw_path> paths = {{"translation", TW_TRANSLATION},
                                                         {"rotation", TW_ROTATION},
                                                         {"scale", TW_SCALE},
                                                         {"weights", TW_WEIGHTS}};
    auto found = paths.find(name);
    if (found == paths.end()) return false;
    path = found->second;
    return true;
  }

  static tw_interpolation find_interpolation(const std::string &name, const std::string &pointer) {
    if (name == "LINEAR") return TW_LINEAR;
    if (name == "STEP") return TW_STEP;
    if (name == "CUBICSPLINE") return TW_CUBICSPLINE;
    refuse(TW_INVALID, pointer + "/interpolation", "an interpolation is LINEAR, STEP or CUBICSPLINE");
  }

  // False for a channel without a node or of an unknown path.
  bool read_channel(const tinygltf::Animation &source, const std::string &animation, size_t index,
                    tw_track_keys &track) {
    const tinygltf::AnimationChannel &channel = source.channels[index];
    std::string pointer = text(animation, "/channels/", index);
    tw_path path;
    if (channel.target_node == -1 || !find_path(channel.target_path, path)) return false;
    if (channel.target_node < 0 || static_cast<uint32_t>(channel.target_node) >= document_.model->node_count)
      refuse(TW_INVALID, pointer + "/target/node", "there is no node ", channel.target_node);
    if (channel.sampler < 0 || static_cast<size_t>(channel.sampler) >= source.samplers.size())
      refuse(TW_INVALID, pointer + "/sampler", "there is no sampler ", channel.sampler);
    track.node = static_cast<uint32_t>(channel.target_node);
    track.path = path;
    track.form = path == TW_ROTATION ? TW_KEY_QUATERNION : TW_KEY_VALUES;
    read_sampler(source.samplers[static_cast<size_t>(channel.sampler)],
                 text(animation, "/samplers/", channel.sampler), track);
    return true;
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
    // Each track makes its own copy when it is compiled.
    uint64_t size = elements.count() * uint64_t{elements.width()} + keys.count;
    if (size > document_.values_left)
      refuse(TW_LIMIT, pointer, "the animations name their keys too many times");
    document_.values_left -= size;
  }

  uint32_t morph_count(uint32_t node, const std::string &pointer) const {
    int mesh = document_.source.nodes[node].mesh;
    uint32_t count = mesh < 0 ? 0 : document_.model->meshes[mesh].morph_count;
    if (count == 0)
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
      if (i > 0 && !(times[i] > times[i - 1])) refuse(TW_INVALID, place, "key time ", i, " does not ascend");
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

  // Accessors may lie over the same bytes.
  void spend(const Elements &elements, const std::string &pointer) {
    uint64_t size = uint64_t{elements.count()} * elements.width();
    if (size > document_.values_left) refuse(TW_LIMIT, pointer, "the animations have too many keys");
    document_.values_left -= size;
  }
};

} // namespace

void read_clips(Document &document, Accessors &accessors) {
  size_t count = document.source.animations.size();
  document.model->clips = allocate<tw_clip_keys>(document, count);
  document.model->clip_count = static_cast<uint32_t>(count);
  ClipReader reader(document, accessors);
  for (size_t i = 0; i < count; i++) reader.read(i);
}

} // namespace gltf
