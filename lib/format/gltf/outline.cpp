// What is checked before tinygltf sees a byte, and the document that it then sees: the chunks of a GLB file
// (glTF 2.0, section 4.4), the JSON text, and a copy of it without buffers, images and all that is not read.
#include "gltf/document.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "meshopt_read.h"

namespace gltf {

namespace {

// ---- containers ------------------------------------------------------------------------------------

constexpr uint32_t chunk_json = 0x4E4F534A, chunk_bin = 0x004E4942;
constexpr size_t header_size = 12, chunk_header_size = 8;

// tinygltf takes sizes as unsigned int.
constexpr uint64_t size_max = INT32_MAX;

// A file taken apart; a view of its bytes.
struct Container {
  bool binary;
  std::string_view json;
  Bytes bin; // size 0: there is no BIN chunk
};

uint32_t read_u32(const uint8_t *at) {
  return static_cast<uint32_t>(at[0]) | static_cast<uint32_t>(at[1]) << 8 |
         static_cast<uint32_t>(at[2]) << 16 | static_cast<uint32_t>(at[3]) << 24;
}

[[noreturn]] void refuse_container(const std::string &detail) {
  refuse(TW_SYNTAX, "", detail);
}

struct Chunk {
  uint32_t type;
  const uint8_t *data;
  uint64_t size, end; // end: offset in the file
};

Chunk read_chunk(const uint8_t *bytes, uint64_t length, uint64_t offset) {
  if (length - offset < chunk_header_size) refuse_container("the GLB ends inside a chunk header");
  Chunk chunk = {read_u32(bytes + offset + 4), bytes + offset + chunk_header_size, read_u32(bytes + offset),
                 0};
  if (chunk.size > length - offset - chunk_header_size)
    refuse_container(text("a GLB chunk of ", chunk.size, " bytes goes past the end of the file"));
  if (chunk.size % 4 != 0) refuse_container("the length of a GLB chunk is not a multiple of 4");
  chunk.end = offset + chunk_header_size + chunk.size;
  return chunk;
}

Container open_binary(const Bytes &file) {
  if (file.size < header_size + chunk_header_size) refuse_container("the GLB is too short for its headers");
  uint32_t version = read_u32(file.data + 4), length = read_u32(file.data + 8);
  if (version != 2) refuse(TW_UNSUPPORTED, "", "GLB version ", version, ": only version 2 can be read");
  if (length != file.size)
    refuse_container(text("the GLB says that it has ", length, " bytes, and has ", file.size));
  Chunk json = read_chunk(file.data, length, header_size);
  if (json.type != chunk_json) refuse_container("the first GLB chunk is not JSON");
  Container container = {true, {reinterpret_cast<const char *>(json.data), json.size}, {nullptr, 0}};
  if (json.end == length) return container;
  Chunk bin = read_chunk(file.data, length, json.end);
  if (bin.type != chunk_bin) refuse_container("the second GLB chunk is not BIN");
  container.bin = {bin.data, bin.size};
  // Chunks of other types may follow; a reader ignores them, but they too must fit.
  for (uint64_t at = bin.end; at < length;) at = read_chunk(file.data, length, at).end;
  return container;
}

Container open_container(const Bytes &file) {
  if (file.size > size_max) refuse(TW_LIMIT, "", "glTF files over 2 GiB are not read");
  if (file.size >= 4 && std::memcmp(file.data, "glTF", 4) == 0) return open_binary(file);
  return {false, {reinterpret_cast<const char *>(file.data), file.size}, {nullptr, 0}};
}

// Where an object stands: an element of one of the root's arrays, or the root itself. Text is made of
// it only for a refusal.
struct Place {
  const char *array; // "" for the root
  uint64_t index;
  std::string pointer(std::string_view member) const {
    return *array ? text("/", array, "/", index, member.empty() ? "" : "/", member) : text("/", member);
  }
};

// A member that the checks rely on may stand only once, spelt without escapes: the parser must not
// see another one than we do.
class Once {
public:
  explicit Once(Place place) : place_(place) {}
  bool is(std::string_view key, std::string_view name) {
    if (key != name) return false;
    for (std::string_view seen : seen_)
      if (seen == name) refuse(TW_SYNTAX, place_.pointer(name), "the member stands twice");
    seen_.push_back(name);
    return true;
  }
  void check(std::string_view key) const {
    if (is_escaped(key))
      refuse(TW_UNSUPPORTED, place_.pointer(""), "a member's name is written with an escape");
  }

private:
  Place place_;
  std::vector<std::string_view> seen_;
};

// ---- the checks ----------------------------------------------------------------------------------------

constexpr uint64_t integer_max = uint64_t{1} << 53;

uint64_t integer(const char *value, Place place, const char *member) {
  const char *end = tw_json_skip(value);
  uint64_t number = 0;
  for (const char *c = value; c < end; c++) {
    if (*c < '0' || *c > '9' || number > integer_max / 10)
      refuse(TW_INVALID, place.pointer(member), "this must be a whole number, 0 or more");
    number = number * 10 + static_cast<uint64_t>(*c - '0');
  }
  return number;
}

// Extensions that a document may require: their meaning is read, or they only speak of what is handed on.
bool is_supported(std::string_view extension) {
  static constexpr std::string_view names[] = {
      "KHR_mesh_quantization", "FB_ngon_encoding",        "KHR_texture_transform",
      "KHR_texture_basisu",    "EXT_texture_webp",        "EXT_texture_avif",
      "MSFT_texture_dds",      "KHR_lights_punctual",     "EXT_mesh_gpu_instancing",
      "KHR_animation_pointer", "EXT_meshopt_compression", "KHR_meshopt_compression"};
  if (extension.substr(0, 14) == "KHR_materials_") return true;
  return std::find(std::begin(names), std::end(names), extension) != std::end(names);
}

// The length of a data URI's head that tinygltf would read by itself, 0 for any other: with anything else it
// looks for a file.
size_t data_head(std::string_view uri) {
  std::string head;
  for (size_t i = 0; i < uri.size() && head.size() < 64; i++) {
    if (uri[i] == '\\' && i + 1 < uri.size() && uri[i + 1] == '/') continue;
    head += uri[i];
    if (uri[i] == ',') return tinygltf::IsDataURI(head) ? i + 1 : 0;
  }
  return 0;
}

// One walk over the document; remembers what the checks need of one part for another.
class Checker {
public:
  Checker(const Container &container, Budget &budget, Outline &out)
      : container_(container), budget_(budget), out_(out), buffers_(Counted<Buffer>(budget)),
        views_(Counted<View>(budget)), accessor_views_(Counted<uint64_t>(budget)),
        indices_(Counted<Indices>(budget)) {}

