#include "oracle.hpp"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <opensubdiv/sdc/catmarkScheme.h>
#include <opensubdiv/sdc/loopScheme.h>

#include <algorithm>
#include <cmath>

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

static Sdc::SchemeType scheme_of(const tw_surface_options &o) {
  return o.scheme == TW_LOOP       ? Sdc::SCHEME_LOOP
         : o.scheme == TW_BILINEAR ? Sdc::SCHEME_BILINEAR
                                   : Sdc::SCHEME_CATMARK;
}

static Sdc::Options sdc_options(const tw_surface_options &o) {
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

static std::vector<int> flat(const std::vector<std::vector<int>> &faces) {
  std::vector<int> corners;
  for (const auto &face : faces) corners.insert(corners.end(), face.begin(), face.end());
  return corners;
}

static std::unique_ptr<Far::TopologyRefiner> refiner_for(const Cage &cage, const tw_surface_options &o) {
  Far::TopologyDescriptor d;
  std::vector<int> sizes, corners = flat(cage.faces), creases;
  for (const auto &face : cage.faces) sizes.push_back(static_cast<int>(face.size()));
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
  std::vector<std::vector<int>> uv_corners;
  for (const UvSet &set : cage.uv_sets) uv_corners.push_back(flat(set.faces));
  std::vector<Far::TopologyDescriptor::FVarChannel> channels(cage.uv_sets.size());
  for (size_t i = 0; i < channels.size(); i++) {
    channels[i].numValues = static_cast<int>(cage.uv_sets[i].values.size() / 2);
    channels[i].valueIndices = uv_corners[i].data();
  }
  d.numFVarChannels = static_cast<int>(channels.size());
  d.fvarChannels = channels.data();
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(d, Factory::Options(scheme_of(o), sdc_options(o))));
  Far::TopologyRefiner::UniformOptions uniform(static_cast<int>(o.level));
  uniform.fullTopologyInLastLevel = true;
  refiner->RefineUniform(uniform);
  return refiner;
}

// The number of levels after which nothing is semi-sharp.
static uint32_t decay_levels(const Cage &cage) {
  float greatest = 0;
  for (const auto *list : {&cage.crease_sharpness, &cage.corner_sharpness})
    for (float sharpness : *list)
      if (Sdc::Crease::IsSemiSharp(sharpness)) greatest = std::max(greatest, sharpness);
  return static_cast<uint32_t>(std::ceil(greatest));
}

Oracle::Oracle(const Cage &cage, const tw_surface_options &o, const Sculpts &sculpts)
    : refiner_(refiner_for(cage, o)), linear_(o.scheme == TW_BILINEAR) {
  refine(cage, o, sculpts);
  if (!o.normals || linear_ || o.level >= decay_levels(cage)) return;
  tw_surface_options further = o;
  further.level++;
  further.limit = false;
  Cage bare = cage;
  bare.uv_sets.clear();
  next_ = std::make_unique<Oracle>(bare, further, sculpts);
}

void Oracle::follow(const Cage &cage, const tw_surface_options &o, const Sculpts &sculpts) {
  tw_surface_options deepest = o;
  deepest.level = sculpts.back().level;
  deepest.limit = deepest.normals = false;
  Sculpts shown;
  for (const Sculpt &sculpt : sculpts)
    if (sculpt.level <= o.level) shown.push_back(sculpt);
  const Oracle to(cage, deepest, sculpts), from(cage, deepest, shown);
  for (size_t i = 0; i < points.size(); i++) {
    int v = static_cast<int>(i);
    for (int level = static_cast<int>(o.level); level < static_cast<int>(deepest.level); level++)
      v = to.refiner_->GetLevel(level).GetVertexChildVertex(v);
    points[i].AddWithWeight(to.points[static_cast<size_t>(v)], 1);
    points[i].AddWithWeight(from.points[static_cast<size_t>(v)], -1);
  }
}

