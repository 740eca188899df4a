// The checks before tinygltf parses: the chunks of a GLB file (glTF 2.0, section 4.4), and the JSON text.
#include "gltf/document.hpp"

#include <algorithm>
#include <cstring>
#include <tuple>

#include "meshopt_read.h"
#include "word.h"

namespace gltf {

namespace {

// ---- containers ------------------------------------------------------------------------------------

constexpr uint32_t chunk_json = 0x4E4F534A, chunk_bin = 0x004E4942;
constexpr size_t header_size = 12, chunk_header_size = 8;

// tinygltf takes sizes as unsigned int.
constexpr uint64_t size_max = INT32_MAX;

[[noreturn]] void refuse_container(const std::string &detail) {
  refuse(TW_SYNTAX, "", detail);
}

struct Chunk {
  uint32_t type;
  const uint8_t *data;
  uint64_t size, end; // end: offset in the file
};

// Whether a chunk of a type that glTF has may begin here.
bool begins_chunk(const uint8_t *bytes, uint64_t length, uint64_t offset) {
  return offset == length ||
         (length - offset >= chunk_header_size && tw_read_u32(bytes + offset + 4) == chunk_bin);
}

// Lengths that are no multiple of 4 break the format, but their meaning is plain: the next chunk follows at
// once, or behind padding that the length does not count.
Chunk read_chunk(const uint8_t *bytes, uint64_t length, uint64_t offset, Outline &outline) {
  if (length - offset < chunk_header_size) refuse_container("the GLB ends inside a chunk header");
  Chunk chunk = {tw_read_u32(bytes + offset + 4), bytes + offset + chunk_header_size,
                 tw_read_u32(bytes + offset), 0};
  if (chunk.size > length - offset - chunk_header_size)
    refuse_container(text("a GLB chunk of ", chunk.size, " bytes goes past the end of the file"));
  chunk.end = offset + chunk_header_size + chunk.size;
  uint64_t aligned = (chunk.end + 3) / 4 * 4;
  if (chunk.size % 4 != 0)
    outline.lose("chunk of the GLB has a length that is no multiple of 4: it is read",
                 "chunks of the GLB have a length that is no multiple of 4: they are read");
  if (aligned <= length && !begins_chunk(bytes, length, chunk.end)) chunk.end = aligned;
  return chunk;
}

// Passes over what stands behind the first two chunks. Chunks of other types are ignored, but they too must
// fit.
void skip_chunks(const uint8_t *bytes, uint64_t length, uint64_t offset, Outline &outline) {
  while (offset < length) {
    if (length - offset < 4) {
      outline.lose("byte behind the GLB is left out", "bytes behind the GLB are left out", length - offset);
      return;
    }
    offset = read_chunk(bytes, length, offset, outline).end;
    outline.lose("chunk of the GLB is left out: only the first ones, JSON and BIN, are read",
                 "chunks of the GLB are left out: only the first ones, JSON and BIN, are read");
  }
}

// The JSON text without zeros behind it: some pad its chunk, or end their file, with these in place of
// blanks.
std::string_view drop_zeros(std::string_view json, Outline &outline) {
  size_t size = json.size();
  while (size > 0 && json[size - 1] == '\0') size--;
  outline.lose("zero byte behind the JSON text is left out: blanks belong there",
               "zero bytes behind the JSON text are left out: blanks belong there", json.size() - size);
  return json.substr(0, size);
}

Container open_binary(const Bytes &file, Outline &outline) {
  if (file.size < header_size + chunk_header_size) refuse_container("the GLB is too short for its headers");
  uint32_t version = tw_read_u32(file.data + 4), length = tw_read_u32(file.data + 8);
  if (version != 2) refuse(TW_UNSUPPORTED, "", "GLB version ", version, ": only version 2 can be read");
  if (length > file.size || length < header_size + chunk_header_size)
    refuse_container(text("the GLB says that it has ", length, " bytes, and has ", file.size));
  outline.lose("byte behind the GLB is left out", "bytes behind the GLB are left out", file.size - length);
  Chunk json = read_chunk(file.data, length, header_size, outline);
  if (json.type != chunk_json) refuse_container("the first GLB chunk is not JSON");
  std::string_view json_text(reinterpret_cast<const char *>(json.data), json.size);
  Container container = {true, drop_zeros(json_text, outline), {nullptr, 0}, {}, 0};
  auto end_at = [&](uint64_t end) {
    container.tail = {file.data + end, static_cast<size_t>(file.size - end)};
    container.tail_inside = length - end;
  };
  end_at(json.end);
  if (json.end == length) return container;
  Chunk bin = read_chunk(file.data, length, json.end, outline);
  if (bin.type != chunk_bin) refuse_container("the second GLB chunk is not BIN");
  container.bin = {bin.data, bin.size};
  end_at(bin.end);
  skip_chunks(file.data, length, bin.end, outline);
  return container;
}

// The place of an object: an element of one of the root's arrays, or the root itself. Its text is made only
// for a refusal.
struct Place {
  const char *array; // "" for the root
  uint64_t index;
  std::string pointer(std::string_view member) const {
    std::string_view slash = member.empty() ? "" : "/"; // "/" alone would be the root's member ""
    return *array ? text("/", array, "/", index, slash, member) : text(slash, member);
  }
};

// Checks that a value is an object, that members of these names, on which the checks rely, occur only once,
// and that no name is written with escapes: the parser must not see another member than the checks.
void check_object(Place place, const char *value, std::string_view names) {
  if (*value != '{') refuse(TW_INVALID, place.pointer(""), "this must be an object");
  std::vector<std::string_view> seen;
  for (Items i(value); i.more(); i.next()) {
    if (is_escaped(i.key()))
      refuse(TW_UNSUPPORTED, place.pointer(""), "a member's name is written with an escape");
    if (!has_word(names, i.key())) continue;
    if (std::find(seen.begin(), seen.end(), i.key()) != seen.end())
      refuse(TW_SYNTAX, place.pointer(i.key()), "the member stands twice");
    seen.push_back(i.key());
  }
}

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

// The whole number that a member holds; `absent` without such a member.
uint64_t integer_of(const char *object, const char *member, Place place, uint64_t absent = 0) {
  const char *value = tw_json_member(object, member);
  return value ? integer(value, place, member) : absent;
}

// The text between the quotes of a member; empty if it is no string.
std::string_view string_member(const char *object, const char *member) {
  const char *value = tw_json_member(object, member);
  return value && *value == '"' ? string_of(value) : std::string_view();
}

// Whether a document may require an extension: it is read, or it only concerns what passes through.
bool is_supported(std::string_view extension) {
  static constexpr std::string_view names[] = {"KHR_mesh_quantization",
                                               "FB_ngon_encoding",
                                               "KHR_texture_transform",
                                               "KHR_texture_basisu",
                                               "EXT_texture_webp",
                                               "EXT_texture_avif",
                                               "MSFT_texture_dds",
                                               "KHR_lights_punctual",
                                               "EXT_mesh_gpu_instancing",
                                               "KHR_animation_pointer",
                                               "EXT_meshopt_compression",
                                               "KHR_meshopt_compression",
                                               "KHR_node_visibility",
                                               "KHR_xmp_json_ld",
                                               "VRM",
                                               "VRMC_vrm",
                                               "VRMC_vrm_animation",
                                               "VRMC_materials_mtoon"};
  if (extension.substr(0, 14) == "KHR_materials_") return true;
  return std::find(std::begin(names), std::end(names), extension) != std::end(names);
}

// The length of the head of a data URI of a type that tinygltf knows, up to its comma; 0 for any other uri.
// any_type: of any data URI in base64. Scheme, media type and `base64` may be in upper case.
size_t data_head(std::string_view uri, bool any_type = false) {
  std::string head;
  for (size_t i = 0; i < uri.size() && head.size() < 128; i++) {
    if (uri[i] == '\\' && i + 1 < uri.size() && uri[i + 1] == '/') continue;
    head += uri[i];
    if (uri[i] != ',') continue;
    head = in_lower_case(head);
    bool is_base64 = head.compare(0, 5, "data:") == 0 && head.find(";base64,") != std::string::npos;
    return tinygltf::IsDataURI(head) || (any_type && is_base64) ? i + 1 : 0;
  }
  return 0;
}

// Walks over the document once, and keeps what its parts must be checked against.
class Checker {
public:
  Checker(const Container &container, Budget &budget, Outline &out)
      : container_(container), budget_(budget), out_(out), buffers_(budget), views_(budget),
        accessor_views_(budget), indices_(budget), read_views_(budget) {}