  void run(const char *root) {
    if (*root != '{') refuse(TW_SYNTAX, "", "a glTF document is a JSON object");
    Once once({"", 0});
    for (Items i(root); i.more(); i.next()) {
      once.check(i.key());
      for (const Part &part : parts)
        if (once.is(i.key(), part.name)) elements(part, i.value());
    }
    check_outline();
  }

private:
  struct Buffer {
    uint64_t length = 0;
    std::optional<std::string_view> uri;
    bool is_fallback = false; // of EXT_meshopt_compression
  };
  struct View {
    uint64_t buffer = 0, offset = 0, length = 0;
    const char *compressed = nullptr; // the extension's object
  };
  struct Indices {
    uint64_t mesh, primitive, accessor;
  };
  struct Part {
    std::string_view name;
    uint64_t most; // 0: any number
    void (Checker::*element)(uint64_t index, const char *value);
  };
  static const Part parts[14];

  const Container &container_;
  Budget &budget_;
  Outline &out_;
  Vector<Buffer> buffers_;
  Vector<View> views_;
  Vector<uint64_t> accessor_views_; // no_view for one without
  Vector<Indices> indices_;
  std::string_view unsupported_; // the first required extension that is
  uint64_t unsupported_index_ = 0, tracks_ = 0;

  void elements(const Part &part, const char *array) {
    if (*array != '[')
      refuse(TW_INVALID, text("/", part.name),
             "this must be an array, as it is from glTF 2.0 on: glTF 1 is not read");
    uint64_t count = part.most ? tw_json_count(array) : 0, index = 0;
    if (count > part.most)
      refuse(TW_LIMIT, text("/", part.name), "there are ", count, ", and at most ", part.most, " are read");
    for (Items i(array); i.more() && part.element; i.next()) (this->*part.element)(index++, i.value());
  }