void Oracle::refine(const Cage &cage, const tw_surface_options &o, const Sculpts &sculpts) {
  Far::PrimvarRefinerReal<double> primvar(*refiner_);
  points.resize(static_cast<size_t>(cage.point_count()));
  for (size_t i = 0; i < points.size(); i++)
    for (size_t c = 0; c < 3; c++) points[i].v[c] = static_cast<double>(cage.points[3 * i + c]);
  for (const UvSet &set : cage.uv_sets) {
    uvs.emplace_back(set.values.size() / 2);
    for (size_t i = 0; i < set.values.size(); i++)
      uvs.back()[i / 2].v[i % 2] = static_cast<double>(set.values[i]);
  }
  int sets = static_cast<int>(uvs.size());
  for (int level = 1; level <= static_cast<int>(o.level); level++) {
    std::vector<Value3> next(static_cast<size_t>(refiner_->GetLevel(level).GetNumVertices()));
    primvar.Interpolate(level, points, next);
    points.swap(next);
    for (const Sculpt &sculpt : sculpts)
      if (sculpt.level == static_cast<uint32_t>(level)) points = sculpt.points;
    for (int set = 0; set < sets; set++) {
      std::vector<Value3> &values = uvs[static_cast<size_t>(set)];
      std::vector<Value3> refined(static_cast<size_t>(refiner_->GetLevel(level).GetNumFVarValues(set)));
      primvar.InterpolateFaceVarying(level, values, refined, set);
      values.swap(refined);
    }
  }
  if (!sculpts.empty() && sculpts.back().level > o.level) follow(cage, o, sculpts);
  unmoved_ = points;
  std::vector<Value3> limit(points.size());
  tangents1_.resize(points.size());
  tangents2_.resize(points.size());
  primvar.Limit(points, limit, tangents1_, tangents2_);
  if (!o.limit) return;
  points.swap(limit);
  // A bilinear surface is its own limit, but OpenSubdiv smooths the values along seams there too.
  for (int set = 0; set < sets && !linear_; set++) {
    std::vector<Value3> &values = uvs[static_cast<size_t>(set)], uv_limit(values.size());
    primvar.LimitFaceVarying(values, uv_limit, set);
    values.swap(uv_limit);
  }
}

bool Oracle::misreads(size_t set) const {
  const Far::TopologyLevel &cage = refiner_->GetLevel(0);
  for (int v = 0; v < cage.GetNumVertices(); v++) {
    auto faces = cage.GetVertexFaces(v);
    auto places = cage.GetVertexFaceLocalIndices(v);
    std::vector<int> seen;
    int before = -1;
    for (int i = 0; i < faces.size(); i++) {
      int value = cage.GetFaceFVarValues(faces[i], static_cast<int>(set))[places[i]];
      bool known = std::find(seen.begin(), seen.end(), value) != seen.end();
      if (known && value != before && seen.size() == 2 && value == seen[1]) return true;
      if (!known) seen.push_back(value);
      before = value;
    }
  }
  return false;
}

long Oracle::returning_values(size_t set) const {
  const Far::TopologyLevel &cage = refiner_->GetLevel(0);
  long count = 0;
  for (int v = 0; v < cage.GetNumVertices(); v++) {
    auto faces = cage.GetVertexFaces(v);
    auto places = cage.GetVertexFaceLocalIndices(v);
    std::vector<int> sectors; // the value of each
    for (int i = 0; i < faces.size(); i++) {
      int value = cage.GetFaceFVarValues(faces[i], static_cast<int>(set))[places[i]];
      if (sectors.empty() || sectors.back() != value) sectors.push_back(value);
    }
    bool is_closed = cage.GetVertexEdges(v).size() == faces.size();
    if (is_closed && sectors.size() > 1 && sectors.front() == sectors.back()) sectors.pop_back();
    std::sort(sectors.begin(), sectors.end());
    bool returns = std::adjacent_find(sectors.begin(), sectors.end()) != sectors.end();
    count += returns && !cage.IsVertexNonManifold(v);
  }
  return count;
}

// ---- normals -----------------------------------------------------------------------------------

static Value3 difference(const Value3 &a, const Value3 &b) {
  Value3 d = a;
  d.AddWithWeight(b, -1);
  return d;
}

