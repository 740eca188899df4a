// OpenSubdiv defines right: same connectivity, points, limits, normals and UVs, over hand-made and
// random cages, all options, levels 1 to 4. Prints TAP; an argument sets the number of random cages.
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "cages.hpp"

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

namespace {

struct Value3 {
  double v[3] = {0, 0, 0};
  void Clear() { v[0] = v[1] = v[2] = 0; }
  void AddWithWeight(const Value3 &other, double weight) {
    for (int i = 0; i < 3; i++) v[i] += weight * other.v[i];
  }
};

struct Options {
  tw_surface_options tw;
  std::string text() const {
    char line[200];
    std::snprintf(line, sizeof line, "level %u boundary %d uv %d creasing %d triangles %d scheme %d limit %d",
                  tw.level, static_cast<int>(tw.boundary), static_cast<int>(tw.uv),
                  static_cast<int>(tw.creasing), static_cast<int>(tw.triangles), static_cast<int>(tw.scheme),
                  tw.limit);
    return line;
  }
};

Sdc::SchemeType scheme_of(const tw_surface_options &o) {
  return o.scheme == TW_LOOP       ? Sdc::SCHEME_LOOP
         : o.scheme == TW_BILINEAR ? Sdc::SCHEME_BILINEAR
                                   : Sdc::SCHEME_CATMARK;
}

Sdc::Options sdc_options(const tw_surface_options &o) {
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(
      o.boundary == TW_BOUNDARY_EDGE_ONLY ? Sdc::Options::VTX_BOUNDARY_EDGE_ONLY
      : o.boundary == TW_BOUNDARY_NONE    ? Sdc::Options::VTX_BOUNDARY_NONE
                                          : Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  static const Sdc::Options::FVarLinearInterpolation rules[] = {
      Sdc::Options::FVAR_LINEAR_CORNERS_ONLY,  Sdc::Options::FVAR_LINEAR_NONE,
      Sdc::Options::FVAR_LINEAR_CORNERS_PLUS1, Sdc::Options::FVAR_LINEAR_CORNERS_PLUS2,
      Sdc::Options::FVAR_LINEAR_BOUNDARIES,    Sdc::Options::FVAR_LINEAR_ALL};
  options.SetFVarLinearInterpolation(rules[o.uv]);
  options.SetCreasingMethod(o.creasing == TW_CREASE_CHAIKIN ? Sdc::Options::CREASE_CHAIKIN
                                                            : Sdc::Options::CREASE_UNIFORM);
  options.SetTriangleSubdivision(o.triangles == TW_TRIANGLES_SMOOTH ? Sdc::Options::TRI_SUB_SMOOTH
                                                                    : Sdc::Options::TRI_SUB_CATMARK);
  return options;
}

// The same cage refined by OpenSubdiv in double precision.
class Oracle {
public:
  Oracle(const Cage &cage, const tw_surface_options &o) {
    Far::TopologyDescriptor d;
    std::vector<int> sizes, corners, uvs, creases;
    for (const auto &face : cage.faces) {
      sizes.push_back(static_cast<int>(face.size()));
      corners.insert(corners.end(), face.begin(), face.end());
    }
    for (const auto &face : cage.face_uvs) uvs.insert(uvs.end(), face.begin(), face.end());
    for (const auto &crease : cage.creases) creases.insert(creases.end(), crease.begin(), crease.end());
    d.numVertices = cage.point_count();
    d.numFaces = static_cast<int>(sizes.size());
    d.numVertsPerFace = sizes.data();
    d.vertIndicesPerFace = corners.data();
    d.numCreases = static_cast<int>(cage.creases.size());
    d.creaseVertexIndexPairs = creases.data();
    d.creaseWeights = cage.crease_sharpness.data();
    d.numCorners = static_cast<int>(cage.corners.size());
    d.cornerVertexIndices = cage.corners.data();
    d.cornerWeights = cage.corner_sharpness.data();
    d.numHoles = static_cast<int>(cage.holes.size());
    d.holeIndices = cage.holes.data();
    Far::TopologyDescriptor::FVarChannel channel;
    if (!uvs.empty()) {
      channel.numValues = static_cast<int>(cage.uvs.size() / 2);
      channel.valueIndices = uvs.data();
      d.numFVarChannels = 1;
      d.fvarChannels = &channel;
    }
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    refiner_.reset(Factory::Create(d, Factory::Options(scheme_of(o), sdc_options(o))));
    Far::TopologyRefiner::UniformOptions uniform(static_cast<int>(o.level));
    uniform.fullTopologyInLastLevel = true;
    refiner_->RefineUniform(uniform);
    refine(cage, o);
  }

  const Far::TopologyRefiner &refiner() const { return *refiner_; }
  std::vector<Value3> points, tangents1, tangents2, uvs;

private:
  void refine(const Cage &cage, const tw_surface_options &o) {
    Far::PrimvarRefinerReal<double> primvar(*refiner_);
    points.resize(static_cast<size_t>(cage.point_count()));
    for (size_t i = 0; i < points.size(); i++)
      for (size_t c = 0; c < 3; c++) points[i].v[c] = static_cast<double>(cage.points[3 * i + c]);
    uvs.resize(cage.uvs.size() / 2);
    for (size_t i = 0; i < uvs.size(); i++)
      for (size_t c = 0; c < 2; c++) uvs[i].v[c] = static_cast<double>(cage.uvs[2 * i + c]);
    for (int level = 1; level <= static_cast<int>(o.level); level++) {
      std::vector<Value3> next(static_cast<size_t>(refiner_->GetLevel(level).GetNumVertices()));
      primvar.Interpolate(level, points, next);
      points.swap(next);
      if (cage.face_uvs.empty()) continue;
      std::vector<Value3> next_uvs(static_cast<size_t>(refiner_->GetLevel(level).GetNumFVarValues(0)));
      primvar.InterpolateFaceVarying(level, uvs, next_uvs, 0);
      uvs.swap(next_uvs);
    }
    std::vector<Value3> limit(points.size());
    tangents1.resize(points.size());
    tangents2.resize(points.size());
    primvar.Limit(points, limit, tangents1, tangents2);
    if (!o.limit) return;
    points.swap(limit);
    if (cage.face_uvs.empty()) return;
    std::vector<Value3> uv_limit(uvs.size());
    primvar.LimitFaceVarying(uvs, uv_limit, 0);
    uvs.swap(uv_limit);
  }

  std::unique_ptr<Far::TopologyRefiner> refiner_;
};

// A face of the last level: OpenSubdiv's index, and which of its corners is our first.
struct Cell {
  int face, turn;
};

// The orders in which tw_surface_read_faces may give faces: patch by patch and in rows within, or, where
// a surface is refined in the generic way to its end, the four children of each face after one another.
// Patches are the quads of the cage when it has no other faces, else those of the first level.
enum class Order { CagePatches, Patches, Generic };

// OpenSubdiv's faces in such an order.
class CellWalk {
public:
  CellWalk(const Far::TopologyRefiner &refiner, int level, Order order) : refiner_(refiner), level_(level) {
    const auto &cage = refiner.GetLevel(0);
    for (int f = 0; f < cage.GetNumFaces(); f++) {
      int size = cage.GetFaceVertices(f).size();
      auto children = cage.GetFaceChildFaces(f);
      if (refiner.GetSchemeType() == Sdc::SCHEME_LOOP) {
        walk_children(0, f, 0);
        continue;
      }
      if (order == Order::CagePatches && size == 4) {
        walk_quad(0, f, 0);
        continue;
      }
      for (int corner = 0; corner < size; corner++) {
        int turn = size == 4 ? corner : 0;
        if (order == Order::Patches)
          walk_quad(1, children[corner], turn);
        else
          walk_children(1, children[corner], turn);
      }
    }
  }
  std::vector<Cell> cells;

private:
  void walk_children(int level, int face, int turn) {
    if (level == level_) {
      if (!refiner_.GetLevel(level).IsFaceHole(face)) cells.push_back({face, turn});
      return;
    }
    auto children = refiner_.GetLevel(level).GetFaceChildFaces(face);
    bool triangles = refiner_.GetSchemeType() == Sdc::SCHEME_LOOP;
    for (int k = 0; k < 4; k++) {
      int child = triangles ? k : (turn + k) % 4;
      walk_children(level + 1, children[child], triangles ? 0 : child);
    }
  }

  void walk_quad(int level, int face, int turn) {
    int side = 1 << (level_ - level);
    std::vector<Cell> grid(static_cast<size_t>(side * side));
    place(level, face, turn, side, 0, 0, side, grid);
    for (const Cell &cell : grid)
      if (!refiner_.GetLevel(level_).IsFaceHole(cell.face)) cells.push_back(cell);
  }

  void place(int level, int face, int turn, int size, int i, int j, int side, std::vector<Cell> &grid) {
    if (size == 1) {
      grid[static_cast<size_t>(j * side + i)] = {face, turn};
      return;
    }
    auto children = refiner_.GetLevel(level).GetFaceChildFaces(face);
    static const int right[] = {0, 1, 1, 0}, up[] = {0, 0, 1, 1};
    for (int k = 0; k < 4; k++)
      place(level + 1, children[(turn + k) % 4], turn, size / 2, i + right[k] * size / 2,
            j + up[k] * size / 2, side, grid);
  }

  const Far::TopologyRefiner &refiner_;
  int level_;
};

// One comparison; says what differs.
class Comparison {
public:
  Comparison(const Cage &cage, const Options &options)
      : cage_(cage), options_(options), oracle_(cage, options.tw) {
    for (size_t c = 0; c < 3; c++) {
      float low = cage.points[c], high = low;
      for (size_t i = c; i < cage.points.size(); i += 3) {
        low = std::min(low, cage.points[i]);
        high = std::max(high, cage.points[i]);
      }
      diameter_ = std::max(diameter_, static_cast<double>(high - low));
    }
  }

  std::string run() {
    CageView view(cage_);
    tw_error error{};
    tw_surface *surface = nullptr;
    if (tw_surface_create(&view.mesh, &options_.tw, &surface, &error) != TW_OK) return error.detail;
    tw_surface_reader *reader = tw_surface_reader_create(surface);
    std::string result;
    for (Order order : {Order::CagePatches, Order::Patches, Order::Generic}) {
      result = compare(surface, reader, order);
      if (result != "connectivity differs") break;
    }
    tw_surface_reader_destroy(reader);
    tw_surface_destroy(surface);
    return result;
  }

private:
  static std::string report(const char *what, double difference) {
    char text[100];
    std::snprintf(text, sizeof text, "%s differ by %g", what, difference);
    return text;
  }

  std::string compare(tw_surface *surface, tw_surface_reader *reader, Order order) {
    const auto &level = oracle_.refiner().GetLevel(static_cast<int>(options_.tw.level));
    CellWalk walk(oracle_.refiner(), static_cast<int>(options_.tw.level), order);
    const tw_surface_counts *counts = tw_surface_get_counts(surface);
    if (counts->faces != walk.cells.size())
      return "faces: " + std::to_string(counts->faces) + " against " + std::to_string(walk.cells.size());
    std::vector<uint32_t> points(counts->corners), vertices(counts->corners);
    tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, counts->faces, nullptr, points.data());
    tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, counts->faces, nullptr, vertices.data());
    uint64_t point_rows = tw_surface_row_count(surface, TW_DOMAIN_POINTS);
    uint64_t vertex_rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
    if (point_rows != counts->vertices) return "rows of points and counted vertices";
    const tw_surface_layout *layout = tw_surface_get_layout(surface);
    std::vector<float> positions(3 * point_rows), rows(layout->stride * vertex_rows);
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, point_rows, positions.data());
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, vertex_rows, rows.data());

    std::vector<int> ours_to_theirs(point_rows, -1),
        theirs_to_ours(static_cast<size_t>(level.GetNumVertices()), -1);
    double worst_point = 0, worst_uv = 0;
    normal_error_.assign(static_cast<size_t>(level.GetNumVertices()), 4);
    for (size_t cell = 0; cell < walk.cells.size(); cell++) {
      auto face_vertices = level.GetFaceVertices(walk.cells[cell].face);
      int size = face_vertices.size();
      for (int k = 0; k < size; k++) {
        int theirs = face_vertices[(walk.cells[cell].turn + k) % size];
        size_t at = cell * static_cast<size_t>(size) + static_cast<size_t>(k);
        uint32_t ours = points[at];
        if (ours >= point_rows || vertices[at] >= vertex_rows) return "an index is out of range";
        int &forth = ours_to_theirs[ours], &back = theirs_to_ours[static_cast<size_t>(theirs)];
        if (forth == -1 && back == -1) {
          forth = theirs;
          back = static_cast<int>(ours);
        }
        if (forth != theirs || back != static_cast<int>(ours)) return "connectivity differs";
        const float *row = &rows[vertices[at] * layout->stride];
        for (size_t c = 0; c < 3; c++) {
          if (row[c] != positions[3 * ours + c]) return "a split vertex is not where its point is";
          worst_point = std::max(worst_point, std::abs(static_cast<double>(row[c]) -
                                                       oracle_.points[static_cast<size_t>(theirs)].v[c]));
        }
        if (layout->normal != UINT32_MAX) compare_normal(static_cast<size_t>(theirs), row + layout->normal);
        if (!cage_.face_uvs.empty()) {
          int value = level.GetFaceFVarValues(walk.cells[cell].face, 0)[(walk.cells[cell].turn + k) % size];
          const double *uv = oracle_.uvs[static_cast<size_t>(value)].v;
          worst_uv = std::max({worst_uv, std::abs(static_cast<double>(row[layout->uvs[0]]) - uv[0]),
                               std::abs(1 - static_cast<double>(row[layout->uvs[0] + 1]) - uv[1])});
        }
      }
    }
    double tolerance = options_.tw.limit ? 1e-4 : 1e-5;
    if (worst_point > tolerance * diameter_) return report("points", worst_point / diameter_);
    if (worst_uv > 1e-5) return report("UVs", worst_uv);
    return layout->normal == UINT32_MAX ? "" : check_normals(theirs_to_ours);
  }

  // The best of the normals that a split point has counts.
  void compare_normal(size_t theirs, const float *normal) {
    const double *a = oracle_.tangents1[theirs].v, *b = oracle_.tangents2[theirs].v;
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    double size =
        std::sqrt((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2]));
    double unit =
        std::sqrt(static_cast<double>(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]));
    if (!(std::abs(unit - 1) < 1e-5)) not_unit_ = true;
    // Nearly parallel tangents have no direction that two ways of rounding agree on.
    if (!(length > 0.1 * size) || size < 1e-12) {
      normal_error_[theirs] = 0;
      return;
    }
    double worst = 0;
    for (int c = 0; c < 3; c++)
      worst = std::max(worst, std::abs(n[c] / length - static_cast<double>(normal[c])));
    normal_error_[theirs] = std::min(normal_error_[theirs], worst);
  }

  std::string check_normals(const std::vector<int> &theirs_to_ours) {
    if (not_unit_) return "a normal is not of unit length";
    const auto &level = oracle_.refiner().GetLevel(static_cast<int>(options_.tw.level));
    for (size_t v = 0; v < theirs_to_ours.size(); v++) {
      if (theirs_to_ours[v] == -1 || normal_error_[v] <= tolerance(level, static_cast<int>(v)) ||
          arbitrary(level, static_cast<int>(v)))
        continue;
      return report("normals", normal_error_[v]);
    }
    return "";
  }

  // The two edges of a corner that stays smooth straighten out with each level: their plane is known the
  // less the finer the mesh.
  static double tolerance(const Far::TopologyLevel &level, int vertex) {
    return level.GetVertexFaces(vertex).size() == 1 ? 1e-3 : 1e-4;
  }

  // Where OpenSubdiv takes the tangents of one side or face of several, and which one is an accident of
  // its storage: sharpness that has not decayed, sharp points amid faces, and non-manifold points.
  static bool arbitrary(const Far::TopologyLevel &level, int vertex) {
    if (level.IsVertexNonManifold(vertex)) return true;
    auto faces = level.GetVertexFaces(vertex);
    for (int i = 0; i < faces.size(); i++)
      if (level.IsFaceHole(faces[i])) return true; // the side that it took may be a hole
    bool semi = Sdc::Crease::IsSemiSharp(level.GetVertexSharpness(vertex));
    auto edges = level.GetVertexEdges(vertex);
    for (int i = 0; i < edges.size(); i++) {
      semi |= Sdc::Crease::IsSemiSharp(level.GetEdgeSharpness(edges[i]));
    }
    return semi || (level.GetVertexRule(vertex) == Sdc::Crease::RULE_CORNER && faces.size() > 1);
  }

  const Cage &cage_;
  const Options &options_;
  Oracle oracle_;
  double diameter_ = 0;
  std::vector<double> normal_error_;
  bool not_unit_ = false;
};

