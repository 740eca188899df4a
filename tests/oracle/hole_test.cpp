// TW_FILL_TRIANGLES covers holes with the same area as CGAL's minimal triangulation. TAP.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Simple_cartesian.h>

#include "tweend/edit.h"

namespace {

using kernel = CGAL::Simple_cartesian<double>;
using point = kernel::Point_3;
using loop = std::vector<point>;

double area_of(const point &a, const point &b, const point &c) {
  return std::sqrt(CGAL::cross_product(b - a, c - a).squared_length()) / 2;
}

// The weight that CGAL's dynamic program minimises: here only the sum of the areas.
class total_area {
public:
  explicit total_area(double sum) : sum(sum) {}
  template <class table>
  total_area(const loop &points, const loop &, int i, int j, int k, const table &)
      : sum(area_of(at(points, i), at(points, j), at(points, k))) {}
  double get() const { return sum; }
  total_area operator+(const total_area &other) const { return total_area(sum + other.sum); }
  bool operator<(const total_area &other) const { return sum < other.sum; }
  bool operator==(const total_area &other) const { return sum == other.sum; }
  bool operator!=(const total_area &other) const { return sum != other.sum; }
  static total_area DEFAULT() { return total_area(0); }
  static total_area NOT_VALID() { return total_area(-1); }

private:
  static const point &at(const loop &points, int i) { return points[static_cast<size_t>(i)]; }
  double sum;
};

struct any_triangle {
  bool operator()(const loop &, int, int, int) const { return true; }
};

struct no_tracer {
  template <class table> void operator()(const table &, int, int) const {}
};

double area_by_cgal(loop points) {
  using calculator = CGAL::internal::Weight_calculator<total_area, any_triangle>;
  using visitor = CGAL::Polygon_mesh_processing::Hole_filling::Default_visitor;
  points.push_back(points.front());
  no_tracer tracer;
  visitor watcher;
  CGAL::internal::Triangulate_hole_polyline<kernel, no_tracer, calculator, visitor,
                                            CGAL::internal::Lookup_table>
      fill;
  return fill(points, loop(), tracer, calculator(), watcher).get();
}

// The area that fills the hole behind a mesh of one face, which has no edges but that face's. Negative on
// failure.
double area_by_tweend(const loop &points) {
  const auto count = static_cast<uint32_t>(points.size());
  std::vector<float> positions;
  std::vector<uint32_t> corners;
  for (const point &p : points)
    for (int i = 0; i < 3; i++) positions.push_back(static_cast<float>(p[i]));
  for (uint32_t i = 0; i < count; i++) corners.push_back(count - 1 - i);
  const uint32_t offsets[] = {0, count};
  tw_mesh mesh, out;
  tw_mesh_init(&mesh);
  mesh.point_count = mesh.corner_count = count;
  mesh.positions = positions.data();
  mesh.face_count = 1;
  mesh.face_offsets = offsets;
  mesh.corners = corners.data();
  tw_edit fill{};
  fill.kind = TW_EDIT_FILL;
  fill.fill.method = TW_FILL_TRIANGLES;
  const tw_edit_limits limits{1 << 20, 1 << 20, 1 << 20, 1 << 20, nullptr};
  const std::unique_ptr<tw_arena, void (*)(tw_arena *)> arena(tw_arena_create(), tw_arena_destroy);
  if (tw_mesh_edit(&mesh, nullptr, &fill, 1, &limits, arena.get(), &out, nullptr, nullptr, nullptr,
                   nullptr) != TW_OK)
    return -1;
  if (out.face_count != 1 + count - 2) return -2;
  double sum = 0;
  for (uint32_t f = 1; f < out.face_count; f++) {
    const uint32_t *triangle = out.corners + out.face_offsets[f];
    sum += area_of(points[triangle[0]], points[triangle[1]], points[triangle[2]]);
  }
  return sum;
}

// Rounds to a value that a float holds exactly.
double rounded(double value) {
  return std::round(value * 4096) / 4096;
}

// A ring of points that deviate from its plane by up to `height`, and from its circle by up to `depth`.
loop ring(std::mt19937 &random, int count, double height, double depth) {
  std::uniform_real_distribution<double> any(-1, 1);
  loop points;
  for (int i = 0; i < count; i++) {
    const double angle = 2 * std::acos(-1.0) * i / count, radius = 1 + depth * any(random);
    points.emplace_back(rounded(radius * std::cos(angle)), rounded(radius * std::sin(angle)),
                        rounded(height * any(random)));
  }
  return points;
}

int tests = 0, failures = 0;

void compare(const std::string &name, double height, double depth) {
  std::mt19937 random(1);
  double worst = 0;
  for (int count = 3; count <= 80; count++) {
    const loop points = ring(random, count, height, depth);
    const double expected = area_by_cgal(points), found = area_by_tweend(points);
    worst = std::max(worst, std::abs(found / expected - 1));
  }
  const bool is_right = worst < 1e-9;
  failures += !is_right;
  std::printf("%sok %d - %s\n", is_right ? "" : "not ", ++tests, name.c_str());
  if (!is_right) std::printf("# areas differ by %g\n", worst);
}

} // namespace

int main() {
  compare("rings in a plane", 0, 0);
  compare("rings in a plane with bays", 0, 0.9);
  compare("rings that leave their plane", 0.3, 0.3);
  compare("tangles", 2, 0.9);
  std::printf("1..%d\n", tests);
  return failures > 0 ? 1 : 0;
}