  // Calls member(key, value, once) for each member of an element that must be an object.
  template <typename Member> static void object(Place place, const char *value, Member member) {
    if (*value != '{') refuse(TW_INVALID, place.pointer(""), "this must be an object");
    Once once(place);
    for (Items i(value); i.more(); i.next()) {
      once.check(i.key());
      member(i.key(), i.value(), once);
    }
  }

  void buffer(uint64_t index, const char *value) {
    Place place = {"buffers", index};
    Buffer buffer;
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "byteLength")) buffer.length = integer(member, place, "byteLength");
      if (once.is(key, "extensions")) buffer.is_fallback = says_fallback(compression_of(member));
      if (!once.is(key, "uri")) return;
      if (*member != '"') refuse(TW_INVALID, place.pointer("uri"), "a uri must be a string");
      buffer.uri = string_of(member);
    });
    buffers_.push_back(buffer);
  }

  static bool says_fallback(const char *extension) {
    const char *value = tw_json_member(extension, "fallback");
    return value && *value == 't';
  }

  void view(uint64_t index, const char *value) {
    Place place = {"bufferViews", index};
    View view;
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "buffer")) view.buffer = integer(member, place, "buffer");
      if (once.is(key, "byteOffset")) view.offset = integer(member, place, "byteOffset");
      if (once.is(key, "byteLength")) view.length = integer(member, place, "byteLength");
      if (once.is(key, "extensions")) view.compressed = compression_of(member);
    });
    views_.push_back(view);
  }

  static const char *compression_of(const char *extensions) {
    const char *ext = tw_json_member(extensions, "EXT_meshopt_compression");
    return ext ? ext : tw_json_member(extensions, "KHR_meshopt_compression");
  }

  // The place is the view's, also for members of the extension.
  void decode_view(size_t i) {
    Place place = {"bufferViews", i};
    View packed;
    tw_meshopt_view form = {0, 0, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE};
    object(place, views_[i].compressed, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "buffer")) packed.buffer = integer(member, place, "buffer");
      if (once.is(key, "byteOffset")) packed.offset = integer(member, place, "byteOffset");
      if (once.is(key, "byteLength")) packed.length = integer(member, place, "byteLength");
      if (once.is(key, "byteStride")) form.stride = integer(member, place, "byteStride");
      if (once.is(key, "count")) form.count = integer(member, place, "count");
      if (once.is(key, "mode"))
        form.mode = static_cast<tw_meshopt_mode>(word(member, "ATTRIBUTES TRIANGLES INDICES", place));
      if (once.is(key, "filter"))
        form.filter =
            static_cast<tw_meshopt_filter>(word(member, "NONE OCTAHEDRAL QUATERNION EXPONENTIAL", place));
    });
    tw_error error = {};
    if (packed.buffer >= buffers_.size())
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes are in no buffer");
    const Bytes bytes = out_.buffers[static_cast<size_t>(packed.buffer)];
    if (packed.offset > bytes.size || packed.length > bytes.size - packed.offset)
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes go past their buffer");
    if (tw_meshopt_check(&form, views_[i].length, &error) != TW_OK)
      refuse(TW_INVALID, place.pointer(""), error.detail);
    // 16 bytes of a column have a header of two bits, and an index takes a byte: no byte decodes to more
    // than 64.
    if (views_[i].length > 64 * packed.length)
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes are too few for what they say to hold");
    budget_.place = place.pointer("");
    Vector<uint8_t> decoded(static_cast<size_t>(views_[i].length), 0, Counted<uint8_t>(budget_));
    if (tw_meshopt_decode(&form, bytes.data + packed.offset, static_cast<size_t>(packed.length),
                          decoded.data(), &error) != TW_OK)
      refuse(TW_INVALID, place.pointer(""), error.detail);
    out_.decoded.push_back(std::move(decoded));
    out_.decoded_views.push_back({i, out_.buffers.size()});
    out_.buffers.push_back({out_.decoded.back().data(), out_.decoded.back().size()});
  }

  // Which of the words, a blank between two, a string is.
  static int word(const char *value, std::string_view words, Place place) {
    std::string_view wanted = *value == '"' ? string_of(value) : std::string_view();
    for (int i = 0; !words.empty(); i++) {
      std::string_view first = words.substr(0, words.find(' '));
      if (first == wanted) return i;
      words.remove_prefix(std::min(words.size(), first.size() + 1));
    }
    refuse(TW_UNSUPPORTED, place.pointer(""), "the mode or filter is unknown");
  }

  void accessor(uint64_t index, const char *value) {
    Place place = {"accessors", index};
    uint64_t view = no_view;
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "bufferView")) view = integer(member, place, "bufferView");
    });
    accessor_views_.push_back(view);
  }

  void mesh(uint64_t index, const char *value) {
    Place place = {"meshes", index};
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (!once.is(key, "primitives")) return;
      if (*member != '[') refuse(TW_INVALID, place.pointer("primitives"), "this must be an array");
      uint64_t i = 0;
      for (Items primitives(member); primitives.more(); primitives.next())
        primitive(place, i++, primitives.value());
    });
  }

  void primitive(Place place, uint64_t index, const char *value) {
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "indices") && *member != '-')
        indices_.push_back({place.index, index, integer(member, place, "primitives")});
    });
  }

  // The bytes of an image that are in the file are taken from where they stand.
  void image(uint64_t index, const char *value) {
    Place place = {"images", index};
    ImageOutline image = {index, no_view, {}, {}};
    bool has_uri = false;
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "bufferView")) image.view = integer(member, place, "bufferView");
      if (once.is(key, "mimeType") && *member == '"') image.mime_type = string_of(member);
      if (!once.is(key, "uri")) return;
      has_uri = true;
      if (*member == '"') image.uri = string_of(member);
    });
    if (image.view != no_view && has_uri)
      refuse(TW_INVALID, place.pointer(""), "an image has a bufferView or a uri, not both");
    if (image.view != no_view || data_head(image.uri) > 0)
      out_.images.push_back(image);
    else if (has_uri)
      link(image.uri, place);
  }

  // What is on the web stays there. A file beside the document is not ours to open: without it the model
  // would lose the image.
  void link(std::string_view uri, Place place) {
    std::string address = unescape(uri);
    if (address.compare(0, 5, "data:") == 0) return;
    if (address.compare(0, 7, "http://") != 0 && address.compare(0, 8, "https://") != 0)
      refuse_absent(address, place);
    out_.link_count++;
  }

  [[noreturn]] void refuse_absent(const std::string &name, Place place) {
    refuse(TW_UNSUPPORTED, place.pointer("uri"), "the file \"", name.substr(0, 100),
           "\" was not sent: send it along in one form, or put its bytes inside");
  }

  // check_outline reports it first: it may be the cause of the other faults.
  void required_extension(uint64_t index, const char *value) {
    if (*value != '"')
      refuse(TW_INVALID, text("/extensionsRequired/", index), "an extension is named by a string");
    if (!unsupported_.empty() || is_supported(string_of(value))) return;
    unsupported_ = string_of(value);
    unsupported_index_ = index;
  }

  void animation(uint64_t index, const char *value) {
    Place place = {"animations", index};
    object(place, value, [&](std::string_view key, const char *member, Once &once) {
      if (once.is(key, "channels") && *member == '[') tracks_ += tw_json_count(member);
      once.is(key, "samplers");
    });
    if (tracks_ > TW_TRACKS_MAX)
      refuse(TW_LIMIT, place.pointer("channels"), "with these there are ", tracks_, " channels, and at most ",
             int{TW_TRACKS_MAX}, " are read");
  }

  // ---- what the parts must agree on

  void check_outline() {
    if (!unsupported_.empty())
      refuse(TW_UNSUPPORTED, text("/extensionsRequired/", unsupported_index_),
             "the document requires the extension ", unsupported_, ", which is not supported",
             unsupported_ == "KHR_draco_mesh_compression"
                 ? ": `gltf-transform copy IN OUT` writes the file without it"
                 : "");
    for (size_t i = 0; i < buffers_.size(); i++) open_buffer(i);
    for (size_t i = 0; i < views_.size(); i++) check_view(i);
    for (size_t i = 0; i < views_.size(); i++)
      if (views_[i].compressed) decode_view(i);
    for (size_t i = 0; i < accessor_views_.size(); i++)
      if (accessor_views_[i] != no_view && accessor_views_[i] >= views_.size())
        refuse(TW_INVALID, text("/accessors/", i, "/bufferView"), "there is no such buffer view");
    for (const Indices &indices : indices_) check_indices(indices);
    for (const ImageOutline &image : out_.images)
      if (image.view != no_view && image.view >= views_.size())
        refuse(TW_INVALID, text("/images/", image.index, "/bufferView"), "there is no such buffer view");
  }

  void open_buffer(size_t i) {
    const Buffer &buffer = buffers_[i];
    Place place = {"buffers", i};
    if (buffer.length == 0)
      refuse(TW_INVALID, place.pointer("byteLength"), "a buffer needs at least one byte");
    if (!buffer.uri && buffer.is_fallback) { // what it would hold is compressed elsewhere
      out_.buffers.push_back({nullptr, 0});
      return;
    }
    Bytes bytes = buffer.uri ? decode(*buffer.uri, place) : take_bin(i, buffer.length, place);
    if (bytes.size != buffer.length)
      refuse(TW_INVALID, place.pointer("byteLength"),
             buffer.uri ? "the data URI holds " : "the BIN chunk has only ", bytes.size, " bytes");
    out_.buffers.push_back(bytes);
  }

  Bytes decode(std::string_view uri, Place place) {
    size_t head = data_head(uri);
    if (head == 0) {
      std::string name = unescape(uri);
      if (name.compare(0, 5, "data:") == 0)
        refuse(TW_UNSUPPORTED, place.pointer("uri"), "the data URI of a buffer must be base64");
      refuse_absent(name, place);
    }
    budget_.place = place.pointer("uri");
    std::string_view rest;
    out_.decoded.push_back(decode_base64(uri.substr(head), budget_, &rest));
    if (rest.find_first_not_of('=') != std::string_view::npos)
      refuse(TW_INVALID, place.pointer("uri"), "the data URI is not base64");
    return {out_.decoded.back().data(), out_.decoded.back().size()};
  }

  // The chunk may be padded.
  Bytes take_bin(uint64_t index, uint64_t length, Place place) const {
    if (!container_.binary) refuse(TW_INVALID, place.pointer(""), "a buffer of a JSON file needs a uri");
    if (index != 0) refuse(TW_INVALID, place.pointer(""), "only the first buffer may be the BIN chunk");
    return {container_.bin.data, static_cast<size_t>(std::min<uint64_t>(length, container_.bin.size))};
  }

  void check_indices(const Indices &indices) const {
    if (indices.accessor >= accessor_views_.size())
      refuse(TW_INVALID, text("/meshes/", indices.mesh, "/primitives/", indices.primitive, "/indices"),
             "there is no accessor ", indices.accessor);
    if (accessor_views_[indices.accessor] == no_view)
      refuse(TW_INVALID, text("/accessors/", indices.accessor), "indices need a buffer view");
  }

  void check_view(size_t i) const {
    const View &view = views_[i];
    Place place = {"bufferViews", i};
    if (view.buffer >= buffers_.size())
      refuse(TW_INVALID, place.pointer("buffer"), "there is no such buffer");
    uint64_t size = buffers_[view.buffer].length;
    if (view.length == 0)
      refuse(TW_INVALID, place.pointer("byteLength"), "a buffer view needs at least one byte");
    if (view.offset > size || view.length > size - view.offset)
      refuse(TW_INVALID, place.pointer("byteLength"), "the buffer view goes past the ", size,
             " bytes of its buffer");
  }
};

