// Coarsens levels that OpenSubdiv makes of random cages: the result has the cage's faces, and OpenSubdiv
// makes the same level from it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "oracle.hpp"
#include "tweend/coarsen.h"

namespace {

// The cage with infinitely sharp tags only, since sharpness that has decayed leaves no trace in the level.
// Without UVs and holes.
Cage stripped(Cage cage) {
  cage.uv_sets.clear();
  cage.holes.clear();
  for (float &sharpness : cage.crease_sharpness) sharpness = TW_SHARPNESS_INFINITE;
  for (float &sharpness : cage.corner_sharpness) sharpness = TW_SHARPNESS_INFINITE;
  return cage;
}

// The cage with tags that last over the levels, some of them infinitely sharp. Without UVs and holes.
Cage lasting(Cage cage, uint32_t level, std::mt19937 &random) {
  std::uniform_real_distribution<float> lasts(static_cast<float>(level) + 0.1F, 8.0F);
  cage.uv_sets.clear();
  cage.holes.clear();
  for (float &sharpness : cage.crease_sharpness)
    sharpness = random() % 4 == 0 ? TW_SHARPNESS_INFINITE : lasts(random);
  for (float &sharpness : cage.corner_sharpness)
    sharpness = random() % 4 == 0 ? TW_SHARPNESS_INFINITE : lasts(random);
  return cage;
}

// The last level as a cage. Border edges get no crease: they are sharp anyway.
Cage level_of(const Oracle &oracle) {
  const OpenSubdiv::Far::TopologyLevel &level = oracle.level();
  Cage cage;
  for (const Value3 &point : oracle.points)
    for (double coordinate : point.v) cage.points.push_back(static_cast<float>(coordinate));
  for (int f = 0; f < level.GetNumFaces(); f++) {
    const auto corners = level.GetFaceVertices(f);
    cage.faces.emplace_back(corners.begin(), corners.end());
  }
  for (int e = 0; e < level.GetNumEdges(); e++) {
    if (level.IsEdgeBoundary(e) || level.GetEdgeSharpness(e) <= 0) continue;
    const auto ends = level.GetEdgeVertices(e);
    cage.creases.push_back({ends[0], ends[1]});
    cage.crease_sharpness.push_back(level.GetEdgeSharpness(e));
  }
  for (int v = 0; v < level.GetNumVertices(); v++) {
    if (level.GetVertexSharpness(v) <= 0) continue;
    cage.corners.push_back(v);
    cage.corner_sharpness.push_back(level.GetVertexSharpness(v));
  }
  return cage;
}

Cage cage_of(const tw_mesh &mesh) {
  Cage cage;
  cage.points.assign(mesh.positions, mesh.positions + 3 * static_cast<size_t>(mesh.point_count));
  for (uint32_t f = 0; f < mesh.face_count; f++)
    cage.faces.emplace_back(mesh.corners + mesh.face_offsets[f], mesh.corners + mesh.face_offsets[f + 1]);
  for (uint32_t i = 0; i < mesh.crease_count; i++) {
    const uint32_t *ends = mesh.crease_edges + 2 * static_cast<size_t>(i);
    cage.creases.push_back({static_cast<int>(ends[0]), static_cast<int>(ends[1])});
    cage.crease_sharpness.push_back(mesh.crease_sharpness[i]);
  }
  for (uint32_t i = 0; i < mesh.sharp_point_count; i++) {
    cage.corners.push_back(static_cast<int>(mesh.sharp_points[i]));
    cage.corner_sharpness.push_back(mesh.point_sharpness[i]);
  }
  return cage;
}

double distance(const std::vector<Value3> &a, const std::vector<Value3> &b) {
  double greatest = 0;
  for (size_t i = 0; i < a.size(); i++)
    for (int c = 0; c < 3; c++) greatest = std::fmax(greatest, std::fabs(a[i].v[c] - b[i].v[c]));
  return greatest;
}

// Whether more than two faces have the same edge by its points, or two have it in the same direction. Loop's
// scheme makes the former of two triangles that share two edges, there or at a level between: OpenSubdiv
// tells the two inner edges apart, a reader of the mesh cannot. Across the latter faces are no neighbours.
bool has_odd_edges(const Cage &cage) {
  std::map<std::pair<int, int>, int> faces, directed;
  int most = 0, most_directed = 0;
  for (const std::vector<int> &face : cage.faces)
    for (size_t i = 0; i < face.size(); i++) {
      const int from = face[i], to = face[(i + 1) % face.size()];
      most = std::max(most, ++faces[std::minmax({from, to})]);
      most_directed = std::max(most_directed, ++directed[{from, to}]);
    }
  return most > 2 || most_directed > 1;
}

// The sharpness of each edge and, under {vertex, -1}, of each vertex.
std::map<std::pair<int, int>, float> tags_of(const Cage &cage) {
  std::map<std::pair<int, int>, float> tags;
  for (size_t i = 0; i < cage.creases.size(); i++)
    tags[std::minmax({cage.creases[i][0], cage.creases[i][1]})] = cage.crease_sharpness[i];
  for (size_t i = 0; i < cage.corners.size(); i++) tags[{cage.corners[i], -1}] = cage.corner_sharpness[i];
  return tags;
}

// Whether two levels have the same tags: what is left of the cages' own, so that further levels are alike
// too.
bool has_same_tags(const Cage &a, const Cage &b) {
  const auto some = tags_of(a), others = tags_of(b);
  return some.size() == others.size() &&
         std::equal(some.begin(), some.end(), others.begin(), [](auto &x, auto &y) {
           return x.first == y.first && std::fabs(x.second - y.second) < 1e-3F;
         });
}

int left_out = 0;

// Refines the cage and coarsens the level. Returns what went wrong, "" when the cage came back.
std::string take_back(const Cage &cage, const tw_surface_options &options) {
  const Oracle fine(cage, options);
  const Cage refined = level_of(fine);
  tw_surface_options above = options;
  bool is_odd = has_odd_edges(refined);
  while (!is_odd && --above.level > 0) is_odd = has_odd_edges(level_of(Oracle(cage, above)));
  if (is_odd) {
    left_out++;
    return "";
  }
  const CageView view(refined);
  tw_surface_options back = options;
  back.level = TW_LEVEL_MAX;
  std::unique_ptr<tw_arena, decltype(&tw_arena_destroy)> arena(tw_arena_create(), tw_arena_destroy);
  tw_coarsened found;
  tw_error error;
  if (tw_mesh_coarsen(&view.mesh, &back, nullptr, arena.get(), &found, &error) != TW_OK) return error.detail;
  if (found.levels != options.level) return std::to_string(found.levels) + " levels";
  const Cage coarse = cage_of(found.mesh);
  if (coarse.faces.size() != cage.faces.size()) return "other faces";
  const Oracle again(coarse, options);
  if (again.points.size() != fine.points.size()) return "other points";
  const double missed = distance(again.points, fine.points);
  if (missed > 1e-5) return "missed by " + std::to_string(missed);
  if (found.untagged > 0) return std::to_string(found.untagged) + " tags are told to be lost";
  return has_same_tags(level_of(again), refined) ? "" : "other sharpness";
}

int compare(tw_scheme scheme, bool lasts, const char *name, int number, int count) {
  std::mt19937 random(20261123);
  int failed = 0;
  for (int i = 0; i < count; i++) {
    const Cage any = scheme == TW_LOOP ? random_triangle_cage(random) : random_cage(random);
    tw_surface_options options = {};
    options.scheme = scheme;
    options.level = 1 + static_cast<uint32_t>(i % 3);
    const Cage cage = lasts ? lasting(any, options.level, random) : stripped(any);
    if (lasts && i / 6 % 2) options.creasing = TW_CREASE_CHAIKIN;
    options.boundary = i % 2 ? TW_BOUNDARY_EDGE_ONLY : TW_BOUNDARY_EDGE_AND_CORNER;
    const std::string failure = take_back(cage, options);
    if (failure.empty()) continue;
    if (failed++ < 5) std::printf("# cage %d, level %u: %s\n", i, options.level, failure.c_str());
  }
  std::printf("%s %d - %d random cages come back %s\n", failed ? "not ok" : "ok", number, count, name);
  return failed;
}

} // namespace

int main() {
  const int count = std::getenv("TESTED_SANITIZED") ? 60 : 600;
  int failed = compare(TW_CATMULL_CLARK, false, "from catmull-clark", 1, count);
  failed += compare(TW_LOOP, false, "from loop", 2, count);
  failed += compare(TW_CATMULL_CLARK, true, "from catmull-clark, with semi-sharp tags", 3, count);
  failed += compare(TW_LOOP, true, "from loop, with semi-sharp tags", 4, count);
  std::printf("1..4\n# %d cages left out, for odd edges\n", left_out);
  return failed ? 1 : 0;
}
