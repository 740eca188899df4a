// Soup to points and quad indices, beside OpenSubdiv in the same run. Prints a table, or JSON lines with
// --json; OBJ files may be named as further meshes (each at level 2). Medians of seven runs.
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/stencilTableFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <opensubdiv/osd/cpuEvaluator.h>
#include <opensubdiv/osd/cpuVertexBuffer.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tweend/format.h"

namespace Far = OpenSubdiv::Far;
namespace Osd = OpenSubdiv::Osd;
namespace Sdc = OpenSubdiv::Sdc;

namespace {

constexpr int runs = 7;
bool json = false;

struct Soup {
  std::vector<float> points;
  std::vector<uint32_t> offsets{0}, corners;

  void face(std::initializer_list<uint32_t> face) {
    corners.insert(corners.end(), face);
    offsets.push_back(static_cast<uint32_t>(corners.size()));
  }
  tw_mesh mesh() const {
    tw_mesh mesh;
    tw_mesh_init(&mesh);
    mesh.point_count = static_cast<uint32_t>(points.size() / 3);
    mesh.positions = points.data();
    mesh.face_count = static_cast<uint32_t>(offsets.size() - 1);
    mesh.corner_count = static_cast<uint32_t>(corners.size());
    mesh.face_offsets = offsets.data();
    mesh.corners = corners.data();
    return mesh;
  }
};

// A cube of n x n quads a side, blown up to a bumpy ball. Faces and points in random order when shuffled.
Soup ball(int n, bool triangles, bool shuffled) {
  std::map<std::array<int, 3>, uint32_t> names;
  Soup soup;
  std::mt19937 random(7);
  auto point = [&](std::array<int, 3> p) {
    auto [place, fresh] = names.emplace(p, static_cast<uint32_t>(names.size()));
    if (fresh) {
      double x = 2.0 * p[0] / n - 1, y = 2.0 * p[1] / n - 1, z = 2.0 * p[2] / n - 1;
      double length = std::sqrt(x * x + y * y + z * z), radius = 1 + 0.1 * std::sin(5 * x) * std::cos(4 * y);
      for (double value : {x, y, z}) soup.points.push_back(static_cast<float>(value / length * radius));
    }
    return place->second;
  };
  std::vector<std::array<uint32_t, 4>> quads;
  for (int axis = 0; axis < 3; axis++)
    for (int side = 0; side < 2; side++)
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
          auto at = [&](int u, int v) {
            std::array<int, 3> p{};
            p[static_cast<size_t>(axis)] = side * n;
            p[static_cast<size_t>((axis + 1) % 3)] = u;
            p[static_cast<size_t>((axis + 2) % 3)] = v;
            return point(p);
          };
          std::array<uint32_t, 4> quad{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)};
          if (side == 0) std::swap(quad[1], quad[3]);
          quads.push_back(quad);
        }
  if (shuffled) std::shuffle(quads.begin(), quads.end(), random);
  for (const auto &q : quads) {
    if (!triangles) {
      soup.face({q[0], q[1], q[2], q[3]});
    } else if (random() % 2) {
      soup.face({q[0], q[1], q[2]});
      soup.face({q[0], q[2], q[3]});
    } else {
      soup.face({q[0], q[1], q[3]});
      soup.face({q[1], q[2], q[3]});
    }
  }
  return soup;
}

double seconds(const std::function<void()> &work) {
  auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Timing {
  double median, low, high;
};

Timing measure(const std::function<void()> &work) {
  work();
  std::vector<double> times;
  for (int i = 0; i < runs; i++) times.push_back(seconds(work));
  std::sort(times.begin(), times.end());
  return {times[runs / 2], times.front(), times.back()};
}

// ---- tweend ----------------------------------------------------------------------------------

// Buffers that are used again, as a stream uses its blocks again.
std::vector<float> row_buffer;
std::vector<uint32_t> face_buffer;

void read_share(const tw_surface *surface, unsigned share, unsigned shares) {
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  size_t stride = tw_surface_get_layout(surface)->stride;
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES),
           faces = tw_surface_get_counts(surface)->faces;
  uint64_t first = rows * share / shares, last = rows * (share + 1) / shares;
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, first, static_cast<size_t>(last - first),
                       row_buffer.data() + first * stride);
  first = faces * share / shares;
  last = faces * (share + 1) / shares;
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, first, static_cast<size_t>(last - first), nullptr,
                        face_buffer.data() + 4 * first);
  tw_surface_reader_destroy(reader);
}