  void run(const char *root) {
    std::string names;
    for (const Part &part : parts) names += part.name, names += ' ';
    check_object({"", 0}, root, names);
    for (Items i(root); i.more(); i.next())
      for (const Part &part : parts)
        if (i.key() == part.name) elements(part, i.value());
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
    const char *compressed = nullptr; // the object of the meshopt extension, or nullptr
  };
  struct Indices {
    uint64_t mesh, primitive, accessor;
  };
  struct Part {
    const char *name;
    uint64_t most; // 0: any number
    void (Checker::*element)(uint64_t index, const char *value);
  };

  const Container &container_;
  Budget &budget_;
  Outline &out_;
  Vector<Buffer> buffers_;
  Vector<View> views_;
  Vector<uint64_t> accessor_views_; // no_view for one without
  Vector<Indices> indices_;
  Vector<uint64_t> read_views_;  // views that accessors and images name, in any order, some several times
  std::string_view unsupported_; // the first required extension that is not supported
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

  void buffer(uint64_t index, const char *value) {
    Place place = {"buffers", index};
    check_object(place, value, "byteLength uri extensions");
    Buffer buffer;
    buffer.length = integer_of(value, "byteLength", place);
    buffer.is_fallback = says_fallback(compression_of(value));
    if (const char *uri = tw_json_member(value, "uri")) {
      if (*uri != '"') refuse(TW_INVALID, place.pointer("uri"), "a uri must be a string");
      buffer.uri = string_of(uri);
    }
    buffers_.push_back(buffer);
  }

