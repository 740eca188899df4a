// Joint weights of surfaces agree with OpenSubdiv, which refines the weights of each joint in double as a
// primvar of its own: rows hold as many of the heaviest joints as the mesh has influences a point, or four
// where so many are asked for. Random cages, one to eight sets of joints, all schemes, levels 0 to 3. Prints
// TAP.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "comparison.hpp"

namespace {

constexpr double tolerance = 1e-5;

struct Skin {
  uint32_t width, joint_count, first_joint;
  std::vector<uint16_t> joints; // [points][width]
  std::vector<float> weights;
};

// Up to `width` different joints a point, of random weights.
Skin random_skin(std::mt19937 &random, int points, uint32_t sets) {
  std::uniform_real_distribution<double> share(0.05, 1);
  Skin skin{4 * sets, 4 * sets + static_cast<uint32_t>(random() % 9), random() % 4 == 0 ? 600u : 0u, {}, {}};
  std::vector<uint16_t> all(skin.joint_count);
  for (uint32_t j = 0; j < skin.joint_count; j++) all[j] = static_cast<uint16_t>(skin.first_joint + j);
  for (int p = 0; p < points; p++) {
    std::shuffle(all.begin(), all.end(), random);
    uint32_t used = 1 + static_cast<uint32_t>(random()) % skin.width;
    double sum = 0;
    std::vector<double> shares(skin.width, 0);
    for (uint32_t k = 0; k < used; k++) sum += shares[k] = share(random);
    for (uint32_t k = 0; k < skin.width; k++) {
      skin.joints.push_back(all[k]);
      skin.weights.push_back(static_cast<float>(shares[k] / sum));
    }
  }
  return skin;
}

// The weight of each joint at every vertex of the level: [joint][vertex].
std::vector<std::vector<double>> refine(const Cage &cage, const Skin &skin,
                                        const tw_surface_options &options) {
  std::vector<std::vector<double>> channels;
  Cage weights = cage;
  for (uint32_t first = 0; first < skin.joint_count; first += 3) {
    std::fill(weights.points.begin(), weights.points.end(), 0.0f);
    for (size_t i = 0; i < skin.joints.size(); i++) {
      uint32_t channel = skin.joints[i] - skin.first_joint - first;
      if (channel < 3) weights.points[3 * (i / skin.width) + channel] += skin.weights[i];
    }
    const Oracle oracle(weights, options);
    for (uint32_t k = 0; k < 3; k++) {
      channels.emplace_back();
      for (const Value3 &value : oracle.points) channels.back().push_back(value.v[k]);
    }
  }
  return channels;
}

// What is wrong with a row; "" for nothing.
std::string judge(const float *joints, const float *weights, uint32_t width, const Skin &skin,
                  const std::vector<std::vector<double>> &channels, size_t vertex) {
  std::vector<double> sorted(skin.joint_count);
  for (uint32_t j = 0; j < skin.joint_count; j++) sorted[j] = channels[j][vertex];
  std::sort(sorted.rbegin(), sorted.rend());
  double kept = 0, sum = 0;
  for (uint32_t k = 0; k < width; k++) kept += sorted[k];
  for (uint32_t k = 0; k < width; k++) {
    double weight = static_cast<double>(weights[k]), wanted = sorted[k] / kept;
    sum += weight;
    if (std::fabs(weight - wanted) > tolerance)
      return "weight " + std::to_string(k) + " is " + std::to_string(weight) + ", not " +
             std::to_string(wanted);
    if (weight == 0) continue;
    uint32_t joint = static_cast<uint32_t>(joints[k]) - skin.first_joint;
    if (joint >= skin.joint_count || std::fabs(channels[joint][vertex] / kept - wanted) > tolerance)
      return "joint " + std::to_string(joint) + " is not the one of weight " + std::to_string(wanted);
    for (uint32_t other = 0; other < k; other++)
      if (joints[other] == joints[k]) return "joint " + std::to_string(joint) + " comes twice";
  }
  return std::fabs(sum - 1) < 1e-6 ? "" : "the weights sum to " + std::to_string(sum);
}

long rows_compared = 0;

// influences: that are asked for; 0: all.
std::string compare(const Cage &cage, const Skin &skin, tw_surface_options options) {
  CageView view(cage);
  view.mesh.skin = {skin.width, skin.joints.data(), skin.weights.data()};
  Comparison comparison(cage, options);
  std::string difference = options.level > 0 ? comparison.run(view.mesh) : "";
  tw_surface *surface = nullptr;
  options.normals = false;
  if (difference.empty() && tw_surface_create(&view.mesh, &options, &surface, nullptr) != TW_OK)
    difference = "no surface";
  if (!difference.empty()) return difference;
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  uint32_t width = options.influences ? std::min(options.influences, skin.width) : skin.width;
  if (layout->influences != width) difference = "rows hold " + std::to_string(layout->influences) + " joints";
  const auto channels = refine(cage, skin, options);
  const size_t count = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  std::vector<float> rows(count * layout->stride);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, count, rows.data());
  if (count != tw_surface_row_count(surface, TW_DOMAIN_POINTS)) difference = "points are split";
  for (size_t i = 0; i < count && difference.empty(); i++) {
    const float *row = rows.data() + i * layout->stride;
    const size_t vertex = options.level > 0 ? static_cast<size_t>(comparison.theirs()[i]) : i;
    for (uint32_t c = 0; c < 3; c++)
      if (std::fabs(static_cast<double>(row[c]) - comparison.oracle().points[vertex].v[c]) >
          1e-4 * comparison.diameter())
        difference = "row " + std::to_string(i) + " is another vertex";
    if (difference.empty())
      difference = judge(row + layout->joints, row + layout->weights, width, skin, channels, vertex);
    rows_compared++;
  }
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
  return difference;
}

std::string compare_random(tw_scheme scheme, int count) {
  std::mt19937 random(20261126);
  for (int i = 0; i < count; i++) {
    Cage cage = scheme == TW_LOOP ? random_triangle_cage(random) : random_cage(random);
    cage.uv_sets.clear();
    tw_surface_options options{};
    options.scheme = scheme;
    options.level = 1 + static_cast<uint32_t>(random() % 3);
    options.boundary = static_cast<tw_boundary>(random() % 3);
    options.creasing = random() % 2 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM;
    options.triangles = random() % 2 ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK;
    options.limit = random() % 2;
    options.influences = random() % 3 ? 0 : 4;
    options.normals = true;
    const Skin skin = random_skin(random, cage.point_count(), 1 + static_cast<uint32_t>(random() % 8));
    std::string difference = compare(cage, skin, options);
    if (!difference.empty())
      return "cage " + std::to_string(i) + ", " + text_of(options) + ", " + std::to_string(skin.width) +
             " influences: " + difference;
  }
  return "";
}

} // namespace

int main() {
  const int count = std::getenv("TESTED_SANITIZED") ? 40 : 300;
  const struct {
    tw_scheme scheme;
    const char *name;
  } kinds[] = {{TW_CATMULL_CLARK, "catmull-clark"}, {TW_LOOP, "loop"}, {TW_BILINEAR, "bilinear"}};
  int tests = 0, failures = 0;
  for (const auto &kind : kinds) {
    const std::string difference = compare_random(kind.scheme, count);
    std::printf("%sok %d - opensubdiv weighs joints as %s does\n", difference.empty() ? "" : "not ", ++tests,
                kind.name);
    if (difference.empty()) continue;
    std::printf("# %s\n", difference.c_str());
    failures++;
  }
  std::printf("1..%d\n# %ld rows compared\n", tests, rows_compared);
  return failures || rows_compared == 0;
}
