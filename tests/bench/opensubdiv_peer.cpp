#include "opensubdiv_peer.hpp"

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

namespace Far = OpenSubdiv::Far;
namespace Sdc = OpenSubdiv::Sdc;

namespace {

template <int WIDTH> struct Row {
  float v[WIDTH];
  void Clear(void * = nullptr) { std::fill(v, v + WIDTH, 0.0F); }
  void AddWithWeight(const Row &other, float weight) {
    for (int i = 0; i < WIDTH; i++) v[i] += weight * other.v[i];
  }
};
using Point = Row<3>;
using Uv = Row<2>;

using Refiner = std::unique_ptr<Far::TopologyRefiner>;

Refiner refine(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool full) {
  std::vector<int> sizes(mesh.face_count);
  for (uint32_t f = 0; f < mesh.face_count; f++)
    sizes[f] = static_cast<int>(mesh.face_offsets[f + 1] - mesh.face_offsets[f]);
  Far::TopologyDescriptor d;
  d.numVertices = static_cast<int>(mesh.point_count);
  d.numFaces = static_cast<int>(mesh.face_count);
  d.numVertsPerFace = sizes.data();
  d.vertIndicesPerFace = reinterpret_cast<const int *>(mesh.corners);
  d.numCreases = static_cast<int>(mesh.crease_count);
  d.creaseVertexIndexPairs = reinterpret_cast<const int *>(mesh.crease_edges);
  d.creaseWeights = mesh.crease_sharpness;
  Far::TopologyDescriptor::FVarChannel uvs; // so that the refiner keeps their seams
  uvs.numValues = static_cast<int>(mesh.uv_sets[0].value_count);
  uvs.valueIndices = reinterpret_cast<const int *>(mesh.uv_sets[0].corners);
  d.numFVarChannels = mesh.uv_set_count > 0 ? 1 : 0;
  d.fvarChannels = &uvs;
  Sdc::Options options;
  options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_CORNERS_ONLY);
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  Sdc::SchemeType type = scheme == TW_LOOP ? Sdc::SCHEME_LOOP : Sdc::SCHEME_CATMARK;
  Refiner refiner(Factory::Create(d, Factory::Options(type, options)));
  Far::TopologyRefiner::UniformOptions uniform(static_cast<int>(level));
  uniform.fullTopologyInLastLevel = full;
  refiner->RefineUniform(uniform);
  return refiner;
}

std::vector<Point> points_of(const float *positions, uint32_t count) {
  std::vector<Point> points(count);
  std::memcpy(points.data(), positions, points.size() * sizeof(Point));
  return points;
}

} // namespace

namespace opensubdiv {

Timing subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals) {
  size_t face_size = scheme == TW_LOOP ? 3 : 4;
  return measure([&] {
    Refiner refiner = refine(mesh, scheme, level, normals);
    Far::PrimvarRefiner primvar(*refiner);
    std::vector<Point> points = points_of(mesh.positions, mesh.point_count);
    for (int l = 1; l <= refiner->GetMaxLevel(); l++) {
      std::vector<Point> next(static_cast<size_t>(refiner->GetLevel(l).GetNumVertices()));
      primvar.Interpolate(l, points, next);
      points.swap(next);
    }
    if (mesh.uv_set_count > 0) {
      std::vector<Uv> uvs(mesh.uv_sets[0].value_count);
      std::memcpy(uvs.data(), mesh.uv_sets[0].values, uvs.size() * sizeof(Uv));
      for (int l = 1; l <= refiner->GetMaxLevel(); l++) {
        std::vector<Uv> next(static_cast<size_t>(refiner->GetLevel(l).GetNumFVarValues(0)));
        primvar.InterpolateFaceVarying(l, uvs, next, 0);
        uvs.swap(next);
      }
    }
    if (normals) {
      std::vector<Point> limit(points.size()), t1(points.size()), t2(points.size());
      primvar.Limit(points, limit, t1, t2);
    }
    const auto &last = refiner->GetLevel(refiner->GetMaxLevel());
    size_t count = static_cast<size_t>(last.GetNumFaces());
    std::vector<int> faces(face_size * count);
    for (size_t f = 0; f < count; f++)
      std::memcpy(&faces[face_size * f], &last.GetFaceVertices(static_cast<int>(f))[0],
                  face_size * sizeof(int));
  });
}

} // namespace opensubdiv
