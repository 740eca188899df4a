// Lifetime and size of the kept parts of a glTF file.
#include "gltf/assets.hpp"

#include "tweend/format.h"

void tw_gltf_assets_destroy(tw_gltf_assets *assets) {
  delete assets;
}

size_t tw_gltf_assets_size(const tw_gltf_assets *assets) {
  if (!assets) return 0;
  size_t size = sizeof *assets + assets->materials.size() * sizeof(tinygltf::Material) +
                assets->textures.size() * sizeof(tinygltf::Texture) +
                assets->samplers.size() * sizeof(tinygltf::Sampler);
  for (const tinygltf::Image &image : assets->images)
    size += sizeof image + image.image.size() + image.uri.size();
  return size;
}
