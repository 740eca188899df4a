// Polygon soups that the benchmarks subdivide.
#ifndef TWEEND_SOUPS_HPP
#define TWEEND_SOUPS_HPP

#include <initializer_list>
#include <string>
#include <vector>

#include "tweend/format.h"

struct Soup {
  std::vector<float> points;
  std::vector<uint32_t> offsets{0}, corners;
  std::vector<float> uvs;           // empty: none
  std::vector<uint32_t> uv_corners; // of each corner
  std::vector<uint32_t> creases;    // pairs of points
  std::vector<float> crease_sharpness;
  std::vector<uint16_t> joints; // four a point; empty: none
  std::vector<float> weights;

  void face(std::initializer_list<uint32_t> face);
  tw_mesh mesh() const; // a view
  // The points moved a little, as by an animation.
  std::vector<float> moved() const;
};

// A cube of n x n quads a side, inflated to a bumpy ball. shuffled: faces in random order.
Soup ball(int n, bool shuffled);

// Like a scan: an isosurface in a box of n x n x n cells by marching cubes, of triangles of all shapes, with
// valences from three to a dozen, and borders where the box cuts it.
Soup isosurface(int n);

// Like a character's cage: 6 n n quads of which every third is cut into two triangles, with a UV chart for
// each side, creases around two of them and a skin of a dozen joints.
Soup character(int n);

// The first mesh of an OBJ file; exits when it cannot be read.
Soup read_obj(const std::string &file);

#endif
