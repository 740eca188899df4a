#include "comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

long compared_normals[Oracle::KindCount];
int misread_sets = 0;
long returning_values = 0;
long compared_uvs = 0, compared_colors = 0;

namespace {

// A face of the last level: OpenSubdiv's index, and which of its corners is tweend's first.
struct Cell {
  int face, turn;
};

// OpenSubdiv's faces in an order that tw_surface_read_faces may use: down to a depth, the children of each
// face one after another; from there on patch by patch, with rows inside. Patches are the quads of the cage
// when it has only quads (depth 0), else those of the first level (1), of the deepest level with details, or
// the faces themselves.
class CellWalk {
public:
  CellWalk(const Far::TopologyRefiner &refiner, int level, int depth)
      : refiner_(refiner), level_(level), depth_(depth) {
    const auto &cage = refiner.GetLevel(0);
    for (int f = 0; f < cage.GetNumFaces(); f++) {
      int size = cage.GetFaceVertices(f).size();
      auto children = cage.GetFaceChildFaces(f);
      if (refiner.GetSchemeType() == Sdc::SCHEME_LOOP) {
        walk_children(0, f, 0);
        continue;
      }
      if (depth == 0 && size == 4) {
        walk_quad(0, f, 0);
        continue;
      }
      for (int corner = 0; corner < size; corner++)
        walk_children(1, children[corner], size == 4 ? corner : 0);
    }
  }
  std::vector<Cell> cells;

private:
  void walk_children(int level, int face, int turn) {
    bool triangles = refiner_.GetSchemeType() == Sdc::SCHEME_LOOP;
    if (level == level_ || (level >= depth_ && !triangles)) {
      walk_quad(level, face, turn);
      return;
    }
    auto children = refiner_.GetLevel(level).GetFaceChildFaces(face);
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
  int level_, depth_;
};

std::string report(const char *what, double difference) {
  char text[100];
  std::snprintf(text, sizeof text, "%s differ by %g", what, difference);
  return text;
}

// The normals of one surface. A row may serve several corners: its normal must suit all of them.
class Normals {
public:
  Normals(const Oracle &oracle, uint64_t rows, bool modelled)
      : oracle_(oracle), rows_(rows), modelled_(modelled) {}

  // Compares the normal of a row, for the corner at OpenSubdiv's vertex in OpenSubdiv's face.
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
      // A row of faces without a common tangent plane has the normal of one of them.
      bool shared = row.kind == Oracle::NonManifold || row.kind == Oracle::Flat;
      if (row.undirected || row.best > 3) continue;
      compared_normals[row.kind]++;
      double error = shared ? row.best : row.worst;
      // The normal may come from two short edges, whose ends are rounded to float. So are the points of a
      // sculpted level, whose edges are shorter the deeper it is.
      bool is_of_face = row.kind == Oracle::Valence2 || row.kind == Oracle::Flat;
      double tolerance = is_of_face ? 1e-3 : modelled_ ? 5e-4 : 1e-4;
      if (error > tolerance) return report(("normals of kind " + std::to_string(row.kind)).c_str(), error);
    }
    return "";
  }

private:
  struct Row {
    double worst = 0, best = 4;
    Oracle::Kind kind = Oracle::Smooth;
    bool undirected = false;
  };
  const Oracle &oracle_;
  std::vector<Row> rows_;
  bool modelled_;
  bool not_unit_ = false;
};

// The error of a row's attributes, which hold the point's x; y, z; x, y, z, x.
static double attribute_error(const float *row, const tw_surface_layout &layout, const Value3 &point) {
  static const size_t axes[] = {0, 1, 2, 0, 1, 2, 0};
  double worst = 0;
  const float *values = row + layout.attributes[0].column;
  for (size_t c = 0; c < 7; c++)
    worst = std::max(worst, std::abs(static_cast<double>(values[c]) - point.v[axes[c]]));
  return worst;
}

} // namespace

