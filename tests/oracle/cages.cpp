#include "cages.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

CageView::CageView(const Cage &cage) {
  tw_mesh_init(&mesh);
  offsets_.push_back(0);
  for (size_t f = 0; f < cage.faces.size(); f++) {
    for (int point : cage.faces[f]) corners_.push_back(static_cast<uint32_t>(point));
    offsets_.push_back(static_cast<uint32_t>(corners_.size()));
  }
  for (const auto &crease : cage.creases)
    for (int point : crease) creases_.push_back(static_cast<uint32_t>(point));
  for (int point : cage.corners) sharp_points_.push_back(static_cast<uint32_t>(point));
  for (int face : cage.holes) holes_.push_back(static_cast<uint32_t>(face));
  mesh.point_count = static_cast<uint32_t>(cage.point_count());
  mesh.positions = cage.points.data();
  mesh.face_count = static_cast<uint32_t>(cage.faces.size());
  mesh.corner_count = static_cast<uint32_t>(corners_.size());
  mesh.face_offsets = offsets_.data();
  mesh.corners = corners_.data();
  for (const UvSet &set : cage.uv_sets) {
    std::vector<uint32_t> &corners = uv_corners_[mesh.uv_set_count];
    for (const auto &face : set.faces)
      for (int uv : face) corners.push_back(static_cast<uint32_t>(uv));
    uint32_t count = static_cast<uint32_t>(set.values.size() / 2);
    mesh.uv_sets[mesh.uv_set_count++] = {count, set.values.data(), corners.data()};
  }
  mesh.crease_count = static_cast<uint32_t>(cage.creases.size());
  mesh.crease_edges = creases_.data();
  mesh.crease_sharpness = cage.crease_sharpness.data();
  mesh.sharp_point_count = static_cast<uint32_t>(cage.corners.size());
  mesh.sharp_points = sharp_points_.data();
  mesh.point_sharpness = cage.corner_sharpness.data();
  mesh.hole_count = static_cast<uint32_t>(holes_.size());
  mesh.holes = holes_.data();
}

Cage cube() {
  Cage cage;
  cage.name = "cube";
  for (int z = -1; z <= 1; z += 2)
    for (int y = -1; y <= 1; y += 2)
      for (int x = -1; x <= 1; x += 2)
        for (int value : {x, y, z}) cage.points.push_back(static_cast<float>(value));
  cage.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {1, 3, 7, 5}, {3, 2, 6, 7}, {2, 0, 4, 6}};
  return cage;
}

static UvSet uv_grid(int columns, int rows) {
  UvSet set;
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < columns; x++) {
      set.values.push_back(static_cast<float>(x) / 7);
      set.values.push_back(static_cast<float>(y) / 5);
    }
  return set;
}

Cage grid(int columns, int rows) {
  Cage cage;
  cage.name = "grid";
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < columns; x++) {
      cage.points.push_back(static_cast<float>(x));
      cage.points.push_back(static_cast<float>(y));
      cage.points.push_back(0.3f * static_cast<float>((x * x + 3 * y) % 4));
    }
  for (int y = 0; y + 1 < rows; y++)
    for (int x = 0; x + 1 < columns; x++) {
      int a = y * columns + x;
      cage.faces.push_back({a, a + 1, a + columns + 1, a + columns});
    }
  cage.uv_sets.push_back(uv_grid(columns, rows));
  cage.uv_sets[0].faces = cage.faces;
  return cage;
}

Cage torus(int columns, int rows) {
  Cage cage;
  cage.name = "torus";
  cage.uv_sets.push_back(uv_grid(columns + 1, rows + 1));
  const double turn = 2 * std::acos(-1.0);
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < columns; x++) {
      double u = turn * x / columns, v = turn * y / rows, radius = 2 + std::cos(v);
      cage.points.push_back(static_cast<float>(radius * std::cos(u)));
      cage.points.push_back(static_cast<float>(radius * std::sin(u)));
      cage.points.push_back(static_cast<float>(std::sin(v)));
    }
  for (int y = 0; y < rows; y++)
    for (int x = 0; x < columns; x++) {
      auto at = [&](int i, int j) { return (j % rows) * columns + i % columns; };
      cage.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
      // UVs are unrolled, with seams where the torus closes.
      auto uv = [&](int i, int j) { return j * (columns + 1) + i; };
      cage.uv_sets[0].faces.push_back({uv(x, y), uv(x + 1, y), uv(x + 1, y + 1), uv(x, y + 1)});
    }
  return cage;
}