  static bool says_fallback(const char *extension) {
    const char *value = tw_json_member(extension, "fallback");
    return value && *value == 't';
  }

  // The place of a view's bytes, or of the compressed bytes in its extension.
  static View read_view(const char *object, Place place) {
    return {integer_of(object, "buffer", place), integer_of(object, "byteOffset", place),
            integer_of(object, "byteLength", place), nullptr};
  }

  void view(uint64_t index, const char *value) {
    Place place = {"bufferViews", index};
    check_object(place, value, "buffer byteOffset byteLength extensions");
    views_.push_back(read_view(value, place));
    views_.back().compressed = compression_of(value);
  }

  // Decodes a compressed view. Refusals point to the view, also for members of its extension.
  void decode_view(size_t i) {
    Place place = {"bufferViews", i};
    const char *value = views_[i].compressed;
    check_object(place, value, "buffer byteOffset byteLength byteStride count mode filter");
    const View packed = read_view(value, place);
    const tw_meshopt_view form = {
        integer_of(value, "count", place), integer_of(value, "byteStride", place),
        static_cast<tw_meshopt_mode>(word(value, "mode", "ATTRIBUTES TRIANGLES INDICES", place)),
        static_cast<tw_meshopt_filter>(
            word(value, "filter", "NONE OCTAHEDRAL QUATERNION EXPONENTIAL COLOR", place))};
    tw_error error = {};
    if (packed.buffer >= buffers_.size())
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes are in no buffer");
    const Bytes bytes = out_.buffers[static_cast<size_t>(packed.buffer)];
    if (packed.offset > bytes.size || packed.length > bytes.size - packed.offset)
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes go past their buffer");
    if (tw_meshopt_check(&form, views_[i].length, &error) != TW_OK)
      refuse(TW_INVALID, place.pointer(""), error.detail);
    if (views_[i].length / TW_MESHOPT_EXPANSION_MAX > packed.length)
      refuse(TW_INVALID, place.pointer(""), "the compressed bytes are too few for what they say to hold");
    budget_.place = place.pointer("");
    Vector<uint8_t> decoded(budget_, static_cast<size_t>(views_[i].length), 0);
    if (tw_meshopt_decode(&form, bytes.data + packed.offset, static_cast<size_t>(packed.length),
                          decoded.data(), &error) != TW_OK)
      refuse(TW_INVALID, place.pointer(""), error.detail);
    out_.decoded.push_back(std::move(decoded));
    out_.decoded_views.push_back({i, out_.buffers.size()});
    out_.buffers.push_back({out_.decoded.back().data(), out_.decoded.back().size()});
  }

