// A cage refined by OpenSubdiv in double precision, and its normals for each side of a point.
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

// All points of a level in OpenSubdiv's order, which replace those that subdivision makes.
struct Sculpt {
  uint32_t level;
  std::vector<Value3> points;
};
using Sculpts = std::vector<Sculpt>; // by ascending level

class Oracle {
public:
  // On levels coarser than the deepest sculpted one, vertices are moved by as much as their descendants on
  // that level.
  Oracle(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts = {});

  const OpenSubdiv::Far::TopologyRefiner &refiner() const { return *refiner_; }
  const OpenSubdiv::Far::TopologyLevel &level() const { return refiner_->GetLevel(refiner_->GetMaxLevel()); }

  std::vector<Value3> points;           // of the last level, or their limits
  std::vector<std::vector<Value3>> uvs; // [set]

  // Whether OpenSubdiv misreads a UV set. Around a point with two values, when the second value comes again
  // after the first has, it takes it for a third value (FVarLevel::completeTopologyFromFaceValues compares
  // only with the first of the two). So it does not see that the value's faces are separated, which would pin
  // the value.
  bool misreads(size_t set) const;
  // At how many points of the cage a value of the set comes again in a sector that does not touch its first.
  long returning_values(size_t set) const;

  // The rule that a normal comes from, for counting.
  enum Kind { Smooth, Side, Corner, Amid, SemiSharp, Valence2, NonManifold, Flat, KindCount };

  // The unit normals that the corner of a face at a vertex of the last level may have. Empty when the
  // tangents are parallel up to rounding.
  std::vector<Value3> normals(int vertex, int face, Kind &kind) const;

private:
  Kind kind_of(int vertex) const;
  void refine(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts);
  void follow(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts);

  std::unique_ptr<OpenSubdiv::Far::TopologyRefiner> refiner_;
  bool linear_;
  std::vector<Value3> unmoved_; // points of the last level, before the limit
  std::vector<Value3> tangents1_, tangents2_;
  std::unique_ptr<Oracle> next_; // the next level, as long as something is semi-sharp
};
