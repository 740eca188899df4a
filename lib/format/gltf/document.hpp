// A glTF document on its way from bytes to a tw_model: refusals, the budget of memory, the outline that is
// made before tinygltf sees a byte, accessors, and the steps of reading.
#ifndef TWEEND_GLTF_DOCUMENT_HPP
#define TWEEND_GLTF_DOCUMENT_HPP

#include <cstdint>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <tiny_gltf.h>

#include "gltf/gltf.h"
#include "tweend/format.h"
#include "tweend/json_text.h"

namespace gltf {

// ---- refusals ------------------------------------------------------------------------------------

// How the reading side says no: an exception that stays inside lib/format/gltf and becomes a tw_error at its
// C surface.
struct Refusal {
  tw_status status;
  std::string pointer; // RFC 6901, into the glTF document; "" where there is no place
  std::string detail;
};

// The parts one after the other, as text.
template <typename... Parts> std::string text(const Parts &...parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

template <typename... Parts>
[[noreturn]] void refuse(tw_status status, std::string pointer, const Parts &...parts) {
  throw Refusal{status, std::move(pointer), text(parts...)};
}

// A member's name as a part of a pointer (RFC 6901).
std::string pointer_part(const std::string &name);

// The same at the C surface: fills the error, and returns the status.
tw_status report(const Refusal &refusal, tw_error *error);

// ---- memory --------------------------------------------------------------------------------------

// Bytes that reading may still take, of those that tw_reading_size promises. Whoever takes more is refused.
class Budget {
public:
  explicit Budget(uint64_t bytes) : left_(bytes) {}
  uint64_t left() const { return left_; }
  void take(uint64_t bytes) {
    if (bytes > left_) refuse(TW_LIMIT, place, "the document takes too much memory to read");
    left_ -= bytes;
  }
  void give(uint64_t bytes) { left_ += bytes; }

  std::string place; // pointer to what is being read

private:
  uint64_t left_;
};

// Bytes that are taken for a while.
class Hold {
public:
  Hold(Budget &budget, uint64_t bytes) : budget_(budget), bytes_(bytes) { budget_.take(bytes_); }
  Hold(const Hold &) = delete;
  Hold &operator=(const Hold &) = delete;
  ~Hold() { budget_.give(bytes_); }

private:
  Budget &budget_;
  uint64_t bytes_;
};

// Allocates out of a budget.
template <typename T> struct Counted {
  using value_type = T;
  using propagate_on_container_move_assignment =
      std::true_type; // memory moves with its budget: that never throws
  Budget *budget;

  explicit Counted(Budget &from) : budget(&from) {}
  template <typename U> Counted(const Counted<U> &other) : budget(other.budget) {}
  T *allocate(size_t count) {
    budget->take(count * sizeof(T));
    return std::allocator<T>().allocate(count);
  }
  void deallocate(T *memory, size_t count) {
    std::allocator<T>().deallocate(memory, count);
    budget->give(count * sizeof(T));
  }
  template <typename U> bool operator==(const Counted<U> &other) const { return budget == other.budget; }
  template <typename U> bool operator!=(const Counted<U> &other) const { return budget != other.budget; }
};

template <typename T> class Vector : public std::vector<T, Counted<T>> {
public:
  explicit Vector(Budget &budget) : Vector::vector(Counted<T>(budget)) {}
  Vector(Budget &budget, size_t count, const T &value = T())
      : Vector::vector(count, value, Counted<T>(budget)) {}
};

// ---- the JSON text -------------------------------------------------------------------------------
// Checked by tw_json_check before any of this sees it.

// An object or array of the text, item by item; `value` moves along.
class Items {
public:
  explicit Items(const char *container) { more_ = tw_json_first(container, &item_); }
  bool more() const { return more_; }
  void next() { more_ = tw_json_next(tw_json_skip(item_.value), &item_); }
  std::string_view key() const { return {item_.key, item_.key_size}; }
  const char *value() const { return item_.value; }

private:
  tw_json_item item_;
  bool more_;
};

inline std::string_view value_text(const char *value) {
  return {value, static_cast<size_t>(tw_json_skip(value) - value)};
}

// What stands between the quotes of a string.
inline std::string_view string_of(const char *value) {
  std::string_view quoted = value_text(value);
  return quoted.substr(1, quoted.size() - 2);
}

inline bool is_escaped(std::string_view key) {
  return key.find('\\') != std::string_view::npos;
}

// Calls element(index, value) for each element of an array; for none of what is no array, or nullptr.
template <typename Element> void each(const char *array, Element element) {
  size_t index = 0;
  if (array && *array == '[')
    for (Items i(array); i.more(); i.next()) element(index++, i.value());
}

// A whole number that JSON and a double hold alike; nothing for any other value, or nullptr.
std::optional<uint64_t> whole_number(const char *value);

// The same as tinygltf has indices; -1 for what is none.
int index_of(const char *value);

// Whether the words of a list, a blank between two, have this one.
bool has_word(std::string_view list, std::string_view word);

// A JSON string as it is meant; `written`: what stands between the quotes.
std::string unescape(std::string_view written);

// The bytes of base64 text as far as it goes, "\/" being a slash as JSON may write it. rest: what stands
// behind it.
Vector<uint8_t> decode_base64(std::string_view written, Budget &budget, std::string_view *rest = nullptr);

struct Bytes {
  const uint8_t *data;
  size_t size;
};

// The type of an image that its bytes show; nullptr for another one.
const char *image_type(const Bytes &file);

// JSON text under way.
class Text {
protected:
  explicit Text(Budget &budget) : text_(budget) {}

  Vector<char> text_;

  void put(std::string_view text) { text_.insert(text_.end(), text.begin(), text.end()); }

  // The comma before a member or an element, unless it is the first.
  void put_comma() {
    if (text_.back() != '{' && text_.back() != '[') text_.push_back(',');
  }

  void put_key(std::string_view key) {
    put_comma();
    put("\"");
    put(key);
    put("\":");
  }
};

// ---- before tinygltf -----------------------------------------------------------------------------

// Where the bytes of an image are.
struct ImageOutline {
  uint64_t index;                  // in the document
  uint64_t view;                   // no_view: in the uri
  std::string_view mime_type, uri; // as written, between the quotes
};
constexpr uint64_t no_view = UINT64_MAX;

// A view that was compressed: its bytes are a buffer of their own.
struct DecodedView {
  size_t view, buffer;
};

// What a file holds, apart from what tinygltf reads.
struct Outline {
  explicit Outline(Budget &budget)
      : json(budget), buffers(budget), decoded(budget), images(budget), decoded_views(budget) {}

  bool binary = false;   // a GLB
  const char *root;      // the JSON object
  Vector<char> json;     // the document without buffers and all else that is not read
  Vector<Bytes> buffers; // BIN chunk, decoded data URIs and views
  Vector<Vector<uint8_t>> decoded;
  Vector<ImageOutline> images;            // those whose bytes are in the file
  Vector<DecodedView> decoded_views;      // in place of what the document says of them
  uint32_t link_count = 0;                // images on the web
  uint64_t tree_size = 0, model_size = 0; // what parsing takes at most, and what stays of it
};

// Members that are read, a blank between two: tinygltf sees no others, and all others are kept for answers.
constexpr char node_members[] = "name children mesh skin matrix translation rotation scale weights",
               mesh_members[] = "name weights primitives",
               primitive_members[] = "attributes indices material mode targets",
               skin_members[] = "name joints skeleton inverseBindMatrices",
               animation_members[] = "name channels samplers", channel_members[] = "sampler target",
               target_members[] = "node path", sampler_members[] = "input output interpolation",
               scene_members[] = "nodes";

struct Document;

// Checks the container and the JSON text: lengths, grammar, depth, number of values; that no unknown
// extension is required, that every buffer is inside the file, every buffer view inside its buffer, that
// views and accessors exist where tinygltf would follow them; and that parsing stays in the budget. tinygltf
// opens files that a uri names, copies buffers, recurses without bound, and spends kilobytes on an empty
// object. Fills the outline, and gives the document's arrays the room that they need.
void make_outline(const Bytes &file, Document &document);

// Copies what is read of a checked document into the outline, and adds up what parsing the copy takes, which
// stays in the budget.
void copy_for_parser(const char *root, Document &document);

// ---- accessors -----------------------------------------------------------------------------------

// Bytes of a component; 0 for a type that glTF does not have.
uint32_t component_size(int component_type);

// A view of one accessor's elements (glTF 2.0, section 3.6.2), checked: whoever holds one may read any of
// them.
class Elements {
public:
  uint32_t count() const { return count_; }
  uint32_t width() const { return width_; }
  int component_type() const { return component_type_; }
  bool normalized() const { return normalized_; }
  // Without data all elements are 0.
  bool has_data() const { return data_ || sparse_count_ > 0; }

  // Element i as floats: out[width]. Throws Refusal on a value that is not finite.
  void read(uint32_t i, float *out) const;
  // The same; false in place of the refusal, out then holds all 0.
  bool read_finite(uint32_t i, float *out) const;

  // The bytes of element i as they stand: out[width * size of a component].
  void copy(uint32_t i, uint8_t *out) const;

  // Element i of unsigned integers as they are; 0 for other types.
  uint32_t read_index(uint32_t i) const;

private:
  friend class Accessors;
  int accessor_ = -1;
  const uint8_t *data_ = nullptr; // nullptr: all zero
  size_t stride_ = 0;
  uint32_t count_ = 0, width_ = 0;
  int component_type_ = 0;
  bool normalized_ = false;
  // Replaced elements, by ascending index.
  uint32_t sparse_count_ = 0;
  int sparse_index_type_ = 0;
  const uint8_t *sparse_indices_ = nullptr, *sparse_values_ = nullptr;

  // nullptr for what is not replaced.
  const uint8_t *find_sparse(uint32_t i) const;

  // nullptr for 0.
  const uint8_t *find(uint32_t i) const {
    const uint8_t *replaced = sparse_count_ ? find_sparse(i) : nullptr;
    return replaced ? replaced : data_ ? data_ + size_t{i} * stride_ : nullptr;
  }
};

// Opens accessors, each one once.
class Accessors {
public:
  // buffers: outlive the accessors.
  Accessors(const tinygltf::Model &model, const Vector<Bytes> &buffers, Budget &budget);

  // The accessor at `index`, which `pointer` names. type: TINYGLTF_TYPE_*. Throws Refusal.
  const Elements &open(int index, int type, const std::string &pointer);

  // As open, for any type.
  const Elements &open_any(int index, const std::string &pointer);

  // "SCALAR", ... of an accessor that was opened.
  const char *type_name(int index) const;

private:
  const tinygltf::Model &model_;
  const Vector<Bytes> &buffers_;
  Vector<std::optional<Elements>> opened_;
  uint64_t sparse_left_; // sparse indices that may still be checked: accessors may share their bytes

  Elements check(size_t index);
  void check_sparse(size_t index, Elements &elements);
  const uint8_t *check_range(int view, uint64_t offset, uint64_t count, uint64_t element_size,
                             uint64_t *stride, const std::string &pointer) const;
};

// ---- reading -------------------------------------------------------------------------------------

// What a primitive says, as text. An entry is nullptr where that is nothing.
struct PrimitiveText {
  const char *kept;       // beyond what is read: see gltf.h
  const char *attributes; // in the document's text
  bool bears_ngons;       // FB_ngon_encoding
};

struct MeshText {
  const char *tags; // extras.tweend in the document's text, or nullptr
  Vector<PrimitiveText> primitives;
};

struct Document {
  Document(tw_model *target, tw_quads how, tw_weld joining, uint64_t memory)
      : budget(memory), outline(budget), mesh_texts(budget), channel_texts(budget), slots(budget),
        normal_maps(budget), model(target), quads(how), weld(joining) {}

  Budget budget;
  Outline outline;
  tinygltf::Model source;
  Vector<MeshText> mesh_texts;                // of each mesh
  Vector<Vector<const char *>> channel_texts; // of each animation's tracks: what they keep, or nullptr
  Vector<tw_material_slot> slots;             // see tw_model
  std::map<std::pair<int32_t, std::string_view>, size_t> slot_numbers;
  Vector<int> normal_maps;          // of each material: the UV set of its normal map, -1 without one
  tw_model *model;                  // keep_parts makes room for what the document's parts become
  tw_gltf_assets *assets = nullptr; // the model's
  tw_quads quads;
  tw_weld weld;
  uint64_t json_values = 0; // the most; 0: any number
  // Elements of a file may be named by many others; these keep a small file from taking long to read.
  uint64_t corners_left = 0, values_left = 0;
  // For the warnings.
  size_t degenerate_faces = 0, partly_textured = 0;
  uint32_t reversed_edges = 0;
  std::set<std::string> attribute_warnings;
  // What became of an attribute.
  void note(const std::string &fate) {
    constexpr size_t most = 16; // more are told of as these
    if (attribute_warnings.size() < most) attribute_warnings.insert(fate);
  }

  // Sets of named groups, of all meshes.
  std::map<std::string, uint32_t> group_numbers;
  std::vector<const char *> group_names;
};

// [count] elements in the model's arena, with anything in them. Throws bad_alloc.
template <typename Element> Element *allocate(Document &document, size_t count) {
  document.budget.take(count * sizeof(Element));
  void *memory = tw_arena_alloc_raw(document.model->arena, count, sizeof(Element));
  if (!memory) throw std::bad_alloc();
  return static_cast<Element *>(memory);
}

// The same, zeroed.
template <typename Element> Element *allocate_zero(Document &document, size_t count) {
  document.budget.take(count * sizeof(Element));
  void *memory = tw_arena_alloc(document.model->arena, count, sizeof(Element));
  if (!memory) throw std::bad_alloc();
  return static_cast<Element *>(memory);
}

// Whether a channel animates a node in a way that tracks have. tinygltf sees no other channels.
bool is_track(const char *channel);

// A name as clients can use it, nullptr for an empty one. Control characters become blanks.
const char *copy_name(Document &document, const std::string &name);

// What the model holds comes from the document's parts, each step on its own; all throw Refusal.
void keep_parts(Document &document, Accessors &accessors);  // room, and what is borne beyond what is read
void read_assets(Document &document);                       // after keep_parts: bytes of images, references
void read_meshes(Document &document, Accessors &accessors); // after read_assets
void read_nodes(Document &document);                        // after read_meshes; and the scenes
void read_skins(Document &document, Accessors &accessors);  // after read_nodes
void read_clips(Document &document, Accessors &accessors);  // after read_meshes and read_nodes

} // namespace gltf

#endif
