// glTF 2.0, textureInfo; KHR_texture_transform, whose texCoord goes before; KHR_materials_clearcoat.
#include "gltf/normal_map.hpp"

#include <algorithm>

namespace gltf {

namespace {

int member(const tinygltf::Value &object, const char *name, int absent) {
  if (!object.IsObject() || !object.Has(name)) return absent;
  const tinygltf::Value &value = object.Get(name);
  return value.IsInt() ? std::max(value.Get<int>(), 0) : absent;
}

} // namespace

int normal_map_uvs(const tinygltf::Material &material) {
  const tinygltf::NormalTextureInfo &map = material.normalTexture;
  if (map.index >= 0) {
    auto transform = map.extensions.find("KHR_texture_transform");
    int set = std::max(map.texCoord, 0);
    return transform == map.extensions.end() ? set : member(transform->second, "texCoord", set);
  }
  auto coat = material.extensions.find("KHR_materials_clearcoat");
  if (coat == material.extensions.end() || !coat->second.Has("clearcoatNormalTexture")) return -1;
  const tinygltf::Value &texture = coat->second.Get("clearcoatNormalTexture");
  int set = member(texture, "texCoord", 0);
  if (!texture.IsObject() || !texture.Has("extensions")) return set;
  const tinygltf::Value &extensions = texture.Get("extensions");
  if (!extensions.IsObject() || !extensions.Has("KHR_texture_transform")) return set;
  return member(extensions.Get("KHR_texture_transform"), "texCoord", set);
}

} // namespace gltf
