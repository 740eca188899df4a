#include "soups.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <random>

void Soup::face(std::initializer_list<uint32_t> face) {
  corners.insert(corners.end(), face);
  offsets.push_back(static_cast<uint32_t>(corners.size()));
}

tw_mesh Soup::mesh() const {
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = static_cast<uint32_t>(points.size() / 3);
  mesh.positions = points.data();
  mesh.face_count = static_cast<uint32_t>(offsets.size() - 1);
  mesh.corner_count = static_cast<uint32_t>(corners.size());
  mesh.face_offsets = offsets.data();
  mesh.corners = corners.data();
  return mesh;
}

std::vector<float> Soup::moved() const {
  std::vector<float> to(points);
  for (size_t i = 0; i < to.size(); i += 3) to[i] += 0.1F * std::sin(3 * to[i + 1]);
  return to;
}

namespace {

using Quad = std::array<uint32_t, 4>;

// Points of the ball, named by their place on the cube's lattice.
class Lattice {
public:
  Lattice(Soup &soup, int n) : soup_(soup), n_(n) {}

  uint32_t point(const std::array<int, 3> &p) {
    auto [place, fresh] = names_.emplace(p, static_cast<uint32_t>(names_.size()));
    if (fresh) {
      double x = 2.0 * p[0] / n_ - 1, y = 2.0 * p[1] / n_ - 1, z = 2.0 * p[2] / n_ - 1;
      double length = std::sqrt(x * x + y * y + z * z), radius = 1 + 0.1 * std::sin(5 * x) * std::cos(4 * y);
      for (double value : {x, y, z}) soup_.points.push_back(static_cast<float>(value / length * radius));
    }
    return place->second;
  }

private:
  Soup &soup_;
  int n_;
  std::map<std::array<int, 3>, uint32_t> names_;
};

void add_side(Lattice &lattice, int n, size_t axis, bool far, std::vector<Quad> &quads) {
  auto at = [&](int u, int v) {
    std::array<int, 3> p{};
    p[axis] = far ? n : 0;
    p[(axis + 1) % 3] = u;
    p[(axis + 2) % 3] = v;
    return lattice.point(p);
  };
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      Quad quad{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
      if (!far) std::swap(quad[1], quad[3]);
      quads.push_back(quad);
    }
}

} // namespace

Soup ball(int n, bool triangles, bool shuffled) {
  Soup soup;
  Lattice lattice(soup, n);
  std::mt19937 random(7);
  std::vector<Quad> quads;
  for (size_t axis = 0; axis < 3; axis++)
    for (bool far : {false, true}) add_side(lattice, n, axis, far, quads);
  if (shuffled) std::shuffle(quads.begin(), quads.end(), random);
  for (const Quad &q : quads) {
    if (!triangles) {
      soup.face({q[0], q[1], q[2], q[3]});
    } else if (random() % 2) {
      soup.face({q[0], q[1], q[2]});
      soup.face({q[0], q[2], q[3]});
    } else {
      soup.face({q[0], q[1], q[3]});
      soup.face({q[1], q[2], q[3]});
    }
  }
  return soup;
}

Soup read_obj(const std::string &file) {
  std::ifstream in(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  tw_model *model = nullptr;
  tw_error error{};
  if (tw_obj_read(reinterpret_cast<const uint8_t *>(text.data()), text.size(), &model, &error) != TW_OK) {
    std::fprintf(stderr, "%s: line %llu: %s\n", file.c_str(), static_cast<unsigned long long>(error.line),
                 error.detail);
    std::exit(1);
  }
  if (model->mesh_count == 0) {
    std::fprintf(stderr, "%s: no mesh\n", file.c_str());
    std::exit(1);
  }
  const tw_mesh &mesh = model->meshes[0];
  Soup soup;
  soup.points.assign(mesh.positions, mesh.positions + 3 * size_t{mesh.point_count});
  soup.offsets.assign(mesh.face_offsets, mesh.face_offsets + mesh.face_count + 1);
  soup.corners.assign(mesh.corners, mesh.corners + mesh.corner_count);
  tw_model_destroy(model);
  return soup;
}
