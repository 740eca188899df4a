// One pass over the JSON text of a glTF file before it is parsed for real. Remembers only what the checks
// need: required extensions, buffers, buffer views, and who names a view.
#include "gltf/container.hpp"
#include "gltf/json_scan.hpp"

#include <algorithm>
#include <vector>

#include <tiny_gltf.h>

namespace gltf {

namespace {

constexpr uint64_t integer_max = uint64_t{1} << 53;

struct BufferOutline {
  uint64_t byte_length = 0;
  bool has_uri = false;
  uint64_t uri_bytes = 0; // that the data URI decodes to
};

struct ViewOutline {
  uint64_t buffer = 0, offset = 0, length = 0;
};

// Extensions that a document may require: their meaning is read, or they only speak of what is handed on.
bool is_supported(std::string_view extension) {
  static constexpr std::string_view names[] = {
      "KHR_mesh_quantization", "FB_ngon_encoding", "KHR_texture_transform", "KHR_texture_basisu",
      "EXT_texture_webp",      "EXT_texture_avif", "MSFT_texture_dds",      "KHR_lights_punctual"};
  if (extension.substr(0, 14) == "KHR_materials_") return extension != "KHR_materials_variants";
  return std::find(std::begin(names), std::end(names), extension) != std::end(names);
}

constexpr uint64_t no_view = UINT64_MAX;

struct IndicesOutline {
  uint64_t mesh, primitive, accessor;
};

class Scanner : JsonScan {
public:
  Scanner(const Container &container, const tw_read_limits &limits)
      : JsonScan(container.json, container.json_size, limits.json_values), container_(container) {}

  void run() {
    blanks();
    if (at_ == end_ || *at_ != '{') malformed("a glTF document is a JSON object");
    root();
    blanks();
    if (at_ != end_) malformed("there is text after the JSON document");
    check_outline();
  }

private:
  const Container &container_;
  std::vector<BufferOutline> buffers_;
  std::vector<ViewOutline> views_;
  std::vector<uint64_t> accessor_views_; // no_view for one without
  std::vector<IndicesOutline> indices_;
  std::vector<uint64_t> image_views_; // image index << 32 | view, of the images that have one
  std::string_view unsupported_;      // the first required extension that is
  uint64_t unsupported_index_ = 0;

  // ---- the parts that are looked at ------------------------------------------------------------

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
      if (key.find('\\') != std::string_view::npos)
        refuse(TW_UNSUPPORTED, place_.pointer(""), "a member's name is written with an escape");
    }

  private:
    Place place_;
    std::vector<std::string_view> seen_;
  };

  uint64_t integer(Place place, const char *member) {
    char first = peek();
    const char *start = at_;
    uint64_t value = 0;
    if (first >= '0' && first <= '9') {
      count_value();
      number();
      for (const char *c = start; c < at_; c++) {
        if (*c < '0' || *c > '9' || value > integer_max / 10) refuse_integer(place, member);
        value = value * 10 + static_cast<uint64_t>(*c - '0');
      }
      return value;
    }
    refuse_integer(place, member);
  }

  [[noreturn]] static void refuse_integer(Place place, const char *member) {
    refuse(TW_INVALID, place.pointer(member), "this must be a whole number, 0 or more");
  }

  void root() {
    Once once({"", 0});
    object([&](std::string_view key) {
      once.check(key);
      if (once.is(key, "extensionsRequired"))
        elements("/extensionsRequired", sizeof(std::string), [this](uint64_t i) { required_extension(i); });
      else if (once.is(key, "buffers"))
        elements("/buffers", sizeof(tinygltf::Buffer), [this](uint64_t i) { buffer(i); });
      else if (once.is(key, "bufferViews"))
        elements("/bufferViews", sizeof(tinygltf::BufferView), [this](uint64_t i) { view(i); });
      else if (once.is(key, "images"))
        elements("/images", sizeof(tinygltf::Image), [this](uint64_t i) { image(i); });
      else if (once.is(key, "animations"))
        elements("/animations", sizeof(tinygltf::Animation), [this](uint64_t i) { animation(i); });
      else if (once.is(key, "materials"))
        elements("/materials", sizeof(tinygltf::Material), [this](uint64_t) { skip(); });
      else if (once.is(key, "accessors"))
        elements("/accessors", sizeof(tinygltf::Accessor), [this](uint64_t i) { accessor(i); });
      else if (once.is(key, "nodes"))
        elements("/nodes", sizeof(tinygltf::Node), [this](uint64_t) { skip(); });
      else if (once.is(key, "meshes"))
        elements("/meshes", sizeof(tinygltf::Mesh), [this](uint64_t i) { mesh(i); });
      else if (peek() == '[')
        // Cameras are the largest of what remains.
        elements("", sizeof(tinygltf::Camera), [this](uint64_t) { skip(); });
      else
        skip();
    });
  }

