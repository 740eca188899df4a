// glTF has no groups of faces. Cutting primitives at them would cost a draw call each, so they are told
// as ranges of indices, the form in which three.js has them (BufferGeometry.addGroup).
#include "gltf/groups.hpp"

#include <cstring>

namespace gltf {

namespace {

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

} // namespace

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

} // namespace gltf