const Checker::Part Checker::parts[14] = {
    {"extensionsRequired", 0, &Checker::required_extension},
    {"buffers", 0, &Checker::buffer},
    {"bufferViews", 0, &Checker::view},
    {"accessors", 0, &Checker::accessor},
    {"images", 0, &Checker::image},
    {"meshes", TW_MESHES_MAX, &Checker::mesh},
    {"animations", TW_CLIPS_MAX, &Checker::animation},
    {"materials", TW_MATERIALS_MAX, nullptr},
    {"nodes", TW_NODES_MAX, nullptr},
    {"skins", TW_NODES_MAX, nullptr},
    {"textures", 0, nullptr},
    {"samplers", 0, nullptr},
    {"cameras", 0, nullptr},
    {"scenes", 0, nullptr},
};

// ---- the copy, and what it costs ---------------------------------------------------------------------

// What malloc takes for so many bytes.
constexpr uint64_t chunk(uint64_t size) {
  return size == 0 ? 0 : size <= 24 ? 32 : (size + 8 + 15) / 16 * 16;
}

// The nodes of a JSON tree, which is made of std::map, std::vector and std::string. An element has 16 bytes.
constexpr uint64_t tree_slot = 16, tree_member = chunk(80), tree_object = chunk(48), tree_array = chunk(24),
                   tree_string = chunk(32);

