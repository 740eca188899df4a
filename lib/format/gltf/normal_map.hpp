// What a material says of its normal map.
#ifndef TWEEND_GLTF_NORMAL_MAP_HPP
#define TWEEND_GLTF_NORMAL_MAP_HPP

#include <tiny_gltf.h>

namespace gltf {

// The set of texture coordinates that its normal map lies on, else that of its clear coat; -1 without either.
int normal_map_uvs(const tinygltf::Material &material);

} // namespace gltf

#endif
