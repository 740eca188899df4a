// The bounds of level=auto hold against OpenSubdiv's limit surface, and are not far from the distances that
// are found. TAP.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "oracle.hpp"

namespace {

struct point {
  double v[3];
};

inline point operator-(const point &a, const point &b) {
  return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2]}};
}
inline point along(const point &a, const point &b, double s) {
  return {{a.v[0] + s * (b.v[0] - a.v[0]), a.v[1] + s * (b.v[1] - a.v[1]), a.v[2] + s * (b.v[2] - a.v[2])}};
}
inline double dot(const point &a, const point &b) {
  return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2];
}

inline double to_segment(const point &p, const point &a, const point &b) {
  point side = b - a;
  double square = dot(side, side), s = square > 0 ? dot(p - a, side) / square : 0;
  point to = p - along(a, b, std::clamp(s, 0.0, 1.0));
  return std::sqrt(dot(to, to));
}

using triangle = std::array<point, 3>;

inline double to_triangle(const point &p, const triangle &t) {
  point a = t[1] - t[0], b = t[2] - t[0], to = p - t[0];
  double aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), pa = dot(to, a), pb = dot(to, b),
         area = aa * bb - ab * ab;
  if (area > 1e-14 * aa * bb) {
    double u = (bb * pa - ab * pb) / area, v = (aa * pb - ab * pa) / area;
    if (u >= 0 && v >= 0 && u + v <= 1) {
      point foot = along(along(t[0], t[1], u), t[2], 0);
      for (int c = 0; c < 3; c++) foot.v[c] = t[0].v[c] + u * a.v[c] + v * b.v[c];
      to = p - foot;
      return std::sqrt(dot(to, to));
    }
  }
  return std::min({to_segment(p, t[0], t[1]), to_segment(p, t[1], t[2]), to_segment(p, t[2], t[0])});
}

struct box {
  point low{{INFINITY, INFINITY, INFINITY}}, high{{-INFINITY, -INFINITY, -INFINITY}};

  void add(const point &p) {
    for (int c = 0; c < 3; c++) {
      low.v[c] = std::min(low.v[c], p.v[c]);
      high.v[c] = std::max(high.v[c], p.v[c]);
    }
  }
  int longest_axis() const {
    point side = high - low;
    return static_cast<int>(std::max_element(side.v, side.v + 3) - side.v);
  }
  double square_from(const point &p) const {
    point to;
    for (int c = 0; c < 3; c++) to.v[c] = std::max({low.v[c] - p.v[c], 0.0, p.v[c] - high.v[c]});
    return dot(to, to);
  }
};

// Triangles in a binary tree of bounding boxes.
class triangle_tree {
public:
  explicit triangle_tree(std::vector<triangle> all) : triangles(std::move(all)), sorted(triangles) {
    if (!sorted.empty()) add_node(0, sorted.size());
  }

  // How far a point is from the triangles. As soon as that is found to be less than `enough`, which is what
  // the caller knows of another point that is farther, whatever is less than `enough` is returned.
  double distance(const point &p, double enough) const {
    double best = INFINITY;
    if (!nodes.empty()) look_into(0, p, enough, best);
    return best;
  }

  const std::vector<triangle> triangles;

private:
  enum { LEAF_MAX = 4 };
  struct node {
    box bounds;
    size_t first, last; // of sorted
    size_t second;      // the second half, 0 for a leaf; the first half follows its parent
  };

  size_t add_node(size_t first, size_t last) {
    size_t at = nodes.size();
    node made{{}, first, last, 0};
    for (size_t i = first; i < last; i++)
      for (const point &p : sorted[i]) made.bounds.add(p);
    nodes.push_back(made);
    if (last - first <= LEAF_MAX) return at;
    auto where = [axis = made.bounds.longest_axis()](const triangle &t) {
      return t[0].v[axis] + t[1].v[axis] + t[2].v[axis];
    };
    size_t middle = first + (last - first) / 2;
    auto begin = sorted.begin();
    std::nth_element(begin + static_cast<ptrdiff_t>(first), begin + static_cast<ptrdiff_t>(middle),
                     begin + static_cast<ptrdiff_t>(last),
                     [&](const triangle &a, const triangle &b) { return where(a) < where(b); });
    add_node(first, middle);
    size_t second = add_node(middle, last);
    nodes[at].second = second;
    return at;
  }

