// The triangle primitives of one mesh over one numbering of the vertices that they use.
#ifndef TWEEND_GLTF_PRIMITIVE_HPP
#define TWEEND_GLTF_PRIMITIVE_HPP

#include <array>
#include <vector>

#include "gltf/document.hpp"

namespace gltf {

// The attributes of a primitive, opened. Primitives that name the same accessors share one.
struct VertexSource {
  const Elements *position = nullptr;
  std::array<const Elements *, TW_UV_SETS_MAX> uvs = {};
  const Elements *color = nullptr;
  std::array<const Elements *, 2> joints = {}, weights = {};
  bool has_tangents = false;
  std::vector<const Elements *> morphs; // an entry is nullptr for a target that moves no point
};

// A vertex as an element of its source.
struct Vertex {
  uint32_t source, element;
};

struct TriangleList {
  std::vector<uint32_t> corners; // 3 a triangle, indices into Primitives::vertices; none degenerate
  int32_t material = -1;
  bool polygons = false; // consecutive triangles from one corner are one face
};

struct Primitives {
  std::vector<VertexSource> sources;
  std::vector<Vertex> vertices;
  std::vector<TriangleList> lists; // in the file's order
  size_t skipped = 0;              // primitives of points and lines
  size_t degenerate = 0;           // triangles with a repeated corner
};

// Reads the primitives of a mesh. scratch: kept between calls. Throws Refusal.
Primitives read_primitives(Document &document, Accessors &accessors, size_t mesh,
                           std::vector<uint32_t> &scratch);

} // namespace gltf

#endif