Cage icosahedron() {
  Cage cage;
  cage.name = "icosahedron";
  const float g = 1.618034f;
  cage.points = {-1, g,  0,  1, g, 0,  -1, -g, 0,  1, -g, 0, 0,  -1, g,  0,  1, g,
                 0,  -1, -g, 0, 1, -g, g,  0,  -1, g, 0,  1, -g, 0,  -1, -g, 0, 1};
  cage.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return cage;
}

static Cage named(Cage cage, const char *name) {
  cage.name = name;
  return cage;
}

static Cage with_crease(Cage cage, const std::vector<int> &path, float sharpness) {
  for (size_t i = 0; i + 1 < path.size(); i++) {
    cage.creases.push_back({path[i], path[i + 1]});
    cage.crease_sharpness.push_back(sharpness);
  }
  return cage;
}

static std::vector<std::vector<int>> fans(const std::vector<std::vector<int>> &faces) {
  std::vector<std::vector<int>> triangles;
  for (const auto &face : faces)
    for (size_t i = 1; i + 1 < face.size(); i++) triangles.push_back({face[0], face[i], face[i + 1]});
  return triangles;
}

// Cuts every face into a fan of triangles. All triangles of a hole are holes.
static Cage triangulated(Cage cage) {
  std::vector<int> holes;
  int first = 0;
  for (size_t f = 0; f < cage.faces.size(); f++) {
    int count = static_cast<int>(cage.faces[f].size()) - 2;
    if (std::count(cage.holes.begin(), cage.holes.end(), static_cast<int>(f)))
      for (int i = 0; i < count; i++) holes.push_back(first + i);
    first += count;
  }
  cage.holes = holes;
  cage.faces = fans(cage.faces);
  for (UvSet &set : cage.uv_sets) set.faces = fans(set.faces);
  return cage;
}