  // The nearer half first: what is found there mostly rules the other half out.
  void look_into(size_t at, const point &p, double enough, double &best) const {
    const node &here = nodes[at];
    if (here.second == 0) {
      for (size_t i = here.first; i < here.last; i++) best = std::min(best, to_triangle(p, sorted[i]));
      return;
    }
    std::array<std::pair<double, size_t>, 2> halves;
    for (size_t half = 0; half < 2; half++) {
      size_t child = half == 0 ? at + 1 : here.second;
      halves[half] = {nodes[child].bounds.square_from(p), child};
    }
    if (halves[1] < halves[0]) std::swap(halves[0], halves[1]);
    for (const auto &[square, child] : halves)
      if (!(best < enough) && square < best * best) look_into(child, p, enough, best);
  }

  std::vector<triangle> sorted;
  std::vector<node> nodes;
};

// The triangles of a level as answers have them. diagonal: which one cuts quads.
std::vector<triangle> triangles_of(const tw_surface *surface, uint32_t diagonal) {
  std::vector<float> rows(3 * tw_surface_row_count(surface, TW_DOMAIN_POINTS));
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, rows.size() / 3, rows.data());
  std::vector<uint32_t> sizes(1), corners(tw_surface_largest_face(surface));
  std::vector<triangle> out;
  for (uint64_t f = 0; f < tw_surface_get_counts(surface)->faces; f++) {
    size_t count = tw_surface_read_faces(reader, TW_DOMAIN_POINTS, f, 1, sizes.data(), corners.data());
    auto at = [&](size_t i) {
      const float *row = rows.data() + 3 * corners[(i + diagonal) % count];
      return point{{static_cast<double>(row[0]), static_cast<double>(row[1]), static_cast<double>(row[2])}};
    };
    for (size_t i = 2; i < count; i++) out.push_back({at(0), at(i - 1), at(i)});
  }
  tw_surface_reader_destroy(reader);
  return out;
}

struct tally {
  int cages = 0, compared = 0, chosen = 0, near = 0, near_in_short = 0;
  double loosest = 0, loosest_in_short = 0;
  std::string failure;
};

// How many levels deeper the limit surface is looked at: what is semi-sharp rounds off only there.
uint32_t depth_of(const Cage &cage) {
  const auto is_semi = [](float sharpness) { return sharpness > 1 && sharpness < 10; };
  const auto has_some = [&](const std::vector<float> &all) {
    return std::any_of(all.begin(), all.end(), is_semi);
  };
  return has_some(cage.crease_sharpness) || has_some(cage.corner_sharpness) ? 5 : 3;
}

// The limit surface as OpenSubdiv has it some levels deeper: triangles of its limit points, without hidden
// faces.
std::vector<triangle> limit_of(const Cage &cage, tw_surface_options options, uint32_t depth) {
  options.level = depth;
  options.limit = true;
  options.normals = false;
  const Oracle oracle(cage, options);
  const auto &level = oracle.level();
  std::vector<triangle> out;
  for (int f = 0; f < level.GetNumFaces(); f++) {
    if (level.IsFaceHole(f)) continue;
    auto corners = level.GetFaceVertices(f);
    auto at = [&](int i) {
      point p;
      std::memcpy(p.v, oracle.points[static_cast<size_t>(corners[i])].v, sizeof p.v);
      return p;
    };
    for (int i = 2; i < corners.size(); i++) out.push_back({at(0), at(i - 1), at(i)});
  }
  return out;
}

// The greatest distance of some points of a triangle from other triangles, or what is less than `enough`.
double distance_of(const triangle &t, const triangle_tree &from, double enough, std::mt19937 &random) {
  std::uniform_real_distribution<double> share(0, 1);
  double most = 0;
  for (const point &p : {t[0], t[1], t[2], along(t[0], t[1], 0.5), along(t[1], t[2], 0.5),
                         along(along(t[0], t[1], share(random)), t[2], share(random))})
    most = std::max(most, from.distance(p, std::max(most, enough)));
  return most;
}

// The greatest distance of triangles from others: of corners all over the surface, then ever closer around
// the farthest of these, as triangles that are beside each other mostly follow each other.
double farthest_of(const std::vector<triangle> &triangles, const triangle_tree &from, std::mt19937 &random) {
  const size_t ALL_OVER = 400, FOLLOWED = 5;
  std::vector<std::pair<double, size_t>> found; // the farthest first
  size_t step = std::max<size_t>(1, triangles.size() / ALL_OVER);
  for (size_t i = 0; i < triangles.size(); i += step) {
    double enough = found.size() < FOLLOWED ? 0 : found.back().first;
    std::pair<double, size_t> next{from.distance(triangles[i][random() % 3], enough), i};
    found.insert(std::upper_bound(found.begin(), found.end(), next, std::greater<>()), next);
    if (found.size() > FOLLOWED) found.pop_back();
  }
  for (auto &best : found) {
    best.first = std::max(best.first, distance_of(triangles[best.second], from, best.first, random));
    for (size_t near = (step + 1) / 2, at = best.second; near > 0; near /= 2, at = best.second)
      for (size_t i : {at - std::min(at, near), std::min(at + near, triangles.size() - 1)})
        best = std::max(best, {distance_of(triangles[i], from, best.first, random), i});
  }
  return std::max_element(found.begin(), found.end())->first;
}

