// Joins a glTF document and the files that it names into one GLB. The files become the BIN chunk, behind that
// of a GLB, in the order in which buffers and images name them, so that the same files make the same bytes in
// whatever order they came. In the JSON only the places of bytes change: buffers, images[].uri, and the
// buffer and byteOffset of bufferViews and of their meshopt extensions; all else is copied as it is. Names of
// files are compared, nothing is opened.
#include "gltf/document.hpp"
#include "gltf/reserve.hpp"

#include <algorithm>
#include <cstring>

#include "word.h"

namespace gltf {

namespace {

// ---- names -----------------------------------------------------------------------------------------

// Decodes percent-encoding; a % that begins no escape stays.
std::string decode_percent(std::string_view uri) {
  std::string out;
  for (size_t i = 0; i < uri.size(); i++) {
    bool is_escape =
        uri[i] == '%' && i + 2 < uri.size() && tw_hex_digit(uri[i + 1]) >= 0 && tw_hex_digit(uri[i + 2]) >= 0;
    out += is_escape ? static_cast<char>(tw_hex_digit(uri[i + 1]) << 4 | tw_hex_digit(uri[i + 2])) : uri[i];
    if (is_escape) i += 2;
  }
  return out;
}

// Separates the steps of a path by single slashes, and drops the step ".".
std::string simplify_path(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  std::string out;
  for (size_t at = 0, end; at < path.size(); at = end + 1) {
    end = std::min(path.find('/', at), path.size());
    std::string step = path.substr(at, end - at);
    if (step.empty() || step == ".") continue;
    out += step;
    if (end < path.size()) out += '/';
  }
  return out;
}

std::string base_of(const std::string &path) {
  return path.substr(path.rfind('/') + 1);
}

// Finds files by their names.
class Names {
public:
  Names(const tw_named_file *files, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
      std::string path = simplify_path(files[i].name);
      bases_.emplace(base_of(path), i);
      paths_.emplace(path, i);
    }
  }

  // Finds the file that a uri names: by its path, else by its base name if only one file has it.
  uint32_t find(const std::string &uri, const std::string &pointer) const {
    std::string path = simplify_path(decode_percent(uri));
    auto found = paths_.equal_range(path);
    if (found.first == found.second) found = bases_.equal_range(base_of(path));
    if (found.first == found.second)
      refuse(TW_INVALID, pointer, "the file \"", path.substr(0, 100), "\" was not sent");
    if (std::next(found.first) != found.second)
      refuse(TW_INVALID, pointer, "several files are called \"", found.first->first.substr(0, 100), "\"");
    return found.first->second;
  }

  bool has(const std::string &uri) const {
    std::string path = simplify_path(decode_percent(uri));
    return paths_.count(path) + bases_.count(base_of(path)) > 0;
  }

private:
  std::multimap<std::string, uint32_t> paths_, bases_;
};

// The decoded uri of a buffer or image; nothing without a uri, and for a data URI.
std::optional<std::string> file_uri(const char *object) {
  const char *written = tw_json_member(object, "uri");
  if (!written || *written != '"' || has_scheme(string_of(written), "data:")) return {};
  return unescape(string_of(written));
}

// The same of an image; nothing also for an image on the web.
std::optional<std::string> image_uri(const char *object) {
  std::optional<std::string> uri = file_uri(object);
  bool is_web = uri && (has_scheme(*uri, "http://") || has_scheme(*uri, "https://"));
  return is_web ? std::nullopt : uri;
}

// The byteLength of a buffer or view; UINT64_MAX, which no file has, if it is no whole number: the reader
// refuses that.
uint64_t declared_length(const char *object) {
  return whole_number(tw_json_member(object, "byteLength")).value_or(UINT64_MAX);
}

// ---- the bundle --------------------------------------------------------------------------------------

class Bundle : Text {
public:
  Bundle(const char *root, const Container &container, tw_named_file *files, uint32_t file_count,
         Budget &budget)
      : Text(budget), container_(container), root_(root), buffer_array_(find_array("buffers")),
        view_array_(find_array("bufferViews")), image_array_(find_array("images")),
        view_count_(view_array_ ? tw_json_count(view_array_) : 0), files_(files), names_(files, file_count),
        offsets_(file_count, UINT64_MAX), image_views_(file_count, TW_NO_INDEX),
        bin_size_((uint64_t{container.bin.size} + 3) / 4 * 4) {}

