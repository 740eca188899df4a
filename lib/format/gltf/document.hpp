// Reading a glTF document into a tw_model: refusals, the memory budget, the outline that is checked before
// tinygltf parses, accessors, and the steps of reading.
#ifndef TWEEND_GLTF_DOCUMENT_HPP
#define TWEEND_GLTF_DOCUMENT_HPP

#include <algorithm>
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
#include "losses.h"
#include "tweend/format.h"
#include "tweend/json_text.h"
#include "weld.h"

namespace gltf {

// ---- refusals ------------------------------------------------------------------------------------

// An error of reading: an exception that stays inside lib/format/gltf and becomes a tw_error in its C
// functions.
struct Refusal {
  tw_status status;
  std::string pointer; // RFC 6901, into the glTF document; "" where there is no place
  std::string detail;
};

// Joins the parts as text.
template <typename... Parts> std::string text(const Parts &...parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

template <typename... Parts>
[[noreturn]] void refuse(tw_status status, std::string pointer, const Parts &...parts) {
  throw Refusal{status, std::move(pointer), text(parts...)};
}

// Escapes a member's name for a JSON pointer (RFC 6901).
std::string pointer_part(const std::string &name);

// Replaces characters that cannot be shown in text from the document.
std::string printable(std::string text);

// Fills a tw_error from a refusal; returns the status.
tw_status report(const Refusal &refusal, tw_error *error);

// ---- memory --------------------------------------------------------------------------------------

// Bytes that reading may still take, of those that tw_reading_size allows. To take more throws a Refusal.
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

// Takes bytes from a budget while it lives.
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

// Charges steps of work. Throws bad_alloc where the result is not wanted any more, of which the meter tells.
inline void work(uint64_t steps) {
  if (!tw_work(steps)) throw std::bad_alloc();
}

// An allocator that takes from a budget.
template <typename T> struct Counted {
  using value_type = T;
  using propagate_on_container_move_assignment =
      std::true_type; // memory moves with its budget: that never throws
  Budget *budget;

  explicit Counted(Budget &from) : budget(&from) {}
  template <typename U> Counted(const Counted<U> &other) : budget(other.budget) {}
  T *allocate(size_t count) {
    budget->take(count * sizeof(T));
    try {
      return std::allocator<T>().allocate(count);
    } catch (...) {
      budget->give(count * sizeof(T));
      throw;
    }
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
// All of this takes only text that tw_json_check has passed.

// Iterates over the items of an object or array. Each is a step of work.
class Items {
public:
  explicit Items(const char *container) {
    work(1);
    more_ = tw_json_first(container, &item_);
  }
  bool more() const { return more_; }
  void next() {
    work(1);
    more_ = tw_json_next(tw_json_skip(item_.value), &item_);
  }
  std::string_view key() const { return {item_.key, item_.key_size}; }
  const char *value() const { return item_.value; }

private:
  tw_json_item item_;
  bool more_;
};

inline std::string_view value_text(const char *value) {
  return {value, static_cast<size_t>(tw_json_skip(value) - value)};
}

// The text between the quotes of a string, escapes undecoded.
inline std::string_view string_of(const char *value) {
  std::string_view quoted = value_text(value);
  return quoted.substr(1, quoted.size() - 2);
}

inline bool is_escaped(std::string_view key) {
  return key.find('\\') != std::string_view::npos;
}

// Calls element(index, value) for each element of an array; does nothing for nullptr and values that are no
// array.
template <typename Element> void each(const char *array, Element element) {
  size_t index = 0;
  if (array && *array == '[')
    for (Items i(array); i.more(); i.next()) element(index++, i.value());
}

// A whole number from 0 to 2^53, all of which a double holds; nothing for nullptr and any other value.
std::optional<uint64_t> whole_number(const char *value);

// How the bytes of a buffer view are compressed by meshopt: the member of its extensions; nullptr: they are
// not.
const char *compression_of(const char *view);

// An index as tinygltf has it; -1 for nullptr and any other value.
int index_of(const char *value);

// Whether a list of words, a blank between two, has this word.
bool has_word(std::string_view list, std::string_view word);

// Decodes the escapes of a JSON string. written: the text between its quotes.
std::string unescape(std::string_view written);

// The text with the letters A to Z in lower case.
std::string in_lower_case(std::string_view text);

// Whether a URI begins with a scheme, given in lower case with what follows it ("data:"): RFC 3986 takes
// upper case for the same.
bool has_scheme(std::string_view uri, std::string_view scheme);

// Decodes base64 text up to the first other character; JSON may write a slash as "\/". rest: the text from
// there on.
Vector<uint8_t> decode_base64(std::string_view written, Budget &budget, std::string_view *rest = nullptr);

struct Bytes {
  const uint8_t *data;
  size_t size;
};

// The media type of an image by its first bytes, as a string literal; nullptr if unknown.
const char *image_type(const Bytes &file);

// Builds JSON text.
class Text {
protected:
  explicit Text(Budget &budget) : text_(budget) {}

  Vector<char> text_;

  void put(std::string_view text) { text_.insert(text_.end(), text.begin(), text.end()); }

  // Puts a comma before a member or an element, unless it is the first.
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

// A compressed view, decoded into a buffer of its own.
struct DecodedView {
  size_t view, buffer;
};

// The fate of members and extensions that are not as their specification says.
constexpr char not_its_type[] = "left out, as this is not of the type that glTF gives it",
               unfit_extension[] =
                   "this is not as the extension's specification says: it is read as far as it is";

// What is passed over because it is not as its specification says, by kind.
struct Misfit {
  const char *what;  // a string literal: the sentence behind the place
  std::string place; // JSON pointer to the first
  size_t count;
};

// What the checks before tinygltf find in a file.
struct Outline {
  explicit Outline(Budget &budget)
      : whole(budget), json(budget), buffers(budget), decoded(budget), images(budget), decoded_views(budget) {
  }

  bool binary = false; // a GLB
  const char *root;    // the JSON object, of the file or of `whole`
  // The document without blanks, or with its integers written as such; empty if it is read as it is.
  Vector<char> whole;
  Vector<char> json;     // the document without buffers and all else that is not read
  Vector<Bytes> buffers; // BIN chunk, decoded data URIs and views
  Vector<Vector<uint8_t>> decoded;
  Vector<ImageOutline> images;            // those whose bytes are in the file
  Vector<DecodedView> decoded_views;      // replace what the document says of these views
  uint32_t link_count = 0;                // images on the web
  uint64_t tree_size = 0, model_size = 0; // the most bytes that parsing takes for a while, and keeps
  tw_losses losses = {};                  // of the whole document

  // Notes that something is passed over, as tw_lose does.
  void lose(const char *one, const char *many, uint64_t count = 1) { tw_lose(&losses, one, many, count, 0); }

  std::vector<Misfit> misfits; // by their first occurrence

  // Notes something that is not as its specification says. place: a function that makes its JSON pointer,
  // which is called for the first of a kind alone.
  template <typename Place> void misfit(const char *what, Place place) {
    auto found = std::find_if(misfits.begin(), misfits.end(),
                              [&](const Misfit &kind) { return std::string_view(kind.what) == what; });
    if (found == misfits.end())
      misfits.push_back({what, place(), 1});
    else
      found->count++;
  }
};

// Members that are read, a blank between two. tinygltf sees no others; all others are kept for answers.
constexpr char node_members[] = "name children mesh skin matrix translation rotation scale weights",
               mesh_members[] = "name weights primitives",
               primitive_members[] = "attributes indices material mode targets",
               skin_members[] = "name joints skeleton inverseBindMatrices",
               animation_members[] = "name channels samplers", channel_members[] = "sampler target",
               target_members[] = "node path", sampler_members[] = "input output interpolation",
               scene_members[] = "nodes";

struct Document;

// The parts of a file; a view of its bytes.
struct Container {
  bool binary;
  std::string_view json;
  Bytes bin;  // size 0: there is no BIN chunk
  Bytes tail; // of a GLB: what stands behind these chunks, of which the first bytes belong to the GLB
  uint64_t tail_inside;
};

// Opens a GLB or a JSON file, and notes what of it is passed over. The JSON text is not checked.
Container open_container(const Bytes &file, Outline &outline);

// Copies a document without the blanks between its values if they are more than half of it: the walks over
// the text are many, one for each level that it is nested. Otherwise `out` stays empty.
void drop_blanks(const char *root, Vector<char> &out);

// Copies a document with numbers like 36.0 written as integers where glTF has integers. Returns how many
// there are; without any, `out` stays empty.
size_t write_integers(const char *root, Budget &budget, Vector<char> &out);

// Checks the container and the JSON text: lengths, grammar, depth, number of values; that no unknown
// extension is required; that every buffer is inside the file, every buffer view inside its buffer; that
// views and accessors exist where tinygltf would follow them; and that parsing stays in the budget. All this
// because tinygltf opens files that a uri names, copies buffers, recurses without bound, and spends kilobytes
// on an empty object. Fills the outline, and reserves the arrays of the document.
void make_outline(const Bytes &file, Document &document);

// Copies the members that are read of a checked document into the outline, and sums up what parsing the copy
// takes. Refuses what exceeds the budget.
void copy_for_parser(const char *root, Document &document);

// ---- accessors -----------------------------------------------------------------------------------

// Bytes of a component; 0 for a type that glTF does not have.
uint32_t component_size(int component_type);

// A view of one accessor's elements (glTF 2.0, section 3.6.2). It is checked, so that any element may be
// read.
class Elements {
public:
  uint32_t count() const { return count_; }
  uint32_t width() const { return width_; }
  int component_type() const { return component_type_; }
  bool normalized() const { return normalized_; }
  // False: all elements are 0, without data in the file.
  bool has_data() const { return data_ || sparse_count_ > 0; }

  // Element i as floats: out[width], a step of work. Throws Refusal on a value that is not finite.
  void read(uint32_t i, float *out) const;
  // As read, but returns false and all 0 instead of the refusal, and charges no work: it never throws.
  bool read_finite(uint32_t i, float *out) const;

  // Copies the undecoded bytes of element i, a step of work: out[width * size of a component].
  void copy(uint32_t i, uint8_t *out) const;

  // Element i of an accessor of unsigned integers, a step of work; 0 for other types.
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

  // The bytes that replace element i, or nullptr.
  const uint8_t *find_sparse(uint32_t i) const;

  // The bytes of element i; nullptr if it is 0.
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
  uint64_t sparse_left_; // sparse indices that may still be checked, as accessors may share their bytes

  Elements check(size_t index);
  void check_sparse(size_t index, Elements &elements);
  const uint8_t *check_range(int view, uint64_t offset, uint64_t count, uint64_t element_size,
                             uint64_t *stride, const std::string &pointer) const;
};

// ---- reading -------------------------------------------------------------------------------------

// Tells which vertices of the file something shows, by their accessors of positions, which meshes may share.
class ShownVertices {
public:
  explicit ShownVertices(Budget &budget) : budget_(budget) {}

  // elements: [count] of `positions`, all different.
  void add(const Elements &positions, const uint32_t *elements, size_t count);
  void add_all(const Elements &positions) { add(positions, nullptr, positions.count()); }

  // How many vertices nothing shows, of the accessors that were added.
  uint64_t missing() const;

private:
  static constexpr uint64_t entry_size = 96; // in the map

  struct Accessor {
    uint32_t left;         // elements that nothing shows yet
    Vector<bool> is_shown; // [elements]; empty while none or all are shown
  };
  Budget &budget_;
  std::map<const Elements *, Accessor> accessors_;
};

// The text of a primitive; nullptr where there is none.
struct PrimitiveText {
  const char *preserved;  // members that are not read, see gltf.h
  const char *attributes; // in the document's text
  bool bears_ngons;       // FB_ngon_encoding
};

struct MeshText {
  const char *tags; // extras.tweend in the document's text, or nullptr
  Vector<PrimitiveText> primitives;
};

// A channel of an animation that moves a node by KHR_animation_pointer, which tinygltf does not see.
struct PointedChannel {
  uint32_t node;
  tw_path path;
  int sampler;
  std::string place;     // the channel's JSON pointer
  const char *preserved; // of the channel and the sampler, or nullptr
  // (weight, sampler) of several channels that move one weight each, at the same times and with one
  // interpolation; the other weights stay at rest. Empty: the sampler moves all.
  std::vector<std::pair<uint32_t, int>> weights = {};
};

// Where a track of a clip comes from in the document.
struct TrackPlace {
  uint32_t channel;  // of the animation
  int input, output; // accessors
};
using TrackPlaces = std::vector<std::vector<TrackPlace>>; // [clip][track]

struct Document {
  Document(tw_model *target, tw_quads how, tw_weld joining, uint64_t memory)
      : budget(memory), outline(budget), mesh_texts(budget), channel_texts(budget), pointed_channels(budget),
        slots(budget), normal_maps(budget), shown(budget), model(target), quads(how), weld(joining) {}

  Budget budget;
  Outline outline;
  tinygltf::Model source;
  Vector<MeshText> mesh_texts;                // of each mesh
  Vector<Vector<const char *>> channel_texts; // of each animation's tracks: what is kept of them, or nullptr
  Vector<Vector<PointedChannel>> pointed_channels; // of each animation
  Vector<tw_material_slot> slots;                  // see tw_model
  std::map<std::pair<int32_t, std::string_view>, size_t> slot_numbers;
  Vector<int> normal_maps; // of each material: the UV set of its normal map, -1 without one
  ShownVertices shown;
  tw_model *model;                  // keep_parts allocates its arrays
  tw_gltf_assets *assets = nullptr; // the model's
  tw_quads quads;
  tw_weld weld;
  uint64_t json_values = 0; // the most that the document may have; 0: any number
  // Corners and values that may still be read. Many elements may name the same accessor, and a small file
  // must not take long to read.
  uint64_t corners_left = 0, values_left = 0;
  void spend_values(uint64_t count, const std::string &pointer, const char *what) {
    if (count > values_left) refuse(TW_LIMIT, pointer, what, " are too many for a file of this size");
    values_left -= count;
  }
  // For the warnings.
  size_t degenerate_faces = 0, partly_textured = 0;
  tw_welded welded = {};
  std::set<std::string> attribute_warnings;
  // Notes what became of an attribute, for a warning.
  void note(const std::string &fate) {
    if (attribute_warnings.size() <= TW_WARNINGS_MAX) attribute_warnings.insert(fate); // one more: it says so
  }

  TrackPlaces track_places; // of all tracks that are read

  // The sets of groups of all meshes.
  std::map<std::string, uint32_t> group_numbers;
  std::vector<const char *> group_names;
};

// Allocates [count] elements in the model's arena, uninitialised. Throws bad_alloc.
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

// Whether a channel animates the translation, rotation, scale or weights of a node. tinygltf sees no other
// channels.
bool is_track(const char *channel);

// Copies a name into the model; nullptr for an empty name. Control characters become blanks.
const char *copy_name(Document &document, const std::string &name);

// Copies the name of an object of the document's text; nullptr without one.
const char *copy_name_of(Document &document, const char *object);

// The steps that fill the model from the document, in this order; all throw Refusal.
void keep_parts(Document &document, Accessors &accessors);  // allocates parts, keeps what is not read
void read_assets(Document &document);                       // after keep_parts: references, bytes of images
void read_meshes(Document &document, Accessors &accessors); // after read_assets
void read_nodes(Document &document);                        // after read_meshes; and the scenes
void read_humanoid(Document &document);                     // after read_nodes
void read_face(Document &document);                         // after read_humanoid
void read_skins(Document &document, Accessors &accessors);  // after read_nodes
void read_clips(Document &document, Accessors &accessors);  // after read_meshes and read_nodes

} // namespace gltf

#endif