enum { LEVELS = 2, SHORT_ROOM = 64 };

// Errors as they are looked at for wishes of at least so much, and not yet where there are none.
struct rung {
  double enough;
  uint32_t faces_max;
  std::vector<double> errors; // [LEVELS + 3]
};

// The first two rungs of level=auto (api/surface/auto_level.c).
std::vector<rung> rungs_of(const Cage &cage) {
  point low{{INFINITY, INFINITY, INFINITY}}, high{{-INFINITY, -INFINITY, -INFINITY}};
  for (size_t i = 0; i < cage.points.size(); i++) {
    low.v[i % 3] = std::min(low.v[i % 3], static_cast<double>(cage.points[i]));
    high.v[i % 3] = std::max(high.v[i % 3], static_cast<double>(cage.points[i]));
  }
  double size = std::sqrt(dot(high - low, high - low));
  return {{size / 256, 0, {}}, {size / 4096, 0, {}}};
}

bool look(const tw_mesh &mesh, const tw_surface_options &options, rung &out, tw_error &error) {
  const tw_error_wish wish = {LEVELS + 2, out.enough, out.faces_max};
  out.errors.resize(LEVELS + 3);
  return tw_surface_errors(&mesh, &options, &wish, nullptr, out.errors.data(), &error) == TW_OK;
}

void compare(const Cage &cage, tw_surface_options options, std::mt19937 &random, double planted, tally &all) {
  CageView view(cage);
  const uint32_t depth = depth_of(cage);
  double fine[TW_LEVEL_MAX + 1];
  std::vector<rung> rungs = rungs_of(cage);
  tw_error error{};
  const tw_error_wish deep = {depth, 0.004, 0};
  tw_surface_options limits = options;
  limits.limit = true;
  if (!look(view.mesh, options, rungs[0], error) ||
      tw_surface_errors(&view.mesh, &limits, &deep, nullptr, fine, &error) != TW_OK) {
    all.failure = cage.name + ": " + error.detail;
    return;
  }
  const std::vector<double> &bounds = rungs[0].errors;
  // With room for few faces, as if the cage had hundreds of thousands: in batches, and by rings.
  rung short_of_room = {rungs[1].enough, SHORT_ROOM, {}};
  if (!look(view.mesh, options, short_of_room, error)) {
    all.failure = cage.name + ": " + error.detail;
    return;
  }
  const triangle_tree limit(limit_of(cage, options, depth));
  if (limit.triangles.empty()) return;
  all.cages++;
  double found[LEVELS + 1];
  for (uint32_t level = 0; level <= LEVELS; level++) {
    options.level = level;
    tw_surface *surface;
    if (tw_surface_create(&view.mesh, &options, &surface, &error) != TW_OK) return;
    found[level] = 0;
    for (uint32_t diagonal = 0; diagonal < (level > 0 ? 2u : 1u); diagonal++) {
      const triangle_tree answer(triangles_of(surface, diagonal));
      found[level] = std::max({found[level], farthest_of(limit.triangles, answer, random),
                               farthest_of(answer.triangles, limit, random)});
    }
    tw_surface_destroy(surface);
    // OpenSubdiv's points are joined by triangles, which are as far from the surface as that level is.
    double bound = planted * std::min(bounds[level], short_of_room.errors[level]) + fine[depth] + 1e-6;
    all.compared++;
    if (found[level] > bound && all.failure.empty()) {
      char text[200];
      std::snprintf(text, sizeof text, "%s, level %u: found %.6g, bound %.6g", cage.name.c_str(), level,
                    found[level], bound);
      all.failure = text;
    }
    if (level > 0 && found[level] > 0.01) {
      all.loosest = std::max(all.loosest, bounds[level] / found[level]);
      all.loosest_in_short = std::max(all.loosest_in_short, short_of_room.errors[level] / found[level]);
    }
  }
  // Which level an error needs, by the bounds and by what was found. Not the error of level 0 itself, for
  // which that level would be the least: no bound of it is as small.
  for (double share : {0.9, 0.5, 0.2, 0.1, 0.05}) {
    double wanted = share * found[0];
    uint32_t by_bound = 0, in_short = 0, least = 0;
    while (least <= LEVELS && found[least] > wanted) least++;
    if (least > LEVELS || !(wanted > 0.01)) continue;
    rung &own = rungs[wanted < rungs[0].enough];
    if (own.errors.empty() && !look(view.mesh, options, own, error)) return;
    while (by_bound < LEVELS + 2 && own.errors[by_bound] > wanted) by_bound++;
    while (in_short < LEVELS + 2 && short_of_room.errors[in_short] > wanted) in_short++;
    all.chosen++;
    all.near_in_short += in_short <= least + 1;
    all.near += by_bound <= least + 1;
  }
}

