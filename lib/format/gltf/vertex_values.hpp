// What the vertices of a mesh hold, written into the model.
#ifndef TWEEND_GLTF_VERTEX_VALUES_HPP
#define TWEEND_GLTF_VERTEX_VALUES_HPP

#include <limits>

#include "gltf/cage_tags.hpp"
#include "gltf/vertex_sources.hpp"
#include "merge_points.h"

namespace gltf {

constexpr size_t no_skin = std::numeric_limits<size_t>::max();

// Vertices are the elements that faces use.
struct Vertices {
  const Vector<uint32_t> &element;      // of each vertex, in its source
  const Vector<uint32_t> &point;        // of each vertex
  const Vector<uint32_t> &first_vertex; // of each point
  tw_soup soup;                         // at the corners of faces
  CageTags &tags;
};

// A status of what welds: TW_OK, or else no memory, or the result is not wanted any more, of which the meter
// tells.
void check_status(tw_status status);

// Refuses more morph targets than a mesh may have.
void check_morph_count(size_t count, size_t mesh);

// Writes positions, attributes, joints, morph targets, texture coordinates and, where `keeps_normals`,
// normals. skin_joints: the fewest joints of the skins that nodes give the mesh; no_skin: none does.
void write_vertices(Document &document, size_t mesh, const VertexSources &sources, const Vertices &vertices,
                    size_t skin_joints, bool keeps_normals);

} // namespace gltf

#endif