std::vector<Cage> hand_made() {
  std::vector<Cage> cages = {cube(),     grid(4, 4),  grid(2, 2),   grid(3, 2),
                             grid(6, 5), torus(6, 5), icosahedron()};
  cages.push_back(
      named(with_crease(cube(), {0, 1, 3, 2, 0}, 10), "cube with one face inside an infinite crease"));
  cages.push_back(named(with_crease(cube(), {0, 1, 3, 2, 0}, 2.5f), "cube with a semi-sharp crease"));
  cages.push_back(named(with_crease(cube(), {0, 1}, 10), "cube with a crease of one edge: two darts"));
  cages.push_back(named(with_crease(cube(), {0, 1, 3}, 1.3f), "cube with a semi-sharp path"));
  cages.push_back(
      named(with_crease(with_crease(grid(6, 6), {12, 13, 14, 15, 16, 17}, 3), {2, 8, 14, 20, 26, 32}, 1.7f),
            "grid with two creases that cross"));
  cages.push_back(
      named(with_crease(grid(6, 6), {7, 8, 9, 15, 21}, 10), "grid with an infinite crease that turns"));
  const std::vector<int> rim = {0, 1, 2, 3, 4, 9, 14, 19, 18, 17, 16, 15, 10, 5, 0};
  cages.push_back(named(with_crease(grid(5, 4), rim, 10), "grid held by creases on its border"));
  cages.push_back(named(with_crease(grid(5, 4), {0, 1, 2, 3, 4, 9, 14}, 10), "grid half held by creases"));
  cages.push_back(named(with_crease(grid(5, 4), rim, 3), "grid with semi-sharp creases on its border"));
  Cage cornered = named(cube(), "cube with sharp points");
  cornered.corners = {0, 3, 5};
  cornered.corner_sharpness = {10, 1.5f, 0.4f};
  cages.push_back(cornered);
  // Around a point of the torus's seam, one value is beside a crease and the other is not.
  const std::vector<int> across = {12, 13, 14, 15}, along = {0, 6, 12, 18, 24, 0};
  Cage seamed = torus(6, 5);
  for (size_t i = 0; i < seamed.uv_sets[0].values.size(); i++)
    seamed.uv_sets[0].values[i] += 0.03f * static_cast<float>(i * i % 11); // bent, so that smoothing acts
  cages.push_back(named(with_crease(seamed, across, 2.3f), "torus with a semi-sharp crease from its seam"));
  cages.push_back(named(with_crease(with_crease(seamed, across, 1.2f), along, 3.4f),
                        "torus with a semi-sharp crease from its semi-sharp seam"));
  Cage holed = named(grid(5, 5), "grid with holes");
  holed.holes = {5, 6};
  cages.push_back(holed);
  Cage fins = named(cube(), "cube with a fin on an edge");
  fins.points.insert(fins.points.end(), {-2, -2, -2, 2, -2, -2});
  fins.faces.push_back({0, 1, 9, 8});
  cages.push_back(fins);
  Cage bow = named(grid(3, 3), "two quads that share a point");
  bow.faces = {bow.faces[0], bow.faces[3]};
  bow.uv_sets[0].faces = bow.faces;
  cages.push_back(bow);
  Cage flipped = named(grid(3, 2), "neighbours of opposite winding");
  std::reverse(flipped.faces[1].begin(), flipped.faces[1].end());
  flipped.uv_sets[0].faces = flipped.faces;
  cages.push_back(flipped);
  Cage pillow = named(grid(2, 2), "two quads back to back: points of valence 2");
  pillow.faces.push_back({0, 2, 3, 1});
  pillow.uv_sets.clear();
  pillow.points[2] = 0.5f;
  cages.push_back(pillow);
  Cage keyhole = named(grid(4, 4), "a face with a hole that it reaches by an edge of its own");
  keyhole.faces = {{0, 1, 2, 3, 7, 11, 15, 14, 13, 12, 8, 4, 0, 5, 9, 10, 6, 5}};
  keyhole.uv_sets.clear();
  cages.push_back(keyhole);
  Cage pinched = named(cube(), "a cube with a face that comes to a point twice");
  pinched.points.insert(pinched.points.end(), {-0.5f, 0.2f, 1, 0.2f, 0.5f, 1.2f});
  pinched.faces[1] = {4, 5, 7, 6, 4, 8, 9};
  cages.push_back(pinched);
  // Many irregular patches of a few kinds.
  const std::vector<int> ring = {0, 1, 2, 3, 4, 5, 6, 7, 0};
  cages.push_back(named(triangulated(torus(8, 3)), "torus of triangles"));
  cages.push_back(named(with_crease(triangulated(torus(8, 3)), ring, 1.7f),
                        "torus of triangles with a semi-sharp crease"));
  return cages;
}

// `faces` triangles around a point: a closed cone, or a fan with a border.
static Cage cone(int faces, bool closed) {
  Cage cage;
  cage.points = {0, 0, 1};
  int rim = closed ? faces : faces + 1;
  const double turn = 2 * std::acos(-1.0);
  for (int i = 0; i < rim; i++) {
    double angle = turn * i / (closed ? faces : faces + 3);
    cage.points.push_back(static_cast<float>(std::cos(angle)));
    cage.points.push_back(static_cast<float>(std::sin(angle)));
    cage.points.push_back(0.1f * static_cast<float>(i % 3));
  }
  for (int i = 0; i < faces; i++) cage.faces.push_back({0, 1 + i, 1 + (i + 1) % rim});
  cage.name = (closed ? "cone of " : "fan of ") + std::to_string(faces) + " triangles";
  return cage;
}

