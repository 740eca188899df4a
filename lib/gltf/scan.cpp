// One pass over the JSON text of a glTF file (RFC 8259), before it is parsed for real. Remembers only
// what the checks need: buffers, buffer views, images.
#include "gltf/container.hpp"

#include <cstring>
#include <string_view>
#include <vector>

#include <tiny_gltf.h>

#include "gltf/refusal.hpp"

namespace gltf {

namespace {

constexpr int depth_max = 64;
constexpr uint64_t integer_max = uint64_t{1} << 53;

// What the parsed document may cost in memory: much more than any exporter's text needs, much less
// than text made to be dear.
constexpr uint64_t cost_free = 32u << 20, cost_per_byte = 64, cost_max = uint64_t{1} << 30;
constexpr uint64_t value_cost = 256; // a node of the JSON tree and its copy

struct BufferOutline {
  uint64_t byte_length = 0;
  bool has_uri = false;
  uint64_t uri_bytes = 0; // that the data URI decodes to
};

struct ViewOutline {
  uint64_t buffer = 0, offset = 0, length = 0;
};

constexpr uint64_t no_view = UINT64_MAX;

struct IndicesOutline {
  uint64_t mesh, primitive, accessor;
};

class Scanner {
public:
  Scanner(const Container &container, const tw_read_limits &limits)
      : container_(container), limits_(limits), at_(container.json),
        end_(container.json + container.json_size) {}

  void run() {
    // A byte order mark is passed over by the parser too.
    if (end_ - at_ >= 3 && std::memcmp(at_, "\xEF\xBB\xBF", 3) == 0) at_ += 3;
    blanks();
    if (at_ == end_ || *at_ != '{') malformed("a glTF document is a JSON object");
    root();
    blanks();
    if (at_ != end_) malformed("there is text after the JSON document");
    check_outline();
  }

private:
  const Container &container_;
  const tw_read_limits &limits_;
  const char *at_, *end_;
  int depth_ = 0;
  uint64_t values_ = 0, cost_ = 0;
  std::vector<BufferOutline> buffers_;
  std::vector<ViewOutline> views_;
  std::vector<uint64_t> accessor_views_; // no_view for one without
  std::vector<IndicesOutline> indices_;
  std::vector<uint64_t> image_views_; // image index << 32 | view, of the images that have one
  uint64_t images_ = 0;

  // ---- the grammar ---------------------------------------------------------------------------

  [[noreturn]] void malformed(const char *what) {
    refuse(TW_SYNTAX, "", what, ", at byte ", at_ - container_.json, " of the JSON text");
  }

  void blanks() {
    while (at_ < end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) at_++;
  }

  char peek() {
    blanks();
    if (at_ == end_) malformed("the JSON text ends too early");
    return *at_;
  }

  void expect(char c) {
    if (peek() != c) malformed("the JSON text is malformed");
    at_++;
  }

  void spend(uint64_t cost) {
    cost_ += cost;
    if (cost_ > cost_max || cost_ > cost_free + cost_per_byte * container_.json_size)
      refuse(TW_LIMIT, "", "the JSON text would take too much memory to parse");
  }

  void count_value() {
    values_++;
    if (limits_.json_values != 0 && values_ > limits_.json_values)
      refuse(TW_LIMIT, "", "the JSON text has more than ", limits_.json_values, " values");
    spend(value_cost);
  }

  void open(char c) {
    if (++depth_ > depth_max) refuse(TW_SYNTAX, "", "the JSON text is nested more than ", depth_max, " deep");
    count_value();
    expect(c);
  }

  // After an element: whether another one follows.
  bool more(char closing) {
    char c = peek();
    if (c != ',' && c != closing) malformed("the JSON text is malformed");
    at_++;
    return c == ',';
  }

  // The text between the quotes, as it is written.
  std::string_view string() {
    expect('"');
    const char *start = at_;
    while (at_ < end_ && *at_ != '"') {
      if (static_cast<unsigned char>(*at_) < 0x20) malformed("a string has a control character");
      if (*at_ == '\\' && ++at_ == end_) break;
      at_++;
    }
    if (at_ == end_) malformed("a string does not end");
    return {start, static_cast<size_t>(at_++ - start)};
  }

  void word(const char *expected) {
    size_t length = std::strlen(expected);
    if (static_cast<size_t>(end_ - at_) < length || std::memcmp(at_, expected, length) != 0)
      malformed("the JSON text is malformed");
    at_ += length;
  }

  void number() {
    const char *start = at_;
    while (at_ < end_ && std::strchr("+-.eE0123456789", *at_) && *at_) at_++;
    if (at_ == start) malformed("the JSON text is malformed"); // its grammar is the parser's to check
  }

  // Calls member(key) behind the colon of each member; it must take the value.
  template <typename Member> void object(Member member) {
    open('{');
    if (peek() == '}') {
      at_++;
    } else {
      do {
        peek();
        std::string_view key = string();
        spend(key.size());
        expect(':');
        member(key);
      } while (more('}'));
    }
    depth_--;
  }

  template <typename Element> uint64_t array(Element element) {
    uint64_t count = 0;
    open('[');
    if (peek() == ']') {
      at_++;
    } else {
      do {
        element(count++);
      } while (more(']'));
    }
    depth_--;
    return count;
  }

  void skip() {
    switch (peek()) {
    case '{': object([this](std::string_view) { skip(); }); return;
    case '[': array([this](uint64_t) { skip(); }); return;
    default: break;
    }
    count_value();
    switch (*at_) {
    case '"': string(); break;
    case 't': word("true"); break;
    case 'f': word("false"); break;
    case 'n': word("null"); break;
    default: number(); break;
    }
  }

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
      if (once.is(key, "buffers"))
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
  template <typename Element> void elements(const char *pointer, size_t size, Element element) {
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
    images_ = i + 1;
    element_object(place, [&](std::string_view key, Once &once) {
      if (!once.is(key, "bufferView")) return skip();
      uint64_t index = integer(place, "bufferView");
      if (index > UINT32_MAX || i > UINT32_MAX) refuse_integer(place, "bufferView");
      image_views_.push_back(i << 32 | index);
    });
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
      if (once.is(key, "primitives") && peek() == '[')
        elements("", sizeof(tinygltf::Primitive), [this, i](uint64_t k) { primitive(i, k); });
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