static void add_normal(const Value3 &tangent1, const Value3 &tangent2, std::vector<Value3> &out) {
  const double *a = tangent1.v, *b = tangent2.v;
  Value3 n;
  for (int i = 0; i < 3; i++) n.v[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
  double length = std::sqrt(n.v[0] * n.v[0] + n.v[1] * n.v[1] + n.v[2] * n.v[2]);
  double size1 = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]),
         size2 = std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]), size = size1 * size2;
  // For two faces back to back, one tangent is only a rounding error.
  if (std::min(size1, size2) < 1e-5 * std::max(size1, size2)) return;
  if (!(length > 0.01 * size) || size < 1e-12) return;
  for (double &component : n.v) component /= length;
  out.push_back(n);
}

namespace {

// Receives the masks that OpenSubdiv computes. BorderVertex is the neighbourhood for which it computes them:
// a vertex of so many faces whose outer two edges are infinitely sharp.
struct Mask {
  using Weight = double;
  explicit Mask(size_t edges) : edge(edges, 0), face(edges, 0) {}
  double vertex = 0;
  std::vector<double> edge, face;
  void SetNumVertexWeights(int) {}
  void SetNumEdgeWeights(int) {}
  void SetNumFaceWeights(int) {}
  void SetFaceWeightsForFaceCenters(bool) {}
  int GetNumVertexWeights() const { return 1; }
  int GetNumEdgeWeights() const { return static_cast<int>(edge.size()); }
  int GetNumFaceWeights() const { return static_cast<int>(face.size()); }
  double &VertexWeight(int) { return vertex; }
  double &EdgeWeight(int i) { return edge[static_cast<size_t>(i)]; }
  double &FaceWeight(int i) { return face[static_cast<size_t>(i)]; }
};

struct BorderVertex {
  int faces;
  int GetNumEdges() const { return faces + 1; }
  int GetNumFaces() const { return faces; }
  float *GetSharpnessPerEdge(float *sharpness) const {
    for (int i = 0; i <= faces; i++)
      sharpness[i] = i == 0 || i == faces ? Sdc::Crease::SHARPNESS_INFINITE : 0.0f;
    return sharpness;
  }
};

// The faces around a vertex that are joined by edges which are not infinitely sharp, counter-clockwise.
class Run {
public:
  Run(const Far::TopologyLevel &level, const std::vector<Value3> &points, int vertex, int face)
      : level_(level), points_(points), vertex_(vertex) {
    int first = face, total = level.GetVertexFaces(vertex).size();
    for (int i = 0; i < total; i++) { // go back to the start of the run
      int before = across(first, edge_of(first, 0));
      if (before == -1) break;
      first = before;
      if (first == face) closed_ = true;
      if (closed_) break;
    }
    for (int at = first, i = 0; at != -1 && i < total; i++) {
      faces_.push_back(at);
      at = across(at, edge_of(at, 1));
      if (at == first) break;
    }
  }

  // Whether two different sharp edges bound the run.
  bool bounded() const { return !closed_ && edge_of(faces_.front(), 0) != edge_of(faces_.back(), 1); }

  // Adds the normal of a face's own two edges at the vertex.
  void add_corner(int face, std::vector<Value3> &out) const {
    add_normal(difference(corner(face, 1), own()), difference(corner(face, -1), own()), out);
  }
  void add_first_corner(std::vector<Value3> &out) const { add_corner(faces_.front(), out); }

  // Adds the normal of a border vertex that has the faces of the run.
  template <Sdc::SchemeType SCHEME> void add_side(std::vector<Value3> &out) const {
    size_t edges = faces_.size() + 1;
    Mask position(edges), mask1(edges), mask2(edges);
    Sdc::Scheme<SCHEME>(Sdc::Options())
        .ComputeVertexLimitMask(BorderVertex{static_cast<int>(faces_.size())}, position, mask1, mask2,
                                Sdc::Crease::RULE_CREASE);
    add_normal(apply<SCHEME>(mask1), apply<SCHEME>(mask2), out);
  }

private:
  int place(int face) const { return level_.GetFaceVertices(face).FindIndex(vertex_); }
  const Value3 &own() const { return points_[static_cast<size_t>(vertex_)]; }
  const Value3 &corner(int face, int further) const {
    auto corners = level_.GetFaceVertices(face);
    int at = (place(face) + further + corners.size()) % corners.size();
    return points_[static_cast<size_t>(corners[at])];
  }

