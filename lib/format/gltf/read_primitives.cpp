// Primitives to triangles over the vertices in use (glTF 2.0, section 3.7.2).
#include "gltf/primitive.hpp"

#include <algorithm>
#include <map>

namespace gltf {

namespace {

using Attributes = std::map<std::string, int>;
using SourceKey = std::pair<Attributes, std::vector<Attributes>>;

const char ngon_extension[] = "FB_ngon_encoding";

class PrimitiveReader {
public:
  PrimitiveReader(Document &document, Accessors &accessors, size_t mesh, std::vector<uint32_t> &scratch)
      : document_(document), accessors_(accessors), mesh_(document.source.meshes[mesh]),
        pointer_(text("/meshes/", mesh, "/primitives/")), scratch_(scratch) {}

  Primitives read() {
    for (size_t i = 0; i < mesh_.primitives.size(); i++) add(i);
    // Source by source: one scratch numbering serves them all.
    for (uint32_t source = 0; source < out_.sources.size(); source++) number_vertices(source);
    return std::move(out_);
  }

private:
  Document &document_;
  Accessors &accessors_;
  const tinygltf::Mesh &mesh_;
  std::string pointer_;
  std::vector<uint32_t> &scratch_; // by element: vertex + 1; all 0 between calls
  Primitives out_;
  std::map<SourceKey, uint32_t> known_;
  std::vector<uint32_t> list_source_;

  void add(size_t i) {
    const tinygltf::Primitive &primitive = mesh_.primitives[i];
    if (primitive.mode < TINYGLTF_MODE_POINTS || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
      refuse(TW_INVALID, text(pointer_, i, "/mode"), "mode ", primitive.mode, " is out of range");
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
      out_.skipped++;
      return;
    }
    uint32_t source = find_source(i);
    TriangleList list;
    list.material = material(primitive.material, i);
    list.polygons = bears_polygons(primitive);
    list.corners = read_triangles(i, out_.sources[source].position->count());
    out_.lists.push_back(std::move(list));
    list_source_.push_back(source);
  }

  int32_t material(int index, size_t i) const {
    if (index >= -1 && (index < 0 || static_cast<uint32_t>(index) < document_.model->material_count))
      return index;
    refuse(TW_INVALID, text(pointer_, i, "/material"), "there is no material ", index);
  }

  // Some exporters only declare the extension, others mark their primitives too.
  bool bears_polygons(const tinygltf::Primitive &primitive) const {
    if (document_.quads == TW_QUADS_OFF) return false;
    if (primitive.extensions.count(ngon_extension)) return true;
    const std::vector<std::string> &used = document_.source.extensionsUsed;
    if (std::find(used.begin(), used.end(), ngon_extension) == used.end()) return false;
    return std::none_of(
        mesh_.primitives.begin(), mesh_.primitives.end(),
        [](const tinygltf::Primitive &other) { return other.extensions.count(ngon_extension) > 0; });
  }

  // ---- attributes ------------------------------------------------------------------------------

  uint32_t find_source(size_t i) {
    const tinygltf::Primitive &primitive = mesh_.primitives[i];
    auto [found, fresh] = known_.try_emplace(SourceKey(primitive.attributes, primitive.targets),
                                             static_cast<uint32_t>(out_.sources.size()));
    if (fresh) out_.sources.push_back(open_source(primitive, text(pointer_, i)));
    return found->second;
  }

  // An attribute of as many elements as there are positions, or nullptr.
  const Elements *attribute(const Attributes &attributes, const std::string &name, const std::string &pointer,
                            const Elements *position) {
    auto found = attributes.find(name);
    if (found == attributes.end()) return nullptr;
    std::string place = pointer + "/" + name;
    const Elements &elements = accessors_.open_any(found->second, place);
    if (position && elements.count() != position->count())
      refuse(TW_INVALID, place, "the attribute has ", elements.count(), " elements, and POSITION ",
             position->count());
    return &elements;
  }

  const Elements *vector_attribute(const Attributes &attributes, const std::string &name, uint32_t least,
                                   uint32_t most, const std::string &pointer, const Elements *position) {
    const Elements *elements = attribute(attributes, name, pointer, position);
    if (elements && (elements->width() < least || elements->width() > most))
      refuse(TW_INVALID, text("/accessors/", attributes.at(name), "/type"), name, " must have ", least,
             " components");
    return elements;
  }

  VertexSource open_source(const tinygltf::Primitive &primitive, const std::string &primitive_pointer) {
    const Attributes &attributes = primitive.attributes;
    std::string pointer = primitive_pointer + "/attributes";
    VertexSource source;
    source.position = vector_attribute(attributes, "POSITION", 3, 3, pointer, nullptr);
    if (!source.position) refuse(TW_INVALID, pointer, "a primitive needs the attribute POSITION");
    for (size_t set = 0; set < source.uvs.size(); set++)
      source.uvs[set] = vector_attribute(attributes, text("TEXCOORD_", set), 2, 2, pointer, source.position);
    source.color = vector_attribute(attributes, "COLOR_0", 3, 4, pointer, source.position);
    for (size_t set = 0; set < source.joints.size(); set++) {
      source.joints[set] = vector_attribute(attributes, text("JOINTS_", set), 4, 4, pointer, source.position);
      source.weights[set] =
          vector_attribute(attributes, text("WEIGHTS_", set), 4, 4, pointer, source.position);
      check_joints(attributes, source, set, pointer);
    }
    source.has_tangents = attributes.count("TANGENT") > 0;
    for (size_t target = 0; target < primitive.targets.size(); target++)
      source.morphs.push_back(vector_attribute(primitive.targets[target], "POSITION", 3, 3,
                                               text(primitive_pointer, "/targets/", target),
                                               source.position));
    return source;
  }

