// Sculpts levels of random cages. OpenSubdiv, given the moved points, refines that level to the same surface:
// connectivity, points (within 1e-5 of the size), limits (1e-4) and normals (5e-4), while UVs and attributes
// stay as they were. Facts that need no oracle: unchanged points change nothing, a moved cage takes its
// details along, a plan with other positions gives the bytes of a fresh surface.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "comparison.hpp"
#include "tweend/detail.h"

namespace {

std::string with_number(const char *what, double number) {
  char text[100];
  std::snprintf(text, sizeof text, "%s by %g", what, number);
  return text;
}

// All rows of a surface.
std::vector<float> read_rows(const tw_surface *surface, tw_domain domain) {
  const uint64_t count = tw_surface_row_count(surface, domain);
  std::vector<float> rows(count *
                          (domain == TW_DOMAIN_VERTICES ? tw_surface_get_layout(surface)->stride : 3));
  std::unique_ptr<tw_surface_reader, decltype(&tw_surface_reader_destroy)> reader(
      tw_surface_reader_create(surface), tw_surface_reader_destroy);
  tw_surface_read_rows(reader.get(), domain, 0, count, rows.data());
  return rows;
}

using Surface = std::unique_ptr<tw_surface, decltype(&tw_surface_destroy)>;

Surface surface_of(const tw_mesh &mesh, const tw_surface_options &options) {
  tw_surface *surface = nullptr;
  tw_error error{};
  if (tw_surface_create(&mesh, &options, &surface, &error) != TW_OK) {
    std::printf("Bail out! %s: %s\n", text_of(options).c_str(), error.detail);
    std::exit(1);
  }
  return Surface(surface, tw_surface_destroy);
}

std::vector<float> points_of(const tw_mesh &mesh, tw_surface_options options, uint32_t level) {
  options.level = level;
  options.limit = options.normals = false;
  return read_rows(surface_of(mesh, options).get(), TW_DOMAIN_POINTS);
}

double greatest_difference(const std::vector<float> &a, const std::vector<float> &b) {
  if (a.size() != b.size()) return HUGE_VAL;
  double greatest = 0;
  for (size_t i = 0; i < a.size(); i++)
    greatest = std::fmax(greatest, std::fabs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return greatest;
}

// A random similarity transform, which rotates by up to `radians`.
class Motion {
public:
  Motion(std::mt19937 &random, double scale, double radians) : scale_(scale) {
    std::uniform_real_distribution<double> unit(-1, 1);
    double axis[3], length = 0;
    for (double &component : axis) {
      component = unit(random);
      length += component * component;
    }
    for (double &component : axis) component /= std::sqrt(length);
    const double angle = radians * unit(random), c = std::cos(angle), s = std::sin(angle);
    for (int i = 0; i < 3; i++) {
      shift_[i] = scale * unit(random);
      for (int j = 0; j < 3; j++) {
        const double sign = (j - i + 3) % 3 == 1 ? -1 : 1;
        turn_[i][j] = (1 - c) * axis[i] * axis[j] + (i == j ? c : sign * s * axis[3 - i - j]);
      }
    }
  }

  std::vector<float> of(const std::vector<float> &points) const {
    std::vector<float> out(points.size());
    for (size_t p = 0; p < points.size(); p += 3)
      for (size_t i = 0; i < 3; i++) {
        double sum = 0;
        for (size_t j = 0; j < 3; j++) sum += turn_[i][j] * static_cast<double>(points[p + j]);
        out[p + i] = static_cast<float>(scale_ * sum + shift_[i]);
      }
    return out;
  }

private:
  double scale_, turn_[3][3], shift_[3];
};

// Moves points: half of the time smoothly around one of them, as a sculptor does, else a third of them at
// random.
void move_points(std::vector<float> &points, double size, uint32_t level, std::mt19937 &random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  if (points.empty()) return; // TW_BOUNDARY_NONE may leave no faces
  const bool is_smooth = random() % 2 == 0;
  const double by = size * (is_smooth ? 0.1 : 0.1 / (1 << level));
  const size_t middle = 3 * (random() % (points.size() / 3));
  const double place[3] = {points[middle], points[middle + 1], points[middle + 2]};
  const double direction[3] = {unit(random), unit(random), unit(random)};
  for (size_t p = 0; p < points.size(); p += 3) {
    double square = 0;
    for (size_t c = 0; c < 3; c++)
      square += std::pow((static_cast<double>(points[p + c]) - place[c]) / size, 2);
    const double weight = std::exp(-30 * square);
    const bool moves = is_smooth ? weight > 0.01 : random() % 3 == 0;
    for (size_t c = 0; c < 3 && moves; c++)
      points[p + c] += static_cast<float>(by * (is_smooth ? weight * direction[c] : unit(random)));
  }
}

// A cage with sculpted levels, for the library and for OpenSubdiv.
class Model {
public:
  Model(const Cage &cage, const tw_surface_options &options)
      : cage_(cage), options_(options), view_(cage_), attributes_(cage_),
        arena_(tw_arena_create(), tw_arena_destroy) {
    attributes_.give(view_.mesh);
    mesh = view_.mesh;
    size = Comparison(cage_, at(0, true)).diameter();
  }

  // The options for a level; bare: without normals and limit.
  tw_surface_options at(uint32_t level, bool bare = false) const {
    tw_surface_options options = options_;
    options.level = level;
    if (bare) options.limit = options.normals = false;
    return options;
  }

  // Moves points of a level, which must be deeper than those sculpted before. Returns what goes wrong, or "".
  std::string sculpt(uint32_t level, std::mt19937 &random) {
    const tw_surface_options options = at(level, true);
    Comparison before(cage_, options, sculpts_);
    std::string failure = before.run(mesh);
    if (!failure.empty()) return "before sculpting, " + failure;
    std::vector<float> points = points_of(mesh, options_, level);
    move_points(points, size, level, random);
    failure = post(level, points);
    Sculpt sculpt = {level, before.oracle().points};
    for (size_t row = 0; row < before.theirs().size(); row++)
      for (size_t c = 0; c < 3; c++)
        sculpt.points[static_cast<size_t>(before.theirs()[row])].v[c] =
            static_cast<double>(points[3 * row + c]);
    sculpts_.push_back(sculpt);
    return failure;
  }

  // Sculpts the level to these points. Returns what goes wrong, also when the level then has other points.
  std::string post(uint32_t level, const std::vector<float> &points) {
    const tw_surface_options options = at(level, true);
    tw_mesh sculpted;
    tw_error error{};
    if (tw_mesh_sculpt(&mesh, &options, points.data(), nullptr, nullptr, arena_.get(), &sculpted, &error) !=
        TW_OK)
      return error.detail;
    mesh = sculpted;
    const double missed = greatest_difference(points_of(mesh, options_, level), points);
    return missed <= 1e-6 * size ? "" : with_number("the level shows other points,", missed / size);
  }

  std::string compare(uint32_t level) const {
    tw_surface_options options = at(level);
    // On levels coarser than the deepest sculpted one OpenSubdiv cannot give normals: the points shown there
    // are moved.
    if (level < sculpts_.back().level) options.normals = false;
    Comparison comparison(cage_, options, sculpts_);
    const std::string failure = comparison.run(mesh);
    return failure.empty() ? "" : text_of(options) + ": " + failure;
  }

  // The level's points in OpenSubdiv's order: tweend's order depends on which levels have details.
  std::vector<float> ordered_points(uint32_t level) const {
    Comparison comparison(cage_, at(level, true), sculpts_);
    comparison.run(mesh);
    const std::vector<float> points = points_of(mesh, options_, level);
    std::vector<float> out(3 * comparison.oracle().points.size());
    for (size_t row = 0; row < comparison.theirs().size(); row++)
      std::copy_n(&points[3 * row], 3, &out[3 * static_cast<size_t>(comparison.theirs()[row])]);
    return out;
  }

  // The mesh with other positions, which must outlive the result.
  tw_mesh moved(const std::vector<float> &positions) const {
    tw_mesh out = mesh;
    out.positions = positions.data();
    return out;
  }
  std::vector<float> positions() const {
    return std::vector<float>(mesh.positions, mesh.positions + 3 * static_cast<size_t>(mesh.point_count));
  }

  tw_mesh mesh;
  double size;

private:
  Cage cage_;
  tw_surface_options options_;
  CageView view_;
  PointAttributes attributes_;
  Sculpts sculpts_;
  std::unique_ptr<tw_arena, decltype(&tw_arena_destroy)> arena_;
};

bool same_details(const tw_mesh &a, const tw_mesh &b) {
  bool same = a.point_count == b.point_count && a.detail_count == b.detail_count &&
              std::memcmp(a.positions, b.positions, 3 * sizeof(float) * a.point_count) == 0;
  for (uint32_t i = 0; i < a.detail_count && same; i++)
    same = a.details[i].level == b.details[i].level &&
           a.details[i].vertex_count == b.details[i].vertex_count &&
           std::memcmp(a.details[i].offsets, b.details[i].offsets,
                       3 * sizeof(float) * a.details[i].vertex_count) == 0;
  return same;
}

// ---- facts of one model, sculpted on a level and, every second time, on the next deeper one --------------

// Compares a level from the deepest sculpted one on, and a coarser one.
std::string agrees_with_opensubdiv(Model &model, uint32_t deepest, std::mt19937 &random) {
  std::string failure = model.compare(deepest + static_cast<uint32_t>(random() % 3));
  if (failure.empty() && deepest > 1)
    failure = model.compare(1 + static_cast<uint32_t>(random() % (deepest - 1)));
  return failure;
}

std::string unchanged_points_change_nothing(Model &model, uint32_t deepest, std::mt19937 &) {
  for (uint32_t level = 0; level <= deepest + 1; level++) {
    const tw_mesh before = model.mesh;
    std::string failure = model.post(level, points_of(before, model.at(level), level));
    if (!failure.empty()) return failure;
    if (!same_details(before, model.mesh)) return "level " + std::to_string(level) + " changes it";
  }
  return "";
}

std::string moves_with_its_cage(Model &model, uint32_t deepest, std::mt19937 &random) {
  for (double scale : {1.0, 0.01, 300.0}) {
    const Motion motion(random, scale, 3);
    const std::vector<float> positions = motion.of(model.positions());
    const tw_mesh moved = model.moved(positions);
    for (uint32_t level = 0; level <= deepest + 1; level++) {
      const std::vector<float> here = points_of(model.mesh, model.at(level), level),
                               there = points_of(moved, model.at(level), level);
      const double missed = greatest_difference(motion.of(here), there) / (scale * model.size);
      if (!(missed <= 1e-5)) return with_number(("level " + std::to_string(level)).c_str(), missed);
    }
  }
  return "";
}

// Shifting a whole level takes deeper details along (within 1e-4, as they amplify rounding). Not with holes,
// whose points cannot be moved.
std::string moves_with_a_level(Model &model, uint32_t deepest, std::mt19937 &random) {
  if (model.mesh.hole_count > 0 || model.at(0).boundary == TW_BOUNDARY_NONE) return "";
  const Motion motion(random, 1, 0);
  const std::vector<float> fine = motion.of(model.ordered_points(deepest));
  const uint32_t level = static_cast<uint32_t>(random() % deepest);
  std::string failure = model.post(level, motion.of(points_of(model.mesh, model.at(level), level)));
  if (!failure.empty()) return failure;
  const double missed = greatest_difference(fine, model.ordered_points(deepest)) / model.size;
  return missed <= 1e-4 ? "" : with_number("misses it", missed);
}

// Any level can be sculpted after deeper ones, and then has the new points.
std::string shows_coarser_sculpting(Model &model, uint32_t deepest, std::mt19937 &random) {
  const uint32_t level = static_cast<uint32_t>(random() % (deepest + 1));
  std::vector<float> points = points_of(model.mesh, model.at(level), level);
  move_points(points, model.size, level, random);
  return model.post(level, points);
}

std::string plan_gives_the_same_bytes(Model &model, uint32_t deepest, std::mt19937 &random) {
  tw_surface_options options = model.at(deepest + static_cast<uint32_t>(random() % 2));
  if (random() % 3 == 0) options.level = static_cast<uint32_t>(random() % (deepest + 1));
  std::vector<float> positions = model.positions();
  move_points(positions, model.size, 0, random);
  const tw_mesh moved = model.moved(positions);
  options.movable = true;
  const Surface plan = surface_of(model.mesh, options), fresh = surface_of(moved, options);
  tw_surface *by_plan = nullptr;
  if (tw_surface_with_positions_by(plan.get(), positions.data(), nullptr, &by_plan) != TW_OK)
    return "no surface";
  const Surface owned(by_plan, tw_surface_destroy);
  const std::vector<float> rows = read_rows(by_plan, TW_DOMAIN_VERTICES),
                           expected = read_rows(fresh.get(), TW_DOMAIN_VERTICES);
  const bool same =
      rows.size() == expected.size() &&
      (rows.empty() || std::memcmp(rows.data(), expected.data(), rows.size() * sizeof(float)) == 0);
  return same ? "" : text_of(options) + ": other rows";
}

struct Fact {
  const char *name;
  std::string (*check)(Model &model, uint32_t deepest, std::mt19937 &random);
};

const Fact facts[] = {
    {"opensubdiv refines sculpted levels alike", agrees_with_opensubdiv},
    {"unchanged points change nothing", unchanged_points_change_nothing},
    {"details move, turn and grow with their cage", moves_with_its_cage},
    {"details move with a level above them", moves_with_a_level},
    {"levels above details can be sculpted", shows_coarser_sculpting},
    {"a plan with other positions gives the bytes of a fresh surface", plan_gives_the_same_bytes},
};

tw_surface_options random_options(tw_scheme scheme, std::mt19937 &random) {
  tw_surface_options options{};
  options.scheme = scheme;
  options.boundary = static_cast<tw_boundary>(random() % 3);
  options.uv = static_cast<tw_uv_rule>(random() % 6);
  options.creasing = static_cast<tw_creasing>(random() % 2);
  options.triangles = static_cast<tw_triangles>(random() % 2);
  options.limit = random() % 3 == 0;
  options.normals = true;
  return options;
}

int failures = 0, tests = 0;

void check(const Fact &fact, tw_scheme scheme, int count) {
  static const char *const names[] = {"catmull-clark", "loop"};
  std::mt19937 random(20261123);
  int failed = 0;
  for (int i = 0; i < count; i++) {
    const Cage cage = scheme == TW_LOOP ? random_triangle_cage(random) : random_cage(random);
    Model model(cage, random_options(scheme, random));
    const uint32_t first = 1 + static_cast<uint32_t>(i % 3),
                   deepest = std::min(first + static_cast<uint32_t>(i % 2), 3u);
    std::string failure = model.sculpt(first, random);
    if (failure.empty() && deepest > first) failure = model.sculpt(deepest, random);
    if (failure.empty()) failure = fact.check(model, deepest, random);
    if (failure.empty()) continue;
    if (failed++ < 5) std::printf("# cage %d, sculpted to level %u: %s\n", i, deepest, failure.c_str());
  }
  std::printf("%sok %d - %s: %s, %d cages\n", failed ? "not " : "", ++tests, fact.name, names[scheme], count);
  if (failed) std::printf("# %d fail\n", failed);
  failures += failed;
}

} // namespace

int main() {
  const int count = std::getenv("TESTED_SANITIZED") ? 10 : 50;
  for (const Fact &fact : facts)
    for (tw_scheme scheme : {TW_CATMULL_CLARK, TW_LOOP}) check(fact, scheme, count);
  std::printf("1..%d\n", tests);
  return failures ? 1 : 0;
}
