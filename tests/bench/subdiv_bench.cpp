// Subdivision compared with OpenSubdiv in the same run: from polygon soup to points and indices, the cost of
// limit normals, and new positions on a known topology. All on one thread.
// usage: subdiv_bench [--only=NAME] [--json=FILE] [OBJ...]   an OBJ file is added at levels 1 to 3
//        subdiv_bench --print-ball=N                          prints a cage of 6 N N quads as OBJ, or
//        subdiv_bench --print-isosurface=N, --print-character=N   one of those of soups.hpp
//        subdiv_bench --peer OBJ LEVEL    prints the seconds of OpenSubdiv with limit tangents
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <string>

#include "opensubdiv_peer.hpp"
#include "report.h"
#include "soups.hpp"
#include "timing.hpp"
#include "tweend/subdiv.h"

namespace {

Soup unskinned(Soup soup) {
  soup.joints.clear();
  soup.weights.clear();
  return soup;
}

struct Case {
  std::string name;
  Soup soup;
  std::vector<unsigned> levels;
  tw_scheme scheme = TW_CATMULL_CLARK;
};

// ---- tweend ----------------------------------------------------------------------------------

// Buffers that are reused, as a stream reuses its blocks.
std::vector<float> row_buffer;
std::vector<uint32_t> face_buffer;

void read_all(const tw_surface *surface, bool faces) {
  size_t rows = static_cast<size_t>(tw_surface_row_count(surface, TW_DOMAIN_VERTICES));
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  row_buffer.resize(std::max(row_buffer.size(), rows * tw_surface_get_layout(surface)->stride));
  face_buffer.resize(std::max(face_buffer.size(), static_cast<size_t>(counts->corners)));
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, rows, row_buffer.data());
  if (faces)
    tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, static_cast<size_t>(counts->faces), nullptr,
                          face_buffer.data());
  tw_surface_reader_destroy(reader);
}

[[noreturn]] void give_up(const tw_error &error) {
  std::fprintf(stderr, "%s\n", error.detail);
  std::exit(1);
}

tw_surface *create(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals, bool movable) {
  tw_surface_options options{};
  options.scheme = scheme;
  options.level = level;
  options.normals = normals;
  options.movable = movable;
  tw_surface *surface = nullptr;
  tw_error error{};
  if (tw_surface_create(&mesh, &options, &surface, &error) != TW_OK) give_up(error);
  return surface;
}

void subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals) {
  tw_surface *surface = create(mesh, scheme, level, normals, false);
  read_all(surface, true);
  tw_surface_destroy(surface);
}

Timing move(const tw_surface *known, const float *positions) {
  return measure([&] {
    tw_surface *surface = nullptr;
    if (tw_surface_with_positions_by(known, positions, nullptr, &surface) != TW_OK) std::exit(1);
    read_all(surface, false);
    tw_surface_destroy(surface);
  });
}

// ---- reports ---------------------------------------------------------------------------------

void compare(bench_report &report, const Case &c, unsigned level) {
  tw_mesh mesh = c.soup.mesh();
  std::vector<float> positions = c.soup.moved();
  auto [points, normals] = measure_by_turns([&] { subdivide(mesh, c.scheme, level, false); },
                                            [&] { subdivide(mesh, c.scheme, level, true); });
  Timing points_peer = opensubdiv::subdivide(mesh, c.scheme, level, false);
  Timing normals_peer = opensubdiv::subdivide(mesh, c.scheme, level, true);
  tw_surface *known = create(mesh, c.scheme, level, false, true);
  double faces = static_cast<double>(tw_surface_get_counts(known)->faces) / 1e6;
  Timing again = move(known, positions.data());
  tw_surface_destroy(known);

  auto row = [&](const char *name, const Timing &ours, const char *peer_name, const Timing &peer) {
    auto rate = [&](const Timing &t) {
      return bench_timing{faces / t.median, faces / t.high, faces / t.low};
    };
    bench_row(&report, name, "Mfaces/s", rate(ours), peer_name, rate(peer), true);
  };
  bench_scene(&report, "%s, level %u", c.name.c_str(), level);
  row("points and indices", points, "OpenSubdiv", points_peer);
  row("and limit normals", normals, "OpenSubdiv", normals_peer);
  row("and limit normals", normals, "without them", points);
  row("new positions on a plan", again, "from the start", points);
}

