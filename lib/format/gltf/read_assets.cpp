// Materials, textures and images: checks their references, copies the bytes of images, and reads on which
// texture coordinates normal maps lie. All else of them is kept as text (preserve.cpp).
#include "gltf/document.hpp"

#include <algorithm>

namespace gltf {

namespace {

// The way from an object of the document to a value inside it. Its text is made only for a refusal.
struct Way {
  const Way *parent;
  std::string_view member;
  std::string pointer() const {
    std::string above = parent ? parent->pointer() : "";
    return parent ? text(above, "/", pointer_part(std::string(member))) : std::string(member);
  }
};

// An index must be a whole number below count.
void check_index(const char *value, uint64_t count, const Way &way) {
  std::optional<uint64_t> index = whole_number(value);
  if (!index || *index >= count)
    refuse(TW_INVALID, way.pointer(), "index ", value_text(value).substr(0, 32), " is out of range: there ",
           tw_plural(count, "is", "are"), " ", count);
}

bool is_texture(std::string_view key) {
  return key.size() >= 7 && key.substr(key.size() - 7) == "Texture";
}

// Checks the texture references of a material and its extensions: members named ...Texture that are objects
// with an index. The recursion is bounded, as tw_json_check has checked the depth.
void check_textures(const char *object, uint64_t textures, const Way &way) {
  for (Items i(object); i.more(); i.next()) {
    if (*i.value() != '{' || i.key() == "extras") continue;
    const Way here = {&way, i.key()};
    const char *index = is_texture(i.key()) ? tw_json_member(i.value(), "index") : nullptr;
    if (index) check_index(index, textures, {&here, "index"});
    check_textures(i.value(), textures, here);
  }
}

// Checks a member that is an index, if the object has it.
void check_reference(const char *object, const char *member, uint64_t count, const Way &way) {
  if (const char *index = tw_json_member(object, member)) check_index(index, count, {&way, member});
}

void check_texture(const char *texture, const tw_gltf_assets &assets, const Way &way) {
  check_reference(texture, "sampler", assets.samplers.count, way);
  check_reference(texture, "source", assets.image_count, way);
  const char *extensions = tw_json_member(texture, "extensions");
  const Way inside = {&way, "extensions"};
  if (extensions && *extensions == '{')
    for (Items i(extensions); i.more(); i.next())
      check_reference(i.value(), "source", assets.image_count, {&inside, i.key()});
}

// ---- images

const char *copy_quoted(Document &document, std::string_view written) {
  if (written.empty()) return nullptr;
  char *quoted = allocate_zero<char>(document, written.size() + 3);
  quoted[0] = quoted[written.size() + 1] = '"';
  std::copy(written.begin(), written.end(), quoted + 1);
  return quoted;
}

// The media type in a data URI; "" if it is no image or text.
std::string uri_type(std::string_view uri) {
  std::string head = in_lower_case(unescape(uri.substr(0, uri.find(','))));
  if (head.compare(0, 11, "data:image/") == 0) return head.substr(5, head.find(';') - 5);
  return head.compare(0, 10, "data:text/") == 0 ? "text/plain" : "";
}

// Copies the bytes of an image from its data URI or its view; images may share a view.
void take_bytes(Document &document, const ImageOutline &outline, tw_gltf_image &image) {
  if (outline.view == no_view) {
    Vector<uint8_t> bytes = decode_base64(outline.uri.substr(outline.uri.find(',') + 1), document.budget);
    if (bytes.empty()) refuse(TW_INVALID, text("/images/", outline.index, "/uri"), "the image has no bytes");
    uint8_t *copy = allocate<uint8_t>(document, bytes.size());
    std::copy(bytes.begin(), bytes.end(), copy);
    image.bytes = copy;
    image.size = bytes.size();
    std::string type = uri_type(outline.uri);
    image.mime_type =
        tw_utf8_is_name(type.data(), type.size()) && type.find_first_of("\"\\") == std::string::npos
            ? copy_quoted(document, type)
            : nullptr;
    return;
  }
  const tinygltf::BufferView &view = document.source.bufferViews.at(static_cast<size_t>(outline.view));
  const Bytes &bytes = document.outline.buffers.at(static_cast<size_t>(view.buffer));
  if (view.byteOffset > bytes.size || view.byteLength > bytes.size - view.byteOffset)
    refuse(TW_INVALID, text("/bufferViews/", outline.view), "the buffer view goes past its buffer");
  uint8_t *copy = allocate<uint8_t>(document, view.byteLength);
  std::copy(bytes.data + view.byteOffset, bytes.data + view.byteOffset + view.byteLength, copy);
  image.bytes = copy;
  image.size = view.byteLength;
  image.mime_type = copy_quoted(document, outline.mime_type);
}

void take_images(Document &document) {
  tw_model_warn_count(document.model, document.outline.link_count,
                      "image is an address on the web, and not in the model",
                      "images are addresses on the web, and not in the model");
  for (const ImageOutline &outline : document.outline.images) {
    tw_gltf_image &image = document.assets->images[outline.index];
    document.budget.place = text("/images/", outline.index);
    take_bytes(document, outline, image);
    const char *shown = image.mime_type ? nullptr : image_type({image.bytes, image.size});
    if (shown) image.mime_type = copy_quoted(document, shown);
  }
}

// ---- materials

void name_materials(Document &document) {
  const tw_gltf_objects &materials = document.assets->materials;
  if (materials.count == 0) return;
  document.model->material_names = allocate_zero<const char *>(document, materials.count);
  for (uint32_t i = 0; i < materials.count; i++) {
    const char *name = tw_json_member(materials.items[i], "name");
    if (name && *name == '"')
      document.model->material_names[i] = copy_name(document, unescape(string_of(name)));
  }
  document.model->material_count = materials.count;
}

int set_of(const char *info, int absent) {
  int set = index_of(tw_json_member(info, "texCoord"));
  return set >= 0 && set < 256 ? set : absent;
}

const char *extension(const char *object, const char *name) {
  return tw_json_member(tw_json_member(object, "extensions"), name);
}

// The UV set that a material's normal map lies on, else that of its clear coat's; -1 without either (glTF
// 2.0, textureInfo; KHR_texture_transform, whose texCoord takes precedence; KHR_materials_clearcoat).
int normal_map_uvs(const char *material) {
  const char *map = tw_json_member(material, "normalTexture"),
             *coat = extension(material, "KHR_materials_clearcoat");
  if (!tw_json_member(map, "index")) map = tw_json_member(coat, "clearcoatNormalTexture");
  if (!map) return -1;
  return set_of(extension(map, "KHR_texture_transform"), set_of(map, 0));
}

} // namespace

void read_assets(Document &document) {
  const tw_gltf_assets &assets = *document.assets;
  for (uint32_t i = 0; i < assets.materials.count; i++) {
    std::string place = text("/materials/", i);
    check_textures(assets.materials.items[i], assets.textures.count, {nullptr, place});
    document.normal_maps.push_back(normal_map_uvs(assets.materials.items[i]));
  }
  for (uint32_t i = 0; i < assets.textures.count; i++) {
    std::string place = text("/textures/", i);
    check_texture(assets.textures.items[i], assets, {nullptr, place});
  }
  take_images(document);
  name_materials(document);
}

} // namespace gltf
