// Cages for the comparison with OpenSubdiv: hand-made cages for each rule, and random cages.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tweend/subdiv.h"

struct UvSet {
  std::vector<float> values;           // u v
  std::vector<std::vector<int>> faces; // in the order of the cage's faces
};

struct Cage {
  std::string name;
  std::vector<float> points; // x y z
  std::vector<std::vector<int>> faces;
  std::vector<UvSet> uv_sets;
  std::vector<std::array<int, 2>> creases;
  std::vector<float> crease_sharpness;
  std::vector<int> corners;
  std::vector<float> corner_sharpness;
  std::vector<int> holes;

  int point_count() const { return static_cast<int>(points.size() / 3); }
};

// A cage as a tw_mesh. Owns the index arrays; values such as positions stay the cage's, which must outlive
// the view.
class CageView {
public:
  explicit CageView(const Cage &cage);
  CageView(const CageView &) = delete;
  tw_mesh mesh;

private:
  std::vector<uint32_t> offsets_, corners_, uv_corners_[TW_UV_SETS_MAX], creases_, sharp_points_, holes_;
};

Cage cube();
Cage grid(int columns, int rows);
Cage torus(int columns, int rows);
Cage icosahedron();
std::vector<Cage> hand_made();

// The same for Loop's scheme, with triangles only.
std::vector<Cage> hand_made_triangles();

// Random cages: with faces cut, merged and removed, moved points, tags, and UVs with seams.
Cage random_cage(std::mt19937 &random);
Cage random_triangle_cage(std::mt19937 &random);
// A random cage with UVs that come, go and come again around points: their sectors do not touch.
Cage random_alternating_cage(std::mt19937 &random);
