// Accessors: every offset is checked in 64 bits before it is followed, and sparse elements are applied.
#include "gltf/document.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gltf {

uint32_t component_size(int component_type) {
  switch (component_type) {
  case TINYGLTF_COMPONENT_TYPE_BYTE:
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
  case TINYGLTF_COMPONENT_TYPE_SHORT:
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
  case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
  default: return 0; // doubles and signed 32-bit integers are no types of glTF
  }
}

namespace {

// The most elements of an accessor without data, which costs nothing in the file.
constexpr uint64_t zeros_max = 1u << 20;

// Sparse indices that may be checked beyond one for each byte of the buffers: accessors may share their
// bytes.
constexpr uint64_t sparse_free = 4u << 20;

// Steps of work of finding an element among the sparse ones, which lie anywhere.
constexpr uint64_t search_steps = 16;

template <typename Component> Component load(const uint8_t *at) {
  Component value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

// glTF 2.0, section 3.6.2.2, and the equations of KHR_mesh_quantization.
float component_value(const uint8_t *at, int component_type, bool normalized) {
  switch (component_type) {
  case TINYGLTF_COMPONENT_TYPE_BYTE: {
    float value = load<int8_t>(at);
    return normalized ? std::max(value / 127.0f, -1.0f) : value;
  }
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
    float value = load<uint8_t>(at);
    return normalized ? value / 255.0f : value;
  }
  case TINYGLTF_COMPONENT_TYPE_SHORT: {
    float value = load<int16_t>(at);
    return normalized ? std::max(value / 32767.0f, -1.0f) : value;
  }
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
    float value = load<uint16_t>(at);
    return normalized ? value / 65535.0f : value;
  }
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return static_cast<float>(load<uint32_t>(at));
  default: return load<float>(at);
  }
}

uint32_t index_value(const uint8_t *at, int component_type) {
  switch (component_type) {
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return load<uint8_t>(at);
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return load<uint16_t>(at);
  case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return load<uint32_t>(at);
  default: return 0;
  }
}

const char *name_of(int type) {
  switch (type) {
  case TINYGLTF_TYPE_SCALAR: return "SCALAR";
  case TINYGLTF_TYPE_VEC2: return "VEC2";
  case TINYGLTF_TYPE_VEC3: return "VEC3";
  case TINYGLTF_TYPE_VEC4: return "VEC4";
  case TINYGLTF_TYPE_MAT2: return "MAT2";
  case TINYGLTF_TYPE_MAT3: return "MAT3";
  default: return "MAT4";
  }
}

} // namespace

// ---- reading --------------------------------------------------------------------------------------

const uint8_t *Elements::find_sparse(uint32_t i) const {
  tw_work(search_steps); // what calls this asks whether to go on
  auto index = [&](uint32_t k) {
    return index_value(sparse_indices_ + size_t{k} * component_size(sparse_index_type_), sparse_index_type_);
  };
  uint32_t low = 0, high = sparse_count_;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (index(middle) < i)
      low = middle + 1;
    else
      high = middle;
  }
  bool is_replaced = low < sparse_count_ && index(low) == i;
  return is_replaced ? sparse_values_ + size_t{low} * component_size(component_type_) * width_ : nullptr;
}

void Elements::read(uint32_t i, float *out) const {
  work(1);
  if (!read_finite(i, out))
    refuse(TW_INVALID, text("/accessors/", accessor_), "element ", i, " has a value that is not finite");
}

bool Elements::read_finite(uint32_t i, float *out) const {
  const uint8_t *at = find(i);
  if (!at) {
    std::fill(out, out + width_, 0.0f);
    return true;
  }
  if (component_type_ != TINYGLTF_COMPONENT_TYPE_FLOAT) {
    size_t size = component_size(component_type_);
    for (uint32_t c = 0; c < width_; c++)
      out[c] = component_value(at + c * size, component_type_, normalized_);
    return true;
  }
  std::memcpy(out, at, width_ * sizeof(float));
  bool finite = std::all_of(out, out + width_, [](float value) { return std::isfinite(value); });
  if (!finite) std::fill(out, out + width_, 0.0f);
  return finite;
}