int tests = 0, failures = 0;

// A torus of triangles, some quads of which are cut along the other diagonal, with its points moved:
// irregular throughout, as scans are.
Cage noisy_scan(int around, int round, double noise, std::mt19937 &random) {
  std::uniform_real_distribution<double> moved(-noise, noise);
  Cage cage;
  cage.name = "noisy scan";
  for (int i = 0; i < around * round; i++) {
    double along = 2 * M_PI * (i / round) / around, turn = 2 * M_PI * (i % round) / round,
           width = 1 + moved(random), radius = 3 + width * std::cos(turn);
    for (double x : {radius * std::cos(along), radius * std::sin(along), width * std::sin(turn)})
      cage.points.push_back(static_cast<float>(x));
  }
  for (int i = 0; i < around * round; i++) {
    int after = (i / round + 1) % around * round, up = (i % round + 1) % round;
    std::array<int, 4> quad = {i, after + i % round, after + up, i / round * round + up};
    std::rotate(quad.begin(), quad.begin() + static_cast<int>(random() % 2), quad.end());
    cage.faces.push_back({quad[0], quad[1], quad[2]});
    cage.faces.push_back({quad[0], quad[2], quad[3]});
  }
  return cage;
}

// The top of a sphere of triangles around a hole, with its points moved: the triangles there are slivers, of
// which some are folded.
Cage noisy_cap(double noise, std::mt19937 &random) {
  const int AROUND = 50, ROWS = 5;
  std::uniform_real_distribution<double> moved(-noise, noise);
  Cage cage;
  cage.name = "noisy cap";
  for (int i = 0; i < AROUND * ROWS; i++) {
    double along = 2 * M_PI * (i / ROWS) / AROUND, down = M_PI * (i % ROWS + 0.5) / 30;
    for (double x : {std::sin(down) * std::cos(along), std::sin(down) * std::sin(along), std::cos(down)})
      cage.points.push_back(static_cast<float>(3 * x + moved(random)));
  }
  for (int i = 0; i < AROUND * ROWS; i++) {
    int row = i % ROWS, after = (i / ROWS + 1) % AROUND * ROWS;
    if (row == ROWS - 1) continue;
    std::array<int, 4> quad = {i, after + row, after + row + 1, i + 1};
    std::rotate(quad.begin(), quad.begin() + static_cast<int>(random() % 2), quad.end());
    cage.faces.push_back({quad[0], quad[1], quad[2]});
    cage.faces.push_back({quad[0], quad[2], quad[3]});
  }
  return cage;
}

// What of a scan is looked at.
struct scan_wish {
  uint32_t first, last; // levels
  double enough;
  uint32_t faces_max;
  bool limit;
};

// Whether a scan's bounds hold, and are at most twice the greatest distance of all triangles' corners, edges
// and middles.
void scan(const std::string &name, const Cage &cage, const scan_wish &of) {
  const uint32_t DEEPER = 2, DEEPEST = 2;
  CageView view(cage);
  tw_surface_options options{};
  options.limit = of.limit;
  tw_error error{};
  double told[DEEPEST + 1], loosest = 0;
  const tw_error_wish wish = {DEEPEST, of.enough, of.faces_max};
  std::string failure;
  if (tw_surface_errors(&view.mesh, &options, &wish, nullptr, told, &error) != TW_OK) failure = error.detail;
  for (options.level = of.first; options.level <= of.last && failure.empty(); options.level++) {
    tw_surface *surface;
    if (tw_surface_create(&view.mesh, &options, &surface, &error) != TW_OK) break;
    const triangle_tree limit(limit_of(cage, options, options.level + DEEPER));
    double found = 0;
    for (const triangle &t : triangles_of(surface, 0))
      for (const point &p : {t[0], along(t[0], t[1], 0.5), along(t[1], t[2], 0.5),
                             along(along(t[0], t[1], 0.5), t[2], 1. / 3)})
        found = std::max(found, limit.distance(p, found));
    tw_surface_destroy(surface);
    loosest = std::max(loosest, told[options.level] / found);
    std::printf("# level %u: told %.6g, found %.6g\n", options.level, told[options.level], found);
    if (found > told[options.level] + 1e-6) failure = "a level is farther from the limit than its bound";
    if (told[options.level] > 2 * found) failure = "a bound is more than twice what is found";
  }
  std::printf("%sok %d - %s is told within twice its distance\n# loosest %.2f\n",
              failure.empty() ? "" : "not ", ++tests, name.c_str(), loosest);
  if (!failure.empty()) std::printf("# %s\n", failure.c_str());
  failures += !failure.empty();
}