// What becomes of its values in tinygltf's structs, at most: attributes of a map, numbers of an array, maps
// of an array.
constexpr uint64_t member_cost = 80, element_cost = 16, object_cost = 96;

// What is read of an object; all else is left out.
struct Schema {
  std::string_view members; // that are copied as they are, a blank between two
  struct Part {
    std::string_view key; // "" for none
    const Schema *schema;
    uint64_t size; // bytes of the struct that an element of the array becomes; 0: it is an object, no array
    bool (*is_read)(const char *element); // nullptr: all elements are
  } parts[2];
};

const Schema primitive_schema = {"attributes indices material mode targets", {}};
const Schema target_schema = {"node path", {}};
const Schema channel_schema = {"sampler", {{"target", &target_schema, 0, nullptr}, {}}};
const Schema keys_schema = {"input output interpolation", {}};
const Schema asset_schema = {"version minVersion", {}};

// The root's arrays that are read.
struct RootArray {
  std::string_view key;
  uint64_t size;
  void (*reserve)(tinygltf::Model &model, size_t count); // tinygltf would double them as they grow
  Schema schema;
};

template <auto Member> void reserve(tinygltf::Model &model, size_t count) {
  (model.*Member).reserve(count);
}

// From 2.9 on tinygltf begins with an empty model: what was reserved is gone, and arrays double as they grow.
bool parser_keeps_room() {
  static const bool keeps = [] {
    static const char document[] = "{\"asset\":{\"version\":\"2.0\"}}";
    tinygltf::Model model;
    std::string error, warning;
    model.nodes.reserve(8);
    tinygltf::TinyGLTF().LoadASCIIFromString(&model, &error, &warning, document, sizeof document - 1, "");
    return model.nodes.capacity() >= 8;
  }();
  return keeps;
}

