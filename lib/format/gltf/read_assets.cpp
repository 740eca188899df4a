// Materials, textures, samplers and images, kept as they came for an answer to bear again.
#include "gltf/assets.hpp"
#include "gltf/document.hpp"

#include <algorithm>
#include <climits>
#include <memory>
#include <set>

namespace gltf {

namespace {

void check_index(int index, size_t count, const std::string &pointer) {
  if (index < -1 || (index >= 0 && static_cast<size_t>(index) >= count))
    refuse(TW_INVALID, pointer, "index ", index, " is out of range: there are ", count);
}

// An index in an extension; one that is no integer is out of range.
int index_value(const tinygltf::Value &value) {
  return value.IsInt() ? value.Get<int>() : INT_MIN;
}

// Texture references in extensions: members named ...Texture that are objects with an index. Depth is
// bounded by the guards.
void check_texture_values(const tinygltf::Value &value, size_t textures, const std::string &pointer) {
  if (!value.IsObject()) return;
  for (const std::string &key : value.Keys()) {
    const tinygltf::Value &member = value.Get(key);
    if (!member.IsObject()) continue;
    std::string place = text(pointer, "/", pointer_part(key));
    bool reference = key.size() >= 7 && key.compare(key.size() - 7, 7, "Texture") == 0 && member.Has("index");
    if (reference) check_index(index_value(member.Get("index")), textures, place + "/index");
    check_texture_values(member, textures, place);
  }
}

void check_material(const tinygltf::Material &material, size_t textures, const std::string &pointer) {
  const tinygltf::PbrMetallicRoughness &pbr = material.pbrMetallicRoughness;
  check_index(pbr.baseColorTexture.index, textures, pointer + "/pbrMetallicRoughness/baseColorTexture/index");
  check_index(pbr.metallicRoughnessTexture.index, textures,
              pointer + "/pbrMetallicRoughness/metallicRoughnessTexture/index");
  check_index(material.normalTexture.index, textures, pointer + "/normalTexture/index");
  check_index(material.occlusionTexture.index, textures, pointer + "/occlusionTexture/index");
  check_index(material.emissiveTexture.index, textures, pointer + "/emissiveTexture/index");
  for (const auto &extension : material.extensions)
    check_texture_values(extension.second, textures,
                         text(pointer, "/extensions/", pointer_part(extension.first)));
}

void check_texture(const tinygltf::Texture &texture, const tinygltf::Model &source,
                   const std::string &pointer) {
  check_index(texture.sampler, source.samplers.size(), pointer + "/sampler");
  check_index(texture.source, source.images.size(), pointer + "/source");
  for (const auto &extension : texture.extensions)
    if (extension.second.IsObject() && extension.second.Has("source"))
      check_index(index_value(extension.second.Get("source")), source.images.size(),
                  text(pointer, "/extensions/", pointer_part(extension.first), "/source"));
}

// By the first bytes, for an image that does not say.
const char *image_type(const std::vector<unsigned char> &bytes) {
  static const unsigned char png[] = {0x89, 'P', 'N', 'G'}, jpeg[] = {0xFF, 0xD8, 0xFF};
  if (bytes.size() >= 4 && std::equal(png, png + 4, bytes.begin())) return "image/png";
  if (bytes.size() >= 3 && std::equal(jpeg, jpeg + 3, bytes.begin())) return "image/jpeg";
  return "";
}

// Images may share a view; all together they take at most some times the bytes of the file.
void take_image_bytes(tinygltf::Image &image, const tinygltf::Model &source, uint64_t &bytes_left) {
  if (image.bufferView >= 0) {
    const tinygltf::BufferView &view = source.bufferViews.at(static_cast<size_t>(image.bufferView));
    const std::vector<unsigned char> &bytes = source.buffers.at(static_cast<size_t>(view.buffer)).data;
    if (view.byteOffset > bytes.size() || view.byteLength > bytes.size() - view.byteOffset)
      refuse(TW_INVALID, text("/bufferViews/", image.bufferView), "the buffer view goes past its buffer");
    if (view.byteLength > bytes_left) refuse(TW_LIMIT, "/images", "the images share too many of their bytes");
    bytes_left -= view.byteLength;
    const unsigned char *start = bytes.data() + view.byteOffset;
    image.image.assign(start, start + view.byteLength);
    image.bufferView = -1;
  }
  image.as_is = true;
  if (image.mimeType.empty() && !image.image.empty()) image.mimeType = image_type(image.image);
}

using Names = std::set<std::string>;

void note(const tinygltf::ExtensionMap &extensions, Names &names) {
  for (const auto &extension : extensions) names.insert(extension.first);
}

// The extensions that the kept parts bear, which alone an answer has to declare.
Names used_extensions(const tw_gltf_assets &assets) {
  Names names;
  for (const tinygltf::Material &material : assets.materials) {
    note(material.extensions, names);
    note(material.pbrMetallicRoughness.extensions, names);
    note(material.pbrMetallicRoughness.baseColorTexture.extensions, names);
    note(material.pbrMetallicRoughness.metallicRoughnessTexture.extensions, names);
    note(material.normalTexture.extensions, names);
    note(material.occlusionTexture.extensions, names);
    note(material.emissiveTexture.extensions, names);
    // Textures inside an extension may bear this one.
    for (const auto &extension : material.extensions)
      if (extension.second.IsObject())
        for (const std::string &key : extension.second.Keys())
          if (extension.second.Get(key).IsObject() && extension.second.Get(key).Has("extensions"))
            for (const std::string &name : extension.second.Get(key).Get("extensions").Keys())
              names.insert(name);
  }
  for (const tinygltf::Texture &texture : assets.textures) note(texture.extensions, names);
  for (const tinygltf::Sampler &sampler : assets.samplers) note(sampler.extensions, names);
  for (const tinygltf::Image &image : assets.images) note(image.extensions, names);
  return names;
}

std::vector<std::string> among(const std::vector<std::string> &declared, const Names &names) {
  std::vector<std::string> kept;
  for (const std::string &name : declared)
    if (names.count(name)) kept.push_back(name);
  return kept;
}

void name_materials(Document &document) {
  tw_model *model = document.model;
  const std::vector<tinygltf::Material> &materials = document.source.materials;
  if (materials.empty()) return;
  model->material_names = allocate<const char *>(document, materials.size());
  for (size_t i = 0; i < materials.size(); i++)
    model->material_names[i] = copy_name(document, materials[i].name);
  model->material_count = static_cast<uint32_t>(materials.size());
}

} // namespace

void read_assets(Document &document) {
  tinygltf::Model &source = document.source;
  for (size_t i = 0; i < source.materials.size(); i++)
    check_material(source.materials[i], source.textures.size(), text("/materials/", i));
  for (size_t i = 0; i < source.textures.size(); i++)
    check_texture(source.textures[i], source, text("/textures/", i));
  uint64_t bytes_left = 0;
  for (const tinygltf::Buffer &buffer : source.buffers) bytes_left += 4 * buffer.data.size();
  for (tinygltf::Image &image : source.images) take_image_bytes(image, source, bytes_left);
  name_materials(document);

  auto assets = std::make_unique<tw_gltf_assets>();
  assets->materials = std::move(source.materials);
  assets->textures = std::move(source.textures);
  assets->samplers = std::move(source.samplers);
  assets->images = std::move(source.images);
  assets->copyright = source.asset.copyright;
  Names names = used_extensions(*assets);
  assets->extensions_used = among(source.extensionsUsed, names);
  assets->extensions_required = among(source.extensionsRequired, names);
  document.model->assets = assets.release();
}

} // namespace gltf