int tests = 0, failures = 0, cases = 0;

void compare(const Cage &cage, const Options &options, std::string &first_failure) {
  cases++;
  std::string difference = Comparison(cage, options).run();
  if (!difference.empty() && first_failure.empty())
    first_failure = cage.name + ", " + options.text() + ": " + difference;
  if (!difference.empty()) failures++;
}

void report(const std::string &name, const std::string &first_failure) {
  tests++;
  std::printf("%sok %d - %s\n", first_failure.empty() ? "" : "not ", tests, name.c_str());
  if (!first_failure.empty()) std::printf("# %s\n", first_failure.c_str());
}

Options options_of(tw_scheme scheme, uint32_t level, int boundary, int uv, bool chaikin, bool smooth,
                   bool limit) {
  Options options{};
  options.tw.level = level;
  options.tw.boundary = static_cast<tw_boundary>(boundary);
  options.tw.uv = static_cast<tw_uv_rule>(uv);
  options.tw.creasing = chaikin ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM;
  options.tw.triangles = smooth ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK;
  options.tw.scheme = scheme;
  options.tw.limit = limit;
  options.tw.normals = scheme != TW_BILINEAR;
  return options;
}

void compare_hand_made(uint32_t levels) {
  for (const Cage &cage : hand_made()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++)
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.face_uvs.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 8; flags++)
            compare(cage, options_of(TW_CATMULL_CLARK, level, boundary, uv, flags & 1, flags & 2, flags & 4),
                    failure);
    for (uint32_t level = 1; level <= levels; level++)
      compare(cage, options_of(TW_BILINEAR, level, 0, 0, false, false, false), failure);
    report("opensubdiv agrees on " + cage.name, failure);
  }
  for (const Cage &cage : hand_made_triangles()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++)
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.face_uvs.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 4; flags++)
            compare(cage, options_of(TW_LOOP, level, boundary, uv, flags & 1, false, flags & 2), failure);
    report("opensubdiv agrees by loop on " + cage.name, failure);
  }
}