  // Finds the place of each file in the BIN chunk. False if the document names no file.
  bool place() {
    find_needed_buffers();
    each(buffer_array_, [&](size_t i, const char *buffer) { place_buffer(buffer, i); });
    each(image_array_, [&](size_t i, const char *image) { place_image(image, i); });
    uint32_t next = 1; // behind the BIN chunk
    for (Buffer &buffer : buffers_) buffer.index = buffer.is_file ? 0 : next++;
    return has_files_;
  }

  // Header, JSON chunk padded with blanks, BIN chunk padded with zeros, and what a GLB has behind them;
  // malloc'ed.
  uint8_t *make(uint64_t max_size, size_t *out_size) {
    put_document();
    uint64_t json_size = (uint64_t{text_.size()} + 3) / 4 * 4, length = 28 + json_size + bin_size_,
             size = length + container_.tail.size;
    if (size > max_size || size > UINT32_MAX)
      refuse(TW_LIMIT, "", "together the files would have ", size, " bytes, over the limit");
    auto *glb = static_cast<uint8_t *>(tw_alloc_zero(static_cast<size_t>(size), 1));
    if (!glb) throw std::bad_alloc();
    uint8_t *end = tw_glb_put_head(glb, json_size, bin_size_);
    std::memset(std::copy(text_.begin(), text_.end(), end), ' ', json_size - text_.size());
    end = tw_glb_put_bin_head(end + json_size, bin_size_);
    std::copy_n(container_.bin.data, container_.bin.size, end);
    std::copy_n(container_.tail.data, container_.tail.size, end + bin_size_);
    length += container_.tail_inside;
    tw_put_u32(glb + 8, length);
    for (size_t i = 0; i < offsets_.size(); i++)
      if (offsets_[i] != UINT64_MAX) std::copy_n(files_[i].bytes, files_[i].size, end + offsets_[i]);
    *out_size = static_cast<size_t>(size);
    return glb;
  }

private:
  // Where the GLB has the bytes of a buffer of the document.
  struct Buffer {
    bool is_file;
    uint32_t index;
    uint64_t offset, length; // in the BIN chunk; as declared
  };

  const Container &container_;
  const char *root_, *buffer_array_, *view_array_, *image_array_; // nullptr where the document has none
  uint64_t view_count_;
  tw_named_file *files_;
  Names names_;
  std::vector<uint64_t> offsets_;     // of the files in the BIN chunk; UINT64_MAX: not in it
  std::vector<uint32_t> image_views_; // of the files: the view that is added for an image; TW_NO_INDEX: none
  std::vector<uint32_t> added_;       // the files of the added views
  std::vector<Buffer> buffers_;
  uint64_t bin_size_;
  bool has_files_ = false;
  std::vector<bool> needed_;     // of the buffers: holds bytes that are read
  size_t merged_count_ = 0;      // buffers that came as files, or as the BIN chunk
  const char *merged_ = nullptr; // the last of them

  const char *find_array(const char *name) const {
    const char *value = tw_json_member(root_, name);
    return value && *value == '[' ? value : nullptr;
  }

  // ---- placing

