// Materials, textures, samplers and images, kept as they came for an answer to bear again: their way into a
// model, their size, and what a material says of its normal map.
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

// The image in a data URI, or in a view; views may be shared.
Vector<uint8_t> image_bytes(Document &document, const ImageOutline &outline, tinygltf::Image &image) {
  Budget &budget = document.budget;
  if (outline.view == no_view) {
    size_t comma = outline.uri.find(',');
    std::string head = unescape(outline.uri.substr(0, comma));
    if (head.compare(0, 11, "data:image/") == 0) image.mimeType = head.substr(5, head.find(';') - 5);
    if (head.compare(0, 10, "data:text/") == 0) image.mimeType = "text/plain";
    return decode_base64(outline.uri.substr(comma + 1), budget);
  }
  image.mimeType = unescape(outline.mime_type);
  const tinygltf::BufferView &view = document.source.bufferViews.at(static_cast<size_t>(outline.view));
  const Bytes &bytes = document.outline.buffers.at(static_cast<size_t>(view.buffer));
  if (view.byteOffset > bytes.size || view.byteLength > bytes.size - view.byteOffset)
    refuse(TW_INVALID, text("/bufferViews/", outline.view), "the buffer view goes past its buffer");
  const uint8_t *start = bytes.data + view.byteOffset;
  return Vector<uint8_t>(start, start + view.byteLength, Counted<uint8_t>(budget));
}

// tinygltf saw images without bytes.
void take_images(Document &document) {
  for (const ImageOutline &outline : document.outline.images) {
    tinygltf::Image &image = document.source.images.at(static_cast<size_t>(outline.index));
    document.budget.place = text("/images/", outline.index);
    Vector<uint8_t> bytes = image_bytes(document, outline, image);
    if (bytes.empty()) refuse(TW_INVALID, text("/images/", outline.index, "/uri"), "the image has no bytes");
    document.budget.take(bytes.size());
    image.image.assign(bytes.begin(), bytes.end());
    if (image.mimeType.empty()) image.mimeType = image_type(image.image);
  }
  for (tinygltf::Image &image : document.source.images) image.as_is = true;
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

// ---- normal maps: glTF 2.0, textureInfo; KHR_texture_transform, whose texCoord goes before;
// KHR_materials_clearcoat

int member(const tinygltf::Value &object, const char *name, int absent) {
  if (!object.IsObject() || !object.Has(name)) return absent;
  const tinygltf::Value &value = object.Get(name);
  return value.IsInt() ? std::max(value.Get<int>(), 0) : absent;
}

// ---- bytes in memory beside the structs themselves

constexpr size_t map_node = 32 + 16; // what std::map and malloc add

size_t heap(const std::string &text) {
  return text.capacity() > 15 ? text.capacity() + 17 : 0;
}

size_t heap(const tinygltf::Value &value) {
  size_t size = 0;
  if (value.IsString()) return heap(value.Get<std::string>());
  if (value.IsArray()) {
    const tinygltf::Value::Array &array = value.Get<tinygltf::Value::Array>();
    size = array.capacity() * sizeof(tinygltf::Value) + 16;
    for (const tinygltf::Value &element : array) size += heap(element);
  }
  if (value.IsObject())
    for (const auto &member : value.Get<tinygltf::Value::Object>())
      size += map_node + sizeof member + heap(member.first) + heap(member.second);
  return size;
}

size_t heap(const tinygltf::ExtensionMap &extensions, const tinygltf::Value &extras) {
  size_t size = heap(extras);
  for (const auto &extension : extensions)
    size += map_node + sizeof extension + heap(extension.first) + heap(extension.second);
  return size;
}

size_t heap(const tinygltf::ParameterMap &parameters) {
  size_t size = 0;
  for (const auto &entry : parameters) {
    const tinygltf::Parameter &parameter = entry.second;
    size += map_node + sizeof entry + heap(entry.first) + heap(parameter.string_value) +
            parameter.number_array.capacity() * sizeof(double);
    for (const auto &number : parameter.json_double_value)
      size += map_node + sizeof number + heap(number.first);
  }
  return size;
}

template <typename Info> size_t heap_of_texture(const Info &info) {
  return heap(info.extensions, info.extras);
}

size_t heap(const tinygltf::Material &material) {
  const tinygltf::PbrMetallicRoughness &pbr = material.pbrMetallicRoughness;
  return heap(material.name) +
         (material.emissiveFactor.capacity() + pbr.baseColorFactor.capacity()) * sizeof(double) +
         heap(pbr.extensions, pbr.extras) + heap_of_texture(pbr.baseColorTexture) +
         heap_of_texture(pbr.metallicRoughnessTexture) + heap_of_texture(material.normalTexture) +
         heap_of_texture(material.occlusionTexture) + heap_of_texture(material.emissiveTexture) +
         heap(material.values) + heap(material.additionalValues) +
         heap(material.extensions, material.extras) + 64;
}

size_t size_of(const tw_gltf_assets &assets) {
  size_t size = sizeof assets + assets.materials.capacity() * sizeof(tinygltf::Material) +
                assets.textures.capacity() * sizeof(tinygltf::Texture) +
                assets.samplers.capacity() * sizeof(tinygltf::Sampler) +
                assets.images.capacity() * sizeof(tinygltf::Image);
  for (const tinygltf::Material &material : assets.materials) size += heap(material);
  for (const tinygltf::Texture &texture : assets.textures)
    size += heap(texture.name) + heap(texture.extensions, texture.extras);
  for (const tinygltf::Sampler &sampler : assets.samplers)
    size += heap(sampler.name) + heap(sampler.extensions, sampler.extras);
  for (const tinygltf::Image &image : assets.images)
    size +=
        image.image.capacity() + heap(image.uri) + heap(image.name) + heap(image.extensions, image.extras);
  return size;
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

void read_assets(Document &document) {
  tinygltf::Model &source = document.source;
  for (size_t i = 0; i < source.materials.size(); i++)
    check_material(source.materials[i], source.textures.size(), text("/materials/", i));
  for (size_t i = 0; i < source.textures.size(); i++)
    check_texture(source.textures[i], source, text("/textures/", i));
  take_images(document);
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
  assets->size = size_of(*assets);
  document.model->assets = assets.release();
}

} // namespace gltf

void tw_gltf_assets_destroy(tw_gltf_assets *assets) {
  delete assets;
}

size_t tw_gltf_assets_size(const tw_gltf_assets *assets) {
  return assets ? assets->size : 0;
}
