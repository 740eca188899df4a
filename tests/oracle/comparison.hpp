// Compares a surface with OpenSubdiv's, row by row: connectivity, points, attributes of points and of
// corners, normals, UVs.
//
// Differences from OpenSubdiv, and how they are compared:
// - Normals where several sides meet. OpenSubdiv's tangents are those of one side, depending on its storage.
// Each row is compared with OpenSubdiv's masks for the side, between infinitely sharp edges, on which the
// row's own faces lie.
// - Normals where semi-sharp edges or vertices have not yet decayed. OpenSubdiv treats these as sharp, and
// again returns one of two sides. tweend's normals are those of the vertex after all decay, as OpenSubdiv has
// them at the level where it has just decayed. For limit points both count them as sharp.
// - Sharp points amid faces, without sharp edges that separate these, and points of valence 2 have no tangent
// plane: with both libraries the normal is that of one of the faces there.
// - Non-manifold points are corners to OpenSubdiv, with tangents along any two edges. tweend's normals are
// those of the row's own face, or of its side where the surface is a regular patch there.
// - OpenSubdiv has no open borders: tests/unit/open_test.c tests these.
// - Limits of UVs on bilinear surfaces: OpenSubdiv applies the smooth mask along seams, although its refined
// values are linear there. tweend's stay where they are.
// - UV sets that OpenSubdiv misreads are left out and counted (Oracle::misreads).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "oracle.hpp"

// How many normals of each kind were compared so far, and how many UV sets were left out.
extern long compared_normals[Oracle::KindCount];
extern int misread_sets;
extern long returning_values; // points of compared UV sets around which a value comes, goes and comes again
// Numbers at corners: of UV sets, and of attributes with values of corners.
extern long compared_uvs, compared_colors;

std::string text_of(const tw_surface_options &options);

// Three attributes with the coordinates of a cage's points as values: they must be refined as the points are.
class PointAttributes {
public:
  static constexpr size_t COUNT = 3;
  explicit PointAttributes(const Cage &cage);
  void give(tw_mesh &mesh) const;

private:
  std::vector<float> single_, pair_, four_;
  tw_attribute attributes_[COUNT] = {};
};

// A mesh's attributes, then one for each of its UV sets, with values of corners: u v v u. They must be
// refined as the UVs are.
class CornerAttributes {
public:
  explicit CornerAttributes(const tw_mesh &mesh);
  void give(tw_mesh &mesh) const;

private:
  std::vector<float> values_[TW_UV_SETS_MAX];
  std::vector<tw_attribute> attributes_;
};

// Compares the surface of a cage, which may be sculpted on some of its levels.
class Comparison {
public:
  Comparison(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts = {});

  // Returns what differs, "" for nothing. Compares the mesh with all its data, and again with points alone,
  // which the library computes in other ways. mesh: the cage's, with its PointAttributes or without.
  std::string run();
  std::string run(tw_mesh mesh);

  // Of the last run with all data: OpenSubdiv's vertex for each row of TW_DOMAIN_POINTS.
  const std::vector<int> &theirs() const { return theirs_; }
  const Oracle &oracle() const { return oracle_; }
  double diameter() const { return diameter_; }

private:
  std::string run(const tw_mesh &mesh, const tw_surface_options &options);
  std::string compare(tw_surface *surface, tw_surface_reader *reader, int depth);

  const Cage &cage_;
  tw_surface_options options_;
  Oracle oracle_;
  std::unique_ptr<Oracle> plain_; // unsculpted, for attributes; null: not sculpted
  std::vector<int> theirs_;
  double diameter_ = 0;
};
