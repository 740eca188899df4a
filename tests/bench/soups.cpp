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
  if (!uvs.empty()) {
    mesh.uv_set_count = 1;
    mesh.uv_sets[0] = {static_cast<uint32_t>(uvs.size() / 2), uvs.data(), uv_corners.data()};
  }
  mesh.crease_count = static_cast<uint32_t>(crease_sharpness.size());
  mesh.crease_edges = creases.data();
  mesh.crease_sharpness = crease_sharpness.data();
  if (!joints.empty()) mesh.skin = {4, joints.data(), weights.data()};
  return mesh;
}

std::vector<float> Soup::moved() const {
  std::vector<float> to(points);
  for (size_t i = 0; i < to.size(); i += 3) to[i] += 0.1F * std::sin(3 * to[i + 1]);
  return to;
}

namespace {

using Quad = std::array<uint32_t, 4>;

// Creates the points of the ball, identified by their place on the cube's lattice.
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

Soup ball(int n, bool shuffled) {
  Soup soup;
  Lattice lattice(soup, n);
  std::mt19937 random(7);
  std::vector<Quad> quads;
  for (size_t axis = 0; axis < 3; axis++)
    for (bool far : {false, true}) add_side(lattice, n, axis, far, quads);
  if (shuffled) std::shuffle(quads.begin(), quads.end(), random);
  for (const Quad &q : quads) soup.face({q[0], q[1], q[2], q[3]});
  return soup;
}

// ---- isosurface ------------------------------------------------------------------------------

namespace {

using Cell = std::array<int, 3>;

// A wavy scalar field; inside is where it is below 0.
double field(const Cell &p, int n) {
  double x = 4.0 * p[0] / n - 2, y = 4.0 * p[1] / n - 2, z = 4.0 * p[2] / n - 2;
  return std::sin(2.1 * x) * std::cos(1.7 * y) + std::sin(1.9 * y) * std::cos(2.3 * z) +
         std::sin(2.2 * z) * std::cos(1.8 * x) + 0.4 * std::sin(5 * x + 3 * y) + 0.1;
}

class Marching {
public:
  Marching(Soup &soup, int n) : soup_(soup), n_(n) {}

  void run() {
    for (int z = 0; z < n_; z++)
      for (int y = 0; y < n_; y++)
        for (int x = 0; x < n_; x++) cell({x, y, z});
  }

private:
  using Crossing = std::pair<Cell, Cell>; // an edge of the grid, its lower end first

  bool inside(const Cell &p) const { return field(p, n_) < 0; }

  static Crossing crossing(const Cell &a, const Cell &b) { return a < b ? Crossing(a, b) : Crossing(b, a); }

  uint32_t point(const Crossing &c) {
    auto [place, fresh] = names_.emplace(c, static_cast<uint32_t>(names_.size()));
    if (fresh) {
      double a = field(c.first, n_), b = field(c.second, n_), t = a / (a - b);
      for (size_t i = 0; i < 3; i++)
        soup_.points.push_back(static_cast<float>((c.first[i] + t * (c.second[i] - c.first[i])) / n_));
    }
    return place->second;
  }

  // The surface leaves a face of the cell where a run of inner corners ends, and enters it where the run
  // begins.
  void cross_face(const std::array<Cell, 4> &face, std::map<Crossing, Crossing> &next) {
    for (size_t end = 0; end < 4; end++) {
      size_t after = (end + 1) % 4, first = end;
      if (!inside(face[end]) || inside(face[after])) continue;
      while (inside(face[(first + 3) % 4])) first = (first + 3) % 4;
      next[crossing(face[end], face[after])] = crossing(face[(first + 3) % 4], face[first]);
    }
  }

  void cell(const Cell &at) {
    std::map<Crossing, Crossing> next;
    for (size_t axis = 0; axis < 3; axis++)
      for (int far = 0; far < 2; far++) {
        std::array<Cell, 4> face;
        for (size_t k = 0; k < 4; k++) {
          Cell p = at;
          size_t turn = far ? k : 3 - k; // counter-clockwise from outside
          p[axis] += far;
          p[(axis + 1) % 3] += turn == 1 || turn == 2;
          p[(axis + 2) % 3] += turn >= 2;
          face[k] = p;
        }
        cross_face(face, next);
      }
    while (!next.empty()) {
      std::vector<uint32_t> loop;
      for (auto step = next.begin(); step != next.end();) {
        loop.push_back(point(step->first));
        Crossing on = step->second;
        next.erase(step);
        step = next.find(on);
      }
      for (size_t i = 2; i < loop.size(); i++) soup_.face({loop[0], loop[i - 1], loop[i]});
    }
  }

  Soup &soup_;
  int n_;
  std::map<Crossing, uint32_t> names_;
};

} // namespace

Soup isosurface(int n) {
  Soup soup;
  Marching(soup, n).run();
  return soup;
}

// ---- character -------------------------------------------------------------------------------

namespace {

void add_skin(Soup &soup) {
  for (size_t p = 0; p < soup.points.size() / 3; p++) {
    double along = 5 * (1.2 + static_cast<double>(soup.points[3 * p + 1])); // bones along y
    int bone = static_cast<int>(along);
    float share = static_cast<float>(along - bone);
    for (int k = 0; k < 4; k++) soup.joints.push_back(static_cast<uint16_t>(k < 2 ? bone + k : 0));
    soup.weights.insert(soup.weights.end(), {1 - share, share, 0, 0});
  }
}

} // namespace

Soup character(int n) {
  Soup soup;
  Lattice lattice(soup, n);
  uint32_t side = static_cast<uint32_t>(n), uv_row = side + 1;
  for (uint32_t chart = 0; chart < 6; chart++) {
    std::vector<Quad> quads;
    add_side(lattice, n, chart / 2, chart % 2 == 1, quads);
    auto add = [&](const Quad &quad, std::initializer_list<size_t> corners, const Quad &values) {
      for (size_t k : corners) {
        soup.corners.push_back(quad[k]);
        soup.uv_corners.push_back(values[k]);
      }
      soup.offsets.push_back(static_cast<uint32_t>(soup.corners.size()));
    };
    for (uint32_t q = 0; q < quads.size(); q++) {
      uint32_t low = chart * uv_row * uv_row + q / side * uv_row + q % side;
      Quad values{low, low + uv_row, low + uv_row + 1, low + 1};
      if (chart % 2 == 0) std::swap(values[1], values[3]);
      if (q % 3 == 0) {
        add(quads[q], {0, 1, 2}, values);
        add(quads[q], {0, 2, 3}, values);
      } else {
        add(quads[q], {0, 1, 2, 3}, values);
      }
      if (chart > 1 || q % side != 0) continue; // along one end of each line of quads
      size_t far = chart % 2 == 0 ? 3 : 1;
      soup.creases.insert(soup.creases.end(), {quads[q][0], quads[q][far]});
      soup.crease_sharpness.push_back(chart == 0 ? 10.0F : 1.5F);
    }
    for (uint32_t i = 0; i < uv_row * uv_row; i++) {
      soup.uvs.push_back(
          (static_cast<float>(chart) + static_cast<float>(i / uv_row) / static_cast<float>(n)) / 6);
      soup.uvs.push_back(static_cast<float>(i % uv_row) / static_cast<float>(n));
    }
  }
  add_skin(soup);
  return soup;
}

Soup read_obj(const std::string &file) {
  std::ifstream in(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  tw_model *model = nullptr;
  tw_error error{};
  if (tw_obj_read(reinterpret_cast<const uint8_t *>(text.data()), text.size(), TW_WELD_AUTO, &model,
                  &error) != TW_OK) {
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