const RootArray root_arrays[] = {
    {"nodes",
     sizeof(tinygltf::Node),
     reserve<&tinygltf::Model::nodes>,
     {"name children mesh skin matrix translation rotation scale weights", {}}},
    {"meshes",
     sizeof(tinygltf::Mesh),
     reserve<&tinygltf::Model::meshes>,
     {"name weights", {{"primitives", &primitive_schema, 2 * sizeof(tinygltf::Primitive), nullptr}, {}}}},
    {"accessors",
     sizeof(tinygltf::Accessor),
     reserve<&tinygltf::Model::accessors>,
     {"bufferView byteOffset normalized componentType count type sparse", {}}},
    {"bufferViews",
     sizeof(tinygltf::BufferView),
     reserve<&tinygltf::Model::bufferViews>,
     {"buffer byteOffset byteLength byteStride", {}}},
    {"skins",
     sizeof(tinygltf::Skin),
     reserve<&tinygltf::Model::skins>,
     {"name joints skeleton inverseBindMatrices", {}}},
    {"animations",
     sizeof(tinygltf::Animation),
     reserve<&tinygltf::Model::animations>,
     {"name",
      {{"channels", &channel_schema, sizeof(tinygltf::AnimationChannel), is_track},
       {"samplers", &keys_schema, sizeof(tinygltf::AnimationSampler), nullptr}}}},
    {"scenes", sizeof(tinygltf::Scene), reserve<&tinygltf::Model::scenes>, {"nodes", {}}},
};

