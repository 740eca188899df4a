// The same work as tweend's, done by OpenSubdiv.
#ifndef TWEEND_OPENSUBDIV_PEER_HPP
#define TWEEND_OPENSUBDIV_PEER_HPP

#include "timing.hpp"
#include "tweend/subdiv.h"

namespace opensubdiv {

// Soup to points and indices of the last level, with limit tangents where normals are asked for.
Timing subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals);

} // namespace opensubdiv

#endif