  // The number of the word, in a list with a blank between two, that a member holds; 0 without the member.
  static int word(const char *object, const char *member, std::string_view words, Place place) {
    if (!tw_json_member(object, member)) return 0;
    std::string_view wanted = string_member(object, member);
    for (int i = 0; !words.empty(); i++) {
      std::string_view first = words.substr(0, words.find(' '));
      if (first == wanted) return i;
      words.remove_prefix(std::min(words.size(), first.size() + 1));
    }
    refuse(TW_UNSUPPORTED, place.pointer(""), "the mode or filter is unknown");
  }

  void accessor(uint64_t index, const char *value) {
    Place place = {"accessors", index};
    check_object(place, value, "bufferView");
    accessor_views_.push_back(integer_of(value, "bufferView", place, no_view));
    read_views_.push_back(accessor_views_.back());
    const char *sparse = tw_json_member(value, "sparse");
    for (const char *part : {"indices", "values"})
      if (const char *view = tw_json_member(tw_json_member(sparse, part), "bufferView"))
        read_views_.push_back(whole_number(view).value_or(no_view));
  }

  void mesh(uint64_t index, const char *value) {
    Place place = {"meshes", index};
    check_object(place, value, "primitives");
    const char *primitives = tw_json_member(value, "primitives");
    if (primitives && *primitives != '[')
      refuse(TW_INVALID, place.pointer("primitives"), "this must be an array");
    each(primitives, [&](size_t i, const char *primitive) {
      check_object(place, primitive, "indices");
      const char *indices = tw_json_member(primitive, "indices");
      if (indices && *indices != '-') indices_.push_back({index, i, integer(indices, place, "primitives")});
    });
  }

  // Notes where the bytes of an image are, if they are in the file.
  void image(uint64_t index, const char *value) {
    Place place = {"images", index};
    check_object(place, value, "bufferView mimeType uri");
    ImageOutline image = {index, integer_of(value, "bufferView", place, no_view),
                          string_member(value, "mimeType"), string_member(value, "uri")};
    read_views_.push_back(image.view);
    bool has_uri = tw_json_member(value, "uri");
    if (image.view != no_view && has_uri)
      refuse(TW_INVALID, place.pointer(""), "an image has a bufferView or a uri, not both");
    if (image.view != no_view || data_head(image.uri) > 0)
      out_.images.push_back(image);
    else if (has_uri)
      link(image.uri, place);
  }

  // An image on the web stays there. A file beside the document is refused: it must not be opened here, and
  // without it the model would lose the image.
  void link(std::string_view uri, Place place) {
    std::string address = unescape(uri);
    if (has_scheme(address, "data:")) return;
    if (!has_scheme(address, "http://") && !has_scheme(address, "https://")) refuse_absent(address, place);
    out_.link_count++;
  }

