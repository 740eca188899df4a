// A surface held against OpenSubdiv's, row by row: connectivity, points, attributes of points, normals, UVs.
//
// What differs from OpenSubdiv, and how it is compared:
// - Normals where several sides meet. OpenSubdiv's tangents are those of one side, as its storage has it.
//   Every row of ours is held against OpenSubdiv's masks for the side that the row's own faces lie on,
//   between infinitely sharp edges.
// - Normals where something semi-sharp has yet to decay. OpenSubdiv takes it for sharp, and so has one of two
//   sides again. Ours are those of the vertex after all decay, as OpenSubdiv has them at the level at which
//   it has just decayed. Limit points count it as sharp with both.
// - Sharp points amid faces, without sharp edges that part them, and points of valence 2 have no tangent
//   plane: the normal is that of one of the faces there, with both.
// - Non-manifold points are corners to OpenSubdiv, its tangents along any two edges. Ours are those of the
//   row's own face, or of its side where the surface is a regular patch right there.
// - Open borders are not OpenSubdiv's: tests/unit/open_test.c.
// - Limits of UVs on bilinear surfaces: OpenSubdiv applies the smooth mask along seams, although its refined
//   values are linear there. Ours stay where they are.
// - UV sets that OpenSubdiv misreads are left out and counted (Oracle::misreads).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "oracle.hpp"

// What was compared so far, and the UV sets that were not.
extern long compared_normals[Oracle::KindCount];
extern int misread_sets;

std::string text_of(const tw_surface_options &options);

// Three attributes that are the points of a cage once more, so that what holds for these holds for them.
class PointAttributes {
public:
  explicit PointAttributes(const Cage &cage);
  void give(tw_mesh &mesh) const;

private:
  std::vector<float> single_, pair_, four_;
  tw_attribute attributes_[3];
};

// Of a cage, modelled on some of its levels.
class Comparison {
public:
  Comparison(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts = {});

  // What differs; "" where nothing does. With all that the mesh bears and its points alone, which are made in
  // other ways. The mesh is the cage's, with its PointAttributes or without.
  std::string run();
  std::string run(tw_mesh mesh);

  // Of the last run, with all that the mesh bears: OpenSubdiv's vertex of each row of TW_DOMAIN_POINTS.
  const std::vector<int> &theirs() const { return theirs_; }
  const Oracle &oracle() const { return oracle_; }
  double diameter() const { return diameter_; }

private:
  std::string run(const tw_mesh &mesh, const tw_surface_options &options);
  std::string compare(tw_surface *surface, tw_surface_reader *reader, int depth);

  const Cage &cage_;
  tw_surface_options options_;
  Oracle oracle_;
  std::unique_ptr<Oracle> plain_; // what attributes are of, where points are modelled
  std::vector<int> theirs_;
  double diameter_ = 0;
};
