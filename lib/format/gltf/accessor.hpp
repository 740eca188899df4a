// Accessors (glTF 2.0, section 3.6.2), checked: whoever holds an Elements may read any of its elements.
#ifndef TWEEND_GLTF_ACCESSOR_HPP
#define TWEEND_GLTF_ACCESSOR_HPP

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tiny_gltf.h>

namespace gltf {

// A view of one accessor's elements; lives as long as the document.
class Elements {
public:
  uint32_t count() const { return count_; }
  uint32_t width() const { return width_; }
  int component_type() const { return component_type_; }
  bool normalized() const { return normalized_; }

  // Element i as floats: out[width]. Throws Refusal on a value that is not finite.
  void read(uint32_t i, float *out) const;

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
  explicit Accessors(const tinygltf::Model &model) : model_(model), opened_(model.accessors.size()) {}

  // The accessor at `index`, which `pointer` names. type: TINYGLTF_TYPE_*. Throws Refusal.
  const Elements &open(int index, int type, const std::string &pointer);

  // As open, for any type.
  const Elements &open_any(int index, const std::string &pointer);

private:
  const tinygltf::Model &model_;
  std::vector<std::optional<Elements>> opened_;

  Elements check(size_t index) const;
  void check_sparse(size_t index, Elements &elements) const;
  const uint8_t *check_range(int view, uint64_t offset, uint64_t count, uint64_t element_size,
                             uint64_t *stride, const std::string &pointer) const;
};

} // namespace gltf

#endif
