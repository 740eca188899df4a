// OpenSubdiv defines right: same connectivity, points (within 1e-5 of the cage's size), limit points and
// normals (1e-4), UVs (1e-5) and attributes of points, over hand-made and random cages, all options, levels 1
// to 4. Prints TAP; an argument sets the number of random cages.
//
// What differs from OpenSubdiv, and how it is compared:
// - Normals where several sides meet. OpenSubdiv's tangents are those of one side, as its storage has it.
//   Every row of ours is held against OpenSubdiv's masks for the side that the row's own faces lie on,
//   between infinitely sharp edges.
// - Normals where something semi-sharp has yet to decay. OpenSubdiv takes it for sharp, and so has one of two
//   sides again. Ours are those of the vertex after all decay, as OpenSubdiv has them at the level at which
//   it has just decayed. Limit points count it as sharp with both.
// - Sharp points amid faces, without sharp edges that part them, and points of valence 2 have no tangent
//   plane: the normal is that of one of the faces there, with both.
// - Non-manifold points are corners to OpenSubdiv, its tangents along any two edges. Ours are those of the
//   row's own face, or of its side where the surface is a regular patch right there.
// - Open borders are not OpenSubdiv's: tests/unit/open_test.c.
// - Limits of UVs on bilinear surfaces: OpenSubdiv applies the smooth mask along seams, although its refined
//   values are linear there. Ours stay where they are.
// - UV sets that OpenSubdiv misreads are left out and counted (Oracle::misreads).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "oracle.hpp"
#include "tweend/format.h"

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

namespace {

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

std::string report(const char *what, double difference) {
  char text[100];
  std::snprintf(text, sizeof text, "%s differ by %g", what, difference);
  return text;
}

// The normals of one surface. A row may serve several corners: its normal has to suit all of them.
class Normals {
public:
  Normals(const Oracle &oracle, uint64_t rows) : oracle_(oracle), rows_(rows) {}

  // The row of the corner at OpenSubdiv's vertex in OpenSubdiv's face.
  void add(uint32_t row, int vertex, int face, const float *normal) {
    double square = 0;
    for (int c = 0; c < 3; c++) square += static_cast<double>(normal[c]) * static_cast<double>(normal[c]);
    if (!(std::abs(square - 1) < 1e-5)) not_unit_ = true;
    Row &r = rows_[row];
    auto candidates = oracle_.normals(vertex, face, r.kind);
    if (candidates.empty()) {
      r.undirected = true;
      return;
    }
    double best = 4;
    for (const Value3 &candidate : candidates) {
      double worst = 0;
      for (int c = 0; c < 3; c++)
        worst = std::max(worst, std::abs(candidate.v[c] - static_cast<double>(normal[c])));
      best = std::min(best, worst);
    }
    r.worst = std::max(r.worst, best);
    r.best = std::min(r.best, best);
  }

  std::string verdict() const {
    if (not_unit_) return "a normal is not of unit length";
    for (const Row &row : rows_) {
      // Where a row serves faces that have no tangent plane in common, it is that of one of them.
      bool shared = row.kind == Oracle::NonManifold || row.kind == Oracle::Flat;
      if (row.undirected || row.best > 3) continue;
      counts[row.kind]++;
      double error = shared ? row.best : row.worst;
      // At valence 2 the normal is that of two short edges, whose ends are rounded to float.
      double tolerance = row.kind == Oracle::Valence2 ? 1e-3 : 1e-4;
      if (error > tolerance) return report(("normals of kind " + std::to_string(row.kind)).c_str(), error);
    }
    return "";
  }

  static long counts[Oracle::KindCount];

private:
  struct Row {
    double worst = 0, best = 4;
    Oracle::Kind kind = Oracle::Smooth;
    bool undirected = false;
  };
  const Oracle &oracle_;
  std::vector<Row> rows_;
  bool not_unit_ = false;
};

long Normals::counts[Oracle::KindCount];

int misread_sets = 0;

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

