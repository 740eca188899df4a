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
  std::vector<uint16_t> joints; // four of each point; empty: none
  std::vector<float> weights;

  void face(std::initializer_list<uint32_t> face);
  tw_mesh mesh() const; // a view
  // The same points a little elsewhere, as an animation would have them.
  std::vector<float> moved() const;
};

// A cube of n x n quads a side, blown up to a bumpy ball. Faces come in random order when shuffled.
Soup ball(int n, bool shuffled);

// What a scan is like: an isosurface in a box of n x n x n cells by marching cubes, of triangles of all
// shapes round points of three to a dozen, with borders where the box cuts it.
Soup isosurface(int n);

// What a character's cage is like: 6 n n quads of which every third is two triangles, with a chart of UVs for
// each side, creases round two of them and a skin of a dozen joints.
Soup character(int n);

// The first mesh of an OBJ file; ends the program when it is none.
Soup read_obj(const std::string &file);

#endif