void read_all(const tw_surface *surface, unsigned shares) {
  size_t rows = static_cast<size_t>(tw_surface_row_count(surface, TW_DOMAIN_VERTICES));
  size_t need = rows * tw_surface_get_layout(surface)->stride;
  if (row_buffer.size() < need) row_buffer.resize(need);
  size_t corners = static_cast<size_t>(tw_surface_get_counts(surface)->corners);
  if (face_buffer.size() < corners) face_buffer.resize(corners);
  std::vector<std::thread> helpers;
  for (unsigned share = 1; share < shares; share++) helpers.emplace_back(read_share, surface, share, shares);
  read_share(surface, 0, shares);
  for (std::thread &helper : helpers) helper.join();
}

tw_surface *create(const tw_mesh &mesh, unsigned level, bool normals) {
  tw_surface_options options{};
  options.level = level;
  options.normals = normals;
  tw_surface *surface = nullptr;
  tw_error error{};
  if (tw_surface_create(&mesh, &options, &surface, &error) != TW_OK) {
    std::fprintf(stderr, "%s\n", error.detail);
    std::exit(1);
  }
  return surface;
}

Timing time_tweend(const tw_mesh &mesh, unsigned level, bool normals, unsigned threads) {
  return measure([&] {
    tw_surface *surface = create(mesh, level, normals);
    read_all(surface, threads);
    tw_surface_destroy(surface);
  });
}

// ---- OpenSubdiv ------------------------------------------------------------------------------

struct Point {
  float v[3];
  void Clear(void * = nullptr) { v[0] = v[1] = v[2] = 0; }
  void AddWithWeight(const Point &other, float weight) {
    for (int i = 0; i < 3; i++) v[i] += weight * other.v[i];
  }
};

std::unique_ptr<Far::TopologyRefiner> refine(const tw_mesh &mesh, unsigned level, bool full) {
  std::vector<int> sizes(mesh.face_count);
  for (uint32_t f = 0; f < mesh.face_count; f++)
    sizes[f] = static_cast<int>(mesh.face_offsets[f + 1] - mesh.face_offsets[f]);
  Far::TopologyDescriptor d;
  d.numVertices = static_cast<int>(mesh.point_count);
  d.numFaces = static_cast<int>(mesh.face_count);
  d.numVertsPerFace = sizes.data();
  d.vertIndicesPerFace = reinterpret_cast<const int *>(mesh.corners);
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(d, Factory::Options(Sdc::SCHEME_CATMARK, options)));
  Far::TopologyRefiner::UniformOptions uniform(static_cast<int>(level));
  uniform.fullTopologyInLastLevel = full;
  refiner->RefineUniform(uniform);
  return refiner;
}

std::vector<Point> cage_points(const tw_mesh &mesh) {
  std::vector<Point> points(mesh.point_count);
  std::memcpy(points.data(), mesh.positions, points.size() * sizeof(Point));
  return points;
}

std::vector<Point> interpolate(const Far::TopologyRefiner &refiner, std::vector<Point> points) {
  Far::PrimvarRefiner primvar(refiner);
  for (int level = 1; level <= refiner.GetMaxLevel(); level++) {
    std::vector<Point> next(static_cast<size_t>(refiner.GetLevel(level).GetNumVertices()));
    primvar.Interpolate(level, points, next);
    points.swap(next);
  }
  return points;
}

Timing time_opensubdiv(const tw_mesh &mesh, unsigned level, bool normals) {
  return measure([&] {
    auto refiner = refine(mesh, level, normals);
    std::vector<Point> points = interpolate(*refiner, cage_points(mesh));
    if (normals) {
      std::vector<Point> limit(points.size()), t1(points.size()), t2(points.size());
      Far::PrimvarRefiner(*refiner).Limit(points, limit, t1, t2);
    }
    const auto &last = refiner->GetLevel(refiner->GetMaxLevel());
    std::vector<int> faces(static_cast<size_t>(4 * last.GetNumFaces()));
    for (int f = 0; f < last.GetNumFaces(); f++)
      std::memcpy(&faces[static_cast<size_t>(4 * f)], &last.GetFaceVertices(f)[0], 4 * sizeof(int));
  });
}