bool is_read(std::string_view member) {
  return member == "asset" || member == "scene" ||
         std::any_of(std::begin(root_arrays), std::end(root_arrays),
                     [&](const RootArray &part) { return part.key == member; });
}

// Copies what is read, and adds up what parsing the copy will take.
class Copier : Text {
public:
  explicit Copier(Document &document)
      : Text(document.budget), budget_(document.budget), out_(document.outline), parsed_(document.source) {}

  void run(const char *root, size_t size) {
    text_.reserve(size);
    put("{");
    for (Items i(root); i.more(); i.next()) root_member(i);
    put("}");
    out_.json = std::move(text_);
    out_.tree_size = tree_ + growth_ + 6 * longest_;
    out_.model_size = model_;
  }

private:
  Budget &budget_;
  Outline &out_;
  tinygltf::Model &parsed_;
  uint64_t tree_ = 0, model_ = 0;
  uint64_t growth_ = 0;  // the most that an array takes beside itself while it grows
  uint64_t longest_ = 0; // text; the parser holds several copies of it

  void put_key(std::string_view key) {
    Text::put_key(key);
    count_text(key.size(), 1);
    tree_ += tree_member;
  }

  void check(std::string_view array, uint64_t index) const {
    if (tree_ + model_ + growth_ + 6 * longest_ <= budget_.left()) return;
    refuse(TW_LIMIT, text("/", array, "/", index), "the JSON text up to here takes too much memory to parse");
  }

  // ---- what it costs

  static uint64_t capacity_of(uint64_t count) {
    uint64_t capacity = 1;
    while (capacity < count) capacity *= 2;
    return count ? capacity : 0;
  }

  void count_array(uint64_t &sum, uint64_t count, uint64_t size) {
    uint64_t bytes = capacity_of(count) * size;
    sum += chunk(bytes);
    growth_ = std::max(growth_, chunk(bytes / 2));
  }

  // Short text is in its string.
  void count_text(uint64_t size, uint64_t copies) {
    if (size > 15) {
      tree_ += chunk(size + 1);
      model_ += copies * chunk(size + 1);
    }
    longest_ = std::max(longest_, size);
  }

  void count_value(const char *value) {
    if (*value == '"') {
      tree_ += tree_string;
      count_text(string_of(value).size(), 2);
    } else if (*value == '{') {
      tree_ += tree_object;
      model_ += object_cost;
      for (Items i(value); i.more(); i.next()) {
        tree_ += tree_member;
        model_ += member_cost;
        count_text(i.key().size(), 1);
        count_value(i.value());
      }
    } else if (*value == '[') {
      uint64_t count = 0;
      for (Items i(value); i.more(); i.next(), count++) count_value(i.value());
      tree_ += tree_array;
      count_array(tree_, count, tree_slot);
      count_array(model_, count, element_cost);
    }
  }

  // ---- copying

  void copy(const char *value) {
    put(value_text(value));
    count_value(value);
  }

  // An escaped key may be any member: kept for tinygltf.
  void object(const char *value, const Schema &schema) {
    if (*value != '{') return copy(value);
    tree_ += tree_object;
    put("{");
    for (Items i(value); i.more(); i.next()) {
      if (is_escaped(i.key()) || has_word(schema.members, i.key())) {
        put_key(i.key());
        copy(i.value());
      }
      for (const Schema::Part &part : schema.parts)
        if (!part.key.empty() && part.key == i.key()) {
          put_key(i.key());
          struct_member(i.value(), part);
        }
    }
    put("}");
  }

  void struct_member(const char *value, const Schema::Part &part) {
    if (part.size == 0) return object(value, *part.schema);
    if (*value != '[') return copy(value);
    uint64_t count = array(value, part.is_read, [&](const char *element) { object(element, *part.schema); });
    count_array(model_, count, part.size);
  }

  // Returns the number of elements.
  template <typename Element>
  uint64_t array(const char *value, bool (*is_read)(const char *), Element element) {
    uint64_t count = 0;
    put("[");
    for (Items i(value); i.more(); i.next()) {
      if (is_read && !is_read(i.value())) continue;
      count++;
      put_comma();
      element(i.value());
    }
    put("]");
    tree_ += tree_array;
    count_array(tree_, count, tree_slot);
    return count;
  }

