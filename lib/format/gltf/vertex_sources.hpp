// The attributes that the primitives of a mesh name.
#ifndef TWEEND_GLTF_VERTEX_SOURCES_HPP
#define TWEEND_GLTF_VERTEX_SOURCES_HPP

#include <array>

#include "gltf/document.hpp"

namespace gltf {

using Attributes = std::map<std::string, int>;

// The attributes of a primitive, opened. Primitives that name the same accessors share one.
struct VertexSource {
  const Elements *position = nullptr;
  std::array<const Elements *, TW_UV_SETS_MAX> uvs = {};
  const Elements *normal = nullptr, *tangent = nullptr;
  std::vector<const Elements *> attributes; // of the mesh's smooth attributes, as far as it has them
  std::array<const Elements *, 2> joints = {}, weights = {};
  // An entry is nullptr for a target that moves no point, or normal.
  std::vector<const Elements *> morphs, morph_normals;
  uint32_t first_vertex = 0; // vertices are numbered source by source
};

// A colour, or an attribute of an application's own, of all primitives that have it.
struct SmoothAttribute {
  std::string name;
  uint32_t width;
  bool is_color() const { return name[0] != '_'; }
};

constexpr char too_many_attributes[] = " is left out: a mesh keeps 15 such, of 32 components in all";

class VertexSources {
public:
  VertexSources(Document &document, Accessors &accessors, size_t mesh)
      : document_(document), accessors_(accessors), source_(document.source.meshes[mesh]), index_(mesh),
        pointer_(text("/meshes/", mesh, "/primitives/")) {}

  // The number of primitive i's source among all.
  uint32_t find(size_t i);

  std::vector<VertexSource> all;
  std::vector<SmoothAttribute> smooth; // in the order of the document

private:
  using Key = std::pair<Attributes, std::vector<Attributes>>;

  Document &document_;
  Accessors &accessors_;
  const tinygltf::Mesh &source_;
  size_t index_;
  std::string pointer_;
  std::map<Key, uint32_t> known_;

  const Elements *attribute(const Attributes &attributes, const std::string &name, const std::string &pointer,
                            const Elements *position);
  const Elements *vector_attribute(const Attributes &attributes, const std::string &name, uint32_t least,
                                   uint32_t most, const std::string &pointer, const Elements *position);
  VertexSource open(const tinygltf::Primitive &primitive, size_t i);
  void open_smooth(const Attributes &attributes, size_t i, const std::string &pointer, VertexSource &source);
  std::optional<size_t> smooth_number(const std::string &name, uint32_t width);
  void note_unread(const tinygltf::Primitive &primitive);
};

} // namespace gltf

#endif
