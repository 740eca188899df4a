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

  void face(std::initializer_list<uint32_t> face);
  tw_mesh mesh() const; // a view
  // The same points a little elsewhere, as an animation would have them.
  std::vector<float> moved() const;
};

// A cube of n x n quads a side, blown up to a bumpy ball; each quad as two triangles if so asked, split
// at random. Faces come in random order when shuffled.
Soup ball(int n, bool triangles, bool shuffled);

// The first mesh of an OBJ file; ends the program when it is none.
Soup read_obj(const std::string &file);

#endif