  // The edge of the face that leaves the vertex (side 0) or arrives at it (side 1).
  int edge_of(int face, int side) const {
    auto edges = level_.GetFaceEdges(face);
    return edges[(place(face) + (side ? edges.size() - 1 : 0)) % edges.size()];
  }

  // The other face of an edge, or -1 when the edge is infinitely sharp or has not two faces.
  int across(int face, int edge) const {
    auto faces = level_.GetEdgeFaces(edge);
    if (faces.size() != 2 || Sdc::Crease::IsInfinite(level_.GetEdgeSharpness(edge))) return -1;
    return faces[0] == face ? faces[1] : faces[0];
  }

  template <Sdc::SchemeType SCHEME> Value3 apply(const Mask &mask) const {
    Value3 sum;
    sum.AddWithWeight(own(), mask.vertex);
    for (size_t i = 0; i < faces_.size(); i++) {
      sum.AddWithWeight(corner(faces_[i], 1), mask.edge[i]);
      if (SCHEME == Sdc::SCHEME_CATMARK) sum.AddWithWeight(corner(faces_[i], 2), mask.face[i]);
    }
    sum.AddWithWeight(corner(faces_.back(), -1), mask.edge.back());
    return sum;
  }

  const Far::TopologyLevel &level_;
  const std::vector<Value3> &points_;
  int vertex_;
  std::vector<int> faces_;
  bool closed_ = false;
};

} // namespace

static bool has_semi_sharp(const Far::TopologyLevel &level, int vertex) {
  bool semi = Sdc::Crease::IsSemiSharp(level.GetVertexSharpness(vertex));
  auto edges = level.GetVertexEdges(vertex);
  for (int i = 0; i < edges.size(); i++) semi |= Sdc::Crease::IsSemiSharp(level.GetEdgeSharpness(edges[i]));
  return semi;
}

Oracle::Kind Oracle::kind_of(int vertex) const {
  const Far::TopologyLevel &last = level();
  if (linear_) return Flat;
  if (last.IsVertexNonManifold(vertex)) return NonManifold;
  Sdc::Crease::Rule rule = last.GetVertexRule(vertex);
  if (rule == Sdc::Crease::RULE_CREASE) return Side;
  if (rule == Sdc::Crease::RULE_CORNER) return Corner;
  return last.GetVertexFaces(vertex).size() == 2 ? Valence2 : Smooth;
}

std::vector<Value3> Oracle::normals(int vertex, int face, Kind &kind) const {
  std::vector<Value3> out;
  kind = kind_of(vertex);
  if (kind != Flat && kind != NonManifold && has_semi_sharp(level(), vertex)) {
    int child = next_->refiner_->GetLevel(refiner_->GetMaxLevel()).GetVertexChildVertex(vertex);
    int place = level().GetVertexFaces(vertex).FindIndex(face);
    out = next_->normals(child, next_->level().GetVertexFaces(child)[place], kind);
    // At a corner, and at valence 2, the inner edges turn with each level: use those of this level.
    if (kind != Corner && kind != Amid && kind != Valence2) {
      kind = SemiSharp;
      return out;
    }
    if (kind != Valence2) kind = Corner;
    out.clear();
  }
  if (kind == Smooth) {
    add_normal(tangents1_[static_cast<size_t>(vertex)], tangents2_[static_cast<size_t>(vertex)], out);
    return out;
  }
  Run run(level(), unmoved_, vertex, face);
  if (kind == Flat || kind == NonManifold) run.add_corner(face, out);
  if (kind == Corner && !run.bounded()) kind = Amid;
  if (kind == Amid || kind == Valence2) {
    auto faces = level().GetVertexFaces(vertex);
    for (int i = 0; i < faces.size(); i++) run.add_corner(faces[i], out);
    if (out.size() < static_cast<size_t>(faces.size())) out.clear(); // one of the faces has no normal
  }
  if (kind == Corner) run.add_first_corner(out);
  if (kind != Side && kind != NonManifold) return out;
  if (refiner_->GetSchemeType() == Sdc::SCHEME_LOOP)
    run.add_side<Sdc::SCHEME_LOOP>(out);
  else
    run.add_side<Sdc::SCHEME_CATMARK>(out);
  return out;
}
