// A cage refined by OpenSubdiv in double precision, and the normals that it gives each side of a point.
#pragma once

#include <opensubdiv/far/topologyRefiner.h>

#include <memory>
#include <vector>

#include "cages.hpp"

struct Value3 {
  double v[3] = {0, 0, 0};
  void Clear() { v[0] = v[1] = v[2] = 0; }
  void AddWithWeight(const Value3 &other, double weight) {
    for (int i = 0; i < 3; i++) v[i] += weight * other.v[i];
  }
};

// All points of a level, in OpenSubdiv's order, in place of those that subdivision makes.
struct Sculpt {
  uint32_t level;
  std::vector<Value3> points;
};
using Sculpts = std::vector<Sculpt>; // of ascending levels

class Oracle {
public:
  // Above the deepest level that is sculpted, vertices are moved as far as there.
  Oracle(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts = {});

  const OpenSubdiv::Far::TopologyRefiner &refiner() const { return *refiner_; }
  const OpenSubdiv::Far::TopologyLevel &level() const { return refiner_->GetLevel(refiner_->GetMaxLevel()); }

  std::vector<Value3> points;           // of the last level, or on the limit surface
  std::vector<std::vector<Value3>> uvs; // [set]

  // Whether OpenSubdiv misreads a UV set: round a point with two values, the second of which comes again
  // after the first has, it takes that for a third (FVarLevel::completeTopologyFromFaceValues looks at the
  // first of two alone), and so does not see that the value is parted, which would pin it.
  bool misreads(size_t set) const;

  // What is behind a normal, for counting.
  enum Kind { Smooth, Side, Corner, Amid, SemiSharp, Valence2, NonManifold, Flat, KindCount };

  // Unit normals that the corner of a face at a vertex of the last level may have. Empty where the tangents
  // are parallel, but for rounding.
  std::vector<Value3> normals(int vertex, int face, Kind &kind) const;

private:
  Kind kind_of(int vertex) const;
  void refine(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts);
  void follow(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts);

  std::unique_ptr<OpenSubdiv::Far::TopologyRefiner> refiner_;
  bool linear_;
  std::vector<Value3> unmoved_; // points of the last level
  std::vector<Value3> tangents1_, tangents2_;
  std::unique_ptr<Oracle> next_; // one level on, while something is semi-sharp
};