int print_peer(const char *obj, const char *level) {
  Soup soup = read_obj(obj);
  Timing peer =
      opensubdiv::subdivide(soup.mesh(), TW_CATMULL_CLARK, static_cast<unsigned>(std::atoi(level)), true);
  return std::printf("%g %.0f%%\n", peer.median, 100 * peer.spread()) < 0;
}

int print_obj(const Soup &soup) {
  for (size_t i = 0; i < soup.points.size(); i += 3)
    std::printf("v %.9g %.9g %.9g\n", static_cast<double>(soup.points[i]),
                static_cast<double>(soup.points[i + 1]), static_cast<double>(soup.points[i + 2]));
  for (size_t i = 0; i < soup.uvs.size(); i += 2)
    std::printf("vt %.9g %.9g\n", static_cast<double>(soup.uvs[i]), static_cast<double>(soup.uvs[i + 1]));
  for (size_t f = 0; f + 1 < soup.offsets.size(); f++) {
    std::printf("f");
    for (uint32_t i = soup.offsets[f]; i < soup.offsets[f + 1]; i++) {
      std::printf(" %u", soup.corners[i] + 1);
      if (!soup.uvs.empty()) std::printf("/%u", soup.uv_corners[i] + 1);
    }
    std::printf("\n");
  }
  for (size_t i = 0; i < soup.crease_sharpness.size(); i++)
    std::printf("t crease 2/1/0 %u %u %g\n", soup.creases[2 * i], soup.creases[2 * i + 1],
                static_cast<double>(soup.crease_sharpness[i]));
  return std::ferror(stdout) != 0;
}

} // namespace

int main(int argc, char **argv) {
#ifdef __GLIBC__
  mallopt(M_TRIM_THRESHOLD,
          32 << 20); /* as the daemon does, which does not give memory back after each surface */
#endif
  if (argc == 4 && std::strcmp(argv[1], "--peer") == 0) return print_peer(argv[2], argv[3]);
  std::string only;
  const char *json = nullptr;
  std::vector<Case> cases = {{"cube", ball(1, false), {6, 8, 9}},
                             {"486 quads", ball(9, true), {4, 5}},
                             {"31,104 quads", ball(72, true), {3, 4}},
                             {"isosurface", isosurface(72), {1, 2, 3}},
                             {"large isosurface", isosurface(149), {1, 2, 3}},
                             {"isosurface, Loop", isosurface(72), {1, 2, 3}, TW_LOOP},
                             {"character", unskinned(character(26)), {1, 2, 3, 5}},
                             {"skinned character", character(26), {1, 2, 3}}};
  for (int i = 1; i < argc; i++) {
    if (std::strncmp(argv[i], "--only=", 7) == 0)
      only = argv[i] + 7;
    else if (std::strncmp(argv[i], "--json=", 7) == 0)
      json = argv[i] + 7;
    else if (std::strncmp(argv[i], "--print-ball=", 13) == 0)
      return print_obj(ball(std::atoi(argv[i] + 13), false));
    else if (std::strncmp(argv[i], "--print-isosurface=", 19) == 0)
      return print_obj(isosurface(std::atoi(argv[i] + 19)));
    else if (std::strncmp(argv[i], "--print-character=", 18) == 0)
      return print_obj(character(std::atoi(argv[i] + 18)));
    else
      cases.push_back(
          {std::filesystem::path(argv[i]).stem(), read_obj(argv[i]), {1, 2, 3}, TW_CATMULL_CLARK});
  }
  bench_report report;
  bench_open(&report, json);
  for (const Case &c : cases)
    for (unsigned level : c.levels)
      if (c.name.find(only) != std::string::npos) compare(report, c, level);
  bench_close(&report);
  return 0;
}