// least_near: the share of choices, in percent, that must be the least level or one above. Where a cage folds
// back on itself, touches itself or has fins, points may not slide, and bounds are up to five times what is
// found.
void report(const std::string &name, const tally &all, int least_near) {
  std::string failure = all.failure;
  if (failure.empty() && all.near * 100 < all.chosen * least_near)
    failure = "too many levels are over the least by two";
  std::printf("%sok %d - %s\n", failure.empty() ? "" : "not ", ++tests, name.c_str());
  std::printf(
      "# %d cages, %d levels, %d of %d choices the least level or one above, loosest bound %.2f; short "
      "of room %d, %.2f\n",
      all.cages, all.compared, all.near, all.chosen, all.loosest, all.near_in_short, all.loosest_in_short);
  if (!failure.empty()) std::printf("# %s\n", failure.c_str());
  failures += !failure.empty();
}

} // namespace

int main() {
  // Under a sanitizer this is twenty times slower, so that only some cages are compared. How loose bounds are
  // is judged on all cages alone.
  const bool sanitized = std::getenv("TESTED_SANITIZED") != nullptr;
  const size_t step = sanitized ? 20 : 1;
  const int chance = sanitized ? 1 : 16;
  auto each = [&](const std::vector<Cage> &cages, const tw_surface_options &options, std::mt19937 &random,
                  tally &all) {
    for (size_t i = 0; i < cages.size(); i += step) compare(cages[i], options, random, 1, all);
  };
  std::mt19937 random(20261127);
  for (int limit = 0; limit < 2; limit++) {
    tw_surface_options options{};
    options.limit = limit;
    tally by_hand, by_chance, triangles;
    each(hand_made(), options, random, by_hand);
    for (int i = 0; i < chance; i++) {
      options.boundary = static_cast<tw_boundary>(i % 2);
      options.creasing = static_cast<tw_creasing>(i / 2 % 2);
      compare(random_cage(random), options, random, 1, by_chance);
    }
    options.scheme = TW_LOOP;
    each(hand_made_triangles(), options, random, triangles);
    std::string suffix = limit ? ", limit points" : "";
    report("no level is farther from the limit than its bound" + suffix, by_hand, sanitized ? 0 : 95);
    report("nor are random cages" + suffix, by_chance, sanitized ? 0 : 95);
    report("nor is Loop's scheme" + suffix, triangles, sanitized ? 0 : limit ? 95 : 98);
  }
  if (!sanitized) {
    std::mt19937 little(1), slivers(8), folds(7), limits(3), dense(7), rooms(7), noise(7);
    const uint32_t SHORT = 2048; // no room for all levels around the irregular points
    scan("a noisy scan without room", noisy_scan(20, 8, 0.05, random), {0, 2, 1e-4, SHORT, false});
    scan("a dense scan with little noise", noisy_scan(50, 30, 0.01, little), {0, 0, 0.01, 0, false});
    scan("a cap of slivers", noisy_cap(0.019, slivers), {1, 1, 2e-3, 0, false});
    scan("a cap of folded slivers", noisy_cap(0.0157, folds), {0, 1, 2e-3, 0, false});
    scan("a scan of limit points", noisy_scan(30, 16, 0.02, limits), {1, 2, 1e-3, 0, true});
    scan("a dense scan of limit points", noisy_scan(50, 30, 0.01, dense), {1, 1, 2e-3, 0, true});
    scan("and without room", noisy_scan(50, 30, 0.01, rooms), {1, 1, 1e-4, 16 * SHORT, true});
    scan("nor with more noise", noisy_scan(40, 24, 0.05, noise), {0, 2, 1e-4, 8 * SHORT, true});
  }
  tally planted;
  compare(cube(), {}, random, 0.5, planted);
  std::printf("%sok %d - half of a bound is found to be too little\n", planted.failure.empty() ? "not " : "",
              ++tests);
  failures += planted.failure.empty();
  std::printf("1..%d\n", tests);
  return failures > 0;
}
