// The same work as tweend's, done by OpenSubdiv.
#ifndef TWEEND_OPENSUBDIV_PEER_HPP
#define TWEEND_OPENSUBDIV_PEER_HPP

#include <memory>
#include <vector>

#include "timing.hpp"
#include "tweend/subdiv.h"

namespace opensubdiv {

// Soup to points and indices of the last level, with limit tangents where normals are asked for.
Timing subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals);

// New positions on a topology that is known already.
class Moved {
public:
  Moved(const tw_mesh &mesh, unsigned level);
  ~Moved();
  Timing stencils(const float *positions);                         // one table, one thread
  Timing stencils_on_threads(const float *positions, int threads); // the same with OpenMP
  Timing interpolation(const float *positions);                    // level by level

private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
};

} // namespace opensubdiv

#endif