  [[noreturn]] void refuse_absent(const std::string &name, Place place) {
    refuse(TW_UNSUPPORTED, place.pointer("uri"), "the file \"", name.substr(0, 100),
           "\" was not sent: send it along in one form, or put its bytes inside");
  }

  // Notes the first extension that is not supported. check_outline reports it before all else: it may be the
  // cause of the other faults.
  void required_extension(uint64_t index, const char *value) {
    if (*value != '"')
      refuse(TW_INVALID, text("/extensionsRequired/", index), "an extension is named by a string");
    if (!unsupported_.empty() || is_supported(string_of(value))) return;
    unsupported_ = string_of(value);
    unsupported_index_ = index;
  }

  void animation(uint64_t index, const char *value) {
    Place place = {"animations", index};
    check_object(place, value, "channels samplers");
    const char *channels = tw_json_member(value, "channels");
    if (channels && *channels == '[') tracks_ += tw_json_count(channels);
    if (tracks_ > TW_TRACKS_MAX)
      refuse(TW_LIMIT, place.pointer("channels"), "with these there are ", tracks_, " channels, and at most ",
             int{TW_TRACKS_MAX}, " are read");
  }

  // ---- checks of one part against another

  void check_outline() {
    if (!unsupported_.empty())
      refuse(TW_UNSUPPORTED, text("/extensionsRequired/", unsupported_index_),
             "the document requires the extension ", unsupported_, ", which is not supported",
             unsupported_ == "KHR_draco_mesh_compression"
                 ? ": `gltf-transform copy IN OUT` writes the file without it"
                 : "");
    std::vector<bool> is_read = find_read_buffers(), is_fallback = find_fallback_buffers();
    for (size_t i = 0; i < buffers_.size(); i++) {
      if (is_read[i])
        open_buffer(i);
      else
        skip_buffer(is_fallback[i]);
    }
    for (size_t i = 0; i < views_.size(); i++) check_view(i);
    tell_idle_bytes();
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

  // Which buffers bytes lie in that are read: those of a view, compressed or not.
  std::vector<bool> find_read_buffers() const {
    std::vector<bool> is_read(buffers_.size());
    auto mark = [&](uint64_t buffer) {
      if (buffer < is_read.size()) is_read[static_cast<size_t>(buffer)] = true;
    };
    for (const View &view : views_)
      if (view.compressed) mark(whole_number(tw_json_member(view.compressed, "buffer")).value_or(0));
    for (uint64_t i : read_views_)
      if (i < views_.size() && !views_[static_cast<size_t>(i)].compressed)
        mark(views_[static_cast<size_t>(i)].buffer);
    return is_read;
  }

  // Which buffers would hold a view for readers that cannot decode its compressed bytes, whether they say so
  // or not. They may be nowhere.
  std::vector<bool> find_fallback_buffers() const {
    std::vector<bool> is_fallback(buffers_.size());
    for (const View &view : views_)
      if (view.compressed && view.buffer < buffers_.size())
        is_fallback[static_cast<size_t>(view.buffer)] = true;
    return is_fallback;
  }

  void skip_buffer(bool is_fallback) {
    out_.buffers.push_back({nullptr, 0});
    if (!is_fallback)
      out_.lose("buffer is left out: nothing that is read lies in it",
                "buffers are left out: nothing that is read lies in them");
  }

  void open_buffer(size_t i) {
    const Buffer &buffer = buffers_[i];
    Place place = {"buffers", i};
    if (buffer.length == 0)
      refuse(TW_INVALID, place.pointer("byteLength"), "a buffer needs at least one byte");
    if (!buffer.uri && buffer.is_fallback) { // what it would hold is compressed in another buffer
      out_.buffers.push_back({nullptr, 0});
      return;
    }
    Bytes bytes = buffer.uri ? decode(*buffer.uri, place) : take_bin(i, place);
    if (bytes.size < buffer.length)
      refuse(TW_INVALID, place.pointer("byteLength"),
             buffer.uri ? "the data URI holds " : "the BIN chunk has only ", bytes.size, " bytes, not ",
             buffer.length);
    const uint64_t behind = bytes.size - buffer.length, padding = buffer.uri ? 0 : 3;
    out_.lose("byte behind the length of a buffer is left out",
              "bytes behind the lengths of buffers are left out", behind > padding ? behind : 0);
    out_.buffers.push_back({bytes.data, static_cast<size_t>(buffer.length)});
  }

  Bytes decode(std::string_view uri, Place place) {
    size_t head = data_head(uri, true);
    if (head > 0 && data_head(uri) == 0)
      out_.lose("data URI of a buffer has another type than those of glTF: it is read",
                "data URIs of buffers have another type than those of glTF: they are read");
    if (head == 0) {
      std::string name = unescape(uri);
      if (has_scheme(name, "data:"))
        refuse(TW_UNSUPPORTED, place.pointer("uri"), "the data URI of a buffer must be base64, as ",
               "data:application/octet-stream;base64, says");
      refuse_absent(name, place);
    }
    budget_.place = place.pointer("uri");
    std::string_view rest;
    out_.decoded.push_back(decode_base64(uri.substr(head), budget_, &rest));
    if (rest.find_first_not_of('=') != std::string_view::npos)
      refuse(TW_INVALID, place.pointer("uri"), "the data URI is not base64");
    return {out_.decoded.back().data(), out_.decoded.back().size()};
  }

  // The BIN chunk, which may be padded by up to three bytes.
  Bytes take_bin(uint64_t index, Place place) const {
    if (!container_.binary) refuse(TW_INVALID, place.pointer(""), "a buffer of a JSON file needs a uri");
    if (index != 0) refuse(TW_INVALID, place.pointer(""), "only the first buffer may be the BIN chunk");
    return container_.bin;
  }

  void check_indices(const Indices &indices) const {
    if (indices.accessor >= accessor_views_.size())
      refuse(TW_INVALID, text("/meshes/", indices.mesh, "/primitives/", indices.primitive, "/indices"),
             "there is no accessor ", indices.accessor);
    if (accessor_views_[indices.accessor] == no_view)
      refuse(TW_INVALID, text("/accessors/", indices.accessor), "indices need a buffer view");
  }

  void check_view(size_t i) {
    const View &view = views_[i];
    Place place = {"bufferViews", i};
    if (view.buffer >= buffers_.size())
      refuse(TW_INVALID, place.pointer("buffer"), "there is no such buffer");
    uint64_t size = buffers_[view.buffer].length;
    if (view.length == 0)
      out_.lose("buffer view has no bytes: nothing can be read of it",
                "buffer views have no bytes: nothing can be read of them");
    if (view.offset > size || view.length > size - view.offset)
      refuse(TW_INVALID, place.pointer("byteLength"), "the buffer view goes past the ", size,
             " bytes of its buffer");
  }

  // Tells of bytes of buffers that lie in no view. A few, or zeros, are padding.
  void tell_idle_bytes() {
    constexpr uint64_t padding = 3;
    struct Run {
      uint64_t buffer, begin, end;
    };
    Vector<Run> runs(budget_);
    auto add = [&](const View &view) {
      runs.push_back({view.buffer, view.offset, view.offset + view.length});
    };
    for (size_t i = 0; i < views_.size(); i++) {
      add(views_[i]);
      if (views_[i].compressed) add(read_view(views_[i].compressed, {"bufferViews", i}));
    }
    for (size_t i = 0; i < buffers_.size(); i++) runs.push_back({i, out_.buffers[i].size, UINT64_MAX});
    work(runs.size());
    std::sort(runs.begin(), runs.end(), [](const Run &a, const Run &b) {
      return std::tie(a.buffer, a.begin) < std::tie(b.buffer, b.begin);
    });
    uint64_t buffer = 0, end = 0, idle = 0;
    for (const Run &run : runs) {
      if (run.buffer != buffer) end = 0;
      buffer = run.buffer;
      if (buffer >= buffers_.size()) break; // decode_view refuses it
      const Bytes &bytes = out_.buffers[static_cast<size_t>(buffer)];
      uint64_t begin = std::min<uint64_t>(run.begin, bytes.size);
      if (begin > end) work((begin - end) / sizeof(uint64_t));
      while (begin > end && bytes.data[end] == 0) end++;
      while (begin > end && bytes.data[begin - 1] == 0) begin--;
      if (begin > end + padding) idle += begin - end;
      end = std::max(end, run.end);
    }
    out_.lose("byte of a buffer is left out: it lies in no buffer view",
              "bytes of buffers are left out: they lie in no buffer view", idle);
  }

  static constexpr Part parts[] = {
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
};

} // namespace

Container open_container(const Bytes &file, Outline &outline) {
  if (file.size > size_max) refuse(TW_LIMIT, "", "glTF files over 2 GiB are not read");
  if (file.size >= 4 && std::memcmp(file.data, "glTF", 4) == 0) return open_binary(file, outline);
  std::string_view json_text(reinterpret_cast<const char *>(file.data), file.size);
  return {false, drop_zeros(json_text, outline), {nullptr, 0}, {}, 0};
}

namespace {

// Where members are read. All else is kept as text, members that stand twice included.
constexpr char read_parts[] =
    "accessors animations asset buffers bufferViews meshes nodes scenes skins primitives attributes targets "
    "channels samplers target sparse indices values";

// How many members of objects that are read have the name of one before them. keys: scratch.
uint64_t count_repeated(const char *value, Vector<std::string_view> &keys) {
  uint64_t count = 0;
  const size_t first = keys.size();
  if (*value != '{' && *value != '[') return 0;
  for (Items i(value); i.more(); i.next()) {
    if (*value == '{') keys.push_back(i.key());
    if (*value == '[' || has_word(read_parts, i.key())) count += count_repeated(i.value(), keys);
  }
  auto begin = keys.begin() + static_cast<std::ptrdiff_t>(first);
  std::sort(begin, keys.end());
  for (auto key = begin; key != keys.end(); ++key) count += key != begin && *key == *(key - 1);
  keys.resize(first);
  return count;
}

} // namespace

void make_outline(const Bytes &file, Document &document) {
  Outline &outline = document.outline;
  Container container = open_container(file, outline);
  const tw_json_rules rules = {document.json_values, false};
  tw_error error = {};
  tw_status status = tw_json_check(container.json.data(), container.json.size(), &rules, &error);
  if (status != TW_OK) refuse(status, error.pointer, error.detail);
  const char *root = tw_json_root(container.json.data(), container.json.size());
  if (*root != '{') refuse(TW_SYNTAX, "", "a glTF document is a JSON object"); // else its end is unknown
  Vector<char> dense(document.budget);
  drop_blanks(root, dense);
  if (!dense.empty()) root = dense.data();
  outline.lose("integer is written with a fraction of 0: it is read",
               "integers are written with a fraction of 0: they are read",
               write_integers(root, document.budget, outline.whole));
  if (outline.whole.empty()) outline.whole = std::move(dense);
  if (!outline.whole.empty()) root = outline.whole.data();
  outline.root = root;
  outline.binary = container.binary;
  Checker(container, document.budget, outline).run(root);
  {
    Vector<std::string_view> keys(document.budget);
    outline.lose("member of an object stands twice: which of the two counts is not said",
                 "members of objects stand twice: which of the two counts is not said",
                 count_repeated(root, keys));
  }
  copy_for_parser(root, document);
}

} // namespace gltf
