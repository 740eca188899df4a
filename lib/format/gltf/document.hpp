// A parsed glTF document on its way to a tw_model, and the steps of that way.
#ifndef TWEEND_GLTF_DOCUMENT_HPP
#define TWEEND_GLTF_DOCUMENT_HPP

#include <new>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include "gltf/accessor.hpp"
#include "gltf/refusal.hpp"
#include "tweend/format.h"

namespace gltf {

struct Document {
  explicit Document(tw_model *target, tw_quads how) : model(target), quads(how) {}

  tinygltf::Model source;
  tw_model *model;
  tw_quads quads;
  // Elements of a file may be named by many others; these keep a small file from becoming a large model.
  uint64_t corners_left = 0, values_left = 0;
  // For the warnings.
  size_t skipped_primitives = 0, degenerate_faces = 0, partly_textured = 0;
};

// [count] zeroed elements in the model's arena. Throws bad_alloc.
template <typename Element> Element *allocate(const Document &document, size_t count) {
  void *memory = tw_arena_alloc(document.model->arena, count, sizeof(Element));
  if (!memory) throw std::bad_alloc();
  return static_cast<Element *>(memory);
}

// A name as clients can use it, nullptr for an empty one. Control characters become blanks.
const char *copy_name(const Document &document, const std::string &name);

// What the model holds comes from the document's parts, each step on its own; all throw Refusal.
void read_assets(Document &document);                       // materials, textures, samplers, images
void read_meshes(Document &document, Accessors &accessors); // after read_assets
void read_nodes(Document &document);                        // and the scene
void read_skins(Document &document, Accessors &accessors);  // after read_nodes
void read_clips(Document &document, Accessors &accessors);  // after read_meshes and read_nodes

} // namespace gltf

#endif