  // The array of one of the root's members: each element costs a struct of the parsed document.
  template <typename Element> void elements(const std::string &pointer, size_t size, Element element) {
    if (peek() != '[') refuse(TW_INVALID, pointer, "this must be an array");
    array([&](uint64_t i) {
      spend(size + size / 2);
      element(i);
    });
  }

  template <typename Member> void element_object(Place place, Member member) {
    if (peek() != '{') refuse(TW_INVALID, place.pointer(""), "this must be an object");
    Once once(place);
    object([&](std::string_view key) {
      once.check(key);
      member(key, once);
    });
  }

  void buffer(uint64_t i) {
    Place place = {"buffers", i};
    BufferOutline outline;
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "byteLength")) {
        outline.byte_length = integer(place, "byteLength");
      } else if (once.is(key, "uri")) {
        if (peek() != '"') refuse(TW_INVALID, place.pointer("uri"), "a uri must be a string");
        count_value();
        outline.uri_bytes = check_uri(string(), place);
        outline.has_uri = true;
      } else {
        skip();
      }
    });
    buffers_.push_back(outline);
  }

  // Only what tinygltf takes for a data URI itself: with anything else it would look for a file.
  // Returns the number of bytes that it decodes to.
  static uint64_t check_uri(std::string_view uri, Place place) {
    std::string start;
    uint64_t characters = 0; // of the base64 text; a slash may be written \/
    for (size_t i = 0; i < uri.size(); i++) {
      if (uri[i] == '\\' && i + 1 < uri.size() && uri[i + 1] == '/') continue;
      if (start.empty() || start.back() != ',')
        start += uri[i];
      else if (uri[i] != '=')
        characters++;
    }
    if (!tinygltf::IsDataURI(start))
      refuse(TW_UNSUPPORTED, place.pointer("uri"),
             "a buffer must be inside the file: a base64 data URI or the BIN chunk");
    return characters * 6 / 8;
  }

  void view(uint64_t i) {
    Place place = {"bufferViews", i};
    ViewOutline outline;
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "buffer"))
        outline.buffer = integer(place, "buffer");
      else if (once.is(key, "byteOffset"))
        outline.offset = integer(place, "byteOffset");
      else if (once.is(key, "byteLength"))
        outline.length = integer(place, "byteLength");
      else
        skip();
    });
    views_.push_back(outline);
  }

  void image(uint64_t i) {
    Place place = {"images", i};
    element_object(place, [&](std::string_view key, Once &once) {
      if (!once.is(key, "bufferView")) return skip();
      uint64_t index = integer(place, "bufferView");
      if (index > UINT32_MAX || i > UINT32_MAX) refuse_integer(place, "bufferView");
      image_views_.push_back(i << 32 | index);
    });
  }

  // First of all, so that a file is refused for the extension and not for what it does to the rest.
  void required_extension(uint64_t i) {
    if (peek() != '"')
      refuse(TW_INVALID, text("/extensionsRequired/", i), "an extension is named by a string");
    count_value();
    std::string_view name = string();
    if (unsupported_.empty() && !is_supported(name)) {
      unsupported_ = name;
      unsupported_index_ = i;
    }
  }

  void accessor(uint64_t i) {
    Place place = {"accessors", i};
    uint64_t view = no_view;
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "bufferView"))
        view = integer(place, "bufferView");
      else
        skip();
    });
    accessor_views_.push_back(view);
  }

  void mesh(uint64_t i) {
    Place place = {"meshes", i};
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "primitives"))
        elements(place.pointer("primitives"), sizeof(tinygltf::Primitive),
                 [this, i](uint64_t k) { primitive(i, k); });
      else
        skip();
    });
  }

  void primitive(uint64_t mesh, uint64_t i) {
    Place place = {"meshes", mesh};
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "indices") && peek() != '-')
        indices_.push_back({mesh, i, integer(place, "primitives")});
      else
        skip();
    });
  }

  // tinygltf gives every sampler a copy of its animation's extensions.
  void animation(uint64_t i) {
    Place place = {"animations", i};
    uint64_t extension_values = 0, samplers = 0;
    element_object(place, [&](std::string_view key, Once &once) {
      if (once.is(key, "extensions")) {
        uint64_t before = values_;
        skip();
        extension_values = values_ - before;
      } else if (once.is(key, "samplers") && peek() == '[') {
        samplers = array([this](uint64_t) {
          spend(sizeof(tinygltf::AnimationSampler));
          skip();
        });
      } else {
        if (key == "channels") spend(sizeof(tinygltf::AnimationChannel));
        skip();
      }
    });
    if (extension_values > 0 && samplers > cost_max / value_cost / extension_values) spend(cost_max);
    spend(extension_values * samplers * value_cost);
  }

  // ---- what they must agree on -----------------------------------------------------------------

  void check_outline() const {
    if (!unsupported_.empty())
      refuse(TW_UNSUPPORTED, text("/extensionsRequired/", unsupported_index_),
             "the document requires the extension ", unsupported_, ", which is not supported");
    for (size_t i = 0; i < buffers_.size(); i++) check_buffer(i);
    for (size_t i = 0; i < views_.size(); i++) check_view(i);
    for (size_t i = 0; i < accessor_views_.size(); i++)
      if (accessor_views_[i] != no_view && accessor_views_[i] >= views_.size())
        refuse(TW_INVALID, text("/accessors/", i, "/bufferView"), "there is no such buffer view");
    for (const IndicesOutline &indices : indices_) check_indices(indices);
    for (uint64_t image_view : image_views_)
      if ((image_view & UINT32_MAX) >= views_.size())
        refuse(TW_INVALID, text("/images/", image_view >> 32, "/bufferView"), "there is no such buffer view");
  }

  void check_indices(const IndicesOutline &indices) const {
    if (indices.accessor >= accessor_views_.size())
      refuse(TW_INVALID, text("/meshes/", indices.mesh, "/primitives/", indices.primitive, "/indices"),
             "there is no accessor ", indices.accessor);
    if (accessor_views_[indices.accessor] == no_view)
      refuse(TW_INVALID, text("/accessors/", indices.accessor), "indices need a buffer view");
  }

  void check_buffer(size_t i) const {
    const BufferOutline &buffer = buffers_[i];
    Place place = {"buffers", i};
    if (buffer.byte_length == 0)
      refuse(TW_INVALID, place.pointer("byteLength"), "a buffer needs at least one byte");
    if (buffer.has_uri) {
      if (buffer.uri_bytes != buffer.byte_length)
        refuse(TW_INVALID, place.pointer("byteLength"), "the data URI holds ", buffer.uri_bytes, " bytes");
      return;
    }
    if (!container_.binary) refuse(TW_INVALID, place.pointer(""), "a buffer of a JSON file needs a uri");
    if (i != 0) refuse(TW_INVALID, place.pointer(""), "only the first buffer may be the BIN chunk");
    if (buffer.byte_length > container_.bin_size)
      refuse(TW_INVALID, place.pointer("byteLength"), "the BIN chunk has only ", container_.bin_size,
             " bytes");
  }

  void check_view(size_t i) const {
    const ViewOutline &view = views_[i];
    Place place = {"bufferViews", i};
    if (view.buffer >= buffers_.size())
      refuse(TW_INVALID, place.pointer("buffer"), "there is no such buffer");
    uint64_t size = buffers_[view.buffer].byte_length;
    if (view.length == 0)
      refuse(TW_INVALID, place.pointer("byteLength"), "a buffer view needs at least one byte");
    if (view.offset > size || view.length > size - view.offset)
      refuse(TW_INVALID, place.pointer("byteLength"), "the buffer view goes past the ", size,
             " bytes of its buffer");
  }
};

} // namespace

void check_json(const Container &container, const tw_read_limits &limits) {
  Scanner(container, limits).run();
}

} // namespace gltf
