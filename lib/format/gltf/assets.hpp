// What a glTF file holds besides geometry, hierarchy and clips, kept so that an answer can bear it too:
// materials with their extensions, textures, samplers, images.
#ifndef TWEEND_GLTF_ASSETS_HPP
#define TWEEND_GLTF_ASSETS_HPP

#include <tiny_gltf.h>

#include <string>
#include <vector>

// Indices between the four vectors are checked: texture -> sampler and source, and the core texture
// references of the materials, are in range or -1.
struct tw_gltf_assets {
  std::vector<tinygltf::Material> materials;
  std::vector<tinygltf::Texture> textures;
  std::vector<tinygltf::Sampler> samplers;
  // Either `image` holds the encoded file (PNG, JPEG, KTX2, ...) as it came, `mimeType` is set and
  // `uri` empty; or `uri` is a reference to something outside, as it came, and `image` is empty.
  // `bufferView` is always -1.
  std::vector<tinygltf::Image> images;
  // Extensions that occur in the above, to be declared by an answer that uses them.
  std::vector<std::string> extensions_used, extensions_required;
  std::string copyright; // of the source, "" when it has none
  size_t size = 0;       // bytes that all of it holds
};

namespace gltf {

// The set of texture coordinates that a material's normal map lies on, else that of its clear coat; -1
// without either.
int normal_map_uvs(const tinygltf::Material &material);

} // namespace gltf

#endif
