// Groups of faces in the JSON of a glTF answer.
#ifndef TWEEND_GLTF_GROUPS_HPP
#define TWEEND_GLTF_GROUPS_HPP

#include <tiny_gltf.h>

#include "tweend/format.h"

namespace gltf {

// The extras of a primitive that draws `faces`: {"groups": [{"names": [...], "start": n, "count": n}, ...]},
// ranges of its indices, in order. Faces in no group are in no range; without any range the value is
// null. next_group: the first of the surface's groups among the faces; is moved past them.
tinygltf::Value group_ranges(const tw_model &model, const tw_surface &surface, const tw_surface_group &faces,
                             uint32_t &next_group);

} // namespace gltf

#endif