  // With all that the cage bears, and its points alone, which are made in other ways.
  std::string run() {
    CageView view(cage_);
    // Three attributes that are the points once more, so that what holds for these holds for them.
    size_t count = cage_.points.size() / 3;
    std::vector<float> single(count), pair(2 * count), four(4 * count);
    for (size_t p = 0; p < count; p++) {
      const float *point = &cage_.points[3 * p];
      single[p] = point[0];
      for (size_t c = 0; c < 2; c++) pair[2 * p + c] = point[1 + c];
      for (size_t c = 0; c < 4; c++) four[4 * p + c] = point[c % 3];
    }
    const tw_attribute attributes[] = {
        {"_1", 1, false, single.data()}, {"_2", 2, false, pair.data()}, {"_4", 4, false, four.data()}};
    view.mesh.attributes = attributes;
    view.mesh.attribute_count = 3;
    std::string result = run(view.mesh, options_.tw);
    if (!result.empty() || options_.tw.limit) return result;
    tw_surface_options bare = options_.tw;
    bare.normals = false;
    view.mesh.uv_set_count = view.mesh.attribute_count = 0;
    result = run(view.mesh, bare);
    return result.empty() ? result : result + " without normals";
  }

private:
  std::string run(const tw_mesh &mesh, const tw_surface_options &options) {
    tw_error error{};
    tw_surface *surface = nullptr;
    if (tw_surface_create(&mesh, &options, &surface, &error) != TW_OK) return error.detail;
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

  // Of a row's attributes, which hold the point's x; y, z; x, y, z, x.
  static double attribute_error(const float *row, const tw_surface_layout &layout, const Value3 &point) {
    static const size_t axes[] = {0, 1, 2, 0, 1, 2, 0};
    double worst = 0;
    const float *values = row + layout.attributes[0];
    for (size_t c = 0; c < 7; c++)
      worst = std::max(worst, std::abs(static_cast<double>(values[c]) - point.v[axes[c]]));
    return worst;
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
    double worst_point = 0, worst_attribute = 0, worst_uv = 0;
    Normals compared(oracle_, vertex_rows);
    std::vector<size_t> comparable_sets;
    for (size_t set = 0; set < layout->uv_count; set++)
      if (oracle_.misreads(set))
        misread_sets++;
      else
        comparable_sets.push_back(set);
    for (size_t cell = 0; cell < walk.cells.size(); cell++) {
      auto face_vertices = level.GetFaceVertices(walk.cells[cell].face);
      int size = face_vertices.size();
      for (int k = 0; k < size; k++) {
        int corner = (walk.cells[cell].turn + k) % size, theirs = face_vertices[corner];
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
        if (layout->attribute_count > 0)
          worst_attribute = std::max(
              worst_attribute, attribute_error(row, *layout, oracle_.points[static_cast<size_t>(theirs)]));
        if (layout->normal != UINT32_MAX)
          compared.add(vertices[at], theirs, walk.cells[cell].face, row + layout->normal);
        for (size_t set : comparable_sets) {
          int value = level.GetFaceFVarValues(walk.cells[cell].face, static_cast<int>(set))[corner];
          const double *uv = oracle_.uvs[set][static_cast<size_t>(value)].v;
          worst_uv = std::max({worst_uv, std::abs(static_cast<double>(row[layout->uvs[set]]) - uv[0]),
                               std::abs(1 - static_cast<double>(row[layout->uvs[set] + 1]) - uv[1])});
        }
      }
    }
    double tolerance = options_.tw.limit ? 1e-4 : 1e-5;
    if (worst_point > tolerance * diameter_) return report("points", worst_point / diameter_);
    if (worst_attribute > tolerance * diameter_) return report("attributes", worst_attribute / diameter_);
    if (worst_uv > 1e-5) return report("UVs", worst_uv);
    return compared.verdict();
  }

  const Cage &cage_;
  const Options &options_;
  Oracle oracle_;
  double diameter_ = 0;
};

int tests = 0, failures = 0, cases = 0;

void compare(const Cage &cage, const Options &options, std::string &first_failure) {
  cases++;
  std::string difference = Comparison(cage, options).run();
  if (!difference.empty() && first_failure.empty())
    first_failure = cage.name + ", " + options.text() + ": " + difference;
  if (!difference.empty()) failures++;
}

void conclude(const std::string &name, const std::string &first_failure) {
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
  options.tw.normals = true;
  return options;
}

void compare_hand_made(uint32_t levels) {
  for (const Cage &cage : hand_made()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++)
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.uv_sets.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 8; flags++)
            compare(cage, options_of(TW_CATMULL_CLARK, level, boundary, uv, flags & 1, flags & 2, flags & 4),
                    failure);
    for (uint32_t level = 1; level <= levels; level++)
      compare(cage, options_of(TW_BILINEAR, level, 0, 0, false, false, false), failure);
    conclude("opensubdiv agrees on " + cage.name, failure);
  }
  for (const Cage &cage : hand_made_triangles()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++)
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.uv_sets.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 4; flags++)
            compare(cage, options_of(TW_LOOP, level, boundary, uv, flags & 1, false, flags & 2), failure);
    conclude("opensubdiv agrees by loop on " + cage.name, failure);
  }
}