  void root_array(const RootArray &part, const char *value) {
    if (*value != '[') return copy(value);
    uint64_t index = 0;
    uint64_t count = array(value, nullptr, [&](const char *element) {
      object(element, part.schema);
      model_ += part.size;
      check(part.key, index++);
    });
    if (parser_keeps_room()) {
      part.reserve(parsed_, static_cast<size_t>(count));
    } else {
      model_ += (capacity_of(count) - count) * part.size;
      growth_ = std::max(growth_, capacity_of(count) / 2 * part.size);
    }
    check(part.key, count);
  }

  void root_member(const Items &member) {
    for (const RootArray &part : root_arrays)
      if (part.key == member.key()) {
        put_key(member.key());
        root_array(part, member.value());
      }
    bool is_asset = member.key() == "asset";
    if (!is_asset && member.key() != "scene") return;
    put_key(member.key());
    object(member.value(), asset_schema);
  }
};

// What the document may be copied to.
size_t size_of_copy(const char *root) {
  size_t size = 2;
  for (Items i(root); i.more(); i.next())
    if (is_read(i.key())) size += i.key().size() + 4 + value_text(i.value()).size();
  return size;
}

// ---- strings --------------------------------------------------------------------------------------------

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

// "\/" is a slash: the digit that stands at `at`, -1 at the end of the text.
int next_digit(std::string_view written, size_t &at) {
  if (at + 1 < written.size() && written[at] == '\\' && written[at + 1] == '/') at++;
  return at < written.size() ? base64_digit(written[at++]) : -1;
}

} // namespace

Vector<uint8_t> decode_base64(std::string_view written, Budget &budget, std::string_view *rest) {
  size_t digits = 0, end = 0;
  for (size_t at = 0; next_digit(written, at) >= 0; end = at) digits++;
  if (rest) *rest = written.substr(end);
  Vector<uint8_t> out(digits * 6 / 8, Counted<uint8_t>(budget));
  uint32_t bits = 0, count = 0;
  size_t at = 0;
  for (uint8_t &byte : out) {
    for (; count < 8; count += 6) bits = bits << 6 | static_cast<uint32_t>(next_digit(written, at));
    count -= 8;
    byte = static_cast<uint8_t>(bits >> count);
  }
  return out;
}

std::string unescape(std::string_view written) {
  std::string out(written.size(), '\0');
  out.resize(static_cast<size_t>(tw_json_unescape(written.data(), written.size(), out.data()) - out.data()));
  return out;
}

bool has_word(std::string_view list, std::string_view word) {
  for (size_t at = list.find(word); at != std::string_view::npos; at = list.find(word, at + 1)) {
    size_t end = at + word.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return true;
  }
  return false;
}

bool is_track(const char *channel) {
  const char *target = tw_json_member(channel, "target");
  const char *node = tw_json_member(target, "node");
  const char *path = tw_json_member(target, "path");
  return node && path && *path == '"' && has_word("translation rotation scale weights", string_of(path));
}

std::optional<uint64_t> whole_number(const char *value) {
  double number;
  if (!value || !tw_json_is_number(value)) return {};
  tw_json_number(value, &number);
  if (!(number >= 0 && number <= 9007199254740992.0) || number != std::floor(number)) return {};
  return static_cast<uint64_t>(number);
}

int index_of(const char *value) {
  std::optional<uint64_t> number = whole_number(value);
  return number && *number < INT32_MAX ? static_cast<int>(*number) : -1;
}

std::string pointer_part(const std::string &name) {
  std::string part;
  for (char c : name) part += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return part;
}

void make_outline(const Bytes &file, const tw_read_limits &limits, Document &document) {
  Container container = open_container(file);
  const tw_json_rules rules = {limits.json_values, false};
  tw_error error = {};
  tw_status status = tw_json_check(container.json.data(), container.json.size(), &rules, &error);
  if (status != TW_OK) refuse(status, error.pointer, error.detail);
  const char *root = tw_json_root(container.json.data(), container.json.size());
  document.outline.root = root;
  document.outline.binary = container.binary;
  Checker(container, document.budget, document.outline).run(root);
  Copier(document).run(root, size_of_copy(root));
}

} // namespace gltf