void Elements::copy(uint32_t i, uint8_t *out) const {
  work(1);
  const uint8_t *at = find(i);
  size_t size = size_t{width_} * component_size(component_type_);
  if (at)
    std::memcpy(out, at, size);
  else
    std::memset(out, 0, size);
}

uint32_t Elements::read_index(uint32_t i) const {
  work(1);
  const uint8_t *at = find(i);
  return at ? index_value(at, component_type_) : 0;
}

// ---- checking -------------------------------------------------------------------------------------

// Checks that `count` elements lie in a view; returns where they begin.
const uint8_t *Accessors::check_range(int view, uint64_t offset, uint64_t count, uint64_t element_size,
                                      uint64_t *stride, const std::string &pointer) const {
  if (view < 0 || static_cast<size_t>(view) >= model_.bufferViews.size())
    refuse(TW_INVALID, pointer + "/bufferView", "there is no such buffer view");
  const tinygltf::BufferView &source = model_.bufferViews[static_cast<size_t>(view)];
  const Bytes &bytes = buffers_.at(static_cast<size_t>(source.buffer));
  uint64_t size = source.byteLength;
  if (source.byteOffset > bytes.size || size > bytes.size - source.byteOffset)
    refuse(TW_INVALID, text("/bufferViews/", view), "the buffer view goes past its buffer");
  *stride = source.byteStride ? source.byteStride : element_size;
  if (*stride < element_size || *stride > 252 + element_size)
    refuse(TW_INVALID, text("/bufferViews/", view, "/byteStride"), "the stride does not fit elements of ",
           element_size, " bytes");
  // count is at most 2^32 and the stride small: the product stays far below 2^64.
  if (offset > size || element_size > size - offset || (count - 1) * *stride > size - offset - element_size)
    refuse(TW_INVALID, pointer, "the accessor goes past the ", size, " bytes of its buffer view");
  return bytes.data + source.byteOffset + offset;
}

Accessors::Accessors(const tinygltf::Model &model, const Vector<Bytes> &buffers, Budget &budget)
    : model_(model), buffers_(buffers), opened_(budget, model.accessors.size()), sparse_left_(sparse_free) {
  for (const Bytes &bytes : buffers) sparse_left_ += bytes.size;
}

void Accessors::check_sparse(size_t index, Elements &elements) {
  const auto &sparse = model_.accessors[index].sparse;
  std::string pointer = text("/accessors/", index, "/sparse");
  if (sparse.count < 1 || static_cast<uint32_t>(sparse.count) > elements.count_)
    refuse(TW_INVALID, pointer + "/count", "a sparse accessor replaces from 1 to all of its elements");
  if (static_cast<uint64_t>(sparse.count) > sparse_left_)
    refuse(TW_LIMIT, pointer, "the sparse accessors are too many for a file of this size");
  sparse_left_ -= static_cast<uint64_t>(sparse.count);
  int index_type = sparse.indices.componentType;
  if (index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
      index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
    refuse(TW_INVALID, pointer + "/indices/componentType", "sparse indices are unsigned integers");
  /* Unsigned in later versions of tinygltf. */
  if (static_cast<int64_t>(sparse.indices.byteOffset) < 0 ||
      static_cast<int64_t>(sparse.values.byteOffset) < 0)
    refuse(TW_INVALID, pointer, "an offset is negative");
  uint64_t count = static_cast<uint64_t>(sparse.count), index_size = component_size(index_type), stride;
  uint64_t value_size = uint64_t{component_size(elements.component_type_)} * elements.width_;
  elements.sparse_indices_ =
      check_range(sparse.indices.bufferView, static_cast<uint64_t>(sparse.indices.byteOffset), count,
                  index_size, &stride, pointer + "/indices");
  if (stride != index_size) refuse(TW_INVALID, pointer + "/indices", "sparse data has no stride");
  elements.sparse_values_ =
      check_range(sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset), count,
                  value_size, &stride, pointer + "/values");
  if (stride != value_size) refuse(TW_INVALID, pointer + "/values", "sparse data has no stride");
  elements.sparse_index_type_ = index_type;
  elements.sparse_count_ = static_cast<uint32_t>(count);
  for (uint64_t i = 0, before = 0; i < count; i++) {
    work(1);
    uint64_t at = index_value(elements.sparse_indices_ + i * index_size, index_type);
    if (at >= elements.count_)
      refuse(TW_INVALID, pointer + "/indices", "sparse index ", at, " is out of range");
    if (i > 0 && at <= before) refuse(TW_INVALID, pointer + "/indices", "sparse indices must ascend");
    before = at;
  }
}