static bool repeats_points(const Cage &cage) {
  return std::any_of(cage.faces.begin(), cage.faces.end(), [](const std::vector<int> &face) {
    return std::set<int>(face.begin(), face.end()).size() < face.size();
  });
}

std::vector<Cage> hand_made_triangles() {
  std::vector<Cage> cages;
  for (const Cage &cage : hand_made())
    if (!repeats_points(cage)) cages.push_back(triangulated(cage));
  for (int faces : {3, 4, 5, 6, 7, 12}) cages.push_back(cone(faces, true));
  for (int faces : {1, 2, 3, 4, 6}) cages.push_back(cone(faces, false));
  Cage tetrahedron;
  tetrahedron.name = "tetrahedron";
  tetrahedron.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  tetrahedron.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  cages.push_back(tetrahedron);
  cages.push_back(named(with_crease(icosahedron(), {0, 11, 10, 0}, 10), "icosahedron with a sharp face"));
  cages.push_back(
      named(with_crease(icosahedron(), {0, 5, 9, 8}, 1.6f), "icosahedron with a semi-sharp path"));
  cages.push_back(named(with_crease(icosahedron(), {3, 4}, 10), "icosahedron with two darts"));
  cages.push_back(named(with_crease(with_crease(icosahedron(), {5, 0, 10}, 2.3f), {1, 0, 11}, 0.8f),
                        "icosahedron with two creases that cross"));
  Cage cornered = named(icosahedron(), "icosahedron with sharp points");
  cornered.corners = {0, 3, 5};
  cornered.corner_sharpness = {10, 1.5f, 0.4f};
  cages.push_back(cornered);
  Cage pillow;
  pillow.name = "two triangles back to back";
  pillow.points = {0, 0, 0, 1, 0, 0, 0, 1, 0.5f};
  pillow.faces = {{0, 1, 2}, {0, 2, 1}};
  cages.push_back(pillow);
  Cage pages = named(cone(2, false), "three triangles on an edge");
  pages.points.insert(pages.points.end(), {0.5f, 0.2f, 2});
  pages.faces.push_back({2, 0, 4});
  cages.push_back(pages);
  return cages;
}

// ---- random cages --------------------------------------------------------------------------

namespace {

class Shaper {
public:
  Shaper(Cage cage, std::mt19937 &random) : cage_(std::move(cage)), random_(random) {}

  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  float unit() { return static_cast<float>(random_() % 100001) / 100000; }

  void remove_faces(int count) {
    for (int i = 0; i < count && cage_.faces.size() > 2; i++)
      erase(pick(static_cast<int>(cage_.faces.size())));
  }

  // Cuts faces of four or more corners in two by a diagonal.
  void cut_faces(int count) {
    for (int i = 0; i < count; i++) {
      size_t f = static_cast<size_t>(pick(static_cast<int>(cage_.faces.size())));
      if (cage_.faces[f].size() < 4) continue;
      cut(cage_.faces, f);
      for (UvSet &set : cage_.uv_sets) cut(set.faces, f);
    }
  }

  // Cuts every face into triangles by diagonals from a random corner.
  void triangulate() {
    for (size_t f = 0; f < cage_.faces.size(); f++) {
      int turn = pick(static_cast<int>(cage_.faces[f].size()));
      std::rotate(cage_.faces[f].begin(), cage_.faces[f].begin() + turn, cage_.faces[f].end());
      for (UvSet &set : cage_.uv_sets)
        std::rotate(set.faces[f].begin(), set.faces[f].begin() + turn, set.faces[f].end());
      while (cage_.faces[f].size() > 3) {
        cut(cage_.faces, f);
        for (UvSet &set : cage_.uv_sets) cut(set.faces, f);
      }
    }
  }

  // Merges pairs of faces that share an edge, if the outline stays simple.
  void merge_faces(int count) {
    for (int i = 0; i < count; i++) {
      size_t a = static_cast<size_t>(pick(static_cast<int>(cage_.faces.size())));
      size_t b = static_cast<size_t>(pick(static_cast<int>(cage_.faces.size())));
      if (a != b) merge(a, b);
    }
  }