  static void check_joints(const Attributes &attributes, const VertexSource &source, size_t set,
                           const std::string &pointer) {
    if (!source.joints[set] != !source.weights[set])
      refuse(TW_INVALID, pointer, "JOINTS_", set, " and WEIGHTS_", set, " come together");
    if (!source.joints[set]) return;
    int type = source.joints[set]->component_type();
    if ((type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) ||
        source.joints[set]->normalized())
      refuse(TW_INVALID, text("/accessors/", attributes.at(text("JOINTS_", set)), "/componentType"),
             "joints are unsigned bytes or shorts");
  }

  // ---- triangles -------------------------------------------------------------------------------

  // The elements that corners name, one after the other.
  std::vector<uint32_t> read_indices(size_t i, uint32_t element_count) {
    const tinygltf::Primitive &primitive = mesh_.primitives[i];
    const Elements *indices = nullptr;
    if (primitive.indices != -1) {
      indices = &accessors_.open(primitive.indices, TINYGLTF_TYPE_SCALAR, text(pointer_, i, "/indices"));
      int type = indices->component_type();
      if ((type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
           type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) ||
          indices->normalized())
        refuse(TW_INVALID, text("/accessors/", primitive.indices, "/componentType"),
               "indices are unsigned integers");
    }
    uint32_t count = indices ? indices->count() : element_count;
    spend_corners(count, i);
    std::vector<uint32_t> out(count);
    for (uint32_t k = 0; k < count; k++) {
      out[k] = indices ? indices->read_index(k) : k;
      if (out[k] >= element_count)
        refuse(TW_INVALID, text("/accessors/", primitive.indices), "index ", out[k], " at ", k,
               " is out of range: there are ", element_count, " vertices");
    }
    return out;
  }

  void spend_corners(uint64_t count, size_t i) {
    if (count > document_.corners_left)
      refuse(TW_LIMIT, text(pointer_, i), "the meshes have too many triangles for a file of this size");
    document_.corners_left -= count;
  }

  // Strips and fans written out as triangles.
  static std::vector<uint32_t> unroll(const std::vector<uint32_t> &indices, int mode) {
    std::vector<uint32_t> corners;
    corners.reserve(3 * (indices.size() - 2));
    for (size_t k = 0; k + 2 < indices.size(); k++) {
      if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
        corners.insert(corners.end(), {indices[k], indices[k + 1 + k % 2], indices[k + 2 - k % 2]});
      else
        corners.insert(corners.end(), {indices[k + 1], indices[k + 2], indices[0]});
    }
    return corners;
  }

  void drop_degenerate(std::vector<uint32_t> &corners) {
    size_t kept = 0;
    for (size_t k = 0; k < corners.size(); k += 3) {
      uint32_t a = corners[k], b = corners[k + 1], c = corners[k + 2];
      if (a == b || b == c || c == a) continue;
      corners[kept] = a, corners[kept + 1] = b, corners[kept + 2] = c;
      kept += 3;
    }
    out_.degenerate += (corners.size() - kept) / 3;
    corners.resize(kept);
  }

  std::vector<uint32_t> read_triangles(size_t i, uint32_t element_count) {
    std::vector<uint32_t> corners = read_indices(i, element_count);
    size_t count = corners.size();
    int mode = mesh_.primitives[i].mode;
    if (count < 3 || (mode == TINYGLTF_MODE_TRIANGLES && count % 3 != 0))
      refuse(TW_INVALID, text(pointer_, i), "the primitive's ", count, " corners make no whole triangles");
    if (mode != TINYGLTF_MODE_TRIANGLES) {
      spend_corners(2 * uint64_t{count}, i);
      corners = unroll(corners, mode);
    }
    drop_degenerate(corners);
    return corners;
  }

  // ---- vertices --------------------------------------------------------------------------------

  // Turns elements into vertices in all lists of a source, in the order of their first use.
  void number_vertices(uint32_t source) {
    uint32_t elements = out_.sources[source].position->count();
    if (scratch_.size() < elements) scratch_.resize(elements);
    size_t first = out_.vertices.size();
    for (size_t i = 0; i < out_.lists.size(); i++) {
      if (list_source_[i] != source) continue;
      for (uint32_t &corner : out_.lists[i].corners) {
        uint32_t &vertex = scratch_[corner];
        if (vertex == 0) {
          out_.vertices.push_back({source, corner});
          vertex = static_cast<uint32_t>(out_.vertices.size());
        }
        corner = vertex - 1;
      }
    }
    for (size_t i = first; i < out_.vertices.size(); i++) scratch_[out_.vertices[i].element] = 0;
  }
};

} // namespace

Primitives read_primitives(Document &document, Accessors &accessors, size_t mesh,
                           std::vector<uint32_t> &scratch) {
  return PrimitiveReader(document, accessors, mesh, scratch).read();
}

} // namespace gltf
