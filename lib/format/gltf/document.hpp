// A glTF document on its way from bytes to a tw_model: refusals, the budget of memory, the outline that is
// made before tinygltf sees a byte, accessors, and the steps of reading.
#ifndef TWEEND_GLTF_DOCUMENT_HPP
#define TWEEND_GLTF_DOCUMENT_HPP

#include <cstdint>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <tiny_gltf.h>

#include "tweend/format.h"

// ---- assets --------------------------------------------------------------------------------------

// What a glTF file holds besides geometry, hierarchy and clips, kept so that an answer can bear it too:
// materials with their extensions, textures, samplers, images.
//
// Indices between the four vectors are checked: texture -> sampler and source, and the core texture
// references of the materials, are in range or -1.
struct tw_gltf_assets {
  std::vector<tinygltf::Material> materials;
  std::vector<tinygltf::Texture> textures;
  std::vector<tinygltf::Sampler> samplers;
  // Either `image` holds the encoded file (PNG, JPEG, KTX2, ...) as it came, `mimeType` is set and
  // `uri` empty; or `uri` is a reference to something outside, as it came, and `image` is empty.
  // `bufferView` is always -1.
  std::vector<tinygltf::Image> images;
  // Extensions that occur in the above, to be declared by an answer that uses them.
  std::vector<std::string> extensions_used, extensions_required;
  std::string copyright; // of the source, "" when it has none
  size_t size = 0;       // bytes that all of it holds
};

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

template <typename T> using Vector = std::vector<T, Counted<T>>;

// ---- before tinygltf -----------------------------------------------------------------------------

struct Bytes {
  const uint8_t *data;
  size_t size;
};

// Where the bytes of an image are. Its uri is empty in the document that tinygltf sees.
struct ImageOutline {
  uint64_t index;                  // in the document
  uint64_t view;                   // no_view: in the uri
  std::string_view mime_type, uri; // as written, between the quotes
};
constexpr uint64_t no_view = UINT64_MAX;

// What a file holds, apart from what tinygltf reads.
struct Outline {
  explicit Outline(Budget &budget)
      : json(Counted<char>(budget)), buffers(Counted<Bytes>(budget)),
        decoded(Counted<Vector<uint8_t>>(budget)), images(Counted<ImageOutline>(budget)) {}

  bool binary = false;   // a GLB
  Vector<char> json;     // the document without buffers and all else that is not read
  Vector<Bytes> buffers; // BIN chunk and decoded data URIs
  Vector<Vector<uint8_t>> decoded;
  Vector<ImageOutline> images;            // those whose bytes are in the file
  uint64_t tree_size = 0, model_size = 0; // what parsing takes at most, and what stays of it
};

struct Document;

// Checks the container and the JSON text: lengths, grammar, depth, number of values; that no unknown
// extension is required, that every buffer is inside the file, every buffer view inside its buffer, that
// views and accessors exist where tinygltf would follow them; and that parsing stays in the budget. tinygltf
// opens files that a uri names, copies buffers, recurses without bound, and spends kilobytes on an empty
// object. Fills the outline, and gives the document's arrays the room that they need.
void make_outline(const Bytes &file, const tw_read_limits &limits, Document &document);

// The bytes of base64 text as far as it goes, "\/" being a slash as JSON may write it. rest: what stands
// behind it.
Vector<uint8_t> decode_base64(std::string_view written, Budget &budget, std::string_view *rest = nullptr);

// A JSON string as it is meant; `written`: what stands between the quotes.
std::string unescape(std::string_view written);

// ---- accessors -----------------------------------------------------------------------------------

// A view of one accessor's elements (glTF 2.0, section 3.6.2), checked: whoever holds one may read any of
// them.
class Elements {
public:
  uint32_t count() const { return count_; }
  uint32_t width() const { return width_; }
  int component_type() const { return component_type_; }
  bool normalized() const { return normalized_; }

  // Element i as floats: out[width]. Throws Refusal on a value that is not finite.
  void read(uint32_t i, float *out) const;
  // The same; false in place of the refusal, out then holds all 0.
  bool read_finite(uint32_t i, float *out) const;

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

  const uint8_t *find(uint32_t i) const;
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

struct Document {
  Document(tw_model *target, tw_quads how, uint64_t memory)
      : budget(memory), outline(budget), model(target), quads(how) {}

  Budget budget;
  Outline outline;
  tinygltf::Model source;
  tw_model *model;
  tw_quads quads;
  // Elements of a file may be named by many others; these keep a small file from taking long to read.
  uint64_t corners_left = 0, values_left = 0;
  // For the warnings.
  size_t skipped_primitives = 0, degenerate_faces = 0, partly_textured = 0;
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

// A name as clients can use it, nullptr for an empty one. Control characters become blanks.
const char *copy_name(Document &document, const std::string &name);

// What the model holds comes from the document's parts, each step on its own; all throw Refusal.
void read_assets(Document &document);                       // materials, textures, samplers, images
void read_meshes(Document &document, Accessors &accessors); // after read_assets
void read_nodes(Document &document);                        // and the scene
void read_skins(Document &document, Accessors &accessors);  // after read_nodes
void read_clips(Document &document, Accessors &accessors);  // after read_meshes and read_nodes

// The set of texture coordinates that a material's normal map lies on, else that of its clear coat; -1
// without either.
int normal_map_uvs(const tinygltf::Material &material);

} // namespace gltf

#endif