std::string text_of(const tw_surface_options &o) {
  char line[200];
  std::snprintf(line, sizeof line, "level %u boundary %d uv %d creasing %d triangles %d scheme %d limit %d",
                o.level, static_cast<int>(o.boundary), static_cast<int>(o.uv), static_cast<int>(o.creasing),
                static_cast<int>(o.triangles), static_cast<int>(o.scheme), o.limit);
  return line;
}

PointAttributes::PointAttributes(const Cage &cage) {
  size_t count = cage.points.size() / 3;
  for (size_t p = 0; p < count; p++) {
    const float *point = &cage.points[3 * p];
    single_.push_back(point[0]);
    pair_.insert(pair_.end(), {point[1], point[2]});
    four_.insert(four_.end(), {point[0], point[1], point[2], point[0]});
  }
  const float *values[] = {single_.data(), pair_.data(), four_.data()};
  static const char *const names[] = {"_1", "_2", "_4"};
  for (size_t i = 0; i < COUNT; i++) {
    attributes_[i].name = names[i];
    attributes_[i].width = 1u << i;
    attributes_[i].values = values[i];
  }
}

void PointAttributes::give(tw_mesh &mesh) const {
  mesh.attributes = attributes_;
  mesh.attribute_count = COUNT;
}

CornerAttributes::CornerAttributes(const tw_mesh &mesh)
    : attributes_(mesh.attributes, mesh.attributes + mesh.attribute_count) {
  static const char *const names[] = {"_A", "_B", "_C", "_D"};
  for (uint32_t set = 0; set < mesh.uv_set_count; set++) {
    const tw_uv_set &from = mesh.uv_sets[set];
    for (uint32_t i = 0; i < from.value_count; i++) {
      const float *uv = from.values + 2 * size_t{i};
      values_[set].insert(values_[set].end(), {uv[0], uv[1], uv[1], uv[0]});
    }
    tw_attribute made{};
    made.name = names[set];
    made.width = 4;
    made.values = values_[set].data();
    made.value_count = from.value_count;
    made.corners = from.corners;
    attributes_.push_back(made);
  }
}

void CornerAttributes::give(tw_mesh &mesh) const {
  mesh.attributes = attributes_.data();
  mesh.attribute_count = static_cast<uint32_t>(attributes_.size());
}

Comparison::Comparison(const Cage &cage, const tw_surface_options &options, const Sculpts &sculpts)
    : cage_(cage), options_(options), oracle_(cage, options, sculpts) {
  if (!sculpts.empty()) plain_ = std::make_unique<Oracle>(cage, options);
  for (size_t c = 0; c < 3; c++) {
    float low = cage.points[c], high = low;
    for (size_t i = c; i < cage.points.size(); i += 3) {
      low = std::min(low, cage.points[i]);
      high = std::max(high, cage.points[i]);
    }
    diameter_ = std::max(diameter_, static_cast<double>(high - low));
  }
}

std::string Comparison::run() {
  CageView view(cage_);
  PointAttributes attributes(cage_);
  attributes.give(view.mesh);
  return run(view.mesh);
}

std::string Comparison::run(tw_mesh mesh) {
  std::string result = run(mesh, options_);
  const CornerAttributes corners(mesh);
  // Beside the UV sets, whose fields the attributes share, and without them.
  for (int shared = 1; shared >= 0 && result.empty() && mesh.uv_set_count > 0; shared--) {
    tw_mesh colored = mesh;
    corners.give(colored);
    if (!shared) colored.uv_set_count = 0;
    result = run(colored, options_);
    if (!result.empty())
      result += shared ? " with attributes of corners" : " with attributes of corners alone";
  }
  if (!result.empty() || options_.limit) return result;
  tw_surface_options bare = options_;
  bare.normals = false;
  mesh.uv_set_count = mesh.attribute_count = 0;
  const std::vector<int> rows = theirs_; // without UVs the rows may have another order
  result = run(mesh, bare);
  theirs_ = rows;
  return result.empty() ? result : result + " without normals";
}