// ---- reports ---------------------------------------------------------------------------------

double millions(double count, double time) {
  return count / time / 1e6;
}

void header() {
  if (!json)
    std::printf("%-34s %10s %12s %12s %12s %8s %8s\n", "Mfaces/s (medians)", "faces", "tweend", "2 threads",
                "OpenSubdiv", "ratio", "2 thr.");
}

void compare(const std::string &name, const Soup &soup, unsigned level, bool normals) {
  tw_mesh mesh = soup.mesh();
  tw_surface_options options{};
  options.level = level;
  tw_surface_counts counts;
  tw_surface_count(&mesh, &options, &counts, nullptr);
  double faces = static_cast<double>(counts.faces);
  Timing one = time_tweend(mesh, level, normals, 1), two = time_tweend(mesh, level, normals, 2);
  Timing osd = time_opensubdiv(mesh, level, normals);
  std::string label = name + " level " + std::to_string(level) + (normals ? ", normals" : "");
  if (json)
    std::printf("{\"case\":\"%s\",\"faces\":%.0f,\"tweend_s\":[%g,%g,%g],\"tweend_2_s\":[%g,%g,%g],"
                "\"opensubdiv_s\":[%g,%g,%g]}\n",
                label.c_str(), faces, one.low, one.median, one.high, two.low, two.median, two.high, osd.low,
                osd.median, osd.high);
  else
    std::printf("%-34s %10.0f %12.1f %12.1f %12.1f %8.1f %8.1f   (spread %.0f%% %.0f%% %.0f%%)\n",
                label.c_str(), faces, millions(faces, one.median), millions(faces, two.median),
                millions(faces, osd.median), osd.median / one.median, osd.median / two.median,
                100 * (one.high - one.low) / one.median, 100 * (two.high - two.low) / two.median,
                100 * (osd.high - osd.low) / osd.median);
  std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv) {
  std::vector<std::string> files;
  std::string only;
  for (int i = 1; i < argc; i++) {
    if (std::strcmp(argv[i], "--json") == 0)
      json = true;
    else if (std::strncmp(argv[i], "--only=", 7) == 0)
      only = argv[i] + 7;
    else
      files.push_back(argv[i]);
  }
  struct Case {
    const char *name;
    Soup soup;
    std::vector<unsigned> levels;
  };
  std::vector<Case> cases;
  cases.push_back({"cube", ball(1, false, false), {6, 8, 9}});
  cases.push_back({"486 quads", ball(9, false, true), {4, 5}});
  cases.push_back({"31,104 quads", ball(72, false, true), {3, 4}});
  cases.push_back({"69,312 triangles", ball(76, true, true), {1, 2}});
  header();
  for (const Case &c : cases)
    for (unsigned level : c.levels)
      if (only.empty() || std::string(c.name).find(only) != std::string::npos)
        compare(c.name, c.soup, level, false);
  for (const Case &c : cases)
    if (only.empty() || std::string(c.name).find(only) != std::string::npos)
      compare(c.name, c.soup, c.levels.back(), true);
  for (const std::string &file : files) {
    std::ifstream in(file, std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    tw_model *model = nullptr;
    tw_error error{};
    if (tw_obj_read(reinterpret_cast<const uint8_t *>(text.data()), text.size(), &model, &error) != TW_OK) {
      std::fprintf(stderr, "%s: line %llu: %s\n", file.c_str(), static_cast<unsigned long long>(error.line),
                   error.detail);
      return 1;
    }
    const tw_mesh &mesh = model->meshes[0];
    Soup soup;
    soup.points.assign(mesh.positions, mesh.positions + 3 * mesh.point_count);
    soup.offsets.assign(mesh.face_offsets, mesh.face_offsets + mesh.face_count + 1);
    soup.corners.assign(mesh.corners, mesh.corners + mesh.corner_count);
    compare(file, soup, 2, false);
    tw_model_destroy(model);
  }
  return 0;
}
