// OpenSubdiv, doing the same work as tweend.
#ifndef TWEEND_OPENSUBDIV_PEER_HPP
#define TWEEND_OPENSUBDIV_PEER_HPP

#include "timing.hpp"
#include "tweend/subdiv.h"

namespace opensubdiv {

// Times the way from polygon soup to points and indices of the last level; with `normals`, limit tangents
// too.
Timing subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals);

} // namespace opensubdiv

#endif