// A cage as an OBJ file without tags, whose points the reader may weld.
std::string obj_of(const Cage &cage) {
  std::string text;
  char number[32];
  for (size_t i = 0; i < cage.points.size(); i++) {
    std::snprintf(number, sizeof number, "%s%.9g", i % 3 ? " " : "\nv ", static_cast<double>(cage.points[i]));
    text += number;
  }
  for (const std::vector<int> &face : cage.faces) {
    text += "\nf";
    for (int point : face) text += " " + std::to_string(point + 1);
  }
  return text;
}

// Cages have each point once: welding finds nothing to join.
void weld_nothing(const std::vector<Cage> &cages, const std::string &name) {
  std::string failure;
  for (const Cage &cage : cages) {
    std::string text = obj_of(cage);
    CageView view(cage);
    tw_model *model = nullptr;
    tw_status status = tw_obj_read(reinterpret_cast<const uint8_t *>(text.data()), text.size(), TW_WELD_AUTO,
                                   &model, nullptr);
    const tw_mesh *mesh = status == TW_OK ? model->meshes : nullptr;
    bool same = mesh && mesh->point_count == view.mesh.point_count &&
                mesh->face_count == view.mesh.face_count && mesh->corner_count == view.mesh.corner_count &&
                std::equal(mesh->corners, mesh->corners + mesh->corner_count, view.mesh.corners);
    if (!same && failure.empty()) failure = cage.name;
    tw_model_destroy(model);
  }
  conclude(name, failure);
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
  static const char *const names[] = {"by catmull-clark", "by loop", "bilinearly"};
  conclude(std::string("opensubdiv agrees ") + names[scheme] + " on " + std::to_string(count) +
               " random cages",
           failure);
  if (failures > failed_before) std::printf("# %d of the random cages differ\n", failures - failed_before);
}

} // namespace

// opensubdiv_test [hand-made|random]: both kinds of cages without a word.
int main(int argc, char **argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  // A sanitizer makes each case ten times slower, and sees enough in fewer.
  bool sanitized = std::getenv("TESTED_SANITIZED") != nullptr;
  if (only != "random") {
    compare_hand_made(sanitized ? 2 : 4);
    weld_nothing(hand_made(), "welding leaves hand-made cages as they are");
    weld_nothing(hand_made_triangles(), "welding leaves hand-made cages of triangles as they are");
  }
  if (only != "hand-made") {
    int random_count = sanitized ? 300 : 2500;
    compare_random(TW_CATMULL_CLARK, random_count);
    compare_random(TW_LOOP, random_count);
    compare_random(TW_BILINEAR, random_count / 5);
  }
  std::printf("1..%d\n# %d cases compared\n", tests, cases);
  std::printf("# %d UV sets left out: OpenSubdiv misreads them\n", misread_sets);
  static const char *const kinds[] = {"smooth",     "sides",     "corners",      "sharp amid",
                                      "semi-sharp", "valence 2", "non-manifold", "flat"};
  std::printf("# normals:");
  for (int kind = 0; kind < Oracle::KindCount; kind++)
    std::printf(" %ld %s", Normals::counts[kind], kinds[kind]);
  std::printf("\n");
  return failures ? 1 : 0;
}