Elements Accessors::check(size_t index) {
  const tinygltf::Accessor &accessor = model_.accessors[index];
  std::string pointer = text("/accessors/", index);
  Elements elements;
  elements.accessor_ = static_cast<int>(index);
  elements.component_type_ = accessor.componentType;
  elements.normalized_ = accessor.normalized;
  uint64_t size = component_size(accessor.componentType);
  if (size == 0) refuse(TW_INVALID, pointer + "/componentType", "this is not a component type of glTF");
  if (accessor.normalized && size == 4)
    refuse(TW_INVALID, pointer + "/normalized", "only 8- and 16-bit integers are normalised");
  if (accessor.count < 1 || accessor.count >= UINT32_MAX)
    refuse(TW_INVALID, pointer + "/count", "an accessor has from 1 to 4294967294 elements");
  int width = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type));
  elements.width_ = static_cast<uint32_t>(width);
  elements.count_ = static_cast<uint32_t>(accessor.count);
  if (accessor.bufferView >= 0) {
    uint64_t stride;
    elements.data_ = check_range(accessor.bufferView, accessor.byteOffset, accessor.count,
                                 size * elements.width_, &stride, pointer);
    elements.stride_ = stride;
  } else if (accessor.count > zeros_max) {
    refuse(TW_LIMIT, pointer + "/count", "an accessor without data has at most ", zeros_max, " elements");
  }
  if (accessor.sparse.isSparse) check_sparse(index, elements);
  return elements;
}

const Elements &Accessors::open_any(int index, const std::string &pointer) {
  if (index < 0 || static_cast<size_t>(index) >= opened_.size())
    refuse(TW_INVALID, pointer, "there is no accessor ", index);
  std::optional<Elements> &elements = opened_[static_cast<size_t>(index)];
  if (!elements) elements = check(static_cast<size_t>(index));
  return *elements;
}

const Elements &Accessors::open(int index, int type, const std::string &pointer) {
  const Elements &elements = open_any(index, pointer);
  if (model_.accessors[static_cast<size_t>(index)].type != type)
    refuse(TW_INVALID, text("/accessors/", index, "/type"), "the accessor that ", pointer, " names must be ",
           name_of(type));
  return elements;
}

const char *Accessors::type_name(int index) const {
  return name_of(model_.accessors[static_cast<size_t>(index)].type);
}

// ---- vertices that are shown ----------------------------------------------------------------------

void ShownVertices::add(const Elements &positions, const uint32_t *elements, size_t count) {
  auto found = accessors_.find(&positions);
  if (found == accessors_.end()) {
    budget_.take(entry_size);
    found = accessors_.emplace(&positions, Accessor{positions.count(), Vector<bool>(budget_)}).first;
  }
  Accessor &accessor = found->second;
  if (accessor.left == 0) return;
  if (count == positions.count()) {
    accessor.left = 0;
    Vector<bool>(budget_).swap(accessor.is_shown); // which is not needed any more
    return;
  }
  if (accessor.is_shown.empty()) accessor.is_shown.resize(positions.count());
  work(count);
  for (size_t i = 0; i < count; i++) {
    accessor.left -= !accessor.is_shown[elements[i]];
    accessor.is_shown[elements[i]] = true;
  }
}

uint64_t ShownVertices::missing() const {
  uint64_t count = 0;
  for (const auto &[positions, accessor] : accessors_) count += accessor.left;
  return count;
}

} // namespace gltf