  // Gives single corners their own values: seams around one corner, which end inside the mesh.
  void tear_uvs(UvSet &set, int count) {
    for (int i = 0; i < count; i++) {
      auto &face = set.faces[static_cast<size_t>(pick(static_cast<int>(set.faces.size())))];
      face[static_cast<size_t>(pick(static_cast<int>(face.size())))] = new_value(set);
    }
  }

  // Gives neighbouring faces their own values, as charts have: with a seam all around them, or only between
  // some of them and the faces beyond.
  void cut_chart(UvSet &set, int size, bool round) {
    size_t first = static_cast<size_t>(pick(static_cast<int>(set.faces.size())));
    std::set<size_t> chart = {first};
    for (size_t f = 0; f < set.faces.size() && chart.size() < static_cast<size_t>(size); f++)
      if (share_an_edge(set.faces[f], set.faces[first])) chart.insert(f);
    std::map<int, int> renamed;
    for (size_t f : chart)
      for (int &value : set.faces[f]) {
        if (!renamed.count(value)) renamed[value] = (round || pick(2)) ? new_value(set) : value;
        value = renamed[value];
      }
  }

  // Gives some of the corners that have a value another one, so that either may lie in several sectors.
  void alternate_values(UvSet &set) {
    const auto &face = set.faces[static_cast<size_t>(pick(static_cast<int>(set.faces.size())))];
    int old = face[static_cast<size_t>(pick(static_cast<int>(face.size())))], other = new_value(set);
    for (auto &own : set.faces)
      for (int &value : own)
        if (value == old && pick(2)) value = other;
  }

  void unwrap_anew() {
    if (cage_.uv_sets.empty()) return;
    UvSet second = cage_.uv_sets[0];
    for (float &value : second.values) value = unit();
    cage_.uv_sets.push_back(second);
  }

  std::vector<UvSet> &uv_sets() { return cage_.uv_sets; }

  void tag(int count) {
    static const float values[] = {0.3f, 0.75f, 1, 1.6f, 2, 3.25f, 10, 10};
    std::set<std::pair<int, int>> creased;
    std::set<int> sharp;
    for (int i = 0; i < count; i++) {
      const auto &face = cage_.faces[static_cast<size_t>(pick(static_cast<int>(cage_.faces.size())))];
      size_t at = static_cast<size_t>(pick(static_cast<int>(face.size())));
      int a = face[at], b = face[(at + 1) % face.size()];
      float sharpness = values[pick(8)];
      if (pick(3) > 0) {
        if (!creased.insert(std::minmax(a, b)).second) continue;
        cage_.creases.push_back({a, b});
        cage_.crease_sharpness.push_back(sharpness);
      } else if (sharp.insert(a).second) {
        cage_.corners.push_back(a);
        cage_.corner_sharpness.push_back(sharpness);
      }
    }
  }

  void make_holes(int count) {
    std::set<int> holes;
    for (int i = 0; i < count; i++) holes.insert(pick(static_cast<int>(cage_.faces.size())));
    cage_.holes.assign(holes.begin(), holes.end());
  }

  void move_points(float by) {
    for (float &value : cage_.points) value += by * (unit() - 0.5f);
  }

  // Drops unused points, which would disturb the numbering in the comparison.
  Cage finish() {
    std::map<int, int> renamed;
    std::vector<float> points;
    for (auto &face : cage_.faces)
      for (int &point : face) {
        auto [place, fresh] = renamed.emplace(point, static_cast<int>(renamed.size()));
        if (fresh)
          for (int c = 0; c < 3; c++) points.push_back(cage_.points[static_cast<size_t>(3 * point + c)]);
        point = place->second;
      }
    cage_.points = points;
    return cage_;
  }

private:
  void erase(int face) {
    cage_.faces.erase(cage_.faces.begin() + face);
    for (UvSet &set : cage_.uv_sets) set.faces.erase(set.faces.begin() + face);
  }