void compare_random(tw_scheme scheme, int count) {
  std::mt19937 random(20261121);
  std::string failure;
  int failed_before = failures;
  for (int i = 0; i < count; i++) {
    Cage cage = scheme == TW_LOOP ? random_triangle_cage(random) : random_cage(random);
    uint32_t level = 1 + static_cast<uint32_t>(random() % 4);
    unsigned flags = static_cast<unsigned>(random() % 8);
    // One after another: the order of arguments is the compiler's.
    int uv = static_cast<int>(random() % 6);
    int boundary = static_cast<int>(random() % 3);
    compare(cage, options_of(scheme, level, boundary, uv, flags & 1, flags & 2, flags & 4), failure);
  }
  report(std::string("opensubdiv agrees ") + (scheme == TW_LOOP ? "by loop " : "") + "on " +
             std::to_string(count) + " random cages",
         failure);
  if (failures > failed_before) std::printf("# %d of the random cages differ\n", failures - failed_before);
}

} // namespace

int main(int argc, char **argv) {
  // A sanitizer makes each case ten times slower, and sees enough in fewer.
  bool sanitized = std::getenv("TWEEND_SANITIZED") != nullptr;
  int random_count = argc > 1 ? std::atoi(argv[1]) : sanitized ? 300 : 3000;
  compare_hand_made(sanitized ? 2 : 4);
  compare_random(TW_CATMULL_CLARK, random_count);
  compare_random(TW_LOOP, random_count);
  std::printf("1..%d\n# %d cases compared\n", tests, cases);
  return failures ? 1 : 0;
}