std::string Comparison::run(const tw_mesh &mesh, const tw_surface_options &options) {
  tw_error error{};
  tw_surface *surface = nullptr;
  if (tw_surface_create(&mesh, &options, &surface, &error) != TW_OK) return error.detail;
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  std::string result;
  for (int depth = 0; depth <= static_cast<int>(options_.level); depth++) {
    result = compare(surface, reader, depth);
    if (result != "connectivity differs") break;
  }
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
  return result;
}

std::string Comparison::compare(tw_surface *surface, tw_surface_reader *reader, int depth) {
  const auto &level = oracle_.refiner().GetLevel(static_cast<int>(options_.level));
  CellWalk walk(oracle_.refiner(), static_cast<int>(options_.level), depth);
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

  theirs_.assign(point_rows, -1);
  std::vector<int> theirs_to_ours(static_cast<size_t>(level.GetNumVertices()), -1);
  double worst_point = 0, worst_attribute = 0, worst_uv = 0, worst_color = 0;
  Normals compared(oracle_, vertex_rows, plain_ != nullptr);
  const Oracle &plain = plain_ ? *plain_ : oracle_;
  std::vector<size_t> comparable_sets, comparable_colors;
  for (size_t set = 0; set < layout->uv_count; set++)
    if (oracle_.misreads(set)) {
      misread_sets++;
    } else {
      comparable_sets.push_back(set);
      returning_values += oracle_.returning_values(set);
    }
  for (size_t set = 0; PointAttributes::COUNT + set < layout->attribute_count; set++)
    if (!oracle_.misreads(set)) comparable_colors.push_back(set);
  for (size_t cell = 0; cell < walk.cells.size(); cell++) {
    auto face_vertices = level.GetFaceVertices(walk.cells[cell].face);
    int size = face_vertices.size();
    for (int k = 0; k < size; k++) {
      int corner = (walk.cells[cell].turn + k) % size, theirs = face_vertices[corner];
      size_t at = cell * static_cast<size_t>(size) + static_cast<size_t>(k);
      uint32_t ours = points[at];
      if (ours >= point_rows || vertices[at] >= vertex_rows) return "an index is out of range";
      int &forth = theirs_[ours], &back = theirs_to_ours[static_cast<size_t>(theirs)];
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
        worst_attribute = std::max(worst_attribute,
                                   attribute_error(row, *layout, plain.points[static_cast<size_t>(theirs)]));
      if (layout->normal != UINT32_MAX)
        compared.add(vertices[at], theirs, walk.cells[cell].face, row + layout->normal);
      for (size_t set : comparable_sets) {
        int value = level.GetFaceFVarValues(walk.cells[cell].face, static_cast<int>(set))[corner];
        const double *uv = oracle_.uvs[set][static_cast<size_t>(value)].v;
        compared_uvs += 2;
        worst_uv = std::max({worst_uv, std::abs(static_cast<double>(row[layout->uvs[set]]) - uv[0]),
                             std::abs(1 - static_cast<double>(row[layout->uvs[set] + 1]) - uv[1])});
      }
      for (size_t set : comparable_colors) {
        int value = level.GetFaceFVarValues(walk.cells[cell].face, static_cast<int>(set))[corner];
        const double *uv = oracle_.uvs[set][static_cast<size_t>(value)].v;
        const float *own = row + layout->attributes[PointAttributes::COUNT + set].column;
        compared_colors += 4;
        for (size_t c = 0; c < 4; c++)
          worst_color = std::max(worst_color, std::abs(static_cast<double>(own[c]) - uv[c == 1 || c == 2]));
      }
    }
  }
  double tolerance = options_.limit ? 1e-4 : 1e-5;
  if (worst_point > tolerance * diameter_) return report("points", worst_point / diameter_);
  if (worst_attribute > tolerance * diameter_) return report("attributes", worst_attribute / diameter_);
  if (worst_uv > 1e-5) return report("UVs", worst_uv);
  if (worst_color > 1e-5) return report("attributes of corners", worst_color);
  return compared.verdict();
}