  int new_value(UvSet &set) {
    for (int c = 0; c < 2; c++) set.values.push_back(unit());
    return static_cast<int>(set.values.size() / 2) - 1;
  }

  static bool share_an_edge(const std::vector<int> &a, const std::vector<int> &b) {
    return std::count_if(a.begin(), a.end(),
                         [&](int value) { return std::count(b.begin(), b.end(), value) > 0; }) > 1;
  }

  static void cut(std::vector<std::vector<int>> &faces, size_t f) {
    std::vector<int> face = faces[f], rest = {face[0]};
    rest.insert(rest.end(), face.begin() + 2, face.end());
    faces[f] = {face[0], face[1], face[2]};
    faces.push_back(rest);
  }

  // The outline of a with its edge (a[i], a[i + 1]) replaced by b's other points.
  static std::vector<int> joined(const std::vector<int> &a, size_t i, const std::vector<int> &b, size_t j) {
    std::vector<int> out;
    for (size_t k = 0; k < a.size(); k++) out.push_back(a[(i + 1 + k) % a.size()]);
    for (size_t k = 2; k < b.size(); k++) out.push_back(b[(j + k) % b.size()]);
    return out;
  }

  void merge(size_t a, size_t b) {
    const auto &one = cage_.faces[a], &other = cage_.faces[b];
    for (size_t i = 0; i < one.size(); i++)
      for (size_t j = 0; j < other.size(); j++) {
        if (one[i] != other[(j + 1) % other.size()] || one[(i + 1) % one.size()] != other[j]) continue;
        std::vector<int> face = joined(one, i, other, j);
        if (std::set<int>(face.begin(), face.end()).size() != face.size() || face.size() > 9) return;
        for (UvSet &set : cage_.uv_sets) set.faces[a] = joined(set.faces[a], i, set.faces[b], j);
        cage_.faces[a] = face;
        erase(static_cast<int>(b));
        return;
      }
  }

  Cage cage_;
  std::mt19937 &random_;
};

} // namespace

static Cage random_shape(std::mt19937 &random, bool triangles) {
  int kind = static_cast<int>(random() % 4), columns = 3 + static_cast<int>(random() % 5),
      rows = 3 + static_cast<int>(random() % 4);
  Shaper shaper(kind == 0 ? cube() : kind == 1 ? torus(columns, rows) : grid(columns, rows), random);
  int scale = kind == 0 ? 2 : 6;
  shaper.cut_faces(shaper.pick(scale));
  shaper.merge_faces(shaper.pick(20));
  shaper.cut_faces(shaper.pick(scale));
  if (triangles) shaper.triangulate();
  if (shaper.pick(2)) shaper.remove_faces(shaper.pick(scale));
  if (shaper.pick(3) == 0) shaper.unwrap_anew();
  for (UvSet &set : shaper.uv_sets()) {
    shaper.tear_uvs(set, shaper.pick(5));
    for (int charts = shaper.pick(3); charts > 0; charts--)
      shaper.cut_chart(set, 1 + shaper.pick(5), shaper.pick(4));
  }
  if (shaper.pick(3)) shaper.make_holes(shaper.pick(3));
  shaper.move_points(0.5f);
  Cage cage = shaper.finish();
  Shaper tagger(cage, random);
  if (tagger.pick(4)) tagger.tag(tagger.pick(8));
  cage = tagger.finish();
  cage.name = triangles ? "random triangles" : "random cage";
  return cage;
}

Cage random_cage(std::mt19937 &random) {
  return random_shape(random, false);
}

Cage random_triangle_cage(std::mt19937 &random) {
  return random_shape(random, true);
}

Cage random_alternating_cage(std::mt19937 &random) {
  Shaper shaper(random_shape(random, false), random);
  for (UvSet &set : shaper.uv_sets())
    for (int i = 0; i < 3; i++) shaper.alternate_values(set);
  Cage cage = shaper.finish();
  cage.name = "random cage with values that return";
  return cage;
}