  // Finds the buffers in which the bytes of views are, compressed or not. The file of one that only stands
  // in for compressed bytes need not be sent.
  void find_needed_buffers() {
    needed_.assign(buffer_array_ ? tw_json_count(buffer_array_) : 0, true);
    auto set = [&](const char *object, bool is_needed) {
      uint64_t buffer = whole_number(tw_json_member(object, "buffer")).value_or(UINT64_MAX);
      if (buffer < needed_.size()) needed_[static_cast<size_t>(buffer)] = is_needed;
    };
    each(view_array_, [&](size_t, const char *view) {
      if (compression_of(view)) set(view, false);
    });
    each(view_array_, [&](size_t, const char *view) {
      const char *compressed = compression_of(view);
      set(compressed ? compressed : view, true);
    });
  }

  uint64_t place_file(uint32_t file) {
    if (offsets_[file] == UINT64_MAX) {
      offsets_[file] = bin_size_;
      bin_size_ = (bin_size_ + files_[file].size + 3) / 4 * 4;
      files_[file].is_used = true;
      has_files_ = true;
    }
    return offsets_[file];
  }

  void place_buffer(const char *object, size_t index) {
    Buffer buffer = {false, 0, 0, declared_length(object)};
    std::optional<std::string> uri = file_uri(object);
    if (uri && (needed_[index] || names_.has(*uri))) {
      uint32_t file = names_.find(*uri, text("/buffers/", index, "/uri"));
      if (buffer.length > files_[file].size)
        refuse(TW_INVALID, text("/buffers/", index, "/byteLength"), "the file of the buffer has only ",
               files_[file].size, " bytes");
      buffer.is_file = true;
      buffer.offset = place_file(file);
      merged_ = object;
      merged_count_++;
    } else if (index == 0 && container_.bin.size > 0 && !tw_json_member(object, "uri")) {
      if (buffer.length > container_.bin.size)
        refuse(TW_INVALID, "/buffers/0/byteLength", "the BIN chunk has only ", container_.bin.size,
               " bytes, not ", buffer.length);
      buffer.is_file = true; // at the beginning of the BIN chunk, as before
      merged_ = object;
      merged_count_++;
    }
    buffers_.push_back(buffer);
  }

  void place_image(const char *object, size_t index) {
    std::optional<std::string> uri = image_uri(object);
    if (!uri) return;
    uint32_t file = names_.find(*uri, text("/images/", index, "/uri"));
    place_file(file);
    if (image_views_[file] != TW_NO_INDEX) return;
    image_views_[file] = static_cast<uint32_t>(view_count_ + added_.size());
    added_.push_back(file);
  }

  // ---- printing

  void put_member(const Items &member) {
    put_key(member.key());
    put(value_text(member.value()));
  }

  void put_count(std::string_view key, uint64_t count) {
    put_key(key);
    put(text(count));
  }

  // Prints the extensions of a buffer view: those of meshopt name a buffer too.
  void put_view_extensions(const char *extensions, size_t index) {
    put("{");
    for (Items i(extensions); i.more(); i.next()) {
      put_key(i.key());
      if (has_word("EXT_meshopt_compression KHR_meshopt_compression", i.key()))
        put_view(i.value(), index);
      else
        put(value_text(i.value()));
    }
    put("}");
  }

  // Prints a view, or its meshopt extension, which give the place of their bytes alike. Checks that the bytes
  // lie in their buffer: past its end they would be those of the next file.
  void put_view(const char *object, size_t index) {
    if (*object != '{') return put(value_text(object)); // which the reader refuses
    const char *begin = tw_json_member(object, "byteOffset");
    std::optional<uint64_t> number = whole_number(tw_json_member(object, "buffer")),
                            offset = begin ? whole_number(begin) : 0;
    const Buffer *buffer = number && *number < buffers_.size() ? &buffers_[*number] : nullptr;
    uint64_t length = declared_length(object);
    if (!buffer || !offset || *offset > buffer->length || length > buffer->length - *offset)
      refuse(TW_INVALID, text("/bufferViews/", index), "the buffer view does not lie within a buffer");
    put("{");
    put_count("buffer", buffer->index);
    put_count("byteOffset", buffer->offset + *offset);
    for (Items i(object); i.more(); i.next()) {
      if (has_word("buffer byteOffset", i.key())) continue;
      put_key(i.key());
      if (i.key() == "extensions" && *i.value() == '{')
        put_view_extensions(i.value(), index);
      else
        put(value_text(i.value()));
    }
    put("}");
  }

