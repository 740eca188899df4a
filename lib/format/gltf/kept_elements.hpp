// The accessors of a document that pass through to answers as they are.
#ifndef TWEEND_GLTF_KEPT_ELEMENTS_HPP
#define TWEEND_GLTF_KEPT_ELEMENTS_HPP

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "gltf/document.hpp"

namespace gltf {

// What an accessor that passes through is used for.
enum Use { VERTICES, VERTICES_AS_FLOATS, INDICES, TIMES, PLAIN };

// Copies accessors for answers, each once for each use.
class ElementPreserver {
public:
  ElementPreserver(Document &document, Accessors &accessors)
      : document_(document), accessors_(accessors), preserved_(document.budget) {}

  // Keeps an accessor for a use; returns its number in an answer.
  uint32_t keep(int accessor, Use use, const std::string &pointer) {
    auto [found, fresh] = numbers_.try_emplace({accessor, use}, static_cast<uint32_t>(preserved_.size()));
    if (!fresh) return found->second;
    document_.budget.take(entry_size);
    const Elements &elements = accessors_.open_any(accessor, pointer);
    preserved_.push_back(copy(accessor, elements, use));
    return found->second;
  }

  const Elements &open(int accessor, const std::string &pointer) const {
    return accessors_.open_any(accessor, pointer);
  }

  void finish(tw_gltf_assets &assets) {
    tw_gltf_elements *copies = allocate<tw_gltf_elements>(document_, preserved_.size());
    std::copy(preserved_.begin(), preserved_.end(), copies);
    assets.elements = copies;
    assets.element_count = static_cast<uint32_t>(preserved_.size());
  }

private:
  static constexpr uint64_t entry_size = 96; // in the map

  Document &document_;
  Accessors &accessors_;
  Vector<tw_gltf_elements> preserved_;
  std::map<std::pair<int, Use>, uint32_t> numbers_;

  tw_gltf_elements copy(int accessor, const Elements &elements, Use use) {
    bool is_vertex = use == VERTICES || use == VERTICES_AS_FLOATS;
    tw_gltf_elements out = {};
    out.count = elements.count();
    out.type = accessors_.type_name(accessor);
    out.component = use == VERTICES_AS_FLOATS ? TW_GLTF_FLOAT : elements.component_type();
    out.normalized = elements.normalized() && out.component != TW_GLTF_FLOAT;
    out.target = is_vertex ? TW_GLTF_VERTICES : use == INDICES ? TW_GLTF_INDICES : 0;
    out.stride = elements.width() * component_size(out.component);
    if (out.type[0] == 'M' && component_size(out.component) < 4)
      refuse(TW_UNSUPPORTED, text("/accessors/", accessor), "matrices of small integers are not read");
    if (is_vertex) out.stride = (out.stride + 3) / 4 * 4;
    uint8_t *bytes = allocate_zero<uint8_t>(document_, size_t{out.count} * out.stride);
    for (uint32_t i = 0; i < out.count; i++) copy_element(elements, i, out, bytes + size_t{i} * out.stride);
    out.bytes = bytes;
    bool is_bounded = (use == VERTICES_AS_FLOATS || use == TIMES) && elements.width() <= 4;
    if (is_bounded && out.component == TW_GLTF_FLOAT) find_bounds(out, elements.width());
    return out;
  }

  static void copy_element(const Elements &elements, uint32_t i, const tw_gltf_elements &out, uint8_t *to) {
    float values[16];
    if (out.component != TW_GLTF_FLOAT) return elements.copy(i, to);
    elements.read(i, values); // refuses what is not finite
    std::memcpy(to, values, elements.width() * sizeof *values);
  }

  static void find_bounds(tw_gltf_elements &out, uint32_t width) {
    out.bound_count = width;
    std::fill(out.min, out.min + 4, INFINITY);
    std::fill(out.max, out.max + 4, -INFINITY);
    for (uint32_t i = 0; i < out.count; i++)
      for (uint32_t k = 0; k < width; k++) {
        float value;
        std::memcpy(&value, out.bytes + size_t{i} * out.stride + k * sizeof value, sizeof value);
        out.min[k] = std::min(out.min[k], value);
        out.max[k] = std::max(out.max[k], value);
      }
  }
};

} // namespace gltf

#endif