  // The views of the document, then those added for images.
  void put_views() {
    put_key("bufferViews");
    put("[");
    each(view_array_, [&](size_t i, const char *view) {
      put_comma();
      put_view(view, i);
    });
    for (uint32_t file : added_) {
      put_comma();
      put("{");
      put_count("buffer", 0);
      put_count("byteOffset", offsets_[file]);
      put_count("byteLength", files_[file].size);
      put("}");
    }
    put("]");
  }

  // The buffer that holds all files, then the buffers that are no files. If a single buffer came as a file,
  // its name, extras and extensions stay.
  void put_buffers() {
    put_key("buffers");
    put("[{");
    put_count("byteLength", bin_size_);
    if (merged_count_ == 1)
      for (Items i(merged_); i.more(); i.next())
        if (!has_word("byteLength uri", i.key())) put_member(i);
    put("}");
    each(buffer_array_, [&](size_t i, const char *buffer) {
      if (buffers_[i].is_file) return;
      put_comma();
      put(value_text(buffer));
    });
    put("]");
  }

  void put_image(const char *object, size_t index) {
    std::optional<std::string> uri = image_uri(object);
    if (!uri) return put(value_text(object));
    std::string pointer = text("/images/", index, "/uri");
    uint32_t file = names_.find(*uri, pointer);
    put("{");
    for (Items i(object); i.more(); i.next())
      if (i.key() != "uri") put_member(i);
    if (!tw_json_member(object, "mimeType")) {
      const char *type = image_type({files_[file].bytes, files_[file].size});
      if (!type) refuse(TW_UNSUPPORTED, pointer, "the file is neither PNG, JPEG, WebP, KTX2, AVIF nor DDS");
      put_key("mimeType");
      put(text('"', type, '"'));
    }
    put_count("bufferView", image_views_[file]);
    put("}");
  }

  void put_images() {
    put_key("images");
    put("[");
    each(image_array_, [&](size_t i, const char *image) {
      put_comma();
      put_image(image, i);
    });
    put("]");
  }

  void put_document() {
    text_.reserve(value_text(root_).size());
    put("{");
    for (Items i(root_); i.more(); i.next())
      if (i.value() != buffer_array_ && i.value() != view_array_ && i.value() != image_array_) put_member(i);
    put_buffers();
    put_views();
    if (image_array_) put_images();
    put("}");
  }
};

} // namespace

} // namespace gltf

tw_status tw_gltf_bundle(const uint8_t *bytes, size_t size, tw_named_file *files, uint32_t file_count,
                         uint64_t json_values, uint64_t max_size, uint8_t **out, size_t *out_size,
                         tw_error *error) {
  const tw_json_rules rules = {json_values, false};
  *out = nullptr;
  gltf::Reserve reserve; // stays empty: it has what C++ allocates charged to the meter
  try {
    gltf::Budget budget(UINT64_MAX);   // the JSON does not grow by more than its numbers
    gltf::Outline passed_over(budget); // stands in the bundle as well, and is told when that is read
    const gltf::Container container = gltf::open_container({bytes, size}, passed_over);
    tw_status status = tw_json_check(container.json.data(), container.json.size(), &rules, error);
    const char *root = status == TW_OK ? tw_json_root(container.json.data(), container.json.size()) : nullptr;
    if (status != TW_OK || *root != '{') return status;
    gltf::Bundle bundle(root, container, files, file_count, budget);
    if (bundle.place()) *out = bundle.make(max_size, out_size);
    return TW_OK;
  } catch (const gltf::Refusal &refusal) {
    return gltf::report(refusal, error);
  } catch (const std::bad_alloc &) {
    return tw_fail(error, TW_NO_MEMORY, "no memory to join a glTF and its files");
  }
}
